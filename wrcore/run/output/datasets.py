"""Write channels as datasets of a run file: each with unit and description, over one dimension scale of times.

This uses the low-level interface of HDF5. ``attach_scale`` of h5py rewrites the scale's list of datasets for each of
them, and h5py first creates each attribute under another name. Both together take more than half of the time of writing
a run.
"""

import h5py
import numpy as np
from h5py import h5a, h5d, h5p, h5r, h5s, h5t

from wrcore.run.output.channels import DESCRIPTIONS, unit_of

ROWS = 8192
"""Largest number of rows of a chunk."""

LEVEL = 3
"""Level of deflate compression: level 4 takes a sixth more time for files 0.5 % smaller; level 1 is not faster."""

LONGEST_LIST = 4000
"""Largest number of datasets in the scale's list: an attribute holds 64 KiB. Readers find the scale by
``DIMENSION_LIST``."""

_TEXT, _SCALAR = h5t.py_create(h5py.string_dtype(), logical=True), h5s.create(h5s.SCALAR)
_ENTRY = np.dtype({
    "names": ["dataset", "dimension"], "formats": [h5py.ref_dtype, np.int32], "offsets": [0, 8], "itemsize": 16,
})  # fmt: skip


class Datasets:
    """Datasets of a file over its ``count`` times ``t``, compressed in chunks of at most ``rows`` rows; call `finish`
    when all are created."""

    def __init__(self, file: h5py.File, count: int, compressed: bool = True, rows: int = ROWS) -> None:
        self._file, self._count, self._rows, self._compressed = file, count, min(count, rows, ROWS), compressed
        self._groups, self._made, self._entries = {}, {}, []
        h5py.Dataset(self._create(file.id, "t", (count,))).make_scale("t")
        self._scale = np.array([h5r.create(file.id, b"t", h5r.OBJECT)], h5py.ref_dtype)

    def create(self, group: str, name: str, shape: tuple[int, ...] = ()) -> h5py.Dataset:
        """Create the dataset of a channel in a group; ``shape`` is the shape of its value at one time."""
        if group not in self._groups:
            self._groups[group] = self._file.require_group(group).id
        dataset = self._create(self._groups[group], name, (self._count, *shape))
        scales = np.empty(1 + len(shape), h5py.vlen_dtype(h5py.ref_dtype))
        scales[:] = [self._scale, *(np.empty(0, h5py.ref_dtype) for _ in shape)]
        kind, space = h5t.vlen_create(h5t.STD_REF_OBJ), h5s.create_simple(scales.shape)
        h5a.create(dataset, b"DIMENSION_LIST", kind, space).write(scales)
        self._entries.append((h5r.create(dataset, b".", h5r.OBJECT), 0))
        return h5py.Dataset(dataset)

    def finish(self) -> None:
        """Write the list of datasets that belong to the dimension scale."""
        if 0 < len(self._entries) <= LONGEST_LIST:
            self._file["t"].attrs.create("REFERENCE_LIST", np.array(self._entries, _ENTRY), dtype=_ENTRY)

    def _create(self, group, name, shape):
        if shape not in self._made:
            self._made[shape] = h5s.create_simple(shape), self._properties(shape)
        dataset = h5d.create(group, name.encode(), h5t.IEEE_F64LE, *self._made[shape])
        describe(dataset, unit_of(name), DESCRIPTIONS.get(name, name.replace("_", " ")))
        return dataset

    def _properties(self, shape):
        """Return creation properties of datasets: chunks have one column, because columns of absent patches hold only
        NaN, which compresses well."""
        properties = h5p.create(h5p.DATASET_CREATE)
        properties.set_obj_track_times(False)
        if self._compressed and self._count:
            properties.set_chunk((max(self._rows, 1), *(1 for _ in shape[1:])))
            properties.set_shuffle()
            properties.set_deflate(LEVEL)
        return properties


def describe(dataset: h5d.DatasetID, unit: str, description: str) -> None:
    """Add the attributes ``units`` and ``description`` to a dataset."""
    for name, text in ((b"units", unit), (b"description", description)):
        h5a.create(dataset, name, _TEXT, _SCALAR).write(np.array(text, h5py.string_dtype()))


def write_values(dataset: h5py.Dataset, values: np.ndarray) -> None:
    """Write all values of a dataset."""
    dataset.id.write(h5s.ALL, h5s.ALL, np.ascontiguousarray(values, float))
