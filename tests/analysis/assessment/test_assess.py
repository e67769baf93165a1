"""Filters against their own definitions, sections against the path, percentiles and limits of synthetic signals."""

import dataclasses

import numpy as np
import pytest
from scipy import signal

import wrcore as wr
from tests.synthetic import CONTACT
from wrcore.analysis.assessment.assess import (
    assess,
    low_pass,
    section_statistics,
    section_table,
    sliding_mean,
    track_sections,
)
from wrcore.analysis.assessment.wheels import output_times_after
from wrcore.analysis.legible import findings
from wrcore.cli import main
from wrcore.errors import InputError
from wrcore.run.output.run import Run

RATE, SPEED, LOAD = 1000.0, 20.0, 60e3


def synthetic(forces, path="tangent", duration=60.0, places=lambda t: SPEED * t):
    """Run of one wheelset; ``forces`` gives Q and Y of the wheels over time as functions of time and side (+1, -1)."""
    t = np.arange(int(duration * RATE) + 1) / RATE
    groups = {"wheelset": {"x_m": places(t), "s_m": places(t), "vx_m_per_s": np.full_like(t, SPEED)}}
    groups["wheelset"] |= {"vy_m_per_s": np.zeros_like(t), "vz_m_per_s": np.zeros_like(t)}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        channels = {name: np.zeros((len(t), 3)) for name in CONTACT}
        for name in CONTACT:
            channels[name][:, 1:] = np.nan
        vertical, lateral = forces(t, sign)
        channels["N_N"][:, 0] = vertical  # on a level contact plane
        channels["Fy_N"][:, 0] = -sign * lateral
        channels["a_m"][:, 0] = channels["b_m"][:, 0] = 5e-3
        groups[f"wheelset/{side}"] = channels
    scene = {"name": "synthetic", "speed": SPEED, "track": {"path": path}}
    return Run(scene, "completed", "", t, groups)


def test_low_pass_is_scipys_butterworth_and_starts_settled():
    t = np.arange(20000) / RATE
    for frequency in (5.0, 20.0, 60.0):
        filtered = low_pass(7.0 + np.sin(2 * np.pi * frequency * t), RATE)
        size = np.sqrt(2.0) * np.std(filtered[10000:])
        sos = signal.butter(4, 20.0, fs=RATE, output="sos")
        assert size == pytest.approx(abs(signal.sosfreqz(sos, [frequency], fs=RATE)[1][0]), rel=1e-3)
    assert np.abs(low_pass(np.full(100, 7.0), RATE) - 7.0).max() < 1e-9
    np.testing.assert_allclose(abs(signal.sosfreqz(sos, [20.0], fs=RATE)[1]), np.sqrt(0.5), rtol=1e-6)


def test_sliding_mean_over_the_way():
    s = np.cumsum(np.random.default_rng(0).uniform(0.01, 0.03, 5000))  # uneven speed
    np.testing.assert_allclose(sliding_mean(s, 3.0 * s + 1.0)[200:-200], (3.0 * s + 1.0)[200:-200], atol=3e-4)
    wave = sliding_mean(s, np.sin(2 * np.pi * s / 5.0))
    factor = np.sin(np.pi * 2.0 / 5.0) / (np.pi * 2.0 / 5.0)  # of a mean over 2 m of a wave of 5 m
    np.testing.assert_allclose(wave[200:-200], factor * np.sin(2 * np.pi * s / 5.0)[200:-200], atol=1e-3)
    gap = 3.0 * s + 1.0
    gap[2000] = np.nan
    whole = (s > s[0] + 1.0) & (s < s[-1] - 1.0)
    np.testing.assert_array_equal(np.isfinite(sliding_mean(s, gap)), whole)


def test_only_whole_windows_count():
    """A wave of 2 m has a mean of 0 over 2 m, at the ends of a run, too."""

    def forces(t, sign):
        return np.full_like(t, LOAD), 10e3 * np.cos(2 * np.pi * 10.0 * t) * (sign > 0)

    for duration in (1.0, 20.0):
        table = assess(synthetic(forces, duration=duration)).summary.set_index("quantity")
        assert table.loc["sum_Y", "value"] < 5.0 and table.loc["Y_over_Q", "value"] < 1e-4
    with pytest.raises(InputError, match=r"at least 2 m of way after the first 0.2 s.*, got 1.9 m of wheelset"):
        assess(synthetic(forces, duration=0.295))


