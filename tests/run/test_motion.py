"""Frequency, growth and amplitude of motions whose answers are known in closed form."""

import numpy as np
import pytest
from synthetic import hunting_run

from wrcore.run.motion import amplitude, growth_rate, hunting_frequency, zero_crossings


@pytest.mark.parametrize("frequency", [0.7, 2.6, 9.0])
def test_frequency_of_a_sine_does_not_depend_on_its_growth(frequency):
    run = hunting_run(growth=0.3, frequency=frequency)
    # linear interpolation between samples 1/200 s apart: relative error of a period below (pi f / 200)^2 / 6 per end
    assert hunting_frequency(run.t, run["wheelset"].y_m) == pytest.approx(frequency, rel=2e-3)


def test_frequency_needs_three_crossings():
    t = np.linspace(0, 1, 201)
    assert np.isnan(hunting_frequency(t, np.cos(2 * np.pi * t)))
    assert hunting_frequency(t, np.cos(3.2 * np.pi * t)) == pytest.approx(1.6, rel=1e-3)


def test_zero_crossings_are_interpolated():
    assert zero_crossings([0.0, 1.0, 2.0], [1.0, -3.0, 1.0]) == pytest.approx([0.25, 1.75])


@pytest.mark.parametrize("growth", [-0.8, 0.0, 1.3])
def test_growth_rate_is_the_exponent(growth):
    run = hunting_run(growth=growth)
    # a sampled extremum is off by at most (2 pi f / 400)^2 / 2 = 8e-4 of its height
    assert growth_rate(run.t, run["wheelset"].y_m) == pytest.approx(growth, abs=2e-3)


def test_growth_rate_of_a_monotonic_motion_is_unknown():
    assert np.isnan(growth_rate(np.arange(5.0), np.arange(1.0, 6.0)))


def test_growth_rate_leaves_out_a_sample_that_only_touches_zero():
    y = np.array([1.0, -1.0, 0.0, -1.0, 1.0, -1.0])
    assert growth_rate(np.arange(6.0), y) == pytest.approx(0.0, abs=1e-12)


def test_amplitude_is_half_of_peak_to_peak():
    assert amplitude(np.array([-1.0, 0.5, 3.0])) == 2.0
