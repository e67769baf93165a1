"""Initial state of a vehicle: steady running on the rails, displaced as the scene's key ``initial`` states.

Static equilibrium without friction is solved first; it depends neither on speed nor on creep. If the vehicle is not
displaced, steady running with all contact forces, including the lateral force of spin, is solved from there. A
displaced vehicle is in no lateral equilibrium; its wheelsets get the height, roll and rolling rate at which they do not
accelerate vertically, in roll or about their axles.
"""

import dataclasses
import math

import numpy as np

from wrcore.balance.bodies import put_bodies
from wrcore.balance.equilibrium import Equilibrium, solve_equilibrium, stand_on_rails
from wrcore.balance.linear import cleared, steady_running
from wrcore.bodies.body import EULER, OMEGA, STATE_SIZE, VELOCITY, angles, euler_of, euler_parameters, matrix_of
from wrcore.contact.hertz import contact_modulus
from wrcore.contact.rigid.height_at_load import settle
from wrcore.contact.search import reduction
from wrcore.contact.search.detection import axle_direction, find_patches
from wrcore.equations.many_models import equations_of
from wrcore.equations.model import frictionless, independent_at, internal_states, state_size
from wrcore.errors import InputError
from wrcore.errors.messages import warn
from wrcore.forces.drive import undriven
from wrcore.geometry.path import frame_turn, track_frame
from wrcore.kernels.handles import Handle
from wrcore.track.flexible_track import rails_at
from wrcore.track.track import TrackModel
from wrcore.vehicle.description import GRAVITY
from wrcore.vehicle.train import repeated_equilibrium

LARGEST_RESIDUAL = 1e-6 * GRAVITY
"""Largest accepted acceleration at a computed equilibrium, m/s^2 or rad/s^2."""

LARGEST_RESIDUAL_ON_STRIPS = 0.02 * GRAVITY
"""Largest accepted acceleration for patches on strips, m/s^2 or rad/s^2: forces step by up to 1 % if the number of
strips changes, and the equilibrium may lie at a step."""

LARGEST_RESIDUAL_AT_A_STEP = 0.1 * GRAVITY
"""Largest accepted acceleration for unequal (worn) wheels or rails if a force steps at all equilibria, m/s^2 or
rad/s^2: with `moment` forces step by 10 to 20 % where overlaps merge."""

LARGEST_SLIP, LARGEST_SHIFT = 0.01, 5e-3
"""Bounds for accepted steady running: relative difference of rolling rates from pure rolling, and lateral distance of
wheelsets from static equilibrium, m."""

START_OFFSETS = 1e-3, -1e-3, 2e-3, -2e-3, 3e-3, -3e-3, 4e-3, -4e-3
"""Further lateral starting positions of the search for equilibrium, m, if wheels or rails differ: then the equilibrium
may be off the centre, and worn profiles do not show its position."""

ROUNDING = 1e-9
"""Accelerations of wheelsets below this may be rounding, m/s^2 or rad/s^2."""

EQUILIBRIUM_SPEED = 20.0
"""Speed at which equilibria are solved, m/s; only the velocities in them depend on it."""


@np.errstate(all="ignore")  # an overflow is no equilibrium
def equilibrium_positions(scene, model):
    """Solve for the static `Equilibrium` of a scene's vehicle; all bodies move ahead without rotation.

    It does not depend on speed or friction. An InputError is raised if there is none near the nominal position.
    """
    vehicle, model = scene.vehicle, undriven(model)
    unit = _unit(vehicle, model)
    if unit is not None:
        alone = model._replace(bodies=unit.bodies, elements=unit.elements, joints=unit.joints)
        return repeated_equilibrium(equilibrium_positions(dataclasses.replace(scene, vehicle=unit), alone), vehicle)
    track = TrackModel(True, model.track.path, model.track.irregularity)
    level = frictionless(model)._replace(track=track, speed=EQUILIBRIUM_SPEED)
    expected = "expected a vehicle that rests on its wheels near its nominal position, got"
    limit = LARGEST_RESIDUAL_ON_STRIPS if model.contact.strips.strips else LARGEST_RESIDUAL
    unlike, found, faults = model.contact.geometries, [], []
    for offset in (0.0, *(START_OFFSETS if unlike else ())):
        try:
            equilibrium = solve_equilibrium(level, _standing(scene, model, offset))
        except np.linalg.LinAlgError as error:
            faults.append(InputError(scene.source, "vehicle", f"{expected} none: {error}"))
        except InputError as error:  # its wheels do not fit on the rails there
            faults.append(error)
        else:
            if equilibrium.residual < limit and np.all(equilibrium.wheel_loads > 0.0):
                return equilibrium
            found.append(equilibrium)
    at_a_step = [one for one in found if unlike and one.at_a_step and np.all(one.wheel_loads > 0.0)]
    best = min(at_a_step, key=lambda one: one.residual, default=None)
    if best is not None and best.residual < LARGEST_RESIDUAL_AT_A_STEP:
        left = f"accelerations of up to {LARGEST_RESIDUAL_AT_A_STEP:.2g} m/s^2 are left"  # one line for all such
        warn(f"{scene.source}: the vehicle rests where a contact force steps, and {left}")
        return best
    if not found:
        raise faults[0]
    nearest = min(found, key=lambda one: (np.any(one.wheel_loads <= 0.0), np.nan_to_num(one.residual, nan=np.inf)))
    raise InputError(
        scene.source, "vehicle", f"{expected} accelerations of {nearest.residual:.2g} m/s^2 and a least wheel"
        f" load of {np.min(nearest.wheel_loads, initial=np.inf):.6g} N",
    )  # fmt: skip


