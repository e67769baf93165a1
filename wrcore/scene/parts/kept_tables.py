"""Disk cache of section tables for changing rails and for wheels described by slices.

A table takes seconds to compute and serves many runs.
"""

import hashlib
import io
import math
import os
from contextlib import suppress

import numpy as np

from wrcore.contact.changing_rails.out_of_round import SlicedWheel
from wrcore.contact.changing_rails.section_table import SectionTable, section_table, shape_table
from wrcore.contact.changing_rails.sections import WheelOnSlices
from wrcore.contact.search.geometry import ContactGeometry
from wrcore.errors.messages import say_if_long
from wrcore.errors.new_files import appearing
from wrcore.kernels.cache import drop_unused, table_folder

FORM = 1
"""Version of these tables. Increase it with every change to the numbers in a table, so that cached tables are ignored
and computed again. A test compares a table with a stored one."""

SEAL = 32
"""Length of the SHA-256 digest at the end of a file, bytes."""

TABLE_FIELDS = "begin", "step", "sections", "strips", "bounds"


def kept_table(pair, slices, backwards, lateral=None):
    """Return the `section_table` for slices in place of a pair's rail, from the cache if it is there."""
    wheel = WheelOnSlices(pair.wheel, slices, pair.rolling_radius, pair.half_distance, pair.rail_distance)
    lateral = lateral or slices.lateral
    digest = _digest(pair, slices.sheets, slices.s, backwards, *lateral)
    return _kept(digest, lambda: section_table(wheel, pair.rail, backwards, lateral))


def kept_shape(pair, shape):
    """Return the `shape_table` of a pair and a shape of its wheel or rail.

    Only tables of wheels described by slices are cached; the others are computed at once.
    """
    if not isinstance(shape, SlicedWheel):
        return shape_table(pair, shape)
    digest = _digest(pair, shape.slices.sheets, shape.slices.angles, math.nan)
    return _kept(digest, lambda: shape_table(pair, shape))


def _kept(digest, make):
    """Return the table with a digest from the cache; if it is missing, compute it with ``make`` and store it."""
    path = table_folder() / f"seen_{digest}.npz"
    table = _read(path)
    if table is None:
        with say_if_long("what wheels see of slices is worked out, once"):
            table = make()
        parts = {name: getattr(table, name) for name in TABLE_FIELDS} | table.geometry._asdict()
        del parts["over"]
        with suppress(OSError), appearing(path) as file:
            content = io.BytesIO()
            np.savez(content, **parts)
            file.write(content.getvalue() + _seal(content.getvalue()))
        drop_unused(table_folder(), "seen_*.npz")
    return table


def _read(path):
    """Return the `SectionTable` of a file, or None if the file is missing or damaged."""
    with suppress(OSError):
        content = path.read_bytes()
        arrays, seal = content[:-SEAL], content[-SEAL:]
        if seal == _seal(arrays):
            with suppress(Exception), np.load(io.BytesIO(arrays), allow_pickle=False) as found:  # of another version
                table = _table_of(found)
                os.utime(path)
                return table
    return None


def _seal(content):
    """Return the SHA-256 of a file's content. It is appended to the file, where readers of ZIP files ignore it."""
    return hashlib.sha256(content).digest()


def _table_of(found):
    """Return the `SectionTable` built from a file's arrays."""
    parts = {name: found[name] for name in found.files}
    parts = {name: part if part.ndim else part.item() for name, part in parts.items()}
    own = {name: parts.pop(name) for name in TABLE_FIELDS}
    return SectionTable(**own, geometry=ContactGeometry(**parts))


def _digest(pair, sheets_of_it, places, *numbers):
    """Return a digest of all inputs of a table: a pair, sheets, positions of their slices, and further numbers."""
    digest = hashlib.sha256(f"{FORM}".encode())
    curves = [array for curve in (pair.wheel, pair.rail) for array in (curve.u, curve.f, curve.df, curve.d2f)]
    sheets = [array for sheet in sheets_of_it for array in (sheet.s, sheet.points, (sheet.first, sheet.last))]
    bends = [sheet.spline.c for sheet in sheets_of_it if sheet.spline is not None]
    sizes = pair.rolling_radius, pair.half_distance, pair.rail_distance, *numbers
    for part in (*curves, *sheets, *bends, places, sizes):
        digest.update(f"{np.shape(part)}".encode() + np.ascontiguousarray(part, float).tobytes())
    return digest.hexdigest()[:16]
