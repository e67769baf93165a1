"""Run a sweep: many runs in one process, one number per measure of each run, and one table of all runs.

Parts that all runs of a batch have in common are built once: imports, kernels, profiles, contact geometry, creep table,
static equilibrium. A run then costs its integration and two to four milliseconds (reports/sweeps.md).
"""

from __future__ import annotations

import copy
import dataclasses
import glob
import hashlib
import io
import itertools
import json
import warnings
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import lru_cache
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from wrcore.equations.many_models import equations_of
from wrcore.errors import InputError
from wrcore.errors.checked_calls import Threads, checked
from wrcore.errors.checked_hdf5 import checked_hdf5, new_hdf5
from wrcore.errors.input_files import check_regular, check_unchanged
from wrcore.errors.new_files import appearing, held, remove_folder, remove_remains
from wrcore.errors.schema_keys import unit_of_key
from wrcore.run.output.channels import unit_of
from wrcore.run.progress import counted
from wrcore.run.simulate import output_times
from wrcore.run.simulation import counters_of, integrate_by
from wrcore.scene.changes import with_value
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import Scene, changed_by_file
from wrcore.scene.void_keys import ALL_OTHERS, leave_out_void_keys
from wrcore.sweep.measures import COUNTERS, FORCES, MOTION, Motions, wheel_forces, wheelset_motion
from wrcore.sweep.plan import Sweep, load_sweep, of_parts

_SEALED = "# seal of this part: "
_KIND = "a sweep's table (CSV or HDF5)"

CHUNK = 200  # number of runs whose motions are in memory at a time
AHEAD = 20  # number of runs per thread that are prepared before they begin


def column_unit(name: str) -> str:
    """Return the unit of a column of a sweep's table, from the scene's key or the name of the measure."""
    return unit_of_key(name) or unit_of(name)


class _Task(NamedTuple):
    run: int
    scene: Scene
    values: dict[str, Any]
    shared: dict[Any, Any]


class _Outcome(NamedTuple):
    run: int
    times: np.ndarray
    record: dict[str, Any]
    motion: np.ndarray
    forces: np.ndarray | None


@checked
def run_sweep(
    source: str | PathLike[str] | dict[str, Any] | Sweep,
    threads: Threads = 1,
    progress: Callable[[Iterable], Iterable] | None = None,
) -> pd.DataFrame:
    """Run all runs of a sweep in this process and return their table.

    Parameters
    ----------
    source : str, Path, dict or Sweep
        Sweep, or a file or dict for :func:`wrcore.sweep.plan.load_sweep`.
    threads : int
        Number of simultaneous runs; the table does not depend on it.
    progress : callable, optional
        Wraps the runs, e.g. ``tqdm.tqdm``. By default a bar is shown in a terminal or a notebook.

    Returns
    -------
    pandas.DataFrame
        A row per run: ``run``, the keys, ``status``, ``method`` and the measures in SI units, which their names state.

    Raises
    ------
    InputError
        One line that names the file, the field and the expected value.

    Examples
    --------
    >>> table = run_sweep({
    ...     "name": "decay", "scene": "config/scenes/suspended_wheelset.yaml", "set": {"integration.duration": 0.1},
    ...     "sampling": {"kind": "grid"}, "keys": {"speed": {"values": [20, 30]}}, "measures": ["y_max_m"],
    ... })
    >>> table
       run  speed     status    method  y_max_m
    0    0     20  completed  rodas5    0.002
    1    1     30  completed  rodas5    0.002
    """
    sweep = source if isinstance(source, Sweep) else load_sweep(source)
    return run_rows(sweep, sweep.runs, threads, progress)


