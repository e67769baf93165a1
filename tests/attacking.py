"""What attacks share: a list of them, cases in processes of their own, ways to damage a file."""

import contextlib
import os
import pickle
import resource
import select
import signal
import traceback
from collections import Counter
from pathlib import Path

import h5py
import numpy as np

from wrcore.errors import InputError
from wrcore.errors.checked_hdf5 import sign

ATTACKS = {}
LONGEST = 20.0
"""Seconds that a case may take."""

MEMORY = 3 * 2**30
"""Bytes that a case may ask for on top of what this process has."""

tally = Counter()


def attack(count):
    """List an attack with the number of its cases in full size."""
    return lambda function: ATTACKS.setdefault(function.__name__, (function, count))[0]


def tried(name, case, *args):
    """Findings (one or none) of a case: a function that returns what is wrong, or an empty string."""
    kind, text = isolated(case, *args)
    tally[kind] += 1
    return [] if kind in ("refused", "fine") else [f"{name}: {kind}: {text}"]


def isolated(case, *args):
    """How a function fares in a process of its own: refused, fine, wrong, traceback, crash or hang; and more of it."""
    reading, writing = os.pipe()
    process = os.fork()
    if process == 0:
        os.close(reading)
        os.write(writing, pickle.dumps(_answer(case, args)))
        os._exit(0)
    os.close(writing)
    answer = b""
    while select.select([reading], [], [], LONGEST)[0] and (piece := os.read(reading, 65536)):
        answer += piece
    os.close(reading)
    if not answer:
        os.kill(process, signal.SIGKILL)
    status = os.waitpid(process, 0)[1]
    if answer:
        return pickle.loads(answer)
    if status == signal.SIGKILL:
        return "hang", f"more than {LONGEST:g} s"
    return "crash", signal.Signals(os.WTERMSIG(status)).name if os.WIFSIGNALED(status) else str(status)


def _answer(case, args):
    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, resource.RLIM_INFINITY))
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    os.dup2(nothing, 2)
    try:
        wrong = case(*args)
        return ("wrong", wrong) if wrong else ("fine", "")
    except InputError as error:
        return ("refused", "") if "\n" not in str(error) else ("traceback", str(error))
    except BaseException:
        return "traceback", traceback.format_exc()[-600:]


def mutated(data, rng):
    """Bytes with some of them flipped, overwritten, cut off, doubled or swapped."""
    data, kind = bytearray(data), rng.choice(["flip", "flip", "flip", "write", "cut", "double", "swap"])
    at, other, length = rng.randrange(len(data)), rng.randrange(len(data)), rng.randint(1, 600)
    if kind == "flip":
        for _ in range(rng.randint(1, 3)):
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    elif kind == "write":
        data[at : at + length] = rng.choice([bytes(length), rng.randbytes(length)])[: len(data) - at]
    elif kind == "cut":
        del data[at:]
    elif kind == "double":
        data[at:at] = data[other : other + length]
    else:
        data[at : at + length], data[other : other + length] = data[other : other + length], data[at : at + length]
    return bytes(data)


VALUES = [0, -1, 7, 2**62, np.nan, np.inf, 1e300, 0.5, "x", "", b"\xff", [], [[1.0], [2.0]], np.zeros(3, "S4"), 1j]


def edited(path, rng):
    """Make a file of what HDF5 can hold and nobody expects, with a digest as if it had been written so."""
    fifo = path.with_name("fifo")
    if not fifo.exists():
        os.mkfifo(fifo)
    with h5py.File(path, "a") as file, np.errstate(over="ignore"):
        names = []
        file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        groups = ["/"]
        file.visititems(lambda name, item: groups.append(name) if isinstance(item, h5py.Group) else None)
        for _ in range(rng.randint(1, 2)):
            name, kind = rng.choice(names), rng.choice(["value"] * 4 + ["number"] * 4 + ["attribute"] * 4 + EDITS)
            with contextlib.suppress(KeyError, TypeError, ValueError, OSError, AttributeError, OverflowError):
                _edit(file, name, rng.choice([*names, *groups]), kind, fifo, rng)
    sign(path)


EDITS = ["gone", "external", "soft", "cycle", "virtual", "stored elsewhere", "fill", "moved"]


def _edit(file, name, owner, kind, fifo, rng):
    dataset = file[name]
    if kind == "number":
        dataset[tuple(rng.randrange(n) for n in dataset.shape)] = rng.choice(VALUES[:8])
    elif kind == "attribute":
        attributes = file[owner].attrs
        attributes[rng.choice(list(attributes) or ["x"])] = rng.choice(VALUES)
    else:
        shape = dataset.shape
        del file[name]
        if kind == "value":
            file[name] = rng.choice([*VALUES, np.zeros(tuple(n + 1 for n in shape)), np.zeros(shape, ">i2")])
        elif kind == "external":
            file[name] = h5py.ExternalLink(fifo.name, "/x")
        elif kind == "soft":
            file[name] = h5py.SoftLink("/nowhere")
        elif kind == "cycle":
            file[name] = file["/"]
        elif kind == "virtual":
            layout = h5py.VirtualLayout(shape or (1,), float, (None,) * (len(shape) or 1))
            layout[...] = h5py.VirtualSource(fifo.name, "x", shape or (1,))
            file.create_virtual_dataset(name, layout)
        elif kind == "stored elsewhere":
            file.create_dataset(name, (10**6,), float, external=[(str(fifo), 0, h5py.h5f.UNLIMITED)])
        elif kind == "fill":
            file.create_dataset(name, (2**29, *shape[1:]), float, chunks=(2**20, *shape[1:]), fillvalue=1.0)
        elif kind == "moved":
            file[name + "x"] = 1.0


def same_numbers(one, other):
    """Whether nested tuples, dicts and arrays hold the same bits."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same_numbers(one[key], other[key]) for key in one)
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(same_numbers, one, other))
    if type(one) is not type(other):
        return False
    one, other = np.asarray(one), np.asarray(other)
    return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
