"""Messages about long computations, and about errors in functions that are called by kernels and cannot raise."""

import _thread
import os
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from threading import Timer

from wrcore.kernels.cache import warn

_AFTER = 0.2
"""Delay after which a Ctrl-C during a call from a kernel is raised again, s: after the call even on a busy machine."""

PATIENCE = 3.0
"""Duration of a computation after which wrcore prints a message, s."""


_REACHED = ContextVar("reached", default=str)

_again: list[Timer] = []
"""Timers of Ctrl-C that will be raised again."""


def interrupted():
    """Whether a Ctrl-C during a call from a kernel has not yet been raised again; no new work may start then."""
    return any(timer.is_alive() for timer in _again)


def raise_interrupted():
    """Raise KeyboardInterrupt if a Ctrl-C is waiting; to be called after the kernel has returned."""
    waits = interrupted()
    while _again:
        _again.pop().cancel()
    if waits:
        raise KeyboardInterrupt


@contextmanager
def handed_on(outcome):
    """Catch errors in a function that a kernel calls and that cannot raise.

    A Ctrl-C is raised again after the call. Any other error is printed in one line, with its consequence
    ``outcome``."""
    try:
        yield
    except KeyboardInterrupt:
        _again.append(Timer(_AFTER, _thread.interrupt_main))
        _again[-1].start()
    except BaseException as error:
        first = str(error).strip().partition("\n")[0]
        warn_once(f"exact contact: {type(error).__name__}: {first}; {outcome}")


def _silent():
    return os.environ.get("WRCORE_PROGRESS") == "0"


@contextmanager
def reaching(reached):
    """Append the text of ``reached()``, the progress of the run, to messages of this thread during a block."""
    before = _REACHED.set(reached)
    try:
        yield
    finally:
        _REACHED.reset(before)


def reached_so_far():
    """Return the function that `reaching` has set in this thread; by default one that returns an empty text."""
    return _REACHED.get()


def tell(text):
    """Print a line about the progress of work; nothing with ``WRCORE_PROGRESS=0``."""
    if not _silent():
        warn(text)


@contextmanager
def say_if_long(text, spent=0.0):
    """Print a line if a block takes longer than `PATIENCE`, including the time ``spent`` before (s).

    Nothing is printed with ``WRCORE_PROGRESS=0``."""
    if _silent():
        yield
        return
    timer = Timer(max(PATIENCE - spent, 0.0), warn_once, [text])
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


@cache
def warn_once(text):
    """Print a warning at most once in a process."""
    warn(text)
