"""Command line: ``wrcore simulate | sweep | contact | conicity | creep | table | profiles``.

Exit status 0 only when the result was produced; 2 for bad input, with one line that names the file, the field and
what was expected.
"""

import argparse
import json
import os
import sys
import time
from functools import partial
from pathlib import Path

from wrcore import __version__
from wrcore.errors import InputError
from wrcore.errors.new_files import appearing, try_out

_CONTACT = """
Patches of both wheels for each pose of IN.csv: pose_id, y_m, yaw_rad and, optionally, roll_rad, z_m. z given: forces at
that height; only roll given: each wheel carries the load by itself; neither: both are solved. Roll turns the wheelset
about x first, then yaw about z. Optional motion: V_m_per_s, omega_rad_per_s (rolling rate, positive forward; empty:
free rolling), vy_m_per_s, yaw_rate_rad_per_s, mu; creep forces act where V is given. In OUT.csv x, y, z, x_min_m and
x_max_m count in the track frame (x from the wheelset's cross-section), width_m in the contact plane; creepages, forces
on the wheel and Mz refer to the point x, y, z, of strips the centroid of pressure.
"""


NOT_REACHED = 4
"""Exit status of a run that is not as accurate as asked for, or that left the rails: what came after is unknown."""


class _Parser(argparse.ArgumentParser):
    def error(self, message):
        raise InputError(self.prog, "", message)


