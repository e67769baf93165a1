"""Wheel and rail profiles of a scene, and the `WheelOnRail` of each wheel if wheels or rails differ."""

import math
import os
from dataclasses import replace
from pathlib import Path

from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.errors import InputError, one_of
from wrcore.errors.checked_yaml import parse_ratio
from wrcore.errors.input_files import digest_of_file
from wrcore.geometry.changing_rails.files import profiles_in
from wrcore.geometry.profiles.files import POINT_FILES
from wrcore.geometry.profiles.standards import named_profile
from wrcore.geometry.track import SIDES

LARGEST_WEAR = 0.05  # largest accepted difference of a radius from the vehicle's, m; it detects wrong units
NAMED_BY = (
    "parameters",
    "profile",
    "points",
    "slices",
    "table",
)  # keys of a scene whose values name files


def find_file(path, folder, source, field):
    """Return the path of a file named in a scene.

    The name is relative to the scene's folder, to the folder above it, or to the working directory, in this order.
    """
    found = _found(path, folder)
    if found is None:
        raise InputError(source, field, f"expected an existing file, got {path!r}")
    return found


def _found(path, folder):
    for base in (folder, folder.parent, Path()):
        if os.path.isfile(base / path):  # Path.is_file raises where a name is too long or a folder is closed
            return base / path
    return None


def digests_of_files(value, folder, key=""):
    """Return the SHA-256, by path, of all files that a scene's content or a part of it names.

    Profiles that files of slices name are included.
    """
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else ((key, item) for item in value)
        return {path: digest for name, item in items for path, digest in digests_of_files(item, folder, name).items()}
    found = _found(value, folder) if key in NAMED_BY and isinstance(value, str) else None
    if found is None:
        return {}
    listed = [path for path in profiles_in(found) if os.path.isfile(path)] if key == "slices" else []
    return {str(path): digest_of_file(path) for path in (found, *listed)}


def with_names(value, folder, names, key=""):
    """Return a scene's content, or a part of it, with renamed files; ``names`` maps their paths to new names."""
    if isinstance(value, dict):
        return {name: with_names(item, folder, names, name) for name, item in value.items()}
    if isinstance(value, list):
        return [with_names(item, folder, names, key) for item in value]
    found = _found(value, folder) if key in NAMED_BY and isinstance(value, str) else None
    return value if found is None else names[str(found)]


def wheel_and_rail(data, folder, source):
    """Return the scene's common wheel and rail profile; file names are relative to ``folder``."""
    return tuple(_profile(data[kind], kind, kind, folder, source) for kind in ("wheel", "rail"))


def differing_pairs(data, vehicle, wheel, rail, track, folder, source):
    """Return left and right `WheelOnRail` of each wheelset from the front; empty if all are ``wheel`` on ``rail``."""
    single = data["wheel"].get("wheelsets", {})
    unknown = sorted(set(single) - set(vehicle.wheelset_names))
    if unknown:
        raise InputError(source, f"wheel.wheelsets.{unknown[0]}", one_of(vehicle.wheelset_names, unknown[0]))
    if not single and not any(side in data[kind] for kind in ("wheel", "rail") for side in SIDES):
        return ()
    sides = []
    for side in SIDES:
        under = _rail_of(data["rail"], side, rail, folder, source)
        pair = WheelOnRail(wheel, under, vehicle.rolling_radius, vehicle.half_distance, track.rail_distance(under))
        sides.append(_wheel_of(data["wheel"].get(side, {}), f"wheel.{side}", pair, folder, source))
    return tuple(
        _wheel_of(single.get(name, {}).get(side, {}), f"wheel.wheelsets.{name}.{side}", pair, folder, source)
        for name in vehicle.wheelset_names
        for side, pair in zip(SIDES, sides, strict=True)
    )


def _rail_of(spec, side, rail, folder, source):
    """Return the rail profile of one side.

    The common inclination applies unless the side states another one or its points are already inclined.
    """
    if not spec.get(side):
        return rail
    both = {key: spec[key] for key in ("profile", "inclination") if key in spec}
    profile = spec[side].get("profile")
    if isinstance(profile, dict) and profile.get("inclined") is True:
        both.pop("inclination", None)
    return _profile({**both, **spec[side]}, "rail", f"rail.{side}", folder, source)


def _wheel_of(spec, field, pair, folder, source):
    """Return a pair with the wheel profile and rolling radius that ``spec`` states for its wheel."""
    if not spec:
        return pair
    wheel = _profile(spec, "wheel", field, folder, source) if "profile" in spec else pair.wheel
    radius = float(spec.get("rolling_radius", pair.rolling_radius))
    if abs(radius - pair.rolling_radius) > LARGEST_WEAR:
        expected = f"expected a radius within {LARGEST_WEAR:g} m of {pair.rolling_radius:g} m, got {radius:g}"
        raise InputError(source, f"{field}.rolling_radius", expected)
    return replace(pair, wheel=wheel, rolling_radius=radius)


def _ratio(value, source, field):
    """Return an inclination, a number or a fraction such as '1/40', as a number; None stays None."""
    if value is None:
        return None
    ratio = parse_ratio(value)
    if math.isnan(ratio):
        raise InputError(source, field, f"expected a ratio such as 1/40, got {value!r}")
    if abs(ratio) > 0.2:
        raise InputError(source, field, f"expected a ratio within 1/5, got {value!r}")
    return ratio


def _profile(spec, kind, where, folder, source):
    """Return the profile that the mapping under the key ``where`` names; files are relative to ``folder``."""
    field, profile = f"{where}.profile", spec["profile"]
    inclination = _ratio(spec.get("inclination"), source, f"{where}.inclination") if kind == "rail" else None
    if isinstance(profile, dict) and isinstance(profile.get("points"), str):
        profile = {**profile, "points": str(find_file(profile["points"], folder, source, f"{field}.points"))}
    elif isinstance(profile, str) and Path(profile).suffix.lower() in POINT_FILES:
        profile = str(find_file(profile, folder, source, field))
    try:
        return named_profile(profile, kind, inclination)
    except InputError as error:
        if error.source in (kind, "profile"):  # the error is in the scene, not in a profile's file
            named = f"{where}.inclination" if error.field == "inclination" else field
            raise InputError(source, named, error.expected) from None
        raise
