"""What a right-hand side may leave out or start from: bits of its argument ``mode``."""

FRESH = 0
"""All of it, from nothing: the same numbers whatever was evaluated before."""

WARM = 1
"""Within a step: patches on strips start from their last solutions, part of what a run knows."""

ELLIPSES = 2
"""The ellipse of equal moments stands in for strips that are solved: differences want a smooth neighbour of
the model."""

PATCHES_HELD = 4
"""Patches are those found last: only velocities have changed. Where they are looked up, they are looked up again."""

WRENCHES_HELD = 8
"""The rails' wrenches are those found last."""

PATCHES_ONLY = 16
"""Overlaps are found, those that are looked up as of left wheels, no wrenches."""

BARE = 32
"""Wrenches and counts alone: of patches that are looked up no rows are filled, which nobody reads within a step."""

SPEEDS_GIVEN = 64
"""Speeds of rails without mass are about those in the work; one step of Newton's method leads on, see
:mod:`wrcore.jacobian.flexible_track`."""

STAGE = WARM | BARE
"""What integrators ask for."""
