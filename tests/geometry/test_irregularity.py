"""Irregularity: smooth between and beyond its samples, reproducible, and with the variance of its spectrum."""

import math

import numpy as np
import pytest
from scipy.fft import next_fast_len
from scipy.integrate import quad

from wrcore.errors import InputError
from wrcore.geometry import irregularity
from wrcore.geometry.irregularity import (
    CHANNELS,
    _fast_length,
    combine,
    generate,
    irregularity_at,
    irregularity_data,
    irregularity_extents,
    no_irregularity,
    read_irregularity,
    spectrum,
)
from wrcore.geometry.track import build_track

SPECTRUM = {"level": "low", "seed": 7, "length": 300.0}


def at(data, s):
    """Values and two derivatives, (3, 4)."""
    out = np.full((3, 4), np.nan)
    assert irregularity_at(data, s, out)
    return out


@pytest.fixture(scope="module")
def generated():
    return build_track({"irregularity": {"spectrum": SPECTRUM}}, "test").irregularity


def test_perfect_rails_leave_the_output_alone():
    out = np.full((3, 4), 3.0)
    assert not irregularity_at(no_irregularity(), 1.0, out)
    assert (out == 3.0).all()


def test_spline_runs_through_the_samples_of_each_channel():
    random = np.random.default_rng(1)
    values = np.vstack((np.zeros(4), 1e-3 * random.standard_normal((30, 4)), np.zeros(4)))
    data = irregularity_data(100.0, 0.25, values)
    for i, row in enumerate(values):
        assert at(data, 100.0 + 0.25 * i)[0] == pytest.approx(row, abs=1e-15)


def test_spline_converges_with_the_fourth_power_of_the_step():
    # interpolation error of a cubic spline: h^4; of its derivatives h^3 and h^2
    errors = []
    for count in (100, 200):
        s = np.linspace(0.0, 50.0, count + 1)
        data = irregularity_data(0.0, 50.0 / count, 1e-3 * np.sin(np.pi * s / 50.0)[:, None] ** 8 * np.ones(4))
        fine = np.linspace(10.0, 40.0, 997)
        phase = np.pi * fine / 50.0
        first = 8e-3 * np.pi / 50.0 * np.sin(phase) ** 7 * np.cos(phase)
        found = np.array([at(data, v)[:2, 2] for v in fine])
        errors.append(np.abs(found - np.stack([1e-3 * np.sin(phase) ** 8, first], -1)).max(0))
    rates = np.log2(errors[0] / errors[1])
    assert rates == pytest.approx([4.0, 3.0], abs=0.25)


def test_spline_is_c2_everywhere_and_zero_outside(generated):
    start, step, cells = generated.starts[0], generated.steps[0], len(generated.coefficients)
    scale = np.abs([at(generated, s) for s in np.arange(start, start + cells * step, step)]).max(0)
    for i in range(cells + 1):
        border = start + i * step
        jump = np.abs(at(generated, border + 1e-9) - at(generated, border - 1e-9))
        # over 2e-9 m a continuous quantity changes by its next derivative; the third is at most scale[2] * 2 / step
        assert (jump <= 1e-12 * scale + 2e-9 * np.vstack((scale[1:], 4.0 * scale[2] / step))).all()
    for s in (start - 1.0, start + cells * step + 1e-6, math.inf, -math.inf, math.nan):
        assert (at(generated, s) == 0.0).all()


@pytest.mark.parametrize("s", [30.1, 77.77, 150.0, 281.3])
def test_derivatives_are_those_of_the_values(generated, s):
    h = 1e-3
    here, before, after = (at(generated, v) for v in (s, s - h, s + h))
    # the spline's third derivative is of order 1e-3: h^2 / 6 of it is 2e-10
    assert (after[0] - before[0]) / (2.0 * h) == pytest.approx(here[1], abs=1e-9)
    assert (after[1] - before[1]) / (2.0 * h) == pytest.approx(here[2], abs=2e-6)


