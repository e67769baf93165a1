"""Limit cycles of vehicles as a function of speed: final amplitudes after a large and after a small disturbance.

A motion is simulated in windows of equal length until its amplitude has settled. *Falling* branch: a large disturbance
at the highest speed; the final state is the initial state at the next lower speed. It stays on a limit cycle as long as
one exists. *Rising* branch: a small disturbance at each speed, in the order of increasing speed. The vehicle stays at
rest as long as this is stable. Where the branches differ, the final motion depends on the disturbance.
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
from wrcore.errors.messages import PATIENCE, tell
from wrcore.errors.messages import say as say_aloud
from wrcore.integrate.integrator import METHODS, integrate
from wrcore.run.motion import hunting_frequency
from wrcore.run.simulation import DERAILED_Y
from wrcore.scene.description import Source, as_scene

COLUMNS = (
    "speed_m_per_s", "amplitude_m", "frequency_Hz", "offset_m", "simulated_s", "status",
)  # fmt: skip
CYCLES = ("limit cycle", "irregular")  # status of motions that do not decay
DISTURBANCES = (0.006, 0.0065, 0.007, 0.008, 0.009)  # lateral displacements that may lead to a limit cycle, m


@checked
@dataclass(frozen=True)
class Settling:
    """Settings of the simulation of a motion until its amplitude has settled.

    Attributes
    ----------
    window : float
        Length of a window, s; several periods.
    longest : float
        Longest simulated time, s. A motion that still changes then is growing or decaying if its amplitude did so in
        each window of the second half, else irregular.
    change : float
        Largest relative difference of the amplitudes of three successive windows of a settled motion.
    rest : float
        Amplitude below which a motion is not a limit cycle, m.
    disturbance : float
        Lateral displacement of the vehicle that tests the stability of straight running, m, above ``rest``.
    rate : float
        Sampling rate of the amplitude, 1/s.
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
    """Simulate a window: return times (s), lateral positions (samples, wheelsets), m, the final state, and whether the
    vehicle has not derailed."""
    times = np.linspace(0.0, settling.window, round(settling.window * settling.rate) + 1)
    run = integrate(model, state, times, settling.method, settling.rtol, derailed_y=DERAILED_Y)
    lateral = run.states[:, STATE_SIZE * model.bodies.wheelsets + 1]
    return run.t, lateral, run.states[-1], run.status == "completed"


def settle_motion(model, state, settling):
    """Simulate a motion on a tangent, perfect track until its amplitude has settled; return a row of results and the
    final state.

    The row, of the last window: speed_m_per_s; amplitude_m (half of the peak-to-peak value, of the wheelset with the
    largest; NaN if it derails), frequency_Hz and offset_m (mean) of that wheelset; simulated_s; status: ``derailed``,
    ``at rest``, ``limit cycle``, or after the longest time ``growing``, ``decaying`` or ``irregular``. Amplitudes of a
    chaotic motion may agree by chance; then rounding errors determine whether its status is irregular or limit cycle.
    """
    amplitudes, elapsed, status = [], 0.0, ""
    while not status:
        row, state, lasted = _window(model, state, settling)
        elapsed += lasted
        amplitudes.append(row["amplitude_m"])
        status = "derailed" if np.isnan(amplitudes[-1]) else _status(amplitudes, elapsed, settling)
    return row | {"simulated_s": elapsed, "status": status}, state


def _window(model, state, settling):
    """Simulate a window: return the first entries of the row of `settle_motion`, the final state, and its length, s."""
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
    """Return the status of a motion from the amplitudes of all windows so far; empty if it has not settled."""
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
    """Return a state with all bodies displaced laterally by ``shift`` (m, positive to the left)."""
    state = state.copy()
    state[1 : STATE_SIZE * len(model.bodies.mass) : STATE_SIZE] += shift
    return state


class Watch:
    """Progress messages of a branch, and whether Ctrl-C stopped it.

    ``say`` is called with a line after each speed; by default lines go to standard error after some seconds. If
    ``stoppable``, Ctrl-C ends a branch and its rows are kept; else KeyboardInterrupt is raised."""

    def __init__(self, say=None, stoppable=False):
        self.say, self.stoppable, self.stopped, self.begun = say, stoppable, False, time.monotonic()

    @contextmanager
    def branch(self):
        """Context of a branch that catches Ctrl-C if ``stoppable``."""
        try:
            yield
        except KeyboardInterrupt:
            if not self.stoppable:
                raise
            self.stopped = True

    def tell(self, name, row, remaining):
        """Report the status at a speed of a branch and the largest number of remaining speeds."""
        text = f"{name}, {row['speed_m_per_s']:g} m/s: {row['status']}; at most {remaining} speeds remain"
        if self.say is not None:
            self.say(text)
        elif time.monotonic() - self.begun > PATIENCE:
            tell(f"limit cycles: {text}")

    def end(self, table, asker):
        """Return the table, with ``attrs["stopped"]`` if Ctrl-C stopped it; KeyboardInterrupt if it is empty then."""
        if self.stopped:
            if table.empty:
                raise KeyboardInterrupt
            table.attrs["stopped"] = True
            say_aloud(f"{asker}: stopped; the table holds what was found, {len(table)} rows")
        return table


