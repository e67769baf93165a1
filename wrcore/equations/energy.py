"""Energies and powers of a model: stored energy, losses and inputs of a run.

The energy is E = kinetic + gravitational + springs + elastic contact. The forces of the equations of motion change it
by the powers

    E' = P_frame + P_joints + P_motors - P_brakes - P_dampers - P_creep - P_contact damping + (U_contact' - P_elastic).

Rigid rails are at rest: with any irregularity, energy enters only by the pull of the moving frame. Masses, springs and
dampers of a flexible track (:mod:`wrcore.track.flexible_track`) are included in those of the vehicle. The power of a
contact is then the sum of both sides, wheel and moving rail.

*Elastic contact.* Eq. (7) is a spring N_el = c_d(0) K delta^1.5 and a damping N - N_el. The spring's power is P_elastic
= N_el (approach speed). It equals the rate of U_contact = 2/5 N_el delta if K is constant and the approach speed is the
rate of delta. Along a profile both hold only approximately; the last term is the resulting difference.

*Contact powers* are computed from the equations of motion with all other forces switched off. Without friction, the
power of the normal forces remains; without contact damping as well, that of Hertzian normal forces remains.
"""

import numpy as np

from wrcore.bodies.body import OMEGA, STATE_SIZE, VELOCITY
from wrcore.bodies.inertia import add_carried_gyroscopic, carrying, inertia_axes
from wrcore.contact.search import reduction
from wrcore.equations.equations_of_motion import Equations, derivatives_at
from wrcore.equations.model import frictionless, independent_at, workspace
from wrcore.equations.outputs import drive_history
from wrcore.forces.drive import BRAKE, KIND, undriven
from wrcore.forces.suspension import element_energies, pack_elements
from wrcore.kernels.jit import jit
from wrcore.track.flexible_track import track_places
from wrcore.wheels.contact_model import OUT_OF_RANGE, is_elliptic
from wrcore.wheels.hertzian_force import normal_contact

CHANNELS = (
    "kinetic_J", "gravitational_J", "springs_J", "elastic_contact_J",
    "input_by_frame_W", "input_by_joints_W", "dissipated_by_dampers_W", "dissipated_by_creep_W",
    "dissipated_by_contact_damping_W", "stored_by_springs_W", "stored_by_gravity_W", "stored_by_elastic_contact_W",
)  # fmt: skip
"""Names of the channels: stored energies (J), then powers (W) of inputs, losses and stores."""

DRIVE_CHANNELS = ("input_by_motors_W", "dissipated_by_brakes_W")
"""Names of further channels of scenes with motors or brakes."""


@jit(inline="always")
def _wheels_inertia(bodies, j):
    """Pitch moment of inertia (kg m^2) of the j-th wheelset with independent wheels."""
    return bodies.inertia[bodies.wheelsets[bodies.independent[j, 0]], 1]


@jit(allocates=False)
def _fill_powers(times, states, equations, model, work, rate, powers):
    for i in range(times.shape[0]):
        derivatives_at(equations, times[i], states[i], model, work, rate)
        powers[i] = work.flexible_track.power[0]
        for b in range(work.wrenches.shape[0]):
            if carrying(model.bodies, b):  # kinetic energy already contains their work, as the inertia's axes turn
                axes, at = inertia_axes(model.bodies, work)[b], STATE_SIZE * b
                add_carried_gyroscopic(model.bodies.inertia[b], axes, states[i], at, 1.0, work.wrenches[b])
            for k in range(6):
                powers[i] += work.wrenches[b, k] * states[i, STATE_SIZE * b + VELOCITY + k]
        for j in range(model.bodies.independent.shape[0]):
            inertia, at = _wheels_inertia(model.bodies, j), independent_at(model.bodies, j)
            powers[i] += inertia * states[i, at] * rate[at]


def _powers(times, states, model, work):
    """Power of all forces and moments of a model, also those on rails, at each state, W, shape (n,).

    Gyroscopic moments have no power."""
    powers = np.empty(len(times))
    _fill_powers(times, states, *Equations(model, work).arguments, np.empty(states.shape[1]), powers)
    return powers


@jit
def _kinetic_and_gravitational(model, axes, state):
    """Kinetic and gravitational energy of all bodies, J, and the rate of the gravitational energy, W.

    ``axes`` (n, 3, 3) are the principal axes of the bodies."""
    kinetic = height = rise = 0.0
    for b in range(model.bodies.mass.shape[0]):
        at, mass = STATE_SIZE * b, model.bodies.mass[b]
        local, velocity = axes[b].T.copy() @ state[at + OMEGA : at + STATE_SIZE], state[at + VELOCITY : at + OMEGA]
        kinetic += 0.5 * mass * np.sum(velocity**2) + 0.5 * np.sum(model.bodies.inertia[b] * local**2)
        height, rise = height + mass * state[at + 2], rise + mass * state[at + VELOCITY + 2]
    for j in range(model.bodies.independent.shape[0]):
        kinetic += 0.5 * _wheels_inertia(model.bodies, j) * state[independent_at(model.bodies, j)] ** 2
    return kinetic, model.gravity * height, model.gravity * rise