def worst(wave, speed=SPEED, duration=6.0):
    """Values of sum_Y and left Y/Q of a left wheel's lateral force (N) over time."""
    run = synthetic(
        lambda t, sign: (np.full_like(t, LOAD), wave(t) * (sign > 0)), duration=duration, places=lambda t: speed * t
    )
    table = assess(run).summary.set_index("quantity")["value"]
    return table["sum_Y"], LOAD * table["Y_over_Q"]


@pytest.mark.parametrize("frequency", [10.0, 40.0])
def test_mean_of_a_sine_is_damped_by_filter_and_window(frequency):
    """At 12.7 m/s steps of 0.5 m meet all phases; the integral over 25 points a period of 40 Hz is 1.2 % low."""
    passed = 1.0 / np.sqrt(1.0 + (np.tan(np.pi * frequency / RATE) / np.tan(np.pi * 20.0 / RATE)) ** 8)
    expected = 1e6 * passed * abs(np.sinc(frequency * 2.0 / 12.7))
    for value in worst(lambda t: 1e6 * np.sin(2 * np.pi * frequency * t), speed=12.7, duration=20.0):
        assert value == pytest.approx(expected, rel=0.015)


def test_mean_of_a_constant_and_of_a_step():
    """A constant passes, beginning and end included; a step is a ramp over 2 m, delayed by the low-pass."""
    for value in worst(lambda t: np.full_like(t, 3e3)):
        assert value == pytest.approx(3e3, rel=1e-9)
    force = synthetic(lambda t, sign: (np.full_like(t, LOAD), np.where(t < 1.0, 0.0, 4e3) * (sign > 0)), duration=2.0)
    mean = assess(force).series["sum_Y"]["wheelset"].squeeze()
    assert np.isnan(mean.loc[:0.249]).all() and np.isfinite(mean.loc[0.251:1.949]).all()
    delay = 2.613 / (2 * np.pi * 20.0)  # of the low-pass at 0 Hz
    rising = np.linspace(1.0, 1.05, 6)
    ramp = 4e3 * (0.5 + (rising - 1.0 - delay) * SPEED / 2.0)
    np.testing.assert_allclose(np.interp(rising, mean.index, mean), ramp, atol=40.0)


def test_percentiles_of_means_are_of_steps_of_half_a_metre():
    """A short push is in five of 118 means at 0.5 m; percentiles of so few are not those of all output times."""
    run = synthetic(lambda t, sign: (np.full_like(t, LOAD), 9e3 * np.exp(-(((t - 1.5) / 0.01) ** 2)) * (sign > 0)),
                    duration=3.2)  # fmt: skip
    found = assess(run)
    row = found.sections.query("quantity == 'sum_Y'").iloc[0]
    mean = found.series["sum_Y"]["wheelset"].squeeze().dropna()
    some = mean.to_numpy()[np.searchsorted(SPEED * mean.index, np.arange(5.0, 63.01, 0.5) - 1e-6)]
    assert len(some) == 117 and row["p99_85"] == pytest.approx(np.percentile(some, 99.85), rel=1e-3)
    assert row["p99_85"] < 0.999 * np.percentile(mean, 99.85)


def test_an_unloaded_wheel_does_not_spoil_the_mean():
    """Y/Q of 0.2 but for 0.1 s without a load: 0.2 all along, and no mean where a window lies in the air."""

    def forces(t, sign):
        load = np.where((t > 1.0) & (t < 1.3), 0.0, LOAD)
        return load, 0.2 * load

    found = assess(synthetic(forces, duration=3.0))
    ratio = found.series["Y_over_Q"]["wheelset"]["left"]
    assert ratio.dropna().to_numpy() == pytest.approx(0.2) and ratio.loc[1.06:1.24].isna().all()
    assert ratio.loc[1.4:2.9].notna().all()


@pytest.mark.parametrize(
    "path", ["tangent", [{"tangent": 30.0}, {"transition": 20.0}, {"curve": 100.0, "radius": 600}]]
)
def test_a_run_that_rolls_back_is_assessed(path):
    """20 m ahead, at rest for a second, then 60 m back, beyond where it began."""

    def forces(t, sign):
        return LOAD + 1e3 * sign, np.where(t > 5.0, 7e3, 4e3) * (sign > 0)

    def places(t):
        return np.interp(t, [0.0, 1.0, 2.0, 5.0], [0.0, 20.0, 20.0, -40.0])

    found = assess(synthetic(forces, path, 6.0, lambda t: places(np.minimum(t, 5.0))))
    table = found.summary.set_index("quantity")
    assert table.loc["sum_Y", "value"] == pytest.approx(4e3, rel=1e-9)
    assert table.loc["Q", "value"] == pytest.approx(LOAD + 1e3, rel=1e-6)
    assert (table.loc["Q", "begin_m"], table.loc["Q", "end_m"]) == (-40.0, 20.0)
    back = assess(synthetic(forces, path, 5.0, places), begin=2.0).summary.set_index("quantity")
    assert back.loc["sum_Y", "begin_m"] == pytest.approx(-39.0, abs=0.03)
    backwards = assess(synthetic(forces, path, 5.0, lambda t: -SPEED * t)).summary.set_index("quantity")
    assert backwards.loc["sum_Y", "value"] == pytest.approx(4e3, rel=1e-9)


