"""Kernels of a first run, compiled by a second process while this one compiles others.

A run knows the types of all its kernels before it compiles one (`planned`). Those that it needs last go to a second
process, which leaves them in the cache; who needs one of them waits for it. Where that fails, or only one processor is
there, all are compiled here, as if nothing had been.

What kernels link is a matter of each process: numba numbers what it compiles, and with pieces of both, as it happened
that one was there before the other, a kernel had some twice, was inlined otherwise, and rounded otherwise.
"""

import atexit
import os
import pickle
import subprocess
import sys
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from importlib import import_module
from pathlib import Path

from wrcore.kernels.cache import cache_root

_BEGIN = """
import pickle, sys
sys.path[:], kernels = pickle.load(sys.stdin.buffer)
from wrcore.kernels import aside
aside.linked = "aside"
aside.compile_all(pickle.loads(kernels))
"""

linked = ""
"""Folder below that of the kernels where this process keeps what kernels link."""

_PLAN, _NEEDED_LAST = ContextVar("plan", default=None), ContextVar("needed_last", default=None)


def planned():
    """The list to which kernels are added in place of being compiled, each with the types of its arguments, or None."""
    return _PLAN.get()


@contextmanager
def planning():
    """Let kernels be added to a list in place of being compiled: what is made meanwhile is good for its types alone."""
    token = _PLAN.set([])
    try:
        yield _PLAN.get()
    finally:
        _PLAN.reset(token)


@contextmanager
def compiled_aside(needed_last):
    """Let a second process begin as soon as a kernel is not in the cache: with those that ``needed_last()`` gives, each
    with the types of its arguments."""
    token = _NEEDED_LAST.set(needed_last)
    try:
        yield
    finally:
        _NEEDED_LAST.reset(token)


class _Process:
    """A second process and the names of the kernels that it still has to compile."""

    def __init__(self, kernels):
        self.left = [name for name, _ in kernels]
        self._process = subprocess.Popen(
            [sys.executable, "-I", "-c", _BEGIN], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, env=os.environ | {"WRCORE_CACHE": str(cache_root())},
        )  # fmt: skip
        atexit.register(self._process.kill)
        with suppress(BrokenPipeError), self._process.stdin as its:
            its.write(pickle.dumps((sys.path, pickle.dumps(kernels))))

    def wait_for(self, name):
        """Wait until a kernel is in the cache, or never will be."""
        while name in self.left:
            if self._process.stdout.readline():
                del self.left[0]
            else:
                self.left.clear()

    def over(self):
        """Whether nothing more comes of it."""
        over = not self.left or self._process.poll() is not None
        if over:
            self._process.stdout.close()
            self._process.wait()
            atexit.unregister(self._process.kill)
        return over


_running = None


def missed(function, form):
    """Whether a kernel that is not in the cache may be there now; called by one thread after the other."""
    global _running
    name, needed_last = _name(function, form), _NEEDED_LAST.get()
    waited = _running is not None and name in _running.left
    if waited:
        _running.wait_for(name)
    if _running is not None and _running.over():
        _running = None
    if _running is None and needed_last is not None:
        _NEEDED_LAST.set(None)
        with suppress(Exception):  # who needs them compiles them, and says what is wrong
            _running = _begun(needed_last)
    return waited


def _begun(needed_last):
    """A `_Process`; None where it would not be worth it."""
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    if processors == 1 or not Path(sys.executable or "").name.startswith("python"):  # a host that embeds Python
        return None
    return _Process([(_name(kernel.py_func, kernel.form), types) for kernel, types in needed_last()])


def _name(function, form):
    return function.__module__, function.__qualname__, form


def compile_all(kernels):
    """What the second process does."""
    for name, types in kernels:
        module, function, form = name
        getattr(import_module(module), function).in_form(form).compile(types)
        print(name, flush=True)
