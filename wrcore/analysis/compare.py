"""Compare two runs channel by channel, to quantify the effect of a modelling choice."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any, overload

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from wrcore.analysis.assessment.wheels import wheelsets_of
from wrcore.analysis.measured.compare_signal import SignalComparison, compare_with_signal
from wrcore.analysis.pictures.plot_run import COLORS, HEIGHT, WIDTH, printed, values_of
from wrcore.analysis.pictures.style import plain, styled
from wrcore.errors import InputError
from wrcore.errors.checked_calls import checked
from wrcore.run.output.channels import unit_of
from wrcore.run.output.files import load_run
from wrcore.run.output.run import Run
from wrcore.run.simulation import flat
from wrcore.signals.signal import Signal

SAME_TIME = 1e-9
"""Largest difference between output times of two runs that are treated as equal, s."""

PLACES = ("x_m", "y_m", "z_m", "s_m", "u_wheel_m", "u_rail_m", "s_wheel_rad", "rolling_radius_m")
MOTION = ("m", "rad", "m/s", "rad/s", "m/s^2")
"""Channels of contacts, and units of channels of bodies, whose zero is arbitrary: their scale is their variation."""

ACCURACIES = {"y": "y_m", "Y": "Y_N", "Q": "Q_N", "wear": "T_gamma_N"}
"""Channel of the error that :func:`wrcore.simulate_to_accuracy` states, by the name of the requested quantity."""

LEAST = 1e-9
"""Smallest scale of a position or motion, in its unit: smaller variation is rounding noise."""

NAMED = 6
"""Largest number of groups that are named if only one run has them."""

SHOWN = {"y_m": False, "yaw_rad": False, "Q_N": True, "Y_N": True}
"""Channels that are drawn by default; the value is True for channels of contacts, False for channels of bodies."""


@dataclass(frozen=True, repr=False, eq=False)
class Comparison:
    """Differences of two runs; its text form is a table with a row per channel, for the group with the largest
    difference.

    Examples
    --------
    >>> import wrcore as wr
    >>> scene = wr.load_scene(wr.example("suspended_wheelset"), integration__duration=0.1)
    >>> found = wr.compare(wr.simulate(scene), wr.simulate(scene, speed=40))
    >>> found.changes
    {'speed': (20.0, 40)}
    >>> found.plot().axes[0].get_ylabel()
    'y / mm'
    """

    runs: tuple[Run, Run]
    changes: dict[str, tuple[Any, Any]]
    """Keys of the scenes that differ, with both values; None if a scene does not have the key."""
    t: np.ndarray
    """Output times common to both runs, s."""
    table: pd.DataFrame
    """A row per group and channel; columns: :func:`compare`."""

    @property
    def summary(self) -> pd.DataFrame:
        """Rows with the largest relative difference of each channel, of bodies and of contacts, the largest first."""
        order = self.table.sort_values("relative", ascending=False, kind="stable")
        again = pd.DataFrame({"channel": order["channel"], "contact": order["group"].str.contains("/")}).duplicated()
        return order[~again].reset_index(drop=True)

    def __repr__(self) -> str:
        names = " and ".join(f"{run.scene.get('name', 'run')!r} ({run.status})" for run in self.runs)
        keys = [f"{key}: {one!r}, {other!r}" for key, (one, other) in self.changes.items()]
        rows = self.summary.to_string(index=False, float_format=lambda value: f"{value:.3g}", na_rep="")
        times = f"{names}: {len(self.t)} times, {self.t[0]:g} to {self.t[-1]:g} s"
        return "\n".join([times, *keys, *self._left_out(), rows])

    def _left_out(self) -> Iterator[str]:
        """Yield a line for each run with bodies or wheels that the other run does not have."""
        for which, one, other in zip(("first", "second"), self.runs, self.runs[::-1], strict=True):
            if alone := [group for group in one if group not in other]:
                more = f" and {len(alone) - NAMED} more" if len(alone) > NAMED else ""
                yield f"only the {which} run has {', '.join(alone[:NAMED])}{more}: not compared"

    @checked
    @styled
    def plot(self, *channels: str) -> Figure:
        """Draw channels of both runs, and their difference with the error that the runs state.

        Parameters
        ----------
        *channels : str
            Such as ``"wheelset/left.Q_N"``, a row each. By default: lateral position, yaw, vertical and lateral force,
            each of the group with the largest difference.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        InputError
            If one of the runs does not have a channel.
        """
        channels = channels or self._shown()
        pairs = [tuple(values_of(run, channel) for run in self.runs) for channel in channels]
        figure = Figure(figsize=(1.4 * WIDTH, 0.9 + HEIGHT * len(pairs)), layout="constrained")
        rows = figure.subplots(len(pairs), 2, sharex=True, squeeze=False)
        places = _common(*(run.t for run in self.runs))
        stated = self.table.set_index(["group", "channel"])["error"]
        for (left, right), channel, pair in zip(rows, channels, pairs, strict=True):
            group, _, name = channel.rpartition(".")
            factor, label = printed(name)
            for run, values, look in zip(self.runs, pair, ((COLORS[0], "-"), (COLORS[2], "--")), strict=True):
                for column in np.reshape(values, (len(run.t), -1)).T:
                    left.plot(run.t, factor * column, color=look[0], linestyle=look[1])
            apart = _channel_difference(*(values[at] for values, at in zip(pair, places, strict=True)))
            right.plot(self.t, factor * apart, color=COLORS[1])
            if (group, name) in stated.index and np.isfinite(error := factor * stated[group, name]):
                right.axhspan(-error, error, color="0.85", zorder=0)
            left.set_title(plain(group).replace("_", " "), loc="left")
            left.set(ylabel=label, xmargin=0)
            right.set(ylabel="difference" + "".join(label.partition(" / ")[1:]), xmargin=0)
        for axes in rows[-1]:
            axes.set_xlabel("time / s")
        first, second = (run.scene.get("name", "run") for run in self.runs)
        title = f"full: {first}, dashed: {second}; right: second less first, grey: stated error"
        figure.suptitle(plain(title), x=0.01, ha="left")
        return figure

    def _shown(self) -> tuple[str, ...]:
        """Return the channels of `SHOWN`, each in the group with the largest difference, else the channels that differ
        most."""
        order = self.summary.itertuples()
        worst = {(row.channel, "/" in row.group): f"{row.group}.{row.channel}" for row in order}
        return tuple(worst[key] for key in SHOWN.items() if key in worst) or tuple(worst.values())[: len(SHOWN)]


@overload
def compare(a: Run | str | PathLike[str], b: Run | str | PathLike[str]) -> Comparison: ...
@overload
def compare(
    a: Run | str | PathLike[str],
    b: Signal,
    band: Sequence[float | None] | None = None,
    sections: float | Sequence[Sequence[float]] | None = None,
    limits: Mapping[str, Any] | None = None,
) -> SignalComparison: ...
@checked
def compare(
    a: Run | str | PathLike[str],
    b: Run | Signal | str | PathLike[str],
    band: Sequence[float | None] | None = None,
    sections: float | Sequence[Sequence[float]] | None = None,
    limits: Mapping[str, Any] | None = None,
) -> Comparison | SignalComparison:
    """Compare two runs channel by channel, or a run with a measured signal.

    Two runs: all stored or derived channels that both have are compared at their common output times. Channels of
    contacts are compared patch by patch, at times at which a wheel has the same number of patches in both runs.

    A run and a signal: the channels that both have are resampled and filtered alike, to the larger of both steps, and
    compared where both overlap. :meth:`wrcore.Signal.shifted` or :meth:`wrcore.Signal.aligned` aligns a signal.

    Parameters
    ----------
    a : str, Path or Run
        Run or its file.
    b : str, Path, Run or Signal
        Second run or its file, or a signal of :func:`wrcore.read_signal`.
    band : pair of float or None, optional
        With a signal: lower and upper corner of a filter without phase shift, Hz (over distance 1/m).
    sections : float or sequence of (begin, end), optional
        With a signal: length of sections, or their ends, s or m. By default those of EN 14363 along the run's path: 250
        m of straight track, 100 m or 70 m of full curves.
    limits : mapping, optional
        With a signal: limits of the mean and of the standard deviation of differences by quantity and statistic, such
        as ``{"Q_N": {"maximum": (4e3, 6e3)}}``. Statistics are "maximum", "median" and "rms". wrcore has no limits.

    Returns
    -------
    Comparison
        Of two runs. ``table`` has a row per group and channel, in the channel's ``unit``. ``rms``, ``max``, ``mean``:
        of the difference b - a (the mean with its sign); ``t_max_s``: time of its maximum. ``scale``: root mean square
        of the channel; for positions and motions their standard deviation, or the difference of the runs' means. It is
        the largest value of both runs and all groups, for positions and motions at least 1e-9. ``relative``: rms over
        scale. ``error``: root of the sum of squares of the errors that the runs state; NaN if they state none. Runs of
        :func:`wrcore.simulate_to_accuracy` state the error of y, Y or Q (rms) or wear (of the mean). Runs with a lookup
        table of contact state the largest errors of N and Q. ``compared``: fraction of the common times at which both
        have a value.
    SignalComparison
        Of a run and a signal. ``table`` has a row per channel. ``rms``, ``max``, ``mean``: of the difference run -
        signal; ``scale``: standard deviation of the signal; ``relative``: standard deviation of the difference over
        scale; ``ratio``: standard deviation of the run over scale; ``correlation``: coefficient of both.
        ``validation``: mean and standard deviation over the sections of differences of their statistics.

    Raises
    ------
    InputError
        If a file is not a run, or if the runs have less than two output times, or no channel, in common. With a signal:
        if it does not overlap the run, or has none of its channels.

    Examples
    --------
    >>> import wrcore as wr
    >>> changes = {"contact.patch": "moment", "integration.duration": 0.2}
    >>> scene = wr.load_scene(wr.example("suspended_wheelset"), changes)
    >>> found = wr.compare(wr.simulate(scene), wr.simulate(scene, contact__detection="planar"))
    >>> row = found.table.set_index(["group", "channel"]).loc["wheelset", "y_m"]
    >>> bool(row["rms"] < 1e-6), bool(row["relative"] < 1e-3)
    (True, True)
    """
    if isinstance(b, Signal):
        return compare_with_signal(a if isinstance(a, Run) else load_run(a), b, band, sections, limits)
    for name, value in (("band", band), ("sections", sections), ("limits", limits)):
        if value is not None:
            raise InputError("compare", name, "expected a signal of wr.read_signal beside it, got two runs")
    runs = tuple(one if isinstance(one, Run) else load_run(one) for one in (a, b))
    places = _common(*(run.t for run in runs))
    if len(places[0]) < 2:
        raise InputError("compare", "t", "expected two runs with at least two output times in common")
    found = [
        (group, name, *(np.asarray(run[group][name])[at] for run, at in zip(runs, places, strict=True)))
        for group in runs[0] if group in runs[1]
        for name in runs[0][group].names() if runs[1][group].follows(name)
    ]  # fmt: skip
    scales: dict[tuple[bool, str], float] = {}
    for group, name, *pair in found:
        key = "/" in group, name
        scales[key] = max(scales.get(key, 0.0), _scale(*key, *pair))
    t = runs[0].t[places[0]]
    rows = [row for group, name, *pair in found for row in _row(runs, t, group, name, pair, scales["/" in group, name])]
    if not rows:
        raise InputError("compare", "channels", "expected two runs with a channel in common")
    scenes = [flat(run.scene) for run in runs]
    keys = [key for key in {**scenes[0], **scenes[1]} if scenes[0].get(key) != scenes[1].get(key)]
    changes = {key: (scenes[0].get(key), scenes[1].get(key)) for key in keys}
    return Comparison((runs[0], runs[1]), changes, t, pd.DataFrame(rows))


def _common(one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices, in both runs, of their common output times."""
    if not len(one) or not len(other):
        return np.empty(0, int), np.empty(0, int)
    near = np.minimum(np.searchsorted(other, one - SAME_TIME), len(other) - 1)
    same = np.abs(other[near] - one) <= SAME_TIME
    return np.flatnonzero(same), near[same]


