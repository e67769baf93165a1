"""Steady running in a constant curve: a motion that is constant in axes which rotate with the vehicle.

The path is an infinite circle (or, without curvature, a straight line with cant). In steady running (the balance) the
vehicle rotates about the circle's centre like a rigid body, and its wheelsets spin. The unknowns are the positions of
all bodies, the spins and the force elements' internal states. The residual is the difference of accelerations and
internal states' rates from those of the rotation. A vehicle has no drive here: creep decelerates it in a curve, all its
velocities in proportion. This common acceleration is an unknown, too, unless elements are connected to the moving
frame, which then pulls the vehicle.

Each balance is computed from the preceding one by Broyden's method. The Jacobian is computed once by differences,
updated in each step and kept from one curve to the next, until a step reduces the residual too little (C. G. Broyden,
Math. Comp. 19 (1965) 577-593).

States here are those of a tangent track: positions, rotations and spins in the track axes at the body, x its arc
length. :func:`on_circle` transforms them to the curve.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wrcore.balance.linear import RANK, moved_states
from wrcore.bodies.body import EULER, OMEGA, STATE_SIZE, VELOCITY
from wrcore.bodies.marker import FRAME
from wrcore.contact.search.reduction import MAX_PATCHES
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.model import independent_at, internal_states
from wrcore.geometry.irregularity import no_irregularity
from wrcore.geometry.path import PathData
from wrcore.geometry.path_pieces import CANT_BASE, COLUMNS, CURVATURE, ROLL, WIDENING, X
from wrcore.kernels.handles import Handle
from wrcore.track.track import TrackModel

STEP, SPIN_STEP, SLOWING_STEP = 1e-7, 1e-6, 1e-3
"""Steps of the difference quotients in positions (m, rad), spins (rad/s) and the common acceleration (m/s^2)."""

MOST_STEPS, HALVINGS = 40, 12
"""Largest number of steps for one balance, and of trial lengths of a step with a new Jacobian, each half of the
preceding."""

MISLED = 0.5
"""If a step reduces the residual to more than this fraction of its value, a new Jacobian is computed."""

LAST_STEP, LAST_LEFT = 1e-7, 1e-6
"""Bounds of the last step (m, rad, rad/s, m/s^2) and the last residual (m/s^2, rad/s^2); Broyden's method ends when
both are below them."""

LEAST_PART = 2.0**-8
"""Smallest part of the difference between two curves that is used as one continuation step."""

FAR, STRAIGHT = np.array([1e-3, 0.1, 0.01, 10.0]), 0.1
"""Scales of differences between curves (1/m, m, m, m/s), and the largest relative change of direction between two
continuation steps at which the preceding move is extrapolated."""


class Curve(NamedTuple):
    """A curve of infinite length and the speed of the vehicle."""

    curvature: float  # 1/m, positive to the left
    cant: float  # m over `CANT_BASE`, right rail higher
    widening: float  # m
    speed: float  # m/s

    def towards(self, other, part):
        """Return the curve between this one (``part`` = 0) and another one (``part`` = 1), by linear interpolation."""
        return Curve(*((1.0 - part) * a + part * b for a, b in zip(self, other, strict=True)))


@dataclass(frozen=True)
class CurveBalance:
    """Steady running in a curve."""

    curve: Curve
    state: np.ndarray
    """State in the coordinates of a tangent track; see :func:`on_circle`."""
    acceleration: float
    """Common acceleration of all velocities along the track, m/s^2; negative if creep decelerates the vehicle."""
    residual: float
    """Largest residual of accelerations and rates (m/s^2, rad/s^2, m/s)."""
    patches: np.ndarray
    """(k, 2, MAX_PATCHES, PATCH_COLUMNS): patches of the wheelsets' left and right wheels, NaN where absent."""
    way: np.ndarray
    """(4,): difference from the curve of the preceding balance, in units of ``FAR``."""
    moves: np.ndarray
    """(unknowns,): change of the unknowns from the preceding balance."""


def straight_balance(model, state):
    """Return a static equilibrium ``state`` as the `CurveBalance` of straight track."""
    straight, nothing = Curve(0.0, 0.0, 0.0, float(model.speed)), np.zeros(0)
    return CurveBalance(straight, state, 0.0, 0.0, nothing, np.zeros(4), nothing)


