"""Flexible track under each wheelset: masses, springs and dampers from a scene's key ``track.support``."""

import numpy as np

from wrcore.track.flexible_track import RAILS, FlexibleTrack, rigid_track

SLEEPER_Y, SLEEPER_Z, SLEEPER_ROLL = RAILS, RAILS + 1, RAILS + 2  # sleeper freedoms, after those of the rails


LEAST_RAIL_MASS = 0.1
"""Smallest accepted mass of a rail under a wheel, kg, unless it is 0. At 0.001 kg the rounding of contact forces
accelerates the rail by 1e-5 m/s^2, and no static equilibrium is found (suspended wheelset, springs of 1e8 and
1e12 N/m)."""


def read_support(spec, half_distance, first_state, reader):
    """Return the `FlexibleTrack` under each wheelset from a scene's ``track.support``, or `rigid_track` if it is None.

    ``half_distance`` is the lateral distance of each rail from the track's centre line, m. Each half of the ballast is
    taken to support the sleeper under one rail. ``first_state`` is the index of the track's first state after the
    states of the bodies. InputError if values contradict each other.
    """
    if spec is None:
        return rigid_track()
    _check(spec, reader.at("track.support.rail"))
    rail, sleeper = spec["rail"], spec.get("sleeper")
    d = RAILS + (3 if sleeper else 0)
    mass, matrices = np.full(d, float(rail["mass"])), (np.zeros((d, d)), np.zeros((d, d)))
    if sleeper:
        mass[RAILS:] = sleeper["mass"], sleeper["mass"], sleeper["roll_inertia"]
    for side, lever in enumerate((half_distance, -half_distance)):
        foot = {SLEEPER_Z: 1.0, SLEEPER_ROLL: lever} if sleeper else {}  # height of the sleeper under this rail
        _add(matrices, rail["lateral"], {2 * side: 1.0, **({SLEEPER_Y: -1.0} if sleeper else {})})
        _add(matrices, rail["vertical"], {2 * side + 1: 1.0, **{freedom: -share for freedom, share in foot.items()}})
        if sleeper:
            _add(matrices, sleeper["vertical"], foot, 0.5)
            _add(matrices, sleeper["lateral"], {SLEEPER_Y: 1.0}, 0.5)
    return FlexibleTrack(mass, *matrices, first_state)


def _check(spec, reader):
    """Raise an InputError if values of ``track.support`` contradict each other."""
    mass = spec["rail"]["mass"]
    if 0.0 < mass < LEAST_RAIL_MASS:
        expected = f"expected at least {LEAST_RAIL_MASS:g} kg, or 0 for rails without mass, got {mass:g}"
        raise reader.error("mass", expected)
    if mass == 0.0 and "sleeper" in spec:
        raise reader.error("mass", "expected a mass above 0 in kg on a sleeper")
    for direction in ("lateral", "vertical"):
        if mass == 0.0 and spec["rail"][direction]["damping"] == 0.0:
            raise reader.error(f"{direction}.damping", "expected a damping above 0 in N s/m under a rail without mass")


def _add(matrices, spring, stretch, share=1.0):
    """Add a spring and damper to the matrices K and C, weighted by ``share``.

    ``stretch`` maps each degree of freedom to its factor in the spring's extension.
    """
    row = np.zeros(len(matrices[0]))
    row[list(stretch)] = list(stretch.values())
    for matrix, key in zip(matrices, ("stiffness", "damping"), strict=True):
        matrix += share * spring[key] * np.outer(row, row)