def test_each_wheelset_has_its_own_limit():
    """The heavy wheelset has the larger force, the light one is nearer to its limit."""
    run, light = (
        synthetic(lambda t, sign, q=q, y=y: (np.full_like(t, q), np.full_like(t, y) * (sign > 0)), duration=2.0)
        for q, y in ((100e3, 30e3), (25e3, 20e3))
    )
    run.groups |= {name.replace("wheelset", "light"): channels for name, channels in light.groups.items()}
    table = assess(run).summary.set_index("quantity")
    assert table.loc["sum_Y", "wheelset"] == "light"
    assert table.loc["sum_Y", "value"] == pytest.approx(20e3)
    assert table.loc["sum_Y", "limit"] == pytest.approx(10e3 + 50e3 / 3)


def test_sections_of_a_path():
    path = [{"tangent": 600.0}, {"transition": 80.0}, {"curve": 250.0, "radius": 300.0}, {"transition": 80.0},
            {"curve": 90.0, "radius": -500.0}]  # fmt: skip
    found = track_sections(path, 2000.0)
    assert [(low, high) for low, high, _ in found[:2]] == [(0.0, 300.0), (300.0, 600.0)]
    np.testing.assert_allclose(
        [part[:2] for part in found[2:5]], 680.0 + 250.0 / 3 * np.array([[0, 1], [1, 2], [2, 3]])
    )
    assert found[5] == (1010.0, 1100.0, -500.0) and np.isinf(found[0][2])
    assert len(track_sections("tangent", 1200.0)) == 4
    assert found[6][0] == 1100.0 and found[-1] == (1900.0, 2000.0, -500.0)  # the track goes on as it ended
    assert track_sections(path, 1100.0, -80.0)[:2] == [(-80.0, 260.0, np.inf), (260.0, 600.0, np.inf)]
    assert track_sections(path[1:], 1030.0, -80.0)[0] == (-80.0, 0.0, np.inf)
    assert track_sections("tangent", -5.0, -80.0) == [(-80.0, 0.0, np.inf)]


def test_percentiles_and_limits_of_a_triangular_wave():
    """Its values are spread evenly: 99.85 % of them lie below 0.997 of the amplitude."""

    def forces(t, sign):
        wave = signal.sawtooth(2 * np.pi * t / 2.5, 0.5)
        return LOAD + 5e3 * wave, np.full_like(t, 2e3 if sign > 0 else 5e3)

    found = assess(synthetic(forces))
    table = found.summary.set_index("quantity")
    assert table.loc["Q", "value"] == pytest.approx(LOAD + 0.997 * 5e3, abs=60.0)  # the filter rounds the corners
    assert table.loc["Q", "limit"] == pytest.approx(90e3 + LOAD, rel=1e-3)
    assert table.loc["sum_Y", "value"] == pytest.approx(3e3, rel=1e-9)
    assert table.loc["sum_Y", "limit"] == pytest.approx(10e3 + 2 * LOAD / 3, rel=1e-3)
    assert set(table.index) == {"sum_Y", "Y_over_Q", "Q"}  # no curve, nothing quasi-static
    assert "EN 14363" in repr(found)
    freight = assess(synthetic(forces), freight=True).summary.set_index("quantity")
    assert freight.loc["sum_Y", "limit"] == pytest.approx(0.85 * (10e3 + 2 * LOAD / 3), rel=1e-3)


@pytest.mark.parametrize(("load", "limit"), [(112e3, 200e3), (115e3, np.nan)])
def test_limit_of_heavy_wheels(load, limit):
    found = assess(synthetic(lambda t, sign: (np.full_like(t, load), np.zeros_like(t)), duration=1.0))
    assert found.summary.set_index("quantity").loc["Q", "limit"] == pytest.approx(limit, nan_ok=True)


def test_what_is_recalled_is_marked_in_the_result():
    found = assess(synthetic(lambda t, sign: (np.full_like(t, LOAD), np.zeros_like(t)), duration=1.0))
    assert found.summary["source"].str.contains("limit recalled; low-pass from secondary text, its order chosen").all()
    assert section_statistics([found], k=0.0)["source"].str.contains("recalled").all()


