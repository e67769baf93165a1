"""The benchmarks: what is faster than what, and by how much.

Every group of contenders takes turns in one process; compiling and loading kernels is left out (but where it is the
point, as in ``process``). All functions return rows of :func:`wrcore.cost.timing.compare`.
"""

import json
import subprocess
import sys
import time

import numpy as np
import pandas as pd

from wrcore.contact.detection import PLANAR, SPATIAL
from wrcore.cost.recorded import evaluation, record
from wrcore.cost.search import search_costs
from wrcore.cost.timing import Bar, Contender, compare, summary, take_turns
from wrcore.creep.laws import LAWS
from wrcore.dynamics.body import STATE_SIZE
from wrcore.dynamics.integrate import integrate
from wrcore.dynamics.reference import integrate_function
from wrcore.plain.wheelset import plain_wheelset
from wrcore.scene import compile_scene, load_scene
from wrcore.simulate import output_times

BOXES = {"in the wheelsets": "false", "bodies on joints": "true"}
"""Settings of ``vehicle.axle_boxes``."""

AIM = 0.005
"""Processor time that a timed call lasts at least, roughly, s."""


def lateral(trajectory, model):
    """Lateral positions of the wheelsets over time, m, shape (n, k)."""
    return trajectory.states[:, STATE_SIZE * model.bodies.wheelsets + 1]


def rms(values):
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def repeats(call):
    """How often a call must be made to last ``AIM``."""
    call()
    started = time.process_time()
    call()
    return max(1, int(AIM / max(time.process_time() - started, 1e-7)))


def repeated(label, call, units=1.0):
    """Contender that makes a short call so often that it can be timed."""
    count = repeats(call)

    def often():
        for _ in range(count):
            call()

    return Contender(label, often, count * units)


def engine_against_scipy(title, scene, rtol, ladder, passes):
    """Dormand and Prince's pair, compiled and by scipy, over the same compiled right-hand side, at equal error.

    scipy runs over a ladder of tolerances; its time at the compiled run's error is interpolated between them (both on
    logarithmic scales). The error is that of the lateral position, rms, against a run at a tolerance of 1e-11.

    Parameters
    ----------
    title : str
    scene : Scene
    rtol : float
        Of the compiled run.
    ladder : sequence of float
        Relative tolerances of scipy's runs.
    passes : int
    """
    model, start = compile_scene(scene)
    times = output_times(0.0, scene.data["integration"]["duration"], 200.0)
    truth = lateral(integrate(model, start, times, "tsit5", 1e-11, 1e-14), model)

    def run(method, rtol):
        return lambda: integrate(model, start, times, method, rtol, 1e-3 * rtol)

    def error(method, rtol):
        return rms(lateral(run(method, rtol)(), model) - truth)

    wanted, errors = error("rk45", rtol), np.array([error("scipy_rk45", value) for value in ladder])
    if not errors.min() <= wanted <= errors.max():
        raise ValueError(f"ladder: expected errors around {wanted:.2g} m, got {errors.min():.2g} to {errors.max():.2g}")
    contenders = [repeated("compiled", run("rk45", rtol)), *(Contender("", run("scipy_rk45", r)) for r in ladder)]
    seconds, order = take_turns(contenders, passes), np.argsort(errors)
    equal = [np.exp(np.interp(np.log(wanted), np.log(errors[order]), np.log(row[1:][order]))) for row in seconds]
    paired = np.column_stack([seconds[:, 0], equal])
    bar = Bar("scipy", "ratio", "at least", 8.0)
    rows = summary(f"Dormand-Prince: {title}", "run", ["compiled", "scipy"], paired, "ms", bar)
    return [row | {"error_m": wanted} for row in rows]


def compiled_against_plain(scene, states, duration, passes):
    """The compiled right-hand side against the plain NumPy one: per evaluation, and in runs by the same pair.

    Parameters
    ----------
    scene : Scene
        One wheelset on tangent track.
    states : int
        Of the scene's run, at which both are evaluated.
    duration : float
        Of the runs, s.
    passes : int
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
    """Whole runs with planar and with spatial detection."""
    model, start = compile_scene(scene)
    settings = scene.data["integration"]
    times = output_times(0.0, settings["duration"], scene.data["output"]["rate"])

    def run(detection):
        changed = model._replace(contact=model.contact._replace(detection=detection))
        return lambda: integrate(changed, start, times, settings["method"], settings["rtol"], settings["atol"])

    contenders = [repeated(name, run(number)) for name, number in (("spatial", SPATIAL), ("planar", PLANAR))]
    return compare(f"detection: {title}", "run", contenders, passes, "ms")


def right_hand_sides(group, scenes, count, passes, bar=None):
    """Right-hand sides of several scenes, each at the states of its own run.

    Parameters
    ----------
    group : str
    scenes : dict of str to Scene
        By contender.
    count : int
        States of each run.
    passes : int
    bar : Bar, optional
    """
    contenders = []
    for label, scene in scenes.items():
        recorded = record(scene, scene.data["integration"]["duration"], count)
        contenders.append(evaluation(label, recorded))
    return compare(group, "evaluation", contenders, passes, "us", bar)


def process(scene, passes):
    """A process that runs one scene with kernels and creep table cached, against one that only imports NumPy."""
    command = [sys.executable, "-m", "wrcore.cli", "simulate", str(scene), "--json"]
    report = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()[-1])

    def started(arguments):
        return lambda: subprocess.run(arguments, check=True, capture_output=True)

    contenders = [
        Contender("import of NumPy", started([sys.executable, "-c", "import numpy"])),
        Contender(f"scene of {report['simulated_s']:g} s", started(command)),
    ]
    rows = compare("process", "process", contenders, passes, "s", clock=time.perf_counter)
    rows[1] |= {"bar": "at most 1.5 s", "met": "yes" if rows[1]["time"] <= 1.5 else "no"}
    return rows


def benchmark_table(scenes, settings):
    """All groups as one table.

    Parameters
    ----------
    scenes : dict of str to (str, str, list of str)
        Title, scene file and changes by name.
    settings : dict
        Key ``cost_study.pairs`` of the configuration.

    Returns
    -------
    pandas.DataFrame
    """
    passes, count, rows = settings["passes"], settings["states"], []

    def scene(name, *further):
        _, source, changes = scenes[name]
        return load_scene(source, [*changes, *further])

    for name, entry in settings["engine"].items():
        title = scenes[name][0]
        rows += engine_against_scipy(title, scene(name), entry["rtol"], entry["ladder"], settings["engine_passes"])
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
