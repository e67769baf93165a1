"""Fields of a contact patch and the places of its strips on the profiles, from the strips solved last."""

import numpy as np

from wrcore.contact.normal import solve
from wrcore.contact.normal.gap import UR, U
from wrcore.contact.patch.result import Patch
from wrcore.contact.rolling.rolling import read_field
from wrcore.contact.search import reduction as columns
from wrcore.geometry.track import SIDES


def patch_of_strips(work, settings, row, load, pose, friction, back):
    """Return the `Patch` of the strips solved last in a `StripWork`, by the settings of a `StripModel`.

    The panels of the strips are its cells, relative to the centroid of pressure. ``row`` are the patch's columns,
    ``load`` its normal force (N), ``pose`` side, y, z (m), roll and yaw (rad) of its wheel. A wheel that rolls ``back``
    was solved with the direction of travel reversed.
    """
    turn = -1.0 if back else 1.0
    sign = SIDES[pose[0]]
    count, slender, _ = work.solved
    rolling, library = (work.slender, settings.slender) if slender else (work.rolling, settings.library)
    field = np.empty((9, count * library.panels.n))
    read_field(library.panels, count, rolling, field)
    tx, ts, pressure, sx, ss, slides = field[2:8].reshape(6, count, -1)
    rows = (solve.CENTRE, solve.OWN_WIDTH, solve.HALF_LENGTH, solve.MIDDLE, solve.WINDOW)
    centre, width, half, middle, window = work.strips[list(rows), :count]
    even = solve.even_length(half, width, window)  # strips as rectangles of equal area
    longer = load / work.sums[solve.LOAD] * (half / even)[:, None]
    edges = middle[:, None] + turn * even[:, None] * library.panels.edges
    like, mean_x, mean_s = np.ones(pressure.shape), work.sums[solve.MEAN_X], work.sums[solve.MEAN_S]
    slips = slides > 0.0
    cells = (
        0.5 * (edges[:, 1:] + edges[:, :-1]) - mean_x, sign * like * (centre - mean_s)[:, None],
        turn * (edges[:, :-1] - edges[:, 1:]), like * width[:, None], pressure * longer, tx * longer,
        turn * sign * ts * longer, np.where(slips, sx, 0.0), np.where(slips, turn * sign * ss, 0.0), ~slips,
    )  # fmt: skip
    s_ends = sorted(sign * (work.sums[k] - mean_s) for k in (solve.S_MIN, solve.S_MAX))
    ends = (*(work.sums[k] - mean_x for k in (solve.X_MIN, solve.X_MAX)), *s_ends)
    return Patch(
        *(cell.ravel() for cell in cells), *map(float, row[[columns.NORMAL, columns.FX, columns.FY, columns.MZ]]),
        *map(float, row[columns.XI : columns.PHI + 1]), float(row[columns.ANGLE]),
        tuple(map(float, row[[columns.X, columns.Y, columns.Z]])), friction, pose[0], float(row[columns.P_MAX]),
        tuple(map(float, ends)), pose[1:],
    )  # fmt: skip


def ends_on_profiles(work):
    """Return both ends of the strips solved last on the profiles of wheel and rail, shape (2, 2, strips), m.

    The ends are interpolated between the middles of the strips.
    """
    count = work.solved[0]
    centre, width = work.strips[:2, :count]
    known = np.r_[centre[0] - width[0], centre, centre[-1] + width[-1]]
    ends = centre + 0.5 * np.array([-width, width])
    found = []
    for u in work.normal.gap[:count, [U, UR]].T:
        first, last = (u[1] - u[0]) / (centre[1] - centre[0]), (u[-1] - u[-2]) / (centre[-1] - centre[-2])
        found.append(np.interp(ends, known, np.r_[u[0] - first * width[0], u, u[-1] + last * width[-1]]))
    return np.array(found)
