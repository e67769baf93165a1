"""Simulate runs of any length: write them to disk in blocks, keep interrupted runs and resume them.

A run is integrated in blocks of output times. A run that exceeds one block or takes longer than a minute is written
block by block into a folder next to the file (``.run.h5.parts``). Each block is a complete run file with a checkpoint
and gets its name when it is complete. At the end the blocks are joined to the run file and the folder is removed. If
the process is killed or the disk is full, the folder remains. After SIGINT or SIGTERM the run file contains the results
up to the stop. The same command resumes the run from either. The results are bitwise identical to those of a run
without interruption. Blocks are not used if the compiled model, integration, output or the sources of the kernels
differ. If a block is damaged, the blocks before it are used.
"""

from __future__ import annotations

import json
import math
import os
import signal
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack, contextmanager
from functools import partial
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

from wrcore.errors import InputError
from wrcore.errors.new_files import hold, remove_folder, remove_remains
from wrcore.integrate.integrator import REFERENCES
from wrcore.kernels.cache import source_digest
from wrcore.run.checkpoints import digest_of
from wrcore.run.checks.reach import check_reach, warn_of_unreached
from wrcore.run.checks.shape_along import warn_of_shapes
from wrcore.run.output.compute import ArcLengths
from wrcore.run.output.files import join_runs, read_part, write_going_on, write_run
from wrcore.run.output.run import Run
from wrcore.run.simulate import bytes_per_time, check_memory, output_blocks
from wrcore.run.simulation import Simulation, joined_counters
from wrcore.scene.description import Scene

BLOCK_BYTES, LONGEST_BLOCK = 32e6, 8192
"""Largest size of a block's channels in memory, bytes, and largest number of its output times."""

WHOLE = 2**62  # output times in a block that holds all of them

STOP, INTERRUPTED = "stop", "interrupted"
"""Reason of a block that ends for a checkpoint, and first word of the reason of an interrupted run."""

PATIENCE = 10.0
"""Time after a first signal in which a second one is ignored, s. In this time the run ends: an attempted step with
exact patches and writing a block take up to half a second each. With less time a second Ctrl-C loses up to a minute."""

CHECKPOINT_S = 60.0  # longest wall time between two checkpoints, s


class Interrupts:
    """Context that catches SIGINT and SIGTERM: ``caught`` is the signal's number or 0.

    A second signal within `PATIENCE` is ignored, while results are written. Later it has its usual effect.
    """

    caught, since = 0, 0.0

    def __enter__(self):
        self._before = {}
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self._catch) for number in (signal.SIGINT, signal.SIGTERM)}
        return self

    def _catch(self, number, _):
        if not self.caught:
            self.caught, self.since = number, time.monotonic()
        elif time.monotonic() - self.since > PATIENCE:
            signal.signal(number, self._before[number])
            signal.raise_signal(number)

    def __exit__(self, *_):
        for number, handler in self._before.items():
            signal.signal(number, handler)


def simulate_to(
    scene: Scene,
    path: str | os.PathLike[str] | None,
    progress: Callable[[float], object] | None = None,
    resume: bool = True,
    say: Callable[[str], object] = lambda text: None,
    checkpoint_s: float = CHECKPOINT_S,
    block: int | None = None,
    record: dict[str, Any] | None = None,
) -> tuple[Run, int]:
    """Simulate a scene with bounded memory and write its channels to the run file ``path`` (None: counters only).

    Return the run, with the channels of the last block only, and the number of the signal that interrupted it, or 0.
    An interrupted run of the same scene is resumed unless ``resume`` is False; ``say`` reports this, and damaged files.
    ``progress`` is called with the simulated time reached (s). ``checkpoint_s`` is the longest wall time between
    checkpoints, s; ``block`` the number of output times in a block; ``record`` further settings to store. InputError
    if another process writes the same file; OSError names the file if the disk is full, and the blocks are kept.
    """
    settings = scene.data["integration"]
    check_reach(scene, settings["duration"])
    simulation = Simulation(scene)
    if settings["method"] not in REFERENCES:
        size = block or _block_size(simulation)
    else:  # integration methods of other libraries have no checkpoints
        check_memory(scene)
        size = WHOLE
    summary, blocks = Summary(), None
    with ExitStack() as stack:
        if path is not None:
            blocks = stack.enter_context(Blocks(path, fingerprint(simulation), say))
            if blocks.take_up(simulation, summary, resume):
                say(f"goes on at t = {summary.t:.6g} s, where it was interrupted")
        interrupts = stack.enter_context(Interrupts())
        pieces = output_blocks(0.0, settings["duration"], scene.data["output"]["rate"], size)
        for times, following in pairwise(chain(pieces, [None])):
            while len(rest := times[times > summary.t]) and not summary.over:
                deadline = time.monotonic() + checkpoint_s if size < WHOLE else math.inf
                run = simulation.advance(rest, progress, partial(_stop, interrupts, deadline))
                run.settings |= record or {}
                end = following is None and len(run.t) and run.t[-1] == times[-1]
                summary.add(run, 0 if end else interrupts.caught)
                if blocks is not None:
                    blocks.add(run, simulation, end or summary.over)
        if blocks is not None:
            blocks.join(summary)
    warn_of_unreached(scene, simulation.outputs.places)
    warn_of_shapes(scene.source, summary.counters, scene.data["output"]["rate"])
    return summary.run(), interrupts.caught


