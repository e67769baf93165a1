"""Benchmarks: comparisons of the computing time of two or more variants.

All variants of a group run in turn in one process. Times exclude compiling and loading of kernels, except in
``process``. All benchmark functions return rows of :func:`study.cost.timing.compare`.
"""

import json
import os
import subprocess
import sys
import time

import numpy as np
import pandas as pd

from study.cost.recorded import evaluation, record
from study.cost.search import search_costs
from study.cost.timing import Bar, Contender, compare, summary, take_turns
from wrcore.bodies.body import STATE_SIZE
from wrcore.contact.search.detection import PLANAR, SPATIAL
from wrcore.creep.laws import LAWS
from wrcore.integrate.integrator import integrate
from wrcore.integrate.reference import integrate_function
from wrcore.reference.wheelset import plain_wheelset
from wrcore.run.simulate import output_times
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

BOXES = {"in the wheelsets": "false", "bodies on joints": "true"}
"""Settings of ``vehicle.axle_boxes``."""

AIM = 0.005
"""Approximate minimum processor time of a timed call, s."""


def lateral(trajectory, model):
    """Return lateral positions of the wheelsets over time, m, shape (n, k)."""
    return trajectory.states[:, STATE_SIZE * model.bodies.wheelsets + 1]


def rms(values):
    """Return the root mean square of values."""
    return float(np.sqrt(np.mean(np.square(values))))


def repeats(call):
    """Return the number of repetitions of a call that take about ``AIM``."""
    call()
    started = time.process_time()
    call()
    return max(1, int(AIM / max(time.process_time() - started, 1e-7)))


def repeated(label, call, units=1.0):
    """Return a `Contender` that repeats a short call until it takes about ``AIM``."""
    count = repeats(call)

    def often():
        for _ in range(count):
            call()

    return Contender(label, often, count * units)


def engine_against_scipy(title, scene, accuracy, ladder, passes):
    """Compare the Dormand-Prince pair, compiled and in SciPy, at equal accuracy on the same compiled right-hand side.

    ``accuracy`` is the RMS error of the lateral position (m) relative to a run of ``tsit5`` at a tolerance of 1e-11.
    The time at this error is interpolated (logarithmically) between runs at the relative tolerances of ``ladder``. If
    the run at the loosest tolerance is more accurate, its time is used.
    """
    model, start = compile_scene(scene)
    times = output_times(0.0, scene.data["integration"]["duration"], 200.0)
    truth = lateral(integrate(model, start, times, "tsit5", 1e-11, 1e-14), model)
    methods = {"compiled": "rk45", "scipy": "scipy_rk45"}

    def run(method, rtol):
        return lambda: integrate(model, start, times, method, rtol, 1e-3 * rtol)

    calls = {label: [run(method, rtol) for rtol in ladder] for label, method in methods.items()}
    errors = {label: np.array([rms(lateral(call(), model) - truth) for call in calls[label]]) for label in methods}
    contenders = [repeated("", call) for call in calls["compiled"]] + [Contender("", call) for call in calls["scipy"]]
    seconds = take_turns(contenders, passes)
    parts = {"compiled": seconds[:, : len(ladder)], "scipy": seconds[:, len(ladder) :]}
    equal = np.column_stack([time_at_error(accuracy, errors[label], parts[label]) for label in methods])
    bar = Bar("scipy", "ratio", "at least", 8.0)
    rows = summary(f"Dormand-Prince: {title}", "run", list(methods), equal, "ms", bar)
    return [row | {"error_m": accuracy} for row in rows]


def time_at_error(accuracy, errors, seconds):
    """Interpolate times (passes,) at an error, from errors (n,) and times (passes, n); NaN if no run reaches it."""
    order = np.argsort(errors)
    errors, seconds = np.log(errors[order]), np.log(seconds[:, order])
    return np.exp([np.interp(np.log(accuracy), errors, row, left=np.nan) for row in seconds])


