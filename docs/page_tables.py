"""Tables of pages that are made from the study's tables; `docs.quoted` writes and compares them."""

from collections.abc import Callable
from typing import NamedTuple

from wrcore.run.accuracy import measured_front


def front_markdown(front=None, accuracies=(1e-4, 1e-5, 1e-6, 1e-7)):
    """Return a Markdown table of the fastest measured choice for each accuracy (RMS error of y, m).

    ``front`` is the package's measured front by default. Accuracies that no choice reaches have no row, nor have
    accuracies with the same choice as the next smaller accuracy.
    """
    front = measured_front() if front is None else front
    head = ("scene", "error below", "detection, creep, method, rtol", "error", "of N", "times real time")
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for (kind, speed), rows in front.groupby(["kind", "speed_m_per_s"], sort=False):
        last = None
        for accuracy in sorted(accuracies):
            enough = rows[rows["y_rms_m"] <= accuracy]
            if not len(enough):
                continue
            row = enough.loc[enough["real_time_factor"].idxmax()]
            line = (
                f"{row['detection']}, {row['creep']}, {row['method']}, {row['rtol']:g} |"
                f" {1e6 * row['y_rms_m']:.2g} µm | {100 * row['N_rms_relative']:.2g} % |"
                f" {row['real_time_factor']:.3g} |"
            )
            scene = f"| {kind.replace('_', ' ')}, {speed:g} m/s | {1e6 * accuracy:g} µm | "
            if line != last:
                lines.append(scene + line)
            last = line
    return "\n".join(lines)


class PageTable(NamedTuple):
    """A table in Markdown that is made from tables of the study."""

    reads: tuple
    """Paths of the tables that are read, below the results."""
    make: Callable
    """Function that returns the table in Markdown; its argument is a function that loads a table by its path."""
    within: dict
    """Accepted relative deviation of columns that depend on the machine, by their heads."""
    chosen: bool = False
    """Whether rows are chosen by measured time, so that another machine may choose other rows."""