def main(arguments=None):
    """Entry point.

    Parameters
    ----------
    arguments : sequence of str, optional
        Defaults to the process's arguments.

    Returns
    -------
    int
        Exit status: 0 done, 2 bad input, 1 a run that stalled or failed, 4 an accuracy that was not reached or is that
        of a derailment, 128 and its number for a signal.
    """
    try:
        options = _parser().parse_args(arguments)
        return options.run(options)
    except InputError as error:
        print(f"wrcore: {error}", file=sys.stderr)
        return 2
    except OSError as error:  # a disk that fills up, a file that goes away
        print(f"wrcore: {InputError(error.filename or '', '', error.strerror or error)}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("wrcore: interrupted", file=sys.stderr)
        return 130


def _parser():
    parser = _Parser(prog="wrcore", description="Wheel-rail contact in railway dynamics.")
    parser.add_argument("--version", action="version", version=f"wrcore {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    _add_simulate(commands)
    _add_sweep(commands)
    _add_contact(commands)
    _add_conicity(commands)
    _add_creep(commands)
    _add_table(commands)
    _add_assess(commands)
    _add_evolve(commands)
    command = commands.add_parser("profiles", help="list the named wheel and rail profiles")
    command.set_defaults(run=_profiles)
    return parser


def _add_simulate(commands):
    command = commands.add_parser("simulate", help="run a scene")
    command.add_argument("scene", metavar="SCENE.yaml")
    command.add_argument("--set", action="append", default=[], metavar="key.path=value", dest="overrides")
    command.add_argument("--out", metavar="run.h5", help="write the run here")
    command.add_argument(
        "--resume", action=argparse.BooleanOptionalAction, default=True, help="go on with an interrupted run of --out"
    )
    command.add_argument("--json", action="store_true", help="end with one line of JSON")
    command.add_argument(
        "--accuracy", type=float, metavar="X", help="tighten the integration until its measured error is below this"
    )
    command.add_argument(
        "--accuracy-of", default="y", metavar="y|Y|Q|wear",
        help="of the lateral position of wheelsets (m, rms; the default), wheel forces (N, rms), mean wear number (N)",
    )  # fmt: skip
    command.set_defaults(run=_simulate)


def _add_assess(commands):
    command = commands.add_parser("assess", help="assess a stored run by EN 14363, EN 12299 or ISO 2631")
    command.add_argument("run_file", metavar="run.h5")
    command.add_argument(
        "--standard", default="EN 14363", metavar="'EN 14363'|'EN 12299'|'ISO 2631'", help="default: EN 14363"
    )
    command.add_argument("--begin", type=float, default=0.0, metavar="s", help="leave out what came before; default: 0")
    command.add_argument("--freight", action="store_true", help="limits of freight wagons")
    command.add_argument("--out", metavar="sections.csv", help="write percentiles section by section (EN 14363)")
    command.set_defaults(run=_assess)


def _add_evolve(commands):
    command = commands.add_parser("evolve", help="wear a wheel profile over the distance of a plan, or go on with it")
    command.add_argument("plan", metavar="PLAN.yaml")
    command.add_argument("--out", required=True, metavar="FOLDER", help="profile_000.csv and so on, steps.csv")
    command.add_argument("--threads", type=int, default=1, metavar="n", help="scenes of a step at the same time")
    command.set_defaults(run=_evolve)


def _add_sweep(commands):
    command = commands.add_parser("sweep", help="run a scene many times with other values of its keys")
    command.add_argument("sweep", metavar="SWEEP.yaml")
    command.add_argument("--out", required=True, metavar="table.csv|table.h5", help="a row per run")
    command.add_argument("--threads", type=int, default=1, metavar="n", help="runs at the same time")
    command.add_argument("--batch", metavar="i/n", help="only the i-th of n equal parts, from 1")
    command.add_argument("--gather", nargs="+", metavar="part.csv", help="run nothing: put parts together")
    command.set_defaults(run=_sweep)


def _add_contact(commands):
    command = commands.add_parser("contact", help="contact of a wheelset in given poses", description=_CONTACT)
    command.add_argument("--poses", required=True, metavar="IN.csv")
    command.add_argument("--wheel", required=True, metavar="NAME|FILE")
    command.add_argument("--rail", required=True, metavar="NAME|FILE")
    command.add_argument("--inclination", metavar="1/40", help="of a named rail, which needs one; 0: upright")
    command.add_argument("--gauge", type=float, default=1.435, metavar="m")
    command.add_argument("--rolling-radius", type=float, default=0.46, metavar="m")
    command.add_argument("--tape-circle-half-distance", type=float, default=0.75, metavar="m")
    command.add_argument("--shear-modulus", type=float, default=8.2e10, metavar="Pa")
    command.add_argument("--poisson-ratio", type=float, default=0.28)
    command.add_argument("--detection", choices=("planar", "spatial"), default="spatial")
    command.add_argument(
        "--patch", choices=("maximum", "moment", "strips", "exact", "grid"), default="moment",
        help="reduction of an overlap to an ellipse, or the real patch",
    )  # fmt: skip
    command.add_argument(
        "--resolution", choices=("coarse", "middle", "fine"), default="fine", help="of strips and grids"
    )
    command.add_argument(
        "--slip", choices=("surfaces", "creepages"), default="surfaces",
        help="rigid slip of strips and grids: of the real surfaces, or of one set of creepages per patch",
    )  # fmt: skip
    command.add_argument(
        "--load-by", choices=("vertical", "normal"), default="vertical",
        help="the load is the vertical sum of all forces on a wheel, or the sum of its normal forces",
    )  # fmt: skip
    command.add_argument("--friction", type=float, default=0.3, metavar="mu", help="where a pose gives none")
    command.add_argument("--wheel-load", type=float, required=True, metavar="N")
    command.add_argument("--out", required=True, metavar="OUT.csv")
    command.set_defaults(run=_contact)


def _add_conicity(commands):
    command = commands.add_parser("conicity", help="equivalent conicity of a wheelset on its track (EN 15302)")
    command.add_argument("--wheel", required=True, metavar="NAME|FILE")
    command.add_argument("--rail", required=True, metavar="NAME|FILE")
    command.add_argument("--right-wheel", metavar="NAME|FILE", help="where it differs from --wheel")
    command.add_argument("--right-rolling-radius", type=float, metavar="m", help="where it differs")
    command.add_argument("--unit", choices=("m", "mm"), help="of profile files without a header")
    command.add_argument("--inclination", metavar="1/40", help="of a named rail, which needs one; 0: upright")
    command.add_argument("--gauge", type=float, default=1.435, metavar="m", help="14 mm below the rails' tops")
    command.add_argument("--rolling-radius", type=float, default=0.46, metavar="m")
    command.add_argument("--tape-circle-half-distance", type=float, default=0.75, metavar="m")
    command.add_argument(
        "--roll", action=argparse.BooleanOptionalAction, default=False,
        help="let the wheelset roll so that both wheels touch; the standard does not",
    )  # fmt: skip
    command.add_argument("--amplitudes-from", type=float, default=0.001, metavar="m")
    command.add_argument("--to", type=float, default=0.008, metavar="m")
    command.add_argument("--step", type=float, default=0.001, metavar="m", help="of the amplitudes")
    command.add_argument("--out", required=True, metavar="OUT.csv")
    command.add_argument("--table", metavar="OUT2.csv", help="rolling radius difference over the lateral position")
    command.set_defaults(run=_conicity)


def _add_creep(commands):
    command = commands.add_parser("creep", help="creep forces of given cases")
    command.add_argument("--cases", required=True, metavar="IN.csv")
    command.add_argument("--model", default="table", choices=("table", "exact", "fastsim", "polach", "she", "linear"))
    command.add_argument("--table", metavar="FILE", help="creep table; left out, one is built or found in the cache")
    command.add_argument("--out", required=True, metavar="OUT.csv")
    command.set_defaults(run=_creep)


def _add_table(commands):
    command = commands.add_parser("table", help="build or describe a creep table")
    actions = command.add_subparsers(metavar="ACTION", required=True)
    build = actions.add_parser("build", help="refine until a random check meets the tolerance")
    build.add_argument("--nu", type=float, default=0.28, help="Poisson's ratio")
    build.add_argument("--planes", choices=("ellipse", "sdec"), default="ellipse")
    build.add_argument("--tolerance", type=float, help="99 %% error as a fraction of mu N")
    build.add_argument("--out", required=True, metavar="FILE")
    build.set_defaults(run=_table_build)
    info = actions.add_parser("info", help="what a table holds and how accurate it is")
    info.add_argument("file")
    info.set_defaults(run=_table_info)


def _positive(value, option):
    if not 0.0 < value < float("inf"):
        raise InputError("wrcore contact", option, f"expected a number above 0, got {value}")
    return value


HDF5 = (".h5", ".hdf5")


def _output(path, endings=(".csv",)):
    """Refuse an output path that cannot be written, or is of another kind, before any work starts."""
    if Path(path).suffix.lower() not in endings:
        raise InputError("--out", path, f"expected a name that ends in {' or '.join(endings)}")
    if not os.path.isdir(os.path.dirname(os.path.abspath(path))) or os.path.isdir(path):
        raise InputError("--out", path, "expected a file in an existing folder")
    try:  # permissions do not tell whether a disk is full or a name is too long
        try_out(path)
    except OSError as error:
        raise InputError("--out", path, f"expected a file that can be written: {error.strerror}") from None
    return Path(path)


def _refuse_others(path, attribute, wanted):
    """Refuse to write over an HDF5 file whose attribute (of a scene: its name) says that it is something else."""
    if path.suffix.lower() not in HDF5 or not path.exists():
        return
    import h5py

    try:
        with h5py.File(path) as file:
            found = str(file.attrs.get(attribute, "something else"))
        found = json.loads(found)["name"] if attribute == "scene" else found
    except (OSError, ValueError, KeyError, TypeError):
        found = "something else" if h5py.is_hdf5(path) else wanted  # what no program can read may go
    if found != wanted:
        raise InputError("--out", path, f"expected no file, or one of {wanted!r}; this one is of {found!r}: remove it")


def _write_csv(frame, path):
    """Write a table: never half a file."""
    with appearing(path) as file:
        frame.to_csv(file, index=False, float_format="%.12g")


def _simulate(options):
    from wrcore.run.progress import simulated_time
    from wrcore.run.streaming import simulate_to
    from wrcore.scene.description import load_scene

    out = _output(options.out, HDF5) if options.out else None
    scene = load_scene(options.scene, options.overrides)
    if out:
        _refuse_others(out, "scene", scene.data["name"])
    if options.accuracy is not None:
        return _simulate_to_accuracy(options, scene, out)
    with simulated_time(scene.data["integration"]["duration"]) as advance:
        say = partial(print, f"{scene.data['name']}:")
        run, interrupted = simulate_to(scene, out, advance, options.resume, say)
    _print_run(run, options.json)
    if interrupted:
        return 128 + interrupted
    return 0 if run.status in ("completed", "derailed") else 1


def _simulate_to_accuracy(options, scene, out):
    from wrcore.analysis.to_accuracy import simulate_to_accuracy

    say = partial(print, f"{scene.data['name']}:")
    run, accuracy = simulate_to_accuracy(scene, options.accuracy, options.accuracy_of, say)
    run.settings |= {f"accuracy_{name}": value for name, value in vars(accuracy).items()}
    say(f"{accuracy.reason}; {accuracy.cost:.1f} times the time of this run in all")
    if out:
        run.save(out)
    _print_run(run, options.json)
    if run.status not in ("completed", "derailed"):
        return 1
    return 0 if accuracy.reached and run.status == "completed" else NOT_REACHED


def _print_run(run, as_json):
    """How a run ended, what it cost, and which limits of validity it exceeded."""
    from wrcore.run.validity import LIMITS

    counters = run.counters
    factor = counters["simulated_s"] / counters["wall_s"] if counters["wall_s"] > 0.0 else 0.0
    summary = {
        "status": run.status, "reason": run.reason, "simulated_s": counters["simulated_s"],
        "wall_s": counters["wall_s"], "real_time_factor": factor, "steps": counters["steps"],
        "rejected": counters["rejected"], "rhs_evaluations": counters["rhs_evaluations"],
        "compile_s": counters["compile_s"], "patches": counters["patches"],
        **{name: counters[name] for name in LIMITS},
    }  # fmt: skip
    if as_json:
        print(json.dumps(summary))
        return
    print(
        f"{run.scene['name']}: {run.status}{': ' + run.reason if run.reason else ''}; "
        f"{summary['simulated_s']:g} s in {summary['wall_s']:.3g} s, {factor:.3g} times real time; {summary['steps']} "
        f"steps, {summary['rejected']} rejected, {summary['rhs_evaluations']} right-hand sides"
    )
    exceeded = [f"{counters[name]} {text}" for name, text in LIMITS.items() if counters[name]]
    if exceeded:
        print(f"beyond the models' limits: {', '.join(exceeded)}; {counters['patches']} patches at the output times")


def _assess(options):
    from wrcore.analysis.assess import assess
    from wrcore.run.results import load_run

    out = _output(options.out, (".csv",)) if options.out else None
    assessment = assess(load_run(options.run_file), options.standard, options.begin, options.freight)
    print(assessment)
    if out:
        _write_csv(assessment.sections, out)
    return 0


def _evolve(options):
    from wrcore.analysis.evolve import evolve

    _check_threads("wrcore evolve", options.threads)
    table = evolve(options.plan, options.out, partial(print, flush=True), threads=options.threads)
    columns = ["distance_m", "worn_m", "Sh_m", "Sd_m", "qR_m", "equivalent_conicity"]
    print(table[columns].to_string(index=False, float_format=lambda value: f"{value:.5g}"))
    return 0


def _check_threads(command, threads):
    if not 1 <= threads <= 1000:
        raise InputError(command, "--threads", f"expected 1 to 1000, got {threads}")


def _sweep(options):
    from wrcore.sweep.batch import gather, load_table, run_rows, sweep_to_file, write_table
    from wrcore.sweep.plan import load_sweep

    out = _output(options.out, (".csv", ".h5"))
    _refuse_others(out, "format", "wrcore sweep")
    _check_threads("wrcore sweep", options.threads)
    sweep, started = load_sweep(options.sweep), time.perf_counter()
    if options.gather:
        gather(sweep, options.gather, out)
    elif options.batch:
        write_table(out, run_rows(sweep, sweep.rows(*_batch(options.batch, len(sweep.runs))), options.threads), sweep)
    else:
        sweep_to_file(sweep, out, options.threads)
    table = load_table(out)
    ends = ", ".join(f"{count} {status}" for status, count in table["status"].value_counts().items())
    seconds = f"{time.perf_counter() - started:.3g} s"
    if "wall_s" in table:
        seconds += f", integrations {table['wall_s'].sum():.3g} s in all"
    print(f"{sweep.data['name']}: {len(table)} of {len(sweep.runs)} runs, {ends}, in {seconds}: {out}")
    return 0


def _batch(text, runs):
    """Number (from 0) and count of a batch such as 1/4."""
    number, _, count = text.partition("/")
    if not (number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count) <= runs):
        raise InputError("wrcore sweep", "--batch", f"expected i/n with 1 <= i <= n <= {runs} runs, got {text!r}")
    return int(number) - 1, int(count)


def _contact(options):
    from wrcore.analysis.poses import loaded_poses
    from wrcore.contact.geometry import contact_geometry
    from wrcore.contact.poses import read_poses
    from wrcore.geometry.standards import named_profile
    from wrcore.geometry.track import Track

    out = _output(options.out)
    poses = read_poses(options.poses)
    wheel = named_profile(options.wheel, "wheel")
    rail = named_profile(options.rail, "rail", _ratio(options.inclination))
    geometry = contact_geometry(
        wheel, rail, Track(options.gauge), options.rolling_radius, options.tape_circle_half_distance
    )
    table = loaded_poses(
        poses, geometry, options.wheel_load, options.patch, options.resolution, options.slip, options.load_by,
        options.friction, options.detection, options.shear_modulus, options.poisson_ratio,
    )  # fmt: skip
    if table.empty:
        raise InputError(options.poses, "", "expected a pose in which a wheel touches its rail, got none")
    _write_csv(table, out)
    missing = len(set(poses.pose_id) - set(table.pose_id))
    remarks = f", {missing} poses without contact" if missing else ""
    if options.patch != "grid" and table.attrs["on_grid"]:
        remarks += f", {table.attrs['on_grid']} patches by the grid"
    print(f"{len(poses)} poses, {len(table)} patches{remarks}: {out}")
    return 0


def _conicity(options):
    import numpy as np

    from wrcore.contact.conicity import conicity_curve
    from wrcore.contact.first_touch import first_touch

    out = _output(options.out)
    table_out = _output(options.table) if options.table else None
    first, last, step = options.amplitudes_from, options.to, options.step
    if not (0.0 < first <= last <= 0.05 and (last - first) / 1e4 <= step < float("inf") and step > 0.0):
        raise InputError("wrcore conicity", "--amplitudes-from", "expected 0 < from <= to <= 0.05 m and a step > 0")
    amplitudes = first + step * np.arange(int((last - first) / step + 1e-9) + 1)
    pair = _wheelset_on_track(options)
    curve = conicity_curve(pair, amplitudes, options.roll)
    if curve["equivalent_conicity"].isna().all():
        raise InputError("wrcore conicity", "--to", "expected an amplitude at which the wheelset swings, got none")
    _write_csv(curve, out)
    if table_out:
        shifts = 1e-4 * np.arange(-round(last / 1e-4) - 20, round(last / 1e-4) + 21)
        _write_csv(first_touch(pair, shifts, options.roll), table_out)
    return 0


def _wheelset_on_track(options):
    from wrcore.contact.first_touch import WheelOnRail, WheelsetOnTrack

    wheel = _profile(options, options.wheel, "wheel")
    right_wheel = _profile(options, options.right_wheel, "wheel") if options.right_wheel else wheel
    rail = _profile(options, options.rail, "rail")
    radius = options.rolling_radius
    right = radius if options.right_rolling_radius is None else options.right_rolling_radius
    sides = WheelOnRail(wheel, rail, radius), WheelOnRail(right_wheel, rail, right)
    return WheelsetOnTrack(*sides, options.tape_circle_half_distance, options.gauge)


def _profile(options, spec, kind):
    """A profile of `conicity`; ``--unit`` applies to files, not to names."""
    from wrcore.geometry.standards import named_profile

    if options.unit and os.path.isfile(spec) and Path(spec).suffix.lower() not in (".prw", ".prr"):
        spec = {"points": spec, "unit": options.unit}
    return named_profile(spec, kind, _ratio(options.inclination))


def _ratio(text):
    """A ratio such as 1/40; None where none is given."""
    from wrcore.errors.checked_yaml import parse_ratio

    if text is None:
        return None
    ratio = parse_ratio(text)
    if not abs(ratio) <= 0.2:
        raise InputError("wrcore", "--inclination", f"expected a ratio such as 1/40, within 1/5, got {text!r}")
    return ratio


def _creep(options):
    from wrcore.creep.cases import read_cases, solve_cases
    from wrcore.creep.table import show_progress

    out = _output(options.out)
    frame = solve_cases(read_cases(options.cases), options.model, options.table, progress=show_progress)
    _write_csv(frame, out)
    texts = {"out_of_range": "outside the range of the model's data", "not_converged": "not converged"}
    remarks = [f", {frame.attrs[key]} {text}" for key, text in texts.items() if frame.attrs.get(key)]
    print(f"{len(frame)} cases by the {options.model} model{''.join(remarks)}: {out}")
    return 0


def _table_build(options):
    from wrcore.creep.table import DEFAULT_TOLERANCE, build_table, show_progress, write_table

    out = _output(options.out, HDF5)
    _refuse_others(out, "schema", "wrcore creep table 1")
    tolerance = DEFAULT_TOLERANCE if options.tolerance is None else options.tolerance
    table = build_table(options.nu, options.planes, tolerance, show_progress)
    write_table(out, table)
    return _print_table(table)


def _table_info(options):
    from wrcore.creep.table import load_table

    return _print_table(load_table(options.file))


def _print_table(table):
    from wrcore.creep.table import table_info

    for name, value in table_info(table).items():
        print(f"{name:24s} {value:.6g}" if isinstance(value, float) else f"{name:24s} {value}")
    return 0


def _profiles(options):
    from wrcore.geometry.standards import list_profiles

    rows = list_profiles()
    keys = list(rows[0])
    widths = [
        max(len(str(row[key])) for row in [*rows, dict.fromkeys(keys, "")] + [{k: k for k in keys}]) for key in keys
    ]
    for row in [{k: k for k in keys}, *rows]:
        print("  ".join(str(row[key]).ljust(width) for key, width in zip(keys, widths, strict=True)).rstrip())
    return 0


if __name__ == "__main__":
    sys.exit(main())
