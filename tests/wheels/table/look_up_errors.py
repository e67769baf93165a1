"""Errors of contact from the table: ``python -m tests.wheels.table.look_up_errors [SET ...]``.

Random positions of a left wheel are evaluated by both models. ``solved``: share of patches without an entry of the
table (they are exact). Errors of the others: N (%), creep force over mu N (%), moment over mu N c (%) and p_max (%),
each as median, 95 % and maximum.
"""

import argparse
import math
import time

import numpy as np
import pandas as pd

from study.patch.look_up_errors import FRICTION, PAIRS, SPEED, errors
from wrcore.analysis.contact.loaded import LoadedWheels, Rolling
from wrcore.contact.search import reduction
from wrcore.wheels.contact_model import SOLVED
from wrcore.wheels.table.store import pair_of

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
