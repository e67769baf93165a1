"""Static equilibrium: the vehicle rolls straight ahead at constant speed and all accelerations are zero.

The unknowns are small displacements of all bodies (three translations, three rotations in track axes) and the force
elements' internal states. A wheelset's rotation about its axle is no unknown, as its frame does not spin. Newton's
method solves for zero accelerations, without those of wheelsets about their axles. Displacements without stiffness,
such as those along the track, are not changed.
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
"""Step of the difference quotients, m and rad."""

RESIDUAL = 1e-9
"""Accelerations below this are taken as zero, m/s^2 and rad/s^2. Newton's method continues below it as long as a step
reduces the residual to less than a tenth, because soft motions in y and roll still change much at small residuals."""


NEAR, NOTHING_LEFT = 0.02, 0.01
"""Bounds for an equilibrium at a step of a force: length of the predicted Newton step, m and rad, and fraction of the
residual that the linear prediction does not remove."""


@dataclass(frozen=True)
class Equilibrium:
    """Static equilibrium of a vehicle: at rest relative to the moving frame."""

    state: np.ndarray
    wheel_loads: np.ndarray
    """(k, 2): vertical force of the rails on left and right wheels, N: wheelsets as in ``model.bodies.wheelsets``."""
    residual: float
    """Largest remaining acceleration, m/s^2 or rad/s^2, without those of wheelsets about their axles."""
    at_a_step: bool = False
    """Whether a residual comes from a step of a force: the linear prediction removes it within a move of `NEAR`."""


def displaced(state, model, displacements):
    """Return states (k, size) with displaced bodies.

    A row of ``displacements`` (k, 6 n + states) has each body's translation (m) and rotation vector (rad) in track
    axes, then changes of the elements' internal states (m).
    """
    n = len(model.bodies.mass)
    states = np.tile(state, (len(displacements), 1))
    parts = states[:, : STATE_SIZE * n].reshape(-1, n, STATE_SIZE)
    place = displacements[:, : 6 * n].reshape(-1, n, 6)
    parts[..., :3] += place[..., :3]
    parts[..., EULER:VELOCITY] = _turned(parts[..., EULER:VELOCITY], place[..., 3:])
    states[:, STATE_SIZE * n :] += displacements[:, 6 * n :]
    return states


def _turned(p, turn):
    """Return Euler parameters (..., 4) after a further rotation by a rotation vector (..., 3) in track axes."""
    angle = np.linalg.norm(turn, axis=-1)
    scale = 0.5 * np.sinc(0.5 * angle / np.pi)
    a0, (a1, a2, a3), (e0, e1, e2, e3) = np.cos(0.5 * angle), scale * np.moveaxis(turn, -1, 0), np.moveaxis(p, -1, 0)
    turned = np.stack([
        a0 * e0 - a1 * e1 - a2 * e2 - a3 * e3, a0 * e1 + a1 * e0 + a2 * e3 - a3 * e2,
        a0 * e2 + a2 * e0 + a3 * e1 - a1 * e3, a0 * e3 + a3 * e0 + a1 * e2 - a2 * e1,
    ], axis=-1)  # fmt: skip
    return turned / np.linalg.norm(turned, axis=-1, keepdims=True)


def _unknowns(model):
    """Return the mask (6 n + states,) of unknown displacements: all except wheelsets' rotations about their axles."""
    unknown = np.ones(6 * len(model.bodies.mass) + internal_states(model), bool)
    unknown[6 * np.flatnonzero(model.bodies.spins) + 4] = False
    return unknown


def _accelerations(rates, model):
    """Return rows of accelerations, six per body, and rates of elements' internal states, from rows of state rates."""
    n = len(model.bodies.mass)
    bodies = rates[:, : STATE_SIZE * n].reshape(len(rates), n, STATE_SIZE)[:, :, VELOCITY:].reshape(len(rates), 6 * n)
    return np.hstack([bodies, rates[:, STATE_SIZE * n :]])


def solve_equilibrium(model, state, iterations=50):
    """Solve for the `Equilibrium` on a tangent track by Newton's method from a nearby state.

    In that state all bodies move ahead at the frame's speed, and the wheels nearly touch the rails or are pressed onto
    them. A large ``residual`` means that no equilibrium was found.
    """
    model = model._replace(beta=model.beta or 1.0)  # without feedback a violated joint has no residual
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
        weights = 1.0 / np.maximum(largest, 1e-9 * np.max(largest))  # rows of zeros have no force
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
    """Return the state after the longest of step, half, quarter, ... that reduces the residual; None if none does."""
    for halvings in range(12):
        new = displaced(state, model, step[None, :] * 0.5**halvings)[0]
        rates = equations.at(0.0, new[None, :], WARM)
        if np.max(np.abs(_accelerations(rates, model)[:, _unknowns(model)])) < residual:
            return new
    return None


def wheel_loads(equations, state):
    """Return the vertical force of the rails on each wheel, N, shape (k, 2): left and right."""
    equations(0.0, state)
    rows = equations.work.patches
    cosine, sine = np.cos(rows[..., reduction.ANGLE]), np.sin(rows[..., reduction.ANGLE])
    vertical = rows[..., reduction.NORMAL] * cosine + rows[..., reduction.FY] * sine
    return np.where(np.arange(rows.shape[2]) < equations.work.counts[..., None], vertical, 0.0).sum(axis=2)


def stand_on_rails(model, state, loads):
    """Move, lift and roll wheelsets on irregular rails until their wheels carry their loads, in place.

    In the given ``state`` the wheelsets stand as on perfect rails; the path is taken as straight. Both wheels of a
    wheelset get the mean of its ``loads`` (k, 2; left and right, N).
    """
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
    """Lift the axle of a wheelset over the left and the right rail by ``lifts`` (2,), m, in place."""
    state[at + 2] += 0.5 * (lifts[0] + lifts[1])
    euler, turn = slice(at + EULER, at + VELOCITY), np.array([0.5 * (lifts[0] - lifts[1]) / base, 0.0, 0.0])
    state[euler] = _turned(state[euler], turn)


def _loads_when_lifted(equations, state, at, k, base, lifts):
    """Return the loads (2,) of the k-th wheelset's wheels at rest, N, with its ends lifted by ``lifts`` (2,), m."""
    lifted = state.copy()
    _lift(lifted, at, lifts, base)
    lifted[at + VELOCITY : at + STATE_SIZE] = 0.0
    return wheel_loads(equations, lifted)[k]


def _lifts_for(carried, load, lifts):
    """Return lifts (2,) of both ends, m, at which both wheels carry the load: Newton's method.

    A wheel without contact is lowered first, by 0.1 mm at a time.
    """
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
