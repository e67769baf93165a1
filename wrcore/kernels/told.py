"""What is said of work that takes long, and of what goes wrong where nothing can be raised."""

import _thread
import os
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from threading import Timer

from wrcore.kernels.cache import warn

_AFTER = 0.2
"""Ctrl-C in a call from a kernel is said again so much later, s: after the call, however busy the machine is."""

PATIENCE = 3.0
"""Work takes this long before it says so, s."""


_REACHED = ContextVar("reached", default=str)

_again: list[Timer] = []
"""Of Ctrl-C that is to be said again."""


def interrupted():
    """Whether Ctrl-C in a call from a kernel is still to be said again: nothing is begun any more."""
    return any(timer.is_alive() for timer in _again)


def raise_interrupted():
    """Say it again, now that the kernel has returned."""
    waits = interrupted()
    while _again:
        _again.pop().cancel()
    if waits:
        raise KeyboardInterrupt


@contextmanager
def handed_on(outcome):
    """Around what a kernel calls, which can raise nothing: say later what went wrong, Ctrl-C once more, after the call,
    all else in a line, with its ``outcome``."""
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
    """Let what is said of long work in this thread end with the text that ``reached()`` returns: how far the run is."""
    before = _REACHED.set(reached)
    try:
        yield
    finally:
        _REACHED.reset(before)


def reached_so_far():
    """The function of this thread's `reaching`; without one it returns an empty text."""
    return _REACHED.get()


def tell(text):
    """Say a line of how far work has come; none with ``WRCORE_PROGRESS=0``."""
    if not _silent():
        warn(text)


@contextmanager
def say_if_long(text, spent=0.0):
    """Say a line once what is done takes long, with the time ``spent`` before (s); none with ``WRCORE_PROGRESS=0``."""
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
    """Say a line, once in a process."""
    warn(text)
