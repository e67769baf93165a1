"""Results of an integration: states at the output times, checkpoint to continue from, reason of its end."""

from dataclasses import dataclass

import numpy as np

from wrcore.integrate.engine import Memory
from wrcore.integrate.rosenbrock import Linear


@dataclass(frozen=True)
class Checkpoint:
    """Complete state of a compiled run: a run continued from it is bitwise identical to an uninterrupted one."""

    method: str
    t: float
    """Last output time written, s; the time of the state is up to a step later."""
    memory: Memory
    linear: Linear | None
    """Jacobian of Rosenbrock methods; None for explicit methods."""
    arc_lengths: np.ndarray
    """(k,): arc lengths of the wheelsets, m, from which the next searches start."""
    patches: np.ndarray
    """Solutions of patches on strips, from which the next ones start (:mod:`wrcore.contact.patch.model`)."""
    notes: np.ndarray | None = None
    """Notes of a run by ``auto`` (:mod:`wrcore.integrate.choice`); None or empty for other methods."""
    model: str = ""
    """Fingerprint of the model (:func:`wrcore.run.checkpoints.model_fingerprint`), for checkpoints of a scene's run."""


@dataclass(frozen=True)
class Trajectory:
    """States at the output times, status and cost of an integration."""

    method: str
    """Method used; for ``auto`` all methods used, separated by commas."""
    t: np.ndarray
    """(n,): output times reached, s."""
    states: np.ndarray
    """(n, size): states at these times."""
    status: str
    """"completed", "derailed", "stalled" or "failed"."""
    reason: str
    """Empty for a completed run."""
    steps: int = 0
    rejected: int = 0
    rhs_evaluations: int = 0
    jacobians: int = 0
    factorisations: int = 0
    """Numbers of accepted steps, rejected attempts, evaluations of the right-hand side (with those for Jacobians),
    refreshed Jacobians and factorised matrices."""
    out_of_range: int = 0
    """Number of interpolations outside the range of the creep table."""
    smallest_step: float = np.nan
    """Minimum accepted step, s."""
    wall_s: float = 0.0
    """Wall-clock time of the integration, s."""
    end: Checkpoint | None = None
    """Checkpoint at the end of a compiled run."""
    end_t: float = np.nan
    end_state: np.ndarray | None = None
    """Time (s) and state (size,) of the last valid state: the end of a completed run, else the last accepted step (for
    reference integrators: the last output)."""
    collapses: int = 0
    """Number of steps that were rejected at least three times in succession."""
    on_grid: int = 0
    """Number of patches solved on a grid because strips did not converge."""
    on_fixed_strips: int = 0
    """Number of patches solved on strips without their tips being found."""
    not_tabulated: int = 0
    """Number of patches that were solved because they are outside the lookup table."""
    outside_training: int = 0
    """Number of patches of the surrogate whose shape was far outside the range of its training."""
    unbalanced: int = 0
    """Number of evaluations without a solution for the speeds of rails without mass."""
