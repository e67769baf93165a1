"""Training data of the surrogate's network, from shards of patches: scaled inputs, targets, twins."""

from typing import NamedTuple

import numpy as np

from study.surrogate import shards
from wrcore.contact.surrogate.network import N_CORRECTIONS, force_modes
from wrcore.errors import InputError

HELD_BACK = 20
"""Reciprocal of the share of pairs that are held back to measure the errors of the network."""

CORRECTION_ERRORS = np.array([1e-3, 2e-3, 2e-3, 8e-3, 5e-4, 1e-3, 3e-4, 2e-4])
"""Scales of the errors of the corrections: ln N, ln a, ln b, ln p_max, position along and across the patch over l,
contact angle (rad), and height over l. With eight times these scales for position and angle, linear critical speeds
have errors of 1 to 3 m/s."""

FORCE_ERRORS = np.array([0.005, 0.005, 0.01])
"""Scales of the errors of the creep force (over friction times N) and of the moment (over friction times N times c)."""

OUTPUT_SCALE = 5.0
"""Factor of the corrections: corrections divided by `CORRECTION_ERRORS` are this factor times the network's outputs."""

BIRTH_WEIGHT = 0.1
"""Weight of twins with several overlaps. At 1 they dominate the loss, and the error of the force on treads rises by
20 %."""

FALLBACK_SCALE = 0.15
"""Minimum scale of a descriptor, relative to its standard deviation. Some descriptors are 0 in most patches."""


class Scaling(NamedTuple):
    """Shift (``median``), scale and range of the descriptors, each with shape (N_DESCRIPTORS,)."""

    median: np.ndarray
    scale: np.ndarray
    least: np.ndarray
    greatest: np.ndarray
    """Upper end of the range that contains 99.8 % of the training data; ``least`` is its lower end."""

    def compressed(self, descriptors):
        """Return the inputs of the network (float32) from descriptors."""
        x = (descriptors - self.median) / self.scale
        return (x / (1.0 + x * x) ** 0.25).astype(np.float32)


class Patches(NamedTuple):
    """Inputs and targets of patches, scaled for the loss."""

    inputs: np.ndarray
    corrections: np.ndarray
    """(n, N_CORRECTIONS): corrections divided by `CORRECTION_ERRORS`."""
    forces: np.ndarray
    """(n, POINTS, 3): remainder divided by `FORCE_ERRORS`."""
    disk: np.ndarray
    """(n, POINTS, 2): positions of the creepages in the disk of the force modes."""


class Twins(NamedTuple):
    """Pairs of neighbouring patches: their indices, distance (m) and weight."""

    first: np.ndarray
    second: np.ndarray
    step: np.ndarray
    weight: np.ndarray


class TrainingData(NamedTuple):
    """Training data, and the data that are held back to measure the errors."""

    scaling: Scaling
    training: Patches
    twins: Twins
    held_back: Patches
    digest: str
    """SHA-256 of the shards."""


def scaling_of(descriptors):
    """Return the `Scaling` of training descriptors (n, N_DESCRIPTORS)."""
    low, median, high = np.percentile(descriptors, [5, 50, 95], axis=0)
    scale = np.maximum((high - low) / 3.3, FALLBACK_SCALE * np.std(descriptors, axis=0))
    least, greatest = np.percentile(descriptors, [0.1, 99.9], axis=0)
    scale, width = np.maximum(scale, 1e-6), np.maximum(greatest - least, 1e-9)
    return Scaling(median, scale, least, least + width)


def known_scaling(weights):
    """Return the `Scaling` of the weights of a trained network."""
    return Scaling(*(weights[name] for name in Scaling._fields))


def _joint_scaling(start, own):
    """Return the `Scaling` with shift and scale of trained weights; its range covers theirs and that of ``own``."""
    known = known_scaling(start)
    return known._replace(least=np.minimum(known.least, own.least), greatest=np.maximum(known.greatest, own.greatest))


def run_teacher(teacher, descriptors):
    """Return corrections (n, N_CORRECTIONS) and coefficients of the force modes (n, modes) from trained weights."""
    x = known_scaling(teacher).compressed(descriptors).astype(float)
    for k in (1, 2, 3, 4):
        x = x @ teacher[f"weights_{k}"].astype(float) + teacher[f"biases_{k}"]
        x = 0.5 * x * (1.0 + x / np.sqrt(x * x + 4.0)) if k < 4 else x
    return x[:, :N_CORRECTIONS] * teacher["corrections"], x[:, N_CORRECTIONS:]