def test_channels_combine_means_and_differences():
    left_y, left_z, right_y, right_z = combine(*np.array([[1.0], [2.0], [0.4], [0.6]])).T
    assert (left_y + right_y) / 2 == pytest.approx(1.0) and left_y - right_y == pytest.approx(0.6)
    assert (left_z + right_z) / 2 == pytest.approx(2.0) and left_z - right_z == pytest.approx(0.4)


# S at 0.5 rad/m, worked out by hand from FACTS 11: A 0.67997 / ((0.25 + 0.00042436)(0.25 + 0.67997)), times
# 0.25 / (0.5625 (0.25 + 0.19184)) for the angle
SPECTRA = [
    ("level", "low", 1.17723e-6), ("level", "high", 3.15330e-6),
    ("alignment", "low", 6.18697e-7), ("alignment", "high", 1.78833e-6),
    ("cross_angle", "low", 1.18417e-6),
    # 0.25 A 0.67980 / (0.25 (0.25 + 0.67980)); 4 times 0.25 A_v 0.67980 / (0.92980 (0.25 + W_s^2)), over 2.25
    ("level", "fra_5", 1.53171e-5), ("alignment", "fra_5", 5.57117e-6), ("cross_angle", "fra_5", 7.36850e-6),
    ("level", "fra_6", 2.47851e-6), ("alignment", "fra_6", 2.47851e-6), ("cross_angle", "fra_6", 2.49310e-6),
]  # fmt: skip


@pytest.mark.parametrize(("quantity", "level", "value"), SPECTRA)
def test_spectra_have_their_published_values(quantity, level, value):
    assert spectrum(quantity, level, 0.5) == pytest.approx(value, rel=1e-5)


