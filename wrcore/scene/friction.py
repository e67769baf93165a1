"""Friction of a scene's rails: one coefficient, one per rail, tables along the track, and how it falls with slip."""

from typing import NamedTuple

import numpy as np

from wrcore.errors import InputError
from wrcore.geometry.track import SIDES
from wrcore.kernels import own
from wrcore.scene.schedule import read_schedule
from wrcore.track.schedule import Schedules, pack_schedules

LEAST, MOST = 1e-9, 1.0
"""Bounds of a coefficient."""

LEAST_FACTOR = 0.01
"""Of friction that falls."""


class Friction(NamedTuple):
    """What a model needs to know of it."""

    largest: float
    """Largest coefficient anywhere; the only one where the rails do not differ."""
    rails: Schedules
    """Over arc length, left and right; empty for one coefficient."""
    ratio: float = 1.0
    """A of mu = mu0 ((1 - A) exp(-B w) + A)."""
    decay: float = 0.0
    """B, s/m; of a law of the user's own, samples per m/s."""
    factors: np.ndarray = np.zeros(0)
    """(n,): samples of such a law, from slip velocity 0 on."""
    least_share: float = 1.0
    """Of a rail's largest coefficient, the smallest one along it."""


def read_friction(spec, source, laws, call=True):
    """Friction from a scene's ``contact.friction``, checked against the schema; an InputError where keys do not go
    together or arc lengths do not rise. ``laws`` finds laws of the user; where these are not to be called (``call``),
    the keys are checked and the result is None."""
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
    """Tables of the left and the right rail from a function of arc length; None where it is not to be called."""
    _needs(spec, ("length", "spacing"), source, field)
    s, values = own.on_grid(spec, 2, laws, source, field, call)
    if values is None:
        return None
    _within(values, LEAST, MOST, "coefficients", source, f"{field}.law")
    return [np.column_stack([s, row]) for row in values]


def _falling(spec, source, field, laws, call):
    """Ratio, decay and factors; None where they are those of a law that is not to be called."""
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
    return 0.0, (len(w) - 1) / (w[-1] - w[0]), np.array(values[0])  # one to write to: kernels know no other type


def _needs(spec, keys, source, field):
    for key in keys:
        if key not in spec:
            raise InputError(source, f"{field}.{key}", "expected a value, but the key is missing")


def _within(values, least, most, what, source, field):
    if values.min() < least or values.max() > most:
        got = f"got {values.min():g} to {values.max():g}"
        raise InputError(source, field, f"expected {what} from {least:g} to {most:g}, {got}")
