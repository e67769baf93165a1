"""Test of the contact search by comparison with a dense search at random positions: missed and false patches.

The dense search evaluates a strip every 0.02 mm and refines small gaps. It skips no strip by a bound, so that it
cannot share an error in the bounds of the contact search. It costs some 100 µs per wheel.
``python -m tests.contact.search.dense_search`` prints the number of failures of a pair at a million positions.
"""

import argparse
import math

import numpy as np

from wrcore.contact.rigid.wheel_on_rail import WheelsetOnTrack
from wrcore.contact.search.detection import find_patches
from wrcore.contact.search.geometry import SCAN_STEP
from wrcore.contact.search.reduction import (
    ANGLE,
    CURVATURE_Y,
    MAX_PATCHES,
    PATCH_COLUMNS,
    PENETRATION,
    REDUCTIONS,
    U_WHEEL,
)  # fmt: skip
from wrcore.contact.search.strip import gap_at, make_pose
from wrcore.geometry.profiles.standards import named_profile
from wrcore.kernels.jit import jit

DENSE_STEP = 2e-5
"""Distance of the dense search's strips, m."""

SEPARATION = SCAN_STEP
"""Overlaps closer to one another than this may have a single patch, m; the distance of the search's nodes."""

DEPTH = 1e-7
"""Minimum normal penetration of overlaps that the search must find, m."""

POSE_RANGES = {"y": 0.012, "lift": 0.003, "roll": 0.010, "yaw": 0.030}
"""Random positions (m) and angles (rad) lie within ± these values."""

_MAX_OVERLAPS = 32
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
_CLOSE = 2e-6  # maximum depth of a minimum between two dense strips: M h^2/8 with M up to 1e4 1/m
_LOW, _HIGH, _DEPTH, _GROUP = range(4)
FOUND, MISSED, INVENTED, SPLIT, BAD = range(5)
OUTCOMES = ("found", "missed", "invented", "split", "bad number")


@jit
def _lowest(geometry, pose, low, high):
    """Return the strip of the minimum gap between two strips, its gap, and its depth along the rail's normal, m."""
    a, b = low, high
    c, d = b - _GOLDEN * (b - a), a + _GOLDEN * (b - a)
    gap_c, gap_d = gap_at(geometry, pose, c)[0], gap_at(geometry, pose, d)[0]
    while b - a > 1e-10:
        if gap_c < gap_d:
            b, d, gap_d = d, c, gap_c
            c = b - _GOLDEN * (b - a)
            gap_c = gap_at(geometry, pose, c)[0]
        else:
            a, c, gap_c = c, d, gap_d
            d = a + _GOLDEN * (b - a)
            gap_d = gap_at(geometry, pose, d)[0]
    u = 0.5 * (a + b)
    gap, slope = gap_at(geometry, pose, u)
    return u, gap, -gap / math.sqrt(1.0 + slope * slope)


@jit
def _note(overlaps, count, low, high, depth):
    """Append an overlap if the array is not full; return the new count."""
    if count < overlaps.shape[0]:
        overlaps[count, _LOW], overlaps[count, _HIGH], overlaps[count, _DEPTH] = low, high, depth
        return count + 1
    return count


@jit
def dense_overlaps(geometry, pose, overlaps):
    """Find all overlaps of one wheel by a dense search; return their number.

    Rows of ``overlaps`` (n, 4), from the flange to the field side, get first and last strip (m) and maximum depth along
    the rail's normal (m); the fourth column is not changed.
    """
    strips = int((geometry.wheel.shape[0] - 1) * geometry.wheel_step / DENSE_STEP) + 1
    count = 0
    first = last = depth = 0.0
    inside = False
    two_back = one_back = 1.0
    for k in range(strips + 1):
        u = geometry.wheel_start + k * DENSE_STEP
        gap, slope = gap_at(geometry, pose, u) if k < strips else (1.0, 0.0)
        if gap < 0.0:
            if not inside:
                inside, first, depth = True, u, 0.0
            last = u
            depth = max(depth, -gap / math.sqrt(1.0 + slope * slope))
        elif inside:
            inside = False
            count = _note(overlaps, count, first, last, depth)
        if 0.0 <= one_back < _CLOSE and one_back <= two_back and one_back <= gap:
            at, dip, deep = _lowest(geometry, pose, u - 2.0 * DENSE_STEP, u)
            if dip < 0.0:
                count = _note(overlaps, count, at, at, deep)
        two_back, one_back = one_back, gap
    return count


@jit
def _group(overlaps, count):
    """Write the group index of each overlap; return the number of groups of overlaps closer than `SEPARATION`."""
    group = 0
    for j in range(count):
        if j > 0 and overlaps[j, _LOW] - overlaps[j - 1, _HIGH] >= SEPARATION:
            group += 1
        overlaps[j, _GROUP] = group
    return group + 1 if count > 0 else 0