def run_rows(
    sweep: Sweep, rows: pd.DataFrame, threads: int = 1, progress: Callable[[Iterable], Iterable] | None = None
) -> pd.DataFrame:
    """Run some rows of a sweep's table; arguments and result as for :func:`run_sweep`."""

    def work(task):
        return _run(task, sweep.data["measures"])

    tasks, bar = _tasks(sweep, rows), progress or (lambda items: counted(items, total=len(rows)))
    tables: list[pd.DataFrame] = []
    chunk: list[_Outcome] = []
    with ThreadPoolExecutor(threads) as pool:
        for outcome in bar(_some_at_a_time(pool, work, tasks, AHEAD * threads) if threads > 1 else map(work, tasks)):
            if chunk and (len(chunk) == CHUNK or not _alike(chunk[0], outcome)):
                tables.append(_measured(sweep, chunk))
                chunk = []
            chunk.append(outcome)
    table = pd.concat([*tables, _measured(sweep, chunk)]).sort_index()
    return pd.concat([rows, table], axis=1).reset_index()


def _some_at_a_time(pool: ThreadPoolExecutor, work: Callable, tasks: Iterator[_Task], count: int) -> Iterator[_Outcome]:
    """Yield the results of a pool for tasks in groups of ``count``, because its map would create all tasks at once."""
    while part := list(itertools.islice(tasks, count)):
        yield from pool.map(work, part)


def _tasks(sweep: Sweep, rows: pd.DataFrame) -> Iterator[_Task]:
    """Yield one task per run. Runs with the same parts follow each other and share them, so that parts are built when
    needed and then released.
    """
    parts = [key for key in rows.columns if of_parts(key)]
    groups: dict[str, list[tuple[int, dict[str, Any]]]] = {}
    for run, values in zip(rows.index, rows.to_dict("records"), strict=True):
        text = json.dumps([values.pop(key) for key in parts])
        groups.setdefault(text, []).append((int(run), {str(key): value for key, value in values.items()}))
    for text, members in groups.items():
        made_of = dict(zip(parts, json.loads(text), strict=True))
        scene = changed_by_file(sweep.scene, made_of) if made_of else sweep.scene
        shared: dict[Any, Any] = {}
        for run, values in members:
            yield _Task(run, scene, values, shared)


def _changed(scene: Scene, values: dict[str, Any]) -> Scene:
    """Return a scene with other values of keys that do not require reading files; the values are already checked."""
    data = scene.data
    for key, value in values.items():
        data = with_value(data, key, value)
    if not ALL_OTHERS.isdisjoint(values):
        data = copy.deepcopy(data)
        leave_out_void_keys(data, scene.source, values)
    changed = dataclasses.replace(scene, data=data)
    vars(changed)["alike"] = scene.alike  # shared by runs with the same parts
    return changed


def _run(task: _Task, measures: list[str]) -> _Outcome:
    scene = _changed(task.scene, task.values)
    model, state = compile_scene(scene, shared=task.shared)
    settings, equations = scene.data["integration"], equations_of(model, task.shared)
    times = _times(settings["duration"], scene.data["output"]["rate"])
    trajectory = integrate_by(settings, model, state, times, equations=equations)
    starts = scene.vehicle.positions[model.bodies.wheelsets, 0]
    motion = wheelset_motion(model, starts, trajectory.states)
    forces = wheel_forces(model, trajectory) if set(measures) & set(FORCES) else None
    record = {"status": trajectory.status, "method": trajectory.method}
    counters = counters_of(trajectory)
    record |= {name: counters[name] for name in measures if name in COUNTERS}
    return _Outcome(task.run, times, record, motion, forces)


@lru_cache
def _times(duration: float, rate: float) -> np.ndarray:
    return output_times(0.0, duration, rate)


def _alike(one: _Outcome, other: _Outcome) -> bool:
    """Whether two runs have the same output times and number of wheelsets, so that one array can hold their motions."""
    alike = one.times is other.times or np.array_equal(one.times, other.times)
    return alike and one.motion.shape[1] == other.motion.shape[1]


