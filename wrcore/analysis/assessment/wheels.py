"""Wheel quantities of a run: wheel loads, guiding forces, wear numbers and contact pressure.

Definitions of Q, Y, T gamma and the others: :mod:`wrcore.run.output.derived`.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
import pandas as pd

from wrcore.errors import InputError, check_number
from wrcore.errors.checked_calls import OneOf, checked
from wrcore.geometry.track import SIDES
from wrcore.run.output.derived import forces_on_rail, quotient, rolling_speed
from wrcore.run.output.run import Run

Side = Annotated[str, OneOf(SIDES)]


def wheelsets_of(run):
    """Return the names of a run's wheelsets, in the order of their groups."""
    return [name for name in run.groups if f"{name}/left" in run.groups]


def output_times_after(run, begin, what):
    """Whether each output time of a run is at or after ``begin`` (s), shape (n,); refuse a begin outside the run."""
    if not len(run.t):
        raise InputError(what, "run", "expected output times, but it ended before the first")
    check_number(begin, min(0.0, run.t[0]), run.t[-1], what, "begin", "s")
    return run.t >= begin


def way_shares(run, wheelset, late):
    """Return weights (m,) for means over the distance of a wheelset, at the output times where ``late`` is true.

    At rest they are the weights of a mean over time.
    """
    speed = np.broadcast_to(rolling_speed(run[wheelset], run.scene["speed"]), late.shape)[late]
    return speed / speed.sum() if speed.any() else np.full(speed.shape, 1.0 / speed.size)


@checked
def wheel_forces(run: Run, wheelset: str, side: Side) -> tuple[np.ndarray, np.ndarray]:
    """Return vertical and lateral forces of a wheel on its rail over time.

    Parameters
    ----------
    run : Run
    wheelset : str
    side : {"left", "right"}

    Returns
    -------
    Q, Y : numpy.ndarray, shape (n,)
        Vertical (downwards) and lateral (to the field side) force, N.

    Examples
    --------
    >>> import wrcore as wr
    >>> run = wr.simulate(wr.example("suspended_wheelset"), integration__duration=0.1)
    >>> Q, Y = wr.wheel_forces(run, "wheelset", "left")
    >>> round(1e-3 * Q.mean())
    55
    """
    contact = run[f"{wheelset}/{side}"]
    if "Q_N" in contact and "Y_N" in contact:
        return contact.Q_N, contact.Y_N
    return forces_on_rail(contact, side)


@checked
def wear_number(run: Run, wheelset: str, side: Side, spin: bool = False) -> np.ndarray:
    """Return the wear number T gamma of a wheel over time, without or with the part of spin.

    Parameters
    ----------
    run : Run
    wheelset : str
    side : {"left", "right"}
    spin : bool

    Returns
    -------
    numpy.ndarray, shape (n,)
        Wear number, N.

    Examples
    --------
    >>> import wrcore as wr
    >>> run = wr.simulate(wr.example("suspended_wheelset"), integration__duration=0.1)
    >>> wr.wear_number(run, "wheelset", "left", spin=True).shape == run.t.shape
    True
    """
    return run[f"{wheelset}/{side}"]["T_gamma_spin_N" if spin else "T_gamma_N"]


@checked
def creep_power(run: Run, wheelset: str, side: Side) -> np.ndarray:
    """Return the power dissipated by a wheel's creep over time.

    If a run has no velocities, the speed of the wheelset is the scene's speed.

    Parameters
    ----------
    run : Run
    wheelset : str
    side : {"left", "right"}

    Returns
    -------
    numpy.ndarray, shape (n,)
        Power, W.

    Examples
    --------
    >>> import wrcore as wr
    >>> run = wr.simulate(wr.example("suspended_wheelset"), integration__duration=0.1)
    >>> power = wr.creep_power(run, "wheelset", "left")
    >>> power.shape == run.t.shape, bool(power.min() >= 0.0)
    (True, True)
    """
    return run[f"{wheelset}/{side}"].creep_power_W