@jit
def _in_group(overlaps, count, group, u):
    """Whether a strip lies between the ends of a group of overlaps, within 1.5 steps of the dense search."""
    low, high = np.inf, -np.inf
    for j in range(count):
        if overlaps[j, _GROUP] == group:
            low, high = min(low, overlaps[j, _LOW]), max(high, overlaps[j, _HIGH])
    return low - 1.5 * DENSE_STEP <= u <= high + 1.5 * DENSE_STEP


@jit
def _sound(rows, count):
    """Return the index of the first invalid patch, or -1.

    Invalid are numbers that are not finite, no penetration, or a contact angle of 90° or more.
    """
    for i in range(count):
        fine = rows[i, PENETRATION] > 0.0 and abs(rows[i, ANGLE]) < 0.5 * math.pi
        for column in range(CURVATURE_Y + 1):
            fine = fine and math.isfinite(rows[i, column])
        if not fine:
            return i
    return -1


@jit
def judge(geometry, side, y, z, axle, spatial, reduction, rows, overlaps):
    """Compare the contact search with the dense search for one wheel.

    Arguments are those of :func:`wrcore.contact.search.detection.find_patches`; ``axle`` points outwards, ``overlaps``
    (n, 4) is a work array. Returned are the outcome, strip and depth (m) of the failing overlap or patch, and the
    number of overlaps deeper than `DEPTH`.

    The outcome is FOUND, MISSED (an overlap deeper than `DEPTH` without a patch in its group; only the MAX_PATCHES
    deepest overlaps are tested), INVENTED (a patch outside all groups), SPLIT (more patches in a group than overlaps)
    or BAD (a number that is not finite, no penetration, or a contact angle of 90° or more).
    """
    count = find_patches(geometry, side, y, z, axle[0], axle[1], axle[2], spatial, reduction, rows)
    bad = _sound(rows, count)
    if bad >= 0:
        return BAD, rows[bad, U_WHEEL], rows[bad, PENETRATION], 0
    there = dense_overlaps(geometry, make_pose(side, y, z, axle[0], axle[1], axle[2], spatial), overlaps)
    groups = _group(overlaps, there)
    expected = 0
    for j in range(there):
        expected += overlaps[j, _DEPTH] > DEPTH
    for j in range(there):
        depth, group = overlaps[j, _DEPTH], overlaps[j, _GROUP]
        inside = deeper = members = 0
        for i in range(count):
            inside += _in_group(overlaps, there, group, rows[i, U_WHEEL])
        for other in range(there):
            deeper += overlaps[other, _DEPTH] > depth
            members += overlaps[other, _GROUP] == group
        if inside == 0 and depth > DEPTH and deeper < MAX_PATCHES:
            return MISSED, overlaps[j, _LOW], depth, expected
        if inside > members:
            return SPLIT, overlaps[j, _LOW], depth, expected
    for i in range(count):
        inside = 0
        for group in range(groups):
            inside += _in_group(overlaps, there, group, rows[i, U_WHEEL])
        if inside == 0:
            return INVENTED, rows[i, U_WHEEL], rows[i, PENETRATION], expected
    return FOUND, 0.0, 0.0, expected


@jit
def _judge_all(geometry, poses, depths, spatial, reduction, outcomes, details):
    rows, overlaps = np.empty((MAX_PATCHES, PATCH_COLUMNS)), np.empty((_MAX_OVERLAPS, 4))
    for i in range(poses.shape[0]):
        y, roll, yaw = poses[i, 0], poses[i, 2], poses[i, 3]
        for wheel in range(2):
            side = 1.0 - 2.0 * wheel
            cosine = side * math.cos(roll)
            axle = (-cosine * math.sin(yaw), cosine * math.cos(yaw), side * math.sin(roll))
            z = poses[i, 1]
            if depths[i] > 0.0:  # lower this wheel to this depth of its deepest strip
                z = _touching(geometry, side, y, z, axle, spatial) - depths[i]
            outcome, where, depth, expected = judge(geometry, side, y, z, axle, spatial, reduction, rows, overlaps)
            outcomes[i, wheel] = outcome
            details[i, wheel, 0], details[i, wheel, 1], details[i, wheel, 2] = z, where, depth
            details[i, wheel, 3] = expected


@jit
def _touching(geometry, side, y, z, axle, spatial):
    """Return the height of first touch of the wheel, m, from strips every 0.1 mm; an error of 1 µm is acceptable."""
    pose = make_pose(side, y, z, axle[0], axle[1], axle[2], spatial)
    lowest = 1.0
    for k in range(int((geometry.wheel.shape[0] - 1) * geometry.wheel_step / 1e-4)):
        lowest = min(lowest, gap_at(geometry, pose, geometry.wheel_start + k * 1e-4)[0])
    return z - lowest


