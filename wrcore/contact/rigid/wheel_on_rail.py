"""A wheel on its rail, and a wheelset on its track: profiles, radii and positions."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from wrcore.contact.search.geometry import contact_geometry
from wrcore.errors import InputError, check_number
from wrcore.errors.checked_calls import checked
from wrcore.geometry.profiles.profile import GAUGE_DEPTH, ProfileCurve
from wrcore.geometry.track import GAUGES, SIDES

RADII, HALF_DISTANCES = (0.05, 2.0), (0.2, 1.5)
"""Permitted ranges of rolling radii and of distances of the tape circles from the wheelset's centre, m."""


@checked
@dataclass(frozen=True)
class WheelOnRail:
    """A wheel on its rail.

    Parameters
    ----------
    wheel, rail : ProfileCurve
    rolling_radius : float
        At the tape circle, m.
    half_distance : float
        Tape circle from the wheelset's centre, m; a `WheelsetOnTrack` sets its own.
    rail_distance : float, optional
        Origin of the rail's profile from the track's centre line, m; left out: at standard gauge.
    """

    wheel: ProfileCurve
    rail: ProfileCurve
    rolling_radius: float = 0.46
    half_distance: float = 0.75
    rail_distance: float | None = None

    def __post_init__(self):
        if (self.wheel.kind, self.rail.kind) != ("wheel", "rail"):
            got = f"{self.wheel.kind} and {self.rail.kind}"
            raise InputError(self.wheel.name, "kind", f"expected a wheel and a rail, got {got}")
        check_number(self.rolling_radius, *RADII, "wheel", "rolling_radius", "m")
        check_number(self.half_distance, *HALF_DISTANCES, "wheelset", "half_distance", "m")
        distance = 0.5 * 1.435 + self.rail.gauge_offset() if self.rail_distance is None else self.rail_distance
        object.__setattr__(self, "rail_distance", distance)
        if not math.isnan(distance):
            check_number(distance, *HALF_DISTANCES, "track", "rail_distance", "m")

    @cached_property
    def geometry(self):
        """Return the `ContactGeometry` for kernels; InputError if a part of a rail's profile has no gauge."""
        distance = self.rail_distance
        if distance is None or math.isnan(distance):
            raise InputError(self.rail.name, "gauge", "expected a rail down to where the gauge is measured, got a part")
        pair = _ByContent(self.wheel), _ByContent(self.rail)
        made = _geometry_of(*pair, self.rolling_radius, self.half_distance, float(distance))
        arrays = {name: part for name, part in made._asdict().items() if isinstance(part, np.ndarray)}
        return made._replace(**{name: part.copy("K") for name, part in arrays.items()})


@lru_cache(maxsize=16)
def _geometry_of(wheel, rail, *lengths):
    """Return the cached `ContactGeometry`, of about 2 MB, that scenes with the same profiles copy."""
    return contact_geometry(wheel.curve, rail.curve, *lengths)


class _ByContent:
    """A `ProfileCurve` that equals others with the same nodes."""

    def __init__(self, curve):
        self.curve, digest = curve, hashlib.sha256()
        for row in (curve.u, curve.f, curve.df, curve.d2f):
            digest.update(np.ascontiguousarray(row).data)
        self._digest = digest.digest()

    def __eq__(self, other):
        return self._digest == other._digest

    def __hash__(self):
        return hash(self._digest)


@checked
@dataclass(frozen=True)
class WheelsetOnTrack:
    """A wheelset and the track under it; the sides may differ in profile and in radius.

    Parameters
    ----------
    left, right : WheelOnRail
    half_distance : float
        Tape circle from the wheelset's centre, m.
    gauge : float
        Distance between the rails' innermost points within ``gauge_depth`` of their tops, m.
    gauge_depth : float
        m; 14 mm in the Manchester contact benchmark. The reference rail of UIC 519 is drawn about a point 0.492 mm
        lower than its top, from which its 14 mm count: 14.492 mm here, or a gauge of 1435.195 mm. That point then lies
        at 750 mm.

    Examples
    --------
    >>> import wrcore as wr
    >>> pair = wr.WheelsetOnTrack.alike(wr.named_profile("S1002", "wheel"), wr.named_profile("60E1", "rail", 1 / 40))
    >>> pair.base, round(pair.rail_distance(pair.left), 4)
    (1.5, 0.7605)
    """

    left: WheelOnRail
    right: WheelOnRail
    half_distance: float = 0.75
    gauge: float = 1.435
    gauge_depth: float = GAUGE_DEPTH

    def __post_init__(self):
        for name, bounds in (("half_distance", HALF_DISTANCES), ("gauge", GAUGES), ("gauge_depth", (1e-6, 0.1))):
            check_number(getattr(self, name), *bounds, "track", name, "m")
        for name in SIDES:
            side = getattr(self, name)
            if math.isnan(side.rail.gauge_offset(self.gauge_depth)):
                raise InputError(side.rail.name, "gauge", f"expected a rail down to {self.gauge_depth} m, got a part")
            places = {"half_distance": self.half_distance, "rail_distance": self.rail_distance(side)}
            object.__setattr__(self, name, replace(side, **places))

    @classmethod
    @checked
    def alike(
        cls,
        wheel: ProfileCurve,
        rail: ProfileCurve,
        gauge: float = 1.435,
        rolling_radius: float = 0.46,
        half_distance: float = 0.75,
    ) -> WheelsetOnTrack:
        """Return a wheelset on track whose right side is the mirror image of the left side: the usual case."""
        side = WheelOnRail(wheel, rail, rolling_radius)
        return cls(side, side, half_distance, gauge)

    @property
    def base(self) -> float:
        """Distance of the tape circles, m: the standard's e = 1500 mm at standard gauge."""
        return 2.0 * self.half_distance

    @property
    def mean_radius(self) -> float:
        """Mean of both rolling radii, m."""
        return 0.5 * (self.left.rolling_radius + self.right.rolling_radius)

    def rail_distance(self, side: WheelOnRail) -> float:
        """Distance of the origin of a side's rail from the track's centre line, m, positive."""
        return 0.5 * self.gauge + side.rail.gauge_offset(self.gauge_depth)
