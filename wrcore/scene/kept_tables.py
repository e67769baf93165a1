"""Tables of what wheels see of rails that change, kept in the cache: they take seconds, and one serves many runs."""

import hashlib
import os
from contextlib import suppress
from zipfile import BadZipFile

import numpy as np

from wrcore.contact.geometry import ContactGeometry
from wrcore.contact.seen_rail import WheelOnSlices
from wrcore.contact.seen_table import SeenTable, seen_table
from wrcore.errors.new_files import appearing
from wrcore.kernels.cache import drop_unused, source_digest, table_folder

OWN = "begin", "step", "sections", "strips", "bounds"


def kept_table(pair, slices, backwards):
    """`SeenTable` of slices in place of a pair's rail, from the cache where it was made before."""
    wheel = WheelOnSlices(pair.wheel, slices, pair.rolling_radius, pair.half_distance, pair.rail_distance)
    path = table_folder() / f"seen_{_digest(pair, slices, backwards)}.npz"
    try:
        with np.load(path) as found:
            table = _table_of(found)
        os.utime(path)
    except (OSError, ValueError, KeyError, EOFError, BadZipFile):  # none yet, or no whole one
        table = seen_table(wheel, pair.rail, backwards)
        parts = {name: getattr(table, name) for name in OWN} | table.geometry._asdict()
        del parts["over"]
        with suppress(OSError), appearing(path) as file:
            np.savez(file, **parts)
        drop_unused(table_folder(), "seen_*.npz")
    return table


def _table_of(found):
    """The `SeenTable` of a file's arrays."""
    parts = {name: found[name] for name in found.files}
    parts = {name: part if part.ndim else part.item() for name, part in parts.items()}
    own = {name: parts.pop(name) for name in OWN}
    return SeenTable(**own, geometry=ContactGeometry(**parts))


def _digest(pair, slices, backwards):
    """Digest of all that a table depends on."""
    digest = hashlib.sha256(source_digest().encode())
    curves = [array for curve in (pair.wheel, pair.rail) for array in (curve.u, curve.f, curve.df, curve.d2f)]
    sheets = [array for sheet in slices.sheets for array in (sheet.s, sheet.points, (sheet.first, sheet.last))]
    bends = [sheet.spline.c for sheet in slices.sheets if sheet.spline is not None]
    sizes = pair.rolling_radius, pair.half_distance, pair.rail_distance, backwards
    for part in (*curves, *sheets, *bends, slices.s, sizes):
        digest.update(f"{np.shape(part)}".encode() + np.ascontiguousarray(part, float).tobytes())
    return digest.hexdigest()[:16]
