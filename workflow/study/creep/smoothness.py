"""Errors of a creep table over its range, and smoothness of its forces along lines of creepage.

Units are those of `study.creep.laws`: nondimensional creepages and forces.
"""

import numpy as np

from wrcore.analysis.creep_curves import law_forces
from wrcore.contact.rolling.ellipse import RollingContact
from wrcore.creep.axes import creepages_at, scales
from wrcore.creep.kalker import coefficients_at

SIZES, DIRECTIONS = 16, 10
"""Number of creepage sizes and number of spin directions for each patch of the error map."""

SIZE_RANGE = (0.01, 100.0)
NEAR_POLE = 1e-3
"""Distance xi'/phi' (and eta'/phi') at which the smoothness lines pass the spin axis."""

SPAN = 4
"""Number of points between compared slopes; larger than the three points of a central difference."""

_TIGHT = 1e-5


def _stratified(low, high, count, rng):
    """Return one uniform random number from each of ``count`` equal parts of an interval."""
    return low + (high - low) * (np.arange(count) + rng.uniform(size=count)) / count


def sized_creepages(g, size, alpha, beta, kalker):
    """Return creepages (..., 3) of a size r and a direction (alpha, beta) as defined in `wrcore.creep.axes`.

    Without spin the linear force is 3 r mu N, so that full slip begins near r = 1.
    """
    c11, c22, c23, _ = coefficients_at(np.log(g), kalker)
    rate = scales(g, c11, c22, c23)[-1]
    return creepages_at(g, rate * size / (1 + rate * size), alpha, beta, kalker)


def error_map(model, patches, level, seed=0):
    """Compute errors of a table relative to the exact solver over its range, at stratified random patches.

    The ranges of ln(a/b) and of abs(psi) are divided into ``patches[0]`` parts, each with one random value; this is
    repeated ``patches[1]`` times. Columns: a_over_b, psi, size, alpha, beta, force_error, moment_error.
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
    """Return lines through a table by name: a function of x (n,) and the maximum of abs(x).

    The functions return g, psi (n,) and creepages (n, 3). "cells" crosses cells in all inputs at once; "axis" passes
    the spin axis, the pole of the table's polar inputs, at the distance `NEAR_POLE`; "zero" contains zero creepage.
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
    """Compute forces and slopes of a table along `smooth_lines`, and of the exact solver at fewer points.

    The line "border" is the part of "cells" with the sharpest bend at 100 times the resolution. Columns: line, source
    ("table", "exact"), x, fx, fy, mz, and slopes dfx, dfy, dmz (central differences along x). ``points`` is odd.
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
    """Return exact forces along a line; a line with constant patch shape uses a single operator."""
    g, psi, creepages = places
    if np.ptp(g) == 0 and np.ptp(psi) == 0:
        return RollingContact(g[0], psi[0], nu, level).solve_many(creepages, _TIGHT)[0]
    solved = [
        RollingContact(g[i], psi[i], nu, level).solve_many(creepages[i : i + 1], _TIGHT)[0] for i in range(len(g))
    ]
    return np.concatenate(solved)


def smoothness_table(lines):
    """Return measures of variation and jumps of the slopes of `smoothness`, a row per line, source and output.

    Columns: slope (maximum absolute value) and variation (maximum minus minimum slope, over ``slope``). For the table
    also step (maximum change of the slope over `SPAN` points, over ``slope``) and step_ratio (this change over the
    change for twice the span). The ratio is 0.5 for a slope without jumps and 1 at a jump.
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
