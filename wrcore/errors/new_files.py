"""Output files that appear under their name only when they are complete, and locks of files and folders."""

import os
import re
import secrets
import shutil
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from io import BufferedRandom
from pathlib import Path

from wrcore.errors import InputError

try:
    import fcntl
except ImportError:  # a system without such locks
    fcntl = None  # type: ignore[assignment]


HDF5 = (".h5", ".hdf5")  # endings of the binary files of wrcore


def named(path: str | os.PathLike[str], endings: Iterable[str], source: str) -> None:
    """Raise an InputError of ``source`` for a path that has none of these endings."""
    if Path(path).suffix.lower() not in endings:
        raise InputError(source, path, f"expected a name that ends in {' or '.join(endings)}")


@contextmanager
def appearing(path: str | os.PathLike[str]) -> Iterator[BufferedRandom]:
    """Open a new file for writing and reading; when it is complete, it replaces the file of this name.

    Until then the file has a hidden name and is locked. Hidden files of processes that were killed are removed when
    this name is written again. An OSError names the path if the disk or a quota is full.
    """
    path = Path(path)
    if not path.name:
        raise InputError(path, "", "expected the name of a file")
    path.parent.mkdir(parents=True, exist_ok=True)
    remove_remains(path)
    part = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        with open(part, "x+b") as file:
            locked(file.fileno())
            yield file
            file.flush()
            os.fsync(file.fileno())
            if fcntl is None:  # such a system renames no open file
                file.close()
            os.replace(part, path)
    except OSError as error:
        if error.filename not in (None, str(part)):
            raise
        raise OSError(error.errno, error.strerror or str(error), str(path)) from None
    finally:
        part.unlink(missing_ok=True)


def try_out(path: str | os.PathLike[str]) -> None:
    """Raise an OSError if no file can be written under a name, or under the longest name derived from it."""
    path = Path(path)
    part = path.with_name(f".{path.name}.parts.{secrets.token_hex(4)}.part")
    part.open("xb").close()
    part.unlink()


def output(path: str | os.PathLike[str], endings: Iterable[str] = (".csv",), option: str = "--out") -> Path:
    """Refuse an output path that cannot be written, or has another ending, before the computation starts."""
    named(path, endings, option)
    if not os.path.isdir(os.path.dirname(os.path.abspath(path))) or (os.path.exists(path) and not os.path.isfile(path)):
        raise InputError(option, path, "expected a file in an existing folder")
    try:  # permissions do not tell whether a disk is full or a name is too long
        try_out(path)
    except OSError as error:
        raise InputError(option, path, f"expected a file that can be written: {error.strerror}") from None
    return Path(path)


def locked(descriptor: int) -> bool:
    """Lock an open file or folder until this process ends; return False if another process has locked it."""
    try:
        if fcntl is not None:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


@contextmanager
def held(folder: Path, told: object) -> Iterator[None]:
    """Lock a folder, created if needed, for this process during a block; an InputError names ``told``."""
    lock = hold(folder, told)
    try:
        yield
    finally:
        os.close(lock)


def hold(folder: Path, told: object) -> int:
    """Return the descriptor of a folder, created if needed, that is locked until the descriptor is closed."""
    while True:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
        except (FileExistsError, NotADirectoryError):  # a file or a link
            raise InputError("--out", told, f"expected a folder or nothing as {folder.name}") from None
        if not locked(lock):
            os.close(lock)
            raise InputError("--out", told, "expected a file that no other process is writing")
        with suppress(FileNotFoundError):  # the former holder may just have removed it
            if os.path.samestat(os.fstat(lock), os.stat(folder)):
                return lock
        os.close(lock)


def remove_folder(folder: Path) -> None:
    """Remove a folder: first it is renamed, so that its name is free at once, then its content is deleted."""
    gone = folder.with_name(f"{folder.name}.{secrets.token_hex(4)}.part")
    os.replace(folder, gone)
    shutil.rmtree(gone, ignore_errors=True)


def remove_remains(path: Path) -> None:
    """Remove hidden files and folders that killed processes left, if the user owns them and they are not locked."""
    if fcntl is None:
        return
    left = re.compile(rf"\.{re.escape(path.name)}\.((parts|[0-9a-f]{{16}})\.)?[0-9a-f]{{1,8}}\.part")
    with suppress(OSError), os.scandir(path.parent) as entries:
        for entry in entries:
            if left.fullmatch(entry.name):
                with suppress(OSError):
                    _remove_if_left(entry.path)


def _remove_if_left(name):
    descriptor = os.open(name, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        status = os.fstat(descriptor)
        if status.st_uid != os.geteuid() or not locked(descriptor):
            return
        if stat.S_ISREG(status.st_mode):
            os.unlink(name)
        elif stat.S_ISDIR(status.st_mode):
            shutil.rmtree(name, ignore_errors=True)
    finally:
        os.close(descriptor)
