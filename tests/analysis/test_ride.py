"""Weightings against values of ISO 2631-1's table 3 (recalled), comfort and Wz against signals with known answers."""

import numpy as np
import pytest

from tests.synthetic import hunting_run
from wrcore.analysis.ride import WEIGHTINGS, block_rms, ride_table, sperling, weighted
from wrcore.errors import InputError

TABLE_3 = {"Wk": {1.0: 0.482, 4.0: 0.967, 5.0: 1.039, 6.3: 1.054, 8.0: 1.036, 10.0: 0.988, 16.0: 0.768},
           "Wd": {1.0: 1.011, 2.0: 0.890, 4.0: 0.512, 8.0: 0.253}}  # fmt: skip


@pytest.mark.parametrize("name", TABLE_3)
def test_weightings_of_iso_2631(name):
    for frequency, factor in TABLE_3[name].items():
        assert abs(WEIGHTINGS[name].response(frequency)) == pytest.approx(factor, abs=1.5e-3)


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


def test_what_cannot_be_assessed_is_refused(run):
    with pytest.raises(InputError, match="unknown|expected one of Wk"):
        weighted([0.0, 1.0], 100.0, "Wz")
    with pytest.raises(InputError, match="at least 5 s"):
        ride_table(run, begin=16.0)
    del run.groups["car_body"]["ax_m_per_s2"]
    with pytest.raises(InputError, match="a body without wheels"):
        ride_table(run)