def taught(teacher, descriptors, disk):
    """Return corrections (n, N_CORRECTIONS) and remainders (n, POINTS, 3) from trained weights."""
    corrections, coefficients = run_teacher(teacher, descriptors)
    remainders = np.empty((*disk.shape[:2], 3), np.float32)
    for first in range(0, len(disk), 2000):
        some = disk[first : first + 2000].astype(float)
        modes = force_modes(teacher, *some.reshape(-1, 2).T).reshape(*some.shape[:2], 3, -1)
        remainders[first : first + 2000] = np.einsum("nk,npck->npc", coefficients[first : first + 2000], modes)
    return corrections, remainders


def joined(folders):
    """Return the arrays of all shards by name, and the digest. Numbers of pairs are made unique over the folders."""
    paths, parts = [], []
    for place, folder in enumerate(folders):
        for path in shards.found_in(folder):
            part = shards.read(path)
            part["pair"] = part["pair"].astype(np.int64) + place * 10**9
            paths.append(path)
            parts.append({name: array for name, array in part.items() if name not in _OF_SHARD})
    names = set.intersection(*(set(part) for part in parts))
    return {name: np.concatenate([part[name] for part in parts]) for name in names}, shards.digest_of(paths)


_OF_SHARD = "names", "distances", "failed"
"""Names of the arrays of a shard whose first axis is not the patches."""


def _random_disk(n):
    """Return positions (n, POINTS, 2) of creepages in the disk, for patches that are not solved."""
    from study.surrogate.solution import AT_REST, N_RANDOM, random_points
    from wrcore.wheels.table.lookup import DISK

    random = np.random.default_rng(n)
    points = random_points(random, n * N_RANDOM).reshape(n, N_RANDOM, 2)
    points = np.concatenate([np.tile(AT_REST, (n, 1, 1)), points], axis=1)
    return points / (DISK + np.sqrt(DISK**2 + (points**2).sum(-1, keepdims=True)))


def load(folders, teacher=None, start=None):
    """Return the `TrainingData` of folders with shards.

    With a ``teacher`` (arrays of weights by name) the targets are its outputs, and the shards may be unsolved. With
    weights ``start``, the inputs are shifted and scaled like those of these weights."""
    rows, digest = joined(folders)
    descriptors, disk = rows["descriptors"].astype(float), rows.get("disk")
    if teacher is not None:
        disk = _random_disk(len(descriptors)) if disk is None else disk
        corrections, remainder = taught(teacher, descriptors, disk)
    elif "corrections" in rows:
        corrections, remainder = rows["corrections"], rows["exact"] - rows["base"]
    else:
        raise InputError(str(folders[0]), "shards", "expected solved patches, or --teacher with weights to learn from")
    whole = Patches(descriptors, corrections / CORRECTION_ERRORS, remainder / FORCE_ERRORS, disk)
    is_usable = np.all([np.isfinite(a).reshape(len(a), -1).all(1) for a in whole], axis=0)
    held = is_held_back(rows["pair"])
    if held.all() or not held.any():
        raise InputError(str(folders[0]), "shards", "expected patches of at least two pairs")
    training, held_back = np.flatnonzero(is_usable & ~held), np.flatnonzero(is_usable & held)
    scaling = known_scaling(teacher) if teacher is not None else scaling_of(descriptors[training])
    scaling = _joint_scaling(start, scaling) if start is not None else scaling
    parts = (_part(whole, scaling, some) for some in (training, held_back))
    return TrainingData(scaling, next(parts), _twins(rows, training), next(parts), digest)


def is_held_back(pairs):
    """Whether the pair of each patch is held back. The result depends only on the number of the pair."""
    known = np.unique(pairs)
    held = [pair for pair in known if np.random.default_rng(int(pair)).random() < 1.0 / HELD_BACK]
    return np.isin(pairs, held or known[-1:])


def _part(whole, scaling, some):
    inputs = scaling.compressed(whole.inputs[some])
    return Patches(inputs, *(array[some].astype(np.float32) for array in whole[1:]))


def _twins(rows, training):
    """Return the `Twins` among the patches with the indices ``training``."""
    place = np.full(len(rows["pair"]), -1)
    place[training] = np.arange(len(training))
    first = np.flatnonzero((rows["twin"][:-1] == 0) & (rows["twin"][1:] == 1))
    first = first[(place[first] >= 0) & (place[first + 1] >= 0)]
    overlaps = np.maximum(rows["overlaps"][first], rows["overlaps"][first + 1])
    weight = np.where(overlaps > 1, BIRTH_WEIGHT, 1.0)
    step = rows["step"][first]
    return Twins(place[first], place[first + 1], step.astype(np.float32), weight.astype(np.float32))
