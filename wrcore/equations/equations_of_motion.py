"""Equations of motion: Newton-Euler in absolute coordinates with Lagrange multipliers and Baumgarte, Eq. (8).

    [ M  D^T ] [ v'     ]   [ g                               ]
    [ D   0  ] [ lambda ] = [ gamma - 2 alpha Phi' - beta^2 Phi ]

with v = (r', w) per body in track axes. M is block diagonal (mass, inertia in track axes), so the multipliers follow
from the small system (D M^-1 D^T) lambda = D M^-1 g - gamma*, and the full matrix of Eq. (8) is never formed. A scene
without joints does not run any of this.
"""

from typing import NamedTuple

import numpy as np

from wrcore.bodies.body import OMEGA, STATE_SIZE, VELOCITY, euler_rates, rotation_matrix
from wrcore.bodies.inertia import (
    add_carried_gyroscopic,
    apply_inverse_inertia,
    carrying,
    inertia_axes,
    subtract_gyroscopic,
    turn_to_principal,
)
from wrcore.bodies.joint import Joints
from wrcore.bodies.joint_forces import ConstraintWork, add_reactions, constraint_workspace
from wrcore.bodies.vector import load
from wrcore.contact.changing_rails.section_table import ROWS
from wrcore.contact.patch.model import StripWork, strip_work
from wrcore.contact.search.reduction import MAX_PATCHES, PATCH_COLUMNS
from wrcore.creep.laws import LAWS
from wrcore.forces.control import Controls, ControlWork, control_work, no_controls, with_controls
from wrcore.forces.drive import Drive, add_drive, no_drive
from wrcore.forces.suspension import Elements, element_forces, with_laws
from wrcore.kernels.handles import Handle, Handles, Kernel, Kind, call_address, call_at
from wrcore.kernels.jit import FUSED, jit
from wrcore.kernels.own import fault_in
from wrcore.kernels.told import raise_interrupted
from wrcore.track.changing_rails import KNOWN, Crossing, lay_sections, no_crossing, shorten_step, with_own_arrays
from wrcore.track.check_rail import CheckRails, no_check_rails, press_check_rails, shorten_beside
from wrcore.track.flexible_track import FlexibleTrack, FlexibleTrackWork, flexible_wrenches, rigid_track, track_work
from wrcore.track.schedule import Schedules, pack_schedules
from wrcore.track.track import TrackModel, fill_rail_friction, rail_motions, turn_back_wrenches
from wrcore.wheels.hertzian_force import (
    COUNTERS,
    EVALUATIONS,
    ContactModel,
    alone,
    contact_of,
    press_wheels,
    shaped,
    wheel_wrenches,
)
from wrcore.wheels.modes import FRESH, WRENCHES_HELD
from wrcore.wheels.motion import MOTION

FRICTIONLESS = 1e-9
"""Coefficient of friction that counts as none: of a static wheel load of 50 kN it leaves 50 uN."""


class Bodies(NamedTuple):
    """Rigid bodies, for kernels."""

    mass: np.ndarray  # (n,), kg
    inertia: np.ndarray  # (n, 3): principal moments, kg m^2, about the body's x, y, z axes unless ``axes`` are given
    spins: np.ndarray  # (n,) int: 1 for a body of revolution about its y axis whose frame does not spin along
    wheelsets: np.ndarray  # (k,) int: bodies with wheels
    independent: np.ndarray = np.zeros((0, 2), np.int64)
    """(j, 2) int: wheelsets (by their number) whose wheels turn independently of each other, and the place of half the
    difference of their rolling rates, left less right (rad/s), among the internal states."""
    axes: np.ndarray = np.zeros((0, 3, 3))
    """(n, 3, 3): principal axes in the body's own as columns; of wheelsets in level axes, see
    `wrcore.bodies.inertia`. Empty where all bodies' own axes are principal and all wheelsets bodies of revolution."""


