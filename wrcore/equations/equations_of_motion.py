"""Equations of motion: Newton-Euler in absolute coordinates with Lagrange multipliers and Baumgarte, Eq. (8).

    [ M  D^T ] [ v'     ]   [ g                               ]
    [ D   0  ] [ lambda ] = [ gamma - 2 alpha Phi' - beta^2 Phi ]

with v = (r', w) per body in track axes. M is block diagonal (mass, inertia in track axes). The multipliers follow from
the small system (D M^-1 D^T) lambda = D M^-1 g - gamma*, where gamma* is the second right-hand side. The full matrix of
Eq. (8) is never formed. Multipliers are computed only for scenes with joints.
"""

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
from wrcore.bodies.vector import load
from wrcore.equations.kernels import with_kernels
from wrcore.equations.model import independent_at, workspace
from wrcore.forces.suspension import element_forces
from wrcore.kernels.handles import Handle, Kernel, call_address, call_at
from wrcore.kernels.interrupts import raise_interrupted
from wrcore.kernels.jit import FUSED, jit
from wrcore.kernels.own import fault_in
from wrcore.track.track import rail_motions, turn_back_wrenches
from wrcore.wheels.contact_model import EVALUATIONS, contact_of
from wrcore.wheels.force import press_wheels
from wrcore.wheels.modes import FRESH, WRENCHES_HELD
from wrcore.wheels.motion import MOTION


@jit(allocates=False, fastmath=FUSED)
def _turn_independent_wheels(bodies, work, rate):
    """Fill the rates of half the difference of the rolling rates of independently rotating wheels.

    Each wheel has half the wheelset's pitch moment of inertia. The rolling rate of the wheelset is the mean of both
    wheels; its equation is that of a solid wheelset."""
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
    """Fill ``work.motions`` with the motions of all wheels in their rails' frames.

    The wheelsets' rotation matrices must be in ``work.rotations``."""
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
    if model.kernels.rail_friction_kernel != 0:
        call_address(model.kernels.rail_friction_kernel, model, state, work)
    if model.kernels.rail_sections_kernel != 0:
        call_address(model.kernels.rail_sections_kernel, model, state, work)
    for j in range(model.bodies.independent.shape[0]):
        k, half = model.bodies.independent[j, 0], state[independent_at(model.bodies, j)]
        for wheel in range(2):
            row = work.motions[k, wheel]
            for i in range(3):
                row[MOTION.wx + i] += row[MOTION.side] * half * row[MOTION.ex + i]


@jit(allocates=False, fastmath=FUSED)
def _add_rail_wrenches(model, state, work, rate, mode):
    """Add the forces and moments of the rails to those of the wheelsets; in mode `WRENCHES_HELD`, those found last."""
    wheelsets, tangent, held = model.bodies.wheelsets, model.track.tangent, mode & WRENCHES_HELD
    if not held:
        wheel_motions(model, state, work)
    if model.kernels.flexible_track_kernel != 0:
        call_address(model.kernels.flexible_track_kernel, model, state, work, rate, mode)
    elif not held:
        press_wheels(model, work, mode)
    if model.kernels.check_rails_kernel != 0 and not held:
        call_address(model.kernels.check_rails_kernel, model, state, work)
    for k in range(wheelsets.shape[0]):
        if not (tangent or held):
            turn_back_wrenches(work.rails[k], work.shifts[k], work.rail_wrenches[k], work.patches[k], work.counts[k])
        wrench = work.wrenches[wheelsets[k]]
        for i in range(6):
            wrench[i] += work.rail_wrenches[k, 0, i] + work.rail_wrenches[k, 1, i]


