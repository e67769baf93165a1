"""What each creep model costs and errs: ``python bench/creep.py [--quick]``.

Errors are against CONTACT's extrapolated reference cases (tests/data/creep). Costs are CPU time of one process per
case, amortised over a file, compilation excluded; the models take turns case by case (exact) or round by round (laws),
so that a busy machine disturbs all of them alike. Set OPENBLAS_NUM_THREADS=1 for one core.
"""

import argparse
import time
from pathlib import Path

import numpy as np
import pandas as pd

from wrcore.creep.build import RESOLUTIONS, build_data, count_cases, random_errors
from wrcore.creep.cases import check_cases, nondimensional
from wrcore.creep.halfspace import RollingContact
from wrcore.creep.laws import LAWS, creep_data, creep_forces

DATA = Path(__file__).parent.parent / "tests" / "data" / "creep"
FILES = {"ellipse": "ellipse_cases", "sdec": "sdec_cases", "extremes": "kbt_extremes"}
LEVELS = (8, 10, 12, 16, 20, 22, 24)
ROUNDS = 5
NU = 0.28


def read_cases(name):
    """Axis ratio, shape number, creepages and reference forces of one file, nondimensional."""
    frame = pd.read_csv(DATA / f"{FILES[name]}.csv", comment="#")
    g, psi, creepages, c = nondimensional(check_cases(frame))
    size = (frame.mu * frame.N_N).to_numpy()
    return g, psi, creepages, np.stack([frame.Fx_N / size, frame.Fy_N / size, frame.Mz_Nm / (size * c)], axis=1)


def error_columns(forces, reference):
    """Mean, median, 95 %, 99 %, max of the force error and 95 %, max of the moment error, in per cent."""
    difference = 100 * (forces - reference)
    force, moment = np.hypot(difference[:, 0], difference[:, 1]), abs(difference[:, 2])
    return [force.mean(), *np.percentile(force, [50, 95, 99]), force.max(), np.percentile(moment, 95), moment.max()]


def time_exact(g, psi, creepages, levels):
    """Forces and seconds (operator, one solution) per case and level; the levels take turns on each case."""
    forces = np.empty((len(levels), len(g), 3))
    seconds = np.empty((len(levels), len(g), 2))
    for i in range(len(g)):
        for k, level in enumerate(levels):
            start = time.process_time()
            patch = RollingContact(g[i], psi[i], NU, level)
            seconds[k, i, 0] = time.process_time() - start
            patch.solve_many(creepages[i : i + 1])
            start = time.process_time()
            forces[k, i] = patch.solve_many(creepages[i : i + 1])[0][0]
            seconds[k, i, 1] = time.process_time() - start
    return forces, seconds


def time_laws(g, psi, creepages, laws):
    """Forces and best seconds per case of each (law, data); the laws take turns, several rounds."""
    forces, seconds = np.empty((len(laws), len(g), 3)), np.full(len(laws), np.inf)
    repeat = [2 if law == LAWS["fastsim"] else 200 for law, _ in laws]
    for turn in range(ROUNDS + 1):
        for k, (law, data) in enumerate(laws):
            start = time.process_time()
            for _ in range(repeat[k]):
                creep_forces(law, data, g, psi, creepages, forces[k])
            if turn > 0:
                seconds[k] = min(seconds[k], (time.process_time() - start) / repeat[k] / len(g))
    return forces, seconds


