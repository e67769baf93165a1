"""Out-of-round wheels, from the keys ``out_of_round`` below a scene's ``wheel``."""

import json

import numpy as np

from wrcore.contact.changing_rails.out_of_round import SlicedWheel
from wrcore.errors import InputError
from wrcore.errors.column_files import named_columns, read_column_file
from wrcore.errors.messages import warn
from wrcore.geometry.changing_rails.slices import TURN
from wrcore.geometry.out_of_round import Flat, Measured, OutOfRound, Wave
from wrcore.geometry.track import SIDES
from wrcore.scene.parts.changing_rails import STEEPEST_ALONG, slices_named

LARGEST = 0.01
"""Largest accepted deviation from the round wheel, or from the scene's wheel profile, m; it detects wrong units."""

SWING = 0.5
"""Accepted overshoot of the spline beyond the measured deviations, as a fraction of their range; a tenth of it if the
angles have gaps."""

NARROWER = 2e-3
"""Distance before the end of the wheel's profile; wrcore warns if sections end further from it, m."""


def read_out_of_round(data, vehicle, pairs, crossings, reader):
    """Return (shape, angle) of each wheel, left and right, wheelset after wheelset; empty if all wheels are round.

    The shape is an `OutOfRound` or a `SlicedWheel`, or None for a round wheel; the angle (rad) is the wheel's angle at
    the contact at the beginning. ``pairs`` are those of the scene.
    """
    shapes, known = [], {}
    for k, pair in enumerate(pairs):
        side, name = list(SIDES)[k % 2], vehicle.wheelset_names[k // 2]
        part, spec = reader.at("wheel", side), data["wheel"].get(side, {}).get("out_of_round")
        single = data["wheel"].get("wheelsets", {}).get(name, {}).get(side, {})
        if "out_of_round" in single:
            part, spec = reader.at("wheel.wheelsets", name, side), single["out_of_round"]
        shape, angle = None, 0.0
        if spec:
            key = json.dumps({**spec, "angle": 0.0, "radius": pair.rolling_radius}, sort_keys=True), id(pair.wheel)
            if key not in known:
                known[key] = _shape(spec, pair, part.at("out_of_round"))
            shape, angle = known[key], float(spec["angle"])
            if any(crossing.rails[k % 2] is not None for crossing in crossings):
                expected = f"expected a round wheel on the {side} rail, where track.crossing changes it"
                raise part.error("out_of_round", expected)
        shapes.append((shape, angle))
    if not any(shape for shape, _ in shapes):
        return ()
    return tuple(shapes)


def _shape(spec, pair, reader):
    """Return the shape that ``out_of_round`` of one wheel describes."""
    if "slices" in spec:
        return _sliced(spec, pair, reader)
    radius = pair.rolling_radius
    flats = tuple(Flat(one["length"], one.get("depth"), one["at"]) for one in spec["flats"])
    for k, flat in enumerate(flats):
        if not flat.length < radius:
            expected = f"expected less than the wheel's radius, {radius:g} m, got {flat.length:g}"
            raise reader.error(f"flats.{k}.length", expected)
    waves = [Wave(one["order"], one["amplitude"], one["phase"]) for one in spec["polygon"]]
    if "table" in spec:
        waves.append(_measured(reader.file(spec["table"], "table")))
    if not flats and not waves:
        raise reader.error("", "expected flats, polygon, table or slices, got none")
    shape = OutOfRound(radius, flats, tuple(waves))
    around = np.linspace(0.0, TURN, 20001)
    _check_slope(np.diff(shape.deviation(around)) / (radius * around[1]), reader)
    return shape


def _check_slope(slopes, reader):
    """Raise an InputError if a slope of the wheel's surface along the circumference reaches `STEEPEST_ALONG`."""
    slope = np.abs(slopes).max()
    if not slope < STEEPEST_ALONG:
        expected = f"expected a surface that rises less than {STEEPEST_ALONG:g} along the wheel, got {slope:.3g}"
        raise reader.error("", expected)


def _sliced(spec, pair, reader):
    """Return the `SlicedWheel` of a file of slices; InputError if it does not fit the scene's wheel profile."""
    others = [name for name in ("flats", "polygon", "table") if spec.get(name)]
    if others:
        raise reader.error(others[0], "expected nothing beside slices, which are the whole wheel")
    slices, path = slices_named(spec["slices"], "wheel", reader.at("slices"))
    shape, wheel = SlicedWheel(slices, pair.rolling_radius), pair.wheel
    strips = wheel.u[:: max(round(1e-3 / wheel.spacing), 1)]
    first, last = shape.within(strips)
    if last - first < 10:
        raise InputError(path, "", "expected profiles around the tape circle, u = 0, at all angles")
    ends, strips = strips[[0, -1]], strips[first : last + 1]
    if max(strips[0] - ends[0], ends[1] - strips[-1]) > NARROWER:
        spans = [f"{1e3 * low:.0f} to {1e3 * high:.0f} mm" for low, high in (strips[[0, -1]], ends)]
        warn(f"{path}: sections reach from {spans[0]}, {wheel.name} from {spans[1]}: beyond, it is as at their ends")
    around = np.linspace(0.0, TURN, 3601)
    f, _, rates = shape.slices.heights(around, strips)
    off = np.abs(f - wheel(strips))[:, np.abs(wheel(strips, 1)) < 1.0].max()
    if not off <= LARGEST:
        expected = f"expected sections within {LARGEST:g} m of the scene's wheel {wheel.name}, got {off:.3g} m"
        raise InputError(path, "profile", expected)
    _check_slope(rates / pair.rolling_radius, reader)
    _check_slope(np.diff(f, axis=0) / (pair.rolling_radius * around[1]), reader)  # also where the turn closes
    return shape


def _measured(path):
    """Return the `Measured` deviations of a CSV file with the columns angle_rad and deviation_m."""
    file, known = read_column_file(path), ("angle_rad", "deviation_m")
    found = {name: (k, factor) for k, (name, factor) in named_columns(file, known).items()}
    for name in known:
        if name not in found:
            raise InputError(path, name, f"expected this column; found {', '.join(file.names)}")
    columns, factors = zip(*(found[name] for name in known), strict=True)
    angles, deviations = file.numbers(columns, factors).T
    bad = np.flatnonzero(~np.isfinite(angles + deviations))
    if bad.size:
        raise InputError(path, f"line {file.lines[bad[0]]}", "expected finite numbers")
    if angles.size < 8 or np.any(np.diff(angles) <= 0.0) or angles[-1] - angles[0] > TURN + 1e-9:
        raise InputError(path, "angle_rad", "expected at least 8 angles that increase, within one turn")
    if np.abs(deviations).max() > LARGEST:
        expected = f"expected deviations within {LARGEST:g} m, got {np.abs(deviations).max():g}"
        raise InputError(path, "deviation_m", expected)
    once = slice(None, -1 if angles[-1] - angles[0] > TURN - 1e-6 else None)
    measured = Measured(angles[once], deviations[once])
    gaps, span = np.diff(np.append(measured.angles, measured.angles[0] + TURN)), np.ptp(deviations)
    between = measured.deviation(np.linspace(0.0, TURN, 20001), 0.0)
    swing = max(between.max() - deviations.max(), deviations.min() - between.min())
    if swing > (SWING if gaps.max() < 5.0 * np.median(gaps) else 0.1 * SWING) * span:
        expected = f"expected angles all round, as close as deviations need ({gaps.max():.3g} rad have none)"
        raise InputError(path, "angle_rad", f"{expected}: a spline swings out by {1e3 * swing:.3g} mm between them")
    return measured
