"""What runs lose: time outside the integration in a batch, and rejected steps."""

import cProfile
import pstats
import time
from pathlib import Path

import numpy as np
import pandas as pd

from wrcore.errors.checked_yaml import parse_value
from wrcore.integrate.integrator import integrate
from wrcore.run.simulate import output_times, simulate_many
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.sweep.batch import run_sweep
from wrcore.sweep.plan import load_sweep

SMOOTH = 0.1
"""Part of rejected steps that a smooth scene may have."""


def batch_table(source, overrides, speeds, passes, functions=8):
    """Where the time of a batch of runs, one per speed (m/s), in one process goes, as a sweep and as runs with all
    their channels: seconds (median over the passes) and share of the whole, of integration and of what is not, then of
    the ``functions`` that take most, with their own times, in a profiled batch.
    """
    changes = dict(change.partition("=")[::2] for change in overrides)
    sweep = load_sweep({
        "name": "batch", "scene": str(source), "set": {key: parse_value(text) for key, text in changes.items()},
        "sampling": {"kind": "grid"}, "keys": {"speed": {"values": [float(v) for v in speeds]}},
        "measures": ["y_max_m", "wall_s"],
    })  # fmt: skip

    def as_sweep():
        return float(run_sweep(sweep, progress=iter)["wall_s"].sum())

    def as_runs():
        scenes = [load_scene(source, [*overrides, f"speed={speed:g}"]) for speed in speeds]
        return sum(run.counters["wall_s"] for run in simulate_many(scenes, progress=False))

    rows = []
    for name, batch in (("sweep", as_sweep), ("runs", as_runs)):
        batch()
        whole, integration = np.median([_timed(batch) for _ in range(passes)], axis=0)
        for part, seconds in (("whole", whole), ("integration", integration), ("all else", whole - integration)):
            rows.append({"batch": name, "part": part, "seconds": seconds, "share": seconds / whole})
        profile = cProfile.Profile()
        profile.runcall(batch)
        rows += [{"batch": name} | row for row in _functions(profile, functions)]
    return pd.DataFrame(rows)


def _timed(batch):
    """Seconds by the wall of a batch, and of the integrations in it."""
    started = time.perf_counter()
    integration = batch()
    return time.perf_counter() - started, integration


def _functions(profile, count):
    """Rows of the functions with the longest own times."""
    stats = pstats.Stats(profile).stats
    total = sum(entry[2] for entry in stats.values())
    longest = sorted(stats.items(), key=lambda item: -item[1][2])[:count]
    return [
        {"part": f"profiled: {Path(file).name}:{name}", "seconds": entry[2], "share": entry[2] / total}
        for (file, _, name), entry in longest
    ]


def rejection_table(scenes, methods, tolerances):
    """Rejected steps of every method and relative tolerance (absolute ones a thousandth) on scenes by title, their
    share of all attempts, and whether it keeps ``SMOOTH``.
    """
    rows = []
    for title, scene in scenes.items():
        model, start = compile_scene(scene)
        times = output_times(0.0, scene.data["integration"]["duration"], scene.data["output"]["rate"])
        for method in methods:
            for rtol in tolerances:
                run = integrate(model, start, times, method, rtol, 1e-3 * rtol)
                share = run.rejected / max(run.steps + run.rejected, 1)
                row = {"scene": title, "method": method, "rtol": rtol, "status": run.status, "steps": run.steps}
                rows.append(row | {"rejected": run.rejected, "share": share, "smooth": share <= SMOOTH})
    return pd.DataFrame(rows)
