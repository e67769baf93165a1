"""Computing time over number of wheelsets, duration, tolerance, and number of simultaneous scenes."""

import time
from pathlib import Path

import numpy as np
import pandas as pd

from study.cost.recorded import evaluation, record
from study.cost.timing import Contender, summary, take_turns
from wrcore.equations.model import workspace
from wrcore.integrate.integrator import integrate
from wrcore.run.simulate import output_times, simulate_many
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

BEYOND_ARITHMETIC = 1.25
"""Time per evaluation and wheelset over its minimum above which arithmetic alone does not explain the time."""


def array_bytes(part):
    """Return the bytes of all arrays in a tuple of arrays, tuples and numbers; each array is counted once."""
    found = {}

    def collect(item):
        """Add the arrays in an item to ``found``."""
        if isinstance(item, np.ndarray):
            found[item.__array_interface__["data"][0]] = item.nbytes
        elif isinstance(item, tuple):
            for inner in item:
                collect(inner)

    collect(part)
    return sum(found.values())


def cache_sizes():
    """Return sizes of the first core's data caches, bytes, by name (L1, L2, L3); empty if they are unknown."""
    sizes = {}
    for folder in sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        if (folder / "type").read_text().strip() != "Instruction":
            size = (folder / "size").read_text().strip()
            sizes["L" + (folder / "level").read_text().strip()] = int(size.rstrip("K")) * 1024
    return sizes


def over_wheelsets(title, source, overrides, *, spacing, counts, duration, states, passes):
    """Time evaluations of the right-hand side and runs of trains of ``counts`` vehicles, ``spacing`` (m) apart.

    The vehicle is that of a scene on tangent track without irregularity; runs have a duration (s).

    A row per train contains bodies and wheelsets; microseconds per evaluation of the right-hand side, alone and in a
    run with the work of the integrator, each with quartiles and per wheelset; real-time factor; bytes of data that
    belong to individual wheelsets or bodies (``own_bytes``) and of shared data (``shared_bytes``).
    """
    recorded, runs, rows = [], [], []
    for count in counts:
        train = [f"vehicle.count={count}", f"integration.duration={duration}"]
        train += [f"vehicle.spacing={spacing}"] if count > 1 else []
        scene = load_scene(source, [*overrides, *train])
        found = record(scene, duration, states)
        start = compile_scene(scene)[1]
        run = _run(found.model, start, scene.data["integration"], output_times(0.0, duration, 200.0))
        recorded.append(evaluation("", found))
        trajectory = run()
        runs.append(Contender("", run, trajectory.rhs_evaluations))
        wheelsets = len(found.model.bodies.wheelsets)
        facts = {"scene": title, "vehicles": count, "bodies": len(found.model.bodies.mass), "wheelsets": wheelsets}
        facts |= {"evaluations_per_s": trajectory.rhs_evaluations / duration} | _bytes(found.model, trajectory)
        rows.append(facts | {"real_time_factor": np.nan, "duration_s": duration})
    for name, contenders in (("evaluation", recorded), ("run", runs)):
        for row, timed in zip(rows, summary("", "", counts, take_turns(contenders, passes)), strict=True):
            row |= {f"{name}_us{part}": timed[f"time{part}"] for part in ("", "_low", "_high")}
            row[f"{name}_us_per_wheelset"] = timed["time"] / row["wheelsets"]
    for row in rows:
        row["real_time_factor"] = 1e6 / (row["evaluations_per_s"] * row["run_us"])
    return pd.DataFrame(rows)


def _run(model, start, settings, times):
    return lambda: integrate(model, start, times, settings["method"], settings["rtol"], settings["atol"])


def _bytes(model, trajectory):
    """Return bytes of data shared by all wheelsets, and of data that belong to individual bodies and wheelsets."""
    shared = array_bytes(model.contact)
    own = array_bytes((model, workspace(model), trajectory.end.memory)) - shared
    return {"own_bytes": own, "shared_bytes": shared}


