"""Friction of a scene's rails: one coefficient, one per rail, or tables along the track; it may fall with slip."""

from functools import partial
from typing import NamedTuple

import numpy as np

from wrcore.geometry.track import SIDES
from wrcore.kernels import own
from wrcore.scene.parts.schedule import read_schedule
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
    across: tuple[np.ndarray, np.ndarray] = (np.zeros((0, 2)), np.zeros((0, 2)))
    """Factors over the inclination of the rail's surface (n, 2), left and right, see `wrcore.contact.rail_friction`;
    the right one is empty if the rails are alike, both if the factor is 1 everywhere."""

    def across_of(self, wheel: int) -> np.ndarray:
        """Return the factors (n, 2) of the rail under the left (0) or the right (1) wheel."""
        return self.across[wheel] if len(self.across[1]) else self.across[0]


def read_friction(spec, reader):
    """Return a function that returns the `Friction` of a scene's ``contact.friction``, checked against the schema.

    An InputError is raised at once if keys exclude each other or arc lengths do not increase. User-defined laws are
    called when the function is called.
    """
    spec, reader = spec if isinstance(spec, dict) else {"mu": spec}, reader.at("contact.friction")
    across = _across(spec.get("across"), reader.at("across"))
    along = _along({key: value for key, value in spec.items() if key != "across"}, reader)
    return partial(_with_across, along, across)


def _with_across(along, across):
    """Return the `Friction` that the function ``along`` returns, with factors ``across`` the rails."""
    return along()._replace(across=across)


def _along(spec, reader):
    """Return a function that returns the `Friction` of a mapping without ``across``."""
    falling = _falling(spec.get("falling"), reader.at("falling"))
    given = spec.keys() - {"falling"}
    if "law" in given and given <= {"law", "begin", "length", "spacing"}:
        return partial(_friction, _by_law(_along_rails, spec, 2, reader), falling)
    if given not in ({"mu"}, {"mu", "arc_length"}, {"left", "right"}):
        expected = "expected mu, arc_length and mu, left and right, or law, length and spacing"
        raise reader.error("", f"{expected}, got {' and '.join(sorted(given)) or 'none of them'}")
    if "mu" not in given:
        return partial(_friction, [_table(spec[side], reader.at(side)) for side in SIDES], falling)
    table = spec if "arc_length" in spec else spec["mu"]
    if isinstance(spec["mu"], list) != ("arc_length" in spec):
        raise reader.error("mu", "expected one number, or a list of them with arc_length")
    return partial(_friction, [_table(table, reader)] * 2 if isinstance(table, dict) else float(table), falling)


def _friction(tables, falling):
    """Return the `Friction` of tables of both rails or of one coefficient, and of ratio, decay and factors.

    Each of the two arguments may be a function that calls a user-defined law and returns the argument.
    """
    falling = falling() if callable(falling) else falling
    tables = tables() if callable(tables) else tables
    if isinstance(tables, float):
        return Friction(tables, pack_schedules([]), *falling)
    largest = [float(table[:, 1].max()) for table in tables]
    shares = (float(table[:, 1].min()) / most for table, most in zip(tables, largest, strict=True))
    return Friction(max(largest), pack_schedules(tables), *falling)._replace(least_share=min(shares))


def _across(spec, reader):
    """Return the factors over the inclination of the rail's surface, left and right, see `Friction`."""
    if spec is None:
        return Friction._field_defaults["across"]
    if spec.keys() <= set(SIDES):
        if not spec:
            raise reader.error("", "expected angle and factor, or left, or right, with these")
        tables = [_factors(spec[side], reader.at(side)) if side in spec else np.array([[0.0, 1.0]]) for side in SIDES]
        return tuple(tables)
    if spec.keys() != {"angle", "factor"}:
        expected = "expected angle and factor, or left and right with these"
        raise reader.error("", f"{expected}, got {' and '.join(sorted(spec))}")
    return _factors(spec, reader), np.zeros((0, 2))


def _factors(spec, reader):
    return read_schedule(spec, "factor", ("angle",), reader)[1]


def _table(spec, reader):
    return read_schedule(spec, "mu", ("arc_length",), reader)[1]


def _falling(spec, reader):
    """Return ratio, decay and factors of falling friction, or a function that calls its user-defined law."""
    if spec is None:
        return ()
    if spec.keys() & {"ratio", "decay"} if "law" in spec else spec.keys() - {"ratio", "decay"}:
        raise reader.error("", "expected ratio and decay, or law, length and spacing")
    if "law" in spec:
        return _by_law(_over_slip, spec, 1, reader)
    if spec in ({"ratio": 1.0}, {"decay": 0.0}):
        return ()  # constant friction
    _check_keys(spec, ("ratio", "decay"), reader)
    return float(spec["ratio"]), float(spec["decay"])


def _by_law(function, spec, rows, reader):
    """Return ``function`` with its arguments, a user-defined law and the reader; the law is found but not called."""
    _check_keys(spec, ("length", "spacing"), reader)
    own.on_grid(spec, rows, reader.laws, reader.source, reader.key, call=False)
    return partial(function, spec, reader)


def _along_rails(spec, reader):
    """Return tables of the left and the right rail, sampled from a user's function of arc length."""
    s, values = own.on_grid(spec, 2, reader.laws, reader.source, reader.key)
    _check_range(values, LEAST, MOST, "coefficients", reader)
    return [np.column_stack([s, row]) for row in values]


def _over_slip(spec, reader):
    """Return ratio, decay and factors of falling friction, sampled from a user's function of slip velocity."""
    w, values = own.on_grid(spec, 1, reader.laws, reader.source, reader.key)
    _check_range(values, LEAST_FACTOR, 1.0, "factors", reader)
    return 0.0, (len(w) - 1) / (w[-1] - w[0]), np.array(values[0])  # writable, as kernels need


def _check_keys(spec, keys, reader):
    for key in keys:
        if key not in spec:
            raise reader.error(key, "expected a value, but the key is missing")


def _check_range(values, least, most, what, reader):
    if values.min() < least or values.max() > most:
        got = f"got {values.min():g} to {values.max():g}"
        raise reader.error("law", f"expected {what} from {least:g} to {most:g}, {got}")
