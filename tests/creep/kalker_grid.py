"""The file of Kalker's coefficients afresh, in about two minutes: ``python -m tests.creep.kalker_grid FILE``."""

import sys
from pathlib import Path

import numpy as np

from wrcore.contact.rolling.ellipse_influence import panel_counts, patch_panels, resultants, stuck_forces
from wrcore.creep.kalker import GRID_A_OVER_B, GRID_NU

LEVELS = (32, 48)


def adhesion_coefficients(g, nu, level):
    """C11, C22, C23, C33 of an ellipse with about ``level**2`` panels that all stick, A F = -w; C23 is the mean of
    -dfy/dphi' and dmz/deta', which agree in the limit."""
    panels = patch_panels(g, 0.0, *panel_counts(g, level))
    (c11, _, _), (_, c22, c32), (_, c23, c33) = -resultants(panels, stuck_forces(panels, nu, True)[1])
    return np.array([c11, c22, (c23 - c32) / 2, c33])


def extrapolated_coefficients(g, nu, levels=LEVELS):
    """C11, C22, C23, C33 extrapolated linearly in 1/level from two refinements."""
    coarse, fine = (adhesion_coefficients(g, nu, level) for level in levels)
    return fine + (fine - coarse) * levels[0] / (levels[1] - levels[0])


def main(path):
    lines = [
        "# Linear creep coefficients of two equal bodies, ellipse; tests/creep/kalker_grid.py: half-space, "
        f"adhesion everywhere, levels {LEVELS[0]} and {LEVELS[1]} extrapolated",
        "nu,a_over_b,C11,C22,C23,C33",
    ]
    for nu in GRID_NU:
        for g in GRID_A_OVER_B:
            lines.append(",".join(f"{value:.8g}" for value in (nu, g, *extrapolated_coefficients(g, nu))))
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1])
