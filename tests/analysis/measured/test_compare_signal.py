"""A run against a signal: differences, spectra and validation numbers are those computed by hand."""

import numpy as np
import pytest
from synthetic import hunting_run

import wrcore as wr
from wrcore.analysis.measured.spectra import spectra_of
from wrcore.analysis.measured.validation import sections_of_length

RANDOM = np.random.default_rng(5)


def run_with(y, duration=20.0, path="tangent"):
    run = hunting_run(duration=duration)
    run.groups["wheelset"]["y_m"] = y(run.t)
    run.scene["track"] = {"path": path}
    return run


def sine(t):
    return 1e-3 * np.sin(2 * np.pi * 2.0 * t)


def test_differences_are_those_of_known_waves():
    run, t = run_with(sine), np.arange(2.0, 12.0, 0.001)
    found = wr.compare(run, wr.Signal("t_s", t, {"wheelset.y_m": 0.5 * sine(t) + 2e-3, "other.z_m": t}))
    row = found.table.iloc[0]
    assert found.table["channel"].tolist() == ["wheelset.y_m"] and row["unit"] == "m"
    assert len(found.run.x) == pytest.approx(2000, abs=2) and found.run.step == pytest.approx(0.005)
    np.testing.assert_array_equal(found.run.x, found.signal.x)
    assert row["mean"] == pytest.approx(-2e-3, rel=1e-3) and row["max"] == pytest.approx(2.5e-3, rel=1e-3)
    assert row["ratio"] == pytest.approx(2.0, rel=1e-3) and row["correlation"] == pytest.approx(1.0, abs=1e-4)
    assert row["relative"] == pytest.approx(1.0, rel=1e-3)
    assert row["rms"] == pytest.approx(np.sqrt(4e-6 + 0.125e-6), rel=1e-3)
    assert "wheelset.y_m" in repr(found) and "0 to" not in repr(found).splitlines()[0]


def test_a_band_filters_both_alike():
    run, t = run_with(lambda t: sine(t) + 1e-3 * np.sin(2 * np.pi * 40.0 * t)), np.arange(0.0, 20.0, 0.002)
    signal = wr.Signal("t_s", t, {"wheelset.y_m": sine(t) + 5e-3})
    assert wr.compare(run, signal).table["relative"].item() > 0.9
    row = wr.compare(run, signal, band=(0.2, 10.0)).table.iloc[0]
    assert row["relative"] < 0.03 and abs(row["mean"]) < 1e-5


def test_gaps_of_the_signal_are_left_out():
    run, t = run_with(sine), np.arange(0.0, 20.0, 0.005)
    y = np.where((t > 5.0) & (t < 10.0), np.nan, sine(t))
    row = wr.compare(run, wr.Signal("t_s", t, {"wheelset.y_m": y})).table.iloc[0]
    assert row["samples"] == pytest.approx(3000, abs=5) and row["rms"] < 1e-7


def test_a_signal_over_distance_is_compared_over_distance():
    run = run_with(sine)
    s = np.arange(50.0, 300.0, 0.2)
    found = wr.compare(run, wr.Signal("s_m", s, {"wheelset.y_m": sine(s / 20.0)}))
    assert found.run.axis == "s_m" and found.run.x[0] == pytest.approx(50.0) and found.table["relative"].item() < 1e-3
    assert found.plot().axes[-1].get_xlabel() == "distance / m"


