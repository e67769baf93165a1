"""`Model`, a compiled scene for kernels, its scratch arrays `Workspace`, and the size of its state."""

from typing import NamedTuple

import numpy as np

from wrcore.bodies.body import STATE_SIZE
from wrcore.bodies.joint import Joints
from wrcore.bodies.joint_forces import ConstraintWork, constraint_workspace
from wrcore.contact.changing_rails.section_table import ROWS
from wrcore.contact.patch.model import StripWork, strip_work
from wrcore.contact.search.reduction import MAX_PATCHES, PATCH_COLUMNS
from wrcore.creep.laws import LAWS
from wrcore.forces.control import Controls, ControlWork, control_work, no_controls
from wrcore.forces.drive import Drive, no_drive
from wrcore.forces.suspension import Elements
from wrcore.kernels.jit import jit
from wrcore.track.changing_rails import KNOWN, Crossing, no_crossing
from wrcore.track.check_rail import CheckRails, no_check_rails
from wrcore.track.flexible_track import FlexibleTrack, FlexibleTrackWork, rigid_track, track_work
from wrcore.track.schedule import Schedules, pack_schedules
from wrcore.track.track import TrackModel
from wrcore.wheels.contact_model import COUNTERS, ContactModel
from wrcore.wheels.motion import MOTION

FRICTIONLESS = 1e-9
"""Coefficient of friction that approximates zero: a static wheel load of 50 kN then has a friction force of 50 µN."""


class Bodies(NamedTuple):
    """Rigid bodies, for kernels."""

    mass: np.ndarray  # (n,), kg
    inertia: np.ndarray  # (n, 3): principal moments, kg m^2, about the body's x, y, z axes unless ``axes`` are given
    spins: np.ndarray  # (n,) int: 1 for a body of revolution about its y axis whose frame does not spin along
    wheelsets: np.ndarray  # (k,) int: bodies with wheels
    independent: np.ndarray = np.zeros((0, 2), np.int64)
    """(j, 2) int: number of a wheelset whose wheels rotate independently, and the index of half the difference of their
    rolling rates, left minus right (rad/s), among the internal states."""
    axes: np.ndarray = np.zeros((0, 3, 3))
    """(n, 3, 3): principal axes as columns, in body axes; those of wheelsets in level axes, see
    `wrcore.bodies.inertia`. Empty if all body axes are principal and all wheelsets are bodies of revolution."""


class Kernels(NamedTuple):
    """Compiled kernels that a model's equations call, by address; 0 if the model does not need this kernel.

    `wrcore.equations.kernels.with_kernels` compiles or loads them."""

    wheel_forces_kernel: int = 0
    """Forces and moments of the rails on all wheels."""
    joint_reactions_kernel: int = 0
    """Reactions of the joints."""
    rail_friction_kernel: int = 0
    """Coefficient of friction under each wheel, if it changes along the track."""
    drive_torques_kernel: int = 0
    """Torques of motors and brakes."""
    flexible_track_kernel: int = 0
    """Forces and moments of the rails on all wheels, on a flexible track."""
    control_samples_kernel: int = 0
    """Samples of the control laws."""
    rail_sections_kernel: int = 0
    """Rail section under each wheel, on changing rails."""
    step_limit_kernel: int = 0
    """Limit of the length of steps on changing rails and near check rails."""
    check_rails_kernel: int = 0
    """Forces of check rails."""
    contact_derivatives_kernel: int = 0
    """Derivatives of contact forces, for methods with a Jacobian."""


class Model(NamedTuple):
    """Compiled scene for kernels."""

    bodies: Bodies
    contact: ContactModel
    elements: Elements
    joints: Joints
    track: TrackModel
    speed: float  # speed of the moving frame, m/s
    gravity: float  # m/s^2, downwards
    alpha: float
    beta: float
    """Baumgarte's parameters, 1/s."""
    friction: Schedules = pack_schedules([])
    """Coefficient of friction over arc length for the left and the right rail; empty if it is constant."""
    drive: Drive = no_drive()  # motors, brakes and speed controller
    flexible_track: FlexibleTrack = rigid_track()  # flexible track under each wheelset
    controls: Controls = no_controls()  # control laws of the user
    crossing: Crossing = no_crossing()  # rails that change along the track
    check_rails: CheckRails = no_check_rails()
    kernels: Kernels = Kernels()


