"""Wheel of revolution and rail extruded along the track: Eqs. (1)-(6) of Ferreira, Flores and Marques.

These functions are the readable definition of the surfaces. They serve figures and tests; the contact search
evaluates the same surfaces in compiled form (:mod:`wrcore.contact.detection`).
"""

import numpy as np

from wrcore.geometry.track import rotation

SIDES = {"left": 1.0, "right": -1.0}


def wheel_surface(wheel, r0, half_distance, side, u, s):
    """Points of a wheel's surface in the wheelset's frame, Eqs. (4)-(6).

    Parameters
    ----------
    wheel : ProfileCurve
        Wheel profile, ordinate zero at the tape circle.
    r0 : float
        Rolling radius at the tape circle, m.
    half_distance : float
        Distance of the tape circle from the wheelset's centre, m.
    side : {"left", "right"}
    u, s : array_like
        Lateral coordinate (m, to the field side) and angle about the axle (rad); broadcast together.

    Returns
    -------
    numpy.ndarray, shape (..., 3)
        Points, m. ``s = 0`` is the lowest generator; s turns about the side's outward axle direction.
    """
    u, s = np.broadcast_arrays(np.asarray(u, float), np.asarray(s, float))
    f = wheel(u) - r0
    local = np.stack([f * np.sin(s), u, f * np.cos(s)], axis=-1)
    sign = SIDES[side]
    return local * np.array([sign, sign, 1.0]) + np.array([0.0, sign * half_distance, 0.0])


def wheelset_transform(points, x=0.0, y=0.0, z=0.0, roll=0.0, yaw=0.0):
    """Points of the wheelset's frame, shape (..., 3), moved to the track frame by a pose (m, rad)."""
    return np.asarray(points) @ rotation(roll, yaw).T + np.array([x, y, z])


def rail_surface(rail, track, side, u, x):
    """Points of a rail's surface in the track frame, Eqs. (1)-(3) on a tangent track.

    Parameters
    ----------
    rail : ProfileCurve
        Rail profile as it lies in the track.
    track : Track
    side : {"left", "right"}
    u, x : array_like
        Lateral coordinate (m, to the field side) and arc length along the track (m); broadcast together.

    Returns
    -------
    numpy.ndarray, shape (..., 3)
        Points, m.
    """
    u, x = np.broadcast_arrays(np.asarray(u, float), np.asarray(x, float))
    return np.stack([x, SIDES[side] * (track.rail_distance(rail) + u), rail(u)], axis=-1)
