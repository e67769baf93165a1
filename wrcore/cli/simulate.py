"""``wrcore simulate``: simulate a scene and write its run."""

import argparse
import json
from functools import partial

from wrcore.cli.common.files import HDF5, output, refuse_others

NOT_REACHED = 4
"""Exit status of a run that did not reach the required accuracy, or that derailed: its later motion is unknown."""

ABOUT = """
Run a scene: a file that names vehicle, profiles, track, speed and integration. 'wrcore keys scene'
lists every key with unit, range and default. Kernels are compiled when a model runs for the first time: about
half a minute.
"""

FILES = """
run.h5 has a group per body (wheelset_1, car_body ...) and per wheel (wheelset_1/left; a column per patch). Each holds
channels over time whose names end in their unit: y_m, yaw_rad, N_N, Fx_N, xi, eta, phi_per_m and so on, all of which
wr.load_run("run.h5") lists and explains; .to_pandas() makes one table of them.
"""


def add(commands):
    command = commands.add_parser("simulate", help="run a scene", description=ABOUT, epilog=FILES)
    command.add_argument("scene", metavar="SCENE.yaml", help="'wrcore init FOLDER' makes some to start from")
    command.add_argument(
        "--set", action="append", default=[], metavar="key.path=value", dest="overrides",
        help="another value of a key of the scene, in SI units: speed=60, integration.duration=2; may be repeated; "
             "null takes a key out",
    )  # fmt: skip
    command.add_argument("--out", metavar="run.h5", help="write the run here; left out: it is only reported")
    command.add_argument(
        "--resume", action=argparse.BooleanOptionalAction, default=True,
        help="go on with an interrupted run of --out (default: yes)",
    )  # fmt: skip
    command.add_argument("--json", action="store_true", help="end with one line of JSON")
    command.add_argument(
        "--accuracy", type=float, metavar="X",
        help="tighten the integration until its measured error is below this (m; N for Y, Q and wear)",
    )  # fmt: skip
    command.add_argument(
        "--accuracy-of", default="y", metavar="y|Y|Q|wear",
        help="error of the lateral position of wheelsets (y: m, rms), of wheel forces (Y, Q: N, rms), of the mean wear "
        "number (wear: N)",
    )  # fmt: skip
    command.set_defaults(run=run)


def run(options):
    from wrcore.run.progress import simulated_time
    from wrcore.run.streaming import simulate_to
    from wrcore.scene.description import load_scene

    out = output(options.out, HDF5) if options.out else None
    scene = load_scene(options.scene, options.overrides)
    if out:
        refuse_others(out, "scene", scene.data["name"])
    if options.accuracy is not None:
        return _to_accuracy(options, scene, out)
    with simulated_time(scene.data["integration"]["duration"]) as advance:
        say = partial(print, f"{scene.data['name']}:")
        done, interrupted = simulate_to(scene, out, advance, options.resume, say)
    _print_run(done, options.json)
    if interrupted:
        return 128 + interrupted
    return 0 if done.status in ("completed", "derailed") else 1


def _to_accuracy(options, scene, out):
    from wrcore.analysis.to_accuracy import simulate_to_accuracy

    say = partial(print, f"{scene.data['name']}:")
    done, accuracy = simulate_to_accuracy(scene, options.accuracy, options.accuracy_of, say)
    say(f"{accuracy.reason}; {accuracy.cost:.1f} times the evaluations of this run in all")
    if out:
        done.save(out)
    _print_run(done, options.json)
    if done.status not in ("completed", "derailed"):
        return 1
    return 0 if accuracy.reached and done.status == "completed" else NOT_REACHED


def _print_run(done, as_json):
    """Print how a run ended, its computing time, and the limits of validity that it exceeded."""
    from wrcore.run.checks.validity import LIMITS, LOOK_UP_ERRORS

    counters = done.counters
    factor = counters["simulated_s"] / counters["wall_s"] if counters["wall_s"] > 0.0 else 0.0
    summary = {
        "status": done.status, "reason": done.reason, "simulated_s": counters["simulated_s"],
        "wall_s": counters["wall_s"], "real_time_factor": factor,
    }  # fmt: skip
    summary |= {n: counters[n] for n in ("steps", "rejected", "rhs_evaluations", "compile_s", "patches", *LIMITS)}
    errors = {name: counters[name] for name in LOOK_UP_ERRORS if name in counters}
    summary |= errors
    if as_json:
        print(json.dumps(summary))
        return
    print(
        f"{done.scene['name']}: {done.status}{': ' + done.reason if done.reason else ''}; "
        f"{summary['simulated_s']:g} s in {summary['wall_s']:.3g} s, {factor:.3g} times real time; {summary['steps']} "
        f"steps, {summary['rejected']} rejected, {summary['rhs_evaluations']} right-hand sides"
    )
    exceeded = [f"{counters[name]} {text}" for name, text in LIMITS.items() if counters[name]]
    if exceeded:
        print(f"beyond the models' limits: {', '.join(exceeded)} (of {counters['patches']} patches at output times)")
    if solved := counters.get("patches_not_tabulated", 0):
        print(f"exact contact was solved {solved} times where its table has no answer")
    if any(errors.values()):  # a lookup table was used
        normal, force, pressure = (f"{100.0 * error:.2g} %" for error in errors.values())
        print(
            f"looked-up contact, in the middle of cells beside the exact solver: N within {normal}, creep force within "
            f"{force} of mu N, p_max within {pressure}"
        )
