"""Output files of commands: paths are checked before the computation, and files are never incomplete."""

import json

from wrcore.errors import InputError
from wrcore.errors.new_files import HDF5, appearing
from wrcore.errors.new_files import output as output


def refuse_others(path, attribute, wanted):
    """Refuse to overwrite an HDF5 file whose attribute (for a scene: its name) has another value than ``wanted``."""
    if path.suffix.lower() not in HDF5 or not path.exists():
        return
    from wrcore.errors.checked_hdf5 import checked_hdf5, foreign

    found = "something else"
    if not foreign(path):
        try:
            with checked_hdf5(path, f"one of {wanted!r}") as file:
                value = str(file.attrs.get(attribute, found))
                found = json.loads(value)["name"] if attribute == "scene" and value != found else value
        except InputError:  # damaged or unreadable: it may be overwritten
            return
    if found != wanted:
        raise InputError("--out", path, f"expected no file, or one of {wanted!r}; this one is of {found!r}: remove it")


def write_csv(frame, path):
    """Write a table as CSV; the file appears only when it is complete."""
    with appearing(path) as file:
        frame.to_csv(file, index=False, float_format="%.12g")