@jit
def _elastic_contact_energy(contact, work):
    """Sum of 2/5 N_el delta over all patches of the last evaluation, J."""
    energy = 0.0
    for k in range(work.patches.shape[0]):
        for wheel in range(2):
            for i in range(work.counts[k, wheel]):
                row = work.patches[k, wheel, i]
                delta = row[reduction.PENETRATION]
                if not is_elliptic(contact):  # potential unknown: approximated by that of an ellipse with this force
                    force = row[reduction.NORMAL]
                else:
                    along, across = row[reduction.CURVATURE_X], row[reduction.CURVATURE_Y]
                    force = normal_contact(contact, delta, along, across, 0.0)[0]
                energy += 0.4 * force * delta
    return energy


@jit
def _energies(times, states, evaluation, work):
    """Four stored energies (J), rates of springs and gravity, damper losses and power of the frame (W), shape (n, 8).

    ``evaluation``: the arguments of the model's `Equations` with this workspace."""
    rows, rate = np.empty((times.shape[0], 8)), np.empty(states.shape[1])
    equations, model, work_handle = evaluation
    for i in range(times.shape[0]):
        derivatives_at(equations, times[i], states[i], model, work_handle, rate)
        kinetic, height, rise = _kinetic_and_gravitational(model, inertia_axes(model.bodies, work), states[i])
        stored, stretching, damped, driven = element_energies(
            model.elements, model.track, times[i], model.speed, states[i], work.rotations, work.turns, rate
        )
        pressed = _elastic_contact_energy(model.contact, work)
        found = kinetic, height, stored, pressed, stretching, rise, damped, driven
        for k in range(len(found)):
            rows[i, k] = found[k]
    return rows


def energy_channels(model, work, times, states):
    """Compute energies (J) and powers (W) of a run: channels (n,) by name, which includes the unit.

    Gravitational energy is relative to z = 0, that of springs to their nominal position. ``times`` (s) has shape (n,),
    ``states`` (n, size). ``work`` is overwritten except for its counter of creep interpolations out of range; the
    search for arc lengths starts from those in it."""
    times, states = np.asarray(times, float), np.ascontiguousarray(states, float)
    begin, outside = work.arc_lengths.copy(), int(work.counters[OUT_OF_RANGE])
    if flexible := len(model.flexible_track.mass) > 0:
        model, states, track = _track_energies(model, states, work)
    loose = model.joints._replace(equations=0)
    touching = undriven(model)._replace(elements=pack_elements(), joints=loose, gravity=0.0)
    smooth = frictionless(touching)
    undamped = smooth._replace(contact=smooth.contact._replace(damping=1.0))
    parts = []
    for variant in (model, touching, smooth, undamped):
        parts.append(_powers(times, states, variant, _anew(variant, begin)))
    whole, contact, normal, hertz = parts
    again = _anew(model, begin)
    rows = _energies(times, states, Equations(model, again).arguments, again)
    kinetic, height, stored, pressed, stretching, rise, damped, driven = rows.T
    work.arc_lengths[:] = begin
    drives = _drive_powers(model, work, times, states) if len(model.drive.rows) else {}
    work.counters[OUT_OF_RANGE] = outside
    elastic = -0.5 * (1.0 + model.contact.damping) * hertz
    torques = sum(drives[name] * (1.0 if name.startswith("input") else -1.0) for name in drives)
    joints = whole + rise - contact - (driven - stretching - damped) - torques
    if flexible:
        kinetic, stored, stretching, damped = track + (kinetic, stored, stretching, damped)
    rows = (kinetic, height, stored, pressed, driven, joints, damped, normal - contact, -normal - elastic,
            stretching, rise, elastic)  # fmt: skip
    return dict(zip(CHANNELS, rows, strict=True)) | drives


def _anew(model, arc_lengths):
    """Return a new workspace with these arc lengths (k,), m.

    It has no data of other evaluations, so results are bitwise identical for any number of states."""
    work = workspace(model)
    work.arc_lengths[:] = arc_lengths
    return work


def _track_energies(model, states, work):
    """Return model, states, and kinetic energy, spring energy, its rate and loss of a flexible track, shape (4, n).

    In the returned model and states massless rails have velocities as states: those of this model, which variants of
    it then use."""
    track, places, d = model.flexible_track, track_places(model), len(model.flexible_track.mass)
    if track.mass[0] == 0.0:
        rates = Equations(model, work).at(0.0, states)
        moving = np.concatenate([states[:, places], rates[:, places]], axis=-1)
        parts = states[:, : places[0, 0]], moving.reshape(len(states), -1), states[:, places[-1, -1] + 1 :]
        states, elements = np.hstack(parts), model.elements
        elements = elements._replace(states=elements.states + places.size)
        model = model._replace(flexible_track=track._replace(mass=np.ones(d)), elements=elements)
        places = track_places(model)
    q, v = states[:, places[:, :d]], states[:, places[:, d:]]
    pulls = q @ track.stiffness, v @ track.damping
    terms = 0.5 * track.mass * v * v, 0.5 * q * pulls[0], v * pulls[0], v * pulls[1]
    return model, states, np.array([term.sum(axis=(1, 2)) for term in terms])


def _drive_powers(model, work, times, states):
    """Powers of motors and losses of brakes (W, shape (n,)) by the names `DRIVE_CHANNELS`."""
    torques, rates, *_ = drive_history(Equations(model, work), times, states)
    powers, brakes = torques * rates, model.drive.rows[:, KIND] == BRAKE
    return dict(zip(DRIVE_CHANNELS, (powers[:, ~brakes].sum(axis=1), -powers[:, brakes].sum(axis=1)), strict=True))
