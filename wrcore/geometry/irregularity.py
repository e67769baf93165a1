"""Track irregularity: deviation of the rails' lines from the ideal track, as C2 functions of arc length.

Four channels: lateral (towards n, to the left positive) and vertical (towards b, up) deviation of the left and of the
right rail. They are cubic splines on a uniform grid, so that the curvature of the rails' lines is continuous. The
deviation is faded in and out and is zero elsewhere. Several irregularities, each on its grid, are added.

Measured or generated quantities are combined into the channels as follows: alignment and level are the means of both
rails' lateral and vertical deviation, cross level is left minus right height, gauge is the change of the gauge.
"""

import math
import re
from typing import NamedTuple

import numpy as np

from wrcore.errors import InputError
from wrcore.errors.column_files import named_columns, read_column_file
from wrcore.errors.messages import warn
from wrcore.geometry.spline import clamped_cubics
from wrcore.kernels.jit import jit

CHANNELS = ("left_lateral", "left_vertical", "right_lateral", "right_vertical")
"""Order of the channels."""

MEANS = ("alignment", "level", "cross_level", "gauge")
"""Quantities that `combine` turns into the channels."""

LARGEST = 0.05
"""Largest accepted deviation, m; it detects wrong units."""

_CHAINAGES = ("chainage", "distance", "station", "position")
"""Alternative names of the column of arc lengths."""

_STATION = re.compile(r"(\d+)\+(\d{3}(?:[.,]\d*)?)")  # 12+450: kilometre and metres
_PADDING = 40  # the influence of a node on a cubic spline decays by 0.268 per cell: 0.268^40 = 1e-23
_MOST_CELLS = 2_000_000
_WIDEST = 5.0
"""Largest accepted gap between samples, in median distances of samples; a spline over a longer gap is not reliable."""

CUTOFF_C, CUTOFF_R, CUTOFF_S = 0.8246, 0.0206, 0.4380
"""Cut-off wave numbers of the German (ERRI B 176) spectra, rad/m."""

HALF_BASE = 0.75
"""Half the distance b of the running circles in the cross level's spectrum, m."""

VERTICAL = {"low": 4.032e-7, "high": 1.080e-6}
"""Roughness factor A_v, m rad."""

LATERAL = {"low": 2.119e-7, "high": 6.125e-7}
"""Roughness factor A_a, m rad."""

FRA_SHARE, FRA_CUTOFF = 0.25, 0.8245
"""Factor k, and cut-off wave number (rad/m), of the American spectra."""

FRA = {"fra_5": (2.095e-5, 7.62e-6, 0.8209), "fra_6": (3.39e-6, 3.39e-6, 0.4380)}
"""Constants of the FRA's track classes 5 and 6: roughness factors A_v and A_a (m rad), cut-off wave number of cross
level (rad/m)."""


class IrregularityData(NamedTuple):
    """Irregularity for kernels; for perfect rails ``coefficients.shape[0] == 0``."""

    coefficients: np.ndarray
    """(cells, 4, 4): coefficients of the powers 0 to 3 of the distance from the cell's beginning (m), for each of four
    channels."""
    starts: np.ndarray
    """(n,): beginning of the first cell of each irregularity, m."""
    steps: np.ndarray
    """(n,): length of the cells of each irregularity, m."""
    first: np.ndarray
    """(n + 1,) int: index of the first cell of each irregularity, then the number of cells."""


def no_irregularity():
    """Return the IrregularityData of perfect rails."""
    return IrregularityData(np.zeros((0, 4, 4)), np.zeros(0), np.zeros(0), np.zeros(1, np.int64))


@jit
def irregularity_at(data, s, out):
    """Write deviations (m) and their first and second derivatives at arc length s (m) into ``out`` (3, 4).

    They are zero outside the range. For perfect rails return False and leave ``out`` unchanged; else return True.
    """
    if data.coefficients.shape[0] == 0:
        return False
    out[:, :] = 0.0
    for part in range(data.starts.shape[0]):
        step, first = data.steps[part], data.first[part]
        position = (s - data.starts[part]) / step
        if not 0.0 <= position < data.first[part + 1] - first:
            continue
        i = first + int(position)
        d = (position - (i - first)) * step
        for k in range(4):
            c0, c1 = data.coefficients[i, 0, k], data.coefficients[i, 1, k]
            c2, c3 = data.coefficients[i, 2, k], data.coefficients[i, 3, k]
            out[0, k] += c0 + d * (c1 + d * (c2 + d * c3))
            out[1, k] += c1 + d * (2.0 * c2 + 3.0 * d * c3)
            out[2, k] += 2.0 * c2 + 6.0 * d * c3
    return True


