"""Shards of training data: files of a folder that are never incomplete."""

import hashlib
import json
import os
from pathlib import Path

import numpy as np

from wrcore.errors import InputError

SETTINGS = "settings.json"


def path_of(folder, number):
    """Return the path of the shard with this number."""
    return Path(folder) / f"patches-{number:05d}.npz"


def write(path, arrays):
    """Write arrays by name to an npz file, first under a temporary name so that the file is never incomplete."""
    path = Path(path)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.npz")
    try:
        np.savez(temporary, **arrays)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def read(path):
    """Return the arrays of an npz file by name."""
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def found_in(folder):
    """Return the sorted paths of the shards of a folder; InputError if there are none."""
    paths = sorted(Path(folder).glob("patches-*.npz"))
    if not paths:
        raise InputError(str(folder), "shards", "expected files patches-*.npz, as study.surrogate.patches writes them")
    return paths


def digest_of(paths):
    """Return the SHA-256 of the content of files, as text."""
    digest = hashlib.sha256()
    for path in paths:
        digest.update(Path(path).read_bytes())
    return digest.hexdigest()


def keep_settings(folder, settings):
    """Write the settings of a folder; InputError if the folder has shards with other settings."""
    path = Path(folder) / SETTINGS
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.exists():
        known = json.loads(path.read_text("utf-8"))
        for name, value in settings.items():
            if known.get(name) != value:
                expected = f"expected {known.get(name)} as in the existing shards, got {value}; choose a new folder"
                raise InputError(str(path), name, expected)
        return
    temporary = path.with_suffix(f".{os.getpid()}.tmp")
    temporary.write_text(json.dumps(settings, indent=1) + "\n", "utf-8")
    os.replace(temporary, path)
