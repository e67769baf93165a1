"""Check rails from a scene's key ``track.check_rails``."""

import math

import numpy as np

from wrcore.geometry.track import SIDES
from wrcore.track.check_rail import CheckRails, no_check_rails


def read_check_rails(data, pairs, reader):
    """Return the `CheckRails` of a scene's content, checked against the schema.

    ``pairs`` are the `WheelOnRail` of all wheels, left and right of each wheelset from the front.
    """
    specs = data["track"].get("check_rails", ())
    rows = [
        [_row(data["track"], spec, pair[list(SIDES).index(spec["rail"])], reader.at(f"track.check_rails[{k}]"))
         for k, spec in enumerate(specs)] for pair in zip(pairs[::2], pairs[1::2], strict=True)
    ]  # fmt: skip
    if specs and "energy" in data["output"]["channels"]:
        expected = "expected no energy with track.check_rails, whose friction has no account"
        raise reader.error("output.channels", f"{expected}, got energy")
    return CheckRails(np.array(rows, float)) if specs else no_check_rails()


def _row(track, spec, pair, reader):
    """Return the row of `CheckRails` for one check rail and the wheel of a `WheelOnRail`."""
    flare, face = spec["flare"], 0.5 * track["gauge"] - spec["flangeway"]
    if not 2.0 * flare["length"] <= spec["length"]:
        expected = f"expected at least two flares of {flare['length']:g} m, got {spec['length']:g} m"
        raise reader.error("length", expected)
    radius = pair.rolling_radius - pair.wheel.f[0]
    down, back = pair.rolling_radius - spec["top"], 0.5 * spec["back_to_back"]
    if not radius > down:
        expected = f"expected more than {1e3 * pair.wheel.f[0]:.1f} mm, down to where the wheel's profile ends"
        raise reader.error("top", f"{expected}, got {1e3 * spec['top']:g} mm")
    if not face < back:
        least = 0.5 * track["gauge"] - back
        expected = f"expected more than {1e3 * least:.1f} mm, so that it does not press a wheelset in the middle"
        raise reader.error("flangeway", f"{expected}, got {1e3 * spec['flangeway']:g} mm")
    return (
        SIDES[spec["rail"]], spec["begin"], spec["begin"] + spec["length"], face, flare["length"], flare["opening"],
        back, math.sqrt(radius**2 - down**2), down, spec["stiffness"], spec["friction"],
    )  # fmt: skip