def _standing(scene, model, offset):
    """Return the state of the bodies at their nominal positions, shifted left by ``offset`` (m), wheels on rails."""
    vehicle, wheelsets = scene.vehicle, scene.vehicle.bodies.wheelsets
    sides, state = _geometries(model), np.zeros(state_size(model))
    for body, (x, y, z) in enumerate(vehicle.positions):
        at = STATE_SIZE * body
        state[at : at + 8] = x, y + offset, z, 1.0, 0.0, 0.0, 0.0, EQUILIBRIUM_SPEED
        if body in wheelsets:
            load = vehicle.nominal_wheel_load(body)
            if load <= 0.0:
                got = f"expected wheels pressed onto the rails, got a wheel load of {load:.6g} N"
                raise InputError(scene.source, "vehicle", got)
            k = int(np.flatnonzero(wheelsets == body)[0])
            roll, state[at + 2] = _settled(scene, model, k, sides[k], offset, 0.0, load, state, "track.gauge")
            if model.contact.geometries:
                state[at + EULER : at + VELOCITY] = euler_parameters(roll, 0.0, 0.0)
    return state


def static_equilibrium(scene, model, at_rest=None):
    """Return the static `Equilibrium` of a scene's vehicle on a tangent track without irregularity and friction.

    All bodies move at the scene's speed, wheelsets roll without slip. ``at_rest`` is the result of
    `equilibrium_positions`. The state belongs to the model without its drive (:func:`wrcore.forces.drive.undriven`). An
    InputError is raised if there is no equilibrium near the nominal position.
    """
    at_rest = at_rest or equilibrium_positions(scene, model)
    state = _moving(model, at_rest)
    for k, sides in enumerate(_geometries(model)):
        _roll_as_it_stands(scene, model, k, sides, state)
    return dataclasses.replace(at_rest, state=state)


def _unit(vehicle, model):
    """Return the single vehicle of a train if its equilibrium holds for all, because wheels and track are equal; else
    None."""
    return None if model.contact.geometries or len(model.flexible_track.mass) else vehicle.unit


def _moving(model, at_rest):
    """Return the state of an equilibrium with all bodies at the speed of the moving frame."""
    state = at_rest.state.copy()
    state[VELOCITY : STATE_SIZE * len(model.bodies.mass) : STATE_SIZE] = model.speed
    return state


def _roll_as_it_stands(scene, model, k, sides, state):
    """Set the spin with which the k-th wheelset rolls without slip at its position and attitude, in place.

    Independent wheels get individual speeds.
    """
    body = model.bodies.wheelsets[k]
    part = state[STATE_SIZE * body : STATE_SIZE * (body + 1)]
    roll, _, yaw = angles(part[EULER:VELOCITY])
    left, right = _radii(scene, model, k, sides, state, float(roll), float(yaw))
    radius = sum(left + right) / len(left + right)
    part[OMEGA:] = axle_direction(roll, yaw)
    part[OMEGA:] *= model.speed / radius
    for j in np.flatnonzero(model.bodies.independent[:, 0] == k):
        half = 0.5 * (len(left) / sum(left) - len(right) / sum(right)) if left and right else 0.0
        state[independent_at(model.bodies, j)] = model.speed * half


