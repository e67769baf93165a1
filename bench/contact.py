"""What the contact costs: ``python bench/contact.py [--quick]``.

Nanoseconds per wheel of the full search (nothing tracked: what is left out is known to be far), on the tread and in
flange contact, planar and spatial, with both reductions; and per right-hand side. Planar and spatial take turns in one
process, compilation excluded; medians over paired passes, and the best pass. Set OPENBLAS_NUM_THREADS=1 for one core.

Then a wheel's forces stage by stage, each stage in a loop of its own over the same wheels. What a stage costs in the
chain is more, as it waits for the one before, so that "rest" is what the stages alone do not explain.
"""

import argparse
import time
from functools import partial
from pathlib import Path

import numpy as np

from wrcore._jit import FUSED, jit
from wrcore._lanes import lanes8, ramp8, total
from wrcore.contact import reduction as columns
from wrcore.contact.creepage import creepages
from wrcore.contact.detection import PLANAR, SPATIAL, axle_direction, find_patches
from wrcore.contact.geometry import LANES, contact_geometry
from wrcore.contact.normal import contact_modulus, damping_factor, hertz_shape_at, hertz_table, inverse_cube_root
from wrcore.contact.reduction import MAX_PATCHES, MOMENT, PATCH_COLUMNS, REDUCTIONS
from wrcore.contact.scan import first_zone, make_window, near_blocks, scan
from wrcore.contact.statics import height_at_load
from wrcore.contact.strip import make_pose
from wrcore.creep.laws import creep_force_at
from wrcore.dynamics.integrate import integrate
from wrcore.dynamics.system import Equations
from wrcore.dynamics.wheel import MOTION_COLUMNS, wheel_wrenches
from wrcore.geometry.standards import named_profile
from wrcore.geometry.track import Track
from wrcore.scene import compile_scene, load_scene

SCENES = Path(__file__).parent.parent / "config" / "scenes"
PLACES = {"tread": ((-0.003, 0.003), (-0.003, 0.003)), "flange": ((0.0068, 0.0078), (-0.015, 0.015))}
"""Ranges of lateral position (m) and yaw (rad) of the left wheel."""

LOAD = 5e4  # N per wheel
DETECTIONS = (PLANAR, SPATIAL)
BATCH = 8
FLOPS_PER_STRIP, BYTES_PER_STRIP = 37, 88
"""Of the scan: 3 + 3 + 3 + 3 fused products, 1 difference, 5 for the moments, 1 + 1 for the reserve (a fused one counts
two); eleven numbers loaded."""


@jit(allocates=False)
def search(geometry, poses, spatial, reduction, rows):
    """Patches of the left wheel at all poses; returns their number."""
    found = 0
    for i in range(poses.shape[0]):
        found += find_patches(geometry, 1.0, poses[i, 0], poses[i, 1], poses[i, 2], poses[i, 3], poses[i, 4], spatial,
                              reduction, rows)  # fmt: skip
    return found


def loaded_poses(geometry, place, count):
    """y, z and axle direction of wheels that carry `LOAD` (to 20 %) at a place, in random order."""
    rng = np.random.default_rng(0)
    (low, high), (least, most) = PLACES[place]
    rows, modulus = np.empty((MAX_PATCHES, PATCH_COLUMNS)), contact_modulus(8.2e10, 0.28)
    poses = []
    for _ in range(count):
        y, yaw, load = rng.uniform(low, high), rng.uniform(least, most), LOAD * rng.uniform(0.8, 1.2)
        z = height_at_load(geometry, hertz_table(), modulus, 1.0, y, 0.0, yaw, True, MOMENT, load, 0.46, rows)
        poses.append([y, z, *axle_direction(0.0, yaw)])
    return np.array(poses)


def time_in_turn(calls, passes, units):
    """Nanoseconds per unit, shape (passes, calls): the calls take turns; one turn before them is not counted."""
    times = np.empty((passes + 1, len(calls)))
    for row in times:
        for k, call in enumerate(calls):
            start = time.process_time()
            call()
            row[k] = time.process_time() - start
    return 1e9 * times[1:] / units


def report_row(label, times):
    """One line: median and best of planar and spatial, and the median of the paired ratios."""
    median, best = np.median(times, axis=0), times.min(axis=0)
    ratio = np.median(times[:, 1] / times[:, 0])
    columns = [f"{m:8.0f} ({b:.0f})" for m, b in zip(median, best, strict=True)]
    print(f"{label:34s}" + "".join(f"{column:>18s}" for column in columns) + f"{ratio:10.3f}", flush=True)


