"""``wrcore creep``: creep forces of given cases."""

from argparse import ArgumentTypeError

from wrcore.cli.common.files import output, write_csv
from wrcore.cli.common.options import as_runs, columns
from wrcore.errors import one_of

ABOUT = """
Creep forces of the cases in IN.csv, on elliptic patches and on double ellipses. In Python: wr.creep_force.
"""

CASES = columns(
    "IN.csv, a row per case",
    case_id="any text",
    a_m="semi-axis along rolling",
    b_neg_m="semi-axis across rolling, on the side of negative y",
    b_pos_m="the same on the other side; equal: an ellipse",
    N_N="normal force",
    mu="friction coefficient",
    G_Pa="shear modulus",
    nu="Poisson's ratio",
    **as_runs("xi", "eta", "phi_per_m"),
)

FILES = columns("OUT.csv, a row per case", case_id="of its case", **as_runs("Fx_N", "Fy_N", "Mz_Nm"))


def _law(name):
    """Return the name of a creep law; an unknown name is an error of the parser."""
    from wrcore.creep.cases import MODELS

    if name not in MODELS:
        raise ArgumentTypeError(one_of(MODELS, name))
    return name


def add(commands):
    command = commands.add_parser(
        "creep", help="creep forces of given cases", description=ABOUT, epilog=f"{CASES}\n\n{FILES}"
    )
    command.add_argument("--cases", required=True, metavar="IN.csv", help="a case per row")
    command.add_argument(
        "--model", default="table", metavar="NAME", type=_law,
        help="a creep law as in a scene: a table of exact solutions or a formula; or exact, rolling contact itself",
    )  # fmt: skip
    command.add_argument("--table", metavar="FILE", help="creep table; left out, one is built or found in the cache")
    command.add_argument("--out", required=True, metavar="OUT.csv", help="a row per case")
    command.set_defaults(run=run)


def run(options):
    from wrcore.creep.cases import read_cases, solve_cases
    from wrcore.creep.table import show_progress

    out = output(options.out)
    frame = solve_cases(read_cases(options.cases), options.model, options.table, progress=show_progress)
    write_csv(frame, out)
    texts = {"out_of_range": "outside the range of the model's data", "not_converged": "not converged"}
    remarks = [f", {frame.attrs[key]} {text}" for key, text in texts.items() if frame.attrs.get(key)]
    print(f"{len(frame)} cases by the {options.model} model{''.join(remarks)}: {out}")
    return 0
