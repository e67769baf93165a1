"""Exact contact against CONTACT, as distributions: ``python -m tests.contact.patch.compare_contact [FOLDER]``.

FOLDER holds the reference files that are not distributed with the project (see `contact_reference`); without them only
``mbench_contact`` is compared, which has no creep forces. Per set and resolution: normal force and greatest pressure at
CONTACT's height, and the creep force over mu N: with CONTACT's creepages against its own (D = 2), and of the whole
wheel-rail model with the slip of the surfaces against CONTACT's with that, in one plane (D = 3) and, as whole force in
the track frame, in a curved plane (D = 4), each also with CONTACT's lag of the lateral slip taken out. One plane is
CONTACT's, not the model's, where a patch lies in the flange root: judge by the curved one there. Median, 95 %, worst,
and the case that is worst.
"""

import argparse
import math
import os

import pandas as pd

from tests.analysis.contact.test_poses import outcome, row_of, with_creepages
from tests.contact.patch import contact_reference as contact
from wrcore.analysis.contact.loaded import LoadedWheels, Rolling
from wrcore.contact.patch.model import STRIPS
from wrcore.contact.search import reduction as columns

QUANTITIES = {
    "normal": ("normal force at CONTACT's height", 100.0, "%"),
    "p_max": ("greatest pressure", 100.0, "%"),
    "force": ("creep force, CONTACT's creepages", 100.0, "% of mu N"),
    "surface_force": ("creep force, whole model", 100.0, "% of mu N"),
    "without_lag": ("creep force, whole model, lag taken out", 100.0, "% of mu N"),
    "curved_force": ("the same in a curved plane", 100.0, "% of mu N"),
    "curved_without_lag": ("the same, lag taken out", 100.0, "% of mu N"),
}
RESOLUTIONS = ("coarse", "middle", "fine")
JOINED = (4.74e-3, 5.26e-3)
"""Shifts towards the flange (m) at which CONTACT joins two contacts in one averaged plane."""


def comparable(name):
    """Cases of a set that are heavy and one patch in reality, too."""
    found = [c for c in contact.cases(name) if c.name not in contact.BLENDED and not c.subset.startswith("light")]
    return [c for c in found if c.patches == 1 and not JOINED[0] < c.sign * c.y < JOINED[1]]


def whole_model(wheels, lag=False):
    """Solver for `contact.compare`: the wheel at CONTACT's height in CONTACT's motion."""

    def solve(case, _):
        vy = case.vy + (case.surface_eta * case.speed / math.cos(case.angle) if lag else 0.0)
        rolling = None if math.isnan(case.rolling_rate) else Rolling(case.vx, case.rolling_rate, vy)
        found = wheels.at_height(case.side, case.y, case.z, case.roll, case.yaw, rolling, contact.FRICTION)
        return outcome(row_of(min(found, key=lambda one: abs(one.row[columns.Y] - case.origin[1]))), case)

    return solve


def errors(name, resolution, patch="exact"):
    """Columns of QUANTITIES per case of a set."""
    geometry, cases = contact.geometry(name), comparable(name)
    surfaces, creepages = (LoadedWheels(geometry, patch, resolution, slip) for slip in ("surfaces", "creepages"))
    table = contact.compare(whole_model(surfaces), cases, geometry)
    table["force"] = math.nan
    if not math.isnan(sum(case.xi * case.fx for case in cases)) and patch in STRIPS:  # none in the distributed file
        table["force"] = contact.compare(with_creepages(creepages), cases, geometry)["force"]
        without = contact.compare(whole_model(surfaces, lag=True), cases, geometry)
        table["without_lag"], table["curved_without_lag"] = without["surface_force"], without["curved_force"]
    return table


def distributions(table):
    """Median, 95 % and worst of the amounts of QUANTITIES in a table of `errors`, and the worst case's name."""
    rows = []
    for column, (what, factor, unit) in QUANTITIES.items():
        if column in table and table[column].notna().any():
            size = factor * table[column].abs()
            at = table.loc[size.idxmax()]
            where = f"{at['name']} ({at.side}, y {1e3 * at.y:g} mm, yaw {1e3 * at.yaw:g} mrad)"
            spread = {"median": size.median(), "95 %": size.quantile(0.95), "worst": size.max(), "in": where}
            rows.append({"quantity": what, "unit": unit, "cases": int(size.count())} | spread)
    return pd.DataFrame(rows)


def main():
    """Print the distributions of all sets that are present."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", nargs="?", help="folder with the reference files")
    parser.add_argument("--patch", default="exact", choices=("exact", "tabulated", "surrogate"))
    parser.add_argument("--resolution", nargs="*", default=RESOLUTIONS, choices=RESOLUTIONS)
    chosen = parser.parse_args()
    if chosen.folder:
        os.environ["WRCORE_REFERENCE"] = chosen.folder
    parts = {}
    for name in contact.SETS:
        if comparable(name) and contact.geometry(name) is not None:
            levels = chosen.resolution if chosen.patch in STRIPS else ["middle"]
            parts |= {(name, level): distributions(errors(name, level, chosen.patch)) for level in levels}
    table = pd.concat(parts, names=["set", "resolution"]).reset_index(["set", "resolution"])
    print(table.to_markdown(index=False, floatfmt=".3g"))


if __name__ == "__main__":
    main()
