"""Read and check sweeps: a scene and the keys to vary become a table with a row per run."""

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
from wrcore.errors import InputError, one_of, short
from wrcore.errors.checked_calls import checked
from wrcore.errors.checked_yaml import read_source, validate
from wrcore.integrate.integrator import METHODS
from wrcore.kernels.cache import source_digest
from wrcore.run.checks.reach import check_reach
from wrcore.scene.changes import check_disjoint
from wrcore.scene.description import Scene, changed_by_caller, changed_by_file
from wrcore.scene.reader import find_file
from wrcore.scene.stored import StoredScene
from wrcore.sweep.measures import MEASURES

MOST_RUNS = 10_000_000  # largest number of runs of a sweep
MOST_BATCHES = 500  # largest number of batches: more would be many short processes

FEW = 50  # largest number of values of a key that are all checked before any run

OF_PARTS = ("name", "description", "vehicle", "wheel", "rail", "track", "contact.creep.table")
"""Keys that determine the parts of a scene: if a run changes one of them, the scene is read again."""


@dataclass(frozen=True, repr=False)
class Sweep:
    """A checked sweep: its content, its scene and the table of its runs."""

    data: dict[str, Any]
    """Content of the sweep file with defaults."""
    source: str
    """Name of the sweep in error messages."""
    scene: Scene
    """Scene with the changes that apply to all runs."""
    runs: pd.DataFrame
    """A row per run, numbered from 0 (index ``run``), and a column per key."""
    files: dict[str, str]
    """SHA-256 of all files that are read for any of the runs, by path."""

    @property
    def batches(self) -> int:
        """Number of batches of ``batch`` runs."""
        return math.ceil(len(self.runs) / self.data["batch"])

    def rows(self, batch: int, count: int | None = None) -> pd.DataFrame:
        """Return the rows of a batch, numbered from 0; ``count`` is the number of batches, by default `batches`."""
        edges = np.linspace(0, len(self.runs), (count or self.batches) + 1).round().astype(int)
        return self.runs.iloc[edges[batch] : edges[batch + 1]]

    def digest(self) -> str:
        """Return the digest (16 hex digits) of all inputs that determine the results, except the machine."""
        return digest_of_plan([self.data, self.scene.data], self.files)[:16]

    def __repr__(self) -> str:
        keys = ", ".join(self.runs.columns)
        return f"Sweep {self.data['name']!r}: {len(self.runs)} runs over {keys}; {self.batches} batches"


def digest_of_plan(described: Any, files: Mapping[str, str]) -> str:
    """Return the digest (64 hex digits) of a plan of many runs: its description, the files read and the sources."""
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
        Sweep file (schema ``wrcore/scene/schemas/sweep.yaml``) or its content; then paths are relative to the working
        directory.
    overrides : sequence of str, or dict
        Further changes to the scene that apply to all runs, as for :func:`wrcore.load_scene`.

    Returns
    -------
    Sweep

    Raises
    ------
    InputError
        One line that names the file, the field and the expected value. Every value of each key is checked.

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
    read_from = data["scene"]
    if isinstance(read_from, str):
        read_from = find_file(read_from, folder, name, "scene")
    elif isinstance(source, Mapping) and isinstance(source["scene"], StoredScene):
        read_from = StoredScene(read_from)
    check_disjoint(data["keys"], name, "keys")
    keys = data["keys"]
    scene = changed_by_caller(changed_by_file(read_from, data["set"], folder, undecided=keys), overrides, keys)
    values = {key: _values(entry, data["sampling"], f"keys.{key}", name) for key, entry in data["keys"].items()}
    read = scene.files | _check_values(scene, data["keys"], name)
    runs = pd.DataFrame(RUNS[data["sampling"]["kind"]](values, data["sampling"], name), columns=list(values))
    runs.index.name = "run"
    _check_rows(scene, runs, name)
    shortest = float(min(runs.get("integration.duration", [scene.data["integration"]["duration"]])))
    if data["begin"] >= shortest:
        raise InputError(name, "begin", f"expected less than the shortest run's {shortest:g} s, got {data['begin']:g}")
    sweep = Sweep(data, name, scene, runs, read)
    if sweep.batches > MOST_BATCHES:
        least = math.ceil(len(runs) / MOST_BATCHES)
        raise InputError(name, "batch", f"expected at least {least} runs per batch: a batch is a process of its own")
    return sweep


def _values(entry, sampling, field, source):
    """Return the values of one key as a list, or bounds (low, high, is_logarithmic) for a design of points."""
    if "values" in entry:
        if {"from", "to", "steps"} & set(entry):
            raise InputError(source, field, "expected either values or from and to")
        if None in entry["values"]:
            raise InputError(source, field, "expected values, got null: write the key's default instead")
        return entry["values"]
    if not {"from", "to"} <= set(entry):
        raise InputError(source, field, "expected values, or from and to")
    low, high, log = entry["from"], entry["to"], entry["scale"] == "log"
    if not low < high or (log and low <= 0.0):
        raise InputError(source, field, f"expected from < to{' and from > 0' if log else ''}, got {low} and {high}")
    if RUNS[sampling["kind"]] is _design:
        return (low, high, log)
    if "steps" not in entry:
        raise InputError(source, f"{field}.steps", "expected a number of values, but the key is missing")
    spaced = np.geomspace(low, high, entry["steps"]) if log else np.linspace(low, high, entry["steps"])
    return spaced.tolist()


