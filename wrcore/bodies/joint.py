"""Joints as constraint equations Phi(q, t) = 0 with their Jacobian D and right-hand side gamma of Eq. (8).

Velocities are v = (r', w) per body in track axes. The velocity constraint is Phi' = D v + dPhi/dt, the acceleration
constraint is D v' = gamma. A joint connects a marker of body i, at the arm s_i from its centre, to one of body j. With

    d = r_i + s_i - r_j - s_j,   d' = r_i' + w_i x s_i - r_j' - w_j x s_j,
    d'' = r_i'' + w_i' x s_i - r_j'' - w_j' x s_j + c,   c = w_i x (w_i x s_i) - w_j x (w_j x s_j)

the blocks of D for the two bodies are D_i = [S, R_i] and D_j = -[S, R_j] in every joint below:

*coordinate*: coordinate k of the marker follows the moving frame, which is body j; for example a constant speed.
    Phi = e_k . d.  S = e_k^T, R = (s x e_k)^T, since e_k . (w x s) = w . (s x e_k).  gamma = -e_k . c.
*spherical*: the markers coincide.
    Phi = d.  S = I, R = -s~ (s~ x = s x x).  gamma = -c.
*revolute*: the equations of *spherical*, and the bodies share an axis e, column k of the rotation matrix of body i;
    a, b are the other two columns of body j.
    Phi_4 = e . a, Phi_4' = (w_i x e) . a + e . (w_j x a) = (w_i - w_j) . n with n = e x a.
    S = 0, R_i = R_j = n^T.  gamma_4 = -(w_i - w_j) . n'; with n' = (w_i x e) x a + e x (w_j x a) and W = w_i - w_j
    gamma_4 = -(W . e)(w_i . a) + (W . a)(w_j . e) + (W . W) Phi_4.  Phi_5 is this equation with b.
*no_turn*: the bodies do not rotate relative to each other about axis k: only the equation above, with e column k + 1
    of body i and a column k + 2 of body j.  S = 0. Together with a revolute joint about k it joins the bodies rigidly.
*rigid_link*: a rod without mass keeps the markers at the distance L; lambda is its tension.
    Phi = |d| - L, u = d / |d|.  S = u^T, R = (s x u)^T.  gamma = -u . c - (d' . d' - (u . d')^2) / |d|.

A wheelset's frame does not spin with the wheelset. Only its y axis, the axle, rotates with w, e' = w x e. A joint may
therefore use this axis and markers on it, but no other direction. A wheelset is body i of a revolute joint about y.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.bodies.body import OMEGA, STATE_SIZE
from wrcore.bodies.joint_order import JointOrder, order_joints
from wrcore.bodies.marker import FRAME, marker_motion
from wrcore.bodies.vector import cross, dot, load, minus, store
from wrcore.errors import InputError
from wrcore.kernels.jit import jit

COORDINATE, SPHERICAL, REVOLUTE, RIGID_LINK, NO_TURN = 0, 1, 2, 3, 4
KINDS = {
    "coordinate": COORDINATE, "spherical": SPHERICAL, "revolute": REVOLUTE, "rigid_link": RIGID_LINK,
    "no_turn": NO_TURN,
}  # fmt: skip
EQUATIONS = {"coordinate": 1, "spherical": 3, "revolute": 5, "rigid_link": 1, "no_turn": 1}
MOST_EQUATIONS = 5

ON_AXLE = 1e-9
"""Largest distance of a wheelset's marker from the axle, m."""

SHORTEST_LINK = 1e-3
"""Smallest length of a rigid link, m; a link without length has no direction."""


class Joint(NamedTuple):
    """Description of one joint, before it is checked and ordered by `build_joints`."""

    name: str
    kind: str
    """Kind of the joint, a key of KINDS."""
    bodies: tuple
    """Numbers of the two bodies; FRAME stands for the moving frame."""
    markers: np.ndarray
    """Point of the joint in the axes of each body, (2, 3), m; for the moving frame relative to its origin."""
    axis: int = 0
    """Axis 0, 1 or 2. For coordinate a track axis; for revolute and no_turn an axis of both bodies, whose axes are
    parallel in nominal position."""
    length: float = 0.0
    """Length of a rigid link, m."""


