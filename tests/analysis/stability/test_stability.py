"""Names of modes, root locus and critical speeds."""

import math

import numpy as np
import pytest

from tests.conftest import ELLIPTIC, ROOT
from wrcore.analysis.stability.modes import families, linear_modes, shape_table
from wrcore.analysis.stability.stability import (
    at_speed,
    critical_speed,
    growth,
    root_locus,
    steady_motion,
    straight_ahead,
)
from wrcore.balance.linear import DIRECTIONS
from wrcore.errors import InputError
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene


@pytest.fixture(scope="module")
def trailer():
    scene = load_scene(ELLIPTIC / "trailer_vehicle.yaml", ["initial.y=0.0"])
    return scene.vehicle, *compile_scene(scene)


@pytest.fixture(scope="module")
def suspended():
    scene = load_scene(ELLIPTIC / "suspended_wheelset.yaml", ["initial.y=0.0"])
    return scene.vehicle, *compile_scene(scene)


def test_families(trailer):
    assert families(trailer[0]) == {"car body": [0], "bogie": [1, 2], "wheelset": [3, 4, 5, 6]}


@pytest.mark.parametrize("speed", [10.0, 20.0, 50.0, 80.0, 110.0])
def test_a_bogie_vehicle_has_the_modes_that_its_bodies_make(trailer, speed):
    """Seven bodies: six modes of the car body, six of each bogie, and per wheelset bounce and roll on the contacts.

    The two lateral and yaw motions of a bogie against its wheelsets leave two hunting modes at any speed.
    """
    vehicle, model, state = trailer
    linear = steady_motion(model, state, speed)
    table, shapes, _ = linear_modes(vehicle, linear)
    count = table["name"].value_counts()
    for name in ("lower sway", "upper sway", "bounce", "pitch", "yaw", "surge"):
        assert count[f"car body {name}"] == 1
    for name in ("bounce", "roll", "pitch"):
        assert count[f"bogie {name}, in phase"] == count[f"bogie {name}, in antiphase"] == 1
    for name in ("bounce", "roll"):
        assert table["name"].str.startswith(f"wheelset contact {name}").sum() == 4
    assert table["name"].str.contains("hunting").sum() == 2
    assert table["name"].str.startswith("wheelset spin creep").sum() == 4
    assert (table["name"] == "series damper").sum() == 14  # that many dampers are in series with springs
    assert not (table["name"] == "neutral").any()
    named = table.set_index("name")
    assert named.loc["car body lower sway", "frequency_Hz"] < named.loc["car body upper sway", "frequency_Hz"]

    # the table holds every eigenvalue once, pairs as one row
    pairs = (table["imag_rad_per_s"] > 0.0).sum()
    assert len(table) + pairs == len(linear.matrix)
    assert np.abs(shapes).max(axis=(1, 2)) == pytest.approx(1.0)
    ratio = -table["real_per_s"] / np.hypot(table["real_per_s"], table["imag_rad_per_s"])
    np.testing.assert_allclose(table["damping_ratio"], ratio, rtol=1e-12)


@pytest.mark.parametrize("name", ["freight_wagon_empty", "freight_wagon_laden"])
def test_a_two_axle_wagon_pitches_with_its_body(name):
    """Its wheelsets spin to and fro with it: no name for what has nine tenths of its energy in the car body."""
    scene = load_scene(ELLIPTIC / f"{name}.yaml", ["initial.y=0.0"])
    table, _, energies = linear_modes(scene.vehicle, steady_motion(*compile_scene(scene), 30.0))
    k = table.index[table["name"] == "car body pitch"]
    assert len(k) == 1 and energies[k[0], 0, DIRECTIONS.index("pitch")] > 0.9
    assert not table["name"].str.startswith("wheelset pitch").any()


def test_lower_sway_turns_about_a_pole_below_the_centre_of_mass(trailer):
    """A point h above the centre moves by y - h roll: it rests at h = y/roll."""
    vehicle, model, state = trailer
    table, shapes, _ = linear_modes(vehicle, steady_motion(model, state, 20.0))
    poles = {}
    for name in ("lower sway", "upper sway"):
        shape = shapes[table.index[table["name"] == f"car body {name}"][0], 0]
        poles[name] = np.real(shape[DIRECTIONS.index("y")] / shape[DIRECTIONS.index("roll")])
    assert poles["lower sway"] < 0.0 < poles["upper sway"]


def test_shape_table(suspended):
    vehicle, model, state = suspended
    table, shapes, _ = linear_modes(vehicle, steady_motion(model, state, 40.0))
    rows = shape_table(vehicle, table, shapes)
    k = table.index[table["name"] == "wheelset hunting"][0]
    row = rows[(rows["mode"] == k) & (rows["coordinate"] == "yaw")].iloc[0]
    assert row["amplitude"] * np.exp(1j * row["phase_rad"]) == pytest.approx(shapes[k, 0, 5])
    assert list(rows["name"].unique()) == list(table["name"])


def test_free_wheelset_hunts_at_klingel_s_frequency():
    """f = V/(2 pi) sqrt(conicity/(r e)) (Klingel 1883) of a slender cone; the wheelset's roll takes off half a percent.

    S. l. Wickens (2003), chapter 2: the conicity of a cone is its slope g (b + R g)/(b - r g) on rails of radius R.
    """
    scene = load_scene({
        "name": "cone", "speed": 5.0, "contact": {"creep": {"model": "linear"}},
        "vehicle": {"parameters": str(ROOT / "config/vehicles/wheelset.yaml")},
        "wheel": {"profile": "cone:1/100"}, "rail": {"profile": "circle:0.3"},
    })  # fmt: skip
    model, state = compile_scene(scene)
    table, _, _ = linear_modes(scene.vehicle, steady_motion(model, state, 5.0))
    slope, radius = 0.01, 0.46
    b = scene.track.rail_distance(scene.rail) - 0.3 * math.sin(math.atan(slope))
    conicity = slope * (b + 0.3 * slope) / (b - radius * slope)
    klingel = 5.0 / (2.0 * math.pi) * math.sqrt(conicity / (radius * b))
    hunting = table[table["name"] == "wheelset hunting"].iloc[0]
    assert hunting["frequency_Hz"] == pytest.approx(klingel, rel=0.01)
    assert hunting["real_per_s"] > 0.0  # nothing holds it: unstable at every speed
    assert (table["name"] == "neutral").sum() == 2  # its place along the track, and its speed


