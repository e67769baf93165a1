"""What an integration leaves behind: states at the output times, where it can be taken up again, why it ended."""

from dataclasses import dataclass

import numpy as np

from wrcore.integrate.engine import Memory
from wrcore.integrate.rosenbrock import Linear


@dataclass(frozen=True)
class Checkpoint:
    """Everything a compiled run knows: a run taken up from it goes on bit by bit as if it had not paused."""

    method: str
    t: float
    """Last output time written, s; the run itself is up to a step ahead."""
    memory: Memory
    linear: Linear | None
    """Of Rosenbrock methods."""
    arc_lengths: np.ndarray
    """(k,): of the wheelsets, m: where the search for the next ones starts."""
    patches: np.ndarray
    """Solutions of patches on strips, from which the next ones start (:mod:`wrcore.contact.patch.model`)."""
    notes: np.ndarray | None = None
    """Of a run by ``auto``: what it has seen (:mod:`wrcore.integrate.choice`); of other methods none, or of no size."""
    model: str = ""
    """Fingerprint of the model, where a scene's run left it (:func:`wrcore.run.checkpoints.model_fingerprint`)."""


@dataclass(frozen=True)
class Trajectory:
    """States at the output times, and what they cost."""

    method: str
    """The method used, where ``auto`` was asked for, or both."""
    t: np.ndarray
    """(n,): output times reached, s."""
    states: np.ndarray
    """(n, size)."""
    status: str
    """"completed", "derailed", "stalled" or "failed"."""
    reason: str
    """Empty for a completed run."""
    steps: int = 0
    rejected: int = 0
    rhs_evaluations: int = 0
    jacobians: int = 0
    factorisations: int = 0
    """Accepted steps, rejected attempts, right-hand sides in all (those of Jacobians, too), refreshed Jacobians and
    factorised matrices."""
    out_of_range: int = 0
    """Creep look-ups out of range."""
    smallest_step: float = np.nan
    """Smallest accepted step, s."""
    wall_s: float = 0.0
    """Seconds spent in the integration."""
    end: Checkpoint | None = None
    """Where a compiled run stopped."""
    end_t: float = np.nan
    end_state: np.ndarray | None = None
    """Time (s) and state (size,) of the last valid state: the end of a completed run, else the last step that was
    accepted (by the references: the last output)."""
    collapses: int = 0
    """Steps that were rejected three times in a row or more."""
    on_grid: int = 0
    """Patches that strips did not solve and a grid did."""
    on_fixed_strips: int = 0
    """Patches that strips solved without finding their tips."""
    not_tabulated: int = 0
    """Patches that were to be looked up and had to be solved."""
    outside_training: int = 0
    """Patches of the surrogate whose form was far outside the range of its training."""
    unbalanced: int = 0
    """Evaluations in which rails without mass found no balance."""
