"""Assessment of a run by EN 14363: filters, sections of straight track and curves, percentiles, limits.

Quantities and their sources. Limits are recalled from EN 14363:2005 and its successor of 2016, not read. Filters and
percentiles were compared with gensys.se/course/UIC518_tests.html (after UIC 518 and a draft of EN 14363). The column
``source`` of each table states both.

* sum Y (guiding forces of a wheelset): low-pass 20 Hz, sliding mean over 2 m in steps of 0.5 m; limit K (10 kN + 2 Q0 /
  3), K = 1, freight wagons 0.85.
* Y/Q (leading wheel of safety): the same filters; limit 0.8.
* Q (vertical force of a wheel): low-pass 20 Hz, 99.85 % only; limit 90 kN + Q0, at most 200 kN where 2 Q0 <= 225 kN
  (above 160 km/h the standard's cap is lower, recalled with low confidence: not applied).
* Y_qst, Q_qst (quasi-static, full curves only): medians; limits 60 kN and 145 kN.

The page states the corner frequency of the low-pass (20 Hz or more), not its kind. Here it is a Butterworth filter of
fourth order, applied forwards. Its initial condition is the steady state for the first value of the signal. The means
omit the first 0.2 s, in which the filter settles. Where a wheel is unloaded, Y/Q is interpolated linearly for the
low-pass and omitted from the mean. A sliding mean is over the distance that the wheelset has travelled, forwards or
backwards, and exists where the whole window lies within the run. Q0 is the mean of Q over a wheelset's wheels and the
whole run. Percentiles are 0.15 %, 50 % and 99.85 % within a section; the larger absolute value of the outer two is
compared with the limit. Percentiles of means use the first output time of every 0.5 m, those of wheel forces all output
times. An assessment compares the worst section of its run with the limit. The standard's statistics over the sections
of many runs are in :func:`section_statistics`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated

import numpy as np
import pandas as pd

from wrcore.analysis.assessment.ride import rate_of, ride_table, whole_body_table
from wrcore.analysis.assessment.wheels import output_times_after, wheel_forces, wheelsets_of
from wrcore.errors import InputError
from wrcore.errors.checked_calls import OneOf, Within, checked
from wrcore.geometry.track import SIDES
from wrcore.run.output.derived import quotient
from wrcore.run.output.run import Run
from wrcore.signals.filters import low_pass

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PERCENTILES = (0.15, 50.0, 99.85)
WINDOW = 2.0  # window of the sliding means, m
STEP = 0.5  # step of the sliding means, m

SETTLED = 0.2
"""Settling time of the low-pass, s: then its step response has an error below 1e-4; its slowest pole decays with 48
1/s."""

LEAST_RATE = 1000.0
"""Smallest output rate, 1/s: frequencies above half of the output rate are aliased, see reports/assessment.md."""

STRAIGHT_SECTION, WIDE_SECTION, TIGHT_SECTION, TIGHT = 250.0, 100.0, 70.0, 400.0
"""Lengths of sections on straight track, in curves of at least the radius ``TIGHT`` and in tighter ones, m."""

FILTERED = "limit recalled; low-pass from secondary text, its order chosen"
SOURCES = {
    "sum_Y": FILTERED, "Y_over_Q": FILTERED, "Y_qst": f"{FILTERED}; low confidence in tight curves",
    "Q": f"{FILTERED}; low confidence above 160 km/h", "Q_qst": FILTERED,
}  # fmt: skip
"""Sources of the limit and the filter of each quantity; none of them was read in the standard."""

MEANS = "sum_Y", "Y_over_Q"
"""Quantities that are averaged by sliding means, in steps of `STEP`."""

STANDARDS = ("EN 14363", "EN 12299", "ISO 2631")


@dataclass(frozen=True, eq=False)
class Assessment:
    """Assessment of a run by a standard; its text form is a table.

    Examples
    --------
    >>> import wrcore as wr
    >>> run = wr.simulate(wr.example("suspended_wheelset"), integration__duration=0.5, output__rate=1000)
    >>> assessment = wr.assess(run)
    >>> assessment.standard, assessment.summary["quantity"].tolist()
    ('EN 14363', ['sum_Y', 'Y_over_Q', 'Q'])
    >>> assessment.sections[["quantity", "side", "p50"]].shape
    (5, 3)
    """

    standard: str
    summary: pd.DataFrame
    """A row per quantity (EN 14363), body (EN 12299), or body and direction (ISO 2631)."""
    sections: pd.DataFrame
    """EN 14363: a row per section, wheelset or wheel and quantity; else empty."""
    series: pd.DataFrame = field(default_factory=pd.DataFrame)
    """EN 14363: the filtered quantities over time (index ``t_s``), columns quantity, wheelset and side; else empty."""
    limits: dict[str, dict[str, float]] = field(default_factory=dict)
    """EN 14363: limit of each quantity by wheelset; NaN if the standard states no limit."""

    @checked
    def plot(self) -> Figure:
        """Draw the filtered series from which the percentiles are computed, with their limits (dashed).

        Returns
        -------
        matplotlib.figure.Figure
            A panel per quantity, a line per wheelset or wheel.

        Raises
        ------
        InputError
            For other standards than EN 14363, which have no limits.
        """
        from wrcore.analysis.pictures.plot_assessment import plot_assessment

        return plot_assessment(self)

    def __repr__(self) -> str:
        table = self.summary.to_string(index=False, float_format=lambda value: f"{value:.4g}")
        return f"{self.standard}\n{table}"


@checked
def assess(
    run: Run, standard: Annotated[str, OneOf(STANDARDS)] = "EN 14363", begin: float = 0.0, freight: bool = False
) -> Assessment:
    """Assess a run by a standard for forces, ride comfort or whole-body vibration.

    Parameters
    ----------
    run : Run
        EN 14363 needs contact channels, or s or x of wheelsets and Q and Y of wheels, at 1000 1/s or more. The other
        standards need the channels ``pose`` and ``acceleration`` of bodies at 200 1/s or more.
    standard : {"EN 14363", "EN 12299", "ISO 2631"}
    begin : float
        Start of the evaluation, s.
    freight : bool
        Whether the limits of freight wagons apply.

    Returns
    -------
    Assessment

    Raises
    ------
    InputError
        If the standard is unknown, if the run has not the channels, too low an output rate or less than a window of 2 m
        after the first 0.2 s, or if ``begin`` is outside the run.

    Examples
    --------
    >>> import wrcore as wr
    >>> run = wr.simulate(wr.example("suspended_wheelset"), integration__duration=0.5, output__rate=1000)
    >>> worst = wr.assess(run, "EN 14363").summary.set_index("quantity")
    >>> bool(worst.loc["Y_over_Q", "value"] < worst.loc["Y_over_Q", "limit"])
    True
    """
    if standard != "EN 14363":
        table = (ride_table if standard == "EN 12299" else whole_body_table)(run, begin)
        return Assessment(standard, table, pd.DataFrame())
    sections, wheel_loads, series = section_table(run, begin)
    limits = {name: _limits(load, 0.85 if freight else 1.0) for name, load in wheel_loads.items()}
    return Assessment(standard, _summary(sections, limits), sections, series, limits)


@checked
def section_statistics(
    assessments: Annotated[Sequence[Assessment], Within()], k: Annotated[float, Within(0.0, 100.0)]
) -> pd.DataFrame:
    """Estimate maximum values over the sections of many runs by EN 14363: mean + k times the standard deviation.

    Parameters
    ----------
    assessments : sequence of Assessment
        Assessments by EN 14363 of runs of one vehicle.
    k : float
        The standard's factor for the quantity. It has no default, because its values were not read.

    Returns
    -------
    pandas.DataFrame
        A row per quantity, kind of track (straight; wide curves, of at least 400 m; tight curves), wheelset and side:
        sections, their number; mean, standard_deviation (NaN for one section), largest and estimated_maximum of their
        values, in N, Y/Q a number; limit, the smallest of all runs; share, estimated_maximum over limit; source, the
        source of the limit. The value of a section is the larger absolute value of its 0.15 % and 99.85 % percentiles.
        For Q it is that of 99.85 %, for quasi-static quantities that of the median.

    Raises
    ------
    InputError
        If an assessment is by another standard.

    Examples
    --------
    >>> import wrcore as wr
    >>> scene = wr.load_scene(wr.example("suspended_wheelset"), integration__duration=0.5, output__rate=1000)
    >>> runs = wr.simulate_many([wr.load_scene(scene, initial__y=y) for y in (0.001, 0.002, 0.003)])
    >>> table = wr.section_statistics([wr.assess(run) for run in runs], k=0.0)
    >>> table.loc[table["quantity"] == "sum_Y", "sections"].item()
    3
    """
    if any(one.standard != "EN 14363" for one in assessments):
        raise InputError("section_statistics", "assessments", "expected assessments by EN 14363")
    sections = pd.concat([one.sections for one in assessments], ignore_index=True)
    size = sections["radius_m"].abs()
    kinds = np.select([np.isinf(size), size >= TIGHT], ["straight", "wide curves"], "tight curves")
    groups = sections.assign(track=kinds, value=_sizes(sections)).groupby(
        ["quantity", "track", "wheelset", "side"], sort=False
    )["value"]
    table = groups.agg(sections="size", mean="mean", standard_deviation="std", largest="max").reset_index()
    table["estimated_maximum"] = table["mean"] + k * table["standard_deviation"]
    limits = pd.concat([one.summary for one in assessments]).groupby("quantity")["limit"].min()
    table["limit"] = table["quantity"].map(limits)
    sources = table["quantity"].map(SOURCES)
    return table.assign(share=table["estimated_maximum"] / table["limit"], source=sources)


def _sizes(sections):
    """Return the value of each section that is compared with a limit."""
    outer = sections[["p0_15", "p99_85"]].abs().max(axis=1)
    outer = outer.where(sections["quantity"] != "Q", sections["p99_85"].abs())
    return outer.where(~sections["quantity"].str.endswith("_qst"), sections["p50"].abs())


def sliding_mean(s, values, window=WINDOW):
    """Return means (n,) of values (n,), without NaN, over a window (m) centred at each distance travelled ``s`` (m, not
    decreasing); NaN where the window extends beyond an end or contains no value.
    """
    s, values = np.asarray(s, float), np.asarray(values, float)
    known = np.isfinite(values)

    def integral(y):  # over the distance, by the trapezoidal rule
        total = np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(s))])
        return np.interp(s + 0.5 * window, s, total) - np.interp(s - 0.5 * window, s, total)

    way = integral(known.astype(float))
    there = (way > 1e-6 * window) & (np.minimum(s - s[0], s[-1] - s) > 0.5 * window - 1e-6)
    return np.divide(integral(np.where(known, values, 0.0)), way, out=np.full(s.shape, np.nan), where=there)


def track_sections(path, end, begin=0.0):
    """Divide straight track and full curves of ``track.path`` from ``begin`` to ``end`` (m) into sections of the
    standard's length, without transitions.

    Return begin, end (m) and radius (m, signed, infinite where straight) of each section. A straight or curve shorter
    than this length is one section.
    """
    path = [{"tangent": max(end, 0.0)}] if isinstance(path, str) else path
    s = min(begin, 0.0)
    path = [{"tangent": path[0].get("tangent", 0.0) - s}, *path["tangent" in path[0] :]]
    stretches = []
    for segment in path:
        kind = next(kind for kind in ("tangent", "transition", "curve") if kind in segment)
        radius = float(segment.get("radius", np.inf))
        if kind != "transition":
            stretches.append((s, s + float(segment[kind]), radius))
        s += float(segment[kind])
    stretches.append((s, max(end, s), radius))
    sections = []
    for low, high, radius in stretches:
        target = STRAIGHT_SECTION if np.isinf(radius) else WIDE_SECTION if abs(radius) >= TIGHT else TIGHT_SECTION
        count = max(int((high - low) // target), 1)
        edges = low + (high - low) * np.arange(count + 1) / count
        sections += [(float(a), float(b), radius) for a, b in zip(edges[:-1], edges[1:], strict=True) if b > a]
    return sections


def section_table(run, begin=0.0):
    """Return percentiles per section, wheel loads Q0 and the filtered quantities of a run from ``begin`` (s) on.

    The first result has columns p0_15, p50, p99_85 (N; Y/Q a number) and a row per section, wheelset and side. Q0 (N),
    by wheelset, is the mean Q over the whole run. The third result has a column per filtered quantity over time.
    """
    rate, late = rate_of(run, LEAST_RATE, "EN 14363"), output_times_after(run, begin, "EN 14363")
    wheels = [run[f"{name}/{side}"] for name in wheelsets_of(run) for side in SIDES]
    if not wheels or not all(wheel.follows("Q_N") and wheel.follows("Y_N") for wheel in wheels):
        raise InputError("EN 14363", "run", "expected the channels of contacts, or Q and Y, of wheels")
    rows, loads, series = [], {}, {}
    places = {name: run[name]["s_m" if "s_m" in run[name] else "x_m"] for name in wheelsets_of(run)}
    reach = max(map(np.max, places.values())), min(map(np.min, places.values()))
    sections = track_sections(run.scene.get("track", {}).get("path", "tangent"), *reach)
    for name, s in places.items():
        way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(s)))])
        settled = run.t >= run.t[0] + min(SETTLED, run.t[-1] - run.t[0])
        if way[-1] - way[settled][0] < WINDOW:
            expected = f"expected at least {WINDOW:g} m of way after the first {SETTLED:g} s (the low-pass settles)"
            raise InputError("EN 14363", "run", f"{expected}, got {way[-1] - way[settled][0]:.3g} m of {name}")
        steps = np.isin(np.arange(len(way)), np.searchsorted(way, np.arange(0.0, way[-1], STEP) - 1e-6))
        forces = {side: wheel_forces(run, name, side) for side in SIDES}
        loads[name] = float(np.mean([forces[side][0] for side in SIDES]))
        for quantity, side, values in _filtered(forces, way, rate, settled):
            series[quantity, name, side] = values[late]
            for number, (low, high, radius) in enumerate(sections):
                inside = late & (s >= low) & (s <= high) & np.isfinite(values)
                if quantity.endswith("_qst") and np.isinf(radius) or np.count_nonzero(inside) < 2:
                    continue
                place = (number, s[inside].min(), s[inside].max(), radius)
                if quantity in MEANS and np.any(inside & steps):
                    inside &= steps
                found = np.percentile(values[inside], PERCENTILES)
                rows.append((*place, quantity, name, side, *found))
    columns = ["section", "begin_m", "end_m", "radius_m", "quantity", "wheelset", "side", "p0_15", "p50", "p99_85"]
    return pd.DataFrame(rows, columns=columns), loads, pd.DataFrame(series, index=pd.Index(run.t[late], name="t_s"))


def _filtered(forces, way, rate, settled):
    """Yield quantity, side and filtered signal of a wheelset and its wheels; means only where ``settled`` is true."""

    def mean(values):
        known, places = np.isfinite(values), np.arange(len(values))
        if not known.any():
            return values
        passed = low_pass(np.interp(places, places[known], values[known]), rate)
        found = np.full(len(values), np.nan)
        found[settled] = sliding_mean(way[settled], np.where(known, passed, np.nan)[settled])
        return found

    yield "sum_Y", "", mean(sum(SIDES[side] * forces[side][1] for side in SIDES))
    for side in SIDES:
        vertical, lateral = forces[side]
        yield "Y_over_Q", side, mean(quotient(vertical, lateral))
        load = low_pass(vertical, rate)
        yield "Q", side, load
        yield "Q_qst", side, load
        yield "Y_qst", side, low_pass(lateral, rate)


def _limits(wheel_load, freight):
    return {
        "sum_Y": freight * (10e3 + 2.0 * wheel_load / 3.0),
        "Y_over_Q": 0.8,
        "Q": min(90e3 + wheel_load, 200e3) if 2.0 * wheel_load <= 225e3 else np.nan,
        "Y_qst": 60e3,
        "Q_qst": 145e3,
    }


def _summary(sections, limits):
    """Return the worst value of each quantity relative to its wheelset's limit, with its location and the limit."""
    rows = []
    for quantity in next(iter(limits.values())):
        part = sections[sections["quantity"] == quantity]
        if part.empty:
            continue
        size = _sizes(part)
        limit = part["wheelset"].map(lambda name, quantity=quantity: limits[name][quantity])
        share = size / limit
        at = (share if share.notna().any() else size).idxmax()
        rows.append(
            {"quantity": quantity, "value": size[at], "limit": limit[at], "share": share[at]}
            | {key: part.loc[at, key] for key in ("wheelset", "side", "begin_m", "end_m", "radius_m")}
            | {"source": SOURCES[quantity]}
        )
    return pd.DataFrame(rows)
