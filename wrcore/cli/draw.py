"""``wrcore draw``: pictures of scenes, runs and worn profiles."""

from pathlib import Path

from wrcore.cli.common.files import output
from wrcore.errors import InputError

ABOUT = """
Draw the vehicle of a scene from the side and from above (.svg or .png), put a stored run in motion (.html, one page
that any browser opens without a network), or show a folder of 'wrcore evolve' over the distance (.svg or .png).
"""

FIGURES = (".svg", ".png")


def add(commands):
    command = commands.add_parser(
        "draw", help="picture of a vehicle, animation of a run, profiles over a distance", description=ABOUT
    )
    command.add_argument("source", metavar="SCENE.yaml|run.h5|FOLDER", help="what to draw")
    command.add_argument("--out", required=True, metavar="FILE", help=".html of a run, else .svg or .png")
    command.add_argument("--scene", metavar="SCENE.yaml", help="of the run, where its files are not found from here")
    command.add_argument(
        "--factor", type=float, metavar="N",
        help="of a run: displacements from above are drawn N times larger (default: a round one that shows them)",
    )  # fmt: skip
    command.add_argument("--begin", type=float, default=0.0, metavar="s", help="of a run: shown from here on, s")
    command.add_argument("--end", type=float, default=float("inf"), metavar="s", help="of a run: shown up to here, s")
    command.add_argument(
        "--trust", action="store_true",
        help="of a run: import the installed packages that it names for its kinds of elements (default: no)",
    )  # fmt: skip
    command.set_defaults(run=run)


def run(options):
    of_run = Path(options.source).suffix.lower() in (".h5", ".hdf5")
    out = output(options.out, (".html",) if of_run else FIGURES)
    from wrcore.analysis.pictures.animation import Animation
    from wrcore.analysis.pictures.draw import draw
    from wrcore.analysis.pictures.style import save_figure

    try:
        drawn = draw(options.source, options.scene, options.factor, options.begin, options.end, options.trust)
    except InputError as error:
        if error.source != "draw":
            raise
        raise InputError("wrcore draw", f"--{error.field}", error.expected) from None
    if isinstance(drawn, Animation):
        drawn.write(out)
    else:
        save_figure(drawn, out)
    return 0
