"""Air springs with a reservoir behind an orifice, as springs and a damper that kernels know.

Compressed by z, with w the displacement whose volume A w has gone through the orifice, bag and reservoir press by

    F - F0 = K_a z + K_b (z - w),   K_b (z - w) = K_r w + C |w'|^beta sign(w'),

with K_b = n p A^2/V, K_r = n p A^2/V_reservoir (p absolute, n polytropic exponent), K_a = (p - p_atmosphere) dA/dz.
With s = K_b/(K_b + K_r) and w = s y that is a spring beside a damper in series with another one (Maxwell), exactly:

    F - F0 = (K_a + s K_r) z + s K_b (z - y),   s K_b (z - y) = s^(1 + beta) C |y'|^beta sign(y').

References
----------
Oda, Nishimura, Vibration of air suspension bogies and their design, Bulletin of JSME 13 (1970) 43-50 (beta = 1).
Berg, A three-dimensional airspring model with friction and orifice damping, Vehicle System Dynamics 33 supplement
(1999) 528-539 (beta = 1.8, recalled; its mass of air in the pipe and its friction are left out here).
"""

import numpy as np

from wrcore.errors import InputError
from wrcore.vehicle.statics import preloads

ATMOSPHERE = 101325.0
"""Pa."""

FIRST_PRESSURE = 4e5
"""Above the atmosphere; where the search for the pressure that carries the load begins, Pa."""

PASSES = 8
"""Most passes of that search: pressures enter stiffnesses, and these the shares of the load where springs differ."""

SPEEDS = np.concatenate(([0.0], np.geomspace(1e-3, 5.0, 40)))
"""Of the damper's polygon, m/s: up to 1 mm/s it is linear, beyond its chords are within 1.2 % of the power law."""


def inflated(items, single_elements, layout, joints, gravity):
    """Checked elements with air springs made of what kernels know, each at the pressure that carries its share of the
    load, and preloads (N by name) as :func:`wrcore.vehicle.statics.preloads` gives them; ``gravity`` in m/s^2. An
    InputError names an air spring that carries nothing."""
    springs = {item["name"]: item for item in items if item["kind"] == "air_spring"}
    pressures = {name: FIRST_PRESSURE for name in springs}
    for _ in range(PASSES):
        parts = [part for item in items for part in _parts(item, pressures)]
        single = single_elements(parts, layout)
        found = preloads(single, layout, joints, gravity)
        before = pressures
        pressures = {
            name: abs(item["preload"][2] if "preload" in item else found[name]) / item["effective_area"]
            for name, item in springs.items()
        }
        if all(abs(pressures[name] - before[name]) <= 1e-9 * before[name] for name in springs):
            break
    for name, pressure in pressures.items():
        if not pressure > 0.0:
            raise InputError(layout.source, f"elements.{name}", "expected part of the weight on an air spring")
    return single, found


def _parts(item, pressures):
    """An element as a list of elements: an air spring's spring and, with a reservoir, its damper."""
    if item["kind"] != "air_spring":
        return [item]
    over, area = pressures[item["name"]], item["effective_area"]
    bag = item.get("polytropic_exponent", 1.4) * (over + ATMOSPHERE) * area**2 / item["volume"]
    changing, shear = over * item.get("area_change", 0.0), item.get("shear_stiffness", 0.0)
    spring = {key: item[key] for key in ("name", "bodies", "at", "bending_stiffness", "preload") if key in item}
    spring |= {"kind": "shear_spring", "stiffness": [shear, shear, changing + bag]}
    if "reservoir" not in item:
        return [spring]
    behind = bag * item["volume"] / item["reservoir"]
    share, exponent = bag / (bag + behind), item.get("orifice_exponent", 1.0)
    spring["stiffness"][2] = changing + share * behind
    damper = {key: item[key] for key in ("name", "bodies")}
    damper["at"] = np.mean(np.reshape(item["at"], (-1, 3)), axis=0).tolist()
    damper |= {"kind": "damper", "direction": "z", "series_stiffness": share * bag}
    resistance = share ** (1.0 + exponent) * item["orifice_damping"]
    if exponent == 1.0:
        return [spring, damper | {"damping": resistance}]
    force = resistance * SPEEDS**exponent
    return [spring, damper | {"characteristic": {"velocity": SPEEDS.tolist(), "force": force.tolist()}}]
