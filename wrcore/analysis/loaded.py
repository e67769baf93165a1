"""A loaded wheel on its rail, at a height or under a load, by any patch model: ellipses, strips or a grid."""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from wrcore.analysis.loaded_base import Found, LoadedWheels, free_creepages, free_rate
from wrcore.contact import reduction as columns
from wrcore.contact.creepage import creepages
from wrcore.contact.detection import axle_direction, find_patches
from wrcore.contact.patch.gap import group_end
from wrcore.contact.patch.library import make_library, solve_patch
from wrcore.contact.patch.model import PATCHES, RESOLUTIONS, SLIPS
from wrcore.contact.patch.normal import NormalContact
from wrcore.contact.patch.reference import FINE, solve_on_grids
from wrcore.contact.patch.result import Patch
from wrcore.contact.patch.surfaces import contact_plane
from wrcore.contact.reduction import MAX_PATCHES, MOMENT, PATCH_COLUMNS, PENETRATION, REDUCTIONS
from wrcore.contact.statics import wheel_at_rest
from wrcore.contact.strip import make_pose
from wrcore.creep.laws import LAWS, creep_data, creep_force_at
from wrcore.creep.table import ensure_table
from wrcore.errors import InputError, one_of
from wrcore.geometry.surface import SIDES

MODELS = (*PATCHES, "grid")

GRIDS = {"coarse": ((32, 24),), "middle": ((32, 24), (40, 32)), "fine": FINE}
"""Grids of each resolution (elements along x, across)."""

SLENDER = 3.0
"""Length over width from which strips get more panels along rolling, as in runs."""


class Ellipses(LoadedWheels):
    """Overlaps reduced to ellipses, and the creep table."""

    def __init__(self, geometry, reduction="moment", **options):
        super().__init__(geometry, **options)
        self.reduction = REDUCTIONS[reduction]

    def at_height(self, side, y, z, roll=0.0, yaw=0.0, rolling=None, friction=0.3, fields=False):
        """See `LoadedWheels.at_height`; there are no fields."""
        rows = np.zeros((MAX_PATCHES, PATCH_COLUMNS))
        count, _ = wheel_at_rest(self.geometry, self._hertz, self.modulus, SIDES[side], y, z, roll, yaw, self.spatial,
                                 self.reduction, rows)  # fmt: skip
        rows = rows[:count]
        rows[:, columns.XI : columns.PHI + 1] = np.nan
        if rolling is not None and count:
            self._roll(rows, y, z, roll, yaw, rolling, friction)
        for row in rows:
            row[columns.P_MAX] = 1.5 * row[columns.NORMAL] / (math.pi * row[columns.SEMI_A] * row[columns.SEMI_B])
        ends = ((r[columns.X] - r[columns.SEMI_A], r[columns.X] + r[columns.SEMI_A], 2 * r[columns.SEMI_B])
                for r in rows)  # fmt: skip
        return [Found(row, tuple(map(float, end))) for row, end in zip(rows, ends, strict=True)]

    def height(self, side, y, load, roll=0.0, yaw=0.0, rolling=None, friction=0.3, vertical=True, guess=math.nan):
        """See `LoadedWheels.height`."""
        if rolling is None and vertical:
            return self._still_height(side, y, load, roll, yaw)
        return super().height(side, y, load, roll, yaw, rolling, friction, vertical, guess)

    def settled(self, y, load, yaw=0.0, rolling=None, friction=0.3, vertical=True):
        """See `LoadedWheels.settled`."""
        if rolling is None and vertical:
            return self._still_settled(y, load, yaw)
        return super().settled(y, load, yaw, rolling, friction, vertical)

    def _roll(self, rows, y, z, roll, yaw, rolling, friction):
        """Creepages and creep forces of ellipses."""
        places = [(r[columns.X], r[columns.Y] - y, r[columns.Z] - z, math.cos(r[columns.ANGLE]),
                   math.sin(r[columns.ANGLE])) for r in rows]  # fmt: skip

        def at(motion):
            return np.array([creepages(*motion[:6], *place, motion.speed)[:3] for place in places])

        found = free_creepages(at, rolling, roll, yaw, lambda creeps: rows[:, columns.NORMAL] @ creeps[:, 0])
        for row, creep in zip(rows, found, strict=True):
            row[columns.XI : columns.PHI + 1] = creep
            row[columns.FX : columns.MZ + 1] = creep_by_table(
                row[columns.SEMI_A], row[columns.SEMI_B], row[columns.NORMAL], *creep, friction, self.shear_modulus,
                self.poisson_ratio,
            )  # fmt: skip


