"""Overhead of runs: time outside the integration in a batch, and rejected steps."""

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
"""Maximum share of rejected steps in a smooth scene."""


def batch_table(source, overrides, speeds, passes, functions=8):
    """Return the time of a batch of runs in one process, one run per speed (m/s), split into parts.

    The batch runs as a sweep, and as runs with all channels. Rows contain seconds (median over the passes) and share
    of the whole batch, of the integration and of all other work. Further rows are the ``functions`` with the longest
    times, without the functions that they call, in a profiled batch.
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
    """Return the wall time of a batch and the wall time of the integrations in it, s."""
    started = time.perf_counter()
    integration = batch()
    return time.perf_counter() - started, integration


def _functions(profile, count):
    """Return rows of the functions with the longest times, without the functions that they call."""
    stats = pstats.Stats(profile).stats
    total = sum(entry[2] for entry in stats.values())
    longest = sorted(stats.items(), key=lambda item: -item[1][2])[:count]
    return [
        {"part": f"profiled: {Path(file).name}:{name}", "seconds": entry[2], "share": entry[2] / total}
        for (file, _, name), entry in longest
    ]


def rejection_table(scenes, methods, tolerances):
    """Return the number of rejected steps of scenes (by title) for all methods and relative tolerances.

    Absolute tolerances are a thousandth of the relative tolerances. Columns include the share of rejected steps in all
    attempts, and ``smooth``, whether this share is at most ``SMOOTH``.
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
