"""Compare a run with a measured signal: differences, spectra and validation numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from wrcore.analysis.assessment.assess import track_sections
from wrcore.analysis.measured.spectra import spectra_of
from wrcore.analysis.measured.validation import section_statistics_of, sections_of_length, validation_table
from wrcore.errors import InputError
from wrcore.errors.checked_calls import checked
from wrcore.run.output.channels import unit_of
from wrcore.run.output.run import Run
from wrcore.signals.signal import AXIS_UNITS, Signal, distance_channel, grid_of, signal_of_run, values_of_run

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEAST_SAMPLES = 8
"""Smallest number of common samples of a comparison."""


LIMIT_COLUMNS = ["limit_mean", "limit_standard_deviation", "is_met"]
"""Columns of the validation table that are printed only if the caller has stated limits."""


@dataclass(frozen=True, repr=False, eq=False)
class SignalComparison:
    """Run and measured signal on a common grid, their differences and validation numbers.

    Its text form is the table of differences, then the validation table.

    Examples
    --------
    >>> import numpy as np
    >>> import wrcore as wr
    >>> run = wr.simulate(wr.example("suspended_wheelset"), integration__duration=0.5)
    >>> signal = wr.Signal("t_s", run.t + 7.0, {"wheelset.y_m": 1.01 * run["wheelset"].y_m})
    >>> found = wr.compare(run, signal.shifted(-7.0), limits={"y_m": {"maximum": (1e-4, 1e-4)}})
    >>> bool(0.98 < found.table["ratio"].item() < 1.0), found.validation["is_met"].tolist()
    (True, [False, '', ''])
    >>> found.spectra("wheelset.y_m").columns.tolist()
    ['frequency', 'run', 'signal', 'coherence', 'transfer', 'phase_rad']
    """

    run: Signal
    """Channels of the run on the common grid, filtered."""
    signal: Signal
    """Measured channels on the same grid, filtered alike."""
    table: pd.DataFrame
    """A row per channel; columns: :func:`wrcore.compare`."""
    sections: pd.DataFrame
    """A row per section, channel and statistic: simulated, measured, difference."""
    validation: pd.DataFrame
    """A row per quantity and statistic: mean and standard deviation of the differences, limits."""

    def __repr__(self) -> str:
        unit, per_unit = AXIS_UNITS[self.run.axis]
        x = self.run.x
        reach = f"{x[0]:g} to {x[-1]:g} {unit}, {len(x)} samples at {1.0 / self.run.step:.6g} {per_unit}"
        text = [f"{self.run.source!r} and {self.signal.source or 'signal'!r}: {reach}"]
        has_limits = self.validation["limit_mean"].notna().any()
        validation = self.validation if has_limits else self.validation.drop(columns=LIMIT_COLUMNS)
        text += [t.to_string(index=False, float_format=lambda v: f"{v:.3g}") for t in (self.table, validation)]
        return "\n".join(text)

    @checked
    def spectra(self, channel: str) -> pd.DataFrame:
        """Return power spectral densities, coherence and transfer function of a channel.

        Parameters
        ----------
        channel : str

        Returns
        -------
        pandas.DataFrame
            Columns ``frequency`` (Hz or 1/m), ``run`` and ``signal`` (one-sided densities), ``coherence``, ``transfer``
            and ``phase_rad`` (run over signal). Welch's method; gaps are interpolated.
        """
        return spectra_of(self.run[channel], self.signal[channel], 1.0 / self.run.step)

    @checked
    def plot(self, *channels: str) -> Figure:
        """Draw run and signal, and their difference, a row per channel; by default all channels."""
        from wrcore.analysis.measured.plot_signal import plot_comparison

        return plot_comparison(self, channels or self.signal.keys())

    @checked
    def plot_spectra(self, *channels: str) -> Figure:
        """Draw power spectral densities, transfer function and coherence, a row per channel; by default all."""
        from wrcore.analysis.measured.plot_signal import plot_spectra

        return plot_spectra(self, channels or self.signal.keys())


def compare_with_signal(
    run: Run,
    signal: Signal,
    band: Sequence[float | None] | None = None,
    sections: float | Sequence[Sequence[float]] | None = None,
    limits: Mapping[str, Any] | None = None,
) -> SignalComparison:
    """Compare a run with a signal; arguments and result as for :func:`wrcore.compare`."""
    channels = [channel for channel in signal if _is_of_run(run, channel)]
    if not channels:
        raise InputError("compare", "channels", f"expected a channel of the run, got {', '.join(signal)}")
    simulated = signal_of_run(run, channels, signal.axis)
    measured = Signal(
        signal.axis, signal.x, {channel: signal[channel] for channel in channels},
        {channel: signal.units[channel] for channel in channels}, signal.source,
    )  # fmt: skip
    step = max(simulated.step, measured.step)
    simulated, measured = simulated.resampled(step), measured.resampled(step)
    if band is not None:
        simulated, measured = simulated.filtered(band), measured.filtered(band)
    begin, end = max(simulated.x[0], measured.x[0]), min(simulated.x[-1], measured.x[-1])
    grid = grid_of(np.array([begin, end]), step)
    if len(grid) < LEAST_SAMPLES:
        unit = AXIS_UNITS[signal.axis][0]
        got = f"{simulated.x[0]:g} to {simulated.x[-1]:g} and {measured.x[0]:g} to {measured.x[-1]:g} {unit}"
        expected = "expected a run and a signal that overlap: signal.shifted or signal.aligned moves the signal"
        raise InputError("compare", "signal", f"{expected}, got {got}")
    half = 0.5 * step
    simulated, measured = (one.cut(grid[0] - half, grid[-1] + half) for one in (simulated, measured))
    table = pd.DataFrame([_row(simulated[channel], measured[channel], channel) for channel in channels])
    statistics = section_statistics_of(simulated, measured, _sections(run, simulated, sections))
    return SignalComparison(simulated, measured, table, statistics, validation_table(statistics, limits or {}))


def _is_of_run(run, channel):
    """Whether a run has a channel with one value at a time."""
    group, _, name = channel.rpartition(".")
    return group in run and run[group].follows(name) and np.ndim(run[group][name]) == 1


def _row(run, signal, channel):
    """Return the row of a channel in the table of differences run - signal."""
    known = np.isfinite(run) & np.isfinite(signal)
    one, other = run[known], signal[known]
    row = {"channel": channel, "unit": unit_of(channel), "samples": int(known.sum())}
    if not known.any():
        return row
    difference, spread = one - other, float(np.std(other))
    varies = spread > 0.0 and np.std(one) > 0.0
    return row | {
        "rms": float(np.sqrt(np.mean(difference**2))),
        "max": float(np.abs(difference).max()),
        "mean": float(np.mean(difference)),
        "scale": spread,
        "relative": float(np.std(difference)) / spread if spread > 0.0 else np.nan,
        "ratio": float(np.std(one)) / spread if spread > 0.0 else np.nan,
        "correlation": float(np.corrcoef(one, other)[0, 1]) if varies else np.nan,
    }


def _sections(run, simulated, wanted):
    """Return sections (begin, end) on the axis of the comparison; by default those of EN 14363 along the run's path."""
    begin, end = simulated.x[0], simulated.x[-1] + simulated.step
    if isinstance(wanted, int | float):
        if not wanted > simulated.step:
            raise InputError("compare", "sections", f"expected a length above {simulated.step:g}, got {wanted}")
        return sections_of_length(begin, end, wanted)
    if wanted is not None:
        pairs = [tuple(section) for section in wanted]
        if not pairs or any(len(pair) != 2 or not pair[0] < pair[1] for pair in pairs):
            raise InputError("compare", "sections", "expected pairs of a begin and a greater end")
        return [(float(low), float(high)) for low, high in pairs]
    try:
        s = np.maximum.accumulate(values_of_run(run, distance_channel(run)))
    except InputError:
        return [(begin, end)]
    path = run.scene.get("track", {}).get("path", "tangent")
    edges = [(low, high) for low, high, _ in track_sections(path, s[-1], s[0])]
    if simulated.axis == "t_s":  # times at which the run passes the ends of sections
        edges = [tuple(np.interp(pair, s, run.t)) for pair in edges]
    inside = [(max(low, begin), min(high, end)) for low, high in edges]
    return [(float(low), float(high)) for low, high in inside if high - low > 0.0]