def _geometries(model):
    """Return handles of the `ContactGeometry` of the left and the right wheel of each wheelset."""
    contact, count = model.contact, len(model.bodies.wheelsets)
    geometries = contact.geometries or (contact.geometry,) * (2 * count)
    handles = {number: Handle(one) for number, one in {id(one): one for one in geometries}.items()}
    return [tuple(handles[id(one)] for one in geometries[2 * k : 2 * k + 2]) for k in range(count)]


def _radii(scene, model, k, sides, state, roll, yaw):
    """Return the rolling radii (m) of the left and the right wheel's patches of the k-th wheelset in a state."""
    y, z = state[STATE_SIZE * model.bodies.wheelsets[k] :][1:3]
    axle, rows = axle_direction(roll, yaw), np.empty((reduction.MAX_PATCHES, reduction.PATCH_COLUMNS))
    spatial, reduced, radii = scene.detection != "planar", min(model.contact.reduction, reduction.MOMENT), []
    for one, sign, (aside, up) in zip(sides, (1.0, -1.0), rails_at(model, state, k), strict=True):
        sided = (sign * c for c in axle)
        count = find_patches(one, sign, y - aside, z - up, *sided, spatial, reduced, rows)
        radii.append([z - up - float(row[reduction.Z]) for row in rows[:count]])
    return radii


def _settled(scene, model, k, sides, y, yaw, load, state, blamed="initial"):
    """Return roll (rad) and height (m) at which each wheel of the k-th wheelset carries the load (N).

    The contact damping factor is that of zero speed. ``sides`` are the wheelset's `_geometries`. Rails of a flexible
    track are at their positions in the state. If there is no such position, an InputError names the key ``blamed``.
    """
    contact, (left, right) = model.contact, rails_at(model, state, k)
    modulus = contact_modulus(contact.shear_modulus, contact.poisson_ratio) * 0.5 * (1.0 + contact.damping)
    spatial, nominal = scene.detection != "planar", scene.vehicle.rolling_radius
    roll, z = settle(*sides, contact.hertz, modulus, y, yaw, spatial, contact.reduction, load, nominal)
    if not math.isfinite(z):
        expected = "expected a position in which both wheels stand on the rails under their load,"
        expected += f" got y = {y:g} m, yaw = {yaw:g} rad and {load:.6g} N per wheel"
        if blamed == "track.gauge":
            apart = f"{2.0 * scene.vehicle.half_distance:g} m apart (tape_circle_half_distance of the vehicle, twice)"
            expected = f"expected a gauge that fits tape circles {apart} on these profiles, got {scene.track.gauge:g} m"
            expected += f": centred, the wheels do not stand on the rails under {load:.6g} N each"
        raise InputError(scene.source, blamed, expected)
    if len(model.flexible_track.mass):
        roll, z = roll + 0.5 * (left[1] - right[1]) / contact.geometry.rail_distance, z + 0.5 * (left[1] + right[1])
    return roll, z


def _put_onto_rails(scene, model, k, sides, y, yaw, at_rest, state):
    """Place the k-th wheelset on the rails at y (m) and yaw (rad) with its loads in ``at_rest``, rolling without slip,
    in place."""
    body, load = model.bodies.wheelsets[k], float(0.5 * at_rest.wheel_loads[k].sum())
    roll, z = _settled(scene, model, k, sides, y, yaw, load, state)
    state[STATE_SIZE * body + 1 : STATE_SIZE * body + VELOCITY] = y, z, *euler_parameters(roll, 0.0, yaw)
    _roll_as_it_stands(scene, model, k, sides, state)


