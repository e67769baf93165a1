"""Errors and computing time of creep laws and creep tables, relative to CONTACT and to the exact solver.

All quantities are nondimensional (see `wrcore.creep.laws`): creepages xi', eta', phi', forces over mu N, moments over
mu N c, c = sqrt(a b). A force error is the length of the error vector of (fx, fy), a moment error the absolute error
of mz.
"""

import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wrcore.analysis.creep_curves import law_forces
from wrcore.contact.rolling.ellipse import RollingContact
from wrcore.creep.build import A_OVER_B, PSI_MAX, Resolution, build_data, random_errors
from wrcore.creep.cases import check_cases, nondimensional
from wrcore.creep.laws import creep_forces
from wrcore.creep.table import build_table, table_info
from wrcore.errors import InputError

REFERENCE_FILES = {"ellipse": "ellipse_cases.csv", "sdec": "sdec_cases.csv", "extremes": "kbt_extremes.csv"}
CONTACT_TIMES = "contact_timing.csv"
QUANTILES = {"median": 0.5, "q95": 0.95, "q99": 0.99, "max": 1.0}
ERRORS = {"force": "F", "moment": "M"}
ARGUMENTS, ARGUMENTS_FASTSIM = 50_000, 500
_WARM_UP = Resolution(4, 4, 4, 8, 4, 6)


class ReferenceCases(NamedTuple):
    """Reference cases of one file, nondimensional: names, patches (n,), creepages (n, 3), CONTACT's forces (n, 3)."""

    case_id: np.ndarray
    g: np.ndarray
    psi: np.ndarray
    creepages: np.ndarray
    forces: np.ndarray


def read_reference(folder):
    """Read CONTACT's cases from the `REFERENCE_FILES` in a folder; return them by file.

    Columns are those of ``wrcore creep`` with Fx_N, Fy_N, Mz_Nm. InputError if a file is missing or
    `wrcore.creep.cases.check_cases` rejects a column or value.
    """
    return {name: _read_cases(Path(folder) / file) for name, file in REFERENCE_FILES.items()}


def _read_cases(path):
    import pandas as pd

    try:
        frame = pd.read_csv(path, comment="#")
    except (OSError, ValueError) as error:  # pandas' parser errors are ValueErrors
        raise InputError(path, "", f"expected a CSV file of reference cases ({error})") from error
    g, psi, creepages, c = nondimensional(check_cases(frame, path))
    size = (frame["mu"] * frame["N_N"]).to_numpy()
    forces = np.stack([frame["Fx_N"] / size, frame["Fy_N"] / size, frame["Mz_Nm"] / (size * c)], axis=1)
    return ReferenceCases(frame["case_id"].to_numpy(), g, psi, creepages, forces)


def exact_forces(cases, nu, level):
    """Return forces (n, 3) of `ReferenceCases` from the exact solver at one level of resolution."""
    solved = [
        RollingContact(g, psi, nu, level).solve_many(creepages[None])[0][0]
        for g, psi, creepages in zip(cases.g, cases.psi, cases.creepages, strict=True)
    ]
    return np.array(solved)


def _sizes(difference):
    return np.hypot(difference[:, 0], difference[:, 1]), abs(difference[:, 2])


def error_table(reference, models, nu, levels):
    """Return errors of all laws and of the exact solver in all reference cases, relative to CONTACT and "exact".

    The reference "exact" is the exact solver at the last of the rising ``levels`` of resolution.

    Rows: file x model x reference x case. Columns cases, model, family, against ("CONTACT" or "exact"), case_id,
    force_error, moment_error, out_of_range (number of patches of this file outside the range of the model's data).
    """
    import pandas as pd

    parts = []
    for name, cases in reference.items():
        exact = {level: exact_forces(cases, nu, level) for level in levels}
        found = [(f"exact, level {level}", "exact", forces, 0) for level, forces in exact.items()]
        for model in models:
            found.append((model.name, model.family, *law_forces(model, cases.g, cases.psi, cases.creepages)))
        for model, family, forces, outside in found:
            for against, right in (("CONTACT", cases.forces), ("exact", exact[levels[-1]])):
                force, moment = _sizes(forces - right)
                columns = {"cases": name, "model": model, "family": family, "against": against}
                columns |= {"case_id": cases.case_id, "force_error": force, "moment_error": moment}
                parts.append(pd.DataFrame({**columns, "out_of_range": outside}))
    table = pd.concat(parts, ignore_index=True)
    itself = (table["against"] == "exact") & (table["model"] == f"exact, level {levels[-1]}")
    return table[~itself].reset_index(drop=True)


def random_arguments(count, planes, seed=0):
    """Return random patches and creepages over the range of the tables.

    They are g (n,), psi (n,) (0 for planes "ellipse") and creepages (n, 3).
    """
    rng = np.random.default_rng(seed)
    g = np.exp(rng.uniform(*np.log(A_OVER_B), count))
    psi = rng.uniform(-PSI_MAX, PSI_MAX, count) * (planes == "sdec")
    return g, psi, rng.normal(size=(count, 3)) * np.exp(rng.uniform(-4, 3, count))[:, None]