def maximum_pressure(run, wheelset, side):
    """Return the maximum pressure under a wheel over time, Pa, shape (n,), 0 without contact; 3 N/(2 pi a b) for
    ellipses."""
    return np.max(np.nan_to_num(run[f"{wheelset}/{side}"].p_max_Pa), axis=1)


@checked
def wheelset_channels(run: Run, wheelset: str) -> pd.DataFrame:
    """Return forces, wear and pressure of a wheelset's wheels over time as a table.

    Parameters
    ----------
    run : Run
    wheelset : str

    Returns
    -------
    pandas.DataFrame
        Index ``t_s``; columns: :meth:`wrcore.run.output.run.Run.wheel_forces`.

    Examples
    --------
    >>> import wrcore as wr
    >>> run = wr.simulate(wr.example("suspended_wheelset"), integration__duration=0.1)
    >>> list(wr.wheelset_channels(run, "wheelset"))[:3]
    ['Q_left_N', 'Y_left_N', 'Y_over_Q_left']
    """
    columns: dict[str, np.ndarray] = {}
    for side in SIDES:
        vertical, lateral = wheel_forces(run, wheelset, side)
        columns |= {
            f"Q_{side}_N": vertical,
            f"Y_{side}_N": lateral,
            f"Y_over_Q_{side}": quotient(vertical, lateral),
            f"T_gamma_{side}_N": wear_number(run, wheelset, side),
            f"T_gamma_spin_{side}_N": wear_number(run, wheelset, side, spin=True),
            f"creep_power_{side}_W": creep_power(run, wheelset, side),
            f"p_max_{side}_Pa": maximum_pressure(run, wheelset, side),
        }
    return pd.DataFrame(columns | {"sum_Y_N": run[wheelset].sum_Y_N}, index=pd.Index(run.t, name="t_s"))


@checked
def wheel_table(run: Run, begin: float = 0.0) -> pd.DataFrame:
    """Return loads, guiding forces and wear of each wheel as a table.

    Parameters
    ----------
    run : Run
    begin : float
        Start of the evaluation, s.

    Returns
    -------
    pandas.DataFrame
        A row per wheel: wheelset, side, mean, smallest and largest Q, mean Y (to the field side), largest |Y| (N),
        largest |Y/Q|, mean wear numbers without and with spin (N, over distance) and mean creep power (W, over time).

    Examples
    --------
    >>> import wrcore as wr
    >>> run = wr.simulate(wr.example("suspended_wheelset"), integration__duration=0.1)
    >>> (1e-3 * wr.wheel_table(run).set_index("side")["Q_mean_N"]).round(1).to_dict()
    {'left': 54.6, 'right': 54.5}
    """
    if not wheelsets_of(run):
        raise InputError("wheel_table", "run", "expected the channels of wheels")
    late, rows = output_times_after(run, begin, "wheel_table"), []
    for wheelset in wheelsets_of(run):
        share = way_shares(run, wheelset, late)
        for side in SIDES:
            vertical, lateral = (force[late] for force in wheel_forces(run, wheelset, side))
            ratio = np.abs(quotient(vertical, lateral))
            rows.append({
                "wheelset": wheelset, "side": side, "Q_mean_N": np.mean(vertical), "Q_min_N": np.min(vertical),
                "Q_max_N": np.max(vertical), "Y_mean_N": np.mean(lateral), "Y_max_N": np.max(np.abs(lateral)),
                "Y_over_Q_max": np.nan if np.all(np.isnan(ratio)) else np.nanmax(ratio),
                "T_gamma_mean_N": share @ wear_number(run, wheelset, side)[late],
                "T_gamma_spin_mean_N": share @ wear_number(run, wheelset, side, spin=True)[late],
                "creep_power_mean_W": np.mean(creep_power(run, wheelset, side)[late]),
            })  # fmt: skip
    return pd.DataFrame(rows)
