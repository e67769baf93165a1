"""Identification of parameters: values of a scene's keys with which runs are closest to measured signals."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Annotated, Any, Literal

import numpy as np
import pandas as pd

from wrcore.analysis.measured.compare_signal import compare_with_signal
from wrcore.analysis.measured.fit_result import Fit, correlation_time_of, covariance_of, warnings_of
from wrcore.errors import InputError, one_of
from wrcore.errors.checked_calls import Threads, Within, checked
from wrcore.errors.messages import tell, warn
from wrcore.run.output.run import Run
from wrcore.run.simulate import simulate_many
from wrcore.scene.description import Source, load_scene
from wrcore.signals.signal import Signal, signal_of_run

DIFFERENCE = 3e-3
"""Step of the central differences of the Jacobian, as a share of the width of a key's bounds. Their error by the
integrator's tolerance (1e-4 of the motion) is then some per cent; with 3e-4 it would be ten times as large."""

ABSENT = 10.0
"""Residual of a time that a run has not reached, in standard deviations of the channel: runs that derail fit badly."""

TOLERANCE = 1e-5
"""Change of all values, as a share of the width of their bounds, at which the search ends."""


@checked
def fit(
    scene: Source,
    keys: Mapping[str, Sequence[float]],
    signals: Signal | Sequence[Any],
    band: Sequence[float | None] | None = None,
    noise: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    threads: Threads = 1,
    most_steps: Annotated[int, Within(1, 1000)] = 30,
    progress: Callable[[Sequence[Source]], Iterable[Source]] | Literal[False] = False,
) -> Fit:
    """Find values of a scene's keys with which its runs are closest to measured signals.

    The sum of squared differences of run and signal is minimised within bounds by ``scipy.optimize.least_squares``. All
    runs of a Jacobian are simulated in parallel. Signals must be aligned with the run.

    Parameters
    ----------
    scene : Scene, path or dict
        Its run must cover the signals; its output rate should be that of the signals or more.
    keys : mapping of str to (low, high)
        Bounds by key of the scene, in the key's unit. ``"wheel.profile=cone:{}"`` puts the number into a text.
    signals : Signal, or sequence of Signal or (changes, Signal)
        Measured signals with channels of the run. ``changes`` are those of the scene for one signal, as
        :func:`wrcore.load_scene` takes them, such as ``{"speed": 30}``.
    band : pair of float or None, optional
        Lower and upper corner of a filter for runs and signals, Hz (over distance 1/m).
    noise : mapping of str to float, optional
        Standard deviation of the noise by channel, in SI units; it weights the channels. By default the weight is one
        over the standard deviation of the channel.
    start : mapping of str to float, optional
        Start of the search by key; by default the middle of the bounds, the geometric one if both are above 0.
    threads : int
        Number of simultaneous runs.
    most_steps : int
        Largest number of steps of the search.
    progress : callable or False, optional
        Wraps the runs of each step, such as ``tqdm.tqdm``.

    Returns
    -------
    Fit
        Values, standard errors, covariance, and warnings that name keys which the signals do not determine. Standard
        errors assume that the model is right and that differences are noise; correlation in time is accounted for.

    Raises
    ------
    InputError
        If a key or a bound is invalid, or if a signal has no channel of the run or does not overlap it.

    Examples
    --------
    >>> import wrcore as wr
    >>> changes = {"integration.duration": 0.5, "contact.patch": "moment", "contact.creep.model": "linear"}
    >>> scene = wr.load_scene(wr.example("suspended_wheelset"), changes)
    >>> run = wr.simulate(scene, vehicle__elements__axle_box_left__stiffness__y=9e5)
    >>> signal = wr.Signal("t_s", run.t, {"wheelset.y_m": run["wheelset"].y_m})
    >>> found = wr.fit(scene, {"vehicle.elements.axle_box_left.stiffness.y": (3e5, 2e6)}, signal)
    >>> round(found.table["value"].item(), -3)
    900000.0
    """
    problem = _Problem(load_scene(scene), keys, signals, band, noise or {}, threads, progress)
    begin = problem.start(start or {})
    found, jacobian, residuals = _search(problem, begin, most_steps)
    correlation_time = float(np.mean([correlation_time_of(residuals[part]) for part in problem.parts()]))
    covariance = covariance_of(jacobian, residuals, correlation_time)
    warnings = warnings_of(problem.names, found.x, covariance, jacobian)
    for text in warnings:
        warn(f"fit: {text}")
    return problem.result(begin, found, covariance, residuals, warnings)