def compiled_against_plain(scene, states, duration, passes):
    """Compare the compiled right-hand side with a plain NumPy version, for one wheelset on tangent track.

    Times are per evaluation at ``states`` of the scene's run, and of runs of a duration (s) by the same method.
    """
    recorded = record(scene, scene.data["integration"]["duration"], states)
    model, start = recorded.model, compile_scene(scene)[1]
    plain = plain_wheelset(scene, model.contact.creep.table)

    def slow():
        for state in recorded.states:
            plain.rates(0.0, state)

    bar = Bar("plain NumPy", "ratio", "at least", 1000.0)
    both = [evaluation("compiled", recorded), Contender("plain NumPy", slow, states)]
    rows = compare("right-hand side", "evaluation", both, passes, "us", bar)
    times = np.array([0.0, duration])
    runs = [
        repeated("compiled", lambda: integrate(model, start, times, "rk45", 1e-6, 1e-9)),
        Contender("plain NumPy", lambda: integrate_function(plain.rates, start, times, "scipy_rk45", 1e-6, 1e-9)),
    ]
    return rows + compare("run of plain equations", "run", runs, passes, "ms", bar)


def planar_against_spatial(title, scene, passes):
    """Compare the time of whole runs with planar and with spatial detection."""
    model, start = compile_scene(scene)
    settings = scene.data["integration"]
    times = output_times(0.0, settings["duration"], scene.data["output"]["rate"])

    def run(detection):
        changed = model._replace(contact=model.contact._replace(detection=detection))
        return lambda: integrate(changed, start, times, settings["method"], settings["rtol"], settings["atol"])

    contenders = [repeated(name, run(number)) for name, number in (("spatial", SPATIAL), ("planar", PLANAR))]
    return compare(f"detection: {title}", "run", contenders, passes, "ms")


def right_hand_sides(group, scenes, count, passes, bar=None):
    """Compare the time of evaluations of several scenes (by label), each at ``count`` states of its run."""
    contenders = []
    for label, scene in scenes.items():
        recorded = record(scene, scene.data["integration"]["duration"], count)
        contenders.append(evaluation(label, recorded))
    return compare(group, "evaluation", contenders, passes, "us", bar)


def children_time():
    """Return the processor time of all child processes that have ended, s."""
    times = os.times()
    return times.children_user + times.children_system


def process(scene, passes):
    """Compare a process that runs one scene, with cached kernels and creep table, with a process that imports NumPy."""
    command = [sys.executable, "-m", "wrcore", "simulate", str(scene), "--json"]
    report = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()[-1])

    def started(arguments):
        return lambda: subprocess.run(arguments, check=True, capture_output=True)

    contenders = [
        Contender("import of NumPy", started([sys.executable, "-c", "import numpy"])),
        Contender(f"scene of {report['simulated_s']:g} s", started(command)),
    ]
    rows = compare("process", "process", contenders, passes, "s", clock=children_time)
    rows[1] |= {"bar": "at most 1.5 s", "met": "yes" if rows[1]["time"] <= 1.5 else "no"}
    return rows


def benchmark_table(scenes, settings):
    """Run all benchmarks: scenes (title, file, changes) by name, settings ``cost.pairs`` of the configuration."""
    passes, count, rows = settings["passes"], settings["states"], []

    def scene(name, *further):
        _, source, changes = scenes[name]
        return load_scene(source, [*changes, *further])

    for name, entry in settings["engine"].items():
        rows += engine_against_scipy(scenes[name][0], scene(name), **entry)
    rows += compiled_against_plain(scene(settings["plain"]["scene"]), **settings["plain"]["size"])
    for name in settings["detection"]:
        rows += planar_against_spatial(scenes[name][0], scene(name), passes)
    rows += search_costs(compile_scene(scene(settings["creep"]))[0].contact, count, passes)
    laws = {law: scene(settings["creep"], f"contact.creep.model={law}") for law in LAWS}
    rows += right_hand_sides("creep law", laws, count, passes)
    boxes = {label: scene(settings["axle_boxes"], f"vehicle.axle_boxes={value}") for label, value in BOXES.items()}
    bar = Bar("bodies on joints", "excess", "at most", 2.0)
    rows += right_hand_sides("axle boxes", boxes, count, passes, bar)
    rows += process(**settings["process"])
    return pd.DataFrame(rows)