class Strips(LoadedWheels):
    """Strips, exact or by virtual penetration with the creep table; a grid where strips find no solution, or always."""

    def __init__(self, geometry, model="exact", resolution="middle", slip="surfaces", **options):
        super().__init__(geometry, **options)
        for name, value, known in (("resolution", resolution, RESOLUTIONS), ("slip", slip, SLIPS)):
            if value not in known:
                raise InputError("contact", name, one_of(known, value))
        self.resolution, self.surfaces, self.always = resolution, slip == "surfaces", model == "grid"
        self.exact, self.grids = model != "strips", GRIDS[resolution] if self.always else GRIDS["middle"][-1:]
        arguments = geometry, self.modulus, resolution
        self._contact = NormalContact(*arguments, "exact" if self.exact else "strips", self.detection)
        self._rough = NormalContact(*arguments, "strips", self.detection)

    def at_height(self, side, y, z, roll=0.0, yaw=0.0, rolling=None, friction=0.3, fields=False):
        """See `LoadedWheels.at_height`."""
        pose = side, y, z, roll, yaw
        shapes = self._contact.at_height(*pose)
        if not shapes:
            return []
        solved = [shape.converged for shape in shapes]
        if not all(solved):  # these stand in for the pressure in the mean slip
            rough = self._rough.at_height(*pose)
            shapes = [shape if good else other for shape, good, other in zip(shapes, solved, rough, strict=True)]
        motion, slips = None, [np.zeros((4, len(shape.centre))) for shape in shapes]
        rows = self._overlaps(*pose)
        if rolling is not None:
            at = lambda motion: self._slips(pose, motion, solved, rows)  # noqa: E731
            loads = [_loads(shape) for shape in shapes]
            mean = lambda slips: sum(load @ slip[0] for load, slip in zip(loads, slips, strict=True))  # noqa: E731
            slips, rate = free_rate(at, rolling, roll, yaw, mean)
            motion = rolling.motion(roll, yaw, rate)
        found = []
        for shape, slip, row, good in zip(shapes, slips, rows, solved, strict=True):
            if self.always or not good:
                found.append(self._on_grid(shape, slip, row, pose, motion, friction))
            else:
                found.append(self._on_strips(shape, slip, row, pose, rolling is not None, friction, fields))
        return found

    def _slips(self, pose, motion, solved, rows):
        """Rigid slip of every patch, (4, strips) each."""
        shapes = self._contact.at_height(*pose, motion)
        if not all(solved):
            rough = self._rough.at_height(*pose, motion)
            shapes = [shape if good else other for shape, good, other in zip(shapes, solved, rough, strict=True)]
        if self.surfaces:
            return [np.array([s.slip_x, s.slip_x_dx, s.slip_s, s.slip_s_dx]) for s in shapes]
        return [
            shape.slip_of_creepages(*self._creepages(shape, row, pose, motion))
            for shape, row in zip(shapes, rows, strict=True)
        ]

    @staticmethod
    def _creepages(shape, row, pose, motion):
        """Of the undeformed wheel's material point above the frame's origin."""
        (x, y, z), angle, depth = shape.origin, shape.contact_angle, row[PENETRATION]
        cosine, sine = math.cos(angle), math.sin(angle)
        y, z = y + depth * sine - pose[1], z - depth * cosine - pose[2]
        return creepages(*motion[:6], x, y, z, cosine, sine, motion.speed)[:3]

    def _overlaps(self, side, y, z, roll, yaw):
        """Row of the deepest overlap of each group of them that is one patch."""
        axle = (SIDES[side] * c for c in axle_direction(roll, yaw))
        count = find_patches(self.geometry, SIDES[side], y, z, *axle, self.spatial, MOMENT, self._rows)
        first, deepest = 0, []
        while first < count:
            last = group_end(self._rows, count, first)
            deepest.append(max(self._rows[first:last], key=lambda row: row[PENETRATION]).copy())
            first = last
        return deepest

    def _on_strips(self, shape, slip, row, pose, rolls, friction, fields):
        """`Found` of a patch that strips have solved."""
        mean_x, mean_s, creep = shape.mean_x, shape.mean_s, _mean_creepages(shape, slip)
        a, b = (math.sqrt(5.0 * max(square - mean * mean, 1e-14))
                for square, mean in ((shape.mean_xx, mean_x), (shape.mean_ss, mean_s)))  # fmt: skip
        field, forces = None, np.zeros((3, len(shape.centre)))
        level = "slender" if a > SLENDER * b else self.resolution
        if self.exact and (rolls or fields):
            field = solve_patch(
                (shape.place, shape.own_width, shape.half_length, shape.middle, shape.peak), slip, self.shear_modulus,
                friction, level, self.poisson_ratio,
            )  # fmt: skip
            forces = field.force
        elif rolls:
            fx, fs, mz = creep_by_table(a, b, shape.normal_force, *creep, friction, self.shear_modulus,
                                        self.poisson_ratio)  # fmt: skip
            share = _loads(shape) / shape.normal_force
            forces = share * np.stack([0.0 * share + fx, 0.0 * share + fs, mz + (mean_x - shape.middle) * fs])
        if not self.surfaces:  # creepages are the slip of one plane
            tilt = 0.0 * shape.tilt + _loads(shape) @ shape.tilt / shape.normal_force
            shape = replace(shape, tilt=tilt, height=tilt * (shape.centre - mean_s) - row[PENETRATION])
        angle, normal, *force = shape.resultant(forces)
        plane, (x, y, z) = shape.contact_angle, shape.origin
        point = x + mean_x, y + mean_s * math.cos(plane), z + mean_s * math.sin(plane)
        _fill(row, point, angle, (a, b), normal, force, creep if rolls else (math.nan,) * 3, shape.p_max)
        extent = shape.origin[0] + shape.x_min, shape.origin[0] + shape.x_max, shape.s_max - shape.s_min
        patch = None
        if fields and field is not None:
            panels = make_library(level, self.poisson_ratio).panels
            patch = _patch_of_strips(shape, field, panels, row, friction, pose)
        return Found(row, extent, patch)

    def _on_grid(self, shape, slip, row, pose, motion, friction):
        """`Found` of a patch on grids, in the plane of its strips."""
        side, y, z, roll, yaw = pose
        axle = (SIDES[side] * c for c in axle_direction(roll, yaw))
        rigid = (0.0, 0.0, 0.0)
        if motion is not None:
            rigid = motion if self.surfaces else self._creepages(shape, row, pose, motion)
        solved = solve_on_grids(
            self.geometry, make_pose(SIDES[side], y, z, *axle, self.spatial),
            contact_plane(*shape.origin, shape.contact_angle), rigid, friction, self.shear_modulus, self.poisson_ratio,
            self.grids,
        )  # fmt: skip
        patch = replace(solved, pose=(y, z, roll, yaw))
        mean_x, mean_s = patch.centroid
        load = patch.pressure * patch.cell_area
        axes = (math.sqrt(5.0 * max(load @ (q - mean) ** 2 / max(load.sum(), 1e-30), 1e-14))
                for q, mean in ((patch.x, mean_x), (patch.s, mean_s)))  # fmt: skip
        cosine, sine = math.cos(shape.contact_angle), math.sin(shape.contact_angle)
        point = shape.origin[0] + mean_x, shape.origin[1] + mean_s * cosine, shape.origin[2] + mean_s * sine
        force = patch.fx, patch.fs, patch.mn + mean_s * patch.fx - mean_x * patch.fs
        _fill(row, point, patch.contact_angle, tuple(axes), patch.normal, force,
              (math.nan,) * 3 if motion is None else _mean_creepages(shape, slip), patch.p_max)  # fmt: skip
        x_min, x_max, s_min, s_max = patch.extent
        return Found(row, (shape.origin[0] + x_min, shape.origin[0] + x_max, s_max - s_min), patch, True)


