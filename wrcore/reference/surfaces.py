"""Surfaces of a wheel (of revolution) and a rail (along the track), Eqs. (1)-(6) of Ferreira, Flores and Marques.

These functions are the readable definition of the surfaces. They serve figures and tests; the contact search
evaluates the same surfaces in compiled form (:mod:`wrcore.contact.search.detection`).
"""

import numpy as np

from wrcore.geometry.irregularity import irregularity_at
from wrcore.geometry.path import track_frame
from wrcore.geometry.track import SIDES, rotation


def wheel_surface(wheel, r0, half_distance, side, u, s):
    """Return points (..., 3) of a wheel's surface in the wheelset's frame, m, Eqs. (4)-(6).

    Lateral coordinates u (m) and angles s (rad) broadcast. ``s = 0`` is the lowest generator; s is positive about the
    side's outward axle direction. The tape circle has the radius ``r0`` and the distance ``half_distance`` from the
    centre, m."""
    u, s = np.broadcast_arrays(np.asarray(u, float), np.asarray(s, float))
    f = wheel(u) - r0
    local = np.stack([f * np.sin(s), u, f * np.cos(s)], axis=-1)
    sign = SIDES[side]
    return local * np.array([sign, sign, 1.0]) + np.array([0.0, sign * half_distance, 0.0])


def wheelset_transform(points, x=0.0, y=0.0, z=0.0, roll=0.0, yaw=0.0):
    """Transform points (..., 3) from the wheelset's frame to the track frame, by position (m) and attitude (rad)."""
    return np.asarray(points) @ rotation(roll, yaw).T + np.array([x, y, z])


def rail_surface(rail, track, side, u, s):
    """Return points (..., 3) of a rail's surface in the track's absolute frame, m, Eqs. (1)-(3).

    Lateral coordinates u and arc lengths s of the centre line (m) broadcast.

    r_P = r_r(s) + A_r(s) {0, u, f(u)}, A_r = [t n b]. The rail's origin r_r lies in the track's cross-section at s, at
    half the gauge plus its part of the widening, moved by the irregularity. The profile lies in that cross-section
    without rotation: A_r is the frame of the track. A profile normal to the rail's line would differ by the square of
    the angle between rail and track, 1e-5 of the profile's size in a steep cant ramp.
    """
    u, s = np.broadcast_arrays(np.asarray(u, float), np.asarray(s, float))
    lateral, height = SIDES[side] * (track.rail_distance(rail) + u), rail(u)
    if track.tangent:
        return np.stack([s, lateral, height], axis=-1)
    position, frames, deviation = _along(track, s, side)
    lateral, height = lateral + deviation[..., 0], height + deviation[..., 1]
    return position + lateral[..., None] * frames[..., 1] + height[..., None] * frames[..., 2]


def _along(track, s, side):
    """Return centre line (..., 3), frames (..., 3, 3) and lateral and vertical deviation of a rail (..., 2) at s."""
    position, frames, deviation = np.empty((s.size, 3)), np.empty((s.size, 3, 3)), np.zeros((s.size, 2))
    first, values = (0 if side == "left" else 2), np.zeros((3, 4))
    for i, at in enumerate(s.flat):
        station = track_frame(track.path, at, frames[i])
        irregularity_at(track.irregularity, at, values)
        position[i] = station.x, station.y, station.z
        deviation[i] = values[0, first : first + 2]
        deviation[i, 0] += (0.5 * SIDES[side] + track.path.aside) * station.widening
    return position.reshape(*s.shape, 3), frames.reshape(*s.shape, 3, 3), deviation.reshape(*s.shape, 2)
