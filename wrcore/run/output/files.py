"""Write and read runs as HDF5 files: each dataset has a unit and a description, each file its scene and settings."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from wrcore import __version__
from wrcore.errors import InputError, one_of, short
from wrcore.errors.checked_calls import checked
from wrcore.errors.checked_hdf5 import checked_hdf5, new_hdf5
from wrcore.run.checkpoints import read_checkpoint, write_checkpoint
from wrcore.run.output.channels import DESCRIPTIONS as DESCRIPTIONS
from wrcore.run.output.channels import unit_of as unit_of
from wrcore.run.output.datasets import ROWS, Datasets, describe, write_values
from wrcore.run.output.run import Run
from wrcore.run.state import State
from wrcore.scene.stored import StoredScene

FORMAT = "wrcore run"
FORMAT_VERSION = 3  # up to version 2, velocities and accelerations were in the ground's axes

KIND = "a complete run file (HDF5)"
STATUSES = ("completed", "derailed", "stalled", "failed")
RECORDS = ("scene", "settings", "counters")
END = "end"  # group of the last valid state (not of a body)


@checked
def write_run(
    path: str | PathLike[str], run: Run, also: Callable[[h5py.File, Run], object] | None = None, compressed: bool = True
) -> None:
    """Write a run to a file; the file appears under its name only when it is complete.

    Files of identical runs are bitwise identical: no date, host or path is stored. A digest of the bytes is at the
    beginning of the file.

    Parameters
    ----------
    path : path-like
        File to write (HDF5, its name ends in ``.h5`` or ``.hdf5``); its folder is created if needed.
    run : Run
        Run to write.
    also : callable, optional
        Called with the open file and the run, to add further data.
    compressed : bool
        Whether datasets are compressed.

    Examples
    --------
    >>> import wrcore as wr
    >>> from tempfile import TemporaryDirectory
    >>> run = wr.simulate(wr.example("suspended_wheelset"), integration__duration=0.1)
    >>> with TemporaryDirectory() as folder:
    ...     wr.write_run(f"{folder}/run.h5", run)
    ...     print(wr.load_run(f"{folder}/run.h5").status)
    completed
    """
    with new_hdf5(path) as file:
        file.attrs.update(format=FORMAT, format_version=FORMAT_VERSION, wrcore_version=__version__)
        file.attrs.update(status=run.status, reason=run.reason)
        file.attrs.update({name: _record(getattr(run, name)) for name in RECORDS})
        datasets = Datasets(file, len(run.t), compressed)
        write_values(file["t"], run.t)
        for group in sorted(run.groups):
            for name, values in sorted(run.groups[group].items()):
                write_values(datasets.create(group, name, np.shape(values)[1:]), values)
        datasets.finish()
        if run.end_state is not None:
            _write_end(file.create_group(END), run)
        if also is not None:
            also(file, run)


def _record(values):
    return json.dumps(values, sort_keys=True, default=_plain)


def _plain(value):
    """Convert numpy's numbers and arrays to values that JSON can represent."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} cannot be written to a run file")


def _write_end(group, run):
    """Write the last valid state with its time, the position of its moving frame and its vehicle."""
    text = "13 numbers per body, then own states of force elements and of wheels"
    described = (("t", "s", "time of the last valid state", run.end_t), ("state", "SI", text, run.end_state))
    for name, unit, description, values in described:
        describe(group.create_dataset(name, data=values).id, unit, description)
    if isinstance(run.end_state, State):
        group.attrs["frame_m"], group.attrs["vehicle"] = run.end_state.frame, _record(run.end_state.vehicle)


def write_going_on(file: h5py.File, run: Run, mark: str, places: tuple[np.ndarray, ...]) -> None:
    """Add the data needed to continue a run that ends here: fingerprint, checkpoint and arc lengths (``places``, m)."""
    file.attrs["fingerprint"] = mark
    if run.end is not None:
        write_checkpoint(file[END].create_group("checkpoint"), run.end)
        for k, place in enumerate(places):
            file[END].create_dataset(f"place_{k}", data=place)


def join_runs(path: str | PathLike[str], parts: Sequence[str | PathLike[str]], counters: dict[str, Any]) -> None:
    """Join the files of a run's sections, in order of time, to one run file with the counters of the whole run.

    At most `ROWS` rows of one dataset are in memory at a time. Status, reason and end are those of the last section.
    """
    lengths = [_length(part) for part in parts]
    with new_hdf5(path) as file:
        with checked_hdf5(parts[0], KIND) as first:
            shapes = {name: item.shape[1:] for name, item in _items(first) if isinstance(item, h5py.Dataset)}
        datasets = Datasets(file, sum(lengths), rows=max(lengths))
        for name, shape in sorted(shapes.items()):
            if name != "t":
                group, _, channel = name.rpartition("/")
                datasets.create(group, channel, shape)
        datasets.finish()
        begin = 0
        for part, length in zip(parts, lengths, strict=True):
            with checked_hdf5(part, KIND) as content:
                for at in range(0, length, ROWS):
                    end = min(at + ROWS, length)
                    for name in shapes:
                        file[name][begin + at : begin + end] = content[name][at:end]
            begin += length
        with checked_hdf5(parts[-1], KIND) as last:
            file.attrs.update(last.attrs)
            last.copy(END, file)
        file.attrs["counters"] = _record(counters)


def _length(part):
    with checked_hdf5(part, KIND) as file:
        return len(file["t"])


def _items(file):
    """Return names and items of a file, except those of the group `END`."""
    found: list[tuple[str, Any]] = []
    file.visititems(lambda name, item: found.append((name, item)))
    return [(name, item) for name, item in found if name.split("/")[0] != END]


