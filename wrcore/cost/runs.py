"""What runs lose: time outside the integration in a batch, and rejected steps."""

import cProfile
import pstats
import time
from pathlib import Path

import numpy as np
import pandas as pd

from wrcore.dynamics.integrate import integrate
from wrcore.scene import compile_scene, load_scene
from wrcore.simulate import output_times, simulate_many

SMOOTH = 0.1
"""Part of rejected steps that a smooth scene may have."""


def batch_table(source, overrides, speeds, passes, functions=8):
    """Where the time of a batch of runs in one process goes.

    Parameters
    ----------
    source, overrides
        Scene, as for :func:`wrcore.scene.load_scene`.
    speeds : sequence of float
        One run each, m/s.
    passes : int
        Batches; one more before them warms up and another one afterwards is profiled.
    functions : int
        Rows for the functions that take most of the profiled batch.

    Returns
    -------
    pandas.DataFrame
        part, seconds (median over the passes) and share of the whole: the whole, integration, reading and checking the
        scenes, and the rest (compiling scenes, output channels). Then the functions with their own time, profiled.
    """

    def batch():
        started = time.perf_counter()
        scenes = [load_scene(source, [*overrides, f"speed={speed:g}"]) for speed in speeds]
        loaded = time.perf_counter()
        runs = simulate_many(scenes, progress=False)
        integration = sum(run.counters["wall_s"] for run in runs)
        ended = time.perf_counter()
        return ended - started, integration, loaded - started, ended - loaded - integration

    batch()
    whole, *parts = np.median([batch() for _ in range(passes)], axis=0)
    names = ("integration", "reading scenes", "compiling scenes, output")
    rows = [{"part": "whole batch", "seconds": whole, "share": 1.0}]
    rows += [{"part": name, "seconds": part, "share": part / whole} for name, part in zip(names, parts, strict=True)]
    profile = cProfile.Profile()
    profile.runcall(batch)
    return pd.DataFrame(rows + _functions(profile, functions))


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
    """Rejected steps of every method on scenes.

    Parameters
    ----------
    scenes : dict of str to Scene
        By title.
    methods : sequence of str
    tolerances : sequence of float
        Relative; absolute ones are a thousandth of them.

    Returns
    -------
    pandas.DataFrame
        scene, method, rtol, status, steps, rejected, their share of all attempts, and whether it keeps ``SMOOTH``.
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
