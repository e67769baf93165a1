"""Simulate scenes in memory and return their runs."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from functools import partial
from typing import Annotated, Any, Literal

import numpy as np

from wrcore.bodies.body import STATE_SIZE
from wrcore.contact.search import reduction
from wrcore.creep.table import show_progress
from wrcore.errors import InputError
from wrcore.errors.checked_calls import Threads, checked
from wrcore.integrate.trajectory import Checkpoint
from wrcore.run.checks.reach import check_reach, warn_of_unreached
from wrcore.run.checks.shape_along import warn_of_shapes
from wrcore.run.output.run import Run
from wrcore.run.progress import counted, simulated_time
from wrcore.run.simulation import Simulation
from wrcore.run.state import State
from wrcore.scene.description import Scene, Source, load_scene

STARTS = "a checkpoint, a state or 'initial' (where a run has no end to go on from, it may have an end_state)"


@checked
def simulate(
    scene: Source,
    overrides: Iterable[str] | Mapping[str, Any] = (),
    progress: Callable[[float], object] | Literal[False] | None = None,
    start: Annotated[Checkpoint | np.ndarray | Literal["initial"], STARTS] = "initial",
    **changes: Any,
) -> Run:
    """Simulate a scene and return its run.

    Parameters
    ----------
    scene : Scene, path or dict
        Result of :func:`wrcore.load_scene`, or a path or dict that this function accepts.
    overrides : sequence of str, or dict
        ``key.path=value``, or values by ``key.path``, as :func:`wrcore.load_scene` takes them.
    progress : callable or False, optional
        Called at intervals with the simulated time reached, s. By default a bar is shown if the run takes more than a
        second and output goes to a terminal or a notebook; False: no bar.
    start : Checkpoint, ndarray of shape (size,), or "initial"
        State in which the run begins, if it is not the scene's initial state; then ``initial`` of the scene is ignored.
        The ``end`` of an earlier run continues this run at its time, and the results are bitwise identical to those of
        a run without the stop. This requires the same method and a bitwise identical model; a model compiled on another
        processor is not identical. The ``end_state`` of an earlier run contains its time and the position of the moving
        frame; only the vehicle must be the same. A plain array is a state at time 0.
    **changes
        Further values by key, as :func:`wrcore.load_scene` takes them.

    Returns
    -------
    Run
        Its ``status`` and ``reason`` say how it ended. A run that ended early contains the results up to its end.

    Raises
    ------
    InputError
        One line that names the file, the field and the expected value.

    Examples
    --------
    >>> run = simulate("config/scenes/suspended_wheelset.yaml", speed=30, integration__duration=0.1)
    >>> run.status, run.keys()
    ('completed', ['wheelset', 'wheelset/left', 'wheelset/right'])
    >>> float(run["wheelset"].y_m[0])  # m
    0.002
    """
    scene, begin_at, begin = opened("simulate", scene, overrides, start, changes)
    settings, rate = scene.data["integration"], scene.data["output"]["rate"]
    check_memory(scene)
    if begin_at is None:
        check_reach(scene, settings["duration"])
    with simulated_time(settings["duration"], begin) if progress is None else nullcontext(progress or None) as advance:
        simulation = Simulation(scene, begin_at, show_progress if progress is None else None)
        run = simulation.advance(output_times(begin, settings["duration"], rate), advance)
    warn_of_unreached(scene, simulation.outputs.places)
    warn_of_shapes(scene.source, run.counters, rate)
    return run


def opened(source: str, scene: Source, overrides: Any, start: Any, changes: dict[str, Any]) -> tuple[Scene, Any, float]:
    """Return the checked scene, the start of a `Simulation` (None: initial state) and its time (s) from arguments of
    `simulate`; errors name ``source``.
    """
    begin_at = None if isinstance(start, str) and start == "initial" else start
    overrides = overrides if isinstance(overrides, Mapping) else list(overrides)
    if begin_at is not None and any(re.match(r"initial(__|[.=]|$)", str(key)) for key in (*overrides, *changes)):
        raise InputError(source, "initial", "expected either this or a start")
    if overrides or changes or not isinstance(scene, Scene):
        scene = load_scene(scene, overrides, **changes)
    return scene, begin_at, start.t if isinstance(start, Checkpoint | State) else 0.0


@checked
def simulate_many(
    scenes: Sequence[Source],
    progress: Callable[[Sequence[Source]], Iterable[Source]] | Literal[False] | None = None,
    threads: Threads = 1,
) -> list[Run]:
    """Simulate several scenes in one process, which imports, loads kernels and reads tables only once.

    Parameters
    ----------
    scenes : sequence of Scene, path or dict
    progress : callable or False, optional
        Wraps the sequence of scenes, e.g. ``tqdm.tqdm``. By default a bar as for :func:`simulate`; False: no bar.
    threads : int
        Number of simultaneous runs: compiled parts of a run do not block other threads. Results do not depend on it.

    Returns
    -------
    list of Run
        The results of :func:`simulate` for each scene, in their order.

    Examples
    --------
    >>> scenes = [load_scene("config/scenes/wheelset.yaml", speed=v, integration__duration=0.05) for v in (20, 30)]
    >>> [run.scene["speed"] for run in simulate_many(scenes, threads=2)]
    [20, 30]
    """
    scenes = list(scenes)
    quietly = partial(simulate, progress=False)
    bar = counted if progress is None else progress or iter
    with ThreadPoolExecutor(threads) as pool:
        runs = pool.map(quietly, scenes) if threads > 1 else map(quietly, scenes)
        return [run for _, run in zip(bar(scenes), runs, strict=True)]


LARGEST_RUN = 4e9  # limit of the size of the channels of a run in memory, bytes


def bytes_per_time(vehicle):
    """Return the memory that the channels of one output time take, bytes."""
    patches = len(vehicle.bodies.wheelsets) * 2 * reduction.MAX_PATCHES * reduction.PATCH_COLUMNS
    return 8 * (STATE_SIZE * len(vehicle.body_names) + patches)


def check_memory(scene):
    """Refuse a run whose channels would exceed `LARGEST_RUN` in memory."""
    count = scene.data["integration"]["duration"] * scene.data["output"]["rate"]
    most = LARGEST_RUN / bytes_per_time(scene.vehicle)
    if count > most:
        expected = f"expected at most {most:.2g} output times in memory, got {count:.2g}"
        raise InputError(scene.source, "output.rate", f"{expected}; 'wrcore simulate' writes runs of any length")


def output_times(begin: float, duration: float, rate: float) -> np.ndarray:
    """Return output times (n,), s: multiples of 1/``rate`` (rate in 1/s) from ``begin`` (s) on, and both ends of the
    duration (s)."""
    return np.concatenate(list(output_blocks(begin, duration, rate, 2**62)))


def output_blocks(begin: float, duration: float, rate: float, size: int) -> Iterator[np.ndarray]:
    """Yield :func:`output_times` in blocks of at most ``size`` times (plus both ends), none of them empty."""
    end, slack = begin + duration, 1e-9 * min(1.0, duration * rate)
    first, last = math.ceil(begin * rate - slack), math.floor(end * rate + slack)

    def snapped(k, t):
        return k / rate if abs(k / rate - t) <= slack / rate else t

    low, high = first + (first / rate <= begin + slack / rate), last - (last / rate >= end - slack / rate)
    for at in range(low, max(high, low) + 1, size):
        block = np.arange(at, min(at + size, high + 1)) / rate
        head = [snapped(first, begin)] if at == low else []
        tail = [snapped(last, end)] if at + size > high else []
        yield np.concatenate([head, block, tail])
