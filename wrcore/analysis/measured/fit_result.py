"""Result of a fit: values, standard errors, correlations, and keys that the signals do not determine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from wrcore.analysis.measured.compare_signal import SignalComparison
from wrcore.errors.checked_calls import checked
from wrcore.run.output.run import Run
from wrcore.scene.description import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UNDETERMINED = 0.25
"""Standard error, as a share of the width of the bounds, from which a key is not identified: an interval of two
standard errors to both sides is then as wide as the bounds."""

COUPLED = 0.95
"""Correlation of two keys from which a warning says that mainly a combination of them is identified."""

AT_BOUND = 1e-3
"""Distance from a bound, as a share of the width of the bounds, within which the bound is the best value."""

SMALLEST = 1e-12
"""Smallest singular value of the Jacobian relative to the largest one; smaller ones are rounding."""


@dataclass(frozen=True, repr=False, eq=False)
class Fit:
    """Values of keys with which the runs of a scene are closest to measured signals.

    Its text form is the table of keys and the warnings.

    Examples
    --------
    >>> import wrcore as wr
    >>> changes = {"integration.duration": 0.4, "contact.patch": "moment", "contact.creep.model": "linear"}
    >>> scene = wr.load_scene(wr.example("suspended_wheelset"), changes)
    >>> run = wr.simulate(scene, initial__y=0.0034)
    >>> signal = wr.Signal("t_s", run.t, {"wheelset.y_m": run["wheelset"].y_m})
    >>> found = wr.fit(scene, {"initial.y": (0.001, 0.005)}, signal)
    >>> round(found.table.loc["initial.y", "value"], 6), found.warnings
    (np.float64(0.0034), ())
    """

    table: pd.DataFrame
    """A row per key: value, standard_error, low, high, start."""
    covariance: pd.DataFrame
    """Covariance of the values, in units of the keys."""
    correlation: pd.DataFrame
    """Correlation coefficients of the values."""
    scene: Scene
    """Scene with the fitted values."""
    runs: list[Run]
    """Runs with the fitted values, one for each signal."""
    comparisons: list[SignalComparison]
    """Comparison of each run with its signal."""
    residual: float
    """Root mean square of the differences, each divided by the noise or the standard deviation of its channel."""
    n_runs: int
    """Number of simulated runs."""
    status: str
    """Reason for which the search ended."""
    warnings: tuple[str, ...]
    """A sentence for each key that the signals do not determine, or whose best value is a bound."""

    def __repr__(self) -> str:
        table = self.table.to_string(float_format=lambda value: f"{value:.4g}")
        end = f"residual {self.residual:.4g}, {self.n_runs} runs; {self.status}"
        return "\n".join([table, end, *self.warnings])

    @checked
    def plot(self, number: int = 0) -> Figure:
        """Draw the fitted run and a signal, by default the first one, and their difference."""
        return self.comparisons[number].plot()


def covariance_of(jacobian: np.ndarray, residuals: np.ndarray, correlation_time: float) -> np.ndarray:
    """Return the covariance (n, n) of n values from the Jacobian (m, n) and the residuals (m,) at the best values.

    It is s^2 (J^T J)^-1 with the variance s^2 of the residuals, times their ``correlation_time`` in samples: residuals
    that follow each other alike count as one."""
    n_values = jacobian.shape[1]
    _, singular, axes = np.linalg.svd(jacobian, full_matrices=False)
    singular = np.maximum(singular, SMALLEST * max(singular[0], np.finfo(float).tiny))
    variance = float(residuals @ residuals) / max(len(residuals) - n_values, 1)
    return correlation_time * variance * (axes.T / singular**2) @ axes


def correlation_time_of(residuals: np.ndarray) -> float:
    """Return the integrated autocorrelation time of residuals (n,), in samples; 1 for white noise.

    It is 1 + 2 times the sum of the autocorrelation up to its first value below zero, at most a tenth of the length."""
    values = residuals - residuals.mean()
    power = float(values @ values)
    if power <= 0.0:
        return 1.0
    spectrum = np.abs(np.fft.rfft(values, 2 * len(values))) ** 2
    correlation = np.fft.irfft(spectrum)[: max(len(values) // 10, 1)] / power
    below = np.flatnonzero(correlation < 0.0)
    return float(max(1.0 + 2.0 * correlation[1 : below[0] if below.size else None].sum(), 1.0))


def warnings_of(names: list[str], shares: np.ndarray, covariance: np.ndarray, jacobian: np.ndarray) -> tuple[str, ...]:
    """Return a sentence for each key that is not identified, is coupled to another one, or lies at a bound.

    ``shares`` (n,) are values from 0 (lower bound) to 1; covariance (n, n) and Jacobian (m, n) refer to them."""
    errors = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = np.nan_to_num(covariance / np.outer(errors, errors))
    sizes = np.linalg.norm(jacobian, axis=0)
    found, coupled = [], set()
    for k, name in enumerate(names):
        others = np.abs(np.where(np.arange(len(names)) == k, 0.0, correlation[k]))
        other = int(others.argmax())
        pair = frozenset((k, other))
        if not AT_BOUND < shares[k] < 1.0 - AT_BOUND:
            bound = "lower" if shares[k] < 0.5 else "upper"
            found.append(f"{name} lies at its {bound} bound; its error is not reliable")
        elif errors[k] >= UNDETERMINED:
            reason = "the signals hardly depend on it"
            if others[other] > COUPLED and sizes[k] > 1e-3 * sizes.max():
                reason = f"only a combination with {names[other]} (correlation {correlation[k, other]:.2f})"
                coupled.add(pair)
            found.append(f"{name} cannot be identified: {reason}")
        elif others[other] > COUPLED and pair not in coupled:
            coupled.add(pair)
            found.append(f"{name} and {names[other]} are coupled: correlation {correlation[k, other]:.2f}")
    return tuple(found)
