"""Friction of a scene's rails: one coefficient, one per rail, or tables along the track; it may fall with slip."""

from typing import NamedTuple

import numpy as np

from wrcore.errors import InputError
from wrcore.geometry.track import SIDES
from wrcore.kernels import own
from wrcore.scene.schedule import read_schedule
from wrcore.track.schedule import Schedules, pack_schedules

LEAST, MOST = 1e-9, 1.0
"""Bounds of a friction coefficient."""

LEAST_FACTOR = 0.01
"""Smallest factor by which friction may fall with slip velocity."""


class Friction(NamedTuple):
    """Friction coefficients of both rails and their dependence on slip velocity."""

    largest: float
    """Largest coefficient of both rails; the only one if friction is constant and equal on both."""
    rails: Schedules
    """Coefficients over arc length, left and right; empty if ``largest`` holds everywhere."""
    ratio: float = 1.0
    """A of mu = mu0 ((1 - A) exp(-B w) + A), with the slip velocity w."""
    decay: float = 0.0
    """B, s/m; for a user-defined law, samples per m/s."""
    factors: np.ndarray = np.zeros(0)
    """(n,): samples of a user-defined law over slip velocity, equally spaced from 0."""
    least_share: float = 1.0
    """Smallest ratio of a coefficient along a rail to the same rail's largest coefficient."""


def read_friction(spec, source, laws, call=True):
    """Return the `Friction` of a scene's ``contact.friction``, checked against the schema.

    An InputError is raised if keys exclude each other or arc lengths do not increase. ``laws`` finds user-defined laws.
    If these exist and ``call`` is False, only the keys are checked and the result is None.
    """
    field = "contact.friction"
    if not isinstance(spec, dict):
        return Friction(float(spec), pack_schedules([]))
    falling = _falling(spec.get("falling"), source, f"{field}.falling", laws, call)
    given = spec.keys() - {"falling"}
    if "law" in given and given <= {"law", "begin", "length", "spacing"}:
        tables = _by_law(spec, source, field, laws, call)
    elif given not in ({"mu"}, {"mu", "arc_length"}, {"left", "right"}):
        expected = "expected mu, arc_length and mu, left and right, or law, length and spacing"
        raise InputError(source, field, f"{expected}, got {' and '.join(sorted(given)) or 'none of them'}")
    elif "mu" in given:
        table = spec if "arc_length" in spec else spec["mu"]
        if isinstance(spec["mu"], list) != ("arc_length" in spec):
            raise InputError(source, f"{field}.mu", "expected one number, or a list of them with arc_length")
        if not isinstance(table, dict):
            return None if falling is None else Friction(float(table), pack_schedules([]), *falling)
        tables = [_table(table, source, field)] * 2
    else:
        tables = [_table(spec[side], source, f"{field}.{side}") for side in SIDES]
    if tables is None or falling is None:
        return None
    largest = [float(table[:, 1].max()) for table in tables]
    shares = (float(table[:, 1].min()) / most for table, most in zip(tables, largest, strict=True))
    return Friction(max(largest), pack_schedules(tables), *falling)._replace(least_share=min(shares))


def _table(spec, source, field):
    return read_schedule(spec, "mu", ("arc_length",), source, field)[1]


def _by_law(spec, source, field, laws, call):
    """Return tables of the left and the right rail, sampled from a user's function of arc length.

    The result is None if ``call`` is False.
    """
    _needs(spec, ("length", "spacing"), source, field)
    s, values = own.on_grid(spec, 2, laws, source, field, call)
    if values is None:
        return None
    _within(values, LEAST, MOST, "coefficients", source, f"{field}.law")
    return [np.column_stack([s, row]) for row in values]


def _falling(spec, source, field, laws, call):
    """Return ratio, decay and factors of falling friction; None for a user-defined law if ``call`` is False."""
    if spec is None:
        return ()
    if "law" not in spec:
        _needs(spec, ("ratio", "decay"), source, field)
        if spec.keys() - {"ratio", "decay"}:
            raise InputError(source, field, "expected ratio and decay, or law, length and spacing")
        return float(spec["ratio"]), float(spec["decay"])
    _needs(spec, ("length", "spacing"), source, field)
    if spec.keys() & {"ratio", "decay"}:
        raise InputError(source, field, "expected ratio and decay, or law, length and spacing")
    w, values = own.on_grid(spec, 1, laws, source, field, call)
    if values is None:
        return None
    _within(values, LEAST_FACTOR, 1.0, "factors", source, f"{field}.law")
    return 0.0, (len(w) - 1) / (w[-1] - w[0]), np.array(values[0])  # writable, as kernels need


def _needs(spec, keys, source, field):
    for key in keys:
        if key not in spec:
            raise InputError(source, f"{field}.{key}", "expected a value, but the key is missing")


def _within(values, least, most, what, source, field):
    if values.min() < least or values.max() > most:
        got = f"got {values.min():g} to {values.max():g}"
        raise InputError(source, field, f"expected {what} from {least:g} to {most:g}, {got}")