def over_runs(title, source, overrides, *, durations, tolerances, passes):
    """Time runs over their duration (s) and over their relative tolerance (absolute tolerance: a thousandth of it).

    Columns: name and value of the varied quantity, evaluations, steps, rejected steps, milliseconds, microseconds per
    evaluation, real-time factor.
    """
    scene = load_scene(source, overrides)
    model, start = compile_scene(scene)
    settings = scene.data["integration"]
    varied = [("duration_s", d, {"duration": d}) for d in durations]
    varied += [("rtol", r, {"rtol": r, "atol": 1e-3 * r}) for r in tolerances]
    contenders, rows = [], []
    for name, value, change in varied:
        changed = {**settings, **change}
        run = _run(model, start, changed, output_times(0.0, changed["duration"], 200.0))
        trajectory = run()
        row = {"scene": title, "varied": name, "value": value, "simulated_s": changed["duration"]}
        rows.append(row | {key: getattr(trajectory, key) for key in ("rhs_evaluations", "steps", "rejected")})
        contenders.append(Contender(f"{name} {value:g}", run))
    labels = [contender.label for contender in contenders]
    for row, timed in zip(rows, summary("", "", labels, take_turns(contenders, passes), "ms"), strict=True):
        row |= {f"run_ms{part}": timed[f"time{part}"] for part in ("", "_low", "_high")}
        row["us_per_evaluation"] = 1e3 * row["run_ms"] / row["rhs_evaluations"]
        row["real_time_factor"] = 1e3 * row["simulated_s"] / row["run_ms"]
    return pd.DataFrame(rows)


def over_scenes(title, source, overrides, *, counts, threads, passes):
    """Time several scenes of different speed in one process, a row per number of scenes and number of threads.

    Columns: wall time per scene (ms) with quartiles, speed-up relative to the first number of threads, mean number of
    processors used (reduced by other work on the machine), and whether all results are bitwise identical to those of
    single runs.
    """
    scenes = [load_scene(source, [*overrides, f"speed={speed:g}"]) for speed in np.linspace(30.0, 55.0, max(counts))]
    alone = [simulate_many([scene], progress=False)[0] for scene in scenes]
    rows = []
    for count in counts:
        results, spent = {}, {at_once: [] for at_once in threads}

        def together(at_once, count=count, results=results, spent=spent):
            """Run the scenes with ``at_once`` threads; record their results and their processor and wall time."""
            began = time.process_time(), time.perf_counter()
            results[at_once] = simulate_many(scenes[:count], progress=False, threads=at_once)
            spent[at_once].append((time.process_time() - began[0], time.perf_counter() - began[1]))

        contenders = [Contender(n, lambda n=n, together=together: together(n), count) for n in threads]
        timed = summary("", "", threads, take_turns(contenders, passes, time.perf_counter), "ms")
        for at_once, found in zip(threads, timed, strict=True):
            row = {"scene": title, "scenes": count, "threads": at_once, "faster": 1.0 / found["ratio"]}
            row |= {f"scene_ms{part}": found[f"time{part}"] for part in ("", "_low", "_high")}
            processor, wall = np.sum(spent[at_once], axis=0)
            row["processors"] = processor / wall
            same = all(identical(*pair) for pair in zip(results[at_once], alone[:count], strict=True))
            rows.append(row | {"identical": same})
    return pd.DataFrame(rows)


def identical(run, other):
    """Whether two runs have the same status and bitwise identical numbers in all channels."""
    if run.status != other.status or run.groups.keys() != other.groups.keys():
        return False
    pairs = [(run.groups[g][c], other.groups[g][c]) for g in run.groups for c in run.groups[g]]
    return all(np.array_equal(one, two, equal_nan=True) for one, two in [(run.t, other.t), *pairs])


def findings(wheelsets, caches):
    """Return the size of a train above which arithmetic alone does not explain the time, a row per scene.

    Columns, from :func:`over_wheelsets`: minimum and maximum time per evaluation and wheelset (µs), wheelsets of the
    smallest train above ``BEYOND_ARITHMETIC`` times the minimum, bytes of the longest train with its shared data, and
    the smallest cache (:func:`cache_sizes`) that is large enough for them.
    """
    rows = []
    for scene, part in wheelsets.groupby("scene", sort=False):
        each = part["evaluation_us_per_wheelset"]
        slow = part[each > BEYOND_ARITHMETIC * each.min()]
        total = int((part["own_bytes"] + part["shared_bytes"]).iloc[-1])
        holds = [name for name, size in caches.items() if size >= total]
        rows.append({
            "scene": scene, "least_us_per_wheelset": each.min(), "most_us_per_wheelset": each.max(),
            "wheelsets_beyond_arithmetic": int(slow["wheelsets"].min()) if len(slow) else "none",
            "longest_train_bytes": total, "held_by": holds[0] if holds else "memory",
        })  # fmt: skip
    return pd.DataFrame(rows)