def _measured(sweep: Sweep, outcomes: list[_Outcome]) -> pd.DataFrame:
    """Return the measures of runs with the same output times as a table with a row per run."""
    times = outcomes[0].times
    records = [outcome.record for outcome in outcomes]
    table: dict[str, Any] = {name: [record[name] for record in records] for name in ("status", "method")}
    late = times >= sweep.data["begin"]
    motion, forces = _stacked([outcome.motion for outcome in outcomes], len(times))[:, late], None
    if outcomes[0].forces is not None:
        forces = _stacked([outcome.forces for outcome in outcomes], len(times))[:, late]
    motions = Motions(times[late], motion[..., 0], motion[..., 1], forces, sweep.data["window"])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a run that ended before ``begin`` has only NaN
        for name in sweep.data["measures"]:
            if name in COUNTERS:
                table[name] = [record[name] for record in records]
            else:
                table[name] = (MOTION | FORCES)[name](motions)
    return pd.DataFrame(table, index=pd.Index([outcome.run for outcome in outcomes], name="run"))


def _stacked(parts: list, length: int) -> np.ndarray:
    """Stack arrays of runs, shape (runs, length, ...), padded with NaN after the end of a run."""
    if all(len(part) == length for part in parts):
        return np.stack(parts)
    out = np.full((len(parts), length, *parts[0].shape[1:]), np.nan)
    for row, part in zip(out, parts, strict=True):
        row[: len(part)] = part
    return out


def sweep_to_file(
    sweep: Sweep,
    path: str | PathLike[str],
    threads: int = 1,
    progress: Callable[[Iterable], Iterable] | None = None,
) -> None:
    """Run a sweep batch by batch and write its table, CSV or ``.h5``.

    Finished batches are stored in a folder next to the table; its name contains the digest of the sweep. An interrupted
    call is resumed from them. ``threads`` and ``progress`` are those of :func:`run_sweep`. InputError if another
    process writes the same table, if there are batches of different inputs, or if a file of the sweep changes during
    the call.
    """
    path = Path(path)
    remove_remains(path)
    folder = path.with_name(f".{path.name}.{sweep.digest()}")
    parts = [folder / f"{batch:04d}.csv" for batch in range(sweep.batches)]
    with held(folder, path):
        for other in path.parent.glob(f".{glob.escape(path.name)}.{16 * '[0-9a-f]'}"):
            if other != folder:
                with suppress(OSError):  # this folder may contain batches, too
                    folder.rmdir()
                expected = f"expected the sweep, scene and files that the batches in {other.name} were made of"
                raise InputError("--out", path, f"{expected}, but some were changed; remove that folder to begin anew")
        for batch, part in enumerate(parts):
            if not _whole(sweep, part):
                write_table(part, run_rows(sweep, sweep.rows(batch), threads, progress), sweep)
        gather(sweep, parts, path)
        remove_folder(folder)


def gather(sweep: Sweep, parts: Iterable[str | PathLike[str]], path: str | PathLike[str]) -> None:
    """Join the tables of all batches to one table, in the order of the runs, and write it.

    InputError if a part is damaged, or of another sweep or other sources, or if runs are missing or occur twice.
    """
    tables: list[pd.DataFrame] = []
    owners: dict[int, str | PathLike[str]] = {}
    for part in parts:
        tables.append(load_table(part, sweep))
        for run in tables[-1]["run"]:
            if run in owners:
                raise InputError(part, f"run {run}", f"expected each run once, but {owners[run]} has it, too")
            owners[run] = part
    missing = [run for run in sweep.runs.index if run not in owners]
    if missing:
        expected = f"expected parts with all {len(sweep.runs)} runs, but {len(missing)} are in none"
        raise InputError(sweep.source, "", f"{expected}: {_lacking(sweep, [set(t['run']) for t in tables])}")
    write_table(path, pd.concat(tables).sort_values("run", ignore_index=True))


