"""How smooth looked-up contact is: ``python -m tests.wheels.table.increments [MODEL]``.

A left wheel of the default pair moves across its rail in steps of 1 um, at a height that loads it with 50 kN in the
middle of each stretch. Printed, for each stretch: the largest change from one increment to the next of N, Fx and Fy,
over the mean size of an increment there.
"""

import argparse

import numpy as np
import pandas as pd

from study.patch.look_up_errors import FRICTION, PAIRS, SPEED
from wrcore.analysis.contact.loaded import LoadedWheels, Rolling
from wrcore.contact.search import reduction

STEP, LOAD, DRIFT = 1e-6, 5e4, 1e-3


def increments(wheels, places, rolling):
    """Table of the largest change of an increment over the mean size of one."""
    z = wheels.height("left", float(np.median(places)), LOAD, 0.0, 0.0)
    rows = []
    for y in places:
        found = wheels.at_height("left", y, z, 0.0, 0.0, rolling, FRICTION)
        rows.append(np.sum([one.row[[reduction.NORMAL, reduction.FX, reduction.FY]] for one in found], axis=0))
    steps = np.diff(rows, axis=0)
    return np.abs(np.diff(steps, axis=0)).max(axis=0) / np.abs(steps).mean(axis=0)


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("model", nargs="?", default="tabulated", choices=("tabulated", "exact", "moment"))
    parser.add_argument("--steps", type=int, default=200, help="of each stretch")
    parser.add_argument("--stretches", type=int, default=21, help="from -6 to 6 mm")
    chosen = parser.parse_args()
    geometry = PAIRS["S1002 / 60E1 1:40"]().geometry
    wheels, lines = LoadedWheels(geometry, chosen.model), []
    rolling = Rolling(SPEED, SPEED / geometry.rolling_radius * (1.0 + DRIFT), SPEED * DRIFT)
    for middle in np.linspace(-6e-3, 6e-3, chosen.stretches):
        places = middle + STEP * (np.arange(chosen.steps + 1) - 0.5 * chosen.steps)
        normal, along, across = increments(wheels, places, rolling)
        lines.append({"y, mm": 1e3 * middle, "N": normal, "Fx": along, "Fy": across})
    print(pd.DataFrame(lines).to_markdown(index=False, floatfmt=".2g"))


if __name__ == "__main__":
    main()