def _search(problem, begin, most_steps):
    """Return the result of scipy's search, and the Jacobian and the residuals at its end."""
    from scipy.optimize import least_squares

    found = least_squares(
        problem.residuals, begin, problem.jacobian, (0.0, 1.0), "trf", ftol=1e-8, xtol=TOLERANCE, gtol=1e-10,
        max_nfev=most_steps,
    )  # fmt: skip
    return found, found.jac, found.fun


class _Problem:
    """Least-squares problem in shares of the bounds: 0 at the lower, 1 at the upper bound of each key."""

    def __init__(self, scene, keys, signals, band, noise, threads, progress):
        self.scene, self.band, self.threads, self.progress = scene, band, threads, progress
        self.names, self.low, self.high = _bounds(keys)
        self.pairs, self.n_runs = _pairs(signals), 0
        self.signals = [signal for _, signal in self.pairs]
        self.noise, self.measured, self.weights = noise, [], []

    def values(self, shares):
        """Return the values of the keys by name for shares (n,) of their bounds."""
        numbers = self.low + np.asarray(shares) * (self.high - self.low)
        return dict(zip(self.names, map(float, numbers), strict=True))

    def start(self, given):
        """Return the shares (n,) at which the search begins, inside the bounds."""
        for name, value in given.items():
            if name not in self.names:
                raise InputError("fit", f"start {name}", one_of(self.names, name))
            k = self.names.index(name)
            if not self.low[k] <= value <= self.high[k]:
                raise InputError("fit", f"start {name}", f"expected {self.low[k]:g} to {self.high[k]:g}, got {value:g}")
        middles = np.where(self.low > 0.0, np.sqrt(np.abs(self.low * self.high)), 0.5 * (self.low + self.high))
        values = [given.get(name, middle) for name, middle in zip(self.names, middles, strict=True)]
        return np.clip((np.array(values) - self.low) / (self.high - self.low), 1e-6, 1.0 - 1e-6)

    def scene_of(self, changes, values):
        """Return the scene of a signal, with its changes and with values of the keys."""
        return load_scene(self.scene, {**changes, **dict(_change(name, value) for name, value in values.items())})

    def simulated(self, list_of_shares):
        """Return the runs of all signals for each of several shares (n,) of the bounds."""
        all_values = [self.values(shares) for shares in list_of_shares]
        scenes = [self.scene_of(changes, values) for values in all_values for changes, _ in self.pairs]
        runs = simulate_many(scenes, progress=self.progress, threads=self.threads)
        self.n_runs += len(runs)
        count = len(self.pairs)
        return [runs[k : k + count] for k in range(0, len(runs), count)]

    def residuals(self, shares):
        """Return the weighted differences (m,) of runs and signals."""
        (runs,) = self.simulated([shares])
        if not self.measured:
            self._prepare(runs)
        residuals = self._residuals_of(runs)
        tell(f"fit: {self.n_runs} runs, residual {np.sqrt(np.mean(residuals**2)):.4g}")
        return residuals

    def jacobian(self, shares):
        """Return the derivatives (m, n) of the residuals by central differences, one-sided at a bound."""
        points = []
        for k in range(len(shares)):
            for sign in (1.0, -1.0):
                point = np.array(shares)
                point[k] = np.clip(point[k] + sign * DIFFERENCE, 0.0, 1.0)
                points.append(point)
        residuals = [self._residuals_of(runs) for runs in self.simulated(points)]
        columns = [
            (residuals[2 * k] - residuals[2 * k + 1]) / (points[2 * k][k] - points[2 * k + 1][k])
            for k in range(len(shares))
        ]
        return np.stack(columns, axis=-1)

    def _prepare(self, runs):
        """Resample and filter the signals for the grids of their runs, and compute the weights of their channels."""
        for run, signal in zip(runs, self.signals, strict=True):
            found = compare_with_signal(run, signal, self.band)
            self.measured.append(found.signal)
            weights = {}
            for channel in found.signal:
                deviation = self.noise.get(channel, float(np.nanstd(found.signal[channel])))
                if not deviation > 0.0:
                    raise InputError("fit", channel, "expected a signal that varies and a noise above 0")
                weights[channel] = 1.0 / deviation
            self.weights.append(weights)

    def _residuals_of(self, runs):
        """Return the weighted differences (m,) of the runs of all signals, `ABSENT` where a run has ended early."""
        parts = []
        for run, signal, weights in zip(runs, self.measured, self.weights, strict=True):
            on_grid = _on_grid_of(run, signal, self.band)
            for channel, weight in weights.items():
                known = np.isfinite(signal[channel])
                difference = weight * (on_grid[channel] - signal[channel])[known]
                parts.append(np.where(np.isfinite(difference), difference, ABSENT))
        return np.concatenate(parts)

    def parts(self):
        """Return slices of the residuals, one for each channel of each signal."""
        counts = [np.count_nonzero(np.isfinite(signal[channel])) for signal in self.measured for channel in signal]
        edges = np.cumsum([0, *counts])
        return [slice(begin, end) for begin, end in zip(edges[:-1], edges[1:], strict=True)]

    def result(self, begin, found, covariance, residuals, warnings):
        """Return the `Fit` of a search that began at the shares ``begin``."""
        values, width = self.values(found.x), self.high - self.low
        in_units = covariance * np.outer(width, width)
        errors = np.sqrt(np.diag(in_units))
        correlation = in_units / np.outer(errors, errors)
        table = pd.DataFrame(
            {"value": values, "standard_error": dict(zip(self.names, errors, strict=True))}, index=self.names
        ).assign(low=self.low, high=self.high, start=self.values(begin))
        (runs,) = self.simulated([found.x])
        comparisons = [
            compare_with_signal(run, signal, self.band) for run, signal in zip(runs, self.signals, strict=True)
        ]
        named = {"index": self.names, "columns": self.names}
        return Fit(
            table, pd.DataFrame(in_units, **named), pd.DataFrame(correlation, **named), self.scene_of({}, values), runs,
            comparisons, float(np.sqrt(np.mean(residuals**2))), self.n_runs, found.message.rstrip("."), warnings,
        )  # fmt: skip