def on_circle(model, curve, states):
    """Return states (k, size) that rotate about the curve's centre at its speed, from states on a tangent track."""
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
    """Rotate the attitudes and angular velocities of bodies (..., 13) about an axis by ``angle`` (rad), in place."""
    c, s, i, j = np.cos(0.5 * angle), np.sin(0.5 * angle), (axis + 1) % 3, (axis + 2) % 3
    p, w = parts[..., EULER:VELOCITY].copy(), parts[..., OMEGA:].copy()
    parts[..., EULER] = c * p[..., 0] - s * p[..., 1 + axis]
    parts[..., EULER + 1 + axis] = c * p[..., 1 + axis] + s * p[..., 0]
    parts[..., EULER + 1 + i] = c * p[..., 1 + i] - s * p[..., 1 + j]
    parts[..., EULER + 1 + j] = c * p[..., 1 + j] + s * p[..., 1 + i]
    parts[..., OMEGA + i] = np.cos(angle) * w[..., i] - np.sin(angle) * w[..., j]
    parts[..., OMEGA + j] = np.cos(angle) * w[..., j] + np.sin(angle) * w[..., i]


class Slopes(NamedTuple):
    """Jacobian of the residual with respect to the unknowns, inverted and scaled."""

    inverse: np.ndarray  # (unknowns, rows): pseudo-inverse of the Jacobian
    weights: np.ndarray  # (rows,): factors with which each row's largest derivative is 1
    scales: np.ndarray  # (unknowns,): square of the largest weighted derivative with respect to each unknown

    def size(self, left):
        """Return the maximum norm of a residual ``left`` (rows,), weighted."""
        return np.max(np.abs(self.weights * left))

    def learned(self, step, change):
        """Return the slopes after Broyden's update: the smallest change of the Jacobian that maps step to change."""
        along = (self.scales * step) @ self.inverse
        return self._replace(inverse=self.inverse + np.outer(step - self.inverse @ change, along) / (along @ change))


