"""Static equilibrium: the vehicle rolls straight on at constant speed and nothing accelerates.

Unknown are small displacements of all bodies (three translations, three rotations in track axes) but for a wheelset's
rotation about its axle, which its frame does not have, and the force elements' internal states. Newton's method on the
accelerations, without a wheelset's about its axle; directions in which nothing holds a body (along the track, say) stay
as they are.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from wrcore.bodies.body import EULER, STATE_SIZE, VELOCITY
from wrcore.contact.search import reduction
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.model import frictionless, internal_states
from wrcore.forces.suspension import pack_elements
from wrcore.geometry.irregularity import irregularity_at
from wrcore.geometry.path import tangent_path
from wrcore.wheels.modes import WARM

STEP = 1e-7
"""Of the difference quotients: m and rad."""

RESIDUAL = 1e-9
"""Accelerations below this count as none, m/s^2 and rad/s^2; Newton's method ends there once a step leaves more than a
tenth of what was left before it: what is soft still moves far, in y and roll, while they are all but zero."""


NEAR, NOTHING_LEFT = 0.02, 0.01
"""Of an equilibrium at a step of a force: how far the next one lies by the slopes, m and rad, and the part of the
residual that it leaves."""


@dataclass(frozen=True)
class Equilibrium:
    """Vehicle at rest relative to the moving frame."""

    state: np.ndarray
    wheel_loads: np.ndarray
    """(k, 2): vertical force of the rails on left and right wheels, N: wheelsets as in ``model.bodies.wheelsets``."""
    residual: float
    """Largest acceleration left, m/s^2 or rad/s^2, but for that of a wheelset about its axle."""
    at_a_step: bool = False
    """Whether forces step there, if something is left: by their slopes a move by less than `NEAR` would mend it."""


def displaced(state, model, displacements):
    """States (k, size) with displaced bodies: a row of ``displacements`` (k, 6 n + states) has each body's translation
    (m) and rotation vector (rad) in track axes, then changes of the elements' internal states (m)."""
    n = len(model.bodies.mass)
    states = np.tile(state, (len(displacements), 1))
    parts = states[:, : STATE_SIZE * n].reshape(-1, n, STATE_SIZE)
    place = displacements[:, : 6 * n].reshape(-1, n, 6)
    parts[..., :3] += place[..., :3]
    parts[..., EULER:VELOCITY] = _turned(parts[..., EULER:VELOCITY], place[..., 3:])
    states[:, STATE_SIZE * n :] += displacements[:, 6 * n :]
    return states


def _turned(p, turn):
    """Euler parameters (..., 4) after a further rotation by a rotation vector (..., 3) in track axes."""
    angle = np.linalg.norm(turn, axis=-1)
    scale = 0.5 * np.sinc(0.5 * angle / np.pi)
    a0, (a1, a2, a3), (e0, e1, e2, e3) = np.cos(0.5 * angle), scale * np.moveaxis(turn, -1, 0), np.moveaxis(p, -1, 0)
    turned = np.stack([
        a0 * e0 - a1 * e1 - a2 * e2 - a3 * e3, a0 * e1 + a1 * e0 + a2 * e3 - a3 * e2,
        a0 * e2 + a2 * e0 + a3 * e1 - a1 * e3, a0 * e3 + a3 * e0 + a1 * e2 - a2 * e1,
    ], axis=-1)  # fmt: skip
    return turned / np.linalg.norm(turned, axis=-1, keepdims=True)


def _unknowns(model):
    """Mask (6 n + states,) of the displacements that are unknown: all but a wheelset's rotation about its axle."""
    unknown = np.ones(6 * len(model.bodies.mass) + internal_states(model), bool)
    unknown[6 * np.flatnonzero(model.bodies.spins) + 4] = False
    return unknown


def _accelerations(rates, model):
    """Rows of accelerations, six per body, and rates of the elements' internal states, from rows of state rates."""
    n = len(model.bodies.mass)
    bodies = rates[:, : STATE_SIZE * n].reshape(len(rates), n, STATE_SIZE)[:, :, VELOCITY:].reshape(len(rates), 6 * n)
    return np.hstack([bodies, rates[:, STATE_SIZE * n :]])


