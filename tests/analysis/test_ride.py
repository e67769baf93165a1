"""Weightings against values of ISO 2631-1's table 3 (recalled), comfort and Wz against signals with known answers."""

import numpy as np
import pytest

from tests.synthetic import hunting_run
from wrcore.analysis.assess import assess
from wrcore.analysis.ride import WEIGHTINGS, block_rms, ride_table, sperling, weighted, whole_body_table
from wrcore.errors import InputError

TABLE_3 = {
    "Wk": (0.482, 0.484, 0.494, 0.531, 0.631, 0.804, 0.967, 1.039, 1.054, 1.036, 0.988, 0.902, 0.768, 0.636, 0.513,
           0.405, 0.314, 0.246, 0.186, 0.132),
    "Wd": (1.011, 1.008, 0.968, 0.890, 0.776, 0.642, 0.512, 0.409, 0.323, 0.253),
}  # fmt: skip
THIRDS = (1, 1.25, 1.6, 2, 2.5, 3.15, 4, 5, 6.3, 8, 10, 12.5, 16, 20, 25, 31.5, 40, 50, 63, 80)
"""Hz."""


@pytest.mark.parametrize("name", TABLE_3)
def test_weightings_of_iso_2631(name):
    found = np.abs(WEIGHTINGS[name].response(THIRDS[: len(TABLE_3[name])]))
    np.testing.assert_allclose(found, TABLE_3[name], rtol=0.0, atol=8e-4)


def test_gain_of_wb():
    """1.024 (2.5/4)^2 = 0.4, the plateau of BS 6841, below the step; without band limits and beside its slopes."""
    flat = WEIGHTINGS["Wb"]._replace(low=1e-4, high=1e6)
    assert abs(flat.response(0.05)) == pytest.approx(0.4, rel=1e-3)


@pytest.mark.parametrize("frequency", [0.8, 4.0, 15.0])
def test_weighting_a_sine_scales_it_by_the_response(frequency):
    rate = 500.0
    t = np.arange(int(20 * rate)) / rate
    found = weighted(np.sin(2 * np.pi * frequency * t), rate, "Wk")[int(10 * rate) :]
    assert np.sqrt(2 * np.mean(found**2)) == pytest.approx(abs(WEIGHTINGS["Wk"].response(frequency)), rel=2e-3)


def test_nothing_comes_back_from_the_end_of_a_signal():
    values = np.zeros(5000)
    values[-1] = 1.0
    assert np.abs(weighted(values, 500.0, "Wd")[:4900]).max() < 1e-4


def test_blocks_are_whole():
    np.testing.assert_allclose(block_rms(np.r_[np.full(500, 2.0), np.full(700, 3.0)], 100.0), [2.0, 3.0])


@pytest.mark.parametrize(("vertical", "factor"), [(True, 0.588), (False, 0.737)])
def test_sperling_of_a_sine(vertical, factor):
    rate, f, a = 400.0, 5.0, 0.3
    t = np.arange(int(20 * rate)) / rate
    b = factor * np.sqrt(
        (1.911 * f**2 + (0.25 * f**2) ** 2) / ((1 - 0.277 * f**2) ** 2 + (1.563 * f - 0.0368 * f**3) ** 2)
    )
    expected = ((100 * a) ** 2 / 2 * b**2) ** (1 / 6.67)
    assert sperling(a * np.sin(2 * np.pi * f * t), rate, vertical) == pytest.approx(expected, rel=1e-6)
    assert 2.0 < expected < 4.0  # the scale: 2 good, 3.25 the limit for passengers


@pytest.fixture
def run():
    made = hunting_run(duration=20.0)
    made.groups["car_body"] = {
        "ax_m_per_s2": np.zeros_like(made.t),
        "ay_m_per_s2": 0.3 * np.sin(2 * np.pi * 2.0 * made.t),
        "az_m_per_s2": 0.2 * np.sin(2 * np.pi * 8.0 * made.t),
    }
    return made


def test_mean_comfort_of_two_sines(run):
    table = ride_table(run, begin=5.0)
    assert list(table["body"]) == ["car_body"] and table["blocks"][0] == 3
    parts = [0.3 * abs(WEIGHTINGS["Wd"].response(2.0)), 0.2 * abs(WEIGHTINGS["Wb"].response(8.0))]
    assert table["N_MV"][0] == pytest.approx(6.0 * np.hypot(*parts) / np.sqrt(2.0), rel=0.02)


def test_whole_body_vibration_of_two_sines(run):
    run.groups["car_body"]["az_m_per_s2"][run.t > 15.0] *= 2.0
    table = whole_body_table(run, begin=5.0).set_index("direction")
    lateral = 0.3 * abs(WEIGHTINGS["Wd"].response(2.0)) / np.sqrt(2.0)
    vertical = 0.2 * abs(WEIGHTINGS["Wk"].response(8.0)) / np.sqrt(2.0)
    assert table["weighting"].tolist() == ["Wd", "Wd", "Wk"] and np.isnan(table.loc["x", "crest_factor"])
    assert table.loc["y", "rms_m_per_s2"] == pytest.approx(lateral, rel=0.02)
    largest = np.abs(weighted(run["car_body"].ay_m_per_s2[run.t >= 5.0], 200.0, "Wd")).max()  # at its start
    assert table.loc["y", "crest_factor"] == pytest.approx(largest / lateral, rel=0.02)
    assert table.loc["z", "MTVV_m_per_s2"] == pytest.approx(2.0 * vertical, rel=0.02)
    rms = vertical * np.sqrt((2 / 3) + 4 / 3)  # 10 s as it was, 5 s of twice as much
    assert table.loc["z", "rms_m_per_s2"] == pytest.approx(rms, rel=0.02)
    dose = vertical * np.sqrt(2.0) * (3 / 8 * (10 + 16 * 5)) ** 0.25  # mean of sin^4: 3/8
    assert table.loc["z", "VDV_m_per_s1_75"] == pytest.approx(dose, rel=0.02)
    assert table["total_value_m_per_s2"].tolist() == pytest.approx([np.hypot(lateral, rms)] * 3, rel=0.02)
    assert assess(run, "ISO 2631", begin=5.0).summary.equals(whole_body_table(run, begin=5.0))


def test_running_rms_is_one_over_a_second(run):
    quiet = np.abs(run.t - 10.0) > 0.25  # half a second of 8 Hz is half of what a second counts
    run.groups["car_body"]["az_m_per_s2"][quiet] = 0.0
    table = whole_body_table(run).set_index("direction")
    burst = 0.2 * abs(WEIGHTINGS["Wk"].response(8.0)) / np.sqrt(2.0)
    assert table.loc["z", "MTVV_m_per_s2"] == pytest.approx(burst * np.sqrt(0.5), rel=0.05)


def test_what_cannot_be_assessed_is_refused(run):
    with pytest.raises(InputError, match="unknown|expected one of Wk"):
        weighted([0.0, 1.0], 100.0, "Wz")
    with pytest.raises(InputError, match="at least 5 s"):
        ride_table(run, begin=16.0)
    del run.groups["car_body"]["ax_m_per_s2"]
    with pytest.raises(InputError, match="a body without wheels"):
        ride_table(run)