@jit(allocates=False, fastmath=FUSED)
def fill_derivatives(t, state, model, work, rate, mode=FRESH):
    """Compute the right-hand side of the equations of motion: fill ``rate``, and patches and their counts in ``work``.

    The ``mode`` is one of `wrcore.wheels.modes`. The state contains for each body position (m), Euler parameters,
    velocity (m/s) and angular velocity (rad/s) in track axes. Internal states follow: those of force elements (m), of
    independently rotating wheels (rad/s) and of a flexible track (m, m/s, :mod:`wrcore.track.flexible_track`), the
    speed controller's integral (m), and states and held outputs of control laws (:mod:`wrcore.forces.control`).
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
        _turn_independent_wheels(bodies, work, rate)
    element_forces(model.elements, model.track, t, model.speed, state, work.rotations, work.turns, work.wrenches, rate)
    if model.kernels.drive_torques_kernel != 0:
        call_address(model.kernels.drive_torques_kernel, model, t, state, work, rate)
    if bodies.axes.shape[0] > 0:
        turn_to_principal(bodies, work.rotations, work.principal)
    axes = inertia_axes(bodies, work)
    for b in range(n):
        if carrying(bodies, b):
            add_carried_gyroscopic(bodies.inertia[b], axes[b], state, STATE_SIZE * b, -1.0, work.wrenches[b])
        else:
            subtract_gyroscopic(bodies.inertia[b], axes[b], state, STATE_SIZE * b, work.wrenches[b])
    if model.joints.equations > 0:
        call_address(model.kernels.joint_reactions_kernel, model, t, state, work)
    for b in range(n):
        at = STATE_SIZE * b
        euler_rates(state, at, work.turns[b, 0], work.turns[b, 1], work.turns[b, 2], model.alpha, rate)
        for i in range(3):
            rate[at + i] = state[at + VELOCITY + i]
            rate[at + VELOCITY + i] = work.wrenches[b, i] / bodies.mass[b]
        apply_inverse_inertia(bodies.inertia[b], axes[b], work.wrenches[b], rate[at + OMEGA :])


@jit(allocates=False, forceinline=True)
def derivatives_at(equations, t, state, model, work, rate, mode=FRESH):
    """Compute the right-hand side by the address ``equations``; other arguments are those of `fill_derivatives`."""
    call_at(equations, t, state, model, work, rate, mode)


@jit(allocates=False, nogil=True)
def fill_many(equations, t, states, model, work, rates, mode=FRESH):
    """Fill ``rates`` (n, size) with the right-hand sides at several ``states`` (n, size), row by row."""
    for i in range(states.shape[0]):
        derivatives_at(equations, t, states[i], model, work, rates[i], mode)


class Equations:
    """Equations of motion of a model with their scratch arrays, to be called as ``function(t, state)``.

    For kernels, ``arguments`` contains the address of the right-hand side and handles of model and workspace."""

    def __init__(self, model, work=None):
        self.work = workspace(model) if work is None else work
        model, work = Handle(with_kernels(model, self.work)), Handle(self.work)
        state, self._planned, self.fault = np.empty(0), {}, ""  # the last one of a law of the user
        self.arguments = Kernel(fill_derivatives, 0.0, state, model, work, state, FRESH), model, work

    def planned(self, plan):
        """Return ``plan(model)``, computed once: the result is valid for all models of this structure."""
        if plan not in self._planned:
            self._planned[plan] = plan(self.arguments[1].value)
        return self._planned[plan]

    def turn_to(self, model):
        """Replace the model by another of the same structure, which must have the addresses of its kernels."""
        if len(model.drive.rows) or len(model.controls.rows):  # these may act on different bodies
            self._planned.clear()
        self.arguments[1].renew(model)

    def __call__(self, t, state, mode=FRESH):
        """Return the rate of a state, shape (size,), at a time (s), in a mode of `wrcore.wheels.modes`."""
        return self.at(t, state[None, :], mode)[0]

    def at(self, t, states, mode=FRESH):
        """Return the rates of several states, shape (n, size), at one time (s); NaN if a user's law fails."""
        states, rates = np.ascontiguousarray(states, float), np.empty(states.shape)
        equations, model, work = self.arguments
        if fault := fault_in(fill_many, equations, t, states, model, work, rates, mode):
            self.fault, rates[:] = fault, np.nan
        raise_interrupted()
        return rates
