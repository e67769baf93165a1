"""What one creep table errs over its range, and how smooth it is along lines of creepage.

Units as in `study.creep.laws`: nondimensional creepages and forces.
"""

import numpy as np

from study.creep.laws import law_forces
from wrcore.contact.rolling.ellipse import RollingContact
from wrcore.creep.axes import creepages_at, scales
from wrcore.creep.kalker import coefficients_at

SIZES, DIRECTIONS = 16, 10
"""Sizes of creepage and spin directions for each patch of the error map."""

SIZE_RANGE = (0.01, 100.0)
NEAR_POLE = 1e-3
"""Distance xi'/phi' (and eta'/phi') at which the smoothness lines pass the spin axis."""

SPAN = 4
"""Points over which a jump of the slope is sought: more than the three that a central difference takes."""

_TIGHT = 1e-5


def _stratified(low, high, count, rng):
    """One uniform draw from each of ``count`` equal parts of an interval."""
    return low + (high - low) * (np.arange(count) + rng.uniform(size=count)) / count


def sized_creepages(g, size, alpha, beta, kalker):
    """Creepages (..., 3) of a size r and a direction (alpha, beta) as `wrcore.creep.axes` defines them; without spin
    the linear force is 3 r mu N, so that full slip comes near r = 1.
    """
    c11, c22, c23, _ = coefficients_at(np.log(g), kalker)
    rate = scales(g, c11, c22, c23)[-1]
    return creepages_at(g, rate * size / (1 + rate * size), alpha, beta, kalker)


def error_map(model, patches, level, seed=0):
    """Error of a table against the exact solver all over its range, at one random patch from each pair of parts of the
    range of ln(a/b) and of abs(psi): a_over_b, psi, size, alpha, beta, force_error, moment_error.
    """
    import pandas as pd

    rng, (axes, kalker, _), parts = np.random.default_rng(seed), model.data.table, []
    for _ in range(patches[1]):
        psis = _stratified(0.0, axes.psi_max, patches[0], rng)
        rng.shuffle(psis)
        for log_g, psi in zip(_stratified(axes.log_g_min, axes.log_g_max, patches[0], rng), psis, strict=True):
            size = np.exp(_stratified(*np.log(SIZE_RANGE), SIZES, rng))[:, None] + np.zeros(DIRECTIONS)
            beta = _stratified(0.0, np.pi / 2, DIRECTIONS, rng) + np.zeros((SIZES, 1))
            alpha = rng.uniform(-np.pi, np.pi, beta.shape)
            creepages = sized_creepages(np.exp(log_g), size, alpha, beta, kalker).reshape(-1, 3)
            error = law_forces(model, np.exp(log_g), psi, creepages)[0]
            error -= RollingContact(np.exp(log_g), psi, kalker.nu, level).solve_many(creepages)[0]
            columns = {"a_over_b": np.exp(log_g), "psi": psi, "size": size.ravel(), "alpha": alpha.ravel()}
            columns |= {"beta": beta.ravel(), "force_error": np.hypot(error[:, 0], error[:, 1])}
            parts.append(pd.DataFrame({**columns, "moment_error": abs(error[:, 2])}))
    return pd.concat(parts, ignore_index=True)


def smooth_lines(axes):
    """Lines through a table by name: a function of x (n,) that gives g, psi (n,), creepages (n, 3), and the reach of x.

    "cells" crosses cells in all inputs at once; "axis" passes the spin axis, the pole of the table's polar inputs, at
    `NEAR_POLE`; "zero" runs through zero creepage.
    """

    def cells(x):
        creepages = np.stack([-0.05 + 0.25 * x, 0.12 + 0.2 * x, 0.35 + 0.5 * x], axis=-1)
        return np.exp(0.2 + 0.8 * x), (0.3 + 0.25 * x) * (axes.psi_max > 0), creepages

    def axis(x):
        return 1.3 + 0 * x, 0 * x, np.stack([x, NEAR_POLE + 0 * x, 1 + 0 * x], axis=-1)

    def zero(x):
        return 1.3 + 0 * x, 0 * x, np.stack([0.3 * x, 0.2 * x, 0.3 * x], axis=-1)

    return {"cells": (cells, 1.0), "axis": (axis, 0.005), "zero": (zero, 1.0)}


def smoothness(model, level, points, exact_points):
    """Forces and slopes of a table along `smooth_lines` and, on one of them, where it bends most, a hundredfold
    ("border"), with the exact solver at fewer points: line, source ("table", "exact"), x, fx, fy, mz, and slopes dfx,
    dfy, dmz (central differences along x). ``points`` is odd.
    """
    import pandas as pd

    (axes, kalker, _), parts = model.data.table, []
    lines = smooth_lines(axes)
    for name, (line, reach) in lines.items():
        x = np.linspace(-reach, reach, points)
        parts.append(_along(name, "table", x, law_forces(model, *line(x))[0]))
        few = np.linspace(-reach, reach, exact_points)
        parts.append(_along(name, "exact", few, _exact_along(line(few), kalker.nu, level)))
    cells, reach = lines["cells"]
    bend = np.linalg.norm(np.diff(parts[0][["fx", "fy", "mz"]], n=3, axis=0), axis=1)
    centre = parts[0]["x"][1 + int(np.argmax(bend))] + reach / points
    x = centre + np.linspace(-0.01, 0.01, points) * reach
    parts.append(_along("border", "table", x, law_forces(model, *cells(x))[0]))
    return pd.concat(parts, ignore_index=True)


def _along(line, source, x, forces):
    import pandas as pd

    slopes = np.gradient(forces, x, axis=0)
    numbers = pd.DataFrame(
        np.hstack([x[:, None], forces, slopes]), columns=["x", "fx", "fy", "mz", "dfx", "dfy", "dmz"]
    )
    return numbers.assign(line=line, source=source)


def _exact_along(places, nu, level):
    """Exact forces along a line; patches that follow each other unchanged share their operator."""
    g, psi, creepages = places
    if np.ptp(g) == 0 and np.ptp(psi) == 0:
        return RollingContact(g[0], psi[0], nu, level).solve_many(creepages, _TIGHT)[0]
    solved = [
        RollingContact(g[i], psi[i], nu, level).solve_many(creepages[i : i + 1], _TIGHT)[0] for i in range(len(g))
    ]
    return np.concatenate(solved)


def smoothness_table(lines):
    """How much the slopes vary along each line of `smoothness`, and whether they jump, a row per line, source and
    output.

    Columns: slope (largest size), variation (largest minus smallest slope over the largest size) and, for the table,
    step (largest change of the slope over `SPAN` points over the same) and step_ratio: that step over the one of twice
    the span. A slope without jumps gives 0.5, a jump gives 1.
    """
    import pandas as pd

    rows = []
    for (line, source), part in lines.groupby(["line", "source"], sort=False):
        for output in ("fx", "fy", "mz"):
            slope = part.sort_values("x")[f"d{output}"].to_numpy()[1:-1]
            step, double = (abs(slope[span:] - slope[:-span]).max() for span in (SPAN, 2 * SPAN))
            size = abs(slope).max()
            steps = (step / size, step / double) if source == "table" else (np.nan, np.nan)
            rows.append((line, source, output, size, np.ptp(slope) / size, *steps))
    return pd.DataFrame(rows, columns=["line", "source", "output", "slope", "variation", "step", "step_ratio"])