def markdown(heads, rows):
    """Return a table in Markdown from heads and rows of texts."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def short(number, digits=2):
    """Return a number as text with the given number of significant digits, without an exponent."""
    rounded = float(f"{number:.{digits}g}")
    return f"{rounded:.10f}".rstrip("0").rstrip(".")


def requests_table(load):
    """Return the table of requested accuracies, from `study.accuracy.requests.summary`."""
    heads = ["of", "asked", "can be judged", "reached", "missed", "worst error over asked",
             "evaluations of all runs over the last's, median and largest"]  # fmt: skip
    rows = []
    for row in load("accuracy/requests_summary.csv").itertuples():
        asked = f"{short(1e6 * row.asked)} µm" if row.of == "y" else f"{short(row.asked)} N"
        counts = [str(row.trusted), str(row.reached), str(row.missed)]
        rows.append([row.of, asked, *counts, short(row.worst_ratio), f"{row.cost_median:.2g}, {row.cost_largest:.2g}"])
    return markdown(heads, rows)


TIMED = {
    "wheelset_v20": "free wheelset, 20 m/s, 10 s",
    "wheelset_v20, first 0.5 s": "its first 0.5 s, before flanges strike",
    "suspended_v60": "suspended wheelset, 60 m/s, 10 s",
}
"""Names on the page of the cases of `study.paper.tables.timing_table`."""


def timing_pairs(load):
    """Return the table of the ratios planar / spatial of timed pairs: median, minimum and maximum."""
    heads = ["case", "pairs", "time of a run", "time of one evaluation", "number of evaluations"]
    table, rows = load("paper/timing.csv"), []
    for row in table[table["detection"] == "spatial"].to_dict("records"):
        ratios = [
            f"{row[f'ratio_{name}']:.2f} ({row[f'ratio_{name}_least']:.2f} to {row[f'ratio_{name}_largest']:.2f})"
            for name in ("per_run", "per_call", "of_calls")
        ]
        rows.append([TIMED.get(row["case"], row["case"]), str(row["runs"]), *ratios])
    return markdown(heads, rows)


MODELS = ("moment", "tabulated", "exact, coarser")
LONG = {
    "suspended wheelset, 20 m/s": "suspended wheelset, 20 m/s",
    "suspended wheelset, 60 m/s": "the same at 60 m/s, hunting",
    "free wheelset, 20 m/s, up to 0.8 s": "free wheelset, on its flanges",
    "trailer vehicle, 60 m/s, irregular track": "trailer vehicle, rough track, 60 m/s",
}
"""Names on the page of the scenes with exact contact in the study of accuracy."""


def model_errors(load):
    """Return the table of errors relative to exact contact, of ellipses, interpolation and coarser resolution."""
    heads = ["scene", "y, µm: `moment`", "`tabulated`", "`exact`, coarser", "N, %: `moment`", "`tabulated` (N)",
             "`exact`, coarser (N)", "wear number, %: `moment`", "`tabulated` (wear)",
             "`exact`, coarser (wear)"]  # fmt: skip
    table, rows = load("accuracy/models.csv"), []
    finest = table["creep"].isin(["exact", "table 0.003", "table 0.005"]) & (table["detection"] == "spatial")
    for title, name in LONG.items():
        part = table[finest & (table["scene"] == title)].drop_duplicates("patch").set_index("patch")
        if not len(part):
            continue
        cells = [
            short(factor * part.loc[patch, f"model_{column}"]) if patch in part.index else ""
            for column, factor in (("y_rms_m", 1e6), ("N_rms_relative", 100.0), ("T_gamma_relative", 100.0))
            for patch in MODELS
        ]
        rows.append([name, *cells])
    return markdown(heads, rows)


POSE_MODELS = ["maximum", "moment", "exact, coarse", "exact, middle", "exact, looked up"]
POSE_ERRORS = ["normal force at equal height", "greatest pressure under equal load", "creep force at equal creepage",
               "creep force at equal motion"]  # fmt: skip


def pose_errors(load):
    """Return the table of median, 95 % and maximum error of each patch model at single positions, and patch times."""
    table, costs = load("patch/summary.csv"), load("patch/costs.csv").set_index("model")
    table = table[table["zone"] == "everywhere"].set_index(["quantity", "model"])
    rows = []
    for quantity in POSE_ERRORS:
        cells = [
            " / ".join(short(table.loc[(quantity, model), part]) for part in ("median", "q95", "worst"))
            for model in POSE_MODELS
        ]
        rows.append([f"{quantity}, {table.loc[(quantity, POSE_MODELS[0]), 'unit']}", *cells])
    times = [short(costs.loc[model, "us_per_patch"]) if model in costs.index else "" for model in POSE_MODELS]
    return markdown(["everywhere", *POSE_MODELS], [*rows, ["time per patch without a start, µs", *times]])


RUN_MODELS = ["maximum", "moment", "exact", "looked_up"]


def vehicle_models(vehicle, title):
    """Return a function that makes the table of one vehicle with each patch model."""

    def make(load):
        table = load("patch/models.csv")
        part = table[table["vehicle"] == vehicle].set_index("model")
        speeds = f"limit cycle at {part['cycle_speed_m_per_s'].iloc[0]:.0f} m/s, mm"
        shown = {speeds: ("cycle_amplitude_m", 1e3), "irregular track: greatest Q, kN": ("Q_max_N", 1e-3),
                 "greatest Y, kN": ("Y_max_N", 1e-3), "mean wear number, N": ("T_gamma_mean_N", 1.0)}  # fmt: skip
        rows = [
            [name, *(short(factor * part.loc[model, column], 3) if model in part.index else "" for model in RUN_MODELS)]
            for name, (column, factor) in shown.items()
        ]
        return markdown([title, "maximum", "moment", "exact", "tabulated"], rows)

    return make


VARIANTS = {
    "finest": "the finest",
    "default": "the default: 0.05 mm, one seed, 50 1/s, 3 mm",
    "twice the wear step": "0.1 mm",
    "twice the scenes": "twice the scenes",
    "four times the output rate": "200 1/s",
    "smoothing 1 mm": "smoothing 1 mm",
    "wear in proportion to energy": "law `energy`",
    "maximum instead of moment": "`maximum` instead of `moment`",
}


def wear_influences(load):
    """Return the table of settings and models of a wear plan, compared with the finest one."""
    heads = ["variant", "largest deviation of the depth, % of the deepest", "worn area, %", "conicity (3 mm)", "CPU, s"]
    rows = []
    for row in load("wear/influences.csv").itertuples():
        deviations = [short(100.0 * row.depth_deviation), f"{100.0 * row.area_deviation:+.1f}"]
        name = VARIANTS.get(row.variant, row.variant)
        rows.append([name, *deviations, f"{row.equivalent_conicity:.3f}", short(row.cpu_s)])
    return markdown(heads, rows)


def crossing_models(load):
    """Return the table of patch models on the nose of a crossing, compared with exact contact."""
    table = load("crossings/models.csv")
    heads = ["patch, detection", "height, µm", "half the load on the nose, mm later", "greatest pressure, %",
             "time of a place over that of `exact`"]  # fmt: skip
    rows = []
    for row in table.iloc[1:].itertuples():
        time = row.cpu_s / table["cpu_s"].iloc[0]
        cells = (1e6 * row.height_largest_m, 1e3 * row.goes_over_later_m, 100.0 * row.p_max_worst)
        rows.append([row.model, *map(short, cells), f"{time:.1f}"])
    return markdown(heads, rows)


TIME = 0.5
"""Accepted relative deviation of times, which vary with the machine and its load."""

FRONT = "accuracy/accuracy_front.csv"

TABLES = {
    "front": PageTable((FRONT,), lambda load: front_markdown(load(FRONT)),
                       {"times real time": TIME}, chosen=True),
    "requests": PageTable(("accuracy/requests_summary.csv",), requests_table,
                          {"worst error over asked": TIME,
                           "evaluations of all runs over the last's, median and largest": 0.2}),
    "timing": PageTable(("paper/timing.csv",), timing_pairs,
                        {"time of a run": 0.3, "time of one evaluation": 0.15, "number of evaluations": 0.3}),
    "models": PageTable(("accuracy/models.csv",), model_errors, {}),
    "poses": PageTable(("patch/summary.csv", "patch/costs.csv"), pose_errors, dict.fromkeys(POSE_MODELS, 0.1)),
    "wheelset_models": PageTable(("patch/models.csv",), vehicle_models("suspended_wheelset", "suspended wheelset"),
                                 {"maximum": 0.2}),
    "vehicle_models": PageTable(("patch/models.csv",), vehicle_models("trailer_vehicle", "trailer vehicle"),
                                {"maximum": 0.2}),
    "influences": PageTable(("wear/influences.csv",), wear_influences, {"CPU, s": TIME}),
    "crossings": PageTable(("crossings/models.csv",), crossing_models,
                           {"time of a place over that of `exact`": TIME}),
}  # fmt: skip
"""Tables of pages by the name used in ``reports/quoted.yaml``."""
