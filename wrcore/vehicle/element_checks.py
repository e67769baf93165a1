"""What each kind of force element may and must say; errors name the element."""

import numpy as np

from wrcore.errors import InputError, one_of

KEYS = {
    "spring_damper": (("at",), ("stiffness", "damping", "rotation_stiffness", "rotation_damping", "preload")),
    "shear_spring": (("at", "stiffness"), ("damping", "bending_stiffness", "preload")),
    "air_spring": (
        ("at", "effective_area", "volume"),
        (
            "reservoir",
            "orifice_damping",
            "orifice_exponent",
            "area_change",
            "polytropic_exponent",
            "shear_stiffness",
            "bending_stiffness",
            "preload",
        ),
    ),
    "damper": (("at",), ("direction", "damping", "characteristic", "series_stiffness")),
    "bushing": (
        ("at",),
        (
            "stiffness",
            "cubic_stiffness",
            "damping",
            "rotation_stiffness",
            "rotation_cubic_stiffness",
            "rotation_damping",
            "preload",
        ),
    ),
    "friction": (("at", "direction"), ("force", "mu", "normal", "series_stiffness", "approach", "pendulum")),
    "bump_stop": (("at", "direction"), ("characteristic", "gap", "stiffness")),
    "traction_rod": (("at", "stiffness"), ("damping", "preload")),
    "anti_roll_bar": (("stiffness",), ("at", "damping")),
}
"""Keys of each kind beside name, kind and bodies: those it needs and those it may have."""

VECTORS = {
    "spring_damper": ("stiffness", "damping", "preload"),
    "bushing": ("stiffness", "cubic_stiffness", "rotation_cubic_stiffness", "damping", "preload"),
    "shear_spring": ("stiffness", "damping", "preload"),
    "air_spring": ("preload",),
}
"""Keys with a value per axis; elsewhere the same key holds one number."""


def check_element(item, source):
    """Raise an InputError that names the element if keys are missing, unknown for its kind, or of the wrong shape."""
    field, kind = f"elements.{item['name']}", item["kind"]
    needed, optional = KEYS[kind]
    for key in needed:
        if key not in item:
            raise InputError(source, f"{field}.{key}", f"expected a value, as kind {kind} needs one")
    for key in item:
        if key not in ("name", "kind", "bodies", *needed, *optional):
            raise InputError(source, f"{field}.{key}", f"unknown for kind {kind}; {one_of(needed + optional, key)}")
    for key in ("stiffness", "cubic_stiffness", "rotation_cubic_stiffness", "damping", "preload", "series_stiffness"):
        if key in item:
            _check_quantity(item, key, f"{field}.{key}", source)
    if kind in ("spring_damper", "bushing") and not any(key in item for key in optional):
        raise InputError(source, field, f"expected one of {', '.join(optional)}")
    if kind == "air_spring" and ("reservoir" in item) != ("orifice_damping" in item):
        raise InputError(source, field, "expected both a reservoir and its orifice_damping, or neither")
    if "orifice_exponent" in item and "reservoir" not in item:
        raise InputError(source, f"{field}.orifice_exponent", "expected a reservoir")
    if kind == "friction":
        _check_friction(item, field, source)
    if kind == "damper":
        _check_damper(item, field, source)
    given = {key for key in ("characteristic", "gap", "stiffness") if key in item}
    if kind == "bump_stop" and given not in ({"characteristic"}, {"gap", "stiffness"}):
        raise InputError(source, field, "expected either a characteristic, or gap and stiffness")
    if "characteristic" in item:
        _check_characteristic(item, f"{field}.characteristic", source)


def _check_quantity(item, key, field, source):
    """One number or three, as the kind of element asks for, and none of them negative (but for a preload)."""
    kind, value = item["kind"], item[key]
    vector = key in VECTORS.get(kind, ()) or (kind == "damper" and "direction" not in item)
    if isinstance(value, list) != vector:
        expected = "three numbers [x, y, z]" if vector else "one number"
        if kind == "damper":
            expected += " with a direction" if "direction" in item else " without a direction"
        raise InputError(source, field, f"expected {expected} for kind {kind}, got {value!r}")
    if key != "preload" and np.min(value) < 0.0:
        raise InputError(source, field, f"expected no negative value, got {np.min(value):g}")


def _check_friction(item, field, source):
    """A limit of its own or by another element's force, and one law of slipping."""
    if ("mu" in item) != ("normal" in item):
        raise InputError(source, field, "expected both mu and normal, the name of the element that presses, or neither")
    if "force" not in item and "mu" not in item:
        raise InputError(source, f"{field}.force", "expected a value, or mu and normal")
    if "series_stiffness" not in item and "approach" not in item:
        expected = "expected a value, as kind friction needs one, or approach"
        raise InputError(source, f"{field}.series_stiffness", expected)
    if item.get("series_stiffness") == 0.0:
        raise InputError(source, f"{field}.series_stiffness", "expected a value above 0")
    if "series_stiffness" in item and "approach" in item:
        raise InputError(source, f"{field}.approach", "expected either approach or series_stiffness")
    if "pendulum" in item and ("approach" not in item or "mu" not in item or "force" in item):
        raise InputError(source, f"{field}.pendulum", "expected mu, normal and approach with it, and no force")


def _check_damper(item, field, source):
    """Linear or by a characteristic; along one direction, or linear with a value per axis."""
    if ("damping" in item) == ("characteristic" in item):
        raise InputError(source, field, "expected either damping or characteristic")
    if "direction" not in item and "characteristic" in item:
        raise InputError(source, f"{field}.direction", "expected a value, as a characteristic needs one")
    if "damping" in item and "series_stiffness" in item:
        damping, series = np.atleast_1d(item["damping"]), np.atleast_1d(item["series_stiffness"])
        if np.any((damping > 0.0) != (series > 0.0)):
            expected = "expected values above 0 where damping is above 0, and nowhere else"
            raise InputError(source, f"{field}.series_stiffness", f"{expected}, got {item['series_stiffness']!r}")


def _check_characteristic(item, field, source):
    """Lists of equal length over the kind's own abscissa, rising, with forces that do not fall."""
    abscissa = "velocity" if item["kind"] == "damper" else "displacement"
    curve = item["characteristic"]
    if set(curve) != {abscissa, "force"}:
        raise InputError(source, field, f"expected the lists {abscissa} and force, got {' and '.join(sorted(curve))}")
    x, force = np.array(curve[abscissa], float), np.array(curve["force"], float)
    if x.size != force.size:
        raise InputError(
            source, field, f"expected as many forces as values of {abscissa}, got {force.size} and {x.size}"
        )
    if np.any(np.diff(x) <= 0.0):
        raise InputError(source, f"{field}.{abscissa}", "expected strictly rising values")
    if np.any(np.diff(force) < 0.0):
        raise InputError(source, f"{field}.force", "expected forces that do not fall")
    if "series_stiffness" in item and not np.any(np.diff(force) > 0.0):
        raise InputError(source, f"{field}.force", "expected forces that rise somewhere")