@checked
def load_run(path: str | PathLike[str]) -> Run:
    """Read a run from a file that `write_run` wrote.

    Parameters
    ----------
    path : path-like
        HDF5 file.

    Returns
    -------
    Run

    Raises
    ------
    InputError
        If the file is absent, truncated, damaged, not HDF5, or HDF5 of another kind or version.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> run = Run({"name": "still"}, "completed", "", np.array([0.0, 0.5]), {"wheelset": {"y_m": np.zeros(2)}})
    >>> with TemporaryDirectory() as folder:
    ...     run.save(f"{folder}/run.h5")
    ...     load_run(f"{folder}/run.h5")["wheelset"].y_m
    array([0., 0.])
    """
    with checked_hdf5(path, KIND) as file:
        _check_format(path, file)
        run = _read_frame(file)
        for name, item in _items(file):
            if isinstance(item, h5py.Dataset) and "/" in name:
                group, channel = name.rsplit("/", 1)
                run.groups.setdefault(group, {})[channel] = item[()]
        _check_run(path, run)
    return run


@checked
def load_runs(paths: Iterable[str | PathLike[str]]) -> dict[str, dict[str, Run]]:
    """Read several runs from files ``<case>/<name>.h5``.

    Parameters
    ----------
    paths : iterable of path-like

    Returns
    -------
    dict of str to dict of str to Run
        Runs by folder name and by file name without its ending, in the order of the paths.

    Raises
    ------
    InputError
        If a file cannot be read, see `load_run`.

    Examples
    --------
    >>> import wrcore as wr
    >>> from tempfile import TemporaryDirectory
    >>> run = wr.simulate(wr.example("suspended_wheelset"), integration__duration=0.1)
    >>> with TemporaryDirectory() as folder:
    ...     run.save(f"{folder}/slow/spatial.h5")
    ...     print(wr.load_runs([f"{folder}/slow/spatial.h5"])["slow"].keys())
    dict_keys(['spatial'])
    """
    cases: dict[str, dict[str, Run]] = {}
    for path in map(Path, paths):
        cases.setdefault(path.parent.name, {})[path.stem] = load_run(path)
    return cases


def _check_format(path, file):
    found = file.attrs.get("format", "none")
    if found != FORMAT:
        raise InputError(path, "attribute format", f"expected {FORMAT!r}, got {short(found)}")
    version = int(file.attrs["format_version"])
    if version != FORMAT_VERSION:
        expected = f"expected {FORMAT_VERSION}, got {version}: 'wrcore simulate' runs its scene again"
        raise InputError(path, "attribute format_version", expected)


def _check_run(path, run):
    """Check the conditions that other modules rely on: known status, increasing times, one value or row per time."""
    if run.status not in STATUSES:
        raise InputError(path, "attribute status", one_of(STATUSES, run.status))
    if not isinstance(run.reason, str):
        raise InputError(path, "attribute reason", f"expected text, got {short(run.reason)}")
    for name in RECORDS:
        if not isinstance(getattr(run, name), dict):
            raise InputError(path, f"attribute {name}", "expected a JSON object")
    if not all(isinstance(value, int | float) for value in run.counters.values()):
        raise InputError(path, "attribute counters", "expected numbers")
    times = np.asarray(run.t)
    if times.ndim != 1 or times.dtype.kind != "f" or not (np.isfinite(times).all() and (np.diff(times) > 0.0).all()):
        raise InputError(path, "t", "expected increasing times")
    for group, channels in run.groups.items():
        for name, values in channels.items():
            _check_channel(path, f"{group}/{name}", np.asarray(values), len(times))


def _check_channel(path, name, values, count):
    """Check that a channel, or its dataset, has one number or row for each of ``count`` times."""
    if values.dtype.kind != "f" or len(values.shape) not in (1, 2) or values.shape[0] != count:
        expected = f"expected {count} numbers or rows of numbers, got {values.dtype} {values.shape}"
        raise InputError(path, name, expected)


def _read_frame(file):
    """Read a run without its channels."""
    records = {name: json.loads(file.attrs[name]) for name in RECORDS}
    records["scene"] = StoredScene(records["scene"]) if isinstance(records["scene"], dict) else records["scene"]
    run = Run(status=file.attrs["status"], reason=file.attrs["reason"], t=file["t"][()], groups={}, **records)
    if END in file:
        end = file[END]
        run.end_t, run.end_state = float(end["t"][()]), end["state"][()]
        if "frame_m" in end.attrs:
            names = tuple(json.loads(end.attrs["vehicle"]))
            run.end_state = State(run.end_state, run.end_t, float(end.attrs["frame_m"]), names)
        if "checkpoint" in end:
            run.end = read_checkpoint(end["checkpoint"])
    return run


def read_part(path: str | PathLike[str]) -> tuple[str, Run, list[np.ndarray]]:
    """Read a section of a run, without its channels, that can be continued.

    Return the fingerprint that :func:`write_going_on` added (empty if the run cannot be continued), the run, and its
    arc lengths, m.
    """
    with checked_hdf5(path, KIND) as file:
        _check_format(path, file)
        run = _read_frame(file)
        _check_run(path, run)
        for name, item in _items(file):
            if isinstance(item, h5py.Dataset) and "/" in name:
                _check_channel(path, name, item, len(run.t))
        places = [file[END][name][()] for name in sorted(file.get(END, ())) if name.startswith("place_")]
        return str(file.attrs.get("fingerprint", "")) if run.end else "", run, places
