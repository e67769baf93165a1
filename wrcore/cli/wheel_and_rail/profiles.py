"""``wrcore profiles``: list named profiles, or describe a file of points."""

from wrcore.cli.common.files import output
from wrcore.cli.common.options import profile_of, profile_spec
from wrcore.errors import InputError

ABOUT = """
Without a file: list the named profiles: name, kind, sections from the flange or the crown, source.
With one: read it and say what was read, turned and left out, and what shape it is.
"""

EPILOG = """
A FILE may stand in a mapping with keys of how to read it:
  wrcore profiles "{points: left.whl, tape_circle: 0.0722}"
"""


def add(commands):
    command = commands.add_parser(
        "profiles", help="list the named profiles, or show what a file holds", description=ABOUT, epilog=EPILOG
    )
    command.add_argument("file", nargs="?", metavar="FILE", help="of points: CSV, SIMPACK, MiniProf, Vampire")
    command.add_argument("--kind", choices=("wheel", "rail"), help="of a file whose ending does not say it")
    command.add_argument("--unit", choices=("m", "mm", "inch", "cm", "um"), help="of files that do not state it")
    command.add_argument("--smoothing", type=float, metavar="m", help="noise of the points to even out, m")
    command.add_argument("--inclination", metavar="1/40", help="of a rail whose points are upright (inclined: false)")
    command.add_argument("--out", metavar="FILE", help="picture of it, .svg or .png")
    command.set_defaults(run=run)


def run(options):
    return _show(options) if options.file else _list()


def _list():
    from wrcore.geometry.profiles.standards import list_profiles

    rows = list_profiles()
    rows.insert(0, {key: key for key in rows[0]})
    widths = [max(len(str(row[key])) for row in rows) for key in rows[0]]
    for row in rows:
        print("  ".join(str(cell).ljust(width) for cell, width in zip(row.values(), widths, strict=True)).rstrip())
    return 0


def _show(options):
    from wrcore.geometry.profiles.files import kind_of

    out = output(options.out, (".svg", ".png")) if options.out else None
    spec = profile_spec(options, options.file)
    kind = options.kind or kind_of(spec["points"] if isinstance(spec, dict) else spec)
    if kind is None:
        raise InputError("wrcore profiles", "--kind", f"expected wheel or rail, as {options.file} does not say it")
    curve = profile_of(options, options.file, kind)
    print(curve.source)
    ends = f"{kind}, u from {1e3 * curve.u[0]:.2f} to {1e3 * curve.u[-1]:.2f} mm, {curve.u.size} nodes"
    if kind == "wheel":
        print(f"{ends}; flange {-1e3 * curve.f.min():.2f} mm high, slope at the tape circle {curve(0.0, 1):.4f}")
    elif curve.gauge_offset_m == curve.gauge_offset_m:
        print(f"{ends}; gauge point, down to 14 mm, {1e3 * curve.gauge_offset_m:.2f} mm inside the highest point")
    else:
        print(f"{ends}; it ends above the 14 mm down to which the gauge is measured")
    if out:
        from wrcore.analysis.pictures.plot_profile import plot_profile
        from wrcore.analysis.pictures.style import save_figure

        save_figure(plot_profile(curve), out)
    return 0