def _channel_difference(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the difference of a channel; NaN for patches at times at which the runs have different numbers of them."""
    width = min(part.shape[1:] for part in (one, other))
    if not width:
        return other - one
    alike = np.isfinite(one).sum(axis=1) == np.isfinite(other).sum(axis=1)
    return np.where(alike[:, None], other[:, : width[0]] - one[:, : width[0]], np.nan)


def _scale(of_contact: bool, name: str, *pair: np.ndarray) -> float:
    """Return the scale of a channel: the larger root mean square of both runs.

    For positions and motions it is the largest of both standard deviations, the difference of the means and `LEAST`.
    """
    finite = [values[np.isfinite(values)] for values in pair]
    if not all(values.size for values in finite):
        return 0.0
    if name in PLACES if of_contact else unit_of(name) in MOTION:
        apart = abs(np.mean(finite[1]) - np.mean(finite[0]))
        return float(max(LEAST, apart, *(np.std(values) for values in finite)))
    return float(max(np.sqrt(np.mean(values**2)) for values in finite))


def _row(runs, t, group, name, pair, scale) -> Iterator[dict[str, Any]]:
    """Yield the row of a channel; no row if there is no time at which both runs have a value."""
    apart = _channel_difference(*pair).reshape(len(t), -1)
    known = np.isfinite(apart)
    if not known.any():
        return
    there = apart[known]
    rms, size = float(np.sqrt(np.mean(there**2))), np.where(known, np.abs(apart), -1.0).max(axis=1)
    errors = [error for run in runs for error in _stated(run, group, name, scale)]
    yield {
        "group": group, "channel": name, "unit": unit_of(name), "rms": rms, "max": float(size.max()),
        "t_max_s": float(t[size.argmax()]), "mean": float(np.mean(there)), "scale": scale,
        "relative": rms / scale if scale > 0.0 else 0.0 if rms == 0.0 else np.inf,
        "error": float(np.linalg.norm(errors)) if errors else np.nan,
        "compared": float(known.any(axis=1).mean()),
    }  # fmt: skip


def _stated(run: Run, group: str, name: str, scale: float) -> Iterator[float]:
    """Yield the errors that a run states for one of its channels."""
    of = ACCURACIES.get(str(run.settings.get("accuracy_of")))
    if name == of and (name != "y_m" or group in wheelsets_of(run)):
        yield float(run.settings["accuracy_found"])
    if name in ("N_N", "Q_N") and "look_up_normal_error" in run.counters:
        yield float(run.counters["look_up_normal_error"]) * scale
