"""The normal problem on strips by itself: patches of one wheel in a pose, with their strips, for the tests here."""

import math
from dataclasses import dataclass, replace

import numpy as np

from wrcore.contact.hertz import hertz_table
from wrcore.contact.normal import solve
from wrcore.contact.normal.gap import group_end, rigid_slip
from wrcore.contact.normal.influence import influence_table
from wrcore.contact.normal.strips import MAX_STRIPS, MEMORY, WEIGHT, WIDENED, normal_work
from wrcore.contact.normal.windows import BLENDING_RATIO
from wrcore.contact.rigid.height_at_load import height_of_zero
from wrcore.contact.search.detection import axle_direction, find_patches
from wrcore.contact.search.reduction import MAX_PATCHES, MOMENT, PATCH_COLUMNS
from wrcore.contact.search.strip import make_pose
from wrcore.geometry.track import SIDES

RESOLUTIONS = {"coarse": 8, "middle": 12, "fine": 16}
"""Strips of a window; slender windows have 8, wide ones more."""


@dataclass(frozen=True, eq=False)
class StripPatch:
    """Normal contact of one patch; strips by increasing s in the contact frame (x forward, s to the left)."""

    side: str
    converged: bool
    """False: no solution was found, and there are no strips (and NaN for the sums). So far seen where one overlap runs
    from the flange root up the flange, which no one contact plane fits, and rarely where lobes are about to join."""
    contact_angle: float
    origin: tuple
    """Of the frame in the track frame (x from the wheelset's cross-section), m."""
    centre: np.ndarray
    width: np.ndarray
    half_length: np.ndarray
    middle: np.ndarray
    peak: np.ndarray
    window: np.ndarray
    height: np.ndarray
    """Of the wheel's extreme point in a strip along n, m."""
    tilt: np.ndarray
    """Slope over s of a strip's own contact plane, in which it slips."""
    place: np.ndarray
    own_width: np.ndarray
    """``centre`` and ``width`` along these planes, where strips carry and roll."""
    normal_force: float
    p_max: float
    mean_x: float
    mean_s: float
    mean_xx: float
    mean_ss: float
    x_min: float
    x_max: float
    s_min: float
    s_max: float
    slip_x: np.ndarray = None
    slip_x_dx: np.ndarray = None
    slip_s: np.ndarray = None
    slip_s_dx: np.ndarray = None
    """Rigid slip over V at the middle of the strips; None unless a velocity was given."""


