"""Reference solution of a contact patch on grids, with all its fields: for studies and for errors of patch models."""

import math

import numpy as np

from wrcore.contact.creepage import creepages
from wrcore.contact.grid.grid import grid_normal, grid_rolling
from wrcore.contact.hertz import contact_modulus
from wrcore.contact.patch.result import Patch
from wrcore.contact.search.surfaces import Motion, plane_slip, strip_planes, surface_slip
from wrcore.errors import InputError

FINE = ((40, 32), (48, 40), (56, 48), (64, 48))
"""Grids (along x, across) of a reference; forces are extrapolated linearly in the element size."""


def solve_on_grids(
    geometry, pose, plane, slip, friction=0.3, shear_modulus=8.2e10, poisson_ratio=0.28, grids=FINE, tolerance=1e-4
):
    """Solve one contact patch of a wheel on grids over a contact plane; return the `Patch`.

    All overlaps are one patch. Forces are extrapolated from several grids; fields and normal force are those of the
    last grid. ``slip``: the wheelset's `Motion`, for the rigid slip of the true surfaces, or (xi, eta, phi) at the
    plane's origin, for the slip of a plane. ``grids``: approximate numbers of elements along x (even) and across,
    coarse to fine; one grid has an error of 1 % of the friction bound. ``tolerance``: last change of the tractions over
    that bound. InputError for other grids."""
    if not len(grids) or any(n % 2 or n < 8 or m < 4 for n, m in grids):
        raise InputError("solve_on_grids", "grids", f"expected even numbers from 8 along, 4 across, got {grids!r}")
    modulus = contact_modulus(shear_modulus, poisson_ratio)
    sizes, forces = [], []
    for nx, ns in grids:
        grid = grid_normal(geometry, pose, plane, modulus, nx, ns)
        wx, ws = np.empty(grid.gap.shape), np.empty(grid.gap.shape)
        if isinstance(slip, Motion):
            surface_slip(pose, plane, slip, grid.x, grid.s, *strip_planes(grid.s, grid.gap, grid.height), wx, ws)
        else:
            plane_slip(*slip, grid.x, grid.s, wx, ws)
        traction = grid_rolling(grid, wx, ws, friction, shear_modulus, poisson_ratio, tolerance)
        sizes += [grid.dx, 2.0 * grid.dx]
        forces += [traction.fine, traction.coarse]
    forces = np.polyfit(sizes, forces, 1, w=1.0 / np.array(sizes))[1] if len(grids) > 1 else traction[4:7]
    return _patch(pose, plane, slip, friction, grid, traction, forces)


def _patch(pose, plane, slip, friction, grid, traction, forces):
    """Return the `Patch` whose cells are the elements of a grid."""
    x, s = (a.ravel() for a in np.meshgrid(grid.x, grid.s, indexing="ij"))
    fields = [a.ravel() for a in (traction.pressure, traction.px, traction.ps, traction.sx, traction.ss)]
    stick = (fields[0] > 0.0) & (fields[3] == 0.0) & (fields[4] == 0.0)
    if isinstance(slip, Motion):
        n = float(np.interp(0.0, grid.s, grid.height.min(axis=0)))
        at = plane.x, plane.y - n * plane.sine - pose.y, plane.z + n * plane.cosine - pose.z
        slip = creepages(*slip[:6], *at, plane.cosine, plane.sine, slip.speed)[:3]
    normal = float(grid.pressure.sum() * grid.dx * grid.ds)
    across = grid.pressure.sum(axis=0)
    turn = math.atan(across @ strip_planes(grid.s, grid.gap, grid.height)[1] / max(across.sum(), 1e-30))
    return Patch(
        x, s, np.full(x.shape, grid.dx), np.full(x.shape, grid.ds), *fields, stick, normal, *map(float, forces),
        *map(float, slip), math.atan2(plane.sine, plane.cosine) + turn, (plane.x, plane.y, plane.z), friction,
        "left" if pose.side > 0.0 else "right",
    )  # fmt: skip