def test_statistics_of_sections_and_their_differences():
    """Sections with amplitudes 1 to 4 mm in the run and 10 % less in the signal, with means of -8 mm in both."""
    steps = np.array([1.0, 2.0, 3.0, 4.0])

    def y(t, factor):
        return factor * steps[np.minimum(t // 5.0, 3).astype(int)] * sine(t) - 8e-3

    run, t = run_with(lambda t: y(t, 1.0)), np.arange(0.0, 20.0, 0.005)
    signal = wr.Signal("t_s", t, {"wheelset.y_m": y(t, 0.9)})
    limits = {"y_m": {"maximum": (0.3e-3, 0.2e-3), "median": (1e-3, 1e-3), "rms": (1e-9, 1.0)}}
    found = wr.compare(run, signal, sections=5.0, limits=limits)
    assert len(found.sections) == 4 * 3
    table = found.validation.set_index("statistic")
    differences = 0.1e-3 * steps
    assert table.loc["maximum", "mean"] == pytest.approx(differences.mean(), rel=0.02)
    assert table.loc["maximum", "standard_deviation"] == pytest.approx(differences.std(ddof=1), rel=0.02)
    assert table.loc["maximum", "largest"] == pytest.approx(0.4e-3, rel=0.02)
    assert table["values"].tolist() == [4, 4, 4] and table["is_met"].tolist() == [True, True, False]
    larger = wr.compare(run, wr.Signal("t_s", t, {"wheelset.y_m": y(t, 0.9) + 1e-3}), sections=5.0)
    median = larger.validation.set_index("statistic").loc["median", "mean"]
    assert median == pytest.approx(1e-3, rel=0.02)  # -8 mm is a larger amount than -7 mm


def test_quantities_of_all_wheels_are_pooled():
    run = hunting_run(duration=20.0)
    for side in ("left", "right"):
        run.groups[f"wheelset/{side}"]["Q_N"] = 50e3 + 1e3 * np.sin(run.t)
    channels = {
        f"wheelset/{side}.Q_N": 50e3 + 1e3 * np.sin(run.t) + add for side, add in (("left", 1e3), ("right", -1e3))
    }
    found = wr.compare(run, wr.Signal("t_s", run.t, channels), sections=4.0)
    median = found.validation.set_index("statistic").loc["median"]
    assert median["values"] == 10 and median["mean"] == pytest.approx(0.0, abs=1e-6)
    assert median["standard_deviation"] == pytest.approx(1e3 * np.sqrt(10 / 9), rel=1e-6)


def test_sections_are_those_of_the_path_by_default():
    path = [{"tangent": 100.0}, {"transition": 50.0}, {"curve": 200.0, "radius": 600.0}]
    run = run_with(sine, path=path)
    signal = wr.Signal("t_s", run.t, {"wheelset.y_m": sine(run.t)})
    edges = wr.compare(run, signal).sections[["begin", "end"]].drop_duplicates().to_numpy()
    np.testing.assert_allclose(edges[:3], [[0.0, 5.0], [7.5, 12.5], [12.5, 17.5]], atol=0.01)
    assert wr.compare(run, signal, sections=[(1.0, 2.0)]).sections["end"].unique().tolist() == [2.0]
    assert sections_of_length(0.0, 10.4, 4.0) == [(0.0, 4.0), (4.0, 8.0), (8.0, 12.0)]


def test_sections_without_samples_have_no_rows():
    run = run_with(sine)
    found = wr.compare(run, wr.Signal("t_s", run.t, {"wheelset.y_m": sine(run.t)}), sections=[(100.0, 200.0)])
    assert found.sections.empty and found.validation.empty and "correlation" in repr(found)


def test_spectra_find_density_transfer_and_coherence():
    """White noise of 2 mm at 200 Hz has the density (2 mm)^2 / 100 Hz; a run of three times the signal plus noise."""
    signal = RANDOM.normal(0.0, 2e-3, 40_000)
    run = 3.0 * signal + RANDOM.normal(0.0, 6e-3, 40_000)
    table = spectra_of(run, signal, 200.0).iloc[5:-5]
    assert table["signal"].mean() == pytest.approx(4e-6 / 100.0, rel=0.03)
    assert table["transfer"].median() == pytest.approx(3.0, rel=0.05) and abs(table["phase_rad"].median()) < 0.05
    many = spectra_of(np.tile(run, 4), np.tile(signal, 4), 200.0)["coherence"].iloc[5:-5]
    assert 0.3 < many.median() < 0.7  # 9 / (9 + 9)


def test_figures_have_units():
    run, t = run_with(sine), np.arange(0.0, 20.0, 0.002)
    found = wr.compare(run, wr.Signal("t_s", t, {"wheelset.y_m": sine(t)}))
    axes = found.plot("wheelset.y_m").axes
    assert [one.get_ylabel() for one in axes] == ["y / mm", "difference / mm"]
    labels = [one.get_ylabel() for one in found.plot_spectra().axes]
    assert labels == ["density / (mm)² /Hz", "run over measured", "coherence"]


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"limits": {"z_m": {"rms": (1, 1)}}}, "compare: limits z_m: expected one of y_m"),
        ({"limits": {"y_m": {"mean": (1, 1)}}}, "expected one of maximum, median, rms"),
        ({"limits": {"y_m": {"rms": 1.0}}}, "expected the limit of the mean and that of the standard"),
        ({"limits": {"y_m": (1, 2)}}, "expected pairs by statistic"),
        ({"sections": 1e-4}, "expected a length above 0.005"),
        ({"sections": []}, "expected pairs of a begin"),
        ({"sections": [(2.0, 1.0)]}, "expected pairs of a begin and a greater end"),
        ({"band": (20.0, 300.0)}, "expected corners above 0"),
    ],
)
def test_a_wrong_argument_is_one_line(options, expected):
    run = run_with(sine)
    with pytest.raises(wr.InputError, match=expected):
        wr.compare(run, wr.Signal("t_s", run.t, {"wheelset.y_m": sine(run.t)}), **options)


def test_signals_that_do_not_fit_the_run_are_one_line():
    run = run_with(sine)
    with pytest.raises(wr.InputError, match="expected a run and a signal that overlap.*100 to"):
        wr.compare(run, wr.Signal("t_s", run.t + 100.0, {"wheelset.y_m": run.t}))
    with pytest.raises(wr.InputError, match="channels: expected a channel of the run, got bogie.y_m"):
        wr.compare(run, wr.Signal("t_s", run.t, {"bogie.y_m": run.t}))
    with pytest.raises(wr.InputError, match="compare: band: expected a signal"):
        wr.compare(run, run, band=(1.0, 2.0))