def time_models(models, cases, nu, levels, passes):
    """Measure CPU seconds per case (s_per_case) of all laws and levels, which run in turn in each pass.

    Laws run over random arguments in a compiled loop, the exact solver over the given cases one by one. A first pass is
    omitted, so that times exclude compilation and loading. The work of an exact case is its operator and one solution
    ("from nothing"), or one solution if the operator of its patch exists ("ready").
    """
    import pandas as pd

    rows = []
    for turn in range(-1, passes):
        kept = []
        for model in models:
            kept.append((model.name, model.family, "ready", _time_law(model)))
        for level in levels:
            operator, solution = _time_exact(cases, nu, level, count=1 if turn < 0 else len(cases.g))
            kept.append((f"exact, level {level}", "exact", "ready", solution))
            kept.append((f"exact, level {level}", "exact", "from nothing", operator + solution))
        rows += [(turn, *row) for row in kept if turn >= 0]
    return pd.DataFrame(rows, columns=["pass", "model", "family", "work", "s_per_case"])


def _time_law(model):
    count = ARGUMENTS_FASTSIM if model.family == "fastsim" else ARGUMENTS
    g, psi, creepages = random_arguments(count, "ellipse" if model.family == "table ellipse" else "sdec")
    forces = np.empty((count, 3))
    start = time.process_time()
    creep_forces(model.law, model.data, g, psi, creepages, forces)
    return (time.process_time() - start) / count


def _time_exact(cases, nu, level, count):
    """Return mean CPU seconds of an operator and of one solution with this operator, over the first ``count`` cases."""
    operator = solution = 0.0
    for i in range(count):
        start = time.process_time()
        patch = RollingContact(cases.g[i], cases.psi[i], nu, level)
        middle = time.process_time()
        patch.solve_many(cases.creepages[i : i + 1])
        operator, solution = operator + middle - start, solution + time.process_time() - middle
    return operator / count, solution / count


def laws_table(errors, costs, tables):
    """Return errors and computing time, one row per file, reference and model.

    ``errors`` are from `error_table`, ``costs`` from `time_models`; creep ``tables`` have name, memory_MB and build_s.
    Columns: force_<quantile> and moment_<quantile> (`QUANTILES`), us_per_case and us_from_nothing (medians over the
    passes), memory_MB and build_s (NaN for models without a table), out_of_range.
    """
    keys = ["cases", "against", "model", "family"]
    grouped = errors.groupby(keys, sort=False)
    columns = {}
    for error in ERRORS:
        for name, share in QUANTILES.items():
            columns[f"{error}_{name}"] = grouped[f"{error}_error"].quantile(share)
    result = errors[keys].drop_duplicates().set_index(keys).assign(**columns)
    result["out_of_range"] = grouped["out_of_range"].first()
    result = result.reset_index()
    medians = 1e6 * costs.groupby(["model", "work"])["s_per_case"].median().unstack()
    result["us_per_case"] = result["model"].map(medians["ready"])
    result["us_from_nothing"] = result["model"].map(medians["from nothing"])
    for column in ("memory_MB", "build_s"):
        result[column] = result["model"].map(tables.set_index("name")[column])
    return result


def laws_markdown(laws):
    """Format the table of `laws_table` as Markdown: errors in per cent, one section per file and reference."""
    names = {f"{error}_{q}": f"{symbol} {q.replace('q', '')}" for error, symbol in ERRORS.items() for q in QUANTILES}
    units = {"us_per_case": "µs", "us_from_nothing": "µs with operator", "memory_MB": "MB", "build_s": "build s"}
    parts = [
        "Errors in % of the friction limit (F: mu N, M: mu N c): median, 95 %, 99 %, largest. Times are CPU times."
    ]
    for (cases, against), rows in laws.groupby(["cases", "against"], sort=False):
        shown = rows.drop(columns=["cases", "against", "family"])
        shown[list(names)] = 100 * shown[list(names)]
        shown = shown.rename(columns={**names, **units, "out_of_range": "out of range"})
        text = shown.astype(object).where(shown.notna(), "").to_markdown(index=False, floatfmt=".3g")
        parts += [f"## {cases} cases against {'the exact solver' if against == 'exact' else against}", text]
    return "\n\n".join(parts) + "\n"


def timed_table(name, nu, planes, tolerance, progress=None):
    """Build a creep table (`wrcore.creep.table.build_table`) and measure the time without compilation.

    Returned are the table and a row with name, build_s (CPU seconds including the check at random points) and all
    entries of `wrcore.creep.table.table_info`.
    """
    random_errors(build_data(nu, planes, _WARM_UP), _WARM_UP.level, patches=1, per_patch=2)
    start = time.process_time()
    table = build_table(nu, planes, tolerance, progress)
    return table, {"name": name, "build_s": time.process_time() - start, **table_info(table)}


def contact_points(folder):
    """Return errors (force_q95) and times (us_per_case) of CONTACT over its resolution, from `CONTACT_TIMES`.

    They were measured on another machine over the first ellipse cases. The program is "CONTACT" (with given Hertz
    pressure, the faster of its two solvers) or "its FASTSIM" (parabolic traction bound).
    """
    import pandas as pd

    frame = pd.read_csv(Path(folder) / CONTACT_TIMES, comment="#")
    programs = {"hertz_pressure_given": "CONTACT", "FASTSIM_3flex_parabolic": "its FASTSIM"}
    parts = []
    for pattern, program in programs.items():
        rows = frame[frame["method"].str.contains(pattern)].sort_values("cpu_s_mean_per_case")
        rows = rows.drop_duplicates("n_across").sort_values("n_across")
        columns = {"n_across": rows["n_across"], "force_q95": rows["err_force_q95"]}
        parts.append(pd.DataFrame({"program": program, **columns, "us_per_case": 1e6 * rows["cpu_s_mean_per_case"]}))
    return pd.concat(parts, ignore_index=True)
