"""Errors and Ctrl-C in functions that are called by kernels and cannot raise."""

import _thread
from contextlib import contextmanager
from threading import Timer

from wrcore.errors.messages import warn

_AFTER = 0.2
"""Delay after which a Ctrl-C during a call from a kernel is raised again, s: after the call even on a busy machine."""

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
        warn(f"exact contact: {type(error).__name__}: {first}; {outcome}")
