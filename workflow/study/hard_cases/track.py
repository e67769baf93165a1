"""Hard cases of the track: irregular rails, and a sharp curve at balance speed and above."""

import math
from itertools import product

import numpy as np

from study.hard_cases.cases import Check, contacts, impulse_error, prepare, rows, run, sound, wheel_forces
from wrcore.bodies.marker import FRAME

CANT_BASE = 1.5
"""Lateral distance over which cant is measured, m."""

IMPULSE_ERROR = 2e-3
"""Accepted error of the impulse, relative to that of the load. Forces on irregular rails are sampled at the output
rate."""

CURVE_ERROR = 5e-3
"""Accepted error of forces in the curve, relative to the weight. Oscillations of the bodies contribute this much to a
mean over some seconds."""


def balance_speed(radius, cant):
    """Return the speed (m/s) at which a curve's cant balances the lateral acceleration."""
    return math.sqrt(9.81 * abs(radius) * math.tan(math.asin(cant / CANT_BASE)))


def irregular(vehicles, speeds, spectra, length, duration, methods, detections):
    """Run vehicles for a duration (s) on a length (m) of irregular straight track; return rows of the table.

    Speeds (m/s) are given by vehicle; ``spectra`` are pairs of level and seed. Vehicles must stay on the track, and the
    rails must carry the load.
    """
    found = []
    for name, (level, seed), method, detection in product(speeds, spectra, methods, detections):
        for speed in speeds[name]:
            spectrum = {"level": level, "seed": seed, "length": length, "begin": 15.0}
            changes = {"speed": speed, "integration.method": method, "contact.detection": detection, "initial.y": 0.0}
            setting = prepare(vehicles, name, changes | {"track.irregularity": {"spectrum": spectrum}})
            trajectory = run(setting, duration, 2000.0)
            patches = contacts(setting.model, trajectory.t, trajectory.states)
            off = impulse_error(setting, trajectory, patches)
            source = "Newton's law for all bodies"
            checks = [
                *sound(setting, trajectory),
                Check("impulse of the rails less load and momentum, of the load's", off, IMPULSE_ERROR, "1", source),
            ]
            condition = f"{speed:g} m/s, level {level}, seed {seed}"
            found += rows("track", "irregular", condition, setting, trajectory, checks)
    return found


def curve(vehicles, names, radius, cant, lengths, shares, duration, methods, detections):
    """Check the forces of all wheels on the rails in a curve of given radius and cant (m), at balance speed and above.

    ``lengths`` (m) are tangent, transition and curve; ``shares`` are speeds relative to balance speed. Runs take a
    duration (s), and the checks use its last quarter. Returns rows of the table, and history of Y_N (lateral, all
    wheels) and expected_N over t_s.

    In the track's canted axes the vertical force on the rails is m (g cos + V^2/R sin). The lateral force is
    m (V^2/R cos - g sin). The angle is that of the cant.
    """
    found, history = [], []
    tangent, transition, length = lengths
    path = [{"tangent": tangent}, {"transition": transition}, {"curve": length, "radius": radius, "cant": cant}]
    for name, share, method, detection in product(names, shares, methods, detections):
        speed = share * balance_speed(radius, cant)
        changes = {"speed": speed, "integration.method": method, "contact.detection": detection, "initial.y": 0.0}
        setting = prepare(vehicles, name, changes | {"track.path": path})
        trajectory = run(setting, duration)
        vertical, lateral = wheel_forces(contacts(setting.model, trajectory.t, trajectory.states))
        vertical, lateral = np.sum(vertical, axis=(1, 2)), np.sum(lateral, axis=(1, 2))
        checks, expected = _in_curve(setting, trajectory, vertical, lateral, radius, cant)
        condition = f"R {radius:g} m, cant {1e3 * cant:g} mm, {speed:.1f} m/s ({share:g} of balance)"
        found += rows("track", "curve", condition, setting, trajectory, [*sound(setting, trajectory), *checks])
        label = {"vehicle": name, "detection": detection, "integrator": trajectory.method, "share": share}
        history += [label | {"t_s": t, "Y_N": y, "expected_N": expected}
                    for t, y in zip(trajectory.t[::10], lateral[::10], strict=True)]  # fmt: skip
    return found, history


def _in_curve(setting, trajectory, vertical, lateral, radius, cant):
    """Return the checks of the forces in the curve, and the expected lateral force on the rails, N."""
    elements, mass = setting.model.elements, float(np.sum(setting.model.bodies.mass))
    held = np.flatnonzero(elements.pairs[:, 1] == FRAME)
    springs = [k for p in held for k in range(elements.first_spring[p], elements.first_spring[p + 1])]
    angle, push = math.asin(cant / CANT_BASE), setting.model.speed**2 / radius
    gravity, weight = setting.model.gravity, mass * setting.model.gravity
    load = mass * (gravity * math.cos(angle) + push * math.sin(angle)) - elements.springs[springs, 14].sum()
    sideways = -mass * (push * math.cos(angle) - gravity * math.sin(angle))
    late = trajectory.t >= 0.75 * trajectory.t[-1]
    checks = [
        Check("vertical force less m (g cos + V^2/R sin), of the weight",
              abs(float(np.mean(vertical[late])) - load) / weight, CURVE_ERROR, "1", "Newton's law in the curve"),
    ]  # fmt: skip
    if not np.any(elements.springs[springs, 7]):  # only the rails guide the vehicle laterally
        off = abs(float(np.mean(lateral[late])) - sideways) / weight
        source = "Newton's law in the curve"
        checks.append(Check("lateral force less m (V^2/R cos - g sin), of the weight", off, CURVE_ERROR, "1", source))
    return checks, sideways
