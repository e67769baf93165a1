"""Filters have no phase and known amplitudes, coarser grids alias nothing, and alignment finds a known offset."""

import numpy as np
import pytest
from synthetic import hunting_run

import wrcore as wr
from wrcore.signals.filters import low_pass, on_grid, zero_phase
from wrcore.signals.signal import signal_of_run

RATE = 500.0
T = np.arange(0.0, 20.0, 1.0 / RATE)
MIDDLE = slice(2500, -2500)


def amplitude_and_phase(values, frequency):
    """Amplitude and phase of a harmonic in the middle of a signal."""
    wave = np.exp(-2j * np.pi * frequency * T[MIDDLE])
    found = 2.0 * np.mean(values[MIDDLE] * wave)
    return abs(found), np.angle(found)


@pytest.mark.parametrize(
    ("band", "frequency"), [((None, 20.0), 20.0), ((4.0, None), 4.0), ((None, 20.0), 40.0), ((4.0, None), 2.0)]
)
def test_amplitudes_of_filters_are_those_of_butterworth(band, frequency):
    """Two passes of second order: 1 / (1 + (sqrt(2) - 1) r^4), r the quotient of frequencies that the bilinear
    transform has warped."""
    low, high = band
    warped = np.tan(np.pi * frequency / RATE) / np.tan(np.pi * (low or high) / RATE)
    expected = 1.0 / (1.0 + (np.sqrt(2.0) - 1.0) * (warped if high else 1.0 / warped) ** 4)
    found, phase = amplitude_and_phase(zero_phase(np.cos(2 * np.pi * frequency * T), RATE, band), frequency)
    assert found == pytest.approx(expected, rel=1e-4) and abs(phase) < 1e-6


def test_a_band_keeps_its_middle_and_removes_mean_and_high_frequencies():
    values = 3.0 + np.cos(2 * np.pi * 2.0 * T) + np.cos(2 * np.pi * 100.0 * T)
    signal = wr.Signal("t_s", T, {"a": values}).filtered((0.4, 10.0))
    assert amplitude_and_phase(signal["a"], 2.0)[0] == pytest.approx(1.0, abs=5e-3)
    assert amplitude_and_phase(signal["a"], 100.0)[0] < 1e-3 and abs(signal["a"][MIDDLE].mean()) < 1e-3


def test_low_pass_forwards_begins_steady():
    assert low_pass(np.full(50, 2.0), 100.0, 20.0) == pytest.approx(2.0)


def test_a_coarser_grid_has_no_aliases_and_a_finer_one_interpolates():
    fast, slow = np.cos(2 * np.pi * 70.0 * T), np.cos(2 * np.pi * 3.0 * T)  # 70 Hz would appear as 20 Hz
    signal = wr.Signal("t_s", T, {"fast": fast, "slow": slow}).resampled(0.02)
    inside = slice(50, -50)
    assert np.abs(signal["fast"][inside]).max() < 2e-3
    np.testing.assert_allclose(signal["slow"][inside], np.cos(2 * np.pi * 3.0 * signal.x)[inside], atol=1e-4)
    finer = signal.resampled(0.001)
    np.testing.assert_allclose(finer["slow"][2000:-2000], np.cos(2 * np.pi * 3.0 * finer.x)[2000:-2000], atol=1e-3)


def test_gaps_stay_gaps_and_uneven_samples_become_even():
    x = np.sort(np.random.default_rng(1).uniform(0.0, 10.0, 4000))
    values = np.sin(x)
    values[(x > 4.0) & (x < 5.0)] = np.nan
    grid = np.arange(0.1, 9.9, 0.05)
    found = on_grid(x, values, grid)
    assert np.isnan(found[(grid > 4.01) & (grid < 4.99)]).all()
    known = np.isfinite(found)
    assert known.sum() > len(grid) - 25
    np.testing.assert_allclose(
        found[known & (abs(grid - 4.5) > 1.0)], np.sin(grid[known & (abs(grid - 4.5) > 1.0)]), atol=2e-3
    )