def loaded_wheels(geometry, model="exact", resolution="middle", slip="surfaces", **options):
    """`LoadedWheels` of a geometry by a patch model (maximum, moment, strips, exact or grid); of strips and grids
    ``resolution`` (coarse, middle, fine) and rigid ``slip`` (of the real surfaces, or one set of creepages); options
    are shear_modulus (Pa), poisson_ratio and detection.
    """
    if model not in MODELS:
        raise InputError("patch", "", one_of(MODELS, model))
    if model in REDUCTIONS:
        return Ellipses(geometry, model, **options)
    return Strips(geometry, model, resolution, slip, **options)


def creep_by_table(a, b, normal, xi, eta, phi, friction, shear_modulus, poisson_ratio):
    """Fx, Fy (N) and Mz (N m) on the wheel of an ellipse, by the default creep table."""
    limit, c = friction * normal, math.sqrt(a * b)
    if not limit > 0.0:
        return 0.0, 0.0, 0.0
    scale = shear_modulus * c * c / limit
    fx, fy, mz, _ = creep_force_at(LAWS["table"], _table(poisson_ratio), math.log(a / b), a / b, 0.0, xi * scale,
                                   eta * scale, phi * scale * c)  # fmt: skip
    return limit * fx, limit * fy, limit * c * mz