def _on_grid_of(run: Run, signal: Signal, band) -> Signal:
    """Return the channels of a run on the grid of a prepared signal, NaN at times that the run has not reached."""
    simulated = signal_of_run(run, signal.keys(), signal.axis).resampled(signal.step)
    if band is not None:
        simulated = simulated.filtered(band)
    index = np.rint((signal.x - simulated.x[0]) / signal.step).astype(int)
    inside = (index >= 0) & (index < len(simulated.x))
    at = np.clip(index, 0, len(simulated.x) - 1)
    values = {channel: np.where(inside, simulated[channel][at], np.nan) for channel in signal}
    return Signal(signal.axis, signal.x, values)


def _bounds(keys):
    """Return names, lower and upper bounds (n,) of the keys."""
    if not keys:
        raise InputError("fit", "keys", "expected a key with its bounds")
    for name, bounds in keys.items():
        if len(bounds) != 2 or not np.all(np.isfinite(bounds)) or not bounds[0] < bounds[1]:
            raise InputError("fit", f"keys {name}", f"expected a lower and a greater upper bound, got {bounds}")
    low, high = np.array([list(map(float, bounds)) for bounds in keys.values()]).T
    return list(keys), low, high


def _pairs(signals):
    """Return (changes of the scene, signal) for each signal."""
    items = [signals] if isinstance(signals, Signal) else list(signals)
    pairs = [({}, item) if isinstance(item, Signal) else item for item in items]
    for pair in pairs:
        fits = isinstance(pair, tuple | list) and len(pair) == 2
        if not fits or not isinstance(pair[0], Mapping) or not isinstance(pair[1], Signal):
            raise InputError("fit", "signals", "expected signals, or pairs of changes of the scene and a signal")
    if not pairs:
        raise InputError("fit", "signals", "expected a signal or more")
    return [(dict(changes), signal) for changes, signal in pairs]


def _change(name: str, value: float) -> tuple[str, float | str]:
    """Return key and value of a change; a key such as ``wheel.profile=cone:{}`` has a text for the number."""
    key, equals, text = name.partition("=")
    if equals and "{}" not in text:
        raise InputError("fit", f"keys {name}", "expected {} for the number behind =")
    return key, text.replace("{}", repr(value)) if equals else value
