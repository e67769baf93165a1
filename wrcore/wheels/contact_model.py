"""`ContactModel`: all data from which kernels compute contact forces, as one record. Counters of evaluations."""

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
"""Indices of the counters. EVALUATIONS: of the equations of motion. OUT_OF_RANGE: interpolations outside the creep
table. ON_GRID: patches solved on a grid. SOLVED: patches solved because the pair's table does not contain them.
ON_FIXED: patches on fixed strips, whose tips were not found. OUTSIDE_TRAINING: patches far outside the surrogate's
training."""


COUNTERS = 6
"""Number of counters."""


class ContactModel(NamedTuple):
    """Data from which kernels compute the contact forces of a wheelset from its motion."""

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
    """Coefficient of friction mu at zero slip; its maximum where the rails differ or where it changes along them."""
    damping: float  # c_e of the damping factor in Eq. (7); 1 means no damping
    damping_speed: float  # v0 of the damping factor, m/s
    least_speed: float  # lower bound of the rolling speed by which creepages are divided, m/s
    strips: StripModel  # patches on strips, if the scene has them
    friction_ratio: float = 1.0  # A: friction at large slip velocity over friction at zero slip; 1: constant friction
    friction_decay: float = 0.0  # B: rate at which friction falls with slip velocity, s/m
    geometries: tuple = ()
    """`ContactGeometry` of each wheel (left and right, wheelset by wheelset), if wheels or rails differ; else empty."""
    plain: tuple = ()
    """`ContactGeometry` of each wheel on the unchanged rail section, if rails change along the track; else empty."""
    wheels: np.ndarray = np.zeros(0, np.int64)
    """`Handles` of each wheel's contact model, if wheels or rails differ; see
    `wrcore.equations.kernels.with_wheels`."""
    friction_factors: np.ndarray = np.zeros(0)  # (n,): samples of a user's friction law, see `falling`
    surrogate: Surrogate = no_surrogate()
    """Trained network that replaces exact contact, if the scene has one."""
    friction_across: np.ndarray = np.zeros((0, 2))
    """(n, 2): factor of friction over the rail's inclination, see `wrcore.contact.rail_friction`; empty: 1 everywhere.
    If the rails differ, the left one's."""
    friction_across_right: np.ndarray = np.zeros((0, 2))
    """The right rail's, if the rails differ, else empty. Empty in wheel-specific contact models."""


def without_wheels(contact, **more):
    """Return the `ContactModel` without its wheel-specific data, and with the fields ``more`` replaced."""
    return contact._replace(geometries=(), plain=(), wheels=np.zeros(0, np.int64), **more)


@jit(allocates=False, inline="always")
def contact_of(model, wheelset, wheel):
    """Return the contact model of a wheel (0 left, 1 right): wheel-specific if wheels or rails differ, else common."""
    return other_at(model, model.wheels[2 * wheelset + wheel] if len(model.wheels) > 0 else 0)


@jit(allocates=False, forceinline=True)
def is_elliptic(contact):
    """Whether a `ContactModel` represents contact patches by Hertzian ellipses."""
    return not contact.strips.strips and len(contact.surrogate.median) == 0


def shaped(contact):
    """Whether a `ContactModel` has a creep table that depends on the shape numbers of its patches."""
    return contact.law == LAWS["table"] and contact.creep.table.axes.n_psi > 1 and is_elliptic.py_func(contact)
