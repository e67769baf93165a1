"""A damper along one direction, linear or with a characteristic, or linear along all three axes.

With ``series_stiffness`` it acts in series with a spring (Maxwell). The internal state is the damper's displacement.
"""

import numpy as np

from wrcore.forces import law
from wrcore.forces.kind import AT, DIRECTION, Along, Kind, axis_of, curve, ends_of, faults_of, number, polygon, three
from wrcore.forces.kinds.traction_rod import linear
from wrcore.kernels.jit import FUSED, jit

STEEPEST_INVERSE = 1000.0
"""Largest slope of the inverse characteristic (speed over force), in multiples of its slope at the steepest part.

A damper in series with a spring needs this inverse, which is undefined where the characteristic is flat."""


@jit(allocates=False, fastmath=FUSED)
def velocity(elements, k, stretch, speed, inner, press):
    """Return the force of a characteristic over speed, and its dissipated power."""
    force = law.characteristic(elements, k, speed)[0]
    return force, 0.0, 0.0, force * speed


@jit(allocates=False, fastmath=FUSED)
def series(elements, k, stretch, speed, inner, press):
    """Return the force k (x - s) = c s' of spring and linear damper in series; s is the damper displacement."""
    stiffness, damping = law.numbers(elements, k)[:2]
    force = stiffness * (stretch - inner)
    rate = force / damping
    return force, rate, 0.5 * stiffness * (stretch - inner) ** 2, force * rate


@jit(allocates=False, fastmath=FUSED)
def series_velocity(elements, k, stretch, speed, inner, press):
    """Return the force k (x - s) of spring and damper in series; the inverse characteristic gives the rate of s."""
    stiffness = law.numbers(elements, k)[0]
    force = stiffness * (stretch - inner)
    rate = law.characteristic(elements, k, force)[0]
    return force, rate, 0.5 * stiffness * (stretch - inner) ** 2, force * rate


def parts(item):
    """Return one part, or without a direction one part along each axis with damping."""
    ends, series_stiffness = ends_of(item), item.get("series_stiffness")
    if "direction" not in item:
        values = zip(np.eye(3), item["damping"], series_stiffness or [None] * 3, strict=True)
        return [_linear(ends, *value) for value in values if value[1] > 0.0]
    axis = axis_of(item)
    if "damping" in item:
        return [_linear(ends, axis, item["damping"], series_stiffness)]
    points = polygon(item["characteristic"]["velocity"], item["characteristic"]["force"])
    if series_stiffness is None:
        return [Along(ends, velocity, axis, points=points)]
    return [Along(ends, series_velocity, axis, (series_stiffness,), _inverse(points), inner=True)]


def _linear(ends, axis, damping, stiffness):
    if stiffness is None:
        return Along(ends, linear, axis, (0.0, damping, 0.0))
    return Along(ends, series, axis, (stiffness, damping), inner=True)


def _inverse(points):
    """Return the points of the inverse characteristic, speed over force; flat parts get a small slope."""
    least = np.max(np.diff(points[:, 1]) / np.diff(points[:, 0])) / STEEPEST_INVERSE
    zero = int(np.argmin(np.abs(points[:, 0])))
    rises = np.maximum(np.diff(points[:, 1]), least * np.diff(points[:, 0]))
    force = np.concatenate([[0.0], np.cumsum(rises)])
    return np.column_stack([force - force[zero] + points[zero, 1], points[:, 0]])


def check(item):
    """Check that keys fit together: damping or characteristic, one number with a direction or three without."""
    for key in ("damping", "series_stiffness"):
        if key in item and isinstance(item[key], list) == ("direction" in item):
            expected = "one number with a direction" if "direction" in item else "three numbers without a direction"
            yield key, f"expected {expected}, got {item[key]!r}"
    if ("damping" in item) == ("characteristic" in item):
        yield "", "expected either damping or characteristic"
    if "direction" not in item and "characteristic" in item:
        yield "direction", "expected a value, as a characteristic needs one"
    if "series_stiffness" in item:
        damped, sprung = (np.atleast_1d(value) > 0.0 for value in (item.get("damping", 1.0), item["series_stiffness"]))
        if np.any(damped != sprung):
            expected = "expected values above 0 where damping is above 0, and nowhere else"
            yield "series_stiffness", f"{expected}, got {item['series_stiffness']!r}"
    yield from faults_of(item, "velocity")


def _either(one, three_of_them):
    """Return the schema of a key that holds one number, or one number for each axis."""
    forms = [number(one), three(three_of_them)]
    return {"description": ", or ".join(form["description"] for form in forms), "anyOf": forms}


KIND = Kind(
    {
        "at": AT,
        "direction": DIRECTION,
        "damping": _either("a damping in N s/m", "dampings in N s/m"),
        "characteristic": curve("velocity", "m/s"),
        "series_stiffness": _either(
            "the stiffness in N/m of a spring in series, above 0", "the same above 0 where damping is"
        ),
    },
    ("at",), {"marker": "D", "color": "#E69F00"}, parts, check, (velocity, series, series_velocity),
)  # fmt: skip
