"""Hard cases of the geometry: worn, kinked, noisy, sparse and truncated wheel profiles."""

from dataclasses import replace
from itertools import product

import numpy as np

from study.hard_cases.cases import Check, contacts, impulse_error, prepare, refused, rows, run, sound
from wrcore.contact.search import reduction
from wrcore.errors import InputError
from wrcore.geometry.profiles.profile import ProfileCurve
from wrcore.scene.compile import compile_scene

IMPULSE_ERROR = 1e-3
"""Accepted error of the impulse, relative to that of the load. It is about the accuracy of integrals of forces sampled
at the output rate."""

HALF_SPACE = 0.1
"""Maximum ratio of a semi-axis to the rail head's radius for which a patch is regarded as plane."""

HEAD_RADIUS = 0.3
"""Radius of the UIC60's running surface, m (60E1: EN 13674-1)."""


def worn(wheel, rail, offset, share, reach):
    """Return ordinates (n,), m, at the nodes of a wheel profile that is worn towards the rail around the tape circle.

    Wear has closed a ``share`` of the gap at the tape circle and ends at the distance ``reach`` (m) from it. ``offset``
    (m) is the wheel's minus the rail's lateral coordinate of the same position in the track.
    """
    on_rail = np.clip(wheel.u - offset, rail.u[0], rail.u[-1])
    gap = wheel.f - np.interp(on_rail, rail.u, rail.f)
    near = np.abs(wheel.u) < reach
    window = np.where(near, np.cos(0.5 * np.pi * wheel.u / reach) ** 2, 0.0)
    return wheel.f - share * window * (gap - np.min(gap[near]))


def kinked(wheel, height, place, half_width):
    """Return the ordinates (m) of a wheel profile with a triangular ridge, or a groove for negative height."""
    return wheel.f - height * np.clip(1.0 - np.abs(wheel.u - place) / half_width, 0.0, None)


SHAPES = {"worn": {"share", "reach"}, "kinked": {"height", "place", "half_width"}, "plain": set()}
"""Arguments of the kinds of profiles."""


def sampled(wheel, ordinates, spacing, noise=0.0, seed=0, smoothing=0.0, end=np.inf):
    """Return a `ProfileCurve` through equally spaced points of a wheel profile with given ordinates (n,) at its nodes.

    Points reach up to ``end``. ``noise`` is the standard deviation added to ordinates, ``smoothing`` the root mean
    square distance allowed between curve and points. All lengths are in m.
    """
    u = np.append(-np.arange(0.0, -wheel.u[0], spacing)[:0:-1], np.arange(0.0, wheel.u[-1], spacing))
    u = u[u <= end]
    f = np.interp(u, wheel.u, ordinates) + noise * np.random.default_rng(seed).standard_normal(len(u))
    return ProfileCurve.from_points(u, f, "wheel", "points of the case", trim=True, smoothing=smoothing)


def variants(setting, entries):
    """Return functions that make the wheel profiles of the cases, by name.

    Each function returns a ProfileCurve or raises InputError. The entries contain ``kind`` (worn, kinked or plain), its
    arguments, and those of :func:`sampled`.
    """
    scene = setting.scene
    offset = scene.track.rail_distance(scene.rail) - scene.vehicle.half_distance

    def maker(entry):
        given = dict(entry)
        kind, shape = given.pop("kind"), given.pop("shape", {})
        if kind == "worn":
            ordinates = worn(scene.wheel, scene.rail, offset, **shape)
        elif kind == "kinked":
            ordinates = kinked(scene.wheel, **shape)
        else:
            ordinates = scene.wheel.f
        return lambda: sampled(scene.wheel, ordinates, **given)

    return {name: maker(entry) for name, entry in entries.items()}


def profiles(vehicles, names, entries, duration, detections, methods):
    """Run vehicles on unusual profiles (``entries`` of :func:`variants`) for a duration (s); return rows of the table.

    Results must satisfy the laws of mechanics, or the profile must be refused.
    """
    found = []
    for name in names:
        for case, make in variants(prepare(vehicles, name), entries).items():
            for detection, method in product(detections, methods):
                changes = {"contact.detection": detection, "integration.method": method, "initial.y": 0.003}
                label = {"vehicle": name, "detection": detection, "integrator": method}
                try:
                    setting = prepare(vehicles, name, changes, wheel=make())
                except InputError:
                    plain = prepare(vehicles, name, changes)
                    attempt = _attempt(plain, make)
                    found += refused("profiles", case, "0.003 m off the centre", label, attempt)
                    continue
                trajectory = run(setting, duration, 2000.0)
                checks = [*sound(setting, trajectory), *_profile_checks(setting, trajectory)]
                condition = f"{setting.model.speed:g} m/s, 0.003 m off the centre"
                found += rows("profiles", case, condition, setting, trajectory, checks)
    return found


def _attempt(setting, make):
    return lambda: compile_scene(replace(setting.scene, wheel=make()))


def _profile_checks(setting, trajectory):
    """Return the checks of Newton's law for the vertical motion of all bodies, and of the size of the patches."""
    patches = contacts(setting.model, trajectory.t, trajectory.states)
    off = impulse_error(setting, trajectory, patches)
    largest = float(np.nanmax(patches[..., reduction.SEMI_B])) / HEAD_RADIUS
    return [
        Check("impulse of the rails less load and momentum, of the load's", off, IMPULSE_ERROR, "1", "Newton's law"),
        Check("largest semi-axis over the rail head's radius", largest, HALF_SPACE, "1", "half-space theory"),
    ]
