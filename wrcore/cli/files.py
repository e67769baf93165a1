"""Files that commands write: refused before any work starts, and never half a file."""

import json
import os
from pathlib import Path

from wrcore.errors import InputError
from wrcore.errors.new_files import appearing, try_out

HDF5 = (".h5", ".hdf5")


def output(path, endings=(".csv",), option="--out"):
    """Refuse an output path that cannot be written, or is of another kind, before any work starts."""
    if Path(path).suffix.lower() not in endings:
        raise InputError(option, path, f"expected a name that ends in {' or '.join(endings)}")
    if not os.path.isdir(os.path.dirname(os.path.abspath(path))) or os.path.isdir(path):
        raise InputError(option, path, "expected a file in an existing folder")
    try:  # permissions do not tell whether a disk is full or a name is too long
        try_out(path)
    except OSError as error:
        raise InputError(option, path, f"expected a file that can be written: {error.strerror}") from None
    return Path(path)


def refuse_others(path, attribute, wanted):
    """Refuse to write over an HDF5 file whose attribute (of a scene: its name) says that it is something else."""
    if path.suffix.lower() not in HDF5 or not path.exists():
        return
    import h5py

    try:
        with h5py.File(path) as file:
            found = str(file.attrs.get(attribute, "something else"))
        found = json.loads(found)["name"] if attribute == "scene" else found
    except (OSError, ValueError, KeyError, TypeError):
        found = "something else" if h5py.is_hdf5(path) else wanted  # what no program can read may go
    if found != wanted:
        raise InputError("--out", path, f"expected no file, or one of {wanted!r}; this one is of {found!r}: remove it")


def write_csv(frame, path):
    """Write a table: never half a file."""
    with appearing(path) as file:
        frame.to_csv(file, index=False, float_format="%.12g")
