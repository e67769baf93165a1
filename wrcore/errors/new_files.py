"""Files that appear under their name when they are complete, whatever happens on the way."""

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


HDF5 = (".h5", ".hdf5")  # endings of our binary files


def named(path: str | os.PathLike[str], endings: Iterable[str], source: str) -> None:
    """InputError of a source for a path that does not end as it should."""
    if Path(path).suffix.lower() not in endings:
        raise InputError(source, path, f"expected a name that ends in {' or '.join(endings)}")


@contextmanager
def appearing(path: str | os.PathLike[str]) -> Iterator[BufferedRandom]:
    """A new file, to be written and read, that replaces one of its name when it is complete; OSError names the path
    where the disk or a quota is full.

    Until then it has a hidden name of its own and is locked. Hidden files of that kind whose writer is gone are removed
    by whoever writes the name next.
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
    """OSError where nothing can be written under a name, or under the longest that is derived from it."""
    path = Path(path)
    part = path.with_name(f".{path.name}.parts.{secrets.token_hex(4)}.part")
    part.open("xb").close()
    part.unlink()


def locked(descriptor: int) -> bool:
    """Lock an open file or folder for this process, which ends the lock however it ends; False if it has one."""
    try:
        if fcntl is not None:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


@contextmanager
def held(folder: Path, told: object) -> Iterator[None]:
    """A folder, made if needed, that this process alone writes to meanwhile; else an InputError of ``told``."""
    lock = hold(folder, told)
    try:
        yield
    finally:
        os.close(lock)


def hold(folder: Path, told: object) -> int:
    """Descriptor of a folder, made if needed, that this process alone holds until it is closed, however it ends."""
    while True:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
        except (FileExistsError, NotADirectoryError):  # a file or a link
            raise InputError("--out", told, f"expected a folder or nothing as {folder.name}") from None
        if not locked(lock):
            os.close(lock)
            raise InputError("--out", told, "expected a file that no other process is writing")
        with suppress(FileNotFoundError):  # whoever held it before may just have removed it
            if os.path.samestat(os.fstat(lock), os.stat(folder)):
                return lock
        os.close(lock)


def remove_folder(folder: Path) -> None:
    """Remove a folder at once: it loses its name first and its content then."""
    gone = folder.with_name(f"{folder.name}.{secrets.token_hex(4)}.part")
    os.replace(folder, gone)
    shutil.rmtree(gone, ignore_errors=True)


def remove_remains(path: Path) -> None:
    """Remove what killed processes left of `appearing` and `remove_folder`: hidden, ours, and held by nobody."""
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
