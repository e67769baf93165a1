"""Spectra of a channel of a run and of the measured signal: power spectral density, coherence, transfer function."""

from __future__ import annotations

import numpy as np
import pandas as pd

from wrcore.signals.filters import without_gaps

SEGMENTS = 8
"""Number of segments without overlap that a signal is divided into; more segments have less scatter and fewer
frequencies."""

LEAST_LENGTH = 64
"""Smallest number of samples of a segment, or all samples of a shorter signal."""


def spectra_of(run: np.ndarray, signal: np.ndarray, rate: float) -> pd.DataFrame:
    """Return spectra of values (n,) of a run and of a signal at equal times.

    They are Welch's averages of Hann windows that overlap by a half, without the mean; gaps are interpolated. Columns:
    ``frequency`` (in the unit of ``rate``), ``run`` and ``signal`` (one-sided power spectral densities, unit of the
    values squared over that of the rate), ``coherence`` (0 to 1), ``transfer`` and ``phase_rad`` (amount and phase of
    run over signal, cross spectrum over spectrum of the signal)."""
    from scipy.signal import csd, welch

    one, other = (without_gaps(np.asarray(values, float))[0] for values in (run, signal))
    length = min(len(one), max(LEAST_LENGTH, len(one) // SEGMENTS))
    options = {"fs": rate, "nperseg": length, "detrend": "constant"}
    frequency, density_run = welch(one, **options)
    density_signal = welch(other, **options)[1]
    cross = csd(other, one, **options)[1]
    with np.errstate(invalid="ignore", divide="ignore"):
        coherence = np.abs(cross) ** 2 / (density_run * density_signal)
        transfer = cross / density_signal
    return pd.DataFrame({
        "frequency": frequency, "run": density_run, "signal": density_signal, "coherence": coherence,
        "transfer": np.abs(transfer), "phase_rad": np.angle(transfer),
    })  # fmt: skip
