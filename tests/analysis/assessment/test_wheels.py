"""Forces, wear and hunting against runs whose answers are known in closed form."""

import math

import numpy as np
import pandas as pd
import pytest

import wrcore as wr
from study.speeds.tables import cost_table, speed_row
from tests.conftest import ELLIPTIC
from tests.synthetic import hunting_run
from wrcore.analysis.assessment import wheels as av
from wrcore.analysis.motion import hunting


@pytest.fixture
def run():
    """A decaying hunting motion at 2.6 Hz, one patch per wheel at 30 mrad; a second body gives accelerations."""
    made = hunting_run(growth=-0.5)
    made.scene["integration"] = {"duration": 4.0}
    made.groups["car_body"] = {
        "ay_m_per_s2": 0.3 * np.sin(2 * np.pi * 5 * made.t),
        "az_m_per_s2": np.full_like(made.t, 0.2),
    }
    return made


def put(run, side, **values):
    for name, value in values.items():
        run.groups[f"wheelset/{side}"][name][:, 0] = value


def test_forces_of_a_wheel_are_the_contact_forces_turned_into_the_track_plane(run):
    # left wheel on its flange: plane at 1.2 rad, N = 10 kN, creep force 2 kN up the flange
    put(run, "left", contact_angle_rad=1.2, N_N=1e4, Fy_N=2e3)
    vertical, lateral = av.wheel_forces(run, "wheelset", "left")
    # on the wheel: N along (-sin, cos), Fy along (cos, sin) of (y, z); on the rail the opposite; field side of left: +y
    assert vertical[0] == pytest.approx(1e4 * math.cos(1.2) + 2e3 * math.sin(1.2), rel=1e-12)
    assert lateral[0] == pytest.approx(1e4 * math.sin(1.2) - 2e3 * math.cos(1.2), rel=1e-12)
    assert lateral[0] > 0.0  # the flange presses the rail outwards


def test_mirrored_wheels_have_equal_forces(run):
    put(run, "left", contact_angle_rad=0.4, N_N=1e4, Fy_N=700.0)
    put(run, "right", contact_angle_rad=-0.4, N_N=1e4, Fy_N=-700.0)
    left, right = (av.wheel_forces(run, "wheelset", side) for side in ("left", "right"))
    np.testing.assert_allclose(left, right, rtol=1e-14)


def test_two_patches_add_up(run):
    put(run, "left", N_N=1e4, contact_angle_rad=0.0)
    run.groups["wheelset/left"]["N_N"][:, 1] = 500.0
    run.groups["wheelset/left"]["contact_angle_rad"][:, 1] = math.pi / 2
    run.groups["wheelset/left"]["Fy_N"][:, 1] = 0.0
    vertical, lateral = av.wheel_forces(run, "wheelset", "left")
    assert vertical[0] == pytest.approx(1e4)
    assert lateral[0] == pytest.approx(500.0)


def test_products_of_force_and_creepage_keep_their_signs(run):
    # spin drives the lateral force along its creepage: friction gives back 1 N there and takes 4 N by spin
    put(run, "left", Fx_N=-3e3, xi=2e-3, Fy_N=1e3, eta=1e-3, Mz_Nm=-10.0, phi_per_m=0.4)
    run.groups["wheelset/left"]["Fx_N"][:, 1] = -500.0
    run.groups["wheelset/left"]["xi"][:, 1] = 1e-3
    for name in ("Fy_N", "eta", "Mz_Nm", "phi_per_m"):
        run.groups["wheelset/left"][name][:, 1] = 0.0
    run.groups["wheelset"]["vx_m_per_s"][:], run.groups["wheelset"]["vy_m_per_s"][:] = 12.0, 5.0
    assert av.wear_number(run, "wheelset", "left")[0] == pytest.approx((6.0 - 1.0) + 0.5)
    assert av.wear_number(run, "wheelset", "left", spin=True)[0] == pytest.approx((6.0 - 1.0 + 4.0) + 0.5)
    assert av.creep_power(run, "wheelset", "left")[0] == pytest.approx(13.0 * 9.5)
    del run.groups["wheelset"]["vx_m_per_s"]
    assert av.creep_power(run, "wheelset", "left")[0] == pytest.approx(20.0 * 9.5)


