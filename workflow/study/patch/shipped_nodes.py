"""Nodes of looked-up contact that come with the package: ``python -m study.patch.shipped_nodes [--more] [--out FILE]``.

Scenes run on an empty table, by `METHODS`: those of `study.patch.look_up`, and examples at speeds, on tracks and from
starts that a user may well try. What they meet is kept, a group per pair of profiles: nodes, and which cells may be
looked up (``wrcore/wheels/table/tables/nodes.h5``). With ``--more`` they begin with what comes with the package, and
what they meet besides is added.
"""

import argparse
import tempfile
from itertools import product
from pathlib import Path

import numpy as np

import wrcore as wr
from study.patch.look_up import ROUGH, SCENES
from wrcore.errors.checked_hdf5 import new_hdf5
from wrcore.integrate.choice import CHOICES
from wrcore.wheels.table import creep_modes
from wrcore.wheels.table import store as pair_store

WIDER = {"track.path": [{"tangent": 5}, {"transition": 60}, {"curve": 100, "radius": 600, "cant": 0.1}]}
NOTEBOOK = {"track.irregularity": {"spectrum": {"level": "low", "seed": 3, "length": 150.0, "begin": 15.0}}}
SHARP = {"track.path": [{"tangent": 5}, {"transition": 50}, {"curve": 100, "radius": 400, "cant": 0.1}]}
BEGIN = {}, {"initial.y": 0.003}
MET = [
    *SCENES.values(),
    *(("suspended_wheelset", {"speed": v, **begin}) for v in (20.0, 30.0, 40.0, 50.0, 60.0) for begin in BEGIN),
    *(("trailer_vehicle", {"speed": v, **begin}) for v in (20.0, 30.0, 40.0, 50.0, 60.0, 70.0) for begin in BEGIN),
    *((f"freight_wagon_{load}", {}) for load in ("empty", "laden")),
    *(("trailer_vehicle", {"speed": v, "integration.duration": 4.0, **ROUGH}) for v in (20.0, 40.0)),
    ("trailer_vehicle", {"speed": 25.0, "integration.duration": 6.0, **WIDER}),
    ("guided_car", {}),
    ("trailer_vehicle", {"speed": 55.0, "integration.duration": 4.0, **ROUGH}),
    ("trailer_vehicle", {"speed": 15.0, **SHARP}),
    *(("metro_car", {"speed": v}) for v in (15.0, 20.0, 30.0)),
    ("trailer_vehicle", {"speed": 60.0, "integration.duration": 2.0, **NOTEBOOK}),
    ("trailer_vehicle", {"speed": 60.0, "initial.y": 0.0, "contact.friction": 0.15, "integration.duration": 1.0}),
]
"""Examples and what is set in them."""

COMPRESSION = {"compression": "gzip", "compression_opts": 9, "shuffle": True}

METHODS = "auto", *CHOICES, "rodas4p2"
"""Of integration: attempts of each meet cells of their own."""


def met(scenes, more=False):
    """`Pair` of each table with what scenes, (name, settings), meet on it, empty or with ``more`` as it ships."""
    pairs, shared = {}, (pair_store.Pair._take_shipped, pair_store.table_folder, pair_store._PAIRS)
    with tempfile.TemporaryDirectory() as folder:
        pair_store.Pair._take_shipped = shared[0] if more else lambda _: None
        pair_store.table_folder, pair_store._PAIRS = (lambda: Path(folder)), pairs
        try:
            for (name, settings), method in product(scenes, METHODS):
                changes = {"integration.method": method, **settings, "contact.patch": "tabulated"}
                wr.simulate(wr.example(name), **changes)
        finally:
            pair_store.Pair._take_shipped, pair_store.table_folder, pair_store._PAIRS = shared
        for pair in pairs.values():
            pair.write()
    return [*pairs.values()]


def known(pair):
    """A pair's nodes, and which of its cells may be looked up, with those that it began with: arrays by name."""
    states = {key: state for key, (_, state) in pair._known.items()}
    states |= {key: int(np.sign(state)) if state > 0 else state for key, state in pair.cells.items()}
    misses = {key: miss for key, (miss, _) in pair._known.items()} | dict(pair.misses)
    return {
        "nodes": np.array(sorted(pair._solved_at)),
        "numbers": np.array([pair._solved_at[node] for node in sorted(pair._solved_at)]),
        "parts": np.array(sorted(pair._parts.items())),
        "cells": np.array(list(states.items())),
        "misses": np.array([misses[key] for key in states], np.float32),
        "fingerprint": pair_store.fingerprint(pair.contact),
    }


def write(pairs, path):
    """Keep what pairs know, a group each."""
    with new_hdf5(path) as file:
        for k, pair in enumerate(pairs):
            for name, array in known(pair).items():
                chunks = (len(array), 4) if name == "numbers" else True  # read in half the time of h5py's own choice
                file.create_dataset(f"{k}/{name}", data=array, chunks=chunks, **COMPRESSION)


def main():
    """Run the scenes, write what they met, and say how much it is."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", default=str(creep_modes.SHIPPED / "nodes.h5"))
    parser.add_argument("--more", action="store_true", help="begin with the nodes that come with the package")
    arguments = parser.parse_args()
    path, pairs = arguments.out, met(MET, arguments.more)
    write(pairs, path)
    print(f"{[len(pair.cells) for pair in pairs]} cells met, {Path(path).stat().st_size / 1e6:.1f} MB: {path}")


if __name__ == "__main__":
    main()
