"""Frequency response against time simulation, statics, rigid-body motion and the filter that axle distances make."""

import numpy as np
import pandas as pd
import pytest
import yaml

import wrcore as wr
from tests.conftest import ELLIPTIC, SCENES
from wrcore.cli import main
from wrcore.errors import InputError

TRAILER = ELLIPTIC / "trailer_vehicle.yaml"
TONES = {"alignment": [0.5, 2.0, 5.0], "level": [1.0, 7.0], "cross_level": [1.5, 9.0]}
"""Frequencies in Hz, all different: each is found alone in the spectrum of one run."""

SIZE, SETTLED, WHOLE = 2e-6, 40.0, 44.0


@pytest.fixture(scope="module")
def shaken(tmp_path_factory):
    """A run of the trailer vehicle at 30 m/s over irregularity of 2 um, from when it has settled on."""
    file, speed = tmp_path_factory.mktemp("track") / "tones.csv", 30.0
    s = np.arange(-20.0, speed * (WHOLE + 3.0), 0.025)
    table = {"s_m": s} | {
        f"{kind}_m": SIZE * sum(np.cos(2.0 * np.pi * f * s / speed) for f in tones) for kind, tones in TONES.items()
    }
    pd.DataFrame(table).to_csv(file, index=False)
    run = wr.simulate(
        TRAILER, speed=speed, initial={"y": 0.0},
        track={"irregularity": {"points": str(file), "fade_in": 60.0, "fade_out": 10.0}},
        integration={"duration": WHOLE, "rtol": 1e-8, "method": "tsit5"},
        output={"rate": 100.0, "channels": ["pose", "velocity", "acceleration", "contact"]},
    )  # fmt: skip
    late = (run.t >= SETTLED - 1e-9) & (run.t < WHOLE - 1e-9)
    return run.t[late], lambda group, channel: run[group][channel][late]


@pytest.mark.parametrize("output", [
    "car_body.y_m", "car_body.az_m_per_s2", "car_body.ay_m_per_s2", "bogie_1.roll_rad", "wheelset_4.yaw_rad",
    "wheelset_3/left.Q_N", "wheelset_1/left.Y_N", "wheelset_4.sum_Y_N",
])  # fmt: skip
def test_it_is_what_a_run_over_small_irregularity_shows(shaken, output):
    """Contact is nonlinear: what a run of 2 um shows of one input and output alone is within 1e-3 of the linear one."""
    t, channel = shaken
    values = channel(*output.split("."))
    table = wr.frequency_response(TRAILER, list(TONES), [output], sorted(sum(TONES.values(), [])), 30.0)
    lateral = output.split(".")[1][0] in "yras" or "Y_N" in output
    kinds = ["alignment", "cross_level"] if lateral and "az" not in output else ["level"]
    for kind in kinds:
        for f in TONES[kind]:
            seen = 2.0 * np.mean((values - values.mean()) * np.exp(-2j * np.pi * f * t)) / SIZE
            assert seen == pytest.approx(table.loc[f, (kind, output)], rel=1e-3)


def test_a_slow_force_finds_the_springs_and_a_fast_one_the_mass():
    """Car body on secondary and primary springs and 8 contacts: 1/(4 k_s) + 1/(8 k_p) and a little; 1/m."""
    vehicle = yaml.safe_load((ELLIPTIC.parent / "vehicles/trailer_vehicle.yaml").read_text())
    table = wr.frequency_response(
        TRAILER, ["car_body.Fz_N", "level"], ["car_body.z_m", "car_body.az_m_per_s2"], [1e-3, 200.0]
    )
    mass = vehicle["bodies"]["car_body"]["mass"]
    fast = table.loc[200.0, ("car_body.Fz_N", "car_body.az_m_per_s2")]
    assert fast == pytest.approx(1.0 / mass, rel=1e-3)
    vertical = {"secondary": 0.0, "primary": 0.0}
    for item in vehicle["elements"]:
        for stage in vertical:
            if item["name"].startswith(stage) and "stiffness" in item and not np.isscalar(item["stiffness"]):
                vertical[stage] += item["stiffness"][2]
    slow = table.loc[1e-3, ("car_body.Fz_N", "car_body.z_m")]
    assert slow.real == pytest.approx(1.0 / vertical["secondary"] + 1.0 / vertical["primary"], rel=1e-2)
    assert table.loc[1e-3, ("level", "car_body.z_m")] == pytest.approx(1.0, rel=1e-3)