class Turning:
    """Solver for steady running of a model on infinite curves without irregularity; it keeps its Jacobian.

    ``aside`` is that of `wrcore.geometry.path.PathData`.
    """

    def __init__(self, model, aside=0.0):
        self.row = np.zeros((1, COLUMNS))  # the equations read the curve from this row
        self.row[0, X + 1] = 1.0
        path = PathData(self.row, np.array([-np.inf]), np.zeros(1, np.int64), 0.0, 1.0, aside)
        track = TrackModel(False, path, no_irregularity())
        self.model = model._replace(beta=model.beta or 1.0, track=track)
        self.equations, self.curve, self.slopes = Equations(self.model), None, None
        n, spins = len(model.bodies.mass), 6 * np.flatnonzero(model.bodies.spins) + 4
        places = np.delete(np.arange(6 * n), spins)
        self.columns = np.concatenate([places, 6 * n + spins, 12 * n + np.arange(internal_states(model))])
        self.steps = np.full(len(self.columns) + 1, STEP)
        self.steps[len(places) : len(places) + len(spins)], self.steps[-1] = SPIN_STEP, SLOWING_STEP
        if np.any(model.elements.pairs[:, 1] == FRAME):
            self.steps = self.steps[:-1]  # the frame pulls

    def enter(self, curve):
        """Set curve and speed of the equations; scale the Jacobian's spin columns with the speed."""
        row = self.row[0]
        row[CURVATURE], row[ROLL], row[WIDENING] = curve.curvature, -curve.cant / CANT_BASE, curve.widening
        kernel, handle, work = self.equations.arguments
        faster, self.curve = curve.speed / handle.value.speed, curve
        if faster != 1.0:
            self.equations.arguments = kernel, Handle(handle.value._replace(speed=curve.speed)), work
            if self.slopes is not None:  # creepages are velocities over the speed
                spins = self.steps[: len(self.columns)] == SPIN_STEP
                ratio = np.where(np.append(spins, [False] * (len(self.steps) - len(spins))), faster, 1.0)
                inverse, scales = self.slopes.inverse * ratio[:, None], self.slopes.scales / ratio**2
                self.slopes = self.slopes._replace(inverse=inverse, scales=scales)

    def moved(self, state, acceleration, moves):
        """Return states (k, size) and accelerations (k,) after changes ``moves`` (k, unknowns) of the unknowns."""
        rows = np.zeros((len(moves), 12 * len(self.model.bodies.mass) + internal_states(self.model)))
        rows[:, self.columns] = moves[:, : len(self.columns)]
        slowed = moves[:, -1] if len(self.steps) > len(self.columns) else 0.0
        return moved_states(self.model, state, rows), acceleration + slowed * np.ones(len(moves))

    def left(self, states, accelerations):
        """Return the residual (k, 6 n + states): accelerations and internal states' rates less those of the rotation.

        The rotation about the curve's centre has the common acceleration ``accelerations`` (k,), m/s^2.
        """
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

    def _begin(self, known, curve, straight_on):
        """Return the starting point for the next balance: way (4,), moves, state (size,) and acceleration (m/s^2).

        Way and moves (see `CurveBalance`) are differences from the ``known`` balance; with ``straight_on`` the known
        moves are extrapolated.
        """
        way, moves = np.subtract(curve, known.curve) / FAR, np.zeros(len(self.steps))
        ratio = (way @ known.way) / (known.way @ known.way)
        if straight_on and ratio > 0.0 and np.linalg.norm(way - ratio * known.way) < STRAIGHT * np.linalg.norm(way):
            moves = ratio * known.moves
        state = known.state.copy()
        omegas = state[: STATE_SIZE * len(self.model.bodies.mass)].reshape(-1, STATE_SIZE)[:, OMEGA:]
        omegas *= curve.speed / known.curve.speed
        states, accelerations = self.moved(state, known.acceleration, moves[None])
        return way, moves, states[0], accelerations[0]

    def balance(self, known, curve, straight_on):
        """Return the `CurveBalance` of a curve, iterated from the ``known`` balance of another curve.

        With ``straight_on`` the iteration starts from an extrapolation of the last change.
        """
        way, moves, state, acceleration = self._begin(known, curve, straight_on)
        self.enter(curve)
        left = self.left(state[None], np.array([acceleration]))[0]
        for _ in range(MOST_STEPS):
            fresh = self.slopes is None
            try:
                slopes = self._fresh_slopes(state, acceleration, left) if fresh else self.slopes
            except np.linalg.LinAlgError:  # the iteration has diverged to values that are not finite
                left = np.full_like(left, np.inf)
                break
            step, size, part = -slopes.inverse @ left, slopes.size(left), 2.0
            for _ in range(HALVINGS if fresh else 1):
                part *= 0.5
                states, tried = self.moved(state, acceleration, part * step[None])
                new = self.left(states, tried)[0]
                if slopes.size(new) < (1.0 - 0.1 * part) * size:
                    break
            else:
                self.slopes = None
                if fresh:
                    self.left(state[None], np.array([acceleration]))  # fills the patches of this state
                    break
                continue
            misled = slopes.size(new) > MISLED * size
            self.slopes = None if misled else slopes.learned(part * step, new - left)
            state, acceleration, left, moves = states[0], tried[0], new, moves + part * step
            if np.max(np.abs(left)) < LAST_LEFT and np.max(np.abs(part * step)) < LAST_STEP:
                break
        absent = np.arange(MAX_PATCHES) >= self.equations.work.counts[..., None]
        patches = np.where(absent[..., None], np.nan, self.equations.work.patches)
        residual = float(np.max(np.abs(left)))
        return CurveBalance(curve, state, float(acceleration), residual, patches, way, moves)

    def _fresh_slopes(self, state, acceleration, left):
        """Return `Slopes` computed by differences in all unknowns."""
        moved = self.left(*self.moved(state, acceleration, np.diag(self.steps)))
        slopes = ((moved - left) / self.steps[:, None]).T
        largest = np.max(np.abs(slopes), axis=1)
        weights = 1.0 / np.maximum(largest, 1e-9 * np.max(largest))  # rows of zeros have no force
        slopes *= weights[:, None]
        return Slopes(np.linalg.pinv(slopes, RANK * 1e-2) * weights, weights, np.max(np.abs(slopes), axis=0) ** 2)


@np.errstate(all="ignore")  # an overflow is no balance
def solve_curve(turning, known, curve, limit):
    """Return the `CurveBalance` of a curve, from the ``known`` balance of another curve.

    It is solved directly or through intermediate curves, whose distance is halved until the iteration converges. A
    ``residual`` above the limit (m/s^2) means that no balance was found; the result is then the last curve tried.
    """
    reached, part, straight_on, before = 0.0, 1.0, True, known
    while reached < 1.0:
        target = known.curve.towards(curve, min(reached + part, 1.0))
        found = turning.balance(before, target, straight_on)
        if found.residual < limit:
            before, reached, part = found, reached + part, 2.0 * part
        elif straight_on:
            straight_on = False
        elif part > LEAST_PART:
            part *= 0.5
        else:
            return found
    return before
