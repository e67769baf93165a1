"""Messages on standard error: warnings, progress of work, and a line where work takes long.

Three functions print them. `warn` prints a line once in a process. `tell` prints a line about the progress of work, and
nothing with ``WRCORE_PROGRESS=0``. `say` prints a line always.
"""

import os
import sys
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from threading import Timer

PATIENCE = 3.0
"""Duration of a computation after which wrcore prints a message, s."""

_SUPPRESSED = ContextVar("suppressed", default=False)

_REACHED = ContextVar("reached", default=str)


def say(text):
    """Print a line on standard error if the process has one."""
    if sys.stderr is not None:  # in a process without a console
        print(f"wrcore: {text}", file=sys.stderr, flush=True)


@cache
def _say_once(text):
    say(text)


def warn(text):
    """Print a warning on standard error, unless the process has printed it already or warnings are suppressed."""
    if not _SUPPRESSED.get():
        _say_once(text)


@contextmanager
def warnings_suppressed():
    """Suppress warnings in this thread during a block, for input files that a computation itself has written."""
    before = _SUPPRESSED.set(True)
    try:
        yield
    finally:
        _SUPPRESSED.reset(before)


def _is_silent():
    return os.environ.get("WRCORE_PROGRESS") == "0"


def tell(text):
    """Print a line about the progress of work, once in a process; nothing with ``WRCORE_PROGRESS=0``."""
    if not _is_silent():
        warn(text)


@contextmanager
def say_if_long(text, spent=0.0):
    """Print a line if a block takes longer than `PATIENCE`, including the time ``spent`` before (s).

    Nothing is printed with ``WRCORE_PROGRESS=0``."""
    if _is_silent():
        yield
        return
    timer = Timer(max(PATIENCE - spent, 0.0), warn, [text])
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


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