def test_critical_speed_is_where_the_largest_real_part_changes_sign(suspended):
    vehicle, model, state = suspended
    found = critical_speed(vehicle, model, state, [30.0, 50.0, 70.0, 90.0], 1e-4)
    speed = found["critical_speed_m_per_s"]
    assert growth(steady_motion(model, state, speed - 0.01)) < 0.0 < growth(steady_motion(model, state, speed + 0.01))
    assert found["mode"] == "wheelset hunting"
    assert found["wavelength_m"] == pytest.approx(speed / found["frequency_Hz"])
    assert critical_speed(vehicle, model, state, [30.0, 40.0])["critical_speed_m_per_s"] == math.inf
    assert critical_speed(vehicle, model, state, [70.0, 80.0])["critical_speed_m_per_s"] == -math.inf


def test_no_steady_motion_is_told(suspended):
    vehicle, model, state = suspended
    with pytest.raises(InputError, match="straight ahead"):
        steady_motion(model, state + 0.02 * (np.arange(13) == 2), 20.0)  # 20 mm above the rails, pressed down


def test_where_a_scene_starts_is_of_no_influence(suspended):
    _, model, state = suspended  # in steady running, where a run begins
    (_, centred), (aside, there) = (
        straight_ahead(load_scene(ELLIPTIC / "suspended_wheelset.yaml", [f"initial.y={y}"])) for y in (0.0, 0.003)
    )
    np.testing.assert_allclose(there, centred, atol=1e-12)
    assert growth(steady_motion(aside, there, 70.0)) == pytest.approx(
        growth(steady_motion(model, state, 70.0)), rel=1e-6
    )


def test_small_motions_are_those_on_a_tangent_perfect_track():
    plain, there = straight_ahead(load_scene(ELLIPTIC / "suspended_wheelset.yaml"))
    elsewhere = [
        "track.path=[{transition: 20}, {curve: 50, radius: 500, cant: 0.1}]", "track.gradients=[{gradient: 0.02}]",
        "track.irregularity={spectrum: {level: high, seed: 1, length: 100, begin: -50}}",
    ]  # fmt: skip
    model, state = straight_ahead(load_scene(ELLIPTIC / "suspended_wheelset.yaml", elsewhere))
    np.testing.assert_array_equal(state, there)
    np.testing.assert_array_equal(steady_motion(model, state, 60.0).matrix, steady_motion(plain, there, 60.0).matrix)


def test_root_locus_is_a_table_of_modes_over_speed(suspended):
    vehicle, model, state = suspended
    locus = root_locus(vehicle, model, state, [20.0, 60.0])
    assert locus.columns[0] == "speed_m_per_s"
    for speed, rows in locus.groupby("speed_m_per_s"):
        alone, _, _ = linear_modes(vehicle, steady_motion(model, state, speed))
        np.testing.assert_allclose(rows["real_per_s"], alone["real_per_s"], rtol=1e-6)


def test_a_motion_at_another_speed_rolls_as_before(suspended):
    vehicle, model, state = suspended
    moved, there = at_speed(model, state + 0.001 * (np.arange(13) == 1), 50.0, elapsed=2.0)
    back, again = at_speed(moved, there, 20.0)
    assert (moved.speed, back.speed) == (50.0, 20.0)
    assert there[0] == pytest.approx(state[0] - 2.0 * 20.0)  # where the frame's origin has been put
    assert there[11] / there[7] == pytest.approx(state[11] / state[7], rel=1e-12)  # spin over speed
    np.testing.assert_allclose(again[1:], (state + 0.001 * (np.arange(13) == 1))[1:], rtol=1e-12)


def test_axle_boxes_add_their_pitch_and_leave_the_other_modes(trailer):
    """An axle box on its axle pitches against its spring alone: w^2 = k/J = 1e5/5 (as in trailer_vehicle.yaml).

    That spring holds the bogie against the wheelset's frame where the box is part of it, hence the bogie's pitch moves.
    """
    vehicle, model, state = trailer
    scene = load_scene(ELLIPTIC / "trailer_vehicle.yaml", ["initial.y=0.0", "vehicle.axle_boxes=true"])
    lumped, _, _ = linear_modes(vehicle, steady_motion(model, state, 60.0))
    table, _, _ = linear_modes(scene.vehicle, steady_motion(*compile_scene(scene), 60.0))
    values = (table["real_per_s"] + 1j * table["imag_rad_per_s"]).to_numpy()
    for mode in lumped[lumped["damping_ratio"] < 0.95].itertuples():
        value = complex(mode.real_per_s, mode.imag_rad_per_s)
        far = 0.02 if "bogie pitch" in mode.name else 1e-3
        assert np.min(np.abs(values - value)) < far * abs(value), mode.name
    boxes = table[table["name"].str.startswith("axle box pitch")]
    assert len(boxes) == 8
    np.testing.assert_allclose(np.hypot(boxes["real_per_s"], boxes["imag_rad_per_s"]), math.sqrt(1e5 / 5.0), rtol=0.02)
