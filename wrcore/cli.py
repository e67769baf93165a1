"""Command line: ``wrcore simulate | contact | creep | table | profiles``.

Exit status 0 only when the result was produced; 2 for bad input, with one line that names the file, the field and
what was expected.
"""

import argparse
import json
import os
import sys
from fractions import Fraction
from pathlib import Path

from wrcore import __version__
from wrcore.errors import InputError


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
        Exit status: 0 done, 2 bad input, 1 a run that did not complete.
    """
    try:
        options = _parser().parse_args(arguments)
        return options.run(options)
    except InputError as error:
        print(f"wrcore: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("wrcore: interrupted", file=sys.stderr)
        return 130


def _parser():
    parser = _Parser(prog="wrcore", description="Wheel-rail contact in railway dynamics.")
    parser.add_argument("--version", action="version", version=f"wrcore {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    _add_simulate(commands)
    _add_contact(commands)
    _add_creep(commands)
    _add_table(commands)
    command = commands.add_parser("profiles", help="list the named wheel and rail profiles")
    command.set_defaults(run=_profiles)
    return parser


def _add_simulate(commands):
    command = commands.add_parser("simulate", help="run a scene")
    command.add_argument("scene", metavar="SCENE.yaml")
    command.add_argument("--set", action="append", default=[], metavar="key.path=value", dest="overrides")
    command.add_argument("--out", metavar="run.h5", help="write the run here")
    command.add_argument("--json", action="store_true", help="end with one line of JSON")
    command.set_defaults(run=_simulate)


def _add_contact(commands):
    command = commands.add_parser("contact", help="static contact of a wheelset in given poses")
    command.add_argument("--poses", required=True, metavar="IN.csv")
    command.add_argument("--wheel", required=True, metavar="NAME|FILE")
    command.add_argument("--rail", required=True, metavar="NAME|FILE")
    command.add_argument("--inclination", default="0", metavar="1/40", help="of a named rail")
    command.add_argument("--gauge", type=float, default=1.435, metavar="m")
    command.add_argument("--rolling-radius", type=float, default=0.46, metavar="m")
    command.add_argument("--tape-circle-half-distance", type=float, default=0.75, metavar="m")
    command.add_argument("--shear-modulus", type=float, default=8.2e10, metavar="Pa")
    command.add_argument("--poisson-ratio", type=float, default=0.28)
    command.add_argument("--detection", choices=("planar", "spatial"), default="spatial")
    command.add_argument("--patch", choices=("maximum", "moment"), default="moment", help="reduction of an overlap")
    command.add_argument("--wheel-load", type=float, required=True, metavar="N")
    command.add_argument("--out", required=True, metavar="OUT.csv")
    command.set_defaults(run=_contact)


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
    build.add_argument("--tolerance", type=float, default=0.01, help="99 %% error as a fraction of mu N")
    build.add_argument("--out", required=True, metavar="FILE")
    build.set_defaults(run=_table_build)
    info = actions.add_parser("info", help="what a table holds and how accurate it is")
    info.add_argument("file")
    info.set_defaults(run=_table_info)


def _positive(value, option):
    if not 0.0 < value < float("inf"):
        raise InputError("wrcore contact", option, f"expected a number above 0, got {value}")
    return value


def _output(path):
    """Refuse an output path that cannot be written before any work starts."""
    folder = Path(path).resolve().parent
    if not folder.is_dir():
        raise InputError("--out", str(path), "expected a file in an existing folder")
    if not os.access(folder, os.W_OK):
        raise InputError("--out", str(path), "expected a folder that can be written to")
    return Path(path)


def _write_csv(frame, path):
    """Write a table to a temporary name and rename it: never half a file."""
    temporary = path.with_name(f"{path.name}.part{os.getpid()}")
    try:
        frame.to_csv(temporary, index=False, float_format="%.12g")
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def _simulate(options):
    from wrcore.scene import load_scene
    from wrcore.simulate import simulate

    out = _output(options.out) if options.out else None
    scene = load_scene(options.scene, options.overrides)
    with _progress(scene.data["integration"]["duration"]) as advance:
        run = simulate(scene, advance)
    if out:
        from wrcore.results import write_run

        write_run(out, run)
    counters = run.counters
    summary = {
        "status": run.status, "reason": run.reason, "simulated_s": counters["simulated_s"],
        "wall_s": counters["wall_s"], "real_time_factor": counters["simulated_s"] / counters["wall_s"],
        "steps": counters["steps"], "rejected": counters["rejected"],
        "rhs_evaluations": counters["rhs_evaluations"], "compile_s": counters["compile_s"],
        "table_out_of_range": counters["table_out_of_range"],
    }  # fmt: skip
    if options.json:
        print(json.dumps(summary))
    else:
        print(
            f"{scene.data['name']}: {run.status}{': ' + run.reason if run.reason else ''}; "
            f"{summary['simulated_s']:g} s in {summary['wall_s']:.3g} s, {summary['real_time_factor']:.3g} times real "
            f"time; {summary['steps']} steps, {summary['rejected']} rejected, {summary['rhs_evaluations']} right-hand "
            f"sides, {summary['table_out_of_range']} creep look-ups out of the table's range"
        )
    return 0 if run.status in ("completed", "derailed") else 1


class _progress:
    """Progress bar over simulated time on a terminal; silent in a log."""

    def __init__(self, duration):
        self.duration = duration

    def __enter__(self):
        from tqdm import tqdm

        self.bar = tqdm(
            total=self.duration,
            unit="s",
            disable=None,
            bar_format="{l_bar}{bar}| {n:.2f}/{total:g} s, {remaining} left",
        )
        return None if self.bar.disable else self._advance

    def _advance(self, t):
        self.bar.update(t - self.bar.n)

    def __exit__(self, *_):
        self.bar.close()


def _contact(options):
    from wrcore.contact.geometry import contact_geometry
    from wrcore.contact.poses import read_poses, solve_poses
    from wrcore.geometry.standards import named_profile
    from wrcore.geometry.track import Track

    out = _output(options.out)
    for option in ("wheel_load", "gauge", "rolling_radius", "tape_circle_half_distance", "shear_modulus"):
        _positive(getattr(options, option), f"--{option.replace('_', '-')}")
    if not 0.0 <= options.poisson_ratio <= 0.5:
        raise InputError("wrcore contact", "--poisson-ratio", f"expected 0 to 0.5, got {options.poisson_ratio}")
    try:
        inclination = float(Fraction(options.inclination))
    except (ValueError, ZeroDivisionError):
        raise InputError(
            "wrcore contact", "--inclination", f"expected a ratio such as 1/40, got {options.inclination!r}"
        ) from None
    poses = read_poses(options.poses)
    wheel = named_profile(options.wheel, "wheel")
    rail = named_profile(options.rail, "rail", inclination)
    geometry = contact_geometry(
        wheel, rail, Track(options.gauge), options.rolling_radius, options.tape_circle_half_distance
    )
    table = solve_poses(
        poses, geometry, options.wheel_load, options.detection, options.patch, options.shear_modulus,
        options.poisson_ratio,
    )  # fmt: skip
    _write_csv(table, out)
    missing = len(set(poses.pose_id) - set(table.pose_id))
    print(f"{len(poses)} poses, {len(table)} patches{f', {missing} poses without contact' if missing else ''}: {out}")
    return 0


def _creep(options):
    from wrcore.creep.cases import read_cases, solve_cases

    out = _output(options.out)
    frame = solve_cases(read_cases(options.cases), options.model, options.table)
    _write_csv(frame, out)
    print(f"{len(frame)} cases by the {options.model} model: {out}")
    return 0


def _table_build(options):
    from wrcore.creep.table import build_table, table_info

    out = _output(options.out)
    build_table(out, options.nu, options.planes, options.tolerance)
    print(table_info(out))
    return 0


def _table_info(options):
    from wrcore.creep.table import table_info

    print(table_info(options.file))
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
