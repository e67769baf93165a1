"""Preloads of the springs that carry a vehicle in its nominal position.

Wheelsets and the moving frame are fixed; every other body may move by a small q, a translation and a rotation. B is the
relative motion of an element's two ends per unit of q. K is the sum of B^T k B over the springs' vertical stiffnesses
k, and C q = 0 are the joints. The displacement under the vehicle's weight f follows from

    [ K  C^T ] [ q      ]   [ f ]
    [ C   0  ] [ lambda ] = [ 0 ],

and each spring's preload is -k B q. With these preloads the vehicle is in equilibrium in nominal position, and
horizontal springs, traction rods and bump stops carry no load.
"""

import numpy as np

from wrcore.bodies.marker import FRAME
from wrcore.errors import InputError
from wrcore.forces.kind import Along, Spring, Turning

UNCARRIED = 1e-6
"""Largest force or moment (N, N m) without support that is accepted, as a fraction of the body's weight."""


@np.errstate(all="ignore")  # overflow makes the check of the supported weight fail
def preloads(parts, layout, joints, gravity):
    """Return the vertical preloads (N on the first body, by name) of springs among ``parts`` that state no preload.

    With them the vehicle is at rest in nominal position. Stated preloads carry part of the weight; these springs share
    the remainder in proportion to their stiffness in a linear equilibrium. ``gravity`` is in m/s^2. An InputError names
    a body that neither springs nor joints carry.
    """
    size = 6 * len(layout.names)
    weight, load = np.zeros(size), np.zeros(size)
    weight[2::6] = -gravity * layout.mass
    fixed = np.repeat(layout.spins, 6)
    free, shared, holding = np.zeros((size, size)), np.zeros((size, size)), {}
    for name, bodies, does in parts:
        here = does.ends[0]
        motion = _point_motion(bodies[0], here, layout) - _point_motion(bodies[1], here, layout)
        stiffness, stated = _stiffness(does)
        free += motion.T @ stiffness @ motion
        if stated is not None:
            load += motion[:3].T @ stated
        elif isinstance(does, Spring):
            holding[name] = stiffness[2, 2] * motion[2]
            shared += np.outer(motion[2], holding[name])
    constraints = np.vstack([np.zeros((0, size)), *(_constraints(item, layout) for item in joints)])
    left = _solve(free, constraints, weight, fixed)[1]
    for body, name in enumerate(layout.names):
        part = slice(6 * body, 6 * body + 6)
        if not np.max(np.abs(left[part])) <= UNCARRIED * -weight[6 * body + 2]:
            expected = "expected springs or joints that carry the body in nominal position; a force or moment of"
            got = f"{np.max(np.abs(left[part])):.4g} N or N m is left of its weight"
            raise InputError(layout.source, f"bodies.{name}", f"{expected} {got}")
    sunk = _solve(shared, constraints, weight + load, fixed)[0]
    return {name: -float(force @ sunk) for name, force in holding.items()}


def _solve(stiffness, constraints, load, fixed):
    """Return the displacements under a load and the unsupported part of the load; ``fixed`` unknowns are 0."""
    n, scale = len(load), max(np.max(np.abs(stiffness)), 1.0)
    columns = np.flatnonzero(~fixed)
    rows = constraints[:, columns] * scale
    matrix = np.block([[stiffness[np.ix_(columns, columns)], rows.T], [rows, np.zeros((len(rows), len(rows)))]])
    right = np.concatenate([load[columns], np.zeros(len(rows))])
    if not columns.size:
        return np.zeros(n), np.zeros(n)
    try:
        solved = np.linalg.lstsq(matrix, right, rcond=1e-12)[0]
    except np.linalg.LinAlgError:
        solved = np.full(len(right), np.nan)
    displacement, left = np.zeros(n), np.zeros(n)
    displacement[columns] = solved[: len(columns)]
    left[columns] = (right - matrix @ solved)[: len(columns)]
    return displacement, left


def _point_motion(body, point, layout):
    """Return the motion (6, size) of a point of a body: its translation and rotation per unit of all unknowns."""
    motion = np.zeros((6, 6 * len(layout.names)))
    if body != FRAME:
        x, y, z = np.asarray(point) - layout.positions[body]
        at = 6 * body
        motion[:, at : at + 6] = np.eye(6)
        motion[:3, at + 3 : at + 6] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return motion


def _stiffness(does):
    """Return the stiffness (6, 6) of a part against relative translation and rotation, and its preload.

    The preload (3,) is the stated force on the first body, N, or None.
    """
    stiffness = np.zeros((6, 6))
    if isinstance(does, Along):
        here, there = does.ends
        axis = (here - there) / max(np.linalg.norm(here - there), 1e-9) if does.axis is None else does.axis
        stiffness[:3, :3] = does.slope * np.outer(axis, axis)
        return stiffness, does.preload * axis
    first = 3 * isinstance(does, Turning)
    stiffness[range(first, first + 3), range(first, first + 3)] = does.stiffness
    if first or does.preload is None:
        return stiffness, None
    return stiffness, np.array(does.preload, float)


def _constraints(item, layout):
    """Return the constraint rows (m, size) of a joint in nominal position: each row times the unknowns is 0."""
    first, second = layout.ends(item, f"joints.{item['name']}")
    if item["kind"] == "coordinate":
        return _point_motion(first, layout.positions[first], layout)[["xyz".index(item["axis"])]]
    at = np.array(item["at"], float).reshape(-1, 3)
    motion = _point_motion(first, at[0], layout) - _point_motion(second, at[-1], layout)
    if item["kind"] == "rigid_link":
        return ((at[0] - at[1]) / np.linalg.norm(at[0] - at[1]))[None, :] @ motion[:3]
    free = {"revolute": {item.get("axis")}, "rigid": set()}.get(item["kind"], set("xyz"))
    turns = [3 + k for k, axis in enumerate("xyz") if axis not in free]
    return motion[[0, 1, 2, *turns]]
