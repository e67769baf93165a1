"""Input files: refusal of files that are not regular, and digests of their content."""

import hashlib
import os
import stat
from collections.abc import Mapping

from wrcore.errors import InputError


def check_regular(path: str | os.PathLike[str]) -> None:
    """Raise an OSError if a path is not a regular file, because reading a pipe or a device may never end."""
    if not stat.S_ISREG(os.stat(path).st_mode):
        raise OSError(0, "no regular file", str(path))


def digest_of_file(path: str | os.PathLike[str]) -> str:
    """Return the SHA-256 of the bytes of a regular file; empty if it cannot be read."""
    try:
        check_regular(path)
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ""


def digest_of_all(digests: Mapping[str, str]) -> str:
    """Return one digest of the names and digests of several files, independent of their folders; empty for no files."""
    each = sorted(f"{os.path.basename(path)} {digest}" for path, digest in digests.items())
    return hashlib.sha256("\n".join(each).encode()).hexdigest() if each else ""


def check_unchanged(digests: Mapping[str, str]) -> None:
    """Raise an InputError for the first file whose content differs from its digest; ``digests`` are by path."""
    for path, digest in digests.items():
        if digest_of_file(path) != digest:
            raise InputError(path, "", "expected the content with which this began, but it was changed since")