def report_search(passes, count):
    """The full search per place and reduction."""
    profiles = named_profile("S1002", "wheel"), named_profile("UIC60-MBench", "rail", 1 / 40)
    geometry = contact_geometry(*profiles, Track(1.435), 0.46, 0.75)
    rows = np.empty((MAX_PATCHES, PATCH_COLUMNS))
    for place in PLACES:
        poses = loaded_poses(geometry, place, count)
        for name, reduction in REDUCTIONS.items():
            calls = [partial(search, geometry, poses, d == SPATIAL, reduction, rows) for d in DETECTIONS]
            found = calls[1]() / count
            report_row(f"search, {place}, {name} [{found:.2f}]", time_in_turn(calls, passes, count))


def report_right_hand_side(passes, repeat):
    """One evaluation of the free wheelset's equations, on the tread and over flange impacts."""
    scene = load_scene(SCENES / "wheelset.yaml", ["contact.patch=moment"])
    model, state = compile_scene(scene)
    times = np.linspace(0.0, 2.0, 401)
    trajectory = integrate(model, state, times)
    for label, states in (("tread (0 to 0.5 s)", trajectory.states[:100]), ("0 to 2 s", trajectory.states)):
        states = np.ascontiguousarray(np.tile(states, (repeat, 1)))
        models = [model._replace(contact=model.contact._replace(detection=d)) for d in DETECTIONS]
        calls = [partial(Equations(m).at, 0.0, states) for m in models]
        report_row(f"right-hand side, {label}", time_in_turn(calls, passes, len(states)))


@jit(allocates=False)
def run_bounds(geometry, motions, _):
    """Pose, window and near blocks of all wheels."""
    found = 0
    for m in motions:
        window = make_window(geometry, make_pose(m[0], m[1], m[2], m[3], m[4], m[5], True))
        found += near_blocks(geometry, window)
    return found


@jit(allocates=False)
def run_scan(geometry, motions, counts):
    """The same, and the scan of the zones; ``counts[0]``: strips."""
    counts[0], found = 0, 0.0
    for m in motions:
        window = make_window(geometry, make_pose(m[0], m[1], m[2], m[3], m[4], m[5], True))
        near = near_blocks(geometry, window)
        while near > 0:
            begin, end, near = first_zone(near, geometry.block)
            found += scan(window, geometry.scan_wheel, geometry.scan_rail, begin, end)[0]
            counts[0] += end - begin
    return found


@jit(allocates=False)
def run_search(model, motions, patches):
    """Patches of all wheels."""
    found = 0
    for i in range(motions.shape[0]):
        m = motions[i]
        found += find_patches(model.geometry, m[0], m[1], m[2], m[3], m[4], m[5], True, model.reduction, patches[i])
    return found


@jit(allocates=False, fastmath=FUSED)
def run_hertz(model, motions, patches):
    """Creepages, Hertz and damping of the first patch of all wheels."""
    found = 0.0
    for i in range(motions.shape[0]):
        m, row = motions[i], patches[i, 0]
        arm = row[columns.X], row[columns.Y] - m[1], row[columns.Z] - m[2]
        cosine, sine = row[columns.COSINE], row[columns.SINE]
        xi, eta, phi, approach = creepages(m[6], m[7], m[8], m[9], m[10], m[11], *arm, cosine, sine, m[6])
        stiffness, a, b, log_axis_ratio = hertz_shape_at(
            model.hertz, row[columns.CURVATURE_X], row[columns.CURVATURE_Y]
        )
        inverse = inverse_cube_root(damping_factor(approach, model.damping, model.damping_speed))
        found += xi + eta + phi + stiffness + a + b + log_axis_ratio + inverse
    return found


@jit(allocates=False)
def run_creep(model, motions, patches):
    """Creep forces of the first patch of all wheels."""
    found = 0.0
    for i in range(motions.shape[0]):
        row = patches[i, 0]
        square, limit = row[columns.SEMI_A] * row[columns.SEMI_B], model.friction * row[columns.NORMAL]
        axis_ratio, scale = row[columns.SEMI_A] / row[columns.SEMI_B], model.shear_modulus * square / limit
        f1, f2, m3, _ = creep_force_at(
            model.law, model.creep, 0.3, axis_ratio, 0.0, row[columns.XI] * scale, row[columns.ETA] * scale,
            row[columns.PHI] * scale * 5e-3,
        )  # fmt: skip
        found += f1 + f2 + m3
    return found


