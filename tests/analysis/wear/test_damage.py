"""Damage against the corners of its law, the index of surface fatigue against Hertz and the shakedown limit."""

import numpy as np
import pytest

from tests.analysis.assessment.test_assess import synthetic
from wrcore.analysis.assessment.wheels import wheel_table
from wrcore.analysis.wear.damage import damage_table, fatigue_index, plot_shakedown, rcf_damage, utilised_friction
from wrcore.errors import InputError
from wrcore.run.output.run import Run

K = 300e6


@pytest.fixture
def run():
    made = synthetic(lambda t, sign: (np.full_like(t, 8e4), np.zeros_like(t)), duration=0.1)
    left = made.groups["wheelset/left"]
    left["Fx_N"][:, 0], left["xi"][:, 0] = -2.4e4, 65.0 / 2.4e4
    late = made.t >= 0.05
    left["N_N"][late, 0], left["a_m"][late, 0] = 2e4, 8e-3
    left["Fx_N"][late, 0] = -2e3
    return made


def test_corners_of_the_law():
    np.testing.assert_allclose(rcf_damage([0, 15, 40, 65, 120, 175, 1e4]), [0, 0, 5e-6, 1e-5, 5e-6, 0, 0])


def test_index_is_zero_on_the_limit_of_shakedown(run):
    pressure = 1.5 * 8e4 / (np.pi * 5e-3**2)
    assert utilised_friction(run, "wheelset", "left")[0, 0] == pytest.approx(0.3)
    assert np.isnan(utilised_friction(run, "wheelset", "left")[:, 1:]).all()
    assert fatigue_index(run, "wheelset", "left", K)[0] == pytest.approx(0.3 - K / pressure, rel=1e-12)
    assert fatigue_index(run, "wheelset", "left", 0.3 * pressure)[0] == pytest.approx(0.0, abs=1e-12)


def test_each_patch_has_its_own_index():
    """Tread: 1200 MPa, |T|/N 0.05; flange: 600 MPa, |T|/N 0.3. Both FI are -0.20; one's T with the other's p: +0.05."""
    run = synthetic(lambda t, sign: (np.full_like(t, 8e4), np.zeros_like(t)), duration=0.1)
    left = run.groups["wheelset/left"]
    for patch, (load, share, pressure) in enumerate([(8e4, 0.05, 1.2e9), (2e4, 0.3, 0.6e9)]):
        left["N_N"][:, patch], left["Fx_N"][:, patch], left["Fy_N"][:, patch] = load, 0.0, -share * load
        left["a_m"][:, patch] = left["b_m"][:, patch] = np.sqrt(1.5 * load / (np.pi * pressure))
        left["xi"][:, patch], left["eta"][:, patch] = 0.0, 60.0 / (share * load)  # T gamma of each: 60 N
    np.testing.assert_allclose(fatigue_index(run, "wheelset", "left", K), -0.2, rtol=1e-9)
    row = damage_table(run).set_index("side").loc["left"]
    assert row["FI_max"] == pytest.approx(-0.2) and row["share_above_shakedown"] == 0.0
    assert row["p_max_Pa"] == pytest.approx(1.2e9) and row["T_gamma_mean_N"] == pytest.approx(120.0)
    assert row["rcf_damage_mean"] == pytest.approx(0.9e-5)  # of 60 N on either place, not of 120 N on none
    line = plot_shakedown(run).axes[0].lines[0]
    points = {tuple(np.round(point, 9)) for point in line.get_xydata()[np.isfinite(line.get_xydata()).all(axis=1)]}
    assert points == {(0.05, 4.0), (0.3, 2.0)}
    run.groups["wheelset/left"]["N_N"][:], run.groups["wheelset/left"]["a_m"][:] = np.nan, np.nan
    assert np.all(fatigue_index(run, "wheelset", "left", K) == -np.inf)


def test_table_of_a_run(run):
    table = damage_table(run).set_index("side")
    assert table.loc["left", "rcf_damage_mean"] == pytest.approx(5e-6, rel=0.03)
    assert table.loc["left", "share_above_shakedown"] == pytest.approx(0.5, abs=0.02)
    assert table.loc["right", "rcf_damage_mean"] == 0.0 and table.loc["right", "share_above_shakedown"] == 0.0
    assert table.loc["left", "T_gamma_mean_N"] == pytest.approx(0.5 * (65.0 + 2e3 * 65.0 / 2.4e4), rel=0.03)
    assert damage_table(run, begin=0.05).set_index("side").loc["left", "FI_max"] < 0.0
    with pytest.raises(InputError, match="begin: expected 0 to 0.1 s"):
        damage_table(run, begin=1.0)
    with pytest.raises(InputError, match="channels of wheels"):
        damage_table(Run(run.scene, "completed", "", run.t, {}))


def test_means_are_over_the_way(run):
    """Braked to a quarter of the speed half-way through the time: the second half's share of the way is a fifth."""
    late = run.t >= 0.05
    run.groups["wheelset"]["vx_m_per_s"] = np.where(late, 5.0, 20.0)
    fifth = np.count_nonzero(late) * 5.0 / (np.count_nonzero(late) * 5.0 + np.count_nonzero(~late) * 20.0)
    assert fifth == pytest.approx(0.2, abs=0.01)
    row, wheel = (table(run).set_index("side").loc["left"] for table in (damage_table, wheel_table))
    assert row["T_gamma_mean_N"] == pytest.approx((1.0 - fifth) * 65.0 + fifth * 65.0 / 12.0, rel=1e-12)
    assert wheel["T_gamma_mean_N"] == row["T_gamma_mean_N"] == wheel["T_gamma_spin_mean_N"]
    assert row["rcf_damage_mean"] == pytest.approx((1.0 - fifth) * 1e-5, rel=1e-12)
    assert row["share_above_shakedown"] == pytest.approx(1.0 - fifth, rel=1e-12)
    power = (np.count_nonzero(~late) * 65.0 * 20.0 + np.count_nonzero(late) * 65.0 / 12.0 * 5.0) / len(run.t)
    assert wheel["creep_power_mean_W"] == pytest.approx(power, rel=1e-12)  # a mean over time


def test_map_holds_all_wheels_and_the_limit(run):
    axes = plot_shakedown(run).axes[0]
    assert len(axes.lines) == 3 and axes.get_ylim()[1] >= 5.0
    friction, pressure = axes.lines[-1].get_data()
    np.testing.assert_allclose(friction * pressure, 1.0)
