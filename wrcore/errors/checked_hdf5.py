"""HDF5 files with a digest: wrcore checks the digest and the structure of a file before it reads the data.

The first `BLOCK` bytes, the user block of HDF5, hold the SHA-256 of all following bytes. Some readers also accept a
file without a digest (of an older version); damage of such a file may remain undetected.
"""

import hashlib
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager

import h5py
import numpy as np

from wrcore.errors import InputError
from wrcore.errors.input_files import check_regular
from wrcore.errors.new_files import HDF5, appearing, named

BLOCK = 512
SIGNATURE = b"\x89HDF\r\n\x1a\n"
HEAD = b"HDF5 with SHA-256 of all that follows byte 512: "

FILTERS = {h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32}
MOST_DEFLATED = 1100  # largest ratio of data to stored bytes; deflate reaches 1032
LARGEST_CHUNK = 2**26  # bytes


@contextmanager
def new_hdf5(path: str | os.PathLike[str], **options: bool) -> Iterator[h5py.File]:
    """Create an HDF5 file (:class:`h5py.File` with options) with a digest; it appears under its name when complete.

    An InputError is raised if the name does not end as an HDF5 file does."""
    named(path, HDF5, "file")
    with appearing(path) as whole:
        patient = _Patient(whole.raw)
        try:
            with h5py.File(patient, "w", userblock_size=BLOCK, **options) as file:
                yield file
        finally:
            if patient.fault is not None:
                raise patient.fault
        _sign(whole)


class _Patient:
    """A file that accepts all writes of HDF5 and stores the first error: HDF5 crashes if closing a file fails."""

    def __init__(self, file):
        self.file, self.fault = file, None
        self.seek, self.tell, self.read, self.readinto = file.seek, file.tell, file.read, file.readinto

    def _tried(self, act, *args):
        try:
            return None if self.fault else act(*args)
        except OSError as error:
            self.fault = error

    def write(self, data):
        left = memoryview(data).cast("B")
        while len(left) and not self.fault:
            left = left[self._tried(self.file.write, left) or 0 :]
        return len(data)

    def truncate(self, size=None):
        self._tried(self.file.truncate, size)

    def flush(self):
        """Do nothing, as writes are not buffered."""


def _digest(file):
    file.seek(BLOCK)
    return HEAD + hashlib.file_digest(file, "sha256").hexdigest().encode()


def _sign(file):
    head = _digest(file)
    file.seek(0)
    file.write(head.ljust(BLOCK, b"\0"))


def sign(path: str | os.PathLike[str]) -> None:
    """Write the digest of a file again, after an intended edit of the file."""
    with open(path, "r+b") as file:
        _sign(file)


@contextmanager
def checked_hdf5(path: str | os.PathLike[str], kind: str) -> Iterator[h5py.File]:
    """Open an HDF5 file of wrcore for reading, after a check of its content.

    The content must agree with the digest, all links must lead to the file itself, and all datasets must hold numbers
    or text that are stored in the file. Any error, also while the file is read, is an `InputError` of one line that
    names the expected ``kind`` of file.
    """
    try:
        _check_bytes(path)
        with h5py.File(path, "r") as file, np.errstate(over="ignore"):
            _check_content(file, os.path.getsize(path))
            yield file
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(path, "", f"expected {kind}, got no such file") from None
    except Exception as error:  # a damaged file fails in as many ways as h5py, numpy and JSON have
        raise InputError(path, "", f"expected {kind}, got: {getattr(error, 'strerror', None) or error}") from None


def foreign(path: str | os.PathLike[str]) -> bool:
    """Whether a file is HDF5 without a digest of wrcore, so that its content cannot be verified."""
    try:
        check_regular(path)
        with open(path, "rb") as file:
            return not file.read(BLOCK).startswith(HEAD) and h5py.is_hdf5(path)
    except OSError:
        return False


def _check_bytes(path):
    """Raise a ValueError if a file does not agree with the digest in its first bytes."""
    check_regular(path)
    with open(path, "rb") as file:
        head = file.read(BLOCK)
        if head.startswith(SIGNATURE):
            raise ValueError("HDF5 without the digest that ours begins with (of another program, or version)")
        if not head.startswith(HEAD):
            raise ValueError("another kind of file")
        if head.rstrip(b"\0") != _digest(file):
            raise ValueError("a content that its SHA-256 does not belong to (damaged, or edited)")


def _check_content(file, size):
    """Raise a ValueError if links lead out of a file, or if its data are larger than the file can hold."""
    foreign, items, stored = [], [], 0
    file.visititems_links(lambda name, link: foreign.append(name) if not isinstance(link, h5py.HardLink) else None)
    if foreign:
        raise ValueError(f"a link that leads elsewhere: {foreign[0]}")
    file.visititems(lambda name, item: items.append((name, item)))
    for name, item in items:
        if isinstance(item, h5py.Dataset):
            fault = dataset_fault(item.id)
            if fault:
                raise ValueError(f"{fault}: {name}")
            stored += item.id.get_storage_size()
        elif not isinstance(item, h5py.Group):
            raise ValueError(f"neither group nor dataset: {name}")
    if stored > size:
        raise ValueError("datasets that share their storage")


def dataset_fault(dataset):
    """Return the reason why a dataset is refused, or an empty text. The storage layout is checked first."""
    made = dataset.get_create_plist()
    layout = made.get_layout()
    if layout not in (h5py.h5d.COMPACT, h5py.h5d.CONTIGUOUS, h5py.h5d.CHUNKED) or made.get_external_count():
        return "a dataset stored elsewhere"
    if not {made.get_filter(k)[0] for k in range(made.get_nfilters())} <= FILTERS:
        return "a dataset with an unknown filter"
    kind, shape = dataset.dtype, dataset.shape
    if kind.kind not in "fiub" and h5py.check_string_dtype(kind) is None or shape is None:
        return "a dataset that holds neither numbers nor text"
    if layout == h5py.h5d.CHUNKED and math.prod(made.get_chunk()) * kind.itemsize > LARGEST_CHUNK:
        return "a dataset in huge chunks"
    if math.prod(shape) * kind.itemsize > MOST_DEFLATED * dataset.get_storage_size():
        return "a dataset larger than what is stored"
    return ""