class Joints(NamedTuple):
    """All joints of a model as arrays for kernels, in the order of the solver."""

    kind: np.ndarray  # (n,) int
    bodies: np.ndarray
    """(n, 2) int: first and second body. FRAME can only be the second; a wheelset in a revolute joint is the first."""
    markers: np.ndarray  # (n, 2, 3): marker positions in body axes, m
    axis: np.ndarray  # (n,) int
    length: np.ndarray  # (n,), m
    size: np.ndarray  # (n,) int: number of equations of each joint
    listed: np.ndarray  # (n,) int: index of each joint in the list passed to :func:`build_joints`
    equations: int  # total number of constraint equations
    order: JointOrder


def build_joints(items, spins, source="joints"):
    """Check joints and return them as `Joints`, with the structure of the solver's matrix.

    ``spins`` (bodies,) is 1 for wheelsets, whose frames do not spin with them. An InputError names ``source`` and the
    joint."""
    items = [_checked(item, spins, f"joints.{item.name}", source) for item in items]
    size = np.array([EQUATIONS[item.kind] for item in items], np.int64)
    order, listed = order_joints([item.bodies for item in items], size)
    items = [items[k] for k in listed]
    n = len(items)
    return Joints(
        np.array([KINDS[item.kind] for item in items], np.int64),
        np.array([item.bodies for item in items], np.int64).reshape(n, 2),
        np.array([item.markers for item in items], float).reshape(n, 2, 3),
        np.array([item.axis for item in items], np.int64), np.array([item.length for item in items], float),
        size[listed], listed, int(size.sum()), order,
    )  # fmt: skip


def _checked(item, spins, field, source):
    """Check one joint and return it with its bodies in the order that kernels expect."""
    item = item._replace(bodies=tuple(int(body) for body in item.bodies))
    if item.bodies[0] == item.bodies[1]:
        raise InputError(source, f"{field}.bodies", "expected two different bodies")
    turns = [body != FRAME and bool(spins[body]) for body in item.bodies]
    if item.kind == "revolute" and any(turns):
        if all(turns):
            raise InputError(source, f"{field}.bodies", "expected one wheelset at most in a revolute joint")
        if item.axis != 1:
            raise InputError(source, f"{field}.axis", "expected y, the axle, for a revolute joint of a wheelset")
    if item.kind == "no_turn" and any(turns):
        raise InputError(source, f"{field}.bodies", "expected no wheelset, which turns, in a rigid joint")
    for turn, marker in zip(turns, item.markers, strict=True):
        if turn and max(abs(marker[0]), abs(marker[2])) > ON_AXLE:
            raise InputError(source, f"{field}.at", "expected a point on the wheelset's axle")
    if item.kind == "rigid_link" and not item.length >= SHORTEST_LINK:
        raise InputError(source, f"{field}.at", f"expected two points at least {SHORTEST_LINK:g} m apart")
    if item.bodies[0] == FRAME or (item.kind == "revolute" and turns[1]):
        item = item._replace(bodies=item.bodies[::-1], markers=item.markers[::-1])
    if item.kind == "coordinate" and item.bodies[1] != FRAME:
        raise InputError(source, f"{field}.bodies", "expected a body and the moving frame")
    return item


class JointState(NamedTuple):
    """Constraint values and Jacobian blocks of all joints at one state. Rows beyond a joint's equations are zero."""

    phi: np.ndarray  # (n, 5): constraint Phi, m or rad
    rate: np.ndarray  # (n, 5): its rate Phi', m/s or rad/s
    gamma: np.ndarray  # (n, 5): right-hand side of D v' = gamma
    along: np.ndarray  # (n, 5, 3): block S of D, for the velocities of both bodies
    about: np.ndarray  # (n, 2, 5, 3): blocks R of D, for the angular velocities of the first and the second body


def joint_state(joints):
    """Allocate a `JointState` and fill the rows of S that are constant."""
    n = len(joints.kind)
    along = np.zeros((n, MOST_EQUATIONS, 3))
    for k in range(n):
        if joints.kind[k] in (SPHERICAL, REVOLUTE):
            along[k, :3] = np.eye(3)
        elif joints.kind[k] == COORDINATE:
            along[k, 0, joints.axis[k]] = 1.0
    rows = (np.zeros((n, MOST_EQUATIONS)) for _ in range(3))
    return JointState(*rows, along, np.zeros((n, 2, MOST_EQUATIONS, 3)))


