"""Everything that turns a wheelset's motion into contact forces, as one record for kernels; counters of evaluations."""

from typing import NamedTuple

import numpy as np

from wrcore.contact.hertz import HertzTable
from wrcore.contact.patch.model import StripModel
from wrcore.contact.search.geometry import ContactGeometry
from wrcore.contact.surrogate.network import Surrogate, no_surrogate
from wrcore.creep.laws import LAWS, CreepData
from wrcore.kernels.handles import other_at
from wrcore.kernels.jit import jit

EVALUATIONS, OUT_OF_RANGE, ON_GRID, SOLVED, ON_FIXED, OUTSIDE_TRAINING = range(6)
"""Places of the counters: evaluations, creep look-ups out of the table's range, patches solved on a grid, patches of a
pair's table that were solved instead of looked up, patches on fixed strips, whose tips were not found, and patches of
the surrogate far outside the range of its training."""


COUNTERS = 6


class ContactModel(NamedTuple):
    """Everything that turns a wheelset's motion into contact forces, for kernels."""

    geometry: ContactGeometry
    hertz: HertzTable
    law: int  # creep law, see wrcore.creep.laws.LAWS
    creep: CreepData
    detection: int  # PLANAR, SPATIAL or AUTO of wrcore.contact.search.detection
    detection_tolerance: float  # AUTO: normal penetration that planar detection may miss, m
    reduction: int  # MAXIMUM or MOMENT of wrcore.contact.search.reduction
    shear_modulus: float  # G, Pa
    poisson_ratio: float
    friction: float
    """Coulomb's mu at no slip; of rails that differ, or along which it changes, the largest one."""
    damping: float  # c_e of Eq. (7)'s damping factor; 1 means none
    damping_speed: float  # v0 of the damping factor, m/s
    least_speed: float  # rolling speed is not taken smaller than this in creepages, m/s
    strips: StripModel  # patches on strips, if the scene asks for them
    friction_ratio: float = 1.0  # A: friction at large slip velocity over that at none; 1: it does not fall
    friction_decay: float = 0.0  # B: rate at which friction falls with slip velocity, s/m
    geometries: tuple = ()
    """Where wheels or rails differ: the `ContactGeometry` of each wheel, left and right of wheelset after wheelset."""
    plain: tuple = ()
    """Where rails change along the track: the `ContactGeometry` of each wheel where they do not."""
    wheels: np.ndarray = np.zeros(0, np.int64)
    """The same as `Handles` of contact models, see `wrcore.equations.kernels.with_wheels`."""
    friction_factors: np.ndarray = np.zeros(0)  # (n,): of a friction law of the user's own, see `falling`
    surrogate: Surrogate = no_surrogate()
    """Trained network of exact contact, if the scene asks for it."""


def without_wheels(contact, **more):
    """A `ContactModel` without what its wheels have of their own, and ``more`` in it."""
    return contact._replace(geometries=(), plain=(), wheels=np.zeros(0, np.int64), **more)


@jit(allocates=False, inline="always")
def contact_of(model, wheelset, wheel):
    """The contact model of a wheel (0 left, 1 right): its own where wheels or rails differ, else that of all."""
    return other_at(model, model.wheels[2 * wheelset + wheel] if len(model.wheels) > 0 else 0)


@jit(allocates=False, forceinline=True)
def is_elliptic(contact):
    """Whether the patches of a `ContactModel` are ellipses."""
    return not contact.strips.strips and len(contact.surrogate.median) == 0


def shaped(contact):
    """Whether a `ContactModel` asks for the shape numbers of its patches."""
    return contact.law == LAWS["table"] and contact.creep.table.axes.n_psi > 1 and is_elliptic.py_func(contact)
