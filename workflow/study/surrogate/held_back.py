"""Print the errors of trained weights on the pairs of profiles that are held back from training.

    python -m study.surrogate.held_back FOLDER ... [--weights weights.npz]

The table has a row for each class of contact angle, and one for patches with several overlaps. It states the error of
N, relative to N, and that of the creep force, relative to friction times N, as median / 95 % / 99 %."""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from study.surrogate import shards
from study.surrogate.training_data import is_held_back, joined, taught
from wrcore.contact.surrogate import network

CLASSES = {"to 0.1 rad": (0.0, 0.1), "0.1 to 0.4 rad": (0.1, 0.4), "0.4 to 0.7 rad": (0.4, 0.7),
           "from 0.7 rad": (0.7, 9.0)}  # fmt: skip
"""Classes of the contact angle, rad."""


def errors(weights, rows):
    """Return the errors of N (n,) and of the creep force (n, points), in per cent, of patches ``rows`` (arrays by name)
    by ``weights`` (arrays by name)."""
    corrections, remainders = taught(weights, rows["descriptors"].astype(float), rows["disk"])
    of_load = 100.0 * np.abs(corrections[:, 0] - rows["corrections"][:, 0])
    difference = remainders - (rows["exact"] - rows["base"])
    return of_load, 100.0 * np.hypot(difference[..., 0], difference[..., 1])


def table(weights, rows):
    """Return the table of errors (pandas.DataFrame) of the held back patches among ``rows``."""
    held = is_held_back(rows["pair"])
    rows = {name: array[held] for name, array in rows.items()}
    (of_load, of_force), angle = errors(weights, rows), np.abs(rows["angle"])
    classes = {"all": angle >= 0.0} | {name: (angle >= low) & (angle < high) for name, (low, high) in CLASSES.items()}
    classes["several overlaps"] = rows["overlaps"] > 1
    found = []
    for name, some in classes.items():
        said = ("/".join(f"{q:.3g}" for q in np.percentile(e[some], [50, 95, 99])) for e in (of_load, of_force))
        found.append([name, int(some.sum()), *said] if some.any() else [name, 0, "", ""])
    return pd.DataFrame(found, columns=["patches", "number", "N, %", "creep force, %"])


def main():
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER")
    parser.add_argument("--weights", type=Path, default=network._WEIGHTS, help="those of the package if left out")
    asked = parser.parse_args()
    print(table(shards.read(asked.weights), joined(asked.folders)[0]).to_markdown(index=False))


if __name__ == "__main__":
    main()
