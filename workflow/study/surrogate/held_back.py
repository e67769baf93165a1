"""Print the errors of trained weights on the pairs of profiles that are held back from training.

    python -m study.surrogate.held_back FOLDER ... [--weights weights.npz] [--figure errors.png] [--trained]

The table has a row for each class of contact angle, and one for patches with several overlaps. It states the error of
N, relative to N, and that of the creep force, relative to friction times N, as median / 95 % / 99 %. The figure shows
the errors over contact angle, normal force and friction, and how many patches the data have there."""

import argparse
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd

from study.surrogate import shards
from study.surrogate.training_data import is_held_back, joined, taught
from wrcore.analysis.pictures.style import styled
from wrcore.contact.surrogate import network

CLASSES = {"to 0.1 rad": (0.0, 0.1), "0.1 to 0.4 rad": (0.1, 0.4), "0.4 to 0.7 rad": (0.4, 0.7),
           "from 0.7 rad": (0.7, 9.0)}  # fmt: skip
"""Classes of the contact angle, rad."""

OVER = (("angle", "contact angle / rad", 1.0, None), ("load", "normal force / kN", 1e-3, (1.0, 10.0, 100.0)),
        ("friction", "coefficient of friction", 1.0, (0.03, 0.1, 0.3, 0.8)))  # fmt: skip
"""Names, axis labels, factors and, for logarithmic axes, ticks of the quantities over which errors are drawn."""

CLASSES_DRAWN, LEAST_DRAWN = 16, 20
"""Number of classes of each quantity in the figure, and minimum number of patches of a class."""


def errors(weights, rows):
    """Return the errors of N (n,) and of the creep force (n, points), in per cent, of patches ``rows`` (arrays by name)
    by ``weights`` (arrays by name)."""
    corrections, remainders = taught(weights, rows["descriptors"].astype(float), rows["disk"])
    of_load = 100.0 * np.abs(corrections[:, 0] - rows["corrections"][:, 0])
    difference = remainders - (rows["exact"] - rows["base"])
    return of_load, 100.0 * np.hypot(difference[..., 0], difference[..., 1])


def table(weights, rows, trained=False):
    """Return the table of errors (pandas.DataFrame) of the held back patches among ``rows``.

    If ``trained``, of all others, which the training has used."""
    held = is_held_back(rows["pair"]) != trained
    rows = {name: array[held] for name, array in rows.items()}
    (of_load, of_force), angle = errors(weights, rows), np.abs(rows["angle"])
    classes = {"all": angle >= 0.0} | {name: (angle >= low) & (angle < high) for name, (low, high) in CLASSES.items()}
    classes["several overlaps"] = rows["overlaps"] > 1
    found = []
    for name, some in classes.items():
        said = ("/".join(f"{q:.3g}" for q in np.percentile(e[some], [50, 95, 99])) for e in (of_load, of_force))
        found.append([name, int(some.sum()), *said] if some.any() else [name, 0, "", ""])
    return pd.DataFrame(found, columns=["patches", "number", "N, %", "creep force, %"])


def _edges(values, count, is_log):
    """Return ``count`` + 1 limits of equally wide classes from the least to the largest of values."""
    low, high = float(values.min()), float(values.max()) * (1.0 + 1e-9)
    return np.geomspace(low, high, count + 1) if is_log else np.linspace(low, high, count + 1)


@styled
def figure(weights, rows):
    """Return the figure of errors of the held back patches among ``rows``.

    One column each for contact angle, normal force and coefficient of friction. Upper panels: errors of N and of the
    creep force, median and 95 %, in classes with at least 20 patches. Lower panels: number of patches in training."""
    import matplotlib.pyplot as plt

    held = is_held_back(rows["pair"])
    some = {name: array[held] for name, array in rows.items()}
    of_load, of_force = errors(weights, some)
    drawn, panels = plt.subplots(2, 3, figsize=(7.5, 4.2), sharex="col", height_ratios=(3, 1), layout="constrained")
    for column, (name, label, factor, ticks) in enumerate(OVER):
        values = factor * np.abs(some[name])
        edges = _edges(factor * np.abs(rows[name]), CLASSES_DRAWN, bool(ticks))
        upper, lower = panels[:, column]
        inside = [(values >= a) & (values < b) for a, b in pairwise(edges)]
        middle = np.sqrt(edges[1:] * edges[:-1]) if ticks else 0.5 * (edges[1:] + edges[:-1])
        for error, text, color in ((of_load, "normal force", "#0072B2"), (of_force, "creep force", "#D55E00")):
            for percent, dashes in ((50, "--"), (95, "-")):
                line = [np.percentile(error[k], percent) if k.sum() >= LEAST_DRAWN else np.nan for k in inside]
                upper.plot(middle, line, dashes, color=color, label=f"{text}, {percent} %")
        upper.set(yscale="log", ylim=(0.01, 20.0))
        lower.hist(factor * np.abs(rows[name][~held]), edges, color="0.6")
        lower.set(xlabel=label, yscale="log", ylim=(300.0, None))
        if ticks:
            lower.set_xscale("log")
            lower.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
            lower.minorticks_off()
    panels[0, 0].set_ylabel("error / %")
    panels[1, 0].set_ylabel("patches")
    drawn.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return drawn


def main():
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER")
    parser.add_argument("--weights", type=Path, default=network._WEIGHTS, help="those of the package if left out")
    parser.add_argument("--figure", type=Path, help="file of a figure of the errors, such as errors.png")
    parser.add_argument("--trained", action="store_true", help="errors on the patches that are not held back")
    asked = parser.parse_args()
    weights, rows = shards.read(asked.weights), joined(asked.folders)[0]
    print(table(weights, rows, asked.trained).to_markdown(index=False))
    if asked.figure:
        figure(weights, rows).savefig(asked.figure)


if __name__ == "__main__":
    main()
