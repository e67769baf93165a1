"""Force over displacement along one direction, given by a characteristic or by gap and stiffness."""

import numpy as np

from wrcore.forces import law
from wrcore.forces.kind import AT, DIRECTION, Along, Kind, axis_of, curve, ends_of, faults_of, number, polygon
from wrcore.kernels.jit import FUSED, jit


@jit(allocates=False, fastmath=FUSED)
def displacement(elements, k, stretch, speed, inner, press):
    """Return the force of a characteristic over displacement, and its stored energy."""
    force, stored = law.characteristic(elements, k, stretch)
    return force, 0.0, stored, 0.0


def parts(item):
    """Return one part. It may act as the normal force of friction; it carries weight with its steepest slope."""
    if "gap" in item:
        gap, free = item["gap"], int(item["gap"] == 0.0)
        points = polygon([0.0, gap, gap + 1.0][free:], [0.0, 0.0, item["stiffness"]][free:])
    else:
        points = polygon(item["characteristic"]["displacement"], item["characteristic"]["force"])
    presses = -float(np.interp(0.0, points[:, 0], points[:, 1]))
    slope = np.max(np.diff(points[:, 1]) / np.diff(points[:, 0]))
    return [Along(ends_of(item), displacement, axis_of(item), points=points, slope=slope, presses=presses)]


def check(item):
    """Check that either a characteristic or gap and stiffness are given."""
    given = {"characteristic", "gap", "stiffness"} & set(item)
    if given not in ({"characteristic"}, {"gap", "stiffness"}):
        yield "", "expected either a characteristic, or gap and stiffness"
    yield from faults_of(item, "displacement")


KIND = Kind(
    {"at": AT, "direction": DIRECTION, "characteristic": curve("displacement", "m"),
     "gap": number("the free play to either side in m, 0 to 1", most=1.0), "stiffness": number("a stiffness in N/m")},
    ("at", "direction"), {"marker": "P", "color": "0.1"}, parts, check, (displacement,),
)  # fmt: skip
