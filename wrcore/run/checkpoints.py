"""Checkpoints in HDF5 files: nested tuples of arrays and numbers, stored exactly as groups, datasets and attributes."""

import hashlib
from typing import NamedTuple, get_type_hints

import h5py
import numpy as np

from wrcore.contact.normal.strips import MEMORY
from wrcore.equations.model import Model
from wrcore.integrate.engine import Memory
from wrcore.integrate.rosenbrock import Linear
from wrcore.integrate.trajectory import Checkpoint

NOT_THERE = {"patches": np.zeros((0, 0, 0, MEMORY)), "notes": np.zeros(0)}
"""Values of datasets that files of older versions do not contain."""


class _Saved(NamedTuple):
    """Fields of a checkpoint that are stored in a file; ``linear`` is None for a method without a Jacobian."""

    memory: Memory
    linear: Linear
    arc_lengths: np.ndarray
    patches: np.ndarray
    notes: np.ndarray


def write_checkpoint(group: h5py.Group, checkpoint: Checkpoint) -> None:
    """Write a checkpoint into an empty group."""
    for name in ("method", "t", "model"):
        group.attrs[name] = getattr(checkpoint, name)
    _write(group, _Saved(*(getattr(checkpoint, name) for name in _Saved._fields)))


def read_checkpoint(group: h5py.Group) -> Checkpoint:
    """Read a checkpoint that `write_checkpoint` wrote; KeyError if an entry is missing."""
    saved = _read(group, _Saved)
    if saved.patches.shape[-1] != MEMORY:  # file of an earlier version: start without stored patches
        saved = saved._replace(patches=np.zeros((*saved.patches.shape[:-1], MEMORY)))
    return Checkpoint(str(group.attrs["method"]), float(group.attrs["t"]), *saved, str(group.attrs.get("model", "")))


def _write(group, parts):
    for name, part in parts._asdict().items():
        if isinstance(part, tuple):
            _write(group.create_group(name), part)
        elif isinstance(part, np.ndarray):
            group.create_dataset(name, data=part)
        elif part is not None:
            group.attrs[name] = part


def _read(group, kind):
    """Read a tuple of the class ``kind`` from a group; arrays and numbers get the types that the kernels expect."""
    parts = {}
    for name, type_ in get_type_hints(kind).items():
        if type_ is np.ndarray:
            kept = group[name][()] if name in group or name not in NOT_THERE else NOT_THERE[name]
            parts[name] = np.ascontiguousarray(kept)
        elif issubclass(type_, tuple):
            parts[name] = _read(group[name], type_) if name in group else None
        else:
            parts[name] = type_(group.attrs[name])
    return kind(**parts)


def model_fingerprint(model: Model) -> str:
    """Return the SHA-256 digest (hex) of all numbers of a compiled model."""
    creep = model.contact.creep._replace(own_kernel=0)  # an address of this process only
    return digest_of(model._replace(contact=model.contact._replace(creep=creep))).hexdigest()


def digest_of(parts, *texts: str):
    """Return the SHA-256 hash object of texts and of all arrays of nested tuples, with their types and shapes."""
    digest = hashlib.sha256("\0".join(texts).encode())
    for array in _numbers(parts):
        digest.update(f"{array.dtype}{array.shape}".encode() + array.tobytes())
    return digest


def _numbers(parts):
    if isinstance(parts, tuple):
        return [array for part in parts for array in _numbers(part)]
    return [np.ascontiguousarray(parts)]