@jit(allocates=False)
def run_batch(model, motions, patches, counts, bounds, wrenches):
    """Wrenches of all wheels, ``BATCH`` in one call."""
    for i in range(0, motions.shape[0], BATCH // 2):
        wheels = slice(i, i + BATCH // 2)
        wheel_wrenches(model, motions[wheels], patches[wheels], counts[wheels], bounds[wheels], wrenches[wheels])


@jit(fastmath=FUSED)
def multiply_and_add(count):
    """Sums of twelve independent chains of ``count`` fused products of eight numbers."""
    a = b = c = d = e = f = g = h = i = j = k = m = ramp8()
    x, y = lanes8(0.999999), lanes8(1e-6)
    for _ in range(count):
        a, b, c, d, e, f = a * x + y, b * x + y, c * x + y, d * x + y, e * x + y, f * x + y
        g, h, i, j, k, m = g * x + y, h * x + y, i * x + y, j * x + y, k * x + y, m * x + y
    return total(a + b + c + d + e + f + g + h + i + j + k + m)


def rolling_motions(poses):
    """Motions for `wheel_wrenches`: left wheels that roll at 20 m/s with small creepages."""
    rng = np.random.default_rng(1)
    motions = np.zeros((len(poses), MOTION_COLUMNS))
    motions[:, 0], motions[:, 1:6], motions[:, 6] = 1.0, poses, 20.0
    motions[:, 7] = -poses[:, 2] * 20.0 * rng.uniform(0.5, 1.1, len(poses))
    motions[:, 8:12] = [2e-3, 1e-2, 2e-2, 1e-2] * rng.normal(size=(len(poses), 4)) + [0.0, 0.0, 20.0 / 0.46, 0.0]
    return motions


def report_stages(passes, count):
    """The wrench of a wheel by the creep table and the moment reduction, stage by stage."""
    model = compile_scene(load_scene(SCENES / "wheelset.yaml", ["contact.patch=moment", "contact.creep.model=table"]))[
        0
    ]
    contact = model.contact
    peak = 1e-9 * 2 * 12 * LANES * 10**6 / best_seconds(partial(multiply_and_add, 10**6))
    print(
        f"\na wheel's wrench, spatial, moment, table; ns per wheel: median (best). Fused products: {peak:.0f} Gflop/s"
    )
    names = ("bounds", "scan", "patch", "Hertz", "creep", "rest", "in all")
    print(f"{'':10s}" + "".join(f"{name:>14s}" for name in names) + "   scan: strips, Gflop/s, of the peak, GB/s")
    for place in PLACES:
        motions = rolling_motions(loaded_poses(contact.geometry, place, count))
        patches, counts = np.zeros((count, MAX_PATCHES, PATCH_COLUMNS)), np.zeros(count, np.int64)
        half = count // 2, 2
        results = patches.reshape(*half, *patches.shape[1:]), counts.reshape(half), np.zeros(half), np.zeros((*half, 6))
        calls = [partial(run, contact.geometry, motions, counts) for run in (run_bounds, run_scan)]
        calls += [partial(run, contact, motions, patches) for run in (run_search, run_hertz, run_creep)]
        run_scan(contact.geometry, motions, counts)
        strips = counts[0] / count
        times = time_in_turn([partial(run_batch, contact, motions.reshape(*half, -1), *results), *calls], passes, count)
        batch, bounds, scanned, search, hertz, creep = times.T
        rest = batch - search - hertz - creep
        stages = bounds, scanned - bounds, search - scanned, hertz, creep, rest, batch
        seconds = 1e-9 * np.median(scanned - bounds)
        rate = 1e-9 * strips * FLOPS_PER_STRIP / seconds
        print(f"{place:10s}" + "".join(f"{np.median(t):8.0f} ({t.min():3.0f})" for t in stages)
              + f"   {strips:.0f}, {rate:.0f}, {100 * rate / peak:.0f} %, "
              f"{1e-9 * strips * BYTES_PER_STRIP / seconds:.0f}", flush=True)  # fmt: skip


def best_seconds(call, repeat=5):
    """Least time of a call, s."""
    best = np.inf
    for _ in range(repeat):
        start = time.process_time()
        call()
        best = min(best, time.process_time() - start)
    return best


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="fewer passes")
    passes = 5 if parser.parse_args().quick else 41
    print("S1002 on UIC60 1:40; ns per wheel [patches] and per right-hand side (two wheels): median (best)")
    print(f"{'':34s}{'planar':>18s}{'spatial':>18s}{'ratio':>10s}")
    report_search(passes, 2000)
    report_right_hand_side(passes, 20)
    report_stages(passes, 2000)


if __name__ == "__main__":
    main()