def test_wheels_that_unload_are_no_large_load():
    """Of Q the 99.85 % percentile counts, not the amount of the 0.15 % one."""

    def forces(t, sign):
        return np.where((t > 1.0) & (t < 2.0), -3.0 * LOAD, LOAD), np.zeros_like(t)

    table = assess(synthetic(forces, duration=4.0)).summary.set_index("quantity")
    assert table.loc["Q", "value"] < 1.5 * LOAD


def test_what_lies_before_the_beginning_does_not_count():
    def forces(t, sign):
        return np.where(t < 1.0, 2.0 * LOAD, LOAD), np.zeros_like(t)

    whole, late = (assess(synthetic(forces, duration=4.0), begin=begin).summary for begin in (0.0, 2.0))
    assert whole.set_index("quantity").loc["Q", "value"] > 1.9 * LOAD
    assert late.set_index("quantity").loc["Q", "value"] == pytest.approx(LOAD, rel=1e-3)


def test_quasi_static_values_are_medians_of_full_curves():
    path = [{"tangent": 200.0}, {"transition": 50.0}, {"curve": 900.0, "radius": 600.0}]

    def forces(t, sign):
        curve = np.clip((SPEED * t - 200.0) / 50.0, 0.0, 1.0) + 0.3 * np.sin(2 * np.pi * t)
        return LOAD - 8e3 * sign * curve, np.full_like(t, 3e3) + (20e3 * curve if sign < 0 else 0.0)

    table = assess(synthetic(forces, path)).summary.set_index("quantity")
    assert table.loc["Q_qst", "value"] == pytest.approx(LOAD + 8e3, rel=2e-3)
    assert table.loc["Y_qst", "value"] == pytest.approx(23e3, rel=5e-3)
    assert table.loc["Y_qst", "side"] == "right" and table.loc["Y_qst", "begin_m"] >= 250.0


def test_channels_of_a_wheelset_by_name():
    run = synthetic(lambda t, sign: (np.full_like(t, LOAD), np.full_like(t, 4e3 if sign > 0 else 1e3)), duration=1.0)
    table = run.wheel_forces("wheelset")
    assert table["Q_left_N"].iloc[5] == LOAD and table["Y_right_N"].iloc[5] == 1e3
    assert table["sum_Y_N"].iloc[5] == 3e3 and table["Y_over_Q_left"].iloc[5] == pytest.approx(4e3 / LOAD)
    assert table["p_max_left_Pa"].iloc[5] == pytest.approx(1.5 * LOAD / (np.pi * 25e-6))
    with pytest.raises(KeyError, match="no group"):
        run.wheel_forces("bogie")


def test_a_run_without_what_it_takes_is_refused():
    run = synthetic(lambda t, sign: (np.full_like(t, LOAD), np.zeros_like(t)), duration=1.0)
    with pytest.raises(InputError, match="expected one of EN 14363, EN 12299"):
        wr.assess(run, "UIC 518")
    for begin, says in ((np.nan, "a number, finite"), (-0.1, "0 to 1 s"), (1.001, "0 to 1 s")):
        with pytest.raises(InputError, match=f"begin: expected {says}"):
            wr.assess(run, begin=begin)
    with pytest.raises(InputError, match="expected output times"):
        output_times_after(Run(run.scene, "failed", "at once", run.t[:0], {}), 0.0, "x")
    slow = Run(run.scene, "completed", "", run.t[::5], {})
    with pytest.raises(InputError, match=r"output.rate.*at least 1000 1/s in the scene, got 200"):
        section_table(slow)
    with pytest.raises(InputError, match="channels of contacts, or Q and Y"):
        section_table(Run(run.scene, "completed", "", run.t, {}))


def test_q_and_y_are_enough():
    """A run that keeps Q and Y by name instead of its contacts is worth the same."""
    run = synthetic(lambda t, sign: (LOAD + 1e3 * np.sin(9.0 * t), np.full_like(t, 2e3 + 500.0 * sign)), duration=3.0)
    lean = Run(run.scene, "completed", "", run.t, {"wheelset": run.groups["wheelset"]})
    for side in ("left", "right"):
        wheel = run[f"wheelset/{side}"]
        lean.groups[f"wheelset/{side}"] = {name: wheel[name] for name in ("Q_N", "Y_N")}
    assert assess(lean).summary.equals(assess(run).summary)
    del lean.groups["wheelset/left"]["Y_N"]
    with pytest.raises(InputError, match="channels of contacts, or Q and Y"):
        assess(lean)


