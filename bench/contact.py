"""What the contact search costs: ``python bench/contact.py [--quick]``.

Nanoseconds per wheel of the full search (nothing tracked: every call looks at all strips), on the tread and in flange
contact, planar and spatial, with both reductions; and per right-hand side. Planar and spatial take turns in one
process, compilation excluded; medians over paired passes, and the best pass. Set OPENBLAS_NUM_THREADS=1 for one core.
"""

import argparse
import time
from functools import partial
from pathlib import Path

import numpy as np

from wrcore._jit import jit
from wrcore.contact.detection import PLANAR, SPATIAL, axle_direction, find_patches
from wrcore.contact.geometry import contact_geometry
from wrcore.contact.normal import contact_modulus, hertz_table
from wrcore.contact.reduction import MAX_PATCHES, MOMENT, PATCH_COLUMNS, REDUCTIONS
from wrcore.contact.statics import height_at_load
from wrcore.dynamics.integrate import integrate
from wrcore.dynamics.system import fill_derivatives, workspace
from wrcore.geometry.standards import named_profile
from wrcore.geometry.track import Track
from wrcore.scene import compile_scene, load_scene

SCENES = Path(__file__).parent.parent / "config" / "scenes"
PLACES = {"tread": ((-0.003, 0.003), (-0.003, 0.003)), "flange": ((0.0068, 0.0078), (-0.015, 0.015))}
"""Ranges of lateral position (m) and yaw (rad) of the left wheel."""

LOAD = 5e4  # N per wheel
DETECTIONS = (PLANAR, SPATIAL)


@jit(allocates=False)
def search(geometry, poses, spatial, reduction, rows):
    """Patches of the left wheel at all poses; returns their number."""
    found = 0
    for i in range(poses.shape[0]):
        found += find_patches(geometry, 1.0, poses[i, 0], poses[i, 1], poses[i, 2], poses[i, 3], poses[i, 4], spatial,
                              reduction, rows)  # fmt: skip
    return found


@jit(allocates=False)
def evaluate(states, model, work, rate):
    """The right-hand side at all states."""
    for i in range(states.shape[0]):
        fill_derivatives(0.0, states[i], model, work, rate)


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
    work = workspace(model)
    times = np.linspace(0.0, 2.0, 401)
    trajectory = integrate(model, state, times)
    for label, states in (("tread (0 to 0.5 s)", trajectory.states[:100]), ("0 to 2 s", trajectory.states)):
        states = np.ascontiguousarray(np.tile(states, (repeat, 1)))
        rate = np.empty_like(state)
        models = [model._replace(contact=model.contact._replace(detection=d)) for d in DETECTIONS]
        calls = [partial(evaluate, states, m, work, rate) for m in models]
        report_row(f"right-hand side, {label}", time_in_turn(calls, passes, len(states)))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="fewer passes")
    passes = 5 if parser.parse_args().quick else 41
    print("S1002 on UIC60 1:40; ns per wheel [patches] and per right-hand side (two wheels): median (best)")
    print(f"{'':34s}{'planar':>18s}{'spatial':>18s}{'ratio':>10s}")
    report_search(passes, 2000)
    report_right_hand_side(passes, 20)


if __name__ == "__main__":
    main()