def joint_jacobian(joints, values, bodies):
    """Return the constraint Jacobian D (equations, bodies, 6) of all joints, from the result of `evaluate_joints`.

    The rows are in the order of the joints. Linearisation and tests use this matrix; the solver does not form it."""
    blocks = []
    for k, size in enumerate(joints.size):
        block = np.zeros((size, bodies, 6))
        for body, about, sign in zip(joints.bodies[k], values.about[k], (1.0, -1.0), strict=True):
            if body != FRAME:
                block[:, body] = sign * np.hstack([values.along[k], about])[:size]
        blocks.append(block)
    return np.concatenate([np.zeros((0, bodies, 6)), *blocks])


@jit(allocates=False, forceinline=True)
def evaluate_joints(joints, t, speed, state, rotations, out):
    """Fill a `JointState` with all constraints at a state; ``rotations`` (bodies + 1, 3, 3) end with the identity."""
    mark = joints.markers
    for k in range(joints.kind.shape[0]):
        kind, i, j = joints.kind[k], joints.bodies[k, 0], joints.bodies[k, 1]
        p, s, v = marker_motion(speed, t, state, rotations, i, mark[k, 0, 0], mark[k, 0, 1], mark[k, 0, 2])
        q, z, u = marker_motion(speed, t, state, rotations, j, mark[k, 1, 0], mark[k, 1, 1], mark[k, 1, 2])
        distance, speeds = minus(p, q), minus(v, u)
        wi, wj = _angular_velocity(state, i), _angular_velocity(state, j)
        c = minus(_centripetal(wi, s), _centripetal(wj, z))
        if kind == SPHERICAL or kind == REVOLUTE:
            for row in range(3):
                out.phi[k, row], out.rate[k, row], out.gamma[k, row] = distance[row], speeds[row], -c[row]
            _point_rows(s, out.about[k, 0])
            _point_rows(z, out.about[k, 1])
            if kind == REVOLUTE:
                axis = joints.axis[k]
                _axis_row(rotations[i], rotations[j], axis, (axis + 1) % 3, wi, wj, k, 3, out)
                _axis_row(rotations[i], rotations[j], axis, (axis + 2) % 3, wi, wj, k, 4, out)
        elif kind == NO_TURN:
            axis = joints.axis[k]
            _axis_row(rotations[i], rotations[j], (axis + 1) % 3, (axis + 2) % 3, wi, wj, k, 0, out)
        else:
            along, curvature = out.along[k, 0], 0.0
            out.phi[k, 0] = distance[joints.axis[k]]
            if kind == RIGID_LINK:
                length = math.sqrt(dot(distance, distance))
                out.phi[k, 0], curvature = length - joints.length[k], 1.0 / length
                store((distance[0] / length, distance[1] / length, distance[2] / length), along)
            direction = load(along, 0)
            stretch = dot(direction, speeds)
            out.rate[k, 0] = stretch
            out.gamma[k, 0] = -dot(direction, c) - curvature * (dot(speeds, speeds) - stretch * stretch)
            store(cross(s, direction), out.about[k, 0, 0])
            store(cross(z, direction), out.about[k, 1, 0])


@jit(allocates=False, inline="always")
def _axis_row(first, second, axis, across, wi, wj, k, row, out):
    """Fill one row: column ``axis`` of the first body stays perpendicular to column ``across`` of the second body."""
    e = (first[0, axis], first[1, axis], first[2, axis])
    a = (second[0, across], second[1, across], second[2, across])
    turn, phi, normal = minus(wi, wj), dot(e, a), cross(e, a)
    out.phi[k, row], out.rate[k, row] = phi, dot(turn, normal)
    out.gamma[k, row] = dot(turn, a) * dot(wj, e) - dot(turn, e) * dot(wi, a) + dot(turn, turn) * phi
    store(normal, out.about[k, 0, row])
    store(normal, out.about[k, 1, row])


@jit(allocates=False, inline="always")
def _point_rows(arm, about):
    """Write the rows -s~ of D for the arm s into ``about``."""
    about[0, 1], about[0, 2] = arm[2], -arm[1]
    about[1, 0], about[1, 2] = -arm[2], arm[0]
    about[2, 0], about[2, 1] = arm[1], -arm[0]


@jit(allocates=False, inline="always")
def _angular_velocity(state, body):
    if body == FRAME:
        return 0.0, 0.0, 0.0
    return load(state, STATE_SIZE * body + OMEGA)


@jit(allocates=False, inline="always")
def _centripetal(w, arm):
    """Return the centripetal acceleration w x (w x s) of a point at the arm s."""
    along, square = dot(w, arm), dot(w, w)
    return w[0] * along - arm[0] * square, w[1] * along - arm[1] * square, w[2] * along - arm[2] * square