@pytest.mark.parametrize("step", [0.002, 0.0031, 0.01])
def test_alignment_finds_a_known_offset_below_the_step(step):
    """A sum of waves that does not repeat, cut out of the run's time, with noise of 20 %."""
    random = np.random.default_rng(3)
    frequencies, phases = random.uniform(0.5, 8.0, 12), random.uniform(0.0, 6.3, 12)

    def motion(t):
        return np.sin(2 * np.pi * np.outer(t, frequencies) + phases).sum(axis=1) / 3.5

    run = hunting_run(duration=20.0)
    run.groups["wheelset"]["y_m"] = motion(run.t)
    t = np.arange(5.0, 13.0, step)
    signal = wr.Signal("t_s", t - 3.21, {"wheelset.y_m": motion(t) + random.normal(0.0, 0.2, len(t))})
    error = 4.0 * 0.2 / np.sqrt(len(t) * np.mean(np.gradient(motion(t), step) ** 2))  # Cramer-Rao: four deviations
    aligned = signal.aligned(run, "wheelset.y_m")
    assert error < 2e-3 and aligned.x[0] - signal.x[0] == pytest.approx(3.21, abs=error)
    assert signal.aligned(run, "wheelset.y_m", band=(None, 10.0)).x[0] == pytest.approx(5.0, abs=error)


def test_alignment_over_distance_finds_a_chainage():
    random = np.random.default_rng(4)
    run = hunting_run(duration=20.0)
    run.groups["wheelset"]["y_m"] = np.convolve(random.normal(size=len(run.t)), np.hanning(60), "same")
    s = np.arange(100.0, 300.0, 0.25)
    y = np.interp(s, run["wheelset"].x_m, run["wheelset"].y_m)
    signal = wr.Signal("s_m", s + 12_450.0, {"wheelset.y_m": y})
    assert signal.aligned(run, "wheelset.y_m").x[0] == pytest.approx(100.0, abs=0.02)


def test_a_periodic_motion_and_a_weak_correlation_are_doubtful(capsys):
    run = hunting_run(growth=0.0, duration=20.0)
    t = np.arange(0.0, 8.0, 0.005)
    wr.Signal("t_s", t, {"wheelset.y_m": np.sin(2 * np.pi * 2.6 * t)}).aligned(run, "wheelset.y_m")
    assert "a shift 0.385 s away fits" in capsys.readouterr().err
    noise = np.random.default_rng(0).normal(size=len(t))
    wr.Signal("t_s", t, {"wheelset.y_m": noise}).aligned(run, "wheelset.y_m")
    assert "correlation coefficient of only" in capsys.readouterr().err
    with pytest.raises(wr.InputError, match="expected a channel that varies"):
        wr.Signal("t_s", t, {"wheelset.y_m": np.ones(len(t))}).aligned(run, "wheelset.y_m")


def test_a_signal_over_time_becomes_one_over_distance_without_standstill():
    t = np.arange(0.0, 10.0, 0.1)
    s = np.where(t < 3.0, 20.0 * t, np.where(t < 5.0, 60.0, 60.0 + 20.0 * (t - 5.0)))
    signal = wr.Signal("t_s", t, {"d_m": s, "y_m": s / 1e3}).over_distance("d_m")
    assert signal.axis == "s_m" and signal.keys() == ["y_m"]
    np.testing.assert_allclose(signal["y_m"], signal.x / 1e3)
    assert wr.Signal("t_s", t, {"y_m": s}).over_distance(25.0).x[-1] == pytest.approx(25.0 * t[-1])


def test_a_run_becomes_a_signal_over_its_distance():
    signal = signal_of_run(hunting_run(), ["wheelset.y_m"], "s_m")
    np.testing.assert_allclose(signal.x, hunting_run()["wheelset"].x_m)
    with pytest.raises(wr.InputError, match="one value at a time"):
        signal_of_run(hunting_run(), ["wheelset/left.N_N"])


@pytest.mark.parametrize(
    ("act", "expected"),
    [
        (lambda s: s.filtered((5.0, 2.0)), "expected corners above 0 and below 250 Hz"),
        (lambda s: s.filtered((None, 400.0)), "below 250 Hz"),
        (lambda s: s.filtered((1.0,)), "band: expected a lower and an upper corner"),
        (lambda s: s.resampled(100.0), "expected a step below the 19.998 of the signal"),
        (lambda s: s.resampled(1e-300), "at most 5e.07 steps"),
        (lambda s: s.cut(30.0), "expected a part of 0 to 19.998"),
        (lambda s: s["z"], "no channel 'z' in this signal; it has y"),
        (lambda s: wr.Signal("t", T, {}), "axis: expected one of t_s, s_m"),
        (lambda s: wr.Signal("t_s", -T, {}), "x: expected two increasing numbers"),
        (lambda s: wr.Signal("t_s", T, {"a": T[1:]}), "a: expected 10000 values"),
    ],
)
def test_a_wrong_argument_is_one_line(act, expected):
    with pytest.raises(wr.InputError, match=expected):
        act(wr.Signal("t_s", T, {"y": T}))