class Model(NamedTuple):
    """A compiled scene, for kernels."""

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
    wheels: int = 0  # address of the kernel that finds the rails' wrenches, see `with_kernels`
    reactions: int = 0  # address of the kernel that adds the joints' reactions
    friction: Schedules = pack_schedules([])
    """Over arc length, for the left and the right rail, where friction is not the same everywhere; else empty."""
    rail_friction: int = 0  # address of the kernel that looks it up
    drive: Drive = no_drive()  # motors, brakes and speed controller
    torques: int = 0  # address of the kernel that adds their torques
    flexible_track: FlexibleTrack = rigid_track()  # the track under each wheelset, if it is flexible
    rails: int = 0  # address of the kernel that finds the wrenches of the rails of a flexible track
    controls: Controls = no_controls()  # control laws of the user's own
    samples: int = 0  # address of the kernel that takes their samples
    crossing: Crossing = no_crossing()  # rails that change along the track
    sections: int = 0  # address of the kernel that lays what the wheels see of them
    strides: int = 0  # address of the kernel that keeps steps short on them
    check_rails: CheckRails = no_check_rails()
    guards: int = 0  # address of the kernel that adds their forces
    slopes: int = 0  # address of the kernel of what patches change, for methods with a Jacobian


class Workspace(NamedTuple):
    """Scratch arrays of one evaluation, and what it leaves for output."""

    rotations: np.ndarray  # (n + 1, 3, 3): of the bodies, and of the moving frame on a curved track
    arc_lengths: np.ndarray  # (k,): last arc length of each wheelset, m; where the search for the next one starts
    turns: np.ndarray  # (n, 3): angular velocities of the bodies' frames, rad/s; a wheelset's frame does not spin
    wrenches: np.ndarray  # (n, 6): force and moment about the centre of mass of each body
    patches: np.ndarray  # (k, 2, MAX_PATCHES, PATCH_COLUMNS): patches of each wheelset, left and right
    counts: np.ndarray  # (k, 2) int: patches in contact
    motions: np.ndarray  # (k, 2, 15): `WheelMotion` of each wheel in its rail's frame
    rail_wrenches: np.ndarray  # (k, 2, 6): force and moment of the rails on each wheelset
    rails: np.ndarray  # (k, 2, 3, 3): axes of the rails' frames
    shifts: np.ndarray  # (k, 2, 2): where rails are off their nominal places, m
    bounds: np.ndarray  # (k, 2): bound of planar detection's error (detection ``auto`` only), m
    counters: np.ndarray  # (4,) int, see `wrcore.wheels.hertzian_force`
    constraints: ConstraintWork
    frame: np.ndarray  # (3, 3): axes of the track's frame
    irregularity: np.ndarray
    strips: StripWork
    flexible_track: FlexibleTrackWork
    control: ControlWork
    principal: np.ndarray  # (n, 3, 3): principal axes of the bodies, where they have ``Bodies.axes``
    seen: np.ndarray  # (k, 2, 4): which sections of rails that change the wheels' arrays hold
    blocks: np.ndarray  # (k, 2) unsigned: which blocks of these, a bit for each
    section: np.ndarray  # (ROWS + 4, m): scratch of :mod:`wrcore.track.changing_rails`


def state_size(model):
    """Length of the state vector: 13 numbers per body, then all states that belong to no body."""
    return STATE_SIZE * len(model.bodies.mass) + internal_states(model)


def internal_states(model):
    """Number of states that belong to no body: of force elements and the track, then that of the speed controller, then
    those of control laws."""
    return model.elements.states + len(model.drive.control) + len(model.controls.start)


def workspace(model):
    """Allocate the scratch arrays for a model."""
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
    """Place in the state of half the difference of rolling rates of the j-th wheelset with independent wheels."""
    return STATE_SIZE * bodies.mass.shape[0] + bodies.independent[j, 1]


@jit(allocates=False, fastmath=FUSED)
def _turn_wheels_apart(bodies, work, rate):
    """Rates of half the difference of rolling rates: each wheel has half the wheelset's pitch moment of inertia. The
    wheelset's own rolling rate is the mean of both, whose equation is that of a solid wheelset."""
    for j in range(bodies.independent.shape[0]):
        k = bodies.independent[j, 0]
        body = bodies.wheelsets[k]
        moment = 0.0
        for i in range(3):
            apart = work.rail_wrenches[k, 0, 3 + i] - work.rail_wrenches[k, 1, 3 + i]
            moment += apart * work.rotations[body, i, 1]
        rate[independent_at(bodies, j)] = moment / bodies.inertia[body, 1]