def test_a_fast_moment_finds_the_inverse_of_the_tensor():
    inertia = {"roll": 56800.0, "pitch": 1970000.0, "yaw": 1970000.0, "xz": 40000.0, "xy": 9000.0}
    scene = wr.load_scene(TRAILER, {"vehicle.bodies.car_body.inertia": inertia})
    outputs, frequency = [f"car_body.w{axis}_rad_per_s" for axis in "xyz"], 1000.0
    table = wr.frequency_response(scene, ["car_body.Mx_Nm", "car_body.Mz_Nm"], outputs, [frequency], speed=20.0)
    found = 2j * np.pi * frequency * table.to_numpy().reshape(2, 3)
    tensor = np.array([[56800.0, -9000.0, -40000.0], [-9000.0, 1970000.0, 0.0], [-40000.0, 0.0, 1970000.0]])
    inverse = np.linalg.inv(tensor)[[0, 2]]
    np.testing.assert_allclose(found, inverse, atol=1e-3 * np.abs(inverse[:, 2:]).max())


def test_axle_distances_filter():
    """Bounce ends where half a wave lies between the bogies' pivots, pitch where a whole one does, but for what bogies
    that pitch hand on along the track."""
    speed, pivots = 20.0, 2.0 * 9.5
    table = wr.frequency_response(
        TRAILER, ["level"], ["car_body.z_m", "car_body.pitch_rad"], [speed / (2 * pivots), speed / pivots], speed
    )["level"].abs()
    assert table["car_body.z_m"].iloc[0] < 1e-6 * table["car_body.z_m"].iloc[1]
    assert table["car_body.pitch_rad"].iloc[1] < 0.01 * table["car_body.pitch_rad"].iloc[0]


def test_one_rail_is_half_of_both():
    outputs = ["wheelset/left.Q_N", "wheelset.roll_rad"]
    kinds = ["left_vertical", "right_vertical", "level", "cross_level"]
    table = wr.frequency_response(ELLIPTIC / "suspended_wheelset.yaml", kinds, outputs, [3.0])
    for output in outputs:
        left, right, level, cross = (table.loc[3.0, (kind, output)] for kind in kinds)
        assert left + right == pytest.approx(level, abs=1e-4 * abs(left))
        assert 0.5 * (left - right) == pytest.approx(cross, abs=1e-4 * abs(left))


def test_frequencies_come_back_as_they_were_asked_for():
    asked = [0.1, 1.0 / 3.0, 7.3]
    table = wr.frequency_response(ELLIPTIC / "suspended_wheelset.yaml", ["level"], ["wheelset.y_m"], asked)
    assert table.index.tolist() == asked


@pytest.mark.parametrize("arguments, says", [
    ((["lvel"], ["wheelset.y_m"], [1.0]), "inputs: .*did you mean 'level'"),
    ((["wheelset.Fq_N"], ["wheelset.y_m"], [1.0]), "inputs: .*did you mean"),
    ((["level"], ["wheelset.yy_m"], [1.0]), "no channel 'yy_m'"),
    ((["level"], ["y_m"], [1.0]), "outputs: expected"),
    ((["level"], ["wheelset/left.N_N"], [1.0]), "outputs: expected a channel that has one number"),
    ((["level"], ["wheelset.y_m"], [0.0]), "frequencies: expected"),
    ((["level"], ["wheelset.y_m"], [1.0], 80.0), "speed: expected a speed at which small motions die away"),
])  # fmt: skip
def test_bad_input_is_named(arguments, says):
    with pytest.raises(InputError, match=says):
        wr.frequency_response(ELLIPTIC / "suspended_wheelset.yaml", *arguments)


def test_a_vehicle_that_nothing_holds_along_the_track_is_told_so():
    with pytest.raises(InputError, match="along the track, where nothing holds the vehicle against its rolling resist"):
        wr.frequency_response(SCENES / "locomotive.yaml", ["level"], ["body.z_m"], [1.0], speed=20.0)


def test_control_laws_do_not_count():
    with pytest.raises(InputError, match="steady motion: speed 15 m/s"):  # not of outputs that go to motors left out
        wr.frequency_response(SCENES / "guided_car.yaml", ["level"], ["car_body.z_m"], [1.0], speed=15.0)


def test_the_command_writes_table_and_plot(tmp_path):
    out, plot = tmp_path / "bode.csv", tmp_path / "bode.svg"
    words = ["--input", "level", "car_body.Fz_N", "--output", "car_body.az_m_per_s2", "--count", "5"]
    assert main(["response", str(TRAILER), *words, "--out", str(out), "--plot", str(plot)]) == 0
    rows = pd.read_csv(out)
    assert list(rows) == ["input", "output", "frequency_Hz", "amplitude", "phase_rad"] and len(rows) == 10
    table = wr.frequency_response(TRAILER, ["level"], ["car_body.az_m_per_s2"], [0.1])
    assert rows["amplitude"][0] == pytest.approx(abs(table.iloc[0, 0]), rel=1e-9)
    assert plot.read_text().startswith("<?xml")
