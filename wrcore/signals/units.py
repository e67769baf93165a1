"""Units of measured signals: the name and the unit in a column's title, and the factor to the SI unit."""

import math
import re

from wrcore.run.output.channels import unit_of

G = 9.80665
"""Standard acceleration of gravity, m/s^2 (defined by the 3rd CGPM, 1901); the unit g of accelerometers."""

INCH, FOOT, MILE, POUND_FORCE = 0.0254, 0.3048, 1609.344, 4.4482216152605
"""Exact values in m and N (international yard and pound of 1959)."""

UNITS = {
    "_m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "um": 1e-6, "in": INCH, "inch": INCH, "ft": FOOT, "mi": MILE},
    "_s": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0},
    "_m_per_s": {"m/s": 1.0, "mm/s": 1e-3, "km/h": 1 / 3.6, "kmh": 1 / 3.6, "kph": 1 / 3.6, "mph": MILE / 3600.0},
    "_m_per_s2": {"m/s2": 1.0, "m/s/s": 1.0, "ms-2": 1.0, "mm/s2": 1e-3, "g": G, "mg": 1e-3 * G},
    "_N": {"N": 1.0, "kN": 1e3, "MN": 1e6, "lbf": POUND_FORCE, "kip": 1e3 * POUND_FORCE, "kips": 1e3 * POUND_FORCE},
    "_Nm": {"Nm": 1.0, "kNm": 1e3},
    "_Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "bar": 1e5, "N/mm2": 1e6},
    "_rad": {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180.0, "°": math.pi / 180.0},
    "_rad_per_s": {
        "rad/s": 1.0, "mrad/s": 1e-3, "deg/s": math.pi / 180.0, "°/s": math.pi / 180.0, "rpm": math.pi / 30.0,
    },
    "_per_m": {"1/m": 1.0, "1/km": 1e-3, "1/mm": 1e3, "m-1": 1.0, "km-1": 1e-3},
    "_Hz": {"Hz": 1.0, "1/s": 1.0, "kHz": 1e3},
    "_W": {"W": 1.0, "kW": 1e3, "MW": 1e6},
    "_J": {"J": 1.0, "kJ": 1e3, "MJ": 1e6},
    "": {"1": 1.0, "-": 1.0, "%": 1e-2, "‰": 1e-3, "mm/m": 1e-3, "permil": 1e-3},
}  # fmt: skip
"""Factors to the SI unit by unit, by the suffix that names of channels have for the SI unit; none for pure numbers."""

ENDINGS = {"_m_per_s2": "m/s2", "_m_per_s": "m/s", "_rad_per_s": "rad/s", "_mm_per_s": "mm/s", "_km_per_h": "km/h"}
"""Ends of column names that are not a separator and a unit of `UNITS`."""

_TYPOGRAPHY = str.maketrans({"²": "2", "³": "3", "⁻": "-", "¹": "1", "µ": "u", "μ": "u", "·": "", "−": "-"})
_FORMS = {unit: (suffix, factor) for suffix, units in UNITS.items() for unit, factor in units.items()}
_LOWER = {unit.lower(): unit for unit in reversed(_FORMS) if unit[0] != "M"}
_BRACKET = re.compile(r"(.*?)[\s,_]*[\[(]\s*([^\])]*?)\s*[\])]\s*$")


def plain_unit(text):
    """Return a unit as `UNITS` writes it, or an empty text for a text that is not one of them.

    Exponents may be written ``m/s²``, ``m/s^2`` or ``m/s**2``. Capitals matter only in units that begin with M, since
    mPa is not MPa."""
    unit = re.sub(r"[\s^*.]", "", text.strip("[]() ").translate(_TYPOGRAPHY)).replace("m_per_", "m/")
    return unit if unit in _FORMS else _LOWER.get(unit.lower(), "")


def suffix_and_factor(unit):
    """Return the suffix of channels with a unit's quantity, such as ``_m_per_s2``, and the factor to the SI unit.

    None if the unit is not one of `UNITS`."""
    return _FORMS.get(plain_unit(unit))


def split_title(title):
    """Return the name in a column's title and its unit; the unit is empty if the title states none.

    Titles are such as ``Acc Y [m/s2]``, ``Q (kN)``, ``v / km/h``, ``y in mm``, ``y_mm`` or ``ay_m_per_s2``."""
    title = title.strip().strip("\"'").strip()
    bracket = _BRACKET.fullmatch(title)
    if bracket and bracket[1]:
        return bracket[1].rstrip("/ "), bracket[2]
    for ending, unit in ENDINGS.items():
        if title.lower().endswith(ending) and len(title) > len(ending):
            return title[: -len(ending)], unit
    for mark in (r"[_\s]", r"/"):  # a blank first: v km/h
        for match in re.finditer(mark, title):
            name, unit = re.sub(r"(\s+in|\s*/)\s*$", "", title[: match.start()]), title[match.end() :]
            if name and plain_unit(unit) not in ("", "1", "-"):
                return name.strip(), unit
    return title, ""


def channel_of_title(title, unit):
    """Return the name of a channel, with the suffix of its SI unit, for a column that no channel is named for.

    For example ``acc_y_m_per_s2`` of the title ``Acc Y`` and the unit g."""
    name = re.sub(r"[^\w./]+", "_", title).strip("_").lower() if "." not in title else title.strip()
    suffix, _ = suffix_and_factor(unit) or ("", 1.0)
    return name if suffix and name.endswith(suffix) else f"{name}{suffix}"


def is_of_channel(unit, channel):
    """Whether values with a unit can be those of a channel, whose name states an SI unit."""
    known = suffix_and_factor(unit)
    return known is not None and unit_of(f"x{known[0]}") == unit_of(channel)
