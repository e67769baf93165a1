"""How far contact that is looked up is from the exact solver: ``python -m study.patch.look_up_errors [SET ...]``.

Random poses of a left wheel, each rolled over by both. ``solved``: share of patches for which the table has no answer
(they are exact). Of the others: errors of N (%), of the creep force over mu N (%), of the moment over mu N c (%) and of
p_max (%), each at 50, 95 and 100 %.
"""

import argparse
import math
import time

import numpy as np
import pandas as pd

from wrcore.analysis.contact.loaded import LoadedWheels, Rolling
from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.contact.search import reduction
from wrcore.geometry.profiles.profile import ProfileCurve
from wrcore.geometry.profiles.standards import named_profile
from wrcore.wheels.contact_model import SOLVED
from wrcore.wheels.table.store import pair_of

SPEED, FRICTION = 20.0, 0.3


def worn(depth, place, width):
    """S1002 with a hollow, m."""
    new = named_profile("S1002", "wheel")
    u = np.linspace(-0.06, 0.055, 1151)
    f = new(u) + depth * np.exp(-(((u - place) / width) ** 2))
    return ProfileCurve.from_points(u, f - np.interp(0.0, u, f), "wheel", "hollow")


PAIRS = {
    "S1002 / 60E1 1:40": lambda: WheelOnRail(named_profile("S1002", "wheel"), named_profile("60E1", "rail", 1 / 40)),
    "S1002 / 60E1 1:20": lambda: WheelOnRail(named_profile("S1002", "wheel"), named_profile("60E1", "rail", 1 / 20)),
    "S1002 / 54E1 1:40": lambda: WheelOnRail(named_profile("S1002", "wheel"), named_profile("54E1", "rail", 1 / 40)),
    "hollow 1 mm / 60E1 1:40": lambda: WheelOnRail(worn(1e-3, 0.0, 0.015), named_profile("60E1", "rail", 1 / 40)),
}
POSES = {
    "hunting": ((-4e-3, 4e-3), 2e-4, 4.5e-3, (3.5e4, 7.5e4), 3e-3, 0.0),
    "rough track": ((-4e-3, 4e-3), 1e-3, 3e-3, (2e4, 1.1e5), 3e-3, 0.0),
    "curve": ((4e-3, 7e-3), 3e-4, 1.2e-2, (2e4, 1.1e5), 3e-3, 0.0),
    "tread and root": ((4.6e-3, 5.8e-3), 3e-4, 8e-3, (2e4, 8e4), 1e-3, -2.7e-3),
    "edges of the hollow": ((3e-4, 7e-4), 0.0, 2e-3, (5.9e4, 6.1e4), 3e-3, 0.0),
}
"""Range of y (m), spread of roll beside that of balance and range of yaw (rad), range of the load (N), that of both
creepages, and the middle of the one along the rail: where the tread hardly slips, beside the root."""


def rolled(geometry, poses, count, seed):
    """Rows of both models (patches, columns), what of them was solved, and seconds that the table's nodes took."""
    (low, high), spread, most, loads, creepages, middle = POSES[poses]
    models = {name: LoadedWheels(geometry, name) for name in ("exact", "tabulated")}
    random, rows, solved, spent = np.random.default_rng(seed), {name: [] for name in models}, [], 0.0
    while len(solved) < count:
        y, yaw, load = random.uniform(low, high), random.uniform(-most, most), math.exp(random.uniform(*np.log(loads)))
        roll, _ = models["exact"].settled(y, load)
        roll += random.normal(0.0, spread)
        z = models["exact"].height("left", y, load, roll, yaw)
        drift, spin = random.uniform(-1.0, 1.0, 2) * creepages
        if math.isnan(z):
            continue
        rolling = Rolling(SPEED, SPEED / geometry.rolling_radius * (1.0 + middle + spin), SPEED * (yaw + drift))
        before, found = models["tabulated"]._counters[SOLVED], {}
        for name, wheels in models.items():
            begin = time.process_time()
            found[name] = [one.row for one in wheels.at_height("left", y, z, roll, yaw, rolling, FRICTION)]
            spent += time.process_time() - begin if name == "tabulated" else 0.0
        if found["exact"]:
            heaviest = int(np.argmax([row[reduction.NORMAL] for row in found["exact"]]))
            solved.append(models["tabulated"]._counters[SOLVED] > before)
            for name in models:
                rows[name].append(found[name][heaviest])
    return {name: np.array(found) for name, found in rows.items()}, np.array(solved), spent, models["tabulated"]


def errors(exact, table):
    """Columns of errors in %."""
    limit = FRICTION * exact[:, reduction.NORMAL]
    c = np.sqrt(exact[:, reduction.SEMI_A] * exact[:, reduction.SEMI_B])
    difference = table - exact
    return {
        "N": 100.0 * abs(difference[:, reduction.NORMAL]) / exact[:, reduction.NORMAL],
        "F": 100.0 * np.hypot(difference[:, reduction.FX], difference[:, reduction.FY]) / limit,
        "M": 100.0 * abs(difference[:, reduction.MZ]) / (limit * c),
        "p_max": 100.0 * abs(difference[:, reduction.P_MAX]) / exact[:, reduction.P_MAX],
    }


def main():
    """Print a table of the sets that are asked for, or all."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--pairs", nargs="*", default=list(PAIRS), help="some of: " + ", ".join(PAIRS))
    parser.add_argument("--poses", nargs="*", default=list(POSES), help="some of: " + ", ".join(POSES))
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    lines = []
    for pair in chosen.pairs:
        geometry = PAIRS[pair]().geometry
        for poses in chosen.poses:
            rows, solved, spent, wheels = rolled(geometry, poses, chosen.count, chosen.seed)
            kept = pair_of(wheels._at_work(FRICTION).value)
            found = errors(*(rows[name][~solved] for name in ("exact", "tabulated")))
            told = {name: "/".join(f"{q:.2g}" for q in np.percentile(e, [50, 95, 100])) for name, e in found.items()}
            nodes, states = len(kept._solved_at), np.array(list(kept.cells.values()))
            lines.append({"pair": pair, "poses": poses, "solved, %": 100.0 * solved.mean(), **told, "nodes": nodes,
                          "cells": len(states), "ready": (states > 0).sum(), "hard": (states == -2).sum(),
                          "s": spent})  # fmt: skip
            print(pd.DataFrame(lines[-1:]).to_markdown(index=False, floatfmt=".3g"), flush=True)


if __name__ == "__main__":
    main()
