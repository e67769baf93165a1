"""Measured signals in SI units over time or distance, and the same form of channels of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from wrcore.errors import InputError, UnknownNameError, similar
from wrcore.errors.checked_calls import checked
from wrcore.run.output.channels import unit_of
from wrcore.run.output.run import Run
from wrcore.signals.alignment import offset_by_correlation
from wrcore.signals.filters import check_band, on_grid, usual_step, without_gaps, zero_phase

if TYPE_CHECKING:
    import pandas as pd

AXIS_UNITS = {"t_s": ("s", "Hz"), "s_m": ("m", "1/m")}
"""Unit of the axis and unit of frequencies along it, by the name of the axis."""

MOST_SAMPLES = 50_000_000
"""Largest number of even steps of a signal; more do not fit into the memory of most machines."""

Axis = Literal["t_s", "s_m"]
Band = tuple[float | None, float | None]


@checked
@dataclass(frozen=True, repr=False, eq=False)
class Signal:
    """Channels of a measurement over time or distance, in SI units.

    Parameters
    ----------
    axis : {"t_s", "s_m"}
        Whether ``x`` is time or distance.
    x : ndarray, shape (n,)
        Increasing times (s) or distances (m) of the samples.
    values : dict of str to ndarray, shape (n,)
        Values by channel, NaN where there is none. Names of channels are those of a run, such as ``wheelset.y_m``.
    units : dict of str to str
        Unit of each channel; an SI unit wherever the file states a known unit.
    source : str
        File that was read.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(0.0, 2.0, 0.001)
    >>> signal = Signal("t_s", t, {"car_body.ay_m_per_s2": np.sin(2 * np.pi * t) + np.sin(400 * np.pi * t)})
    >>> signal
    Signal: 2000 samples over 1.999 s, 1000 Hz; car_body.ay_m_per_s2 (m/s^2)
    >>> smooth = signal.filtered((None, 20.0)).resampled(0.01)
    >>> len(smooth.x), bool(abs(smooth["car_body.ay_m_per_s2"][25] - 1.0) < 1e-3)
    (200, True)
    """

    axis: Axis
    x: np.ndarray
    values: Mapping[str, np.ndarray]
    units: Mapping[str, str] = field(default_factory=dict)
    source: str = ""

    def __post_init__(self) -> None:
        for name, part in {"x": self.x, **self.values}.items():
            if part.dtype.kind not in "fiub":
                raise InputError("Signal", name, "expected an array of numbers")
        object.__setattr__(self, "x", np.asarray(self.x, float))
        object.__setattr__(self, "values", {name: np.asarray(part, float) for name, part in self.values.items()})
        units = {name: self.units.get(name, unit_of(name)) for name in self.values}
        object.__setattr__(self, "units", units)
        if self.x.ndim != 1 or len(self.x) < 2 or not (np.diff(self.x) > 0.0).all() or not np.isfinite(self.x).all():
            raise InputError("Signal", "x", "expected two increasing numbers or more")
        for name, part in self.values.items():
            if part.shape != self.x.shape:
                raise InputError("Signal", name, f"expected {len(self.x)} values, got an array of shape {part.shape}")

    @property
    def step(self) -> float:
        """Median distance of samples, s or m."""
        return usual_step(self.x)

    def __getitem__(self, channel: str) -> np.ndarray:
        """Return the values (n,) of a channel; the error for an unknown name states the channels."""
        if channel not in self.values:
            text = f"no channel {channel!r} in this signal; it has {', '.join(self.values)}"
            raise UnknownNameError("signal", "", f"{text}{similar(channel, self.values)}")
        return self.values[channel]

    def __iter__(self) -> Iterator[str]:
        return iter(self.values)

    def keys(self) -> list[str]:
        """Return the names of the channels."""
        return list(self.values)

    def __repr__(self) -> str:
        unit, per_unit = AXIS_UNITS[self.axis]
        rate = f"{1.0 / self.step:.6g} {per_unit}"
        channels = ", ".join(f"{name} ({self.units[name]})" for name in self.values)
        source = f" {self.source!r}" if self.source else ""
        return f"Signal{source}: {len(self.x)} samples over {self.x[-1] - self.x[0]:.6g} {unit}, {rate}; {channels}"

    @checked
    def filtered(self, band: Sequence[float | None]) -> Signal:
        """Return the signal after a band-pass, high-pass or low-pass without phase shift.

        The filter is a Butterworth filter of second order, applied forwards and backwards. It reduces the amplitude to
        71 % at a corner. Unevenly spaced samples are resampled first.

        Parameters
        ----------
        band : pair of float or None
            Lower and upper corner, Hz over time and 1/m over distance; None: no corner.
        """
        even = self.resampled(self.step)
        corners = check_band(_pair(band), 1.0 / even.step, "filtered", AXIS_UNITS[self.axis][1])
        return even._each(lambda part: _filtered(part, 1.0 / even.step, corners))

    @checked
    def resampled(self, step: float) -> Signal:
        """Return the signal at even steps (s or m), whose positions are multiples of the step.

        Before a coarser grid a low-pass removes frequencies above 80 % of the largest one that the grid can hold."""
        length = float(self.x[-1] - self.x[0])
        if not length / MOST_SAMPLES < min(step, self.step) or not step < length:
            expected = f"expected a step below the {length:g} of the signal, and at most {MOST_SAMPLES:g} steps"
            raise InputError("resampled", "step", f"{expected}, got {step:g} and samples {self.step:g} apart")
        grid = grid_of(self.x, step)
        return replace(self, x=grid, values={name: on_grid(self.x, part, grid) for name, part in self.values.items()})

    @checked
    def shifted(self, offset: float) -> Signal:
        """Return the signal with another zero of its axis; ``offset`` (s or m) is added to ``x``."""
        if not np.isfinite(offset):
            raise InputError("shifted", "offset", f"expected a finite number, got {offset}")
        return replace(self, x=self.x + offset)

    @checked
    def cut(self, begin: float = -np.inf, end: float = np.inf) -> Signal:
        """Return the samples from ``begin`` to ``end`` (s or m)."""
        inside = (self.x >= begin) & (self.x <= end)
        if np.count_nonzero(inside) < 2:
            expected = f"expected a part of {self.x[0]:g} to {self.x[-1]:g} with two samples or more"
            raise InputError("cut", "begin", f"{expected}, got {begin:g} to {end:g}")
        return replace(self, x=self.x[inside], values={name: part[inside] for name, part in self.values.items()})

    @checked
    def over_distance(self, distance: str | float) -> Signal:
        """Return a signal over time as a signal over distance.

        Parameters
        ----------
        distance : str or float
            Channel that holds the distance, m, or constant speed, m/s. Samples at standstill are left out.
        """
        if self.axis != "t_s":
            raise InputError("over_distance", "axis", "expected a signal over time")
        s = self[distance] if isinstance(distance, str) else distance * self.x
        s = np.maximum.accumulate(np.where(np.isfinite(s), s, -np.inf))
        forward = np.isfinite(s) & (np.diff(s, prepend=-np.inf) > 0.0)
        if np.count_nonzero(forward) < 2:
            raise InputError("over_distance", "distance", f"expected distances that increase, got {distance}")
        rows = {name: part[forward] for name, part in self.values.items() if name != distance}
        return replace(self, axis="s_m", x=s[forward], values=rows)

    @checked
    def aligned(self, run: Run, channel: str, band: Sequence[float | None] = (None, None)) -> Signal:
        """Return the signal with its axis shifted to where a channel fits best that of a run.

        The shift has the largest correlation coefficient of both over at least half of the shorter one. A warning says
        if other shifts have nearly the same coefficient, as in periodic motion.

        Parameters
        ----------
        run : Run
        channel : str
            Channel that both have, such as ``wheelset.y_m``.
        band : pair of float or None
            Lower and upper corner of a filter for both, as in :meth:`filtered`.
        """
        simulated = signal_of_run(run, [channel], self.axis)
        step = max(simulated.step, self.step)
        unit, per_unit = AXIS_UNITS[self.axis]
        corners, pairs = check_band(_pair(band), 1.0 / step, "aligned", per_unit), []
        for one in (simulated, replace(self, values={channel: self[channel]})):
            even = one.resampled(step)
            pairs.append((even.x, _filtered(even[channel], 1.0 / step, corners)))
        return self.shifted(offset_by_correlation(pairs[0], pairs[1], step, channel, unit))

    def to_pandas(self) -> pd.DataFrame:
        """Return the channels as a table with a column per channel; the index is the axis."""
        import pandas as pd

        return pd.DataFrame(dict(self.values), index=pd.Index(self.x, name=self.axis))

    def _each(self, change) -> Signal:
        return replace(self, values={name: change(part) for name, part in self.values.items()})


def _pair(band: Sequence[float | None]) -> Band:
    if len(band) != 2:
        raise InputError("signal", "band", f"expected a lower and an upper corner, got {len(band)} numbers")
    return band[0], band[1]


def _filtered(part, rate, corners):
    filled, known = without_gaps(part)
    return np.where(known, zero_phase(filled, rate, corners), np.nan) if known.any() else part


def grid_of(x: np.ndarray, step: float) -> np.ndarray:
    """Return the multiples of a step within the range of positions x."""
    slack = 1e-6
    return step * np.arange(int(np.ceil(x[0] / step - slack)), int(np.floor(x[-1] / step + slack)) + 1)


def signal_of_run(run: Run, channels: Sequence[str], axis: Axis = "t_s", distance: str = "") -> Signal:
    """Return channels of a run as a signal over time or distance.

    ``distance`` is the channel with the distance, by default ``s_m`` or ``x_m`` of the first body that has it."""
    values = {channel: values_of_run(run, channel) for channel in channels}
    signal = Signal("t_s", run.t, values, source=str(run.scene.get("name", "run")))
    if axis == "t_s":
        return signal
    distance = distance or distance_channel(run)
    along = Signal("t_s", run.t, values | {"": values_of_run(run, distance)}, source=signal.source)
    return along.over_distance("")


def distance_channel(run: Run) -> str:
    """Return the first channel of a body with the distance along the track."""
    for group in run:
        for name in ("s_m", "x_m"):
            if "/" not in group and name in run[group]:
                return f"{group}.{name}"
    raise InputError("run", "", "expected a body with the channel s_m or x_m, for its distance")


def values_of_run(run: Run, channel: str) -> np.ndarray:
    """Return the values (n,) of a channel of a run, such as ``wheelset/left.Q_N``."""
    group, _, name = channel.rpartition(".")
    values = run[group][name]
    if values.ndim > 1:
        expected = "expected a channel with one value at a time, such as Q_N or Y_N, got one of contact patches"
        raise InputError("run", channel, expected)
    return values