def solve_equilibrium(model, state, iterations=50):
    """Equilibrium on a tangent track by Newton's method from a nearby state, in which all bodies move ahead at the
    frame's speed, wheels about to touch the rails or pressed onto them; a large ``residual`` means that none was
    found."""
    model = model._replace(beta=model.beta or 1.0)  # without feedback a joint's violation would not show
    equations = Equations(model)
    unknown = _unknowns(model)
    size = int(unknown.sum())
    residual, before, at_a_step = np.inf, np.inf, False
    for _ in range(iterations):
        rows = STEP * np.eye(len(unknown))[unknown]
        states = displaced(state, model, np.vstack([rows, -rows]))
        values = _accelerations(equations.at(0.0, np.vstack([states, state]), WARM), model)[:, unknown]
        residual = float(np.max(np.abs(values[-1])))
        if residual < RESIDUAL and not residual < 0.1 * before:
            break
        before = residual
        slopes = ((values[:size] - values[size:-1]) / (2.0 * STEP)).T
        largest = np.max(np.abs(slopes), axis=1)
        weights = 1.0 / np.maximum(largest, 1e-9 * np.max(largest))  # nothing acts in a row of zeros
        step = np.zeros(len(unknown))
        step[unknown] = np.linalg.lstsq(weights[:, None] * slopes, -weights * values[-1], rcond=1e-11)[0]
        left = np.max(np.abs(values[-1] + slopes @ step[unknown]))
        at_a_step = bool(np.max(np.abs(step)) < NEAR and left < NOTHING_LEFT * residual)
        better = _improved(state, step, model, equations, residual)
        if better is None:
            break
        state = better
    return Equilibrium(state, wheel_loads(equations, state), residual, at_a_step)


def _improved(state, step, model, equations, residual):
    """The state after the longest of the step, its half, its quarter, ... that comes closer to equilibrium, or None."""
    for halvings in range(12):
        new = displaced(state, model, step[None, :] * 0.5**halvings)[0]
        rates = equations.at(0.0, new[None, :], WARM)
        if np.max(np.abs(_accelerations(rates, model)[:, _unknowns(model)])) < residual:
            return new
    return None


def wheel_loads(equations, state):
    """Vertical force of the rails on each wheel, N, shape (k, 2)."""
    equations(0.0, state)
    rows = equations.work.patches
    cosine, sine = np.cos(rows[..., reduction.ANGLE]), np.sin(rows[..., reduction.ANGLE])
    vertical = rows[..., reduction.NORMAL] * cosine + rows[..., reduction.FY] * sine
    return np.where(np.arange(rows.shape[2]) < equations.work.counts[..., None], vertical, 0.0).sum(axis=2)


def stand_on_rails(model, state, loads):
    """Move, lift and roll wheelsets that stand where rails are out of line, until their wheels carry their loads again.
    They stand in ``state``, changed in place, as on perfect rails; the path is taken as straight. Of ``loads`` (k, 2;
    left and right, N) each wheelset's mean is what both of its wheels get."""
    joints, track = model.joints._replace(equations=0), model.track._replace(path=tangent_path())
    bare = frictionless(model)._replace(elements=pack_elements(), joints=joints, track=track)
    equations, base, deviations = Equations(bare), model.contact.geometry.rail_distance, np.zeros((3, 4))
    for k, body in enumerate(model.bodies.wheelsets):
        at, load = STATE_SIZE * body, np.mean(loads[k])
        irregularity_at(track.irregularity, state[at], deviations)
        if deviations[0].any():
            state[at + 1] += 0.5 * (deviations[0, 0] + deviations[0, 2])
            carried = partial(_loads_when_lifted, equations, state, at, k, base)
            _lift(state, at, _lifts_for(carried, load, deviations[0, 1::2].copy()), base)


def _lift(state, at, lifts, base):
    """Lift the axle of a wheelset over the left and over the right rail, m."""
    state[at + 2] += 0.5 * (lifts[0] + lifts[1])
    euler, turn = slice(at + EULER, at + VELOCITY), np.array([0.5 * (lifts[0] - lifts[1]) / base, 0.0, 0.0])
    state[euler] = _turned(state[euler], turn)


def _loads_when_lifted(equations, state, at, k, base, lifts):
    """Loads (N) of the k-th wheelset's wheels at rest, shape (2,), with its ends lifted by ``lifts`` (m)."""
    lifted = state.copy()
    _lift(lifted, at, lifts, base)
    lifted[at + VELOCITY : at + STATE_SIZE] = 0.0
    return wheel_loads(equations, lifted)[k]


def _lifts_for(carried, load, lifts):
    """Lifts of both ends at which both wheels carry the load: Newton's method, lowering a wheel that hangs first."""
    for _ in range(100):
        missing = load - carried(lifts)
        if np.max(np.abs(missing)) < 1e-6 * load:
            break
        if np.max(missing) == load:
            lifts = lifts - 1e-4 * (missing == load)
            continue
        slopes = np.array([(load - carried(lifts + STEP * end) - missing) / STEP for end in np.eye(2)]).T
        lifts = lifts + np.clip(np.linalg.solve(slopes, -missing), -5e-5, 5e-5)
    return lifts