def _check_values(scene, entries, source):
    """Check each key separately, at values that represent all its values; return the digests of the files read."""
    files: dict[str, str] = {}
    for key, entry in entries.items():
        for value in _trials(entry):
            try:
                changed = changed_by_file(scene, {key: value}, undecided=entries)
            except InputError as error:
                raise InputError(source, f"keys.{key}", str(error)) from None
            if changed.data["integration"]["method"] not in ("auto", *METHODS):
                raise InputError(source, f"keys.{key}", one_of(("auto", *METHODS), value))
            files |= changed.files
    return files


def _check_rows(scene, runs, source):
    """Check keys together in some of the rows: the first row of each combination of values that are not numbers, and
    the rows in which a number is smallest or largest."""
    numbers = [key for key, column in runs.items() if column.dtype.kind in "iuf"]
    others = runs.drop(columns=numbers)
    tried = others.map(repr).drop_duplicates().index[:FEW] if others.size else runs.index[:1]
    ends = [row for key in numbers for row in (runs[key].idxmin(), runs[key].idxmax())]
    for row in dict.fromkeys([*tried, *ends]):
        values = {key: runs.at[row, key] for key in runs.columns}
        try:
            changed = changed_by_file(scene, values)
            check_reach(changed, changed.data["integration"]["duration"])
        except InputError as error:
            said = ", ".join(f"{key} {short(_plain(value))}" for key, value in values.items())
            raise InputError(
                source, f"keys, run {row}", f"expected values that go together, got {said}: {error}"
            ) from None


def _plain(value):
    """Convert a numpy number to a Python number, for messages."""
    return value.item() if isinstance(value, np.generic) else value


def _trials(entry):
    """Return values of a key that represent all of them: bounds and a number between them, or all values of a list.

    Of a list with more than `FEW` numbers only the smallest, the largest and one fractional number are returned.
    """
    if "values" not in entry:
        low, high = entry["from"], entry["to"]
        return low, high, low + 0.4142 * (high - low)
    values = entry["values"]
    if len(values) <= FEW or any(isinstance(value, bool) or not isinstance(value, int | float) for value in values):
        return values
    return [min(values), max(values), *[value for value in values if value != int(value)][:1]]


def _grid(values, sampling, source):
    """Return all combinations of the values of the keys."""
    if (count := math.prod(map(len, values.values()))) > MOST_RUNS:
        raise InputError(source, "keys", f"expected a grid of at most {MOST_RUNS} runs, got {count}")
    return list(itertools.product(*values.values()))


def _list(values, sampling, source):
    """Return one run per position in the lists of values: the first values of all keys, the second values, and so
    on."""
    counts = {key: len(among) for key, among in values.items()}
    first = next(iter(counts))
    for key, count in counts.items():
        if count != counts[first]:
            expected = f"expected as many values as of {first}, {counts[first]}, got {count}"
            raise InputError(source, f"keys.{key}", expected)
    return list(zip(*values.values(), strict=True))


def _design(values, sampling, source):
    """Return the values of each key at the points of a Latin hypercube or a Sobol sequence (scipy.stats.qmc)."""
    from scipy.stats import qmc

    if "runs" not in sampling:
        raise InputError(source, "sampling.runs", "expected a number of runs, but the key is missing")
    count, random = sampling["runs"], np.random.default_rng(sampling["seed"])
    if sampling["kind"] == "sobol":
        if count & (count - 1):
            raise InputError(source, "sampling.runs", f"expected a power of 2 for Sobol points, got {count}")
        places = qmc.Sobol(len(values), seed=random).random(count)
    else:
        places = qmc.LatinHypercube(len(values), seed=random).random(count)
    return {key: _at_places(among, column) for (key, among), column in zip(values.items(), places.T, strict=True)}


def _at_places(among, places):
    """Return the values at relative positions (n,) from 0 to 1 in a list or between bounds."""
    if isinstance(among, list):
        return [among[min(int(place * len(among)), len(among) - 1)] for place in places]
    low, high, log = among
    return (low * (high / low) ** places if log else low + (high - low) * places).tolist()


RUNS = {"grid": _grid, "list": _list, "latin_hypercube": _design, "sobol": _design}
"""Functions that return the runs, by ``sampling.kind``."""


def of_parts(key: str) -> bool:
    """Whether a scene has to be read again if this key changes."""
    return any(key == part or key.startswith(f"{part}.") for part in OF_PARTS)
