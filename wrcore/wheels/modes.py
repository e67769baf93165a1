"""Modes of an evaluation of the right-hand side: bits of its argument ``mode``, which may be combined."""

FRESH = 0
"""Full evaluation without starting values: the result does not depend on earlier evaluations."""

WARM = 1
"""Evaluation within a step: patches on strips start from their last solutions, which are part of a run's state."""

ELLIPSES = 2
"""Replace solved strips by the ellipse of equal moments: difference quotients need a smooth approximation of the model.
"""

PATCHES_HELD = 4
"""Keep the patches of the last evaluation, as only velocities have changed. Table patches are interpolated again."""

WRENCHES_HELD = 8
"""Keep the forces and moments of the rails of the last evaluation."""

PATCHES_ONLY = 16
"""Search only: fill the overlaps (those of table wheels mirrored to the left side) and compute no forces."""

BARE = 32
"""Compute forces and counts only: rows of table patches are not filled, as they are not read within a step."""

SPEEDS_GIVEN = 64
"""Start from approximate speeds of massless rails in the workspace and do one Newton step, see
:mod:`wrcore.jacobian.flexible_track`."""

STAGE = WARM | BARE
"""Mode of the stages of integrators."""
