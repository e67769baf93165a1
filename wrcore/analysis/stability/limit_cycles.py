"""Limit cycles of vehicles over speed: what is left of a large and of a small disturbance.

A motion is followed in windows of equal length until its amplitude has settled. *Falling*: a large disturbance at the
highest speed, and the state is carried from speed to speed downwards; it stays on a limit cycle for as long as there is
one. *Rising*: a small disturbance at each speed, carried upwards; it stays at rest for as long as that is stable. Where
the branches differ, the disturbance decides.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pandas as pd

from wrcore.analysis.stability.stability import at_speed, rising, straight_ahead
from wrcore.bodies.body import STATE_SIZE
from wrcore.errors import InputError
from wrcore.errors.checked_calls import ABOVE_ZERO, OneOf, Within, checked
from wrcore.integrate.integrator import METHODS, integrate
from wrcore.kernels.cache import say as say_aloud
from wrcore.kernels.told import PATIENCE, tell
from wrcore.run.motion import hunting_frequency
from wrcore.run.simulation import DERAILED_Y
from wrcore.scene.description import Source, as_scene

COLUMNS = (
    "speed_m_per_s", "amplitude_m", "frequency_Hz", "offset_m", "simulated_s", "status",
)  # fmt: skip
CYCLES = ("limit cycle", "irregular")  # status of motions that do not die away
DISTURBANCES = (0.006, 0.0065, 0.007, 0.008, 0.009)  # sideways shifts that may end on a cycle, m


@checked
@dataclass(frozen=True)
class Settling:
    """How a motion is followed until it has settled.

    Attributes
    ----------
    window : float
        Length of a window, s; several periods.
    longest : float
        A motion that still changes after this time is taken as it is, s: growing or decaying in each window since
        half-way, or irregular.
    change : float
        Amplitudes of three windows in a row that differ by less than this part count as settled.
    rest : float
        A smaller amplitude than this is no limit cycle, m.
    disturbance : float
        Sideways shift of the vehicle that tries whether running straight ahead is stable, m, above ``rest``.
    rate : float
        Samples per second of the amplitude.
    method : str
    rtol : float
        Integration method and tolerance, see `wrcore.integrate.integrator.integrate`.

    Examples
    --------
    >>> import wrcore as wr
    >>> wr.Settling(longest=10.0).window
    2.0
    """

    window: Annotated[float, ABOVE_ZERO] = 2.0
    longest: Annotated[float, ABOVE_ZERO] = 30.0
    change: Annotated[float, ABOVE_ZERO] = 0.002
    rest: Annotated[float, ABOVE_ZERO] = 5e-5
    disturbance: Annotated[float, ABOVE_ZERO] = 1e-4
    rate: Annotated[float, ABOVE_ZERO] = 500.0
    method: Annotated[str, OneOf(("auto", *METHODS))] = "auto"
    rtol: Annotated[float, Within(1e-13, 0.1)] = 1e-5


def _run(model, state, settling):
    """Lateral positions (samples, wheelsets) over a window, the state at its end, and whether the wheels stay on."""
    times = np.linspace(0.0, settling.window, round(settling.window * settling.rate) + 1)
    run = integrate(model, state, times, settling.method, settling.rtol, derailed_y=DERAILED_Y)
    lateral = run.states[:, STATE_SIZE * model.bodies.wheelsets + 1]
    return run.t, lateral, run.states[-1], run.status == "completed"


def settle_motion(model, state, settling):
    """Follow a motion on a tangent, perfect track until its amplitude has settled: a row of what the last window shows,
    and the state at the end.

    The row: speed_m_per_s; amplitude_m (half of the peak to peak, of the wheelset with the largest; NaN if it derails),
    frequency_Hz and offset_m (mean) of that wheelset; simulated_s; derailed; status: ``at rest``, ``limit cycle``, or
    after the longest time ``growing``, ``decaying`` or ``irregular``. Windows of a chaotic motion seldom agree, but
    may: whether it is irregular or a limit cycle then depends on the last bits.
    """
    amplitudes, elapsed, status = [], 0.0, ""
    while not status:
        row, state, lasted = _window(model, state, settling)
        elapsed += lasted
        amplitudes.append(row["amplitude_m"])
        status = "derailed" if np.isnan(amplitudes[-1]) else _status(amplitudes, elapsed, settling)
    return row | {"simulated_s": elapsed, "status": status}, state


def _window(model, state, settling):
    """What a window shows (the first entries of the row of `settle_motion`), the state at its end, and its length."""
    t, lateral, state, on_rails = _run(model, state, settling)
    _, state = at_speed(model, state, model.speed, t[-1])
    spans = 0.5 * np.ptp(lateral, axis=0)
    y = lateral[:, np.argmax(spans)]
    amplitude = float(np.max(spans)) if on_rails else np.nan
    row = {
        "speed_m_per_s": model.speed, "amplitude_m": amplitude,
        "frequency_Hz": hunting_frequency(t, y - np.mean(y)) if amplitude >= settling.rest else np.nan,
        "offset_m": float(np.mean(y)),
    }  # fmt: skip
    return row, state, t[-1]


def _status(amplitudes, elapsed, settling):
    """What the amplitudes of all windows so far show; empty while they show nothing."""
    last = amplitudes[-1]
    if last < settling.rest:
        return "at rest"
    if len(amplitudes) > 2 and np.ptp(amplitudes[-3:]) < settling.change * last:
        return "limit cycle"
    if elapsed < settling.longest - 1e-9:
        return ""
    trend = np.sign(np.diff(amplitudes[(len(amplitudes) - 1) // 2 :]))
    return "decaying" if np.all(trend < 0.0) else "growing" if np.all(trend > 0.0) else "irregular"


def shifted(model, state, shift):
    """A state with all bodies shifted sideways (m)."""
    state = state.copy()
    state[1 : STATE_SIZE * len(model.bodies.mass) : STATE_SIZE] += shift
    return state


class Watch:
    """What is said of the speeds of a branch, and whether it was stopped: ``say`` gets a line after each speed; without
    it lines go to standard error once the work takes long. Ctrl-C ends a branch, which keeps its rows, where it may be
    ``stoppable``; else it is an error as ever."""

    def __init__(self, say=None, stoppable=False):
        self.say, self.stoppable, self.stopped, self.begun = say, stoppable, False, time.monotonic()

    @contextmanager
    def branch(self):
        """Around the speeds of a branch."""
        try:
            yield
        except KeyboardInterrupt:
            if not self.stoppable:
                raise
            self.stopped = True

    def tell(self, name, row, remaining):
        """Say what a speed of a branch has shown, and how many speeds remain at most."""
        text = f"{name}, {row['speed_m_per_s']:g} m/s: {row['status']}; at most {remaining} speeds remain"
        if self.say is not None:
            self.say(text)
        elif time.monotonic() - self.begun > PATIENCE:
            tell(f"limit cycles: {text}")

    def end(self, table, asker):
        """The table, or the interrupt where it is empty; a table that was stopped says so (``attrs``)."""
        if self.stopped:
            if table.empty:
                raise KeyboardInterrupt
            table.attrs["stopped"] = True
            say_aloud(f"{asker}: stopped; the table holds what was found, {len(table)} rows")
        return table


def falling_branch(model, state, speeds, settling, disturbances, resolution, watch=None):
    """Amplitude of the limit cycle from the highest speed downwards: rows of `settle_motion`, fastest first, the last
    one the fastest motion that comes to rest. The speed at which the limit cycle ends is halved to ``resolution``.

    ``state`` runs straight ahead at the model's speed, ``speeds`` rise (m/s), ``disturbances`` are sideways shifts (m).
    The motion is carried from speed to speed. Where its amplitude drops by a third or more, fresh disturbances are
    tried as well and the largest of these motions counts: an irregular motion can leave one limit cycle for another.
    Where every disturbance derails, the next lower speed is tried.
    """
    rows: list[dict[str, Any]] = []
    lost, below, queue, watch = [], None, list(speeds), watch or Watch()
    carried: list[Any] = []
    with watch.branch():
        while queue:
            there, straight = at_speed(model, state, queue.pop())
            tried = [settle_motion(there, at_speed(before, end, there.speed)[1], settling) for before, end in carried]
            if not tried or not tried[0][0]["amplitude_m"] >= 0.67 * rows[-1]["amplitude_m"]:
                tried += [settle_motion(there, shifted(model, straight, shift), settling) for shift in disturbances]
            row, end = max(tried, key=lambda motion: np.nan_to_num(motion[0]["amplitude_m"], nan=-1.0))
            if row["status"] in CYCLES:
                rows.append(row)
                carried = [(there, end)]
            elif row["status"] == "derailed":
                lost.append(row)
            else:
                below, queue = row, []
            gap = rows[-1]["speed_m_per_s"] - below["speed_m_per_s"] if below and rows else 0.0
            if below and gap > resolution:
                queue = [0.5 * (rows[-1]["speed_m_per_s"] + below["speed_m_per_s"])]
            watch.tell(
                "falling", row, len(queue) + (math.ceil(math.log2(gap / resolution)) - 1 if queue and gap else 0)
            )
    table = pd.DataFrame([*lost, *rows, *([below] if below else [])], columns=COLUMNS)
    return table.sort_values("speed_m_per_s", ascending=False, ignore_index=True)


def rising_branch(model, state, speeds, settling, watch=None):
    """Amplitude that a small disturbance leaves, from the lowest speed upwards; arguments as for `falling_branch`. The
    motion is carried from speed to speed and disturbed again (``settling.disturbance``) at each.
    """
    rows, watch = [], watch or Watch()
    with watch.branch():
        for k, speed in enumerate(speeds, 1):
            model, state = at_speed(model, state, speed)
            row, state = settle_motion(model, shifted(model, state, settling.disturbance), settling)
            rows.append(row)
            watch.tell("rising", row, len(speeds) - k)
            if row["status"] == "derailed":
                break
    return pd.DataFrame(rows, columns=COLUMNS)


@checked
def limit_cycles(
    scene: Source,
    speeds: Iterable[float],
    settling: Settling | None = None,
    disturbances: Annotated[Sequence[float], Within(-DERAILED_Y, DERAILED_Y, "m")] = DISTURBANCES,
    resolution: Annotated[float, Within(1e-3, 150.0, "m/s")] = 0.25,
    say: Callable[[str], object] | None = None,
) -> pd.DataFrame:
    """Both branches of a scene's vehicle. Ctrl-C stops it: it then returns the rows that it has.

    Parameters
    ----------
    scene : Scene, path or dict
        Runs are on a tangent, perfect track, whatever it says of path, gradients and irregularity; neither its drive
        and control nor where the vehicle starts count.
    speeds : sequence of float
        Rising, m/s.
    settling : Settling, optional
        Left out: its defaults.
    disturbances : sequence of float
        Sideways shifts of the vehicle that may end on a cycle, one or more, within 0.05 m.
    resolution : float
        Of the lowest speed with a limit cycle, m/s, at least 1e-3.
    say : callable, optional
        Called with a line after each speed: what was found there, and how many speeds remain at most. Left out: lines
        on standard error, once the work takes three seconds (none with ``WRCORE_PROGRESS=0``).

    Returns
    -------
    pandas.DataFrame
        Rows of :func:`falling_branch` and :func:`rising_branch` after a column branch. Where Ctrl-C stopped it,
        ``table.attrs["stopped"]`` is True, and a line on standard error says so.

    Raises
    ------
    InputError
        For speeds that do not rise, a number out of bounds, or no disturbance.

    Examples
    --------
    >>> import wrcore as wr
    >>> settling = wr.Settling(window=1.0, longest=20.0)
    >>> table = wr.limit_cycles(wr.example("suspended_wheelset"), [40.0, 60.0], settling, [0.003], 25.0)
    >>> table[["branch", "speed_m_per_s", "status"]]
        branch  speed_m_per_s       status
    0  falling           60.0  limit cycle
    1  falling           40.0      at rest
    2   rising           40.0      at rest
    3   rising           60.0  limit cycle
    """
    speeds, settling = rising(speeds), settling or Settling()
    (model, state), watch = straight_ahead(as_scene(scene)), Watch(say, stoppable=True)
    tables = {"falling": falling_branch(model, state, speeds, settling, disturbances, resolution, watch)}
    if not watch.stopped:
        tables["rising"] = rising_branch(model, state, speeds, settling, watch)
    table = pd.concat(tables, names=["branch"]).reset_index("branch").reset_index(drop=True)
    return watch.end(table, "limit_cycles")


@checked
def speed_ramp(
    scene: Source,
    start: Annotated[float, Within(1.0, 150.0, "m/s")],
    end: Annotated[float, Within(1.0, 150.0, "m/s")],
    rate: Annotated[float, Within(1e-4, 100.0, "m/s^2")] = 0.5,
    settling: Settling | None = None,
    disturbances: Annotated[Sequence[float], Within(-DERAILED_Y, DERAILED_Y, "m")] = DISTURBANCES,
) -> pd.DataFrame:
    """Nonlinear critical speed by a ramp: a vehicle that hunts above it slows down until the motion dies.

    Parameters
    ----------
    scene : Scene, path or dict
        Runs are on a tangent, perfect track, whatever it says of path, gradients and irregularity; neither its drive
        and control nor where the vehicle starts count.
    start, end : float
        Speeds between which the vehicle slows down, m/s.
    rate : float
        m/s^2: the speed falls by rate times ``settling.window`` from window to window, and is constant in each.
    settling : Settling, optional
        How a motion at the start is followed until it has settled, window and method; the ramp ends at an amplitude
        below its ``rest``. Left out: its defaults, but for windows of 1 s.
    disturbances : sequence of float
        Sideways shifts of the vehicle at the start, m: the largest motion that settles from one goes on.

    Returns
    -------
    pandas.DataFrame
        A row per window: t_s at its end; speed_m_per_s, amplitude_m (NaN: derailed), frequency_Hz, offset_m as in
        :func:`limit_cycles`; stopped by Ctrl-C, the rows so far, as there.

    Raises
    ------
    InputError
        Where the speeds do not fall.

    Notes
    -----
    Read off: the lowest speed whose amplitude is above some limit. It is below the limit cycle's fold by what the
    vehicle slows down while the motion decays: half the rate should give next to the same. It is one motion in one run;
    :func:`limit_cycles` tries fresh disturbances where an amplitude drops.

    Examples
    --------
    >>> import wrcore as wr
    >>> table = wr.speed_ramp(wr.example("suspended_wheelset"), 60.0, 50.0, rate=2.0, disturbances=[0.0025])
    >>> bool(table["amplitude_m"].iloc[-1] < 0.3 * table["amplitude_m"].iloc[0])
    True
    """
    if not start > end:
        raise InputError("speed_ramp", "end", f"expected less than the start of {start:g} m/s, got {end:g}")
    settling = settling or Settling(window=1.0)
    model, state = straight_ahead(as_scene(scene))
    model, straight = at_speed(model, state, start)
    tried = [settle_motion(model, shifted(model, straight, shift), settling) for shift in disturbances]
    _, state = max(tried, key=lambda motion: np.nan_to_num(motion[0]["amplitude_m"], nan=-1.0))
    rows, elapsed, watch = [], 0.0, Watch(stoppable=True)
    with watch.branch():
        for speed in np.arange(start, end, -rate * settling.window):
            model, state = at_speed(model, state, float(speed))
            row, state, lasted = _window(model, state, settling)
            elapsed += lasted
            rows.append({"t_s": elapsed, **row})
            if not row["amplitude_m"] >= settling.rest:
                break
    return watch.end(pd.DataFrame(rows), "speed_ramp")


def nonlinear_critical_speed(table):
    """Dict of nonlinear_critical_speed_m_per_s, half-way between the slowest limit cycle and the fastest motion that
    came to rest in a table of :func:`limit_cycles` (NaN if all or none did), their distance uncertainty_m_per_s, and
    amplitude_m and cycle_frequency_Hz of that limit cycle.
    """
    falling = table[table["branch"] == "falling"]
    cycles, rest = falling[falling["status"].isin(CYCLES)], falling[falling["status"].isin(["at rest", "decaying"])]
    if cycles.empty or rest.empty:
        return dict.fromkeys(
            ("nonlinear_critical_speed_m_per_s", "uncertainty_m_per_s", "amplitude_m", "cycle_frequency_Hz"), np.nan
        )
    slowest, below = cycles.loc[cycles["speed_m_per_s"].idxmin()], rest["speed_m_per_s"].max()
    return {
        "nonlinear_critical_speed_m_per_s": 0.5 * (slowest["speed_m_per_s"] + below),
        "uncertainty_m_per_s": slowest["speed_m_per_s"] - below,
        "amplitude_m": slowest["amplitude_m"], "cycle_frequency_Hz": slowest["frequency_Hz"],
    }  # fmt: skip