@pytest.mark.check
def test_creep_power_is_what_the_energy_loses_by_creep():
    channels = ["pose", "velocity", "contact", "energy"]
    run = wr.simulate(
        ELLIPTIC / "suspended_wheelset.yaml", speed=60, integration__duration=0.5, output__channels=channels
    )
    power = sum(av.creep_power(run, "wheelset", side) for side in ("left", "right"))
    lost = run["energy"].dissipated_by_creep_W
    np.testing.assert_allclose(power, lost, rtol=1e-3, atol=1e-6 * lost.max())
    assert lost.max() > 100.0


def test_quotient_leaves_out_unLoadedWheels():
    ratio = av.quotient(np.array([5e4, 10.0, 0.0]), np.array([2e4, 5.0, 1.0]))
    assert ratio[0] == pytest.approx(0.4)
    assert np.isnan(ratio[1:]).all()


def test_wheel_table_has_a_row_per_wheel(run):
    put(run, "left", N_N=2e4, contact_angle_rad=0.1)
    table = av.wheel_table(run).set_index(["wheelset", "side"])
    assert len(table) == 2
    assert table.loc[("wheelset", "left"), "Y_over_Q_max"] == pytest.approx(math.tan(0.1))
    assert table.loc[("wheelset", "right"), "Q_mean_N"] == pytest.approx(8.9e3 * math.cos(0.03))
    assert table.loc[("wheelset", "left"), "Y_mean_N"] == pytest.approx(2e4 * math.sin(0.1))


def test_hunting_of_a_decaying_oscillation(run):
    frequency, growth, damping = hunting(run.t, run["wheelset"].y_m)
    assert frequency == pytest.approx(2.6, rel=1e-3)
    assert growth == pytest.approx(-0.5, rel=1e-2)
    assert damping == pytest.approx(0.5 / math.hypot(0.5, 2 * math.pi * 2.6), rel=1e-2)


def test_hunting_of_a_motion_that_has_died_is_not_that_of_its_rounding():
    t = np.arange(2001) / 200
    y = 2e-3 * np.exp(-2.0 * t) * np.cos(2 * np.pi * 2.0 * t)
    noisy = np.where(t > 5.0, 1e-9 * np.sin(2 * np.pi * 70 * t), y)
    frequency, growth, _ = hunting(t, noisy)
    assert frequency == pytest.approx(2.0, rel=1e-2)
    assert growth == pytest.approx(-2.0, rel=2e-2)


def test_speed_row_looks_at_the_second_half(run):
    run.groups["car_body"]["az_m_per_s2"][run.t < 2.0] = 50.0  # before the second half: must not count
    row = speed_row(run)
    assert row["speed_m_per_s"] == 20.0
    assert row["car_body_az_max_m_per_s2"] == pytest.approx(0.2)
    assert row["car_body_ay_rms_m_per_s2"] == pytest.approx(0.3 / math.sqrt(2), rel=1e-2)
    # half of peak to peak: the first two extrema after 2 s are the 11th and 12th half period of 2.6 Hz
    extrema = [2e-3 * math.exp(-0.5 * k / 5.2) for k in (11, 12)]
    assert row["amplitude_m"] == pytest.approx(sum(extrema) / 2, rel=1e-3)


def test_a_vehicle_without_car_body_has_no_accelerations(run):
    del run.groups["car_body"]
    assert math.isnan(speed_row(run)["car_body_ay_max_m_per_s2"])


def test_cost_table_compares_planar_per_call_and_states_the_overhead(run):
    def rows(wall_s):
        return [speed_row(run) | {"wall_s": wall_s, "rhs_evaluations": 1000} for _ in range(3)]

    table = pd.DataFrame(
        [{"detection": d, "track": "released"} | row for d, w in (("planar", 0.9), ("spatial", 1.0)) for row in rows(w)]
    )
    cost = cost_table({"coach": table}, {"coach": 6.0}).set_index("detection")
    assert cost.loc["spatial", "planar_over_this_per_call"] == pytest.approx(0.9)
    assert cost.loc["spatial", "real_time_factor"] == pytest.approx(4.0)
    assert cost.loc["planar", "job_overhead"] == pytest.approx(1 - 5.7 / 6.0)
