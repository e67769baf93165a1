"""Influences on worn profiles: each setting and model compared with the finest, and its cost."""

import time

import numpy as np
import pandas as pd

from wrcore.analysis.wear.evolve import evolve, load_wear_plan, profiles_over_distance
from wrcore.analysis.wear.worn_profiles import POINTS

SEEDS = 100
"""Difference of the seeds of successive copies of a scene."""


def variant_changes(variant, distance):
    """Return the changes of a plan over a distance (m) for a variant of the configuration.

    The variant's ``set`` overrides the ``set`` of its ``plan``.
    """
    changes = {"distance": distance, **variant.get("plan", {})}
    return changes | {"set": changes.get("set", {}) | variant.get("set", {})}


def with_copies(plan, copies):
    """Return changes of a plan that replace each scene by ``copies`` scenes on different irregularities."""
    scenes = []
    for part in plan["scenes"]:
        for k in range(copies):
            changes = dict(part.get("set", {}))
            track = changes.get("track.irregularity")
            if track and "spectrum" in track:
                spectrum = track["spectrum"] | {"seed": track["spectrum"].get("seed", 0) + SEEDS * k}
                changes["track.irregularity"] = {**track, "spectrum": spectrum}
            scenes.append({"share": part["share"] / copies, "set": changes})
    return {"scenes": scenes}


def variant_depth(source, changes, folder, copies=1):
    """Return the wear of a wheel by a plan with changes: u and depth (m), table of `evolve`, and processor time (s).

    ``copies`` are those of `with_copies`.
    """
    plan, _ = load_wear_plan(source, changes)
    if copies > 1:
        changes = changes | with_copies(plan, copies)
    started = time.process_time()
    table = evolve(source, folder, changes=changes)
    seconds = time.process_time() - started
    profiles = profiles_over_distance(folder)
    return profiles[-1][1], profiles[-1][2] - profiles[0][2], table, seconds


def influence_table(found):
    """Return a table that compares worn profiles of `variant_depth`, by name, with the first of them.

    Columns are maximum depth (m), worn area (m^2), maximum deviation of the depth and deviation of the area, both
    relative to the first profile, conicity at the end, steps, and processor time (s).
    """
    u, first, _, _ = next(iter(found.values()))
    rows = []
    for name, (places, depth, table, seconds) in found.items():
        there = np.interp(u, places, depth)
        rows.append({
            "variant": name, "worn_max_m": depth.max(), "worn_area_m2": np.sum(depth) * POINTS,
            "depth_deviation": np.abs(there - first).max() / first.max(),
            "area_deviation": np.sum(depth) / np.sum(first) - 1.0,
            "equivalent_conicity": table["equivalent_conicity"].iloc[-1], "steps": len(table) - 1, "cpu_s": seconds,
        })  # fmt: skip
    return pd.DataFrame(rows)
