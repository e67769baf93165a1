"""Cache folder for compiled kernels and creep tables, which only the user may write to.

Compiled kernels are pickles: a person who can write to the folder can run code in the name of each user who loads them.
If the folder is not safe or cannot be written, the process uses a temporary folder instead.
"""

import atexit
import hashlib
import os
import re
import shutil
import stat
import tempfile
import time
from contextlib import suppress
from functools import cache
from pathlib import Path

from wrcore.errors.messages import warn

KERNEL_ROOMS = (
    "kernels", "geometry", "bodies", "contact", "creep", "wheels", "track", "forces", "equations", "jacobian",
    "integrate",
)  # fmt: skip
_KEEP_SECONDS = 14 * 86400
_ROOT = Path(__file__).parents[1]


def source_digest():
    """Return the digest (16 hex digits) of all sources of kernels, as this process first read them."""
    return _first_read()[0]


def sources_changed():
    """Whether a source was edited after the digest was computed, so that later imports may not match the digest."""
    return _stamps() != _first_read()[1]


@cache
def _first_read():
    """Return the digest of the sources, and their stamps before they were read."""
    stamps, digest = _stamps(), hashlib.sha256()
    for name, _, _ in stamps:
        digest.update(name.encode())
        digest.update((_ROOT / name).read_bytes())
    return digest.hexdigest()[:16], stamps


def _stamps():
    """Return name, modification time and size of each source."""
    paths = sorted(path for room in KERNEL_ROOMS for path in (_ROOT / room).rglob("*.py"))
    states = ((path, path.stat()) for path in paths)
    return [(path.relative_to(_ROOT).as_posix(), state.st_mtime_ns, state.st_size) for path, state in states]


def kernel_folder():
    """Return the folder of the kernels that were compiled from the present sources."""
    return cache_root() / "kernels" / source_digest()


def table_folder():
    """Return the folder of the creep tables."""
    return cache_root() / "tables"


def cache_root():
    """Return the cache folder: ``WRCORE_CACHE`` if set and not empty, else ``wrcore`` in the user's cache folder.

    The latter is ``XDG_CACHE_HOME`` or ``~/.cache``. If the folder is not safe, wrcore warns and uses a temporary
    folder."""
    return _prepared(os.environ.get("WRCORE_CACHE") or _default())


def _default():
    try:
        return os.path.join(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache", "wrcore")
    except RuntimeError:  # no home folder
        return ""


@cache
def _prepared(wanted):
    """Create the wanted folder with its subfolders, or a temporary one if this fails, and return its path."""
    try:
        if not wanted:
            raise OSError(0, "expected a home folder or WRCORE_CACHE")
        return _with_parts(Path(os.path.realpath(wanted)))
    except OSError as error:
        where = error.filename or wanted
        warn(f"cache {where + ': ' if where else ''}{error.strerror}; a temporary one is used: kernels compile anew")
    root = Path(tempfile.mkdtemp(prefix="wrcore-"))
    atexit.register(_remove_temporary, root, os.getpid())
    return _with_parts(root)


def _with_parts(root):
    kernels = root / "kernels"
    for folder in (root, root / "tables", kernels, kernels / source_digest()):
        _claim(folder)
    os.utime(folder)
    for below, names, _ in os.walk(folder):  # subfolders made by numba hold the pickles
        for name in names:
            _claim(Path(below, name))
    _drop_old(kernels)
    return root


def _claim(folder):
    """Create a folder, or check an existing one; raise an OSError if the check fails.

    The folder must not be a link, must belong to the user, and only the user may write to it."""
    with suppress(FileExistsError):
        folder.mkdir(mode=0o700, parents=True)
    status = folder.lstat()
    fault = ""
    if not stat.S_ISDIR(status.st_mode):
        fault = "expected a folder, no file or link"
    elif hasattr(os, "geteuid") and status.st_uid != os.geteuid():
        fault = "expected a folder of one's own"
    elif os.name == "posix" and status.st_mode & 0o022:
        fault = "expected a folder that others may not write to (chmod -R go-w)"
    elif not os.access(folder, os.W_OK | os.X_OK):
        fault = "expected a folder that can be written"
    if fault:
        raise OSError(0, fault, str(folder))


def _drop_old(kernels):
    """Delete kernels that were not used for two weeks: only files of numba in folders named by a source digest."""
    for old in os.scandir(kernels):
        with suppress(OSError):  # another process deletes at the same time
            own = re.fullmatch("[0-9a-f]{16}", old.name) and old.is_dir(follow_symlinks=False)
            if not own or time.time() - old.stat(follow_symlinks=False).st_mtime < _KEEP_SECONDS:
                continue
            for folder, _, files in os.walk(old.path, topdown=False):
                for name in files:
                    if re.search(r"\.(nbi|nbc)(\.tmp\.\w+)?$", name):
                        os.unlink(os.path.join(folder, name))
                os.rmdir(folder)


def drop_unused(folder, pattern):
    """Delete the files of a folder that match ``pattern`` and were not used for two weeks."""
    for old in folder.glob(pattern):
        with suppress(OSError):
            if time.time() - old.stat().st_mtime > _KEEP_SECONDS:
                old.unlink()


def _remove_temporary(root, process):
    if os.getpid() == process:  # not in a fork
        shutil.rmtree(root, ignore_errors=True)
