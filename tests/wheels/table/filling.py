"""What a run waits for until its table is filled: ``python -m tests.wheels.table.filling [SCENE ...]``.

Each scene runs with looked-up contact on a table that knows what comes with the package and nothing else; the solver is
compiled before. ``by lattice``: new cells from the coarsest lattice to the finest one.
"""

import argparse
import collections
import tempfile
import time
from pathlib import Path

import pandas as pd

import wrcore as wr
from study.patch.look_up import CURVE, ROUGH
from study.patch.shipped_nodes import SHARP
from wrcore.contact.patch.model import RESOLUTIONS
from wrcore.wheels.table import store as pair_store
from wrcore.wheels.table.cells import LEVELS, corner_of

OTHER, SEED = {"contact.friction": 0.25}, {"track.irregularity.spectrum.seed": 5}
SCENES = {
    "suspended wheelset, friction 0.25": ("suspended_wheelset", OTHER),
    "trailer vehicle, friction 0.25": ("trailer_vehicle", OTHER),
    "freight wagon, laden, friction 0.25": ("freight_wagon_laden", OTHER),
    "metro car, friction 0.25": ("metro_car", OTHER),
    "trailer vehicle, 55 m/s, rough track": ("trailer_vehicle", {"speed": 55.0, **ROUGH, **SEED}),
    "trailer vehicle, 14 m/s, R 350 m": ("trailer_vehicle", {"speed": 14.0, **SHARP, "track.path.2.radius": 350.0}),
    "trailer vehicle, 16.7 m/s, R 300 m, rough, friction 0.25": (
        "trailer_vehicle",
        {"speed": 16.7, **CURVE, **ROUGH, **OTHER},
    ),
    "suspended wheelset, 65 m/s, 3 s": ("suspended_wheelset", {"speed": 65.0, "integration.duration": 3.0}),
}
"""Example scenes and what is set in them."""


def waited(name, settings, resolution="middle"):
    """Row of a run's new nodes and cells, and seconds: on the clock and of processors."""
    looked_up = {"contact.patch": "tabulated", "contact.resolution": resolution}
    pairs, shared = {}, (pair_store.table_folder, pair_store._PAIRS)
    with tempfile.TemporaryDirectory() as folder:
        pair_store.table_folder, pair_store._PAIRS = (lambda: Path(folder)), pairs
        try:
            wall, processor = time.perf_counter(), time.process_time()
            run = wr.simulate(wr.example(name), **settings, **looked_up)
            wall, processor = time.perf_counter() - wall, time.process_time() - processor
            (pair,) = pairs.values()
            at_hand = len(pair_store.Pair(pair.contact, "at_hand")._solved_at)
        finally:
            pair_store.table_folder, pair_store._PAIRS = shared
        levels = [corner_of(key)[0] for key in pair.cells if key not in pair._known]
        cells = collections.Counter(level for level in levels if level < LEVELS)
        row = {
            "nodes": len(pair._solved_at) - at_hand, "cells": cells.total(),
            "by lattice": [cells[level] for level in range(LEVELS)],
            "wall, s": wall, "processors, s": processor, "solved in the run": run.counters["patches_not_tabulated"],
        }  # fmt: skip
        pair._new = 0  # nothing to keep
    return row


def main():
    """Print a table of the scenes that are asked for, or all."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("scenes", nargs="*", help="parts of their names")
    parser.add_argument("--resolution", choices=RESOLUTIONS, default="middle")
    asked = parser.parse_args()
    words, resolution = asked.scenes, asked.resolution
    wanted = {name: scene for name, scene in SCENES.items() if not words or any(word in name for word in words)}
    waited("suspended_wheelset", {"contact.friction": 0.27, "integration.duration": 0.01}, resolution)  # compiles
    for name, scene in wanted.items():
        print(pd.DataFrame({name: waited(*scene, resolution)}).T.to_markdown(floatfmt=".1f"), flush=True)


if __name__ == "__main__":
    main()
