"""Wheel and rail profiles of a scene, and the `WheelOnRail` of each wheel if wheels or rails differ."""

import math
from dataclasses import replace
from pathlib import Path

from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.errors import InputError, one_of
from wrcore.errors.checked_yaml import parse_ratio
from wrcore.geometry.profiles.files import POINT_FILES
from wrcore.geometry.profiles.standards import named_profile
from wrcore.geometry.track import SIDES

LARGEST_WEAR = 0.05  # largest accepted difference of a radius from the vehicle's, m; it detects wrong units


def wheel_and_rail(data, reader):
    """Return the scene's common wheel and rail profile."""
    return tuple(_profile(data[kind], kind, reader.at(kind)) for kind in ("wheel", "rail"))


def differing_pairs(data, vehicle, wheel, rail, track, reader):
    """Return left and right `WheelOnRail` of each wheelset from the front; empty if all are ``wheel`` on ``rail``."""
    single = data["wheel"].get("wheelsets", {})
    unknown = sorted(set(single) - set(vehicle.wheelset_names))
    if unknown:
        raise reader.error(f"wheel.wheelsets.{unknown[0]}", one_of(vehicle.wheelset_names, unknown[0]))
    if not single and not any(side in data[kind] for kind in ("wheel", "rail") for side in SIDES):
        return ()
    sides = []
    for side in SIDES:
        under = _rail_of(data["rail"], side, rail, reader.at("rail", side))
        pair = WheelOnRail(wheel, under, vehicle.rolling_radius, vehicle.half_distance, track.rail_distance(under))
        sides.append(_wheel_of(data["wheel"].get(side, {}), pair, reader.at("wheel", side)))
    return tuple(
        _wheel_of(single.get(name, {}).get(side, {}), pair, reader.at("wheel.wheelsets", name, side))
        for name in vehicle.wheelset_names
        for side, pair in zip(SIDES, sides, strict=True)
    )


def _rail_of(spec, side, rail, reader):
    """Return the rail profile of one side.

    The common inclination applies unless the side states another one or its points are already inclined.
    """
    if not spec.get(side):
        return rail
    both = {key: spec[key] for key in ("profile", "inclination") if key in spec}
    profile = spec[side].get("profile")
    if isinstance(profile, dict) and profile.get("inclined") is True:
        both.pop("inclination", None)
    return _profile({**both, **spec[side]}, "rail", reader)


def _wheel_of(spec, pair, reader):
    """Return a pair with the wheel profile and rolling radius that ``spec`` states for its wheel."""
    if not spec:
        return pair
    wheel = _profile(spec, "wheel", reader) if "profile" in spec else pair.wheel
    radius = float(spec.get("rolling_radius", pair.rolling_radius))
    if abs(radius - pair.rolling_radius) > LARGEST_WEAR:
        expected = f"expected a radius within {LARGEST_WEAR:g} m of {pair.rolling_radius:g} m, got {radius:g}"
        raise reader.error("rolling_radius", expected)
    return replace(pair, wheel=wheel, rolling_radius=radius)


def _ratio(value, reader):
    """Return an inclination, a number or a fraction such as '1/40', as a number; None stays None."""
    if value is None:
        return None
    ratio = parse_ratio(value)
    if math.isnan(ratio):
        raise reader.error("inclination", f"expected a ratio such as 1/40, got {value!r}")
    if abs(ratio) > 0.2:
        raise reader.error("inclination", f"expected a ratio within 1/5, got {value!r}")
    return ratio


def _profile(spec, kind, reader):
    """Return the profile of the kind "wheel" or "rail" that a part of a scene names."""
    profile = spec["profile"]
    inclination = _ratio(spec.get("inclination"), reader) if kind == "rail" else None
    if isinstance(profile, dict) and isinstance(profile.get("points"), str):
        profile = {**profile, "points": str(reader.file(profile["points"], "profile.points"))}
    elif isinstance(profile, str) and Path(profile).suffix.lower() in POINT_FILES:
        profile = str(reader.file(profile, "profile"))
    try:
        return named_profile(profile, kind, inclination)
    except InputError as error:
        if error.source in (kind, "profile"):  # the error is in the scene, not in a profile's file
            raise reader.error("inclination" if error.field == "inclination" else "profile", error.expected) from None
        raise
