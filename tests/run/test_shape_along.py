"""Runs say where surfaces along the rail are no parabola within a patch, on which wheel and how often."""

import math

import numpy as np
import pandas as pd
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC
from wrcore.contact.search import reduction
from wrcore.run.checks.shape_along import NAME, ROUGH, ShapesAlong

RADIUS, DEPTH = 0.46, 6e-5
FLAT = {"flats": [{"length": 0.03, "depth": 3e-4, "at": 0.6}], "angle": 0.0}
POLYGON = {"polygon": [{"order": 3, "amplitude": 3e-4}], "angle": 0.0}
SIZES = {"wheel.profile": "cone:1/20", "rail.profile": "circle:0.3", "rail.inclination": 0}


def scene_of(shape=None, **changes):
    out_of_round = {"wheel.left.out_of_round": shape} if shape else {}
    return wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml", {**SIZES, **out_of_round, **changes})


def patches_at(s, half=6e-3):
    """A patch of each wheel of a wheelset, straight and in the middle, at arc lengths (n,), m."""
    rows = np.full((len(s), 1, 2, reduction.MAX_PATCHES, reduction.PATCH_COLUMNS), np.nan)
    rows[:, :, :, 0, reduction.NORMAL], rows[:, :, :, 0, reduction.SEMI_A] = 5e4, half
    rows[:, :, :, 0, reduction.PENETRATION] = DEPTH
    rows[:, :, :, 0, [reduction.U_WHEEL, reduction.U_RAIL, reduction.X]] = 0.0
    return rows


def rough_at(scene, s, side=0, **how):
    return ShapesAlong(scene).rough(side, patches_at(s, **how)[:, 0, side], s, np.zeros(len(s)))[:, 0]


def test_patches_over_a_flat_are_rough_and_others_are_not():
    """The flat of 30 mm touches at 0.6 rad and at a turn more; the wheel is round at the beginning."""
    s = RADIUS * (0.6 + 2.0 * math.pi * np.array([1.0, 1.5, 2.0])) + np.linspace(-0.05, 0.05, 101)[:, None]
    flagged = rough_at(scene_of(FLAT), s.T.ravel()).reshape(3, -1)
    away = np.abs(np.linspace(-0.05, 0.05, 101)) > 0.03
    assert flagged[[0, 2]].sum(axis=1).min() > 10 and not flagged[[0, 2]][:, away].any() and not flagged[1].any()
    assert (flagged[0] == flagged[2]).all()
    assert not rough_at(scene_of(FLAT), np.array([0.0, 0.01])).any()


def test_patches_on_a_long_wave_are_not_rough():
    assert not rough_at(scene_of(POLYGON), np.linspace(0.0, 6.0, 301)).any()


def test_a_wave_of_48_mm_is_rough_from_some_tenths_of_a_millimetre_on():
    """Over 6 mm a wave leaves its own parabola by (k x)^4/24 of its amplitude, 1.6 %: 5 % of 0.06 mm are 0.2 mm."""
    s = RADIUS * 2.0 * math.pi * (1.0 + np.arange(0.0, 0.1, 1e-3))
    small, large = ({"polygon": [{"order": 60, "amplitude": a}], "angle": 0.0} for a in (5e-6, 4e-4))
    assert not rough_at(scene_of(small), s).any() and rough_at(scene_of(large), s).all()


def test_misfit_is_that_of_the_gap_from_its_parabola():
    """A quartic bump of the wheel: what leaves a parabola fitted by least squares with the weights of runs."""
    scene = scene_of(FLAT)
    shapes = ShapesAlong(scene)
    rows = patches_at(np.zeros(1))[0, 0, 0, :1]

    def bump(s, below, x, u_rail, u_wheel, radii):
        return -3e3 * x**4

    (off,) = shapes._misfits(0, rows, np.zeros(1), np.zeros(1), bump)
    w, half = 5.5e-3, 6e-3
    x = np.linspace(-w, w, 20001)
    weight, gap = (1.0 - (x / w) ** 2) ** 2, -3e3 * x**4
    c2, c0 = np.polyfit(x**2, gap, 1, w=np.sqrt(weight))
    inside = np.linspace(-half, half, 20001)
    expected = np.abs(-3e3 * inside**4 - c0 - c2 * inside**2).max() / DEPTH
    assert off == pytest.approx(expected, rel=0.05) and off > 0.005


def test_patches_over_a_joint_and_on_short_corrugation_are_rough():
    joint = scene_of(**{"wheel.profile": "S1002", "rail.profile": "60E1",
                        "track.crossing": {"slices": "joint:0.01", "at": 5.0, "rail": "both"}})  # fmt: skip
    s = np.array([4.5, 4.9, 5.0, 5.1, 5.5])
    assert rough_at(joint, s).tolist() == [False, False, True, False, False]
    waves = {"begin": 1.0, "length": 10.0, "fade": 0.5, "rail": "left"}
    for amplitude, wavelength, rough in ((4e-5, 0.03, True), (4e-5, 0.5, False)):
        scene = scene_of(**{"track.corrugation": waves | {"amplitude": amplitude, "wavelength": wavelength}})
        along = np.linspace(4.0, 5.0, 101)
        assert rough_at(scene, along).any() == rough and not rough_at(scene, along, side=1).any()


def test_run_over_a_flat_counts_and_names_the_wheel(capsys):
    """At 20 m/s the wheel comes round every 0.145 s; the flat at 0.6 rad touches first as it goes over into it."""
    flat = {"flats": [{"length": 0.03, "depth": 1e-4, "at": 4.0}], "angle": 0.0}
    found = {}
    for name, shape in (("flat", flat), ("polygon", {"polygon": [{"order": 3, "amplitude": 1e-4}]})):
        scene = scene_of(shape, speed=20.0, integration__duration=0.11, output__rate=1000, contact__creep__model="she")
        found[name] = wr.simulate(scene, progress=False).counters
        said = capsys.readouterr().err
        assert ("no parabola within patches of wheelset_left at" in said) == (name == "flat")
    times = found["flat"][f"{NAME}_wheelset_left"]
    assert 1 <= times <= 4 and found["flat"][NAME] == times and f"{NAME}_wheelset_right" not in found["flat"]
    assert found["polygon"][NAME] == 0 and ROUGH == 0.05


@pytest.mark.parametrize(
    "patch",
    [
        "maximum",
        "surrogate",
        pytest.param("exact", marks=pytest.mark.check),
        pytest.param("tabulated", marks=pytest.mark.check),
    ],
)
def test_run_over_a_short_bump_is_flagged_with_each_patch_model(tmp_path, patch):
    """A bump of 50 um, 4 mm wide at half its height: the patch lies on it for a few outputs of 0.1 ms."""
    angles = np.arange(0.0, 2.0 * math.pi, 1e-3)
    bump = 5e-5 * np.exp(-0.5 * ((angles - 4.0) * RADIUS / 1.7e-3) ** 2)
    table = pd.DataFrame({"angle_rad": angles, "deviation_m": bump})
    table.to_csv(tmp_path / "bump.csv", index=False)
    changes = {
        "wheel.left.out_of_round": {"table": str(tmp_path / "bump.csv"), "angle": 0.0}, "contact.patch": patch,
        "speed": 20.0, "integration.duration": 0.095, "output.rate": 1e4,
    }  # fmt: skip
    run = wr.simulate(wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml", changes), progress=False)
    assert run.status == "completed" and run.counters[f"{NAME}_wheelset_left"] > 3