def falling_branch(model, state, speeds, settling, disturbances, resolution, watch=None):
    """Compute amplitudes of the limit cycle from the highest speed downwards.

    Return rows of `settle_motion`, highest speed first; the last row is the fastest motion that comes to rest. The
    speed at which the limit cycle ends is located by bisection to ``resolution`` (m/s). ``state`` is straight running
    at the model's speed, ``speeds`` increase (m/s), ``disturbances`` are lateral displacements (m). The final state at
    a speed is the initial state at the next one. If the amplitude decreases by a third or more, all disturbances are
    tried, too, and the motion with the largest amplitude is used, because an irregular motion can change to another
    limit cycle. If every disturbance leads to derailment, the next lower speed is tried.
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
    """Compute final amplitudes after a small disturbance, from the lowest speed upwards.

    Arguments are those of `falling_branch`. The final state at a speed, displaced again by ``settling.disturbance``, is
    the initial state at the next one.
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
    """Compute limit cycles of a scene's vehicle over speed, in both branches; Ctrl-C stops and returns the rows so far.

    Parameters
    ----------
    scene : Scene, path or dict
        Runs are on a tangent, perfect track. The scene's path, gradients, irregularity, drive, control and initial
        state are ignored.
    speeds : sequence of float
        Increasing speeds, m/s.
    settling : Settling, optional
        Settings of the simulations; by default those of `Settling`.
    disturbances : sequence of float
        Lateral displacements of the vehicle that may lead to a limit cycle, one or more, within 0.05 m.
    resolution : float
        Resolution of the lowest speed with a limit cycle, m/s, at least 1e-3.
    say : callable, optional
        Called with a line after each speed: the result, and the largest number of remaining speeds. By default lines
        go to standard error after three seconds (none with ``WRCORE_PROGRESS=0``).

    Returns
    -------
    pandas.DataFrame
        Rows of :func:`falling_branch` and :func:`rising_branch` after a column branch. After Ctrl-C,
        ``table.attrs["stopped"]`` is True, and a line on standard error reports it.

    Raises
    ------
    InputError
        If speeds do not increase, a number is out of bounds, or there is no disturbance.

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
    """Simulate a decreasing speed ramp of a hunting vehicle, from which the nonlinear critical speed is read.

    Parameters
    ----------
    scene : Scene, path or dict
        Runs are on a tangent, perfect track. The scene's path, gradients, irregularity, drive, control and initial
        state are ignored.
    start, end : float
        Speeds between which the vehicle slows down, m/s.
    rate : float
        Deceleration, m/s^2. The speed is constant in each window and decreases by rate times ``settling.window`` from
        window to window.
    settling : Settling, optional
        Settings of the simulations: of the initial motion until it has settled, and window and method of the ramp. The
        ramp ends at an amplitude below its ``rest``. By default those of `Settling`, with windows of 1 s.
    disturbances : sequence of float
        Lateral displacements of the vehicle at the start, m; the settled motion with the largest amplitude is used.

    Returns
    -------
    pandas.DataFrame
        A row per window: t_s at its end; speed_m_per_s, amplitude_m (NaN: derailed), frequency_Hz, offset_m as in
        :func:`limit_cycles`. After Ctrl-C, the rows so far, as in :func:`limit_cycles`.

    Raises
    ------
    InputError
        If ``end`` is not below ``start``.

    Notes
    -----
    The nonlinear critical speed is the lowest speed with an amplitude above some limit. It is below the fold of the
    limit cycle, because the vehicle slows down while the motion decays. Half the rate should lead to almost the same
    speed. The ramp follows one motion; :func:`limit_cycles` tries new disturbances if an amplitude decreases.

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
    """Return the nonlinear critical speed from a table of :func:`limit_cycles`, as a dict.

    nonlinear_critical_speed_m_per_s is the mean of the lowest speed with a limit cycle and the highest speed at which
    the motion came to rest in the falling branch (NaN without one of them). uncertainty_m_per_s is their difference.
    amplitude_m and cycle_frequency_Hz are those of this limit cycle.
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
