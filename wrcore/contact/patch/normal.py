"""Exact non-Hertzian normal contact of a wheel on a rail: Galerkin strips in windows that end at the tips of contact.

Across the patch, strips of width w carry a pressure that is semi-elliptic along x,

    p = p0 sqrt(1 - ((x - X)/a)^2),   p0 = pi E* Q a,

with unknown Q, half length a and (with yaw) middle X. Galerkin's conditions make the loaded gap vanish in the mean and
in its second and first moment along the strip; the tips of a window lie where a^2, linear there, vanishes. All strips
of a patch, whichever window they belong to, act on each other through the half-space
(:mod:`wrcore.contact.patch.normal_influence`).

References
----------
Johnson, Contact Mechanics (1985), chapters 3 and 4. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990).
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from wrcore.contact.detection import axle_direction
from wrcore.contact.normal import hertz_table
from wrcore.contact.patch.gap import group_end, rigid_slip
from wrcore.contact.patch.normal_influence import influence_table
from wrcore.contact.patch.solve import (
    CENTRE,
    EXACT,
    LOAD,
    MIDDLE,
    OWN_PLACE,
    OWN_WIDTH,
    PEAK,
    STRIP_ROWS,
    STRIP_TILT,
    STRIPS,
    SUMS,
    WHEEL_HEIGHT,
    WINDOW,
    publish,
    solve_patch,
    wheel_overlaps,
)
from wrcore.contact.patch.strips import MAX_STRIPS, MEMORY, WEIGHT, WIDENED, workspace
from wrcore.contact.patch.windows import MORE
from wrcore.contact.reduction import MAX_PATCHES, PATCH_COLUMNS
from wrcore.errors import InputError, one_of
from wrcore.geometry.track import SIDES

RESOLUTIONS = {"coarse": 8, "middle": 12, "fine": 16}
"""Strips of a window; slender windows have 8, wide ones more."""

MODELS = {"exact": EXACT, "strips": STRIPS}
"""``strips``: shape-corrected virtual penetration, without a solution of the half-space."""

TIP_SHARE, TIP_GROWTH = 0.13, 0.04
"""By which a window's last strips are too long for their area: the share, and its growth with ln(a/width) there."""


@dataclass(frozen=True, eq=False)
class StripPatch:
    """Normal contact of one patch on strips; SI units.

    Arrays run over the strips by increasing s in the contact frame: x forward, s lateral (to the left), n from rail
    into wheel, turned by ``contact_angle`` about x from the track frame.
    """

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
    """Pressure in the middle of a strip, Pa: p = peak sqrt(1 - ((x - middle)/half_length)^2)."""
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
    """Means over the pressure, m and m^2."""
    x_min: float
    x_max: float
    s_min: float
    s_max: float
    slip_x: np.ndarray = None
    slip_x_dx: np.ndarray = None
    slip_s: np.ndarray = None
    slip_s_dx: np.ndarray = None
    """Rigid slip over V at the middle of the strips, across in their own planes, and its slope along x; None unless a
    velocity was given."""


def even_length(half_length, width, window):
    """Half lengths of rectangles as wide as the strips with the areas under them, m, shape (strips,).

    Galerkin's strips at the tips of a window are too long, by a share that grows with length over width: fitted to
    the area of Hertz's ellipses with a/b from 0.25 to 9 and 8 to 32 strips (within 0.3 %).
    """
    even, edge = half_length.copy(), np.diff(window, prepend=-1, append=-1) != 0
    at = edge[1:] | edge[:-1]
    even[at] *= 1.0 - TIP_SHARE - TIP_GROWTH * np.log(even[at] / width[at])
    return even


