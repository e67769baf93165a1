"""Hard cases over a long time: an hour of hunting, written to a file, interrupted and continued."""

import tracemalloc
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
import numpy as np

from study.hard_cases.cases import NORM_LIMIT, Check, prepare, rows
from wrcore.bodies.body import STATE_SIZE
from wrcore.integrate.trajectory import Trajectory
from wrcore.run.output.files import load_run
from wrcore.run.streaming import simulate_to

BLOCKS = 16
"""Number of blocks in which a run is written to its file."""

PARTS = 10
"""Number of parts of a run. The amplitudes of the second and the last part are compared, because the motion settles in
the first part."""

MEMORY_GROWTH = 1.05
"""Maximum ratio of the peak memory in the second half of a run to that in the first half. All blocks have the same
size, so that memory must not grow."""


class _BrokenOffError(Exception):
    """Exception that interrupts a run half-way, like a crash."""


def hunting(vehicles, name, changes, duration, rate=200.0):
    """Run a limit cycle over a long duration (s), once without and once with an interruption half-way.

    Outputs are at a rate (1/s). The ``changes`` to the scene set a speed with a stable limit cycle. Returns rows of the
    table.
    """
    kept = {"integration.duration": duration, "output.rate": rate, "output.channels": "[pose, velocity]"}
    setting = prepare(vehicles, name, {**changes, **kept})
    block = int(np.ceil(duration * rate / BLOCKS))
    with TemporaryDirectory() as folder:
        whole, again = (Path(folder, file) for file in ("whole.h5", "again.h5"))
        run, growth = _with_memory(setting.scene, whole, block, duration)
        try:
            simulate_to(setting.scene, again, _break_off_at(0.5 * duration), block=block)
        except _BrokenOffError:
            simulate_to(setting.scene, again, block=block)
        differing = _differing_channels(whole, again)
        amplitude, energy = _drifts(load_run(whole), setting)
    parameters = run.end_state[: STATE_SIZE * len(setting.model.bodies.mass)].reshape(-1, STATE_SIZE)[:, 3:7]
    norm = float(np.max(np.abs(np.linalg.norm(parameters, axis=1) - 1.0)))
    rtol = setting.control["rtol"]
    checks = [
        Check("Euler parameters' norm less 1", norm, NORM_LIMIT, "1", "a hundredth of rtol = 1e-4"),
        Check("change of the amplitude, of its own", amplitude, rtol, "1", "relative tolerance of a step"),
        Check("change of the lateral kinetic energy, of its own", energy, 10.0 * rtol, "1", "ten times that tolerance"),
        Check("channels that differ when taken up again", float(differing), 0.0, "1", "bit by bit"),
        Check("peak memory, second half over first", growth, MEMORY_GROWTH, "1", "blocks are of one size"),
    ]
    condition = f"{setting.model.speed:g} m/s, {duration:g} s"
    return rows("long run", "hunting", condition, setting, _trajectory(run), checks)


def _with_memory(scene, path, block, duration):
    """Return a run, and the ratio of the peak memory in its second half to that in its first half."""
    peaks = []

    def half_way(t):
        if not peaks and t >= 0.5 * duration:
            peaks.append(tracemalloc.get_traced_memory()[1])
            tracemalloc.reset_peak()

    tracemalloc.start()
    try:
        run, _ = simulate_to(scene, path, half_way, block=block)
        peaks.append(tracemalloc.get_traced_memory()[1])
    finally:
        tracemalloc.stop()
    return run, peaks[-1] / peaks[0]


def _break_off_at(t):
    def progress(reached):
        if reached >= t:
            raise _BrokenOffError

    return progress


def _differing_channels(one, other):
    """Return the number of datasets, including the last state, that are not bitwise identical in two run files."""
    differing = 0
    with h5py.File(one, "r") as first, h5py.File(other, "r") as second:
        names = []
        first.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        for name in names:
            same = name in second and first[name].shape == second[name].shape
            differing += not (same and np.array_equal(first[name][()], second[name][()], equal_nan=True))
    return differing


def _drifts(run, setting):
    """Return the relative changes of the first wheelset's amplitude and mean lateral kinetic energy.

    Compared are the second and the last part of the run. The amplitude is sqrt(2) times the root mean square over whole
    periods.
    """
    body = int(setting.model.bodies.wheelsets[0])
    wheelset = run[setting.scene.vehicle.body_names[body]]
    length = len(run.t) // PARTS
    amplitudes, energies = [], []
    for part in (slice(length, 2 * length), slice(-length, None)):
        y = wheelset.y_m[part] - wheelset.y_m[part].mean()
        rising = np.flatnonzero((y[:-1] < 0.0) & (y[1:] >= 0.0))
        periods = slice(rising[0], rising[-1])
        amplitudes.append(np.sqrt(2.0 * np.mean(y[periods] ** 2)))
        speeds = wheelset.vy_m_per_s[part][periods], wheelset.wz_rad_per_s[part][periods]
        mass, inertia = setting.model.bodies.mass[body], setting.model.bodies.inertia[body, 2]
        energies.append(0.5 * np.mean(mass * speeds[0] ** 2 + inertia * speeds[1] ** 2))
    return tuple(float(abs(last / first - 1.0)) for first, last in (amplitudes, energies))


def _trajectory(run):
    """Return a `Trajectory` without states that has the counters of a run, for the rows of the table."""
    counters = run.counters
    ends = np.array([run.t[-1] - counters["simulated_s"], run.t[-1]])
    return Trajectory(
        run.settings["method_used"], ends, np.empty((2, 0)), run.status, run.reason, counters["steps"],
        counters["rejected"], counters["rhs_evaluations"], counters["jacobians"], counters["factorisations"],
        counters["table_out_of_range"], counters["smallest_step_s"], counters["wall_s"],
        collapses=counters["step_collapses"],
    )  # fmt: skip