@jit(allocates=False, fastmath=FUSED)
def wheel_motions(model, state, work):
    """Fill the motions of all wheels in their rails' frames; the wheelsets' rotations are in ``work``."""
    wheelsets, tangent = model.bodies.wheelsets, model.track.tangent
    for k in range(wheelsets.shape[0]):
        at, axle = STATE_SIZE * wheelsets[k], work.rotations[wheelsets[k]]
        if not tangent:
            left, right = contact_of(model.contact, k, 0), contact_of(model.contact, k, 1)
            work.arc_lengths[k] = rail_motions(
                model.track, (left.geometry.rail_distance, right.geometry.rail_distance), state, at, axle,
                work.arc_lengths[k], work.frame, work.irregularity, work.rails[k], work.shifts[k], work.motions[k],
            )  # fmt: skip
        for wheel in range(2):
            row = work.motions[k, wheel]
            row[MOTION.friction] = model.contact.friction
            if tangent:
                row[MOTION.side], row[MOTION.y], row[MOTION.z] = 1.0 - 2.0 * wheel, state[at + 1], state[at + 2]
                for i in range(3):
                    row[MOTION.ex + i] = axle[i, 1]
                for i in range(6):
                    row[MOTION.vx + i] = state[at + VELOCITY + i]
                row[MOTION.bend_y] = row[MOTION.bend_z] = 0.0
    if model.rail_friction != 0:
        call_address(model.rail_friction, model, state, work)
    if model.sections != 0:
        call_address(model.sections, model, state, work)
    for j in range(model.bodies.independent.shape[0]):
        k, half = model.bodies.independent[j, 0], state[independent_at(model.bodies, j)]
        for wheel in range(2):
            row = work.motions[k, wheel]
            for i in range(3):
                row[MOTION.wx + i] += row[MOTION.side] * half * row[MOTION.ex + i]


@jit(allocates=False, fastmath=FUSED)
def _add_rail_wrenches(model, state, work, rate, mode):
    """Add the wrenches of the rails to those of the wheelsets; while they are held, those found last."""
    wheelsets, tangent, held = model.bodies.wheelsets, model.track.tangent, mode & WRENCHES_HELD
    if not held:
        wheel_motions(model, state, work)
    if model.rails != 0:
        call_address(model.rails, model, state, work, rate, mode)
    elif not held:
        press_wheels(model, work, mode)
    if model.guards != 0 and not held:
        call_address(model.guards, model, state, work)
    for k in range(wheelsets.shape[0]):
        if not (tangent or held):
            turn_back_wrenches(work.rails[k], work.shifts[k], work.rail_wrenches[k], work.patches[k], work.counts[k])
        wrench = work.wrenches[wheelsets[k]]
        for i in range(6):
            wrench[i] += work.rail_wrenches[k, 0, i] + work.rail_wrenches[k, 1, i]


