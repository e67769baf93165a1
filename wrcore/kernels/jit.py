"""The one compile decorator, and a cache folder that never serves stale kernels.

Numba notices edits of the file that holds a kernel, but not of a kernel imported from another file. The cache
folder is therefore named after the content of all sources in the rooms that hold kernels: an edit there starts a
fresh cache.
"""

import hashlib
import os
import time
from pathlib import Path

import numba
from numba.core import types
from numba.extending import intrinsic

FAST = {"contract", "nsz", "arcp", "reassoc"}
"""Fast-math flags for scan loops: sums may be reordered; NaN and infinity stay what they are."""

FUSED = {"contract"}
"""Fast-math flag for any kernel: a product and a sum may become one instruction, rounded once.

Which ones do depends on the code around. A kernel that is called, not inlined, exists once in each kernel that calls
it, and which copy runs depends on whether the process compiled it or found it in the cache; the search for overlaps,
where this showed, goes without the flag so that all copies give the same bits."""

KERNEL_ROOMS = ("kernels", "geometry", "contact", "creep", "dynamics", "integrate")
_KEEP_SECONDS = 14 * 86400


def cache_root():
    """Folder for everything that can be rebuilt: compiled kernels and creep tables.

    ``WRCORE_CACHE`` if set, else ``wrcore`` in the user's cache folder (``XDG_CACHE_HOME`` or ``~/.cache``).

    Returns
    -------
    pathlib.Path
    """
    if "WRCORE_CACHE" in os.environ:
        return Path(os.environ["WRCORE_CACHE"])
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "wrcore"


def source_digest():
    """Digest (16 hex digits) of the sources that kernels are made of."""
    root = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for path in sorted(p for room in KERNEL_ROOMS for p in (root / room).rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _prepare_cache_folder():
    """Create the kernel cache of this source state and drop those unused for two weeks."""
    kernels = cache_root() / "kernels"
    folder = kernels / source_digest()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        for old in kernels.iterdir():
            if time.time() - old.stat().st_mtime > _KEEP_SECONDS:
                for file in sorted(old.rglob("*"), reverse=True):
                    file.rmdir() if file.is_dir() else file.unlink()
                old.rmdir()
    except OSError:  # read-only home, or another process clears at the same time: compile without our folder
        return None
    return str(folder)


_FOLDER = _prepare_cache_folder()


def jit(function=None, *, allocates=True, **options):
    """Compile a kernel: ``numba.njit``, cached, with C division (no ZeroDivisionError branch).

    What is not asked for is switched off: numba would hand fast math and inlining on from the first caller that has a
    kernel compiled, so that its code depended on who came first.

    Parameters
    ----------
    function : callable
    allocates : bool
        False for kernels that create no arrays (views of their arguments are fine): numba then counts no references,
        which costs more than the arithmetic where a kernel is handed a tuple of many arrays.
    **options
        Passed on to numba; ``fastmath=FAST`` is meant for scan loops only.
    """
    if function is None:
        return lambda f: jit(f, allocates=allocates, **options)
    settings = {
        "cache": _FOLDER is not None,
        "error_model": "numpy",
        "fastmath": False,
        "forceinline": False,
        **options,
    }
    if not allocates:
        settings["_nrt"] = False
    before = numba.config.CACHE_DIR
    try:
        numba.config.CACHE_DIR = _FOLDER or before
        return numba.njit(function, **settings)
    finally:
        numba.config.CACHE_DIR = before


@intrinsic
def rarely_called(_):
    """In a kernel's first line: keep it out of its callers, whose common path should not carry its registers along."""

    def generate(context, builder, __, ___):
        for attribute in ("noinline", "cold"):
            builder.function.attributes.add(attribute)
        return context.get_dummy_value()

    return types.void(), generate
