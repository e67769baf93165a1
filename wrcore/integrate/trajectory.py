"""What an integration leaves behind: states at the output times, where it can be taken up again, why it ended."""

from dataclasses import dataclass

import numpy as np

from wrcore.dynamics.body import STATE_SIZE
from wrcore.dynamics.track import track_poses
from wrcore.integrate.engine import Memory
from wrcore.integrate.rosenbrock import Linear


@dataclass(frozen=True)
class Checkpoint:
    """Everything a compiled run knows: a run taken up from it goes on bit by bit as if it had not paused.

    Attributes
    ----------
    method : str
    t : float
        Last output time written, s; the run itself is up to a step ahead.
    memory : Memory
    linear : Linear or None
        Of Rosenbrock methods.
    arc_lengths : numpy.ndarray, shape (k,)
        Of the wheelsets, m: where the search for the next ones starts.
    patches : numpy.ndarray
        Solutions of patches on strips, from which the next ones start (:mod:`wrcore.contact.patch.model`).
    model : str
        Fingerprint of the model, where a scene's run left it (:func:`wrcore.run.checkpoints.model_fingerprint`).
    """

    method: str
    t: float
    memory: Memory
    linear: Linear | None
    arc_lengths: np.ndarray
    patches: np.ndarray
    model: str = ""


@dataclass(frozen=True)
class Trajectory:
    """States at the output times, and what they cost.

    Attributes
    ----------
    method : str
        The method used, where ``auto`` was asked for.
    t : numpy.ndarray, shape (n,)
        Output times reached, s.
    states : numpy.ndarray, shape (n, size)
    status : {"completed", "derailed", "stalled", "failed"}
    reason : str
        Empty for a completed run.
    steps, rejected, rhs_evaluations, jacobians, factorisations : int
        Accepted steps, rejected attempts, right-hand sides in all (those of Jacobians, too), refreshed Jacobians and
        factorised matrices.
    out_of_range, on_grid : int
        Creep look-ups out of range; patches that strips did not solve and a grid did.
    unbalanced : int
        Evaluations in which rails without mass found no balance.
    smallest_step : float
        Smallest accepted step, s.
    wall_s : float
        Seconds spent in the integration.
    end : Checkpoint or None
        Where a compiled run stopped.
    end_t : float
        Time of the last valid state, s: the end of a completed run, else the last step that was accepted (by the
        references: the last output).
    end_state : numpy.ndarray, shape (size,)
        That state.
    collapses : int
        Steps that were rejected three times in a row or more.
    """

    method: str
    t: np.ndarray
    states: np.ndarray
    status: str
    reason: str
    steps: int = 0
    rejected: int = 0
    rhs_evaluations: int = 0
    jacobians: int = 0
    factorisations: int = 0
    out_of_range: int = 0
    smallest_step: float = np.nan
    wall_s: float = 0.0
    end: Checkpoint | None = None
    end_t: float = np.nan
    end_state: np.ndarray | None = None
    collapses: int = 0
    on_grid: int = 0
    unbalanced: int = 0


def derailment(model, t, state, arc_lengths, limit=-1.0):
    """Say how far the farthest wheelset is off the track's centre; empty if none is farther than the limit.

    Parameters
    ----------
    model : Model
    t : float
        s.
    state : numpy.ndarray, shape (size,)
    arc_lengths : numpy.ndarray, shape (k,)
        Of the wheelsets, roughly, m.
    limit : float
        m.

    Returns
    -------
    str
    """
    worst = 0.0
    for k, body in enumerate(model.bodies.wheelsets):
        y = state[STATE_SIZE * body + 1]
        if not model.track.tangent:
            y = track_poses(model.track, state[None, :], STATE_SIZE * body, arc_lengths[k])[0][0, 1]
        worst = abs(y) if not abs(y) <= worst else worst
    if worst <= limit:
        return ""
    return f"a wheelset is {1e3 * worst:.0f} mm off the track's centre at t = {t:.6g} s"
