"""Compare two folders of ``wrcore evolve`` at equal distances.

``python -m wrcore.analysis.wear.compare_folders A B [--km 1e4 2e4]``

Prints a row per distance and folder; profiles and tables are interpolated linearly between steps. For tread and flange
it also prints the maximum difference of the profiles and the maximum wear of the second folder.
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from wrcore.analysis.wear.evolve import profiles_over_distance

FLANGE = -0.03
"""Limit between flange (with its root) and tread on the profile, m. The tread is evaluated up to the opposite value on
the field side."""

SHOWN = {"Sh_m": (1e3, 2), "Sd_m": (1e3, 2), "qR_m": (1e3, 2), "hollow_m": (1e3, 2), "equivalent_conicity": (1.0, 3)}
"""Printed columns with their scale and number of decimals."""


def worn_by(folder, distance):
    """Return positions u (m), change of the ordinates since the start (m), and the table's numbers at a distance (m).

    Return None for distances beyond the first reprofiling of the wheel."""
    table, profiles = pd.read_csv(Path(folder) / "steps.csv"), profiles_over_distance(folder)
    turned = np.flatnonzero(table["at_limit"])
    count = turned[0] + 1 if len(turned) else len(table)
    distances = table["distance_m"].to_numpy()[:count]
    if not distances[0] <= distance <= distances[-1]:
        return None
    k = min(max(int(np.searchsorted(distances, distance)) - 1, 0), count - 2)
    part = (distance - distances[k]) / (distances[k + 1] - distances[k])
    u, f = profiles[k][1], (1.0 - part) * profiles[k][2] + part * profiles[k + 1][2]
    numbers = {name: np.interp(distance, distances, table[name].to_numpy()[:count]) for name in SHOWN}
    return u, f - profiles[0][2], numbers


def main():
    """Run the command that prints the comparison."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", nargs=2)
    parser.add_argument("--km", nargs="+", type=float, default=[10_000, 20_000, 30_000, 40_000, 50_000])
    arguments = parser.parse_args()
    print("km, folder, Sh (mm), Sd (mm), qR (mm), hollow (mm), conicity; differ by at most (mm): tread, flange")
    for km in arguments.km:
        found, differ = [worn_by(folder, 1e3 * km) for folder in arguments.folders], []
        if all(found):
            (u, worn, _), (_, other, _) = found
            for there in (np.abs(u) < -FLANGE, u < FLANGE):
                apart, most = (1e3 * np.abs(depth)[there].max() for depth in (worn - other, other))
                differ.append(f"{apart:.2f} of {most:.2f}")
        for folder, one in zip(arguments.folders, found, strict=True):
            numbers = [f"{scale * one[2][name]:.{n}f}" for name, (scale, n) in SHOWN.items()] if one else ["beyond"]
            print(", ".join([f"{km:.0f}", folder, *numbers, *differ]))


if __name__ == "__main__":
    main()