@jit
def _search_all(geometry, poses, spatial, reduction, counts):
    """Fill ``counts`` (n, 2) with the number of patches of both wheels at all positions; -1 for an invalid patch."""
    rows = np.empty((MAX_PATCHES, PATCH_COLUMNS))
    for i in range(poses.shape[0]):
        y, z, roll, yaw = poses[i]
        ex, ey, ez = -math.sin(yaw) * math.cos(roll), math.cos(yaw) * math.cos(roll), math.sin(roll)
        for wheel in range(2):
            side = 1.0 - 2.0 * wheel
            count = find_patches(geometry, side, y, z, side * ex, side * ey, side * ez, spatial, reduction, rows)
            counts[i, wheel] = count
            if _sound(rows, count) >= 0:
                counts[i, wheel] = -1


def random_poses(count, seed=0, nominal=0.46, ranges=None):
    """Return random positions of a wheelset, y, z (m), roll, yaw (rad), shape (count, 4).

    They are uniform in `POSE_RANGES` or other ranges; z is the nominal height (m) plus the lift.
    """
    half = [(POSE_RANGES | (ranges or {}))[name] for name in ("y", "lift", "roll", "yaw")]
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 4)) * half + [0.0, nominal, 0.0, 0.0]


def count_patches(geometry, poses, detection="spatial", reduction="moment"):
    """Return the number of patches per wheel, shape (n, 2), at positions (n, 4): y, z (m), roll, yaw (rad).

    The number is -1 if a patch has numbers that are not finite, no penetration, or a contact angle of 90° or more.
    """
    counts = np.empty((len(poses), 2), np.int64)
    _search_all(geometry, poses, detection == "spatial", REDUCTIONS[reduction], counts)
    return counts


def compare_with_dense(geometry, poses, detection="spatial", reduction="moment", depths=None):
    """Compare the contact search with the dense search at positions (n, 4): y, z (m), roll, yaw (rad).

    With ``depths`` (n,), m, each wheel is first lowered separately to this penetration. A row per wheel contains its
    position, side, outcome (found, missed, invented, split, bad number), u_wheel_m and depth_m of the failing patch or
    overlap, and the number of overlaps deeper than `DEPTH`.
    """
    import pandas as pd

    depths = np.zeros(len(poses)) if depths is None else np.asarray(depths, dtype=float)
    outcomes, details = np.empty((len(poses), 2), np.int64), np.empty((len(poses), 2, 4))
    _judge_all(geometry, poses, depths, detection == "spatial", REDUCTIONS[reduction], outcomes, details)
    wheels = np.repeat(np.asarray(poses), 2, axis=0)
    return pd.DataFrame(
        {"y_m": wheels[:, 0], "z_m": details[..., 0].ravel(), "roll_rad": wheels[:, 2], "yaw_rad": wheels[:, 3],
         "side": np.tile(["left", "right"], len(poses)), "outcome": np.array(OUTCOMES)[outcomes.ravel()],
         "u_wheel_m": details[..., 1].ravel(), "depth_m": details[..., 2].ravel(),
         "overlaps": details[..., 3].ravel().astype(int)}
    )  # fmt: skip


def search_table(geometry, poses, dense, seed=0):
    """Count failures of the contact search at random positions, a row per detection and reduction.

    Invalid patches are counted at ``poses`` positions. Missed, false and split patches are counted at ``dense``
    positions, and at as many with wheels lowered to small penetrations between `DEPTH` and 0.5 mm.
    """
    import pandas as pd

    depths = 10.0 ** np.random.default_rng(seed + 1).uniform(math.log10(DEPTH), -3.3, dense)
    rows = []
    for detection in ("planar", "spatial"):
        for reduction in REDUCTIONS:
            counts = count_patches(geometry, random_poses(poses, seed), detection, reduction)
            compared = pd.concat(
                compare_with_dense(geometry, random_poses(dense, seed + 2), detection, reduction, lowered)
                for lowered in (None, depths)
            )
            row = {"detection": detection, "reduction": reduction, "wheels_searched": counts.size}
            row |= {"bad": int((counts < 0).sum() + (compared.outcome == OUTCOMES[BAD]).sum())}
            row |= {"wheels_compared": len(compared), "overlaps": int(compared.overlaps.sum())}
            row |= {"wheels_with_several": int((compared.overlaps > 1).sum())}
            outcomes = {OUTCOMES[k]: int((compared.outcome == OUTCOMES[k]).sum()) for k in (MISSED, INVENTED, SPLIT)}
            rows.append(row | outcomes)
    return pd.DataFrame(rows)


def main():
    """Print the number of failures of S1002 on UIC60 at 1:40, by detection and reduction."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--poses", type=int, default=1_000_000, help="positions whose patches must be finite")
    parser.add_argument("--dense", type=int, default=5000, help="positions that the dense search also evaluates")
    chosen = parser.parse_args()
    wheel, rail = named_profile("S1002", "wheel"), named_profile("UIC60-MBench", "rail", 1 / 40)
    print(search_table(WheelsetOnTrack.alike(wheel, rail).left.geometry, chosen.poses, chosen.dense).to_string())


if __name__ == "__main__":
    main()
