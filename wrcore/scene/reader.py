"""The reader of a scene finds the files and laws that a part of the scene names, and names the part in errors."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from wrcore.errors import InputError
from wrcore.errors.input_files import digest_of_file
from wrcore.kernels.named_laws import Laws


class Reader(NamedTuple):
    """What the readers of a scene's parts have in common; :meth:`at` returns the reader of one part."""

    source: str
    """Name of the scene in errors."""
    laws: Laws
    """Finds the user-defined laws that the scene names."""
    files: dict[str, str]
    """SHA-256 of the files that were found, by path; the readers of all parts share this dict."""
    key: str = ""
    """Path of keys to the part; empty for the whole scene."""

    @property
    def folder(self) -> Path:
        """Folder of the scene."""
        return self.laws.folders[0]

    def at(self, *keys: object) -> "Reader":
        """Return the reader of the part at a path of keys below this part."""
        return self._replace(key=".".join(filter(None, [self.key, *map(str, keys)])))

    def error(self, key: str, expected: str) -> InputError:
        """Return the error of a key below this part; without a key, of this part."""
        return InputError(self.source, self.at(key).key, expected)

    @contextmanager
    def errors_of(self, key: str) -> Iterator[None]:
        """Give InputErrors of a block the name of the scene and a key below this part."""
        try:
            yield
        except InputError as error:
            raise self.error(key, error.expected) from None

    def file(self, name: str, key: str = "") -> Path:
        """Return the path of a file that a key below this part names, and record the digest of the file.

        The digest is computed before the file is read, so that a change of the file during reading is detected.
        """
        found = find_file(name, self.folder, self.source, self.at(key).key)
        self.record(found)
        return found

    def record(self, path: Path) -> None:
        """Record the digest of a file that is read for the scene."""
        if str(path) not in self.files:
            self.files[str(path)] = digest_of_file(path)


def find_file(name: str, folder: Path, source: str, field: str) -> Path:
    """Return the path of a file that a YAML file in ``folder`` names; InputError if there is no such file.

    The name is relative to the folder, to the folder above it, or to the working directory, in this order.
    """
    found = existing_file(name, folder)
    if found is None:
        raise InputError(source, field, f"expected an existing file, got {name!r}")
    return found


def existing_file(name: str, folder: Path) -> Path | None:
    """Return the path of a file as :func:`find_file` finds it, or None."""
    for base in (folder, folder.parent, Path()):
        if os.path.isfile(base / name):  # Path.is_file raises where a name is too long or a folder is closed
            return base / name
    return None