def irregularity_data(start, step, values):
    """Return the IrregularityData of samples (n, 4), m, in the order of `CHANNELS`, that begin and end at zero.

    The samples begin at arc length ``start`` (m) and are a ``step`` (m) apart. The C2 spline decays to zero in cells of
    zeros that are added at both ends.
    """
    values = np.pad(np.asarray(values, float), ((_PADDING, _PADDING), (0, 0)))
    coefficients = clamped_cubics(step * np.arange(len(values)), values)
    first, steps = np.array([start - _PADDING * step], float), np.array([step], float)
    return IrregularityData(coefficients, first, steps, np.array([0, len(coefficients)]))


def sum_of(parts):
    """Return the IrregularityData of the sum of several ones."""
    sizes = np.concatenate([np.diff(part.first) for part in parts])  # cells of each irregularity of each part
    joined = (np.concatenate([getattr(part, name) for part in parts]) for name in ("coefficients", "starts", "steps"))
    return IrregularityData(*joined, np.cumsum([0, *sizes]))


def irregularity_extents(data):
    """Return arc lengths (n, 2), m, of the first and last sample of each irregularity; elsewhere rails are perfect."""
    ends = data.starts + data.steps * (np.diff(data.first) - _PADDING)
    return np.column_stack([data.starts + _PADDING * data.steps, ends])


def combine(alignment, level, cross_level, gauge):
    """Return the channels (n, 4), m, from alignment, level, cross level and change of gauge, all (n,), m.

    Alignment and level are means of both rails, cross level is left minus right height.
    """
    return np.stack(
        [alignment + 0.5 * gauge, level + 0.5 * cross_level, alignment - 0.5 * gauge, level - 0.5 * cross_level], -1
    )


def _smooth(distance, length):
    """Return a fade factor that rises from 0 to 1 over a length (m), with two zero derivatives at both ends."""
    t = np.clip(distance / length, 0.0, 1.0) if length > 0.0 else np.ones_like(distance)
    return t**3 * (10.0 + t * (6.0 * t - 15.0))


def faded(s, values, fade_in, fade_out, source, field):
    """Return the IrregularityData of faded samples at uniform arc lengths s (n,), values (n, 4), both in m.

    An InputError is raised if the fades are longer than the samples, or if the ends are neither zero nor faded.
    """
    if fade_in + fade_out > s[-1] - s[0]:
        raise InputError(source, field, f"expected fades shorter than the {s[-1] - s[0]:g} m of irregularity")
    values = values * (_smooth(s - s[0], fade_in) * _smooth(s[-1] - s, fade_out))[:, None]
    if max(np.abs(values[0]).max(), np.abs(values[-1]).max()) > 1e-9:
        expected = "expected fade_in and fade_out above 0, as the values do not begin and end at 0"
        raise InputError(source, field, expected)
    return irregularity_data(s[0], (s[-1] - s[0]) / (len(s) - 1), values)


def read_irregularity(path, gauge=None):
    """Read uniform arc lengths (n,) and deviations (n, 4), both in m, from a file of measured irregularity.

    The header names the chainage (``s_m``; also chainage, distance, station, position or km, which may be written
    12+450) and either any of `CHANNELS` or any of `MEANS`, each with its unit (`wrcore.errors.column_files`). Missing
    columns are zero. The track's ``gauge`` (m), if given, is subtracted from an absolute gauge, with a warning. Samples
    at varying distances are interpolated by a cubic spline on a grid of the smallest distance, with a warning. An
    InputError names the file and the wrong line or column, also if such a spline would overshoot between samples."""
    s, columns, lines = _read_table(path)
    wrong = np.flatnonzero(np.diff(s) <= 0.0)
    if wrong.size:
        back = ", but all of it decreases: reverse the lines, and left and right" * (wrong.size == s.size - 1)
        raise InputError(path, f"line {lines[wrong[0] + 1]}", f"expected s_m to increase{back}")
    if "gauge_m" in columns and 0.5 < columns["gauge_m"].min() and columns["gauge_m"].max() < 2.0:
        columns["gauge_m"] = _change_of_gauge(columns["gauge_m"], gauge, path)
    for name, column in columns.items():
        size, k = np.abs(column).max(), int(np.abs(column).argmax())
        if size > LARGEST:
            base, expected = name.removesuffix("_m"), f"expected {name} in m, within {LARGEST:g}, got {column[k]:g}"
            absolute = " (and gauge is its change, or absolute)" * (name == "gauge_m")
            hint = f"; looks like mm: name the column {base}_mm{absolute}" if size > 0.5 else ""
            raise InputError(path, f"line {lines[k]}", expected + hint)
    zero = np.zeros_like(s)
    if set(columns) <= {f"{name}_m" for name in MEANS}:
        values = combine(*(columns.get(f"{name}_m", zero) for name in MEANS))
    else:
        values = np.stack([columns.get(f"{name}_m", zero) for name in CHANNELS], -1)
    return _uniform(s, values, path, lines)