def initial_state(scene, model, at_rest=None, shared=None):
    """Return the initial state: steady running, shifted laterally by ``initial.y``, wheelsets yawed by ``initial.yaw``.

    Motors and brakes do not act in this steady running; the speed controller's integral is zero. On irregular rails
    the wheelsets have their static loads, and axle boxes stay on their axles. Values of ``initial.bodies`` are set last
    and are not changed again. ``at_rest`` is the same vehicle's `equilibrium_positions`; ``shared`` caches equations of
    motion for the next scene (`wrcore.equations.many_models.equations_of`).
    """
    vehicle, data = scene.vehicle, scene.data
    at_rest, driven = at_rest or equilibrium_positions(scene, model), model
    model = undriven(model)
    y, yaw, moved = float(data["initial"]["y"]), float(data["initial"]["yaw"]), data["initial"]["bodies"]
    state = _moving(model, at_rest)
    track = model.track
    level = model if track.tangent else model._replace(track=TrackModel(True, track.path, track.irregularity))
    for k, sides in enumerate(_geometries(model)):
        if y or yaw:
            _put_onto_rails(scene, model, k, sides, y, yaw, at_rest, state)
        else:
            _roll_as_it_stands(scene, model, k, sides, state)
    if y or yaw:
        for body, name in enumerate(vehicle.body_names):
            state[STATE_SIZE * body + 1] += y * (vehicle.data["bodies"][name]["kind"] == "body")
    else:
        state = _steady(vehicle, level, state)
    if moved:
        _move(scene, model, moved, at_rest, state)
    state = _balanced(vehicle, level, equations_of(level, shared), state)
    if not model.track.tangent:
        stand_on_rails(model, state, at_rest.wheel_loads)
        state = _with_axle_boxes(vehicle, state)
    put_bodies(moved, vehicle, state, model.track.path)
    if not model.track.tangent:
        parts = dict(zip(vehicle.body_names, _parts(vehicle, state), strict=True))
        moves = {name: (part[0], part[VELOCITY]) for name, part in parts.items()}
        for name, part in parts.items():  # an axle box is transformed with the arc length of its wheelset
            part[:] = _on_path(model.track.path, *moves[vehicle.data["bodies"][name].get("wheelset", name)], part)
    rest_of_states = np.zeros(internal_states(driven) - internal_states(model))
    rest_of_states[len(rest_of_states) - len(driven.controls.start) :] = driven.controls.start
    return np.concatenate([state, rest_of_states])


def _move(scene, model, moved, at_rest, state):
    """Set the values of ``initial.bodies`` in a state, in place; displaced wheelsets are placed on the rails."""
    for (k, body), sides in zip(enumerate(scene.vehicle.bodies.wheelsets), _geometries(model), strict=True):
        part, values = _parts(scene.vehicle, state)[body], moved.get(scene.vehicle.body_names[body], {})
        if values.keys() & {"y", "yaw"}:
            y, yaw = values.get("y", part[1]), values.get("yaw", float(angles(part[EULER:VELOCITY])[2]))
            _put_onto_rails(scene, model, k, sides, y, yaw, at_rest, state)
        part[OMEGA:] *= values.get("vx", part[VELOCITY]) / part[VELOCITY]
    put_bodies(moved, scene.vehicle, state, model.track.path)


def _parts(vehicle, state):
    """Return the bodies' parts of states (..., size) as views, shape (..., n, 13)."""
    return state[..., : STATE_SIZE * len(vehicle.body_names)].reshape(*state.shape[:-1], -1, STATE_SIZE)


def _with_axle_boxes(vehicle, state):
    """Return the state with axle boxes placed on their axles; their pitch angles are kept."""
    state = state.copy()
    parts = dict(zip(vehicle.body_names, _parts(vehicle, state), strict=True))
    places = dict(zip(parts, vehicle.positions, strict=True))
    for name, part in parts.items():
        described = vehicle.data["bodies"][name]
        if described["kind"] == "axle_box":
            axle, (_, pitch, _) = parts[described["wheelset"]], angles(part[EULER:VELOCITY])
            axes = matrix_of(axle[EULER:VELOCITY])
            part[:3] = axle[:3] + axes @ (places[name] - places[described["wheelset"]])
            part[EULER:VELOCITY] = euler_of(axes @ matrix_of(euler_parameters(0.0, float(pitch), 0.0)))
    return state


def _steady(vehicle, model, state):
    """Return the state of steady running near a state, or the given state if there is none, as without creep forces.

    The vehicles of a train do not act on each other: the result of the first vehicle is repeated for all.
    """
    unit = _unit(vehicle, model)
    if unit is not None:
        bodies, inner = STATE_SIZE * len(unit.body_names), STATE_SIZE * len(vehicle.body_names)
        first = np.concatenate([state[:bodies], state[inner:][: unit.elements.states]])
        alone = model._replace(bodies=unit.bodies, elements=unit.elements, joints=unit.joints)
        return repeated_equilibrium(Equilibrium(_steady(unit, alone, first), np.zeros((0, 2)), 0.0), vehicle).state
    try:
        found = steady_running(model, state).state
    except np.linalg.LinAlgError:
        return state
    wheelsets = [_parts(vehicle, row)[model.bodies.wheelsets] for row in (found, state)]
    turning, moving = (np.linalg.norm(rows[:, OMEGA:], axis=1) for rows in wheelsets)
    shifts = np.abs(wheelsets[0][:, 1] - wheelsets[1][:, 1])
    near = np.all(np.abs(turning - moving) < LARGEST_SLIP * moving) and np.all(shifts < LARGEST_SHIFT)
    return found if near else state


