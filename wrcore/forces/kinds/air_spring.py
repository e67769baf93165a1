"""An air spring, on request with a reservoir behind an orifice: a shear_spring and a damper in series with a spring.

Let z be the compression and A w the volume of air that has passed the orifice. The force of bag and reservoir is

    F - F0 = K_a z + K_b (z - w),   K_b (z - w) = K_r w + C |w'|^beta sign(w'),

with K_b = n p A^2/V, K_r = n p A^2/V_reservoir (p absolute, n polytropic exponent), K_a = (p - p_atmosphere) dA/dz.
With s = K_b/(K_b + K_r) and w = s y this is exactly a spring parallel to a damper and spring in series (Maxwell):

    F - F0 = (K_a + s K_r) z + s K_b (z - y),   s K_b (z - y) = s^(1 + beta) C |y'|^beta sign(y').

References
----------
Oda, Nishimura, Vibration of air suspension bogies and their design, Bulletin of JSME 13 (1970) 43-50 (beta = 1).
Berg, A three-dimensional airspring model with friction and orifice damping, Vehicle System Dynamics 33 supplement
(1999) 528-539 (beta = 1.8, recalled; the mass of air in the pipe and the friction of that model are neglected here).
"""

import numpy as np

from wrcore.forces.kind import AT, Kind, middle_of, number
from wrcore.forces.kinds import damper, shear_spring, spring_damper

ATMOSPHERE = 101325.0
"""Atmospheric pressure, Pa."""

FIRST_PRESSURE = 4e5
"""Gauge pressure at which the search for the pressure that carries the load starts, Pa."""

SPEEDS = np.concatenate(([0.0], np.geomspace(1e-3, 5.0, 40)))
"""Speeds of the damper's polygon, m/s: linear up to 1 mm/s, above with an error below 1.2 % of the power law."""


def first_load(item):
    """Return the load (N) at `FIRST_PRESSURE`."""
    return FIRST_PRESSURE * item["effective_area"]


def parts(item, load):
    """Return spring, bending spring and, with a reservoir, a damper, at the pressure that carries ``load`` (N)."""
    over, area = load / item["effective_area"], item["effective_area"]
    bag = item.get("polytropic_exponent", 1.4) * (over + ATMOSPHERE) * area**2 / item["volume"]
    changing, shear = over * item.get("area_change", 0.0), item.get("shear_stiffness", 0.0)
    spring = {**item, "stiffness": [shear, shear, changing + bag]}
    if "reservoir" not in item:
        return shear_spring.parts(spring)
    behind = bag * item["volume"] / item["reservoir"]
    share, exponent = bag / (bag + behind), item.get("orifice_exponent", 1.0)
    spring["stiffness"][2] = changing + share * behind
    valve = {"at": middle_of(item)[0], "direction": "z", "series_stiffness": share * bag}
    resistance = share ** (1.0 + exponent) * item["orifice_damping"]
    if exponent == 1.0:
        valve["damping"] = resistance
    else:
        valve["characteristic"] = {"velocity": SPEEDS, "force": resistance * SPEEDS**exponent}
    return [*shear_spring.parts(spring), *damper.parts(valve)]


def check(item):
    """Check that the keys of a reservoir are given together."""
    if ("reservoir" in item) != ("orifice_damping" in item):
        yield "", "expected both a reservoir and its orifice_damping, or neither"
    if "orifice_exponent" in item and "reservoir" not in item:
        yield "orifice_exponent", "expected a reservoir"


PURE = {"x-unit": "1"}
KIND = Kind(
    {
        "at": AT,
        "effective_area": number("the effective area in m^2 (1e-4 to 10)", 1e-4, 10.0),
        "volume": number("the volume of the bag in m^3 (1e-6 to 100)", 1e-6, 100.0),
        "reservoir": number("the volume of the reservoir in m^3 (1e-6 to 100)", 1e-6, 100.0),
        "orifice_damping": number(
            "the force in N of the orifice at 1 m/s through the effective area, above 0 (1e-3 to 1e15)", 1e-3
        ),
        "orifice_exponent": number(
            "the power of the speed that the orifice's force follows, 1 (laminar) to 3", 1.0, 3.0, **PURE
        ),
        "area_change": number("the growth of the effective area with compression in m (m^2/m), within 10", -10.0, 10.0),
        "polytropic_exponent": number("the polytropic exponent of the air, 1 (isothermal) to 2", 1.0, 2.0, **PURE),
        "shear_stiffness": number("a stiffness in N/m along x and y"),
        "bending_stiffness": shear_spring.BENDING,
        "preload": spring_damper.KEYS["preload"],
    },
    ("at", "effective_area", "volume"), {"marker": "o", "color": "#0072B2"}, parts, check, first_load=first_load,
)  # fmt: skip
