"""Steady running in a constant curve: what stays the same in axes that go round with the vehicle.

The path is one circle without end (or, without curvature, a straight line with cant). In its balance the vehicle turns
about the circle's centre like a rigid body, and its wheelsets spin as well. Unknown are the places of all bodies, the
spins and the force elements' internal states. The residual is what accelerations and internal states' rates are left
beside those of the turn. Nothing drives a vehicle: creep slows it down in a curve, all its velocities in proportion.
This common acceleration is an unknown, too, unless elements lead to the moving frame, which then pulls.

States here are those of a tangent track: places, rotations and spins in the axes of the track where a body is, x its
arc length. :func:`on_circle` lays them along the curve.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wrcore.balance.equilibrium import RESIDUAL
from wrcore.balance.linear import RANK, moved_states
from wrcore.dynamics.body import EULER, OMEGA, STATE_SIZE, VELOCITY
from wrcore.dynamics.marker import FRAME
from wrcore.dynamics.system import Equations, independent_at, internal_states
from wrcore.dynamics.track import TrackModel
from wrcore.geometry.irregularity import no_irregularity
from wrcore.geometry.path import PathData
from wrcore.geometry.path_pieces import CANT_BASE, COLUMNS, CURVATURE, ROLL, WIDENING, X

STEP, SPIN_STEP, SLOWING_STEP = 1e-7, 1e-6, 1e-3
"""Of the difference quotients in places (m, rad), spins (rad/s) and the common acceleration (m/s^2)."""

MOST_STEPS, HALVINGS = 40, 12
"""Newton's steps towards one balance, and how often each is halved."""

LEAST_PART = 2.0**-8
"""Part of the way between two curves below which the way is not divided any more."""


class Curve(NamedTuple):
    """A curve without end, and the speed in it."""

    curvature: float  # 1/m, positive to the left
    cant: float  # m over `CANT_BASE`, right rail higher
    widening: float  # m
    speed: float  # m/s

    def towards(self, other, part):
        """The curve a part of the way to another one."""
        return Curve(*((1.0 - part) * a + part * b for a, b in zip(self, other, strict=True)))


@dataclass(frozen=True)
class CurveBalance:
    """Steady running in a curve."""

    curve: Curve
    state: np.ndarray
    """As on a tangent track; see :func:`on_circle`."""
    acceleration: float
    """Common one of all velocities, along the track, m/s^2: negative where creep slows the vehicle down."""
    residual: float
    """Largest acceleration or rate left (m/s^2, rad/s^2, m/s)."""


def curve_model(model, curve, aside=0.0):
    """The model on a curve without end, perfect; ``aside`` is that of `wrcore.geometry.path.PathData`."""
    row = np.zeros((1, COLUMNS))
    row[0, X + 1] = 1.0
    row[0, CURVATURE], row[0, ROLL], row[0, WIDENING] = curve.curvature, -curve.cant / CANT_BASE, curve.widening
    path = PathData(row, np.array([-np.inf]), np.zeros(1, np.int64), 0.0, 1.0, aside)
    return model._replace(track=TrackModel(False, path, no_irregularity()), speed=curve.speed)


def on_circle(model, curve, states):
    """States (k, size) that turn about the curve's centre at its speed, from those as on a tangent track."""
    n, out = len(model.bodies.mass), states.copy()
    parts = out[:, : STATE_SIZE * n].reshape(len(states), n, STATE_SIZE)
    roll, bend, speed = -np.arcsin(curve.cant / CANT_BASE), curve.curvature, curve.speed
    s, y, z = (parts[..., i].copy() for i in range(3))
    heading, aside = bend * s, y * np.cos(roll) - z * np.sin(roll)
    parts[..., 0] = s * np.sinc(heading / np.pi) - np.sin(heading) * aside
    parts[..., 1] = 0.5 * bend * s**2 * np.sinc(0.5 * heading / np.pi) ** 2 + np.cos(heading) * aside
    parts[..., 2] = y * np.sin(roll) + z * np.cos(roll)
    for angle, axis in ((roll, 0), (heading, 2)):
        _turn(parts, angle, axis)
    parts[..., VELOCITY], parts[..., VELOCITY + 1] = speed * (1.0 - bend * parts[..., 1]), speed * bend * parts[..., 0]
    parts[..., VELOCITY + 2] = 0.0
    parts[..., OMEGA + 2] += speed * bend
    return out


def _turn(parts, angle, axis):
    """Turn rotations and angular velocities of bodies (..., 13) about an axis, in place."""
    c, s, i, j = np.cos(0.5 * angle), np.sin(0.5 * angle), (axis + 1) % 3, (axis + 2) % 3
    p, w = parts[..., EULER:VELOCITY].copy(), parts[..., OMEGA:].copy()
    parts[..., EULER] = c * p[..., 0] - s * p[..., 1 + axis]
    parts[..., EULER + 1 + axis] = c * p[..., 1 + axis] + s * p[..., 0]
    parts[..., EULER + 1 + i] = c * p[..., 1 + i] - s * p[..., 1 + j]
    parts[..., EULER + 1 + j] = c * p[..., 1 + j] + s * p[..., 1 + i]
    parts[..., OMEGA + i] = np.cos(angle) * w[..., i] - np.sin(angle) * w[..., j]
    parts[..., OMEGA + j] = np.cos(angle) * w[..., j] + np.sin(angle) * w[..., i]