@jit(allocates=False, fastmath=FUSED)
def fill_derivatives(t, state, model, work, rate, mode=FRESH):
    """Right-hand side of the equations of motion: fills ``rate``; patches and counts in ``work`` belong to this
    evaluation afterwards. The ``mode`` is one of `wrcore.wheels.modes`.

    The state: per body position (m), Euler parameters, velocity (m/s), angular velocity (rad/s), track axes; then the
    internal states of force elements (m), of wheels that turn independently (rad/s) and of a flexible track (m, m/s,
    :mod:`wrcore.track.flexible_track`), the speed controller's integral (m), and what control laws hold
    (:mod:`wrcore.forces.control`).
    """
    bodies = model.bodies
    n = bodies.mass.shape[0]
    work.counters[EVALUATIONS] += 1
    for b in range(n):
        at = STATE_SIZE * b
        matrix, turn, wrench = work.rotations[b], work.turns[b], work.wrenches[b]
        rotation_matrix(state, at, matrix)
        wx, wy, wz = load(state, at + OMEGA)
        spin = 0.0
        if bodies.spins[b] == 1:
            spin = wx * matrix[0, 1] + wy * matrix[1, 1] + wz * matrix[2, 1]
        turn[0], turn[1], turn[2] = wx - spin * matrix[0, 1], wy - spin * matrix[1, 1], wz - spin * matrix[2, 1]
        wrench[:] = 0.0
        wrench[2] = -model.gravity * bodies.mass[b]
    if bodies.wheelsets.shape[0] > 0:
        _add_rail_wrenches(model, state, work, rate, mode)
        _turn_wheels_apart(bodies, work, rate)
    element_forces(model.elements, model.track, t, model.speed, state, work.rotations, work.turns, work.wrenches, rate)
    if model.torques != 0:
        call_address(model.torques, model, t, state, work, rate)
    if bodies.axes.shape[0] > 0:
        turn_to_principal(bodies, work.rotations, work.principal)
    axes = inertia_axes(bodies, work)
    for b in range(n):
        if carrying(bodies, b):
            add_carried_gyroscopic(bodies.inertia[b], axes[b], state, STATE_SIZE * b, -1.0, work.wrenches[b])
        else:
            subtract_gyroscopic(bodies.inertia[b], axes[b], state, STATE_SIZE * b, work.wrenches[b])
    if model.joints.equations > 0:
        call_address(model.reactions, model, t, state, work)
    for b in range(n):
        at = STATE_SIZE * b
        euler_rates(state, at, work.turns[b, 0], work.turns[b, 1], work.turns[b, 2], model.alpha, rate)
        for i in range(3):
            rate[at + i] = state[at + VELOCITY + i]
            rate[at + VELOCITY + i] = work.wrenches[b, i] / bodies.mass[b]
        apply_inverse_inertia(bodies.inertia[b], axes[b], work.wrenches[b], rate[at + OMEGA :])


@jit(allocates=False, forceinline=True)
def derivatives_at(equations, t, state, model, work, rate, mode=FRESH):
    """Right-hand side by its address; all else as for :func:`fill_derivatives`."""
    call_at(equations, t, state, model, work, rate, mode)


@jit(allocates=False, nogil=True)
def fill_many(equations, t, states, model, work, rates, mode=FRESH):
    """Right-hand sides of several states (n, size), row by row."""
    for i in range(states.shape[0]):
        derivatives_at(equations, t, states[i], model, work, rates[i], mode)


def frictionless(model):
    """The model with next to no friction anywhere, in the creep law that costs least."""
    contact = model.contact._replace(friction=FRICTIONLESS, law=LAWS["she"])
    return model._replace(contact=contact, friction=pack_schedules([]))


def looked_up(model):
    """Coefficients of friction at which contact on the left and on the right rail is looked up: the largest ones; 0
    where it is not."""
    strips, friction = model.contact.strips, model.friction
    if not strips.looked_up or not len(friction.points):
        return [strips.looked_up] * 2
    return [float(rail[:, 1].max()) for rail in np.split(friction.points, friction.starts[1:-1])]


def with_wheels(model):
    """Contact of a model with what each wheel runs on where they differ, and with what its patches need."""
    contact, of_rails = model.contact, looked_up(model)
    if contact.geometries or of_rails[0] != of_rails[1]:
        wheels, bare = [], alone(contact)
        for k, geometry in enumerate(contact.geometries or (contact.geometry,) * (2 * len(model.bodies.wheelsets))):
            strips = contact.strips._replace(looked_up=of_rails[k % 2])
            if strips.looked_up and contact.plain:
                from wrcore.wheels.table.store import with_pair

                strips = with_pair(bare._replace(geometry=contact.plain[k], strips=strips)).strips
            geometry = with_own_arrays(geometry) if len(model.crossing.tables) else geometry
            wheels.append(bare._replace(geometry=geometry, strips=strips))
        contact = bare._replace(wheels=np.asarray(Handles(wheels)))
    if contact.strips.strips:
        from wrcore.wheels.kernels import with_late

        contact = with_late(contact)
    return contact