class Workspace(NamedTuple):
    """Scratch arrays of one evaluation, with its results for output."""

    rotations: np.ndarray  # (n + 1, 3, 3): rotation matrices of the bodies, and of the moving frame on a curved track
    arc_lengths: np.ndarray  # (k,): last arc length of each wheelset, m; where the search for the next one starts
    turns: np.ndarray  # (n, 3): angular velocities of the bodies' frames, rad/s; a wheelset's frame does not spin
    wrenches: np.ndarray  # (n, 6): force and moment about the centre of mass of each body
    patches: np.ndarray  # (k, 2, MAX_PATCHES, PATCH_COLUMNS): patches of each wheelset, left and right
    counts: np.ndarray  # (k, 2) int: patches in contact
    motions: np.ndarray  # (k, 2, 15): `WheelMotion` of each wheel in its rail's frame
    rail_wrenches: np.ndarray  # (k, 2, 6): force and moment of the rails on each wheelset
    rails: np.ndarray  # (k, 2, 3, 3): axes of the rails' frames
    shifts: np.ndarray  # (k, 2, 2): offsets of the rails from their nominal positions, left and up, m
    bounds: np.ndarray  # (k, 2): bound of planar detection's error (detection ``auto`` only), m
    counters: np.ndarray  # (COUNTERS,) int, see `wrcore.wheels.contact_model`
    constraints: ConstraintWork
    frame: np.ndarray  # (3, 3): axes of the track's frame
    irregularity: np.ndarray
    strips: StripWork
    flexible_track: FlexibleTrackWork
    control: ControlWork
    principal: np.ndarray  # (n, 3, 3): principal axes of the bodies, if there are ``Bodies.axes``
    seen: np.ndarray  # (k, 2, KNOWN): rail sections that the wheels' arrays contain, on changing rails
    blocks: np.ndarray  # (k, 2) unsigned: blocks of these sections that are written, one bit each
    section: np.ndarray  # (ROWS + 4, m): scratch of :mod:`wrcore.track.changing_rails`


def state_size(model):
    """Return the length of the state vector: 13 numbers per body, then all internal states."""
    return STATE_SIZE * len(model.bodies.mass) + internal_states(model)


def internal_states(model):
    """Return the number of internal states, which belong to no body.

    Their order is: force elements and track, speed controller, control laws."""
    return model.elements.states + len(model.drive.control) + len(model.controls.start)


def workspace(model):
    """Allocate the scratch arrays of a model."""
    n, k = len(model.bodies.mass), len(model.bodies.wheelsets)
    return Workspace(
        np.tile(np.eye(3), (n + 1, 1, 1)), np.full(k, np.nan), np.zeros((n, 3)), np.zeros((n, 6)),
        np.zeros((k, 2, MAX_PATCHES, PATCH_COLUMNS)), np.zeros((k, 2), np.int64), np.zeros((k, 2, len(MOTION))),
        np.zeros((k, 2, 6)), np.tile(np.eye(3), (k, 2, 1, 1)), np.zeros((k, 2, 2)), np.full((k, 2), np.nan),
        np.zeros(COUNTERS, np.int64), constraint_workspace(model.joints), np.zeros((3, 3)), np.zeros((3, 4)),
        strip_work(model.contact.strips, k, surrogate=model.contact.surrogate), track_work(model.flexible_track, k),
        control_work(model.controls),
        np.zeros(model.bodies.axes.shape), np.full((len(model.crossing.tables), 2, KNOWN), np.nan),
        np.zeros((len(model.crossing.tables), 2), np.uint64),
        np.zeros((ROWS + 4, model.crossing.sections.shape[-1])),
    )  # fmt: skip


@jit(inline="always")
def independent_at(bodies, j):
    """Index in the state of half the difference of rolling rates of the j-th wheelset with independent wheels."""
    return STATE_SIZE * bodies.mass.shape[0] + bodies.independent[j, 1]


def frictionless(model):
    """Return the model with the coefficient of friction `FRICTIONLESS` everywhere and the cheapest creep law."""
    contact = model.contact._replace(friction=FRICTIONLESS, law=LAWS["she"])
    return model._replace(contact=contact, friction=pack_schedules([]))
