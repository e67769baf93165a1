"""Limits of validity: each is counted where it is exceeded, and only there."""

import numpy as np
import pytest

from tests.conftest import ELLIPTIC, SCENES
from wrcore.cli import main
from wrcore.contact.search import reduction
from wrcore.run.checks.validity import LIMITS, LOOK_UP_ERRORS, WIDEST, WIDEST_TURN, exceeded, look_up_errors
from wrcore.run.simulate import simulate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

RADIUS = 0.3


@pytest.fixture(scope="module")
def contact():
    """Contact model of a cone on a circular rail head of `RADIUS`: curvatures are known everywhere."""
    changes = {"wheel.profile": "cone:1/20", "rail.profile": f"circle:{RADIUS}", "rail.inclination": 0}
    return compile_scene(load_scene(SCENES / "wheelset.yaml", changes | {"contact.creep.model": "she"}))[0].contact


def patch(u_wheel=0.0, u_rail=0.0, width=1e-3, angle=0.0):
    """Patches of one wheelset at one time, one of them on the left wheel."""
    rows = np.full((1, 1, 2, reduction.MAX_PATCHES, reduction.PATCH_COLUMNS), np.nan)
    row = rows[0, 0, 0, 0]
    row[reduction.NORMAL], row[reduction.SEMI_B], row[reduction.ANGLE] = 1e4, width, angle
    row[reduction.U_WHEEL], row[reduction.U_RAIL] = u_wheel, u_rail
    return rows


def counts(contact, rows, roll=0.0, yaw=0.0):
    found = exceeded(contact, rows, np.array([[roll]]), np.array([[yaw]]))
    return {name for name, count in found.items() if count and name != "patches"}


def test_an_ordinary_patch_exceeds_nothing(contact):
    assert counts(contact, patch()) == set()
    assert exceeded(contact, patch(), np.zeros((1, 1)), np.zeros((1, 1)))["patches"] == 1


def test_half_space(contact):
    assert counts(contact, patch(width=0.99 * WIDEST * RADIUS)) <= {"profile_edge"}
    assert "half_space" in counts(contact, patch(width=1.01 * WIDEST * RADIUS))


def test_profile_edges(contact):
    rail, wheel = contact.geometry.rail_start, contact.geometry.wheel_start
    for place in ({"u_rail": rail}, {"u_wheel": wheel}):
        ((name, end),) = place.items()
        assert counts(contact, patch(**{name: end + 1.01e-3})) == set()
        assert counts(contact, patch(**{name: end + 0.99e-3})) == {"profile_edge"}
        # the patch is inclined: it reaches less far across
        assert counts(contact, patch(**{name: end + 0.6e-3}, angle=np.pi / 3)) == set()


def test_search_fallback_counts_both_wheels_of_a_turned_wheelset(contact):
    for roll, yaw in ((0.013, 0.0), (0.0, 0.016)):  # the search's own limits: 12 mrad of roll, 15 mrad of yaw
        turned = exceeded(contact, patch(), np.array([[roll]]), np.array([[yaw]]))
        assert turned["search_fallback"] == 2
        assert counts(contact, patch(), 0.9 * roll, 0.9 * yaw) == set()
    planar = contact._replace(detection=0)
    assert counts(planar, patch(), yaw=0.016) == set()


def test_conformal_patches_lie_in_hollows_of_the_wheel():
    scene = load_scene(SCENES / "wheelset.yaml", {"contact.creep.model": "she"})
    contact = compile_scene(scene)[0].contact
    root = flank = corner = -0.037  # EN 13715: the root of the S1002 flange is an arc of 13 mm, UIC 60's corner, too
    flank -= 0.005  # the flange's flank bulges with 20 mm
    width = 0.5 * WIDEST_TURN * 0.013
    assert counts(contact, patch(root, corner, 1.01 * width)) == {"conformal"}
    assert counts(contact, patch(root, corner, 0.99 * width)) == set()
    assert counts(contact, patch(flank, corner, 1.01 * width)) == set()


def test_counters_of_a_run_and_what_the_command_says(tmp_path, capsys):
    calm = simulate(ELLIPTIC / "suspended_wheelset.yaml", integration__duration=0.5, contact__creep__model="she")
    assert all(calm.counters[name] == 0 for name in LIMITS) and calm.counters["patches"] >= 2 * len(calm.t)
    sets = ["--set=integration.duration=0.05", "--set=initial.yaw=0.02", "--set=contact.creep.model=she"]
    assert main(["simulate", str(SCENES / "wheelset.yaml"), *sets]) == 0
    printed = capsys.readouterr().out
    assert "beyond the models' limits" in printed and LIMITS["search_fallback"] in printed
    assert main(["simulate", str(ELLIPTIC / "suspended_wheelset.yaml"), *sets[::2]]) == 0
    assert "limits" not in capsys.readouterr().out


def test_a_yawed_wheel_is_hollow_along_the_rail_beyond_33_mrad():
    contact = compile_scene(load_scene(SCENES / "wheelset.yaml", {"contact.creep.model": "she"}))[0].contact
    steep = -0.0382  # the root's arc of 13 mm next to the flank of 70 degrees
    assert counts(contact, patch(steep, -0.03), yaw=0.030) <= {"search_fallback"}
    assert "hollow_ahead" in counts(contact, patch(steep, -0.03), yaw=0.040)
    assert "hollow_ahead" not in counts(contact._replace(detection=0), patch(steep, -0.03), yaw=0.040)


def test_both_flanges_on_the_rails(contact):
    rows = patch(angle=0.9)
    rows[0, 0, 1, 0] = rows[0, 0, 0, 0]
    assert counts(contact, rows) == set()  # both contact planes lean to the left
    rows[0, 0, 1, 0, reduction.ANGLE] = -0.9
    assert counts(contact, rows) == {"both_flanges"}
    changes = {"initial": {"y": 0.0}, "integration": {"duration": 0.02}, "contact": {"creep": {"model": "she"}}}
    for gauge in (1.42, 1.35):  # on both flanks, on the tips of both flanges
        tight = simulate(SCENES / "wheelset.yaml", track={"gauge": gauge}, **changes)
        assert tight.counters["both_flanges"] == len(tight.t)


def test_look_up_errors_without_output_times_are_zero(contact):
    """A piece of a run may hold no output time."""
    looked_up = contact._replace(strips=contact.strips._replace(looked_up=0.3))
    none = np.zeros((0, 1, 2, reduction.MAX_PATCHES, reduction.PATCH_COLUMNS))
    assert look_up_errors(looked_up, none) == dict.fromkeys(LOOK_UP_ERRORS, 0.0)