def _stop(interrupts, deadline):
    return STOP if interrupts.caught or time.monotonic() > deadline else ""


def _block_size(simulation):
    """Return the number of output times of a block: its channels take at most `BLOCK_BYTES`; at least 1."""
    return max(1, min(LONGEST_BLOCK, int(BLOCK_BYTES / bytes_per_time(simulation.scene.vehicle))))


def fingerprint(simulation):
    """Return the digest of all inputs that determine a run's channels: model, start, settings, sources of kernels."""
    data = simulation.scene.data
    settings = json.dumps([data["integration"], data["output"]], sort_keys=True)
    return digest_of((simulation.start,), source_digest(), simulation.mark, settings).hexdigest()


class Summary:
    """Summary of a run's blocks: time reached (``t``, s), counters, ``last`` block, and ``over``: whether the run ended
    before its duration."""

    def __init__(self):
        self.first, self.t, self.over, self.last = math.nan, -math.inf, False, None
        self.counters = {}

    def add(self, run, interrupted=0):
        """Add a block; a block that ended for a checkpoint, without a signal, does not end the run."""
        if run.reason == STOP:
            run.status, run.reason = "completed", ""
        if interrupted and run.status == "completed":
            name = signal.Signals(interrupted).name
            run.status, run.reason = "stalled", f"{INTERRUPTED} ({name}) at t = {run.end_t:.6g} s"
        if len(run.t):
            self.first = float(run.t[0]) if math.isnan(self.first) else self.first
            self.t = float(run.t[-1])
        self.over, self.last = run.status != "completed", run
        self.counters = joined_counters(self.counters, run.counters)

    def run(self):
        """Return the last block with the counters of all blocks."""
        self.last.counters = {"compile_s": 0.0, **self.counters, "simulated_s": self.t - self.first}
        return self.last


class Blocks:
    """Blocks of the run with the fingerprint ``mark``, in a folder next to its file.

    There are ``count`` blocks, numbered from 0 without a gap; ``say`` reports damaged blocks.
    """

    def __init__(self, path, mark, say=lambda text: None):
        self.path, self.mark, self.say, self.lock, self.count = Path(path), mark, say, None, 0
        self.folder = self.path.with_name(f".{self.path.name}.parts")

    def __enter__(self):
        remove_remains(self.path)
        if os.path.lexists(self.folder):
            self._open()
        return self

    def __exit__(self, *_):
        if self.lock is not None:
            os.close(self.lock)

    def _open(self):
        if self.lock is None:
            self.lock = hold(self.folder, self.path)

    def _part(self, number):
        return self.folder / f"{number:06d}.h5"

    def take_up(self, simulation, summary, resume):
        """Set a simulation to the end of an interrupted run of the same scene; return False if there is no such run.

        All files are read before any file is moved or removed.
        """
        files, gap = sorted(self.folder.glob("[0-9]*.h5")), 1.5 / simulation.scene.data["output"]["rate"]
        kept = self._readable(files, gap) if resume else []
        alone = self._readable([self.path], gap) if resume and not kept else []
        if alone and alone[0][0].reason.startswith(INTERRUPTED):
            kept = alone
        for run, _ in kept:
            summary.add(run)
            summary.over &= not run.reason.startswith(INTERRUPTED)
        if kept:
            simulation.begin_at(kept[-1][0].end, ArcLengths(*kept[-1][1]))
            del summary.counters["compile_s"]
        for file in reversed(files if kept is alone else files[len(kept) :]):
            file.unlink()
        if kept and kept is alone:
            self._open()
            os.replace(self.path, self._part(0))
        self.count = len(kept)
        return bool(kept)

    def _readable(self, files, gap):
        """Return runs and arc lengths of the blocks up to the first block that cannot be used."""
        kept, reached = [], -0.5 * gap
        for number, file in enumerate(files):
            if not file.exists() or file not in (self.path, self._part(number)):
                break
            try:
                mark, run, places = read_part(file)
            except InputError as error:
                self.say(f"{error}; begins {'before it' if kept else 'anew'}")
                break
            if mark != self.mark or not (run.t[:1] > reached).all() or not (run.t[:1] < reached + gap).all():
                break
            kept.append((run, places))
            reached = run.t[-1] if len(run.t) else reached
        return kept

    def add(self, run, simulation, last):
        """Write a block: as a part, or as the run file if it is the only block."""
        also = partial(write_going_on, mark=self.mark, places=simulation.outputs.arc_lengths)
        with self._told():
            if last and not self.count:
                write_run(self.path, run, also)
                return
            self._open()
            write_run(self._part(self.count), run, also, compressed=False)  # compressed when they are joined
            self.count += 1

    def join(self, summary):
        """Join the blocks to the run file and remove their folder."""
        if self.count:
            with self._told():
                join_runs(self.path, [self._part(number) for number in range(self.count)], summary.run().counters)
        if self.lock is not None:
            remove_folder(self.folder)

    @contextmanager
    def _told(self):
        """Re-raise an OSError (disk full) with the name of the run file and the number of blocks that are kept."""
        try:
            yield
        except OSError as error:
            kept = f"; {self.count} blocks before are kept, the same command goes on" if self.count else ""
            raise OSError(error.errno, f"{error.strerror or error}{kept}", str(self.path)) from None
