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


TIMES = np.linspace(0.0, 10.0, 2001)
NOISE = np.random.default_rng(0).standard_normal(TIMES.size)
PHASE = 2.0 * np.pi * 2.39 * TIMES + 0.4


@pytest.mark.parametrize(
    "motion",
    [
        2e-3 * np.exp(-0.1 * PHASE) * np.cos(PHASE) + 1e-11 * NOISE,  # dies, and leaves rounding noise
        2e-3 * np.exp(-0.3 * PHASE) * np.cos(PHASE) + 1e-11 * NOISE,
        2e-3 * np.exp(-0.05 * PHASE) * np.cos(PHASE) + 4e-5 * NOISE,  # dies, and leaves noise of the measurement
        1e-6 * np.exp(0.05 * PHASE) * np.cos(PHASE),
        2e-3 * np.cos(PHASE) + 2e-4 * NOISE,
        5e-3 + 1e-3 * np.cos(PHASE),  # off the track's centre, as in a curve
        5e-3 * (1.0 - np.exp(-0.5 * TIMES)) + 5e-4 * np.cos(PHASE),
        1e-3 * np.cos(PHASE) + 3e-4 * np.cos(2.0 * np.pi * 8.1 * TIMES),
        1e-3 * np.cos(PHASE) + 3e-4 * np.cos(2.0 * PHASE),  # up and down differ
    ],
    ids=["dying", "damped", "dying_in_noise", "growing", "noisy", "offset", "drifting", "two_frequencies", "skew"],
)
def test_frequency_is_that_of_the_motion_alone(motion):
    assert hunting_frequency(TIMES, motion) == pytest.approx(2.39, rel=5e-3)


@pytest.mark.parametrize("motion", [0.0 * TIMES, 1e-12 * NOISE, 1e-3 + 0.0 * TIMES, 1e-3 * TIMES])
def test_frequency_without_motion_is_unknown(motion):
    assert np.isnan(hunting_frequency(TIMES, motion))


def test_growth_rate_ends_where_the_motion_is_dead():
    y = 2e-3 * np.exp(-0.1 * PHASE) * np.cos(PHASE) + 1e-11 * NOISE
    assert growth_rate(TIMES, y) == pytest.approx(-0.2 * np.pi * 2.39, rel=2e-3)


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
