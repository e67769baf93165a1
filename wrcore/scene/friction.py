"""Friction of a scene's rails: one coefficient, one per rail, tables along the track, and how it falls with slip."""

from typing import NamedTuple

import numpy as np

from wrcore.dynamics.schedule import Schedules, pack_schedules
from wrcore.errors import InputError
from wrcore.geometry.track import SIDES
from wrcore.scene.schedule import read_schedule


class Friction(NamedTuple):
    """What a model needs to know of it."""

    largest: float
    """Largest coefficient anywhere; the only one where the rails do not differ."""
    rails: Schedules
    """Over arc length, left and right; empty for one coefficient."""
    ratio: float
    """A of mu = mu0 ((1 - A) exp(-B w) + A)."""
    decay: float
    """B, s/m."""


def read_friction(spec, source):
    """Friction from a scene's ``contact.friction``, checked against the schema; an InputError where keys do not go
    together or arc lengths do not rise."""
    field = "contact.friction"
    if not isinstance(spec, dict):
        return Friction(float(spec), pack_schedules([]), 1.0, 0.0)
    falling = spec.get("falling", {"ratio": 1.0, "decay": 0.0})
    given = spec.keys() - {"falling"}
    if given not in ({"mu"}, {"mu", "arc_length"}, {"left", "right"}):
        expected = "expected mu, arc_length and mu, or left and right"
        raise InputError(source, field, f"{expected}, got {' and '.join(sorted(given)) or 'none of them'}")
    if "mu" in given:
        table = spec if "arc_length" in spec else spec["mu"]
        if isinstance(spec["mu"], list) != ("arc_length" in spec):
            raise InputError(source, f"{field}.mu", "expected one number, or a list of them with arc_length")
        if not isinstance(table, dict):
            return Friction(float(table), pack_schedules([]), float(falling["ratio"]), float(falling["decay"]))
        tables = [_table(table, source, field)] * 2
    else:
        tables = [_table(spec[side], source, f"{field}.{side}") for side in SIDES]
    largest = float(max(np.max(table[:, 1]) for table in tables))
    return Friction(largest, pack_schedules(tables), float(falling["ratio"]), float(falling["decay"]))


def _table(spec, source, field):
    return read_schedule(spec, "mu", ("arc_length",), source, field)[1]
