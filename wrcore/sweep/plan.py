"""Sweeps from files: a scene, the keys to vary and how, become a table with a row per run."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from wrcore import __version__
from wrcore.errors import InputError, one_of
from wrcore.errors.checked_calls import checked
from wrcore.errors.checked_yaml import read_source, validate
from wrcore.integrate.integrator import METHODS
from wrcore.kernels.cache import source_digest
from wrcore.scene.description import Scene, load_scene
from wrcore.scene.pairs import find_file
from wrcore.sweep.measures import MEASURES

MOST_RUNS = 10_000_000  # runs of a sweep
MOST_BATCHES = 500  # a sweep with more batches than this would be many short processes

OF_PARTS = ("name", "description", "vehicle", "wheel", "rail", "track", "contact.creep.table")
"""Keys that decide what a scene is made of: a run that changes one of them needs the scene read anew."""


@dataclass(frozen=True, repr=False)
class Sweep:
    """A checked sweep."""

    data: dict[str, Any]
    """Content of the sweep file with defaults."""
    source: str
    """Named in errors."""
    scene: Scene
    """With the changes that hold for all runs."""
    runs: pd.DataFrame
    """A row per run, numbered from 0 (index ``run``), and a column per key."""
    files: dict[str, str]
    """SHA-256 of all files that are read for any of the runs, by path."""

    @property
    def batches(self) -> int:
        """Number of batches of ``batch`` runs."""
        return math.ceil(len(self.runs) / self.data["batch"])

    def rows(self, batch: int, count: int | None = None) -> pd.DataFrame:
        """Runs of a batch, numbered from 0, of as many as the sweep has, or of another number of equal ones."""
        edges = np.linspace(0, len(self.runs), (count or self.batches) + 1).round().astype(int)
        return self.runs.iloc[edges[batch] : edges[batch + 1]]

    def digest(self) -> str:
        """Digest (16 hex digits) of all that the results depend on, but for the machine."""
        return digest_of_plan([self.data, self.scene.data], self.files)[:16]

    def __repr__(self) -> str:
        keys = ", ".join(self.runs.columns)
        return f"Sweep {self.data['name']!r}: {len(self.runs)} runs over {keys}; {self.batches} batches"


def digest_of_plan(described: Any, files: Mapping[str, str]) -> str:
    """Digest of a plan of many runs: what its files say, what was read for them, and the sources of the program."""
    read = sorted((Path(path).name, digest) for path, digest in files.items())
    text = json.dumps([described, read, __version__, source_digest()], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


@checked
def load_sweep(
    source: str | PathLike[str] | Mapping[str, Any], overrides: Iterable[str] | Mapping[str, Any] = ()
) -> Sweep:
    """Read and check a sweep.

    Parameters
    ----------
    source : str, Path or dict
        Sweep file (schema ``wrcore/scene/schemas/sweep.yaml``) or its content; then paths count from the working
        directory.
    overrides : sequence of str, or dict
        Further changes to the scene that hold for all runs, as :func:`wrcore.load_scene` takes them.

    Returns
    -------
    Sweep

    Raises
    ------
    InputError
        One line that names file, field and expectation. Every value that a key can take is checked.

    Examples
    --------
    >>> load_sweep({
    ...     "name": "hunting", "scene": "config/scenes/wheelset.yaml", "sampling": {"kind": "grid"},
    ...     "keys": {"speed": {"values": [20, 30, 40]}, "initial.y": {"from": 0.001, "to": 0.003, "steps": 5}},
    ... })
    Sweep 'hunting': 15 runs over speed, initial.y; 1 batches
    """
    name, folder, data = read_source(source, "sweep")
    data = validate(data, "sweep", name)
    for measure in data["measures"]:
        if measure not in MEASURES:
            raise InputError(name, "measures", one_of(MEASURES, measure))
    scene = load_scene(load_scene(find_file(data["scene"], folder, name, "scene"), data["set"]), overrides)
    values = {key: _values(entry, data["sampling"], f"keys.{key}", name) for key, entry in data["keys"].items()}
    read = scene.files | _check_values(scene, data["keys"], name)
    grid = data["sampling"]["kind"] == "grid"
    if grid and (count := math.prod(map(len, values.values()))) > MOST_RUNS:
        raise InputError(name, "keys", f"expected a grid of at most {MOST_RUNS} runs, got {count}")
    if grid:
        runs = pd.DataFrame(list(itertools.product(*values.values())), columns=list(values))
    else:
        runs = _hypercube(values, data["sampling"], name)
    runs.index.name = "run"
    shortest = float(min(runs.get("integration.duration", [scene.data["integration"]["duration"]])))
    if data["begin"] >= shortest:
        raise InputError(name, "begin", f"expected less than the shortest run's {shortest:g} s, got {data['begin']:g}")
    sweep = Sweep(data, name, scene, runs, read)
    if sweep.batches > MOST_BATCHES:
        least = math.ceil(len(runs) / MOST_BATCHES)
        raise InputError(name, "batch", f"expected at least {least} runs per batch: a batch is a process of its own")
    return sweep


def _values(entry, sampling, field, source):
    """Values of one key: a list, or bounds (from, to, scale) that a hypercube fills."""
    if "values" in entry:
        if {"from", "to", "steps"} & set(entry):
            raise InputError(source, field, "expected either values or from and to")
        return entry["values"]
    if not {"from", "to"} <= set(entry):
        raise InputError(source, field, "expected values, or from and to")
    low, high, log = entry["from"], entry["to"], entry["scale"] == "log"
    if not low < high or (log and low <= 0.0):
        raise InputError(source, field, f"expected from < to{' and from > 0' if log else ''}, got {low} and {high}")
    if sampling["kind"] == "latin_hypercube":
        return (low, high, log)
    if "steps" not in entry:
        raise InputError(source, f"{field}.steps", "expected a number of values, but the key is missing")
    spaced = np.geomspace(low, high, entry["steps"]) if log else np.linspace(low, high, entry["steps"])
    return spaced.tolist()


def _check_values(scene, entries, source):
    """Try each key by itself: at its bounds, or at each of its values. Returns the digests of the files read."""
    files: dict[str, str] = {}
    for key, entry in entries.items():
        low, high = entry.get("from", 0.0), entry.get("to", 0.0)
        for value in entry.get("values") or (low, high, low + 0.4142 * (high - low)):
            try:
                changed = load_scene(scene, {key: value})
            except InputError as error:
                raise InputError(source, f"keys.{key}", str(error)) from None
            if changed.data["integration"]["method"] not in ("auto", *METHODS):
                raise InputError(source, f"keys.{key}", one_of(("auto", *METHODS), value))
            files |= changed.files
    return files


def _hypercube(values, sampling, source):
    """Latin hypercube: each key's range in as many equal parts as there are runs, one run in each."""
    if "runs" not in sampling:
        raise InputError(source, "sampling.runs", "expected a number of runs, but the key is missing")
    count, random = sampling["runs"], np.random.default_rng(sampling["seed"])
    columns = {}
    for key, among in values.items():
        places = (random.permutation(count) + random.random(count)) / count
        if isinstance(among, list):
            columns[key] = [among[int(place * len(among))] for place in places]
        else:
            low, high, log = among
            columns[key] = low * (high / low) ** places if log else low + (high - low) * places
    return pd.DataFrame(columns)


def of_parts(key: str) -> bool:
    """Whether a scene has to be read anew if this key changes."""
    return any(key == part or key.startswith(f"{part}.") for part in OF_PARTS)