def _change_of_gauge(absolute, gauge, path):
    """Return the change of the gauge (m) from a file's absolute gauge (m); InputError without the track's gauge."""
    got = f"an absolute gauge, {absolute.mean():.4f} m in the mean"
    if gauge is None:
        expected = "expected the change of the gauge: subtract the design gauge with its widening"
        raise InputError(path, "gauge_m", f"{expected}, got {got}")
    change = absolute - gauge
    if np.abs(change).max() > LARGEST:
        expected = f"expected a gauge within {LARGEST:g} m of track.gauge {gauge:g}"
        raise InputError(path, "gauge_m", f"{expected}, got {got}: set track.gauge to the design gauge")
    warn(f"{path}: gauge_m is {got}: track.gauge {gauge:g} m is subtracted")
    return change


def _read_table(path):
    """Return arc lengths (n,) and columns by name, in m, and the line numbers of a file."""
    file = read_column_file(path)
    file = file._replace(names=tuple("s_km" if name.lower() == "km" else name for name in file.names))
    known = [{f"{name}_m" for name in group} for group in (CHANNELS, MEANS)]
    found = named_columns(file, ("s_m", *sorted(known[0] | known[1])), dict.fromkeys(_CHAINAGES, "s"))
    names = [name for name, _ in found.values()]
    extra = len(names) < len(file.names) or len(set(names)) < len(names)
    rest = set(names) - {"s_m"}
    if extra or "s_m" not in names or not rest or not any(rest <= group for group in known):
        expected = " or ".join(", ".join(f"{name}_m" for name in group) for group in (CHANNELS, MEANS))
        got = ",".join(file.names)
        raise InputError(path, "header", f"expected s_m and columns out of {expected} (or in mm, ...); got {got!r}")
    if len(file.cells) < 4:
        raise InputError(path, "", f"expected four rows or more, got {len(file.cells)}")
    at = next(k for k in found if found[k][0] == "s_m")
    for row, cells in enumerate(file.cells):
        if len(cells) == len(file.names) and "+" in cells[at] and (parts := _STATION.fullmatch(cells[at])):
            metres = 1e3 * float(parts[1]) + float(parts[2].replace(",", "."))
            file.cells[row] = [*cells[:at], repr(metres / found[at][1]), *cells[at + 1 :]]
    table = file.numbers(list(found), [factor for _, factor in found.values()])
    bad = np.flatnonzero(~np.isfinite(table).all(axis=1))
    if bad.size:
        row = bad[0]
        expected = f"expected {len(names)} finite numbers, got {file.texts[row][:40]!r}"
        raise InputError(path, f"line {file.lines[row]}", expected)
    columns = dict(zip(names, table.T, strict=True))
    return columns.pop("s_m"), columns, file.lines


def _uniform(s, values, path, lines):
    """Return arc lengths and values on a uniform grid; InputError for gaps and overshoot of the spline."""
    from scipy.interpolate import CubicSpline

    steps = np.diff(s)
    if np.ptp(steps) <= 1e-6 * steps.mean():
        return np.linspace(s[0], s[-1], len(s)), values
    usual, at = float(np.median(steps)), int(np.argmax(steps))
    if steps[at] > _WIDEST * usual:
        expected = f"expected samples at most {_WIDEST * usual:g} m apart, as their usual distance is {usual:g} m"
        raise InputError(path, f"line {lines[at + 1]}", f"{expected}, got a gap of {steps[at]:g} m")
    count = (s[-1] - s[0]) / steps.min()
    if count > _MOST_CELLS:
        raise InputError(path, "s_m", f"expected distances that do not vary so much, got {steps.min():g} m at least")
    grid = np.linspace(s[0], s[-1], math.ceil(count) + 1)
    carried = CubicSpline(s, values, bc_type="natural")(grid)
    _check_overshoot(s, values, grid, carried, path, lines)
    warn(f"{path}: samples {steps.min():g} to {steps.max():g} m apart are carried over to a grid of {steps.min():g} m")
    return grid, carried


