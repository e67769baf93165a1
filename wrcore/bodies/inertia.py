"""Moments and products of inertia: principal axes of bodies, and parts of wheelsets that do not turn with the axle.

Kernels use principal moments d and principal axes M: the inertia in track axes is J = M diag(d) M^T. If the axes of all
bodies are principal axes, M are the rotation matrices of the bodies and no extra computation is needed.

A *wheelset* whose roll and yaw moments differ, or that has a product xz, carries parts that do not turn with the axle:
bearings, a gear box, an axle-hung motor. Wheels and axle are a body of revolution with angular velocity w. The carried
parts have the angular velocity w - s e, s = w . e, with e the axle's direction. Their support in pitch (a reaction rod)
takes up all their moments about e, so that their pitch inertia has no effect. With the pitch moment d_2 and the
inertia D across the axle, carried parts included, the moments about the centre are

    J w' + s (d_2 - D)(w x e),   J = d_2 e e^T + D,

which for D = d_1 (1 - e e^T), a body of revolution, is J w' + w x J w. D is given in level axes: x is horizontal and
perpendicular to the axle, whatever the angle of the wheelset's frame about the axle. The rotation rate of these axes
about e, (yaw rate) x (roll), is neglected; its effect is of third order.

References
----------
Goldstein, Classical Mechanics (1980), chapter 5 (inertia tensor, principal axes).
"""

import math

import numpy as np

from wrcore.bodies.body import OMEGA
from wrcore.bodies.vector import cross, dot, load
from wrcore.kernels.jit import FUSED, jit


def tensor_of(inertia):
    """Return the inertia tensor (3, 3), kg m^2, from a dict of moments and products of inertia.

    The keys are the moments ``roll``, ``pitch``, ``yaw`` and the products ``xy``, ``xz``, ``yz``. A product is the
    integral over the mass, for example of x y; the tensor holds its negative."""
    tensor = np.diag([float(inertia[key]) for key in ("roll", "pitch", "yaw")])
    for key, place in (("xy", (0, 1)), ("xz", (0, 2)), ("yz", (1, 2))):
        if inertia.get(key):
            tensor[place] = tensor[place[::-1]] = -inertia[key]
    return tensor


def principal(tensors, spins):
    """Return principal moments (n, 3) and principal axes (n, 3, 3) of inertia tensors (n, 3, 3) in the bodies' axes.

    The axes have shape (0, 3, 3) if the axes of all bodies are principal and no wheelset carries parts that do not turn
    with the axle. The second principal axis of a wheelset (``spins``) is its axle."""
    tensors = np.asarray(tensors, float).reshape(-1, 3, 3)
    moments = np.diagonal(tensors, axis1=1, axis2=2).copy()
    axes = np.tile(np.eye(3), (len(tensors), 1, 1))
    skew = np.any(tensors != moments[:, None, :] * np.eye(3), axis=(1, 2))
    for b in np.flatnonzero(skew):
        free = np.array([0, 2] if spins[b] else [0, 1, 2])
        moments[b, free], axes[b][np.ix_(free, free)] = np.linalg.eigh(tensors[b][np.ix_(free, free)])
    carrying = np.asarray(spins, bool) & (moments[:, 0] != moments[:, 2])
    return moments, axes if np.any(skew | carrying) else axes[:0]


def inertia_tensors(bodies):
    """Return the inertia tensors of all bodies in body axes, (n, 3, 3), kg m^2."""
    axes = bodies.axes if len(bodies.axes) else np.tile(np.eye(3), (len(bodies.mass), 1, 1))
    return (axes * bodies.inertia[:, None, :]) @ axes.transpose(0, 2, 1)


@jit(inline="always")
def inertia_axes(bodies, work):
    """Return the principal axes of all bodies in track axes, (n, 3, 3), from the last evaluation."""
    return work.principal if bodies.axes.shape[0] > 0 else work.rotations


@jit(allocates=False, fastmath=FUSED)
def turn_to_principal(bodies, rotations, out):
    """Write the principal axes of all bodies in track axes into ``out`` (n, 3, 3), from ``rotations`` and `Bodies`."""
    for b in range(bodies.axes.shape[0]):
        axes = rotations[b]
        ex, ey, ez = axes[0, 1], axes[1, 1], axes[2, 1]
        length = math.sqrt(ex * ex + ey * ey)
        level = bodies.spins[b] == 1 and length > 0.0
        x, y = (ey / length, -ex / length) if level else (0.0, 0.0)
        for k in range(3):
            p, q, r = bodies.axes[b, 0, k], bodies.axes[b, 1, k], bodies.axes[b, 2, k]
            if level:  # columns (x, y, 0), e and their product
                out[b, 0, k] = p * x + q * ex + r * (y * ez)
                out[b, 1, k] = p * y + q * ey - r * (x * ez)
                out[b, 2, k] = q * ez + r * (x * ey - y * ex)
            else:
                for i in range(3):
                    out[b, i, k] = p * axes[i, 0] + q * axes[i, 1] + r * axes[i, 2]


@jit(allocates=False, fastmath=FUSED)
def apply_inverse_inertia(inertia, axes, wrench, out):
    """Write J^-1 n into ``out`` (3,), with n the moment part of a wrench (6,) and J = M diag(inertia) M^T.

    The columns of M are the principal axes in ``axes``."""
    for i in range(3):
        out[i] = 0.0
    for k in range(3):
        local = axes[0, k] * wrench[3] + axes[1, k] * wrench[4] + axes[2, k] * wrench[5]
        local /= inertia[k]
        for i in range(3):
            out[i] += axes[i, k] * local


@jit(allocates=False, fastmath=FUSED)
def subtract_gyroscopic(inertia, axes, state, at, wrench):
    """Subtract the gyroscopic moment w x J w of a body from the moment part of its wrench (6,)."""
    wx, wy, wz = load(state, at + OMEGA)
    hx = hy = hz = 0.0
    for k in range(3):
        h = inertia[k] * (axes[0, k] * wx + axes[1, k] * wy + axes[2, k] * wz)
        hx += axes[0, k] * h
        hy += axes[1, k] * h
        hz += axes[2, k] * h
    wrench[3] -= wy * hz - wz * hy
    wrench[4] -= wz * hx - wx * hz
    wrench[5] -= wx * hy - wy * hx


@jit(inline="always")
def carrying(bodies, b):
    """Whether a body is a wheelset that carries parts that do not turn with the axle."""
    return bodies.spins[b] == 1 and bodies.inertia[b, 0] != bodies.inertia[b, 2]


@jit(allocates=False, fastmath=FUSED)
def add_carried_gyroscopic(inertia, axes, state, at, factor, wrench):
    """Add ``factor`` times the moment s (d_2 - D)(w x e) to the wrench (6,) of a wheelset with carried parts."""
    w, e = load(state, at + OMEGA), (axes[0, 1], axes[1, 1], axes[2, 1])
    spin, turned = dot(w, e), cross(w, e)
    for k in range(0, 3, 2):
        axis = axes[0, k], axes[1, k], axes[2, k]
        moment = factor * spin * (inertia[1] - inertia[k]) * dot(axis, turned)
        for i in range(3):
            wrench[3 + i] += moment * axis[i]
