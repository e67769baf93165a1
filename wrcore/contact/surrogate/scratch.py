"""Scratch arrays of a wheel's contact by the surrogate."""

from typing import NamedTuple

import numpy as np

from wrcore.contact.half_space_coupling import Ellipse
from wrcore.contact.search.reduction import MAX_PATCHES
from wrcore.contact.surrogate.network import SurrogateWork, surrogate_work
from wrcore.contact.surrogate.strips import Strips, new_strips


class PatchForces(NamedTuple):
    """Arrays (MAX_PATCHES,) of the patches of one group of overlaps."""

    first: np.ndarray
    last: np.ndarray
    """int64: overlaps of the patch, from ``first`` to before ``last``."""
    rise: np.ndarray
    tilt: np.ndarray
    """Rise of the patch by the other patches (m), and the slope of that across it."""
    slip_xi: np.ndarray
    slip_eta: np.ndarray
    """Creepages by the friction on the others."""
    load: np.ndarray
    """Normal force, N; 0 if it does not touch."""
    fx: np.ndarray
    fy: np.ndarray
    mz: np.ndarray
    """Creep forces (N) and moment (N m)."""
    ellipses: np.ndarray
    """(MAX_PATCHES, 7): fields of `Ellipse`."""


class SurrogateScratch(NamedTuple):
    """Scratch arrays of a wheel's contact by the surrogate."""

    network: SurrogateWork
    strips: Strips
    forces: PatchForces
    numbers: np.ndarray
    """(7, 9 + outputs of the network): of one patch after moves of its wheel, for
    :mod:`wrcore.jacobian.surrogate_wheel`."""


def surrogate_scratch(surrogate):
    """`SurrogateScratch` of a `Surrogate`; small where a scene has none."""
    used = len(surrogate.median) > 0
    ends, values = (np.zeros(MAX_PATCHES, np.int64) for _ in range(2)), (np.zeros(MAX_PATCHES) for _ in range(8))
    strips = new_strips() if used else Strips(*(np.zeros(0) for _ in Strips._fields))
    forces = PatchForces(*ends, *values, np.zeros((MAX_PATCHES, len(Ellipse._fields))))
    network = surrogate_work(surrogate)
    numbers = np.zeros((7, 9 + len(network.outputs)) if used else (0, 0))
    return SurrogateScratch(network, strips, forces, numbers)