@np.errstate(all="ignore")  # an overflow is no improvement
def _balanced(vehicle, model, equations, state):
    """Return the state with all wheelsets at heights, rolls and rolling rates whose accelerations are zero.

    Newton's method solves for all wheelsets at once: with the other bodies fixed, wheelsets do not act on each other.
    """
    wheelsets = model.bodies.wheelsets
    boxes = any(described["kind"] == "axle_box" for described in vehicle.data["bodies"].values())
    parts = _parts(vehicle, state)[wheelsets]
    rolls, _, yaws = angles(parts[:, EULER:VELOCITY])
    rolling = np.sum(np.transpose(axle_direction(rolls, yaws)) * parts[:, OMEGA:], axis=-1)
    stands = np.column_stack([parts[:, 2], rolls, rolling])

    def standing(stands):
        """Return states with wheelsets at heights (m), rolls (rad), rolling rates (rad/s), and accelerations."""
        new = np.tile(state, (len(stands), 1))
        parts = _parts(vehicle, new)
        z, roll, rate = (stands[..., i] for i in range(3))
        axles = np.stack(axle_direction(roll, yaws), axis=-1)
        parts[:, wheelsets, 2], parts[:, wheelsets, EULER:VELOCITY] = z, euler_parameters(roll, 0.0, yaws)
        parts[:, wheelsets, OMEGA:] = rate[..., None] * axles
        if boxes:
            new = np.stack([_with_axle_boxes(vehicle, one) for one in new])
        rates = _parts(vehicle, equations.at(0.0, new))[:, wheelsets]
        about = np.sum(rates[..., OMEGA:] * axles, axis=-1)
        return new, np.concatenate([rates[..., 9:11], about[..., None]], axis=-1)

    for unknown in (3, 2):  # without friction no rolling rate is in balance: it is not changed
        found, balanced = _improved(standing, stands, np.diag([1e-8, 1e-8, 1e-7 * model.speed])[:unknown])
        if np.all(np.abs(found[:, 2] - stands[:, 2]) < LARGEST_SLIP * np.abs(stands[:, 2])):
            break
    return cleared(model, balanced)


def _improved(standing, stands, steps):
    """Return the ``stands`` after Newton's method in the first unknowns, and the state there.

    There are as many unknowns as difference ``steps``. Iteration ends at the first step that does not reduce the
    residual, or below ``ROUNDING``. The Jacobian is kept while a step reduces the residual to a tenth or less.
    """
    unknown, slopes = slice(len(steps)), None
    states, left = standing(stands[None])
    left = left[0, :, unknown]
    for _ in range(20):
        if slopes is None:
            ends = standing(stands + np.concatenate([steps, -steps])[:, None])[1]
            high, low = ends[: len(steps), :, unknown], ends[len(steps) :, :, unknown]
            slopes = np.moveaxis((high - low) / (2.0 * steps.sum(axis=1)[:, None, None]), 0, -1)
        new = stands.copy()
        try:
            new[:, unknown] -= np.linalg.solve(slopes, left[..., None])[..., 0]
        except np.linalg.LinAlgError:
            break
        moved, still_left = standing(new[None])
        still_left = still_left[0, :, unknown]
        part = np.max(np.abs(still_left)) / np.max(np.abs(left))
        if not part < 1.0:
            break
        stands, states, left = new, moved, still_left
        if np.max(np.abs(left)) < ROUNDING:
            break
        if part > 0.1:
            slopes = None
    return stands, states[0]


def _on_path(path, s, speed, part):
    """Return the state of one body on the path from its state on a tangent track along x.

    The body is at arc length s (m) of the path; the path's axes at the body move along the path with ``speed``, m/s.
    """
    frame = np.empty((3, 3))
    station = track_frame(path, s, frame)
    turn = frame @ np.array(frame_turn(station)) * speed
    arm = frame @ np.array([part[0] - s, part[1], part[2]])
    position = np.array([station.x, station.y, station.z]) + arm
    velocity = frame @ part[VELOCITY:OMEGA] + np.cross(turn, arm)
    euler = euler_of(frame @ matrix_of(part[EULER:VELOCITY]))
    return np.concatenate([position, euler, velocity, frame @ part[OMEGA:] + turn])
