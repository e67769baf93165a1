"""Validation of a model by sections of track: statistics of simulation and measurement, and their differences.

The procedure is that of model validation in EN 14363:2016 and of the DynoTRAIN project (O. Polach et al., 2014), as
recalled, not read: for each section and quantity the estimated values of simulation and measurement are subtracted. The
mean and the standard deviation of these differences over all sections and sensors of a quantity are compared with
limits. wrcore has no limits; the caller states them.

A difference is positive where the simulation has the larger amount: differences of signed values (medians) are
multiplied by the sign of the measured value.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from wrcore.analysis.assessment.assess import PERCENTILES
from wrcore.errors import InputError, one_of
from wrcore.run.output.channels import unit_of
from wrcore.signals.signal import Signal

STATISTICS = ("maximum", "median", "rms")
"""Statistics of a section. ``maximum``: the larger amount of the percentiles 0.15 % and 99.85 %; ``median``: 50 %, the
quasi-static value; ``rms``: root mean square."""

LEAST_SAMPLES = 8
"""Smallest number of samples with both values in a section; fewer have no percentiles."""


def section_statistics_of(run: Signal, signal: Signal, sections: Sequence[tuple[float, float]]) -> pd.DataFrame:
    """Return statistics of each channel in each section (begin, end), from signals on the same grid.

    Columns: section, begin, end, channel, unit, statistic, simulated, measured, difference."""
    rows = []
    for number, (begin, end) in enumerate(sections):
        inside = (run.x >= begin) & (run.x < end)
        for channel in signal:
            known = inside & np.isfinite(run[channel]) & np.isfinite(signal[channel])
            if np.count_nonzero(known) < LEAST_SAMPLES:
                continue
            simulated, measured = _statistics(run[channel][known]), _statistics(signal[channel][known])
            for name in STATISTICS:
                difference = simulated[name] - measured[name]
                difference *= -1.0 if measured[name] < 0.0 else 1.0
                pair = simulated[name], measured[name]
                rows.append((number, begin, end, channel, unit_of(channel), name, *pair, difference))
    columns = ["section", "begin", "end", "channel", "unit", "statistic", "simulated", "measured", "difference"]
    return pd.DataFrame(rows, columns=columns)


def _statistics(values):
    low, middle, high = np.percentile(values, PERCENTILES)
    return {"maximum": max(abs(low), abs(high)), "median": middle, "rms": float(np.sqrt(np.mean(values**2)))}


def validation_table(sections: pd.DataFrame, limits: Mapping[str, Any]) -> pd.DataFrame:
    """Return mean and standard deviation of the differences of each quantity over all sections and channels.

    Quantities are ends of channels, such as ``Q_N`` of all wheels. ``limits`` are pairs (limit of the amount of the
    mean, limit of the standard deviation) by quantity and statistic: ``{"Q_N": {"maximum": (4e3, 6e3)}}``. Columns:
    quantity, unit, statistic, values (their number), mean, standard_deviation (NaN for one value), largest (amount of a
    difference), limit_mean, limit_standard_deviation, is_met (empty without a limit)."""
    named = sections.assign(quantity=[channel.rpartition(".")[2] for channel in sections["channel"]])
    rows = [
        (*key, part.size, part.mean(), part.std(), part.abs().max())
        for key, part in named.groupby(["quantity", "unit", "statistic"], sort=False)["difference"]
    ]
    columns = ["quantity", "unit", "statistic", "values", "mean", "standard_deviation", "largest"]
    table = pd.DataFrame(rows, columns=columns)
    _check_limits(limits, set(table["quantity"]))
    no_limits = (np.nan, np.nan)
    pairs = [tuple(limits.get(row.quantity, {}).get(row.statistic, no_limits)) for row in table.itertuples()]
    table["limit_mean"] = [float(mean) for mean, _ in pairs]
    table["limit_standard_deviation"] = [float(deviation) for _, deviation in pairs]
    table["is_met"] = [
        "" if np.isnan(mean) else bool(abs(row.mean) <= mean and row.standard_deviation <= deviation)
        for row, (mean, deviation) in zip(table.itertuples(), pairs, strict=True)
    ]
    return table


def _check_limits(limits, quantities):
    """Raise an InputError for limits of unknown quantities or statistics, or that are not pairs of numbers."""
    for quantity, by_statistic in limits.items():
        if quantity not in quantities:
            raise InputError("compare", f"limits {quantity}", one_of(sorted(quantities), quantity))
        if not isinstance(by_statistic, Mapping):
            expected = "expected pairs by statistic, such as {'maximum': (4e3, 6e3)}"
            raise InputError("compare", f"limits {quantity}", expected)
        for statistic, pair in by_statistic.items():
            if statistic not in STATISTICS:
                raise InputError("compare", f"limits {quantity}", one_of(STATISTICS, statistic))
            if np.shape(pair) != (2,) or not np.all(np.asarray(pair, float) >= 0.0):
                expected = "expected the limit of the mean and that of the standard deviation, both at least 0"
                raise InputError("compare", f"limits {quantity} {statistic}", f"{expected}, got {pair}")


def sections_of_length(begin: float, end: float, length: float) -> list[tuple[float, float]]:
    """Return sections of a length from ``begin`` on; the last one may extend beyond ``end`` by half of its length.

    A remainder that is shorter than half of a section is left out."""
    edges = begin + length * np.arange(max(int((end - begin) / length + 0.5), 1) + 1)
    return [(float(low), float(high)) for low, high in zip(edges[:-1], edges[1:], strict=True)]
