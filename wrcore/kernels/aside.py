"""Compilation of some kernels of a first run by a second process, while the main process compiles the others.

The types of all kernels of a run are known before the first one is compiled (`planned`). The second process compiles
the kernels that are needed last and writes them into the cache. The main process waits if it needs one of them. If the
second process fails, or if the machine has only one processor, the main process compiles all kernels.

Each process compiles all parts that its kernels link. Numba numbers these parts. If parts from both processes were
linked, some parts would be duplicates in an order that varies, which changes inlining and rounding.
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
"""Subfolder of the kernel folder in which this process stores the linked form of kernels."""

_PLAN, _NEEDED_LAST = ContextVar("plan", default=None), ContextVar("needed_last", default=None)


def planned():
    """Return the list that collects kernels, with the types of their arguments, without compilation; else None."""
    return _PLAN.get()


@contextmanager
def planning():
    """Collect kernels in a list without compilation during a block.

    Objects that are created meanwhile have the right types, but cannot be called."""
    token = _PLAN.set([])
    try:
        yield _PLAN.get()
    finally:
        _PLAN.reset(token)


@contextmanager
def compiled_aside(needed_last):
    """Start a second process during a block as soon as a kernel is missing in the cache.

    The process compiles the kernels that ``needed_last()`` returns, each with the types of its arguments."""
    token = _NEEDED_LAST.set(needed_last)
    try:
        yield
    finally:
        _NEEDED_LAST.reset(token)


class _Process:
    """Second process, and the names of the kernels that it has not yet compiled."""

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
        """Wait until a kernel is in the cache or the process has ended."""
        while name in self.left:
            if self._process.stdout.readline():
                del self.left[0]
            else:
                self.left.clear()

    def over(self):
        """Whether the process has compiled all its kernels or has ended; if so, release it."""
        over = not self.left or self._process.poll() is not None
        if over:
            self._process.stdout.close()
            self._process.wait()
            atexit.unregister(self._process.kill)
        return over


_running = None


def missed(function, form):
    """Whether a kernel that was missing in the cache may be there now, after waiting for the second process.

    Start this process if it is not running. Only one thread at a time calls this function."""
    global _running
    name, needed_last = _name(function, form), _NEEDED_LAST.get()
    waited = _running is not None and name in _running.left
    if waited:
        _running.wait_for(name)
    if _running is not None and _running.over():
        _running = None
    if _running is None and needed_last is not None:
        _NEEDED_LAST.set(None)
        with suppress(Exception):  # the main process compiles them and reports the error
            _running = _begun(needed_last)
    return waited


def _begun(needed_last):
    """Start and return a `_Process`; None with one processor or in a host program that embeds Python."""
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    if processors == 1 or not Path(sys.executable or "").name.startswith("python"):  # a host that embeds Python
        return None
    return _Process([(_name(kernel.py_func, kernel.form), types) for kernel, types in needed_last()])


def _name(function, form):
    return function.__module__, function.__qualname__, form


def compile_all(kernels):
    """Compile kernels in the second process and print the name of each one when it is in the cache."""
    for name, types in kernels:
        module, function, form = name
        getattr(import_module(module), function).in_form(form).compile(types)
        print(name, flush=True)
