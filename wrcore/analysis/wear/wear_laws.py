"""Wear laws: volume of material that frictional work in a patch removes, m^3 per metre rolled and m^2 of contact.

With q the work (N/m^2 per metre rolled), p the pressure, s the slip (-) and V the rolling speed:

* ``sheffield``: loss of mass over q in three branches. Wear rate over T gamma/A of the University of Sheffield, steel
  R8T on 900A: Braghin, Lewis, Dwyer-Joyce and Bruni, Wear 261 (2006) 1253-1264. The numbers 5.3, 10.4, 55.12, 77.2 and
  61.9 are recalled and agree with a public code. The third branch is joined to the second without a jump (as printed it
  begins at zero).
* ``energy``: only the first branch, loss proportional to frictional work.
* ``archard``: depth k p s/H, with the wear coefficient k from a map over p and the sliding speed V s, hardness H
  (Archard, J. Appl. Phys. 24 (1953) 981-988; as a map for wheels: Jendel, Wear 253 (2002) 89-99; with the user's bounds
  and coefficients: GENSYS manual, ``wr_coupl_pra1``, read). In FASTSIM's slip zone the traction is mu p: p s = q/mu.
  The map uses Hertz's pressure, and the slip under FASTSIM's parabolic pressure.
* ``t_gamma``: volume of a patch per metre rolled over its T gamma, linear between given points and distributed like q.
  This is the form of Pearce and Sherratt, Wear 144 (1991) 343-351, whose area per distance times the wheel's diameter
  is a function of T gamma (times pi: the volume).

The user gives the coefficients of ``archard`` and ``t_gamma``: those of the papers were neither read nor determined.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from wrcore.errors import InputError
from wrcore.errors.checked_yaml import validate

DENSITY = 7850.0  # of steel, kg/m^3

_MILD, _FLAT, _SEVERE = 5.3e-9, 10.4e6, 77.2e6
"""Wear coefficient of the mild branch, kg/m/m^2 per N/m^2, and bounds of the flat branch, N/m^2: 1 ug/m/mm^2 is 1e-3
kg/m/m^2."""


@dataclass(frozen=True, eq=False)
class Sliding:
    """Frictional work over m patches, the argument of wear laws.

    ``rows`` are channels (m,) of contacts, ``friction`` is the friction coefficient and ``speed`` (m,) the rolling
    speed, m/s. The other fields are results of :func:`wrcore.analysis.wear.local_wear.friction_work`.
    """

    rows: Mapping[str, np.ndarray]
    y: np.ndarray
    dy: np.ndarray
    dx: np.ndarray
    work: np.ndarray
    friction: float
    speed: np.ndarray


Law = Callable[[Sliding], np.ndarray]


def sheffield(work):
    """Return the loss (kg per metre rolled and m^2) for frictional work per area (N/m^2): mild, flat, then steep."""
    flat = _MILD * _FLAT
    return np.where(work < _FLAT, _MILD * work, flat + 61.9e-9 * np.maximum(work - _SEVERE, 0.0))


def energy(work):
    """Return the loss (kg per metre rolled and m^2), proportional to frictional work per area (N/m^2)."""
    return _MILD * np.asarray(work)


LAWS = {"sheffield": sheffield, "energy": energy}  # laws that depend only on work


def archard(sliding, hardness, coefficients, speeds, pressures):
    """Return the loss (m^3 per metre rolled and m^2, shape of the work) by Archard's law at a hardness (Pa).

    The map ``coefficients`` (pressures + 1, speeds + 1) applies between the increasing bounds of speed (m/s) and
    pressure (Pa).
    """
    pressed = sliding.work / sliding.friction  # p s
    rows, steps = sliding.rows, sliding.work.shape[-1]
    along = 1.0 - (1.0 - (2.0 * np.arange(steps) + 1.0) / steps) ** 2
    inside = (1.0 - (sliding.y / rows["b_m"][:, None]) ** 2)[..., None] * along  # 1 - (x/a)^2 - (y/b)^2
    mean = (rows["N_N"] / (np.pi * rows["a_m"] * rows["b_m"]))[:, None, None]  # Pa
    slip = pressed / (2.0 * mean * inside)
    row = np.searchsorted(pressures, 1.5 * mean * np.sqrt(inside), side="right")
    column = np.searchsorted(speeds, sliding.speed[:, None, None] * slip, side="right")
    return np.asarray(coefficients, float)[row, column] * pressed / hardness


def over_t_gamma(sliding, points):
    """Return the loss (m^3 per metre rolled and m^2, shape of the work) from T gamma of whole patches, distributed like
    frictional work.

    ``points`` (k, 2) are T gamma (N, increasing) and volume per metre rolled (m^3/m), constant beyond the ends.
    """
    rows = sliding.rows
    number = np.abs(rows["Fx_N"] * rows["xi"] + rows["Fy_N"] * rows["eta"])
    total = np.sum(np.sum(sliding.work, axis=-1) * sliding.dx * sliding.dy, axis=1)
    volume = np.interp(number, *np.transpose(points))
    share = np.divide(volume, total, out=np.zeros(total.shape), where=total > 0.0)
    return sliding.work * share[:, None, None]


def wear_law(law: str | Mapping[str, object], source: str = "local_wear") -> Law:
    """Return the function of a wear law, from :class:`Sliding` to m^3 per metre rolled and m^2.

    ``law`` is ``"sheffield"``, ``"energy"``, ``{"archard": {...}}`` or ``{"t_gamma": [...]}`` (schema
    ``wear_law.yaml``). Errors name ``source``.
    """
    if isinstance(law, str) and law in LAWS:
        return partial(_by_mass, LAWS[law])
    if not isinstance(law, Mapping):
        known = f"expected one of {', '.join(LAWS)}, or a mapping with archard or t_gamma"
        raise InputError(source, "law", f"{known}, got {law!r}")
    try:
        data = validate(dict(law), "wear_law", source)
    except InputError as error:
        raise InputError(source, ".".join(filter(None, ["law", error.field])), error.expected) from None
    if "t_gamma" in data:
        _check_rising([point[0] for point in data["t_gamma"]], "law.t_gamma", source)
        return partial(over_t_gamma, points=data["t_gamma"])
    found = data["archard"]
    for name in ("speeds", "pressures"):
        _check_rising(found[name], f"law.archard.{name}", source)
    shape = len(found["pressures"]) + 1, len(found["speeds"]) + 1
    if [len(row) for row in found["coefficients"]] != [shape[1]] * shape[0]:
        expected = f"expected {shape[0]} rows of {shape[1]} numbers, between the pressures and speeds"
        raise InputError(source, "law.archard.coefficients", expected)
    return partial(archard, **found)


def check_friction(law, friction, source, field):
    """Refuse Archard's law if friction is not one number: then work does not determine pressure times slip."""
    if isinstance(law, Mapping) and "archard" in law and isinstance(friction, Mapping):
        raise InputError(source, field, "expected contact.friction to be one number with the law archard")


def _by_mass(loss, sliding):
    return loss(sliding.work) / DENSITY


def _check_rising(values, field, source):
    if not np.all(np.diff(values) > 0.0):
        raise InputError(source, field, f"expected rising numbers, got {values}")