def _lacking(sweep: Sweep, parts: list[set[int]]) -> str:
    """Return a text that names the missing ``--batch i/n`` if the parts are batches of n, else the missing runs."""
    size = max(map(len, parts), default=len(sweep.runs))
    for count in range(-(-len(sweep.runs) // size), len(sweep.runs) // max(size - 1, 1) + 1):
        batches = [set(sweep.rows(batch, count).index) for batch in range(count)]
        if all(part in batches for part in parts):
            return "--batch " + ", ".join(f"{k}/{count}" for k, batch in enumerate(batches, 1) if batch not in parts)
    missing = np.setdiff1d(sweep.runs.index, list(set().union(*parts)))
    stretches = np.split(missing, np.flatnonzero(np.diff(missing) > 1) + 1)
    return "runs " + ", ".join(f"{runs[0]} to {runs[-1]}" if len(runs) > 1 else f"{runs[0]}" for runs in stretches)


def _whole(sweep: Sweep, part: Path) -> bool:
    try:
        return len(load_table(part, sweep)) > 0
    except InputError:
        return False


def _seal(sweep: Sweep, text: str) -> str:
    """Return the digest of a part's table and of the inputs of its sweep."""
    return hashlib.sha256(f"{sweep.digest()} {text}".encode()).hexdigest()


def _text(table: pd.DataFrame) -> str:
    return table.to_csv(index=False, lineterminator="\n")


def write_table(path: str | PathLike[str], table: pd.DataFrame, part_of: Sweep | None = None) -> None:
    """Write a sweep's table as CSV, or as HDF5 with a dataset and its unit per column if the name ends in ``.h5``.

    The file appears under its name only when it is complete. The table of a batch (``part_of`` a sweep) also gets a
    seal, a comment or an attribute. InputError if the sweep's files have changed.
    """
    path = Path(path)
    if path.suffix == ".h5":
        table = table.astype({name: str for name, column in table.items() if column.dtype.kind not in "biuf"})
    text, seal = _text(table), ""
    if part_of is not None:
        check_unchanged(part_of.files)
        seal = _seal(part_of, text)
    if path.suffix == ".h5":
        _write_hdf5(path, table, seal)
    else:
        with appearing(path) as file:
            file.write((text + (seal and f"{_SEALED}{seal}\n")).encode())


def _write_hdf5(path: Path, table: pd.DataFrame, seal: str) -> None:
    with new_hdf5(path, track_order=True) as file:
        file.attrs["format"] = "wrcore sweep"
        file.attrs["seal"] = seal
        for name in table.columns:
            values = table[name].to_numpy()
            if values.dtype.kind not in "biuf":
                values = values.astype(object)
            dataset = file.create_dataset(name, data=values)
            dataset.attrs["units"] = column_unit(name)


def load_table(path: str | PathLike[str], part_of: Sweep | None = None) -> pd.DataFrame:
    """Read a sweep's table, CSV or HDF5.

    InputError if the file does not exist or is of another kind, or if its seal does not prove that it is a complete
    batch of the sweep ``part_of``.
    """
    path = Path(path)
    try:
        if path.suffix == ".h5":
            table, seal = _read_hdf5(path)
            _check_seal(path, part_of, _text(table), seal)
            return table
        check_regular(path)
        text, _, seal = path.read_text(encoding="utf-8-sig").partition(_SEALED)
        _check_seal(path, part_of, text, seal.strip())
        return pd.read_csv(io.StringIO(text))
    except InputError:
        raise
    except Exception as error:  # pandas raises many kinds of errors for a damaged file
        raise InputError(path, "", f"expected {_KIND}, got: {getattr(error, 'strerror', None) or error}") from None


def _check_seal(path: Path, part_of: Sweep | None, text: str, seal: str) -> None:
    if part_of is not None and seal != _seal(part_of, text):
        expected = "expected a whole part of this sweep, as 'wrcore sweep --batch' writes it of the same files"
        raise InputError(path, "", expected)


def _read_hdf5(path: Path) -> tuple[pd.DataFrame, str]:
    """Read a table and its seal; the seal is empty if there is none."""
    with checked_hdf5(path, _KIND) as file:
        if file.attrs.get("format") != "wrcore sweep":
            raise InputError(path, "attribute format", "expected 'wrcore sweep'")
        columns = {name: item.asstr()[()] if item.dtype.kind == "O" else item[()] for name, item in file.items()}
        return pd.DataFrame(columns), str(file.attrs.get("seal", ""))
