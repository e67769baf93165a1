"""Timing in turns: each pass runs all contenders, so that a slow moment of the machine affects all of them."""

import os
import platform
import time
from collections.abc import Callable
from typing import NamedTuple

import numba
import numpy as np

QUARTILES = (25.0, 50.0, 75.0)


class Contender(NamedTuple):
    """A call that is timed and compared with others."""

    label: str
    call: Callable
    units: float = 1.0
    """Number of the group's units (evaluations, runs, ...) in one call."""


class Bar(NamedTuple):
    """A required limit of a ratio or a difference of times."""

    contender: str
    quantity: str
    """``ratio`` to the first contender, or ``excess`` over it in the group's unit of time."""
    relation: str
    """``at least`` or ``at most``."""
    limit: float


def take_turns(contenders, passes, clock=time.process_time):
    """Return seconds per unit of each contender in each pass, shape (passes, contenders).

    A first pass, which compiles and loads caches, is omitted. The default clock is the processor time of this process.
    """
    seconds = np.empty((passes + 1, len(contenders)))
    for row in seconds:
        for k, contender in enumerate(contenders):
            started = clock()
            contender.call()
            row[k] = (clock() - started) / contender.units
    return seconds[1:]


def compare(group, of, contenders, passes, unit="us", bar=None, clock=time.process_time):
    """Time the contenders of a group and compare them with the first contender; return rows of the benchmark table.

    Columns: group, contender, of (name of the timed unit), unit of time (ns, us, ms or s); median and quartiles of the
    time; median and quartiles of the ratio to the first contender in each pass; excess, the median difference from the
    first contender; passes; the required limit in words (bar) and whether it is met.
    """
    return summary(group, of, [c.label for c in contenders], take_turns(contenders, passes, clock), unit, bar)


def summary(group, of, labels, seconds, unit="us", bar=None):
    """Return rows of :func:`compare` from seconds (passes, contenders)."""
    times = seconds * {"ns": 1e9, "us": 1e6, "ms": 1e3, "s": 1.0}[unit]
    rows = []
    for k, label in enumerate(labels):
        row = {"group": group, "contender": label, "of": of, "unit": unit}
        row |= _quartiles("time", times[:, k]) | _quartiles("ratio", times[:, k] / times[:, 0])
        row |= {"excess": float(np.median(times[:, k] - times[:, 0])), "passes": len(times), "bar": "", "met": ""}
        if bar is not None and bar.contender == label:
            value = row["ratio" if bar.quantity == "ratio" else "excess"]
            row["bar"] = f"{bar.quantity} {bar.relation} {bar.limit:g}" + f" {unit}" * (bar.quantity == "excess")
            row["met"] = "yes" if (value >= bar.limit if bar.relation == "at least" else value <= bar.limit) else "no"
        rows.append(row)
    return rows


def _quartiles(name, values):
    low, middle, high = np.percentile(values, QUARTILES)
    return {name: float(middle), f"{name}_low": float(low), f"{name}_high": float(high)}


def machine():
    """Return facts on the machine: processor, cores, load, and versions of python, numpy and numba.

    Load is the mean number of waiting or running processes over the last minute.
    """
    processor = platform.processor() or platform.machine()
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
        processor = names[0] if names else processor
    except OSError:  # another system than Linux
        pass
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    versions = {"python": platform.python_version(), "numpy": np.__version__, "numba": numba.__version__}
    return {"processor": processor, "cores": os.cpu_count(), "load": round(load, 2)} | versions
