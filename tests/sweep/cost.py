"""What a sweep's run costs beside its integration: ``python -m tests.sweep.cost [runs]``.

For each scene of reports/sweeps.md: processor time per run in the integration and in everything else, in one process
and one thread, and the gain of two threads on the clock, which means something on an idle machine only.
"""

import sys
import time
from unittest import mock

import numpy as np

from wrcore.sweep import batch
from wrcore.sweep.plan import load_sweep

SCENES = ("wheelset", "suspended_wheelset", "trailer_vehicle")


def sweep_of(scene, runs):
    """Keys and measures of config/sweeps/wheelset_hunting.yaml on another scene."""
    return load_sweep({
        "name": scene, "scene": f"config/scenes/{scene}.yaml",
        "set": {"contact.patch": "moment", "integration.duration": 1.0},
        "sampling": {"kind": "latin_hypercube", "runs": runs, "seed": 1},
        "keys": {"speed": {"from": 15.0, "to": 75.0}, "initial.y": {"from": -0.004, "to": 0.004},
                 "contact.friction": {"from": 0.1, "to": 0.5}},
        "measures": ["y_rms_m", "y_max_m", "amplitude_m", "yaw_max_rad", "steps", "rhs_evaluations"], "window": 0.3,
    })  # fmt: skip


def quietly(tasks):
    """No bar: every line it writes would be counted."""
    return tasks


def measured(sweep):
    """Processor time per run, s: in the integration, and in everything else; right-hand sides per run."""
    inside = []

    def timed(*arguments, **settings):
        started = time.thread_time()
        trajectory = integrate(*arguments, **settings)
        inside.append(time.thread_time() - started)
        return trajectory

    integrate = batch.integrate
    with mock.patch.object(batch, "integrate", timed):
        started = time.process_time()
        table = batch.run_sweep(sweep, progress=quietly)
        whole = time.process_time() - started
    return np.sum(inside) / len(table), (whole - np.sum(inside)) / len(table), table["rhs_evaluations"].mean()


def on_the_clock(sweep, threads):
    """Seconds that a sweep takes."""
    started = time.perf_counter()
    batch.run_sweep(sweep, threads=threads, progress=quietly)
    return time.perf_counter() - started


def main():
    """Print a line per scene."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 400
    print("scene, evaluations per run, integration (ms), everything else (ms), share (%), gain of two threads")
    for scene in SCENES:
        batch.run_sweep(sweep_of(scene, 8), progress=quietly)  # kernels, table, statics
        sweep = sweep_of(scene, runs)
        inside, beside, evaluations = np.median([measured(sweep) for _ in range(3)], axis=0)
        gain = np.median([on_the_clock(sweep, 1) / on_the_clock(sweep, 2) for _ in range(3)])
        times = f"{1e3 * inside:.2f}, {1e3 * beside:.2f}, {100.0 * beside / (inside + beside):.1f}"
        print(f"{scene}, {evaluations:.0f}, {times}, {gain:.2f}", flush=True)


if __name__ == "__main__":
    main()