def test_command_line(tmp_path, capsys):
    run = synthetic(lambda t, sign: (np.full_like(t, LOAD), np.zeros_like(t)), duration=2.0)
    run.save(tmp_path / "run.h5")
    assert main(["assess", str(tmp_path / "run.h5"), "--out", str(tmp_path / "sections.csv")]) == 0
    assert "sum_Y" in capsys.readouterr().out and (tmp_path / "sections.csv").read_text().startswith("section,")
    assert main(["assess", str(tmp_path / "run.h5"), "--standard", "EN 1"]) == 2
    assert "standard" in capsys.readouterr().err


def test_statistics_over_the_sections_of_many_runs():
    """Constant forces: the sections' values are the runs' forces, their mean and deviation those of four numbers."""
    path = [{"tangent": 500.0}, {"transition": 50.0}, {"curve": 500.0, "radius": -500.0, "cant": 0.1}]
    sizes = np.array([5e3, 7e3, 8e3, 12e3])
    runs = [synthetic(lambda t, sign, y=y: (LOAD + 0.0 * t, sign * y + 0.0 * t), path, 50.0) for y in sizes]
    assessments = [assess(run) for run in runs]
    table = section_statistics(assessments, 2.0).set_index(["quantity", "track", "side"])
    straight, curved = table.loc[("sum_Y", "straight", "")], table.loc[("Y_qst", "wide curves", "left")]
    count = np.count_nonzero(assessments[0].sections.query("quantity == 'sum_Y'")["radius_m"] == np.inf)
    assert straight["sections"] == 4 * count and count > 1 and curved["sections"] % 4 == 0
    for row, values in ((straight, 2.0 * np.repeat(sizes, count)), (curved, np.repeat(sizes, curved["sections"] // 4))):
        assert row["mean"] == pytest.approx(values.mean(), rel=1e-6)
        assert row["standard_deviation"] == pytest.approx(np.std(values, ddof=1), rel=1e-6)
        assert row["largest"] == pytest.approx(values.max(), rel=1e-6)
        assert row["estimated_maximum"] == pytest.approx(values.mean() + 2.0 * np.std(values, ddof=1), rel=1e-6)
        assert row["share"] == pytest.approx(row["estimated_maximum"] / row["limit"])
    assert straight["limit"] == pytest.approx(10e3 + 2.0 * LOAD / 3.0)
    assert ("Y_qst", "straight", "left") not in table.index
    with pytest.raises(InputError, match="expected assessments by EN 14363"):
        section_statistics([*assessments, dataclasses.replace(assessments[0], standard="EN 12299")], 2.0)


def test_its_picture_has_the_filtered_series_and_their_limits():
    path = [{"tangent": 300.0}, {"transition": 30.0}, {"curve": 400.0, "radius": 600}]

    def forces(t, sign):
        return LOAD + 1e3 * np.sin(2 * np.pi * 100.0 * t), np.full_like(t, 7e3) * (sign > 0)

    assessment = assess(synthetic(forces, path, duration=30.0), begin=1.0)
    figure = assessment.plot()
    assert findings(figure) == []
    assert [axes.get_ylabel() for axes in figure.axes] == [
        "sum Y / kN", "Y over Q", "Q / kN", "Y qst / kN", "Q qst / kN",
    ]  # fmt: skip
    limits = assessment.summary.set_index("quantity")["limit"]
    drawn = [{abs(line.get_ydata()[0]) for line in axes.lines if len(line.get_xdata()) == 2} for axes in figure.axes]
    for quantity, factor, found in zip(limits.index, (1e-3, 1.0, 1e-3, 1e-3, 1e-3), drawn, strict=True):
        assert found == {factor * limits[quantity]}
    load = figure.axes[2].lines[0].get_ydata()
    assert np.ptp(load) < 0.02 and load.mean() == pytest.approx(60.0, rel=1e-3)  # 100 Hz do not pass
    assert assessment.series.index[0] == 1.0 and list(assessment.series["sum_Y"]) == [("wheelset", "")]
    with pytest.raises(InputError, match="plot: standard: expected an assessment by EN 14363, got EN 12299"):
        wr.Assessment("EN 12299", assessment.summary.iloc[:0], assessment.sections).plot()


def test_command_draws(tmp_path):
    synthetic(lambda t, sign: (np.full_like(t, LOAD), 0.0 * t), duration=1.0).save(tmp_path / "run.h5")
    assert main(["assess", str(tmp_path / "run.h5"), "--plot", str(tmp_path / "run.svg")]) == 0
    assert "<svg" in (tmp_path / "run.svg").read_text("utf-8")
