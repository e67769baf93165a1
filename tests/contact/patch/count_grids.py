"""How many patches strips leave to the grid: ``python -m tests.contact.patch.count_grids [coarse|middle|fine]``.

S1002 on UIC60 1:40, left wheel, y from -8 to 8 mm in steps of 20 um, 10 to 80 kN, and lateral scans at fixed heights in
steps of 1 um where a second window of contact is born.
"""

import sys

import numpy as np

from tests.contact.normal.test_strips import MODULUS, height
from tests.contact.patch.strip_contact import NormalContact
from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.geometry.profiles.standards import named_profile

LOADS = (1e4, 3e4, 5.5e4, 8e4)
BIRTHS = (4.7e-3, 4.77e-3, 4.85e-3, 5.53e-3)


def main(resolution="coarse"):
    wheel, rail = named_profile("S1002", "wheel"), named_profile("UIC60-MBench", "rail", 1 / 40)
    pair = WheelOnRail(wheel, rail).geometry
    contact = NormalContact(pair, MODULUS, resolution)
    for yaw in (0.0, 0.005, 0.012, 0.024):
        places = [(y, height(pair, y, load, yaw)) for load in LOADS for y in np.arange(-8e-3, 8e-3, 2e-5)]
        births = [(y + 1e-6 * k, z) for y in BIRTHS for z in [height(pair, y, 5.5e4, yaw)] for k in range(-25, 26)]
        for name, poses in (("wheel loads", places), ("where windows are born", births)):
            found = [patch.converged for y, z in poses for patch in contact.at_height("left", y, z, 0.0, yaw)]
            lost = found.count(False)
            share = f"{lost} of {len(found)} patches ({lost / len(found):.2%})"
            print(f"{resolution}, yaw {1e3 * yaw:g} mrad, {name}: {share}")


if __name__ == "__main__":
    main(*sys.argv[1:])