@lru_cache(maxsize=4)
def _table(nu):
    return creep_data(nu, ensure_table(nu).kernel_data())


def _loads(shape):
    """Normal force of each strip, N."""
    return 0.5 * math.pi * shape.peak * shape.half_length * shape.width


def _mean_creepages(shape, slip):
    """Longitudinal, lateral and spin creepage at the pressure's centroid: means of the rigid slip."""
    share = _loads(shape) / _loads(shape).sum()
    return share @ slip[0], share @ (slip[2] + slip[3] * (shape.mean_x - shape.middle)), share @ slip[3]


def _fill(row, point, angle, axes, normal, force, creep, p_max):
    """Put a patch's results into its row."""
    row[columns.X], row[columns.Y], row[columns.Z] = point
    row[columns.ANGLE], row[columns.NORMAL], row[columns.P_MAX] = angle, normal, p_max
    row[columns.SEMI_A], row[columns.SEMI_B] = axes
    row[columns.FX : columns.MZ + 1], row[columns.XI : columns.PHI + 1] = force, creep


def _patch_of_strips(shape, field, panels, row, friction, pose):
    """`Patch` of strips, their panels as cells, about the pressure's centroid."""
    shorter = shape.even_length / shape.half_length  # strips as rectangles with the areas that they have
    edges = shape.middle[:, None] + shape.even_length[:, None] * panels.edges
    like = np.ones(edges[:, 1:].shape)
    mean_x, mean_s = shape.mean_x, shape.mean_s
    cells = (
        0.5 * (edges[:, 1:] + edges[:, :-1]) - mean_x, like * (shape.centre - mean_s)[:, None],
        edges[:, :-1] - edges[:, 1:], like * shape.own_width[:, None],
        *(one / shorter[:, None] for one in (field.pressure, field.traction_x, field.traction_s)),
        np.where(field.slides, field.slip_x, 0.0), np.where(field.slides, field.slip_s, 0.0), ~field.slides,
    )  # fmt: skip
    ends = shape.x_min - mean_x, shape.x_max - mean_x, shape.s_min - mean_s, shape.s_max - mean_s
    return Patch(
        *(cell.ravel() for cell in cells), *map(float, row[[columns.NORMAL, columns.FX, columns.FY, columns.MZ]]),
        *map(float, row[columns.XI : columns.PHI + 1]), float(row[columns.ANGLE]),
        tuple(map(float, row[[columns.X, columns.Y, columns.Z]])), friction, pose[0], shape.p_max, ends, pose[1:],
    )  # fmt: skip