@pytest.mark.parametrize("level", ["low", "high", "fra_5"])
def test_variance_of_a_whole_period_is_the_integral_of_the_one_sided_spectrum(monkeypatch, level):
    # over a whole period each cosine has variance a^2 / 2 exactly: what is left is Simpson's rule on 1500 shares
    monkeypatch.setattr("wrcore.geometry.irregularity._fast_length", lambda least: least // 2)
    s, values = generate(level, 3, 2400.0 - 0.25, 0.25, 3.0, 80.0)
    assert len(s) == 9600
    mean, difference = 0.5 * (values[:, :2] + values[:, 2:]), values[:, 1] - values[:, 3]
    for found, quantity in ((mean[:, 0], "alignment"), (mean[:, 1], "level"), (difference / 1.5, "cross_angle")):
        integral, _ = quad(lambda w, q=quantity: float(spectrum(q, level, w)), 2 * np.pi / 80, 2 * np.pi / 3)
        assert found.var() == pytest.approx(integral, rel=1e-5), quantity
    assert values[:, 0] == pytest.approx(values[:, 2], abs=1e-18)  # no change of gauge


def test_waves_of_american_spectra_are_as_high_as_the_page_says():
    for level, rms in (("low", 2.1e-3), ("high", 3.4e-3), ("fra_6", 3.0e-3), ("fra_5", 7.6e-3)):
        variance, _ = quad(lambda w, of=level: float(spectrum("level", of, w)), 2 * np.pi / 80, 2 * np.pi / 3)
        assert math.sqrt(variance) == pytest.approx(rms, abs=0.06e-3)


def test_variance_over_seeds_is_the_integral_within_the_sampling_error():
    # half a period of each of 60 seeds; the means' standard error is measured from the seeds themselves
    squares = np.array([(generate("low", seed, 1000.0, 0.25, 3.0, 80.0)[1] ** 2).mean(0) for seed in range(60)])
    level, _ = quad(lambda w: float(spectrum("level", "low", w)), 2 * np.pi / 80, 2 * np.pi / 3)
    angle, _ = quad(lambda w: float(spectrum("cross_angle", "low", w)), 2 * np.pi / 80, 2 * np.pi / 3)
    expected = level + 0.75**2 * angle
    error = squares[:, 1].std() / math.sqrt(60)
    assert error < 0.05 * expected  # else the next line would say nothing
    assert abs(squares[:, 1].mean() - expected) < 3.5 * error


def test_only_the_stated_band_is_present():
    s, values = generate("high", 5, 2000.0, 0.25, 3.0, 80.0)
    window = np.hanning(len(s))[:, None] ** 2
    power = (np.abs(np.fft.rfft(values * window, axis=0)) ** 2).sum(1)
    omega = 2.0 * np.pi * np.fft.rfftfreq(len(s), 0.25)
    inside = (omega > 2 * np.pi / 80 - 0.03) & (omega < 2 * np.pi / 3 + 0.03)
    assert power[~inside].sum() < 1e-9 * power.sum()


def test_seeds_reproduce_and_differ():
    one, same, other = (generate("low", seed, 200.0, 0.25, 3.0, 80.0)[1] for seed in (11, 11, 12))
    assert (one == same).all()
    # correlation of independent tracks of 200 m stays far below 1
    assert abs(np.corrcoef(one[:, 1], other[:, 1])[0, 1]) < 0.7


def test_fades_and_position_are_the_stated_ones():
    keys = {"spectrum": {**SPECTRUM, "begin": 50.0}, "fade_in": 30.0, "fade_out": 0.5}
    data = build_track({"irregularity": keys}, "test").irregularity
    s, values = generate("low", 7, 300.0, 0.25, 3.0, 80.0)
    # untouched between the fades; half as large in the middle of the fade; nothing before
    for i in (120, 700, 1190):
        assert at(data, 50.0 + s[i])[0] == pytest.approx(values[i], abs=1e-15)
    assert at(data, 65.0)[0] == pytest.approx(0.5 * values[60], abs=1e-15)
    # ahead of its first sample the spline dies out, by 0.268 per cell: a millionth of the amplitude of 1 mm
    assert np.abs(at(data, 49.9)[0]).max() < 1e-9


def write(tmp_path, text):
    path = tmp_path / "track.csv"
    path.write_text(text)
    return path


def test_points_are_read_and_found_beside_the_scene(tmp_path):
    rows = "\n".join(f"{0.5 * i},{1e-3 * math.sin(0.3 * i)},{2e-4 * i}" for i in range(41))
    write(tmp_path, f"# measured\ns_m,left_vertical_m,right_lateral_m\n{rows}\n")
    keys = {"irregularity": {"points": "track.csv", "fade_in": 5.0, "fade_out": 5.0}}
    data = build_track(keys, "test", tmp_path).irregularity
    found = at(data, 10.0)[0]
    assert dict(zip(CHANNELS, found, strict=True)) == pytest.approx(
        {"left_lateral": 0.0, "left_vertical": 1e-3 * math.sin(6.0), "right_lateral": 4e-3, "right_vertical": 0.0},
        abs=1e-15,
    )
    assert (build_track(keys, "test", tmp_path / "scenes").irregularity.coefficients == data.coefficients).all()


def test_points_as_means_and_at_varying_distances(tmp_path):
    s = np.cumsum(np.where(np.arange(200) % 3, 0.2, 0.3))
    level = 1e-3 * np.sin(0.5 * s)
    rows = "\n".join(f"{a!r},{b!r}" for a, b in zip(s.tolist(), level.tolist(), strict=True))
    path = write(tmp_path, f"s_m,level_m\n{rows}")
    grid, values = read_irregularity(path)
    assert np.diff(grid) == pytest.approx(grid[1] - grid[0], rel=1e-9) and grid[1] - grid[0] <= 0.2
    inner = slice(20, -20)
    # spline error 5/384 h^4 f'''' = 7e-9 m
    assert values[inner, 1] == pytest.approx(1e-3 * np.sin(0.5 * grid[inner]), abs=7e-9)
    assert values[inner, 3] == pytest.approx(values[inner, 1], abs=0.0)


GOOD = "0,0\n1,0.001\n2,0.001\n3,0\n"
BAD_FILES = [
    ("", "header", "s_m and columns"),
    (f"x,level_m\n{GOOD}", "header", "s_m and columns"),
    (f"s_m\n{GOOD}", "header", "s_m and columns"),
    (GOOD, "header", "s_m and columns"),
    (f"s_m,level\n{GOOD}", "level", "a column such as level_m or level_mm, got 'level' without a unit"),
    (f"s_m,level_mrad\n{GOOD}", "level_mrad", "a column such as level_m or level_mm"),
    (f"s_m,level_m,left_lateral_m\n{GOOD}", "header", "s_m and columns"),
    (f"s_m,level_m,level_m\n{GOOD}", "line 1", "each column once, got level_m twice"),
    ("s_m,level_m\n0,0\n1,0\n2,0\n", "", "four rows"),
    ("s_m,level_m\n0,0\n1,high\n2,0\n3,0\n", "line 3", "two numbers, got '1,high'"),
    ("s_m,level_m\n0,0\n1,nan\n2,0\n3,0\n", "line 3", "2 finite numbers"),
    ("s_m,level_m\n0,0\n1,0,0\n2,0\n3,0\n", "line 3", "2 cells in each row, as in the header, got 3"),
    ("s_m,level_m\n3,0\n2,0.001\n1,0.001\n0,0\n", "line 3", "all of it decreases: reverse the lines"),
    ("s_m,level_m\n0,0\n1,0\n2,1.5\n3,0\n", "line 4", "looks like mm: name the column level_mm"),
    ("s_m,gauge_m\n0,1435\n1,1436\n2,1435.5\n3,1435\n", "line 3", "name the column gauge_mm (and gauge is its"),
    ("s_m,gauge_m\n0,1.435\n1,1.436\n2,1.435\n3,1.437\n", "gauge_m", "subtract the design gauge"),
    ("s_m;level_m\n0;0\n1,0;0,001\n2.0;0.001\n3;0\n", "line 3", "one decimal mark in a file"),
    ("s_m,level_m\n0,0\n2,0\n2,0\n3,0\n", "line 4", "to increase"),
    ("s_m,level_m\n0,0\n1,0\n2,1.5\n3,0\n", "line 4", "level_m in m"),
    ("s_m,level_m\n0,0\n1e-9,0\n2,0\n3,0\n", "s_m", "vary so much"),
]


@pytest.mark.parametrize(("text", "field", "expected"), BAD_FILES)
def test_bad_files_name_the_line(tmp_path, text, field, expected):
    path = write(tmp_path, text)
    with pytest.raises(InputError) as caught:
        read_irregularity(path)
    assert (caught.value.source, caught.value.field) == (str(path), field)
    assert expected in caught.value.expected


def test_unreadable_files_are_named(tmp_path):
    for path in (tmp_path / "missing.csv", tmp_path):
        with pytest.raises(InputError, match="expected a CSV file with a header line: "):
            read_irregularity(path)


S = np.arange(0.0, 50.0, 0.25)
WAVE = 1e-3 * np.sin(0.5 * S) * np.sin(np.pi * S / S[-1])


def columns(header, separator, decimal, *values, more=""):
    rows = (separator.join(f"{v:.6f}" for v in row).replace(".", decimal) for row in zip(*values, strict=True))
    return "\n".join([header, *(row + more for row in rows)]) + "\n"


@pytest.mark.parametrize("text", [
    columns("s_m;level_m", ";", ",", S, WAVE), columns("s_m\tlevel_m", "\t", ",", S, WAVE),
    columns("s_m level_m", " ", ",", S, WAVE), columns("s_m level_m", "  ", ".", S, WAVE),
    columns("s [m];level [mm]", ";", ".", S, 1e3 * WAVE), columns("s,level\nm,mm", ",", ".", S, 1e3 * WAVE),
    columns("Level (mm), Chainage (km)", ",", ".", 1e3 * WAVE, 1e-3 * S),
    columns("km\tlevel/mm", "\t", ",", 1e-3 * S, 1e3 * WAVE),
    columns("s_m,level_inch", ",", ".", S, WAVE / 0.0254), columns("# s_m level_mm", " ", ".", S, 1e3 * WAVE),
    "\ufeff" + columns("s_m;level_mm", ";", ",", S, 1e3 * WAVE, more=";"),
    columns('"s_m","level_m', '","', ",", S, WAVE, more="").replace("\n", '"\n"')[:-1],
    columns("s_m,level_mm", ",", ".", S, 1e3 * WAVE),
], ids=["semicolons", "tabs", "blanks with commas", "blanks", "units in brackets", "units in a line", "km", "km alone",
        "inch", "comment", "byte order mark", "quotes", "plain"])  # fmt: skip
def test_track_in_every_form_of_columns_is_the_same(tmp_path, text):
    s, values = read_irregularity(write(tmp_path, text))
    assert s == pytest.approx(S, abs=2e-3) and np.diff(s).max() == pytest.approx(0.25, rel=1e-2)
    assert values[:, 1] == pytest.approx(WAVE, abs=2e-6) and np.abs(values[:, 0]).max() == 0.0


def test_kilometre_plus_metres_is_a_chainage(tmp_path):
    rows = "\n".join(f"12+{450 + at:06.2f};{1e3 * value:.4f}" for at, value in zip(S, WAVE, strict=True))
    s, _ = read_irregularity(write(tmp_path, f"chainage_m;level_mm\n{rows}\n"))
    assert s == pytest.approx(12450 + S, abs=1e-9)


def test_absolute_gauge_becomes_its_change(tmp_path, capsys):
    _, change = read_irregularity(write(tmp_path, columns("s_m;gauge_mm", ";", ",", S, 1e3 * WAVE)))
    _, absolute = read_irregularity(write(tmp_path, columns("s_m;gauge_mm", ";", ",", S, 1435.0 + 1e3 * WAVE)), 1.435)
    assert absolute == pytest.approx(change, abs=1e-9)
    assert "gauge_m is an absolute gauge, 1.43" in capsys.readouterr().err
    keys = {"irregularity": {"points": "track.csv", "fade_in": 5.0, "fade_out": 5.0}}
    assert np.abs(at(build_track(keys, "test", tmp_path).irregularity, 20.0)[0]).max() < 1e-3
    curve = [{"transition": 50.0}, {"curve": 50.0, "radius": 200.0, "widening": 0.01}]
    with pytest.raises(InputError, match="subtract the design gauge with its widening"):
        build_track({**keys, "path": curve}, "test", tmp_path)
    with pytest.raises(InputError, match="within 0.05 m of track.gauge 1.668, got an absolute gauge"):
        build_track({**keys, "gauge": 1.668}, "test", tmp_path)


KEY = "track.irregularity"
BAD_KEYS = [
    ({}, KEY, "points, spectrum or own"),
    ({"points": []}, f"{KEY}.points", "a CSV file"),
    ({"points": ["a.csv", 3]}, f"{KEY}.points.1", "a CSV file"),
    ({"points": ["none.csv"]}, f"{KEY}.points", "existing file"),
    ({"points": "missing.csv"}, f"{KEY}.points", "existing file"),
    ({"spectrum": {"level": "low", "length": 100.0}}, f"{KEY}.spectrum.seed", "key is missing"),
    ({"spectrum": {**SPECTRUM, "level": "medium"}}, f"{KEY}.spectrum.level", "'low' or 'high'"),
    ({"spectrum": {**SPECTRUM, "seed": 1.5}}, f"{KEY}.spectrum.seed", "whole number"),
    ({"spectrum": {**SPECTRUM, "seed": -1}}, f"{KEY}.spectrum.seed", "whole number"),
    ({"spectrum": {**SPECTRUM, "length": 1.0}}, f"{KEY}.spectrum.length", "10 to 1e5"),
    ({"spectrum": {**SPECTRUM, "spacing": 0.5}}, f"{KEY}.spectrum.spacing", "a tenth of the shortest"),
    ({"spectrum": {**SPECTRUM, "longest": 3.0}}, f"{KEY}.spectrum.longest", "more than the shortest"),
    ({"spectrum": {**SPECTRUM, "shortest": 0.0}}, f"{KEY}.spectrum.shortest", "shortest wavelength in m"),
    ({"spectrum": {**SPECTRUM, "begin": "here"}}, f"{KEY}.spectrum.begin", "begins"),
    ({"spectrum": {**SPECTRUM, "wave": 3.0}}, f"{KEY}.spectrum.wave", "unknown key"),
    ({"spectrum": SPECTRUM, "fade_in": -1.0}, f"{KEY}.fade_in", "faded in"),
    ({"spectrum": SPECTRUM, "fade_in": 200.0, "fade_out": 200.0}, KEY, "fades shorter than the 300 m"),
    ({"spectrum": SPECTRUM, "fade_in": 0.0}, KEY, "do not begin and end at 0"),
    ({"spectrum": SPECTRUM, "fade_out": 0.0}, KEY, "do not begin and end at 0"),
]


@pytest.mark.parametrize(("keys", "field", "expected"), BAD_KEYS)
def test_bad_keys_are_named(tmp_path, keys, field, expected):
    with pytest.raises(InputError) as caught:
        build_track({"irregularity": keys}, "scene.yaml", tmp_path)
    assert (caught.value.source, caught.value.field) == ("scene.yaml", field)
    assert expected in caught.value.expected


def test_several_files_and_a_spectrum_add_up_each_on_its_own_grid(tmp_path):
    # 0.3 m and 0.25 m apart, over different stretches; each faded at its own ends
    rng, names = np.random.default_rng(5), []
    for k, (begin, step) in enumerate(((0.0, 0.3), (40.0, 0.25))):
        s = begin + step * np.arange(300)
        rows = "\n".join(
            f"{a:.6f},{b:.9f},{c:.9f}" for a, b, c in zip(s, *(1e-3 * rng.normal(size=(2, 300))), strict=True)
        )
        (tmp_path / f"{k}.csv").write_text(f"s_m,alignment_m,level_m\n{rows}\n")
        names.append(f"{k}.csv")
    spectrum = {"level": "low", "seed": 2, "length": 100.0, "begin": -10.0}
    both = {"points": names, "spectrum": spectrum}
    whole, *parts = (
        build_track({"irregularity": keys}, "test", tmp_path).irregularity
        for keys in (both, {"points": names[0]}, {"points": names[1:]}, {"spectrum": spectrum})
    )
    for s in np.linspace(-30.0, 140.0, 501):
        np.testing.assert_allclose(at(whole, s), sum(at(part, s) for part in parts), rtol=0.0, atol=1e-15)
    np.testing.assert_array_equal(
        irregularity_extents(whole), np.vstack([irregularity_extents(part) for part in parts])
    )
    assert irregularity_extents(whole)[:, 1].max() == pytest.approx(114.75)
    assert (at(whole, 300.0) == 0.0).all()


def test_period_of_a_spectrum_is_the_fast_length_of_scipy():
    counts = [*range(1, 3000), 123_457, 1_000_001, 7_999_999]
    assert [_fast_length(count) for count in counts] == [next_fast_len(count, real=True) for count in counts]


def test_sums_of_sums_and_of_none_keep_the_range_of_each():
    one, other = (irregularity.irregularity_data(start, 0.25, np.ones((9, 4))) for start in (0.0, 10.0))
    flat = irregularity.sum_of([one, other, one])
    nested = irregularity.sum_of([irregularity.no_irregularity(), irregularity.sum_of([one, other]), one])
    for name in flat._fields:
        np.testing.assert_array_equal(getattr(nested, name), getattr(flat, name))
    assert len(irregularity.irregularity_extents(nested)) == 3