class NormalContact:
    """Normal contact of the wheels of a wheelset on strips: ``modulus`` is E* (Pa), ``resolution`` and ``model`` are of
    RESOLUTIONS and MODELS, ``detection`` planar or spatial; InputError for others.
    """

    def __init__(self, geometry, modulus, resolution="middle", model="exact", detection="spatial"):
        for name, value, known in (("resolution", resolution, RESOLUTIONS), ("model", model, MODELS),
                                   ("detection", detection, ("planar", "spatial"))):  # fmt: skip
            if value not in known:
                raise InputError("NormalContact", name, one_of(known, value))
        if not 0.0 < modulus < math.inf:
            raise InputError("NormalContact", "modulus", f"expected a contact modulus in Pa, got {modulus!r}")
        self.geometry, self.modulus, self.spatial = geometry, float(modulus), detection == "spatial"
        self.resolution, self.model = RESOLUTIONS[resolution], MODELS[model]
        self._hertz, self._values = hertz_table(), influence_table().values
        self._patches = np.zeros((MAX_PATCHES, PATCH_COLUMNS))
        self._work, self._memories = workspace(), {}
        self._strips, self._sums = np.zeros((STRIP_ROWS, MAX_STRIPS)), np.zeros(SUMS)

    def at_height(self, side, y, z, roll=0.0, yaw=0.0, velocity=None, warm=False):
        """Patches (`StripPatch`) of the left or right wheel from the flange to the field side, in a pose of the
        wheelset (m, rad); overlaps whose planes are near each other are one patch.

        ``velocity`` (vx, vy, vz, m/s, wx, wy, wz, rad/s, of the wheelset in the track frame, and the rolling speed V,
        m/s) asks for the rigid slip; ``warm`` starts from the last solution of that side.
        """
        if side not in SIDES:
            raise InputError("NormalContact", "side", f"expected left or right, got {side!r}")
        if not all(map(math.isfinite, (y, z, roll, yaw))):
            raise InputError("NormalContact", "pose", f"expected finite numbers, got {(y, z, roll, yaw)!r}")
        if velocity is not None and not (len(velocity) == 7 and velocity[6] > 0.0):
            raise InputError("NormalContact", "velocity", f"expected vx, vy, vz, wx, wy, wz, V > 0, got {velocity!r}")
        sign = SIDES[side]  # a right wheel is the mirror image of a left one
        if velocity is not None:
            velocity = tuple(float(v) * (sign if k in (1, 3, 5) else 1.0) for k, v in enumerate(velocity))
        axle = axle_direction(sign * roll, sign * yaw)
        count, pose = wheel_overlaps(self.geometry, 1.0, sign * y, z, *axle, self.spatial, self._patches)
        found, first = [], 0
        while first < count:
            last = group_end(self._patches, count, first)
            memory = self._memories.setdefault((side, len(found)), np.zeros(MEMORY))
            if not warm:
                memory[0] = 0.0
            found.append(self._solve(side, pose, first, last, velocity, memory))
            first = last
        return found

    def _solve(self, side, pose, first, last, velocity, memory):
        windows, frame, strips, sums = self._once(pose, first, last, memory)
        share = self._work.more[WEIGHT]
        if share > 0.0:  # the mean with a solution on more strips; the strips of the one that weighs more
            self._work.more[WIDENED] = MORE
            more, _, finer, others = self._once(pose, first, last, memory)
            self._work.more[WIDENED] = 1.0
            if more:
                load = (others if share > 0.5 else sums)[LOAD]
                sums, strips = (1.0 - share) * sums + share * others, finer if share > 0.5 else strips
                strips[PEAK] *= sums[LOAD] / load
        count = strips.shape[1]
        slips = (None,) * 4
        if velocity is not None:
            slips = np.zeros((4, count))
            rigid_slip(self.geometry, pose, frame, velocity, strips[CENTRE], strips[MIDDLE], strips[WHEEL_HEIGHT],
                       strips[STRIP_TILT], slips)  # fmt: skip
        origin = (frame.x, frame.ur + self.geometry.rail_distance, frame.z)
        found = StripPatch(
            side, windows > 0, math.atan2(frame.sine, frame.cosine), origin, *strips[CENTRE : PEAK + 1],
            strips[WINDOW].astype(int), strips[WHEEL_HEIGHT], strips[STRIP_TILT], strips[OWN_PLACE], strips[OWN_WIDTH],
            *map(float, sums), *slips,
        )  # fmt: skip
        return found if side == "left" else _mirrored(found)

    def _once(self, pose, first, last, memory):
        """One solution of the overlaps: number of windows, frame, strips and sums."""
        windows, frame = solve_patch(self.geometry, pose, self._hertz, self._values, self._patches, first, last,
                                     self.resolution, self.model, memory, self._work)  # fmt: skip
        if not windows:
            return 0, frame, self._strips[:, :0], np.full(SUMS, np.nan)
        count = publish(self.modulus, self._work, windows, self._strips, self._sums)
        return windows, frame, self._strips[:, :count].copy(), self._sums.copy()

    def at_load(self, side, y, load, roll=0.0, yaw=0.0, guess=None, vertical=True, velocity=None):
        """Patches of one wheel that carries a load (N), vertically or as the sum of its normal forces, and the height
        of the wheelset's centre (m; ``guess``: one near it), NaN with no patches where none was found.
        """
        if not 0.0 < load < math.inf:
            raise InputError("NormalContact", "load", f"expected a load in N, got {load!r}")

        def excess(z):
            patches = self.at_height(side, y, z, roll, yaw, warm=True)
            force = sum(p.normal_force * (math.cos(p.contact_angle) if vertical else 1.0) for p in patches)
            return force ** (2.0 / 3.0) - load ** (2.0 / 3.0)

        z = height_of_zero(excess, self.geometry.rolling_radius if guess is None else guess)
        return ([] if math.isnan(z) else self.at_height(side, y, z, roll, yaw, velocity)), z


def _mirrored(patch):
    """A patch of a left wheel as that of a right one, or the other way round."""
    arrays = {name: part[::-1] for name, part in vars(patch).items() if isinstance(part, np.ndarray)}
    for name in {"centre", "tilt", "place", "slip_s", "slip_s_dx"} & arrays.keys():
        arrays[name] = -arrays[name]
    arrays["window"] = arrays["window"].max(initial=0) - arrays["window"]
    x, y, z = patch.origin
    return replace(patch, origin=(x, -y, z), contact_angle=-patch.contact_angle, mean_s=-patch.mean_s,
                   s_min=-patch.s_max, s_max=-patch.s_min, **arrays)  # fmt: skip


def height_of_zero(excess, z, step=2e-5, most=60):
    """Zero of a function that falls with z, nearly linear near it: a bracket, then Illinois steps; NaN if lost."""
    low = high = math.nan
    e_low = e_high = 0.0
    last = 0
    for _ in range(most):
        e = excess(z)
        if math.isnan(e):
            return math.nan
        pressed = e > 0.0
        if pressed:
            low, e_low = z, e
            e_high *= 0.5 if last > 0 else 1.0
        else:
            high, e_high = z, e
            e_low *= 0.5 if last < 0 else 1.0
        if math.isnan(low) or math.isnan(high):
            z, step = z + (step if pressed else -step), 2.0 * step
            continue
        last = 1 if pressed else -1
        new = low + (high - low) * e_low / (e_low - e_high)
        if abs(new - z) < 1e-13 or high - low < 1e-13:
            return new
        z = new
    return math.nan
