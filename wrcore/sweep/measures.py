"""Measures of a sweep: one number per measure and run, the worst value over all wheelsets and wheels.

============================  ========================================================================================
``y_rms_m``, ``y_max_m``      root mean square and largest lateral distance of a wheelset from the track's centre
``amplitude_m``               half the peak-to-peak value of the lateral motion over the last ``window``: the amplitude
                              of a limit cycle, if the run has reached it
``yaw_max_rad``               largest yaw of a wheelset
``frequency_Hz``              frequency of the leading wheelset's lateral motion, by `hunting_frequency`; NaN with fewer
                              than three swings
``Q_min_N``, ``Q_max_N``      smallest and largest vertical force of a wheel
``Y_max_N``                   largest absolute lateral force of a wheel on its rail
``Y_over_Q_max``              largest absolute quotient of both forces, where the wheel carries more than 1 kN
``T_gamma_mean_N``            mean over distance of T gamma = |Fx xi + Fy eta|, summed over a wheel's patches;
                              ``T_gamma_spin_mean_N`` includes spin, |Fx xi + Fy eta + Mz phi|
``creep_power_mean_W``        mean power dissipated by a wheel's creep, -V (Fx xi + Fy eta + Mz phi)
``simulated_s``               time reached
``steps``, ``rejected``       accepted and rejected steps; likewise ``rhs_evaluations``, ``jacobians``,
                              ``factorisations``, ``table_out_of_range`` and ``smallest_step_s``
``wall_s``                    time spent in the integration (differs from run to run of the same sweep)
============================  ========================================================================================

Measures of the motion are evaluated at the output times (``output.rate``) from ``begin`` on. Each run also has its
``status`` and the integration ``method``. Measures of forces evaluate all contacts again at the output times.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from wrcore.bodies.body import STATE_SIZE, angles
from wrcore.contact.search import reduction
from wrcore.equations.model import Model
from wrcore.integrate.trajectory import Trajectory
from wrcore.run.motion import hunting_frequency
from wrcore.run.output.compute import evaluated
from wrcore.run.output.derived import UNLOADED, creep_work
from wrcore.track.track import track_poses


@dataclass(frozen=True)
class Motions:
    """Motions and forces of several runs at the same output times; NaN after the end of a run."""

    t: np.ndarray
    """Output times, shape (n,), s."""
    y: np.ndarray
    """Lateral positions, shape (runs, n, wheelsets), m."""
    yaw: np.ndarray
    """Yaw, shape (runs, n, wheelsets), rad."""
    forces: np.ndarray | None
    """Results of `wheel_forces` for each wheel, shape (runs, n, wheelsets, 2, 6); None if no measure needs them."""
    window: float
    """Length of the last part of a run for `amplitude_m`, s."""


def _worst(values: np.ndarray) -> np.ndarray:
    return np.nanmax(values.reshape(len(values), -1), axis=1)


def _last_part(m: Motions) -> np.ndarray:
    reached = np.where(np.isnan(m.y[:, :, 0]), -np.inf, m.t).max(axis=1)
    late = m.t >= reached[:, None] - m.window * (1.0 + 1e-12)
    return np.where(late[:, :, None], m.y, np.nan)


def _amplitude(m: Motions) -> np.ndarray:
    late = _last_part(m)
    return 0.5 * _worst(np.nanmax(late, axis=1) - np.nanmin(late, axis=1))


def _frequency(m: Motions) -> np.ndarray:
    reached = [~np.isnan(row) for row in m.y[:, :, 0]]
    return np.array([hunting_frequency(m.t[r], y[r]) for r, y in zip(reached, m.y[:, :, 0], strict=True)])


def _quotient(m: Motions) -> np.ndarray:
    assert m.forces is not None
    vertical, lateral = m.forces[..., 0], m.forces[..., 1]
    return _worst(np.abs(np.divide(lateral, vertical, out=np.zeros_like(vertical), where=vertical > UNLOADED)))


def _over_way(m: Motions, column: int) -> np.ndarray:
    assert m.forces is not None
    return np.nansum(m.forces[..., column] * m.forces[..., 5], axis=1) / np.nansum(m.forces[..., 5], axis=1)


MOTION: dict[str, Callable[[Motions], np.ndarray]] = {
    "y_rms_m": lambda m: _worst(np.sqrt(np.nanmean(m.y**2, axis=1))),
    "y_max_m": lambda m: _worst(np.abs(m.y)),
    "amplitude_m": _amplitude,
    "yaw_max_rad": lambda m: _worst(np.abs(m.yaw)),
    "frequency_Hz": _frequency,
}
"""Functions that return measures of the motion, shape (runs,)."""

FORCES: dict[str, Callable[[Any], np.ndarray]] = {
    "Q_min_N": lambda m: -_worst(-m.forces[..., 0]),
    "Q_max_N": lambda m: _worst(m.forces[..., 0]),
    "Y_max_N": lambda m: _worst(np.abs(m.forces[..., 1])),
    "Y_over_Q_max": _quotient,
    "T_gamma_mean_N": lambda m: _worst(_over_way(m, 2)),
    "T_gamma_spin_mean_N": lambda m: _worst(_over_way(m, 3)),
    "creep_power_mean_W": lambda m: _worst(np.nanmean(m.forces[..., 4], axis=1)),
}
"""Functions that return measures of the wheels' forces, shape (runs,)."""

COUNTERS = (
    "simulated_s", "steps", "rejected", "rhs_evaluations", "jacobians", "factorisations", "table_out_of_range",
    "smallest_step_s", "wall_s",
)  # fmt: skip
"""Measures of the computational cost, from `wrcore.run.simulation.counters_of`."""

MEASURES = (*MOTION, *FORCES, *COUNTERS)


def wheelset_motion(model: Model, starts: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Return lateral position (m) and yaw (rad) of the wheelsets, shape (n, wheelsets, 2), from ``states`` (n, size)
    and their arc lengths at the start, ``starts`` (wheelsets,), m.
    """
    places = STATE_SIZE * model.bodies.wheelsets
    if model.track.tangent:
        return np.stack([states[:, places + 1], angles(states[:, places[:, None] + [3, 4, 5, 6]])[2]], axis=-1)
    out = np.empty((len(states), len(places), 2))
    for k, (at, start) in enumerate(zip(places, starts, strict=True)):
        out[:, k] = track_poses(model.track, states, at, start)[0][:, [1, 4]]
    return out


def wheel_forces(model: Model, trajectory: Trajectory) -> np.ndarray:
    """Return Q, Y, T gamma without and with spin (N), creep power (W) and speed (m/s) of wheels, shape
    (n, wheelsets, 2, 6)."""
    patches, _, _ = evaluated(model, trajectory)
    angle, normal, lateral = (patches[..., k] for k in (reduction.ANGLE, reduction.NORMAL, reduction.FY))
    cosine, sine = np.cos(angle), np.sin(angle)
    out = np.empty((*patches.shape[:3], 6))
    out[..., 0] = np.nansum(normal * cosine + lateral * sine, axis=-1)
    out[..., 1] = np.nansum(lateral * cosine - normal * sine, axis=-1)
    columns = (reduction.FX, reduction.FY, reduction.MZ, reduction.XI, reduction.ETA, reduction.PHI)
    out[..., 2], out[..., 3], work = creep_work(*(patches[..., column] for column in columns))
    velocities = trajectory.states[:, STATE_SIZE * model.bodies.wheelsets[:, None] + [7, 8, 9]]
    out[..., 5] = np.linalg.norm(velocities, axis=-1)[..., None]
    out[..., 4] = work * out[..., 5]
    return out