class NormalContact:
    """Normal contact of the wheels of a wheelset on strips; ``modulus`` is E* (Pa)."""

    def __init__(self, geometry, modulus, resolution="middle"):
        self.geometry, self.modulus, self.resolution = geometry, modulus, RESOLUTIONS[resolution]
        self._hertz, self._values = hertz_table(), influence_table()
        self._patches = np.zeros((MAX_PATCHES, PATCH_COLUMNS))
        self._work, self._memories = normal_work(), {}
        self._strips, self._sums = np.zeros((solve.STRIP_ROWS, MAX_STRIPS)), np.zeros(solve.SUMS)

    def overlaps(self, y, z, axle):
        """Number of overlaps of a left wheel, and its pose."""
        count = find_patches(self.geometry, 1.0, y, z, *axle, True, MOMENT, self._patches)
        return count, make_pose(1.0, y, z, *axle, True)

    def at_height(self, side, y, z, roll=0.0, yaw=0.0, velocity=None, warm=False):
        """Patches (`StripPatch`) of the left or right wheel from the flange to the field side; ``velocity`` (vx, vy,
        vz, wx, wy, wz, V) asks for the rigid slip, ``warm`` starts from the last solution of that side."""
        sign = SIDES[side]  # a right wheel is the mirror image of a left one
        if velocity is not None:
            velocity = tuple(float(v) * (sign if k in (1, 3, 5) else 1.0) for k, v in enumerate(velocity))
        count, pose = self.overlaps(sign * y, z, axle_direction(sign * roll, sign * yaw))
        found, first = [], 0
        while first < count:
            last = group_end(self.geometry, self._patches, count, first)
            memory = self._memories.setdefault((side, len(found)), np.zeros(MEMORY))
            if not warm:
                memory[0] = 0.0
            found.append(self.solve(side, pose, first, last, velocity, memory))
            first = last
        return found

    def solve(self, side, pose, first, last, velocity, memory):
        """`StripPatch` of the overlaps from ``first`` to before ``last``."""
        windows, frame, strips, sums = self._on_strips(pose, first, last, memory)
        share = self._work.more[WEIGHT]
        if share > 0.0:  # the mean with a solution on more strips; the strips of the one that weighs more
            self._work.more[WIDENED] = BLENDING_RATIO
            more, _, finer, others = self._on_strips(pose, first, last, memory)
            self._work.more[WIDENED] = 1.0
            if more:
                load = (others if share > 0.5 else sums)[solve.LOAD]
                sums, strips = (1.0 - share) * sums + share * others, finer if share > 0.5 else strips
                strips[solve.PEAK] *= sums[solve.LOAD] / load
        slips = (None,) * 4
        if velocity is not None:
            slips = np.zeros((4, strips.shape[1]))
            rigid_slip(self.geometry, pose, frame, velocity, strips[solve.CENTRE], strips[solve.MIDDLE],
                       strips[solve.WHEEL_HEIGHT], strips[solve.STRIP_TILT], slips)  # fmt: skip
        found = StripPatch(
            side, windows > 0, math.atan2(frame.sine, frame.cosine),
            (frame.x, frame.ur + self.geometry.rail_distance, frame.z), *strips[solve.CENTRE : solve.PEAK + 1],
            strips[solve.WINDOW].astype(int), strips[solve.WHEEL_HEIGHT], strips[solve.STRIP_TILT],
            strips[solve.OWN_PLACE], strips[solve.OWN_WIDTH], *map(float, sums), *slips,
        )  # fmt: skip
        return found if side == "left" else _mirrored(found)

    def _on_strips(self, pose, first, last, memory):
        """One solution of the overlaps: number of windows, frame, strips and sums."""
        windows, frame = solve.solve_patch(self.geometry, pose, self._hertz, self._values, self._patches, first, last,
                                           self.resolution, memory, self._work)  # fmt: skip
        if not windows:
            return 0, frame, self._strips[:, :0], np.full(solve.SUMS, np.nan)
        count = solve.publish(self.modulus, self._work, windows, self._strips, self._sums)
        return windows, frame, self._strips[:, :count].copy(), self._sums.copy()

    def at_load(self, side, y, load, yaw=0.0, vertical=True):
        """Patches of one wheel that carries a load (N), vertically or as the sum of its normal forces, and the height
        of the wheelset's centre, m."""

        def excess(z):
            patches = self.at_height(side, y, z, 0.0, yaw, warm=True)
            force = sum(p.normal_force * (math.cos(p.contact_angle) if vertical else 1.0) for p in patches)
            return force ** (2.0 / 3.0) - load ** (2.0 / 3.0)

        z = height_of_zero(excess, self.geometry.rolling_radius)
        return self.at_height(side, y, z, 0.0, yaw), z


def _mirrored(patch):
    """A patch of a left wheel as that of a right one."""
    arrays = {name: part[::-1] for name, part in vars(patch).items() if isinstance(part, np.ndarray)}
    for name in {"centre", "tilt", "place", "slip_s", "slip_s_dx"} & arrays.keys():
        arrays[name] = -arrays[name]
    arrays["window"] = arrays["window"].max(initial=0) - arrays["window"]
    x, y, z = patch.origin
    return replace(patch, origin=(x, -y, z), contact_angle=-patch.contact_angle, mean_s=-patch.mean_s,
                   s_min=-patch.s_max, s_max=-patch.s_min, **arrays)  # fmt: skip
