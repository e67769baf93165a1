"""Influences on worn profiles: each setting and model against the finest, with what it costs."""

import time

import numpy as np
import pandas as pd

from wrcore.analysis.wear.evolve import evolve, load_wear_plan, profiles_over_distance
from wrcore.analysis.wear.worn_profiles import POINTS

SEEDS = 100
"""Further copies of a scene have seeds that differ by multiples of this."""


def variant_changes(variant, distance):
    """Changes of a plan over a distance (m) for a variant of the configuration; its ``set`` comes after that of its
    ``plan``.
    """
    changes = {"distance": distance, **variant.get("plan", {})}
    return changes | {"set": changes.get("set", {}) | variant.get("set", {})}


def with_copies(plan, copies):
    """Changes of a plan that put copies of each scene (so many in all) on other irregularities of its kind beside
    it.
    """
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
    """Depth that a plan with changes, and copies as for `with_copies`, takes off a wheel: u and depth (m), table of
    `evolve`, and processor time (s).
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
    """Worn profiles of `variant_depth` by name beside the first of them: deepest loss (m), area of the loss (m^2),
    largest deviation from the first one's depth and that of the area, both over the first one's, conicity at the end,
    steps, processor time (s).
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