def report_file(name, tables, levels):
    """Print accuracy and cost of all models on one file."""
    g, psi, creepages, reference = read_cases(name)
    print(f"\n{name}: {len(g)} cases; errors in % of mu N (mu N c); ms per case: ready / with operator")
    print(f"{'model':30s}{'mean':>7s}{'median':>8s}{'95 %':>7s}{'99 %':>7s}{'max':>8s} |{'Mz 95':>7s}{'max':>8s} | ms")
    forces, seconds = time_exact(g, psi, creepages, levels)
    for k, level in enumerate(levels):
        operator, solution = 1e3 * seconds[k].mean(axis=0)
        print_row(f"exact, level {level}", error_columns(forces[k], reference), solution, operator + solution)
    laws = [(f"table {label}", LAWS["table"], creep_data(NU, data)) for label, data in tables]
    laws += [(f"FASTSIM {grid} x {grid}", LAWS["fastsim"], creep_data(NU, grid=grid)) for grid in (10, 20, 40)]
    laws += [(law, LAWS[law], creep_data(NU)) for law in ("polach", "she", "linear")]
    forces, seconds = time_laws(g, psi, creepages, [law[1:] for law in laws])
    for k, law in enumerate(laws):
        print_row(law[0], error_columns(forces[k], reference), 1e3 * seconds[k])
    if name == "ellipse":
        report_contact()


def print_row(label, errors, *costs):
    """One aligned row."""
    mean, median, q95, q99, largest, moment, worst = errors
    text = f"{label:30s}{mean:7.3f}{median:8.3f}{q95:7.3f}{q99:7.3f}{largest:8.3f} |{moment:7.3f}{worst:8.3f} | "
    print(text + " / ".join(f"{cost:.3g}" for cost in costs), flush=True)


def report_contact():
    """CONTACT's own points: the faster of its two solvers, and its FASTSIM."""
    rows = pd.read_csv(DATA / "contact_timing.csv", comment="#")
    for row in rows[rows.method.str.contains("pressure_given|parabolic")].itertuples():
        print(f"{row.method[:24]:25s}{row.n_across:3d}^2 {100 * row.err_force_mean:6.3f}        "
              f"{100 * row.err_force_q95:7.3f}       {100 * row.err_force_max:8.3f} |       "
              f"{100 * row.err_mz_max:8.3f} | {1e3 * row.cpu_s_mean_per_case:.3g}")  # fmt: skip


def report_tables(choices):
    """Build tables and print cost, size, error at random cases and the time of one look-up; returns the tables."""
    print(f"{'table':24s}{'cases':>8s}{'build s':>9s}{'MB':>7s}{'ns':>6s}   random: F median, 95, 99 %, max; Mz 99 %")
    built = []
    for planes, index in choices:
        resolution = RESOLUTIONS[planes][index][1]
        start = time.process_time()
        data = build_data(NU, planes, resolution)
        seconds = time.process_time() - start
        force, moment = random_errors(data, max(20, resolution.level))
        label = f"{planes} {index}"
        errors = " ".join(f"{100 * value:.3f}" for value in (*np.percentile(force, [50, 95, 99]), force.max()))
        print(f"{label:24s}{count_cases(data.axes):8d}{seconds:9.2f}{data.coefficients.nbytes / 1e6:7.2f}"
              f"{time_look_up(data):6.0f}   {errors}; {100 * np.percentile(moment, 99):.3f}", flush=True)  # fmt: skip
        built.append((label, data))
    return built


def time_look_up(table, count=100_000):
    """Nanoseconds of one look-up of all three outputs at random arguments all over the table."""
    rng, axes = np.random.default_rng(0), table.axes
    g = np.exp(rng.uniform(axes.log_g_min, axes.log_g_max, count))
    psi = rng.uniform(-axes.psi_max, axes.psi_max, count)
    creepages = rng.normal(size=(count, 3)) * np.exp(rng.uniform(-4, 3, count))[:, None]
    data, forces, best = creep_data(NU, table), np.empty((count, 3)), np.inf
    for _ in range(ROUNDS):
        start = time.process_time()
        creep_forces(LAWS["table"], data, g, psi, creepages, forces)
        best = min(best, time.process_time() - start)
    return 1e9 * best / count


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="two levels, two tables")
    quick = parser.parse_args().quick
    RollingContact(1.0, 0.0, NU, 6).solve(0.1, 0.1, 0.1)
    choices = [("ellipse", 1), ("sdec", 1)] if quick else [(p, i) for p in RESOLUTIONS for i in range(4)]
    tables = report_tables(choices)
    for name in FILES:
        report_file(name, tables, (10, 20) if quick else LEVELS)


if __name__ == "__main__":
    main()