class _Turning:
    """What is left of accelerations in a curve, and how moves change it."""

    def __init__(self, model, curve, aside):
        self.model = curve_model(model._replace(beta=model.beta or 1.0), curve, aside)
        self.curve, self.equations = curve, Equations(self.model)
        n, spins = len(model.bodies.mass), 6 * np.flatnonzero(model.bodies.spins) + 4
        places = np.delete(np.arange(6 * n), spins)
        self.columns = np.concatenate([places, 6 * n + spins, 12 * n + np.arange(internal_states(model))])
        self.steps = np.full(len(self.columns) + 1, STEP)
        self.steps[len(places) : len(places) + len(spins)], self.steps[-1] = SPIN_STEP, SLOWING_STEP
        if np.any(model.elements.pairs[:, 1] == FRAME):
            self.steps = self.steps[:-1]  # the frame pulls

    def moved(self, state, acceleration, moves):
        """States (k, size) and accelerations (k,) after moves (k, unknowns)."""
        rows = np.zeros((len(moves), 12 * len(self.model.bodies.mass) + internal_states(self.model)))
        rows[:, self.columns] = moves[:, : len(self.columns)]
        slowed = moves[:, -1] if len(self.steps) > len(self.columns) else 0.0
        return moved_states(self.model, state, rows), acceleration + slowed * np.ones(len(moves))

    def left(self, states, accelerations):
        """Accelerations and internal states' rates (k, 6 n + states) beside those of a steady turn that slows down."""
        n, bodies = len(self.model.bodies.mass), self.model.bodies
        turning = on_circle(self.model, self.curve, states)
        self.equations.work.arc_lengths[:] = states[0, STATE_SIZE * bodies.wheelsets]
        rates = self.equations.at(0.0, turning)
        speeds, left = (a[:, : STATE_SIZE * n].reshape(-1, n, STATE_SIZE)[..., VELOCITY:] for a in (turning, rates))
        turn, slowing = self.curve.curvature * self.curve.speed, accelerations[:, None] / self.curve.speed
        left = left - slowing[..., None] * speeds
        left[..., 0::3] += turn * speeds[..., 1::3]
        left[..., 1::3] -= turn * speeds[..., 0::3]
        inner = rates[:, STATE_SIZE * n :].copy()
        for j in range(len(bodies.independent)):
            at = independent_at(bodies, j)
            inner[:, at - STATE_SIZE * n] -= slowing[:, 0] * turning[:, at]
        return np.hstack([left.reshape(len(states), -1), inner])


def _solve(turning, state, acceleration):
    """Newton's method from a state: `CurveBalance` of the best one that it finds. Slopes serve again for as long as a
    step leaves less than a tenth."""
    slopes, steps = None, turning.steps
    left = turning.left(state[None], np.array([acceleration]))[0]
    for _ in range(MOST_STEPS):
        if slopes is None:
            moved = turning.left(*turning.moved(state, acceleration, np.diag(steps)))
            slopes = ((moved - left) / steps[:, None]).T
            largest = np.max(np.abs(slopes), axis=1)
            weights = 1.0 / np.maximum(largest, 1e-9 * np.max(largest))  # nothing acts in a row of zeros
            inverse = np.linalg.pinv(weights[:, None] * slopes, RANK * 1e-2)
        size = np.max(np.abs(weights * left))
        step = inverse @ (-weights * left)
        for halving in range(HALVINGS):
            states, tried = turning.moved(state, acceleration, 0.5**halving * step[None])
            new = turning.left(states, tried)[0]
            if np.max(np.abs(weights * new)) < (1.0 - 0.1 * 0.5**halving) * size:
                break
        else:
            break
        part = np.max(np.abs(weights * new)) / size
        state, acceleration, left = states[0], tried[0], new
        if np.max(np.abs(left)) < RESIDUAL or part > 0.1 and np.max(np.abs(left)) < 1e2 * RESIDUAL:
            break
        slopes = slopes if part < 0.1 else None
    return CurveBalance(turning.curve, state, float(acceleration), float(np.max(np.abs(left))))


@np.errstate(all="ignore")  # what overflows is no balance
def solve_curve(model, known, curve, limit, aside=0.0):
    """The `CurveBalance` of a curve, from that of another: directly, or by way of curves between both, as near to each
    other as it takes. A ``residual`` above the limit (m/s^2) means that none was found; it is then of the last curve
    tried."""
    reached, part = 0.0, 1.0
    before = known
    while reached < 1.0:
        target = known.curve.towards(curve, min(reached + part, 1.0))
        faster = before.state.copy()
        omegas = faster[: STATE_SIZE * len(model.bodies.mass)].reshape(-1, STATE_SIZE)[:, OMEGA:]
        omegas *= target.speed / before.curve.speed
        found = _solve(_Turning(model, target, aside), faster, before.acceleration)
        if found.residual < limit:
            before, reached, part = found, reached + part, 2.0 * part
        elif part > LEAST_PART:
            part *= 0.5
        else:
            return found
    return before