def _check_overshoot(s, values, grid, carried, path, lines):
    """Raise an InputError if the spline overshoots two samples by more than half the largest step nearby, plus 2 %."""
    steps = np.pad(np.abs(np.diff(values, axis=0)), ((2, 2), (0, 0)))
    near = np.lib.stride_tricks.sliding_window_view(steps, 5, axis=0).max(axis=-1)
    cell = np.clip(np.searchsorted(s, grid, "right") - 1, 0, len(s) - 2)
    low, high = np.minimum(values[:-1], values[1:])[cell], np.maximum(values[:-1], values[1:])[cell]
    beyond = np.maximum(carried - high, low - carried)
    excess = beyond - 0.5 * near[cell] - 0.02 * np.ptp(values, axis=0)
    k = int(np.argmax(excess.max(axis=1)))
    if excess[k].max() > 0.0:
        where, size = f"line {lines[cell[k] + 1]}", beyond[k].max()
        expected = "expected samples that a spline can follow, not steeper between two than the others"
        raise InputError(path, where, f"{expected}, got one that goes {size:.2g} m beyond them")


def spectrum(quantity, level, omega):
    """Return the power spectral density S of track irregularity over wave numbers ``omega`` (rad/m).

    ``quantity`` is the mean "level" or "alignment" (m^2/(rad/m)), or the "cross_angle" between the rails' heights
    (rad^2/(rad/m)). S is one-sided and per rad/m: a band's variance is the integral of S over its positive wave
    numbers, without a further factor 2 or 2 pi.

    "low" or "high": German (ERRI B 176 RP 1, 1993; constants as in public codes). "fra_5" or "fra_6": American, of the
    FRA's track classes 5 and 6 (X. Lei, N.-A. Noda, J. Sound Vib. 258 (2002) 147-165; two public codes agree on these
    constants, but not on those of classes 1 to 4)."""
    square = np.asarray(omega, float) ** 2
    if level in FRA:
        vertical, lateral, cross = FRA[level]
        factor = lateral if quantity == "alignment" else vertical
        density = FRA_SHARE * factor * FRA_CUTOFF**2 / (square + FRA_CUTOFF**2)
        return density / HALF_BASE**2 / (square + cross**2) if quantity == "cross_angle" else density / square
    factor = (LATERAL if quantity == "alignment" else VERTICAL)[level]
    density = factor * CUTOFF_C**2 / ((square + CUTOFF_R**2) * (square + CUTOFF_C**2))
    if quantity == "cross_angle":
        return density / HALF_BASE**2 * square / (square + CUTOFF_S**2)
    return density


def generate(level, seed, length, spacing, shortest, longest):
    """Generate random irregularity with a :func:`spectrum`, wavelengths from ``shortest`` to ``longest`` (m).

    Return arc lengths s (n,) from 0 to about ``length`` and deviations (n, 4), not faded, all in m. Equal seed, length
    and spacing (m) result in equal tracks.

    The deviation is a sum of cosines with random phases. Their wave numbers are the multiples of 2 pi / period, with a
    period of at least twice the length; each has the variance of its interval of wave numbers. Alignment, level and
    cross level are independent; the gauge is constant, as the spectra do not include it."""
    s = spacing * np.arange(math.floor(length / spacing + 1e-9) + 1)
    period = _fast_length(2 * len(s))
    random = np.random.default_rng(seed)
    alignment, level_, angle = (
        _realise(quantity, level, random, period, spacing, shortest, longest)[: len(s)]
        for quantity in ("alignment", "level", "cross_angle")
    )
    return s, combine(alignment, level_, 2.0 * HALF_BASE * angle, np.zeros_like(s))


def _fast_length(least):
    """Return the smallest product of powers of 2, 3 and 5 that is no less than ``least``.

    A Fourier transform of this length is fast. It replaces ``scipy.fft.next_fast_len``, whose import takes 0.1 s.
    """
    best = 1 << (least - 1).bit_length()
    five = 1
    while five < best:
        odd = five
        while odd < best:
            best = min(best, odd << (-(-least // odd) - 1).bit_length())
            odd *= 3
        five *= 5
    return best


def _realise(quantity, level, random, period, spacing, shortest, longest):
    """Return one periodic realisation (period,) of a spectrum."""
    step = 2.0 * np.pi / (period * spacing)
    omega = step * np.arange(period // 2 + 1)
    ends = 2.0 * np.pi / longest, 2.0 * np.pi / shortest
    low, high = (np.clip(omega + shift, *ends) for shift in (-step / 2, step / 2))
    sides = spectrum(quantity, level, low) + spectrum(quantity, level, high)
    variance = (high - low) / 6.0 * (sides + 4.0 * spectrum(quantity, level, 0.5 * (low + high)))
    phase = random.uniform(0.0, 2.0 * np.pi, len(omega))
    return np.fft.irfft(0.5 * period * np.sqrt(2.0 * variance) * np.exp(1j * phase), period)
