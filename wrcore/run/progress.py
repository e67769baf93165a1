"""Progress bars for long computations, in a terminal or a notebook."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager

DELAY = 1.0  # a computation that takes less than this shows no bar, s


def somebody_watches() -> bool:
    """Whether output goes to a terminal or a notebook, and ``WRCORE_PROGRESS=0`` is not set."""
    if os.environ.get("WRCORE_PROGRESS") == "0":
        return False
    return (sys.stderr is not None and sys.stderr.isatty()) or _in_notebook()


def _in_notebook() -> bool:
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    return type(shell).__name__ == "ZMQInteractiveShell"


@contextmanager
def simulated_time(duration: float, begin: float = 0.0) -> Iterator[Callable[[float], None] | None]:
    """Show a bar over a duration (s) of simulated time from ``begin`` (s).

    Yield a function that is to be called with the time reached (s), or None if output does not go to a terminal or a
    notebook.

    >>> with simulated_time(10.0) as advance:
    ...     if advance:
    ...         advance(5.0)
    """
    if not somebody_watches():
        yield None
        return
    form = "{l_bar}{bar}| {n:.2f}/{total:g} s, {remaining} left"
    with _tqdm()(total=duration, unit="s", delay=DELAY, bar_format=form, leave=False) as bar:
        yield lambda t: bar.update(t - begin - bar.n) and None


def counted(items, total: int | None = None, unit: str = "run"):
    """Wrap an iterable in a progress bar if output goes to a terminal or a notebook."""
    if not somebody_watches():
        return items
    return _tqdm()(items, total=total, unit=unit, delay=DELAY)


def _tqdm():
    """Return the class of the bar: a widget in a notebook with widgets, else a line of text."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # tqdm warns in a notebook without widgets, where it shows a line of text
        from tqdm.auto import tqdm
    return tqdm
