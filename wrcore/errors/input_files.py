"""Files that are read: regular ones, and a digest of what they held."""

import hashlib
import os
import stat
from collections.abc import Mapping

from wrcore.errors import InputError


def check_regular(path: str | os.PathLike[str]) -> None:
    """OSError for what is no regular file: reading a pipe or a device may never end."""
    if not stat.S_ISREG(os.stat(path).st_mode):
        raise OSError(0, "no regular file", str(path))


def digest_of_file(path: str | os.PathLike[str]) -> str:
    """SHA-256 of a regular file's bytes; empty where it cannot be read."""
    try:
        check_regular(path)
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ""


def digest_of_all(digests: Mapping[str, str]) -> str:
    """One digest of several files' names and digests, by path, wherever they lie; empty of none."""
    each = sorted(f"{os.path.basename(path)} {digest}" for path, digest in digests.items())
    return hashlib.sha256("\n".join(each).encode()).hexdigest() if each else ""


def check_unchanged(digests: Mapping[str, str]) -> None:
    """InputError for the first file, of several by path, that no longer is what its digest says."""
    for path, digest in digests.items():
        if digest_of_file(path) != digest:
            raise InputError(path, "", "expected the content with which this began, but it was changed since")