def with_kernels(model, work):
    """The model with the addresses of the kernels of its wheels, elements, joints and so on: only what it runs is
    compiled."""
    wrenches, contact = wheel_wrenches, model.contact
    if contact.strips.strips and len(work.motions):
        from wrcore.wheels.exact_force import strip_wrenches
        from wrcore.wheels.kernels import with_groups

        wrenches, contact = strip_wrenches, with_groups(contact, work.strips)
    elif len(contact.surrogate.median):
        from wrcore.wheels.surrogate_force import surrogate_wrenches

        wrenches = surrogate_wrenches
    elif shaped(contact):
        from wrcore.wheels.shaped_force import shaped_wrenches

        wrenches = shaped_wrenches
    # what follows is compiled for the model as it will be
    model = model._replace(contact=with_wheels(model._replace(contact=contact)), elements=with_laws(model.elements))
    kind, scratch, state, kernels = Kind(model), Kind(work), np.empty(0), {}
    if model.joints.equations:
        kernels["reactions"] = Kernel(add_reactions, kind, 0.0, state, scratch)
    if len(model.controls.rows):
        model, own = with_controls(model, kind, scratch, state)
        kernels |= own
    elif len(model.drive.rows):
        kernels["torques"] = Kernel(add_drive, kind, 0.0, state, scratch, state)
    if len(model.friction.points):
        kernels["rail_friction"] = Kernel(fill_rail_friction, kind, state, scratch)
    if len(model.crossing.tables):
        kernels["sections"] = Kernel(lay_sections, kind, state, scratch)
        kernels["strides"] = Kernel(shorten_step, kind, state, scratch, state, 0)
    if len(model.check_rails.rows):
        kernels["guards"] = Kernel(press_check_rails, kind, state, scratch)
        kernels["strides"] = Kernel(shorten_beside, kind, state, scratch, state, 0)
    if len(model.bodies.wheelsets) and len(model.flexible_track.mass):
        kernels["rails"] = Kernel(flexible_wrenches, kind, state, scratch, state, FRESH)
    if len(model.bodies.wheelsets):
        kernels["wheels"] = Kernel(
            wrenches, Kind(model.contact), work.motions, work.patches, work.counts, work.bounds, work.rail_wrenches,
            work.counters, Kind(work.strips), FRESH,
        )  # fmt: skip
    return model._replace(**{name: getattr(kernel, "address", kernel) for name, kernel in kernels.items()})


class Equations:
    """A model's equations of motion with their scratch arrays, as ``function(t, state)`` and, for kernels, as
    ``arguments``: the right-hand side, and handles of model and work."""

    def __init__(self, model, work=None):
        self.work = workspace(model) if work is None else work
        model, work = Handle(with_kernels(model, self.work)), Handle(self.work)
        state, self._planned, self.fault = np.empty(0), {}, ""  # the last one of a law of the user
        self.arguments = Kernel(fill_derivatives, 0.0, state, model, work, state, FRESH), model, work

    def planned(self, plan):
        """What a function of the model plans, found once: good for all models of this structure."""
        if plan not in self._planned:
            self._planned[plan] = plan(self.arguments[1].value)
        return self._planned[plan]

    def turn_to(self, model):
        """Be the equations of another model of the same structure, with all its kernels."""
        if len(model.drive.rows) or len(model.controls.rows):  # what they act on may be another body
            self._planned.clear()
        self.arguments[1].renew(model)

    def __call__(self, t, state, mode=FRESH):
        """Rate of a state, shape (size,), at a time (s), in a mode of `wrcore.wheels.modes`."""
        return self.at(t, state[None, :], mode)[0]

    def at(self, t, states, mode=FRESH):
        """Rates of several states, shape (n, size), at one time (s)."""
        states, rates = np.ascontiguousarray(states, float), np.empty(states.shape)
        equations, model, work = self.arguments
        if fault := fault_in(fill_many, equations, t, states, model, work, rates, mode):
            self.fault, rates[:] = fault, np.nan
        raise_interrupted()
        return rates
