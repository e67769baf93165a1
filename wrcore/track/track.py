"""Motion of a wheelset on curved or irregular track, in the frame of each rail, whose x axis is along the rail.

At the wheelset's arc length s the track has a frame [t n b] (Eq. 3). A rail is at (Y, Z) of this cross-section, which
includes gauge widening and irregularity. Its direction deviates from t by the slopes of both, and by the twist of a
cant ramp. Position, attitude and velocities are transformed to the rail's frame. Contact is solved there as on tangent
track, and forces and moments are transformed back. The rail does not move, except on flexible track
(:mod:`wrcore.track.flexible_track`): only the direction of its surface changes along the track.

Within a patch the rail is straight. Its curvature kappa is part of Hertz's relative curvature. The sagitta kappa x^2/2
over the longitudinal distance x of the contact from the cross-section is neglected (0.5 µm at x = 17 mm and
R = 300 m).
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.bodies.body import OMEGA, STATE_SIZE, VELOCITY, rotation_matrix
from wrcore.bodies.vector import load, store
from wrcore.contact.search.reduction import Y, Z
from wrcore.geometry.irregularity import IrregularityData, irregularity_at
from wrcore.geometry.path import PathData, arc_length_of, frame_turn, rail_direction, track_frame
from wrcore.kernels.jit import FUSED, jit
from wrcore.track.schedule import scheduled
from wrcore.wheels.motion import MOTION


class TrackModel(NamedTuple):
    """Path and irregularity, for kernels."""

    tangent: bool  # straight and level track without irregularity: the functions of this module are not called
    path: PathData
    irregularity: IrregularityData


@jit(allocates=False, fastmath=FUSED)
def turned_into(frame, x, y, z):
    """Return the components of a vector along the columns of a frame."""
    return (
        frame[0, 0] * x + frame[1, 0] * y + frame[2, 0] * z,
        frame[0, 1] * x + frame[1, 1] * y + frame[2, 1] * z,
        frame[0, 2] * x + frame[1, 2] * y + frame[2, 2] * z,
    )


@jit(allocates=False, fastmath=FUSED)
def turned_back(frame, x, y, z):
    """Return the vector with given components along the columns of a frame."""
    return (
        frame[0, 0] * x + frame[0, 1] * y + frame[0, 2] * z,
        frame[1, 0] * x + frame[1, 1] * y + frame[1, 2] * z,
        frame[2, 0] * x + frame[2, 1] * y + frame[2, 2] * z,
    )


@jit(allocates=False, fastmath=FUSED)
def _rail_frame(frame, lateral, vertical, out):
    """Fill ``out`` with the frame of a rail whose direction deviates from t by slopes towards n and b.

    The columns are the t, n and b of the rail."""
    tx, level = 1.0 / math.sqrt(1.0 + lateral * lateral + vertical * vertical), 1.0 / math.sqrt(1.0 + lateral * lateral)
    ty, tz = lateral * tx, vertical * tx
    nx, ny = -lateral * level, level
    for i in range(3):
        out[i, 0] = frame[i, 0] * tx + frame[i, 1] * ty + frame[i, 2] * tz
        out[i, 1] = frame[i, 0] * nx + frame[i, 1] * ny
        # b' = t' x n'
        out[i, 2] = -frame[i, 0] * tz * ny + frame[i, 1] * tz * nx + frame[i, 2] * (tx * ny - ty * nx)


@jit(allocates=False, fastmath=FUSED)
def rail_motions(track, distances, state, at, axle, guess, frame, values, rails, shifts, motions):
    """Fill a wheelset's motion in the frames of its two rails, and return its arc length (m).

    The search for the arc length starts from ``guess``; the result is NaN if there is none. ``distances`` are those of
    the profiles' origins from the track's centre line (m), ``at`` is the start of the wheelset's state, ``axle`` its
    rotation matrix; ``frame`` (3, 3) and ``values`` (3, 4) are scratch. Fills ``rails`` (2, 3, 3), axes of the left and
    the right rail's frame; ``shifts`` (2, 2), offsets from their nominal positions, left and up (m); and ``motions``
    (2, 15), each a `wrcore.wheels.motion.WheelMotion` except for the friction.
    """
    s = arc_length_of(track.path, state[at], state[at + 1], state[at + 2], guess)
    station = track_frame(track.path, s, frame)
    (vx, vy, vz), (wx, wy, wz) = load(state, at + VELOCITY), load(state, at + OMEGA)
    irregularity_at(track.irregularity, s, values)
    _, bend_vertical, bend = frame_turn(station)
    dx, dy, dz = state[at] - station.x, state[at + 1] - station.y, state[at + 2] - station.z
    _, y, z = turned_into(frame, dx, dy, dz)
    for wheel in range(2):
        side, rail, row = 1.0 - 2.0 * wheel, rails[wheel], motions[wheel]
        share = side * 0.5 + track.path.aside
        shift = share * station.widening + values[0, 2 * wheel]
        lift = values[0, 2 * wheel + 1]
        place = side * distances[wheel]
        slope_y = share * station.widening_rate + values[1, 2 * wheel]
        lateral, vertical, _ = rail_direction(station, place + shift, lift, slope_y, values[1, 2 * wheel + 1])
        if not track.path.climbs:
            lateral, vertical = slope_y, values[1, 2 * wheel + 1]
        _rail_frame(frame, lateral, vertical, rail)
        # position of the wheelset's centre relative to the rail's origin, in the rail's frame
        gx, gy, gz = turned_back(frame, 0.0, y - place - shift, z - lift)
        _, ry, rz = turned_into(rail, gx, gy, gz)
        row[MOTION.side], row[MOTION.y], row[MOTION.z] = side, ry + place, rz
        store(turned_into(rail, axle[0, 1], axle[1, 1], axle[2, 1]), row[MOTION.ex :])
        store(turned_into(rail, vx, vy, vz), row[MOTION.vx :])
        store(turned_into(rail, wx, wy, wz), row[MOTION.wx :])
        row[MOTION.bend_y] = bend + values[2, 2 * wheel]
        row[MOTION.bend_z] = -bend_vertical + values[2, 2 * wheel + 1]
        shifts[wheel, 0], shifts[wheel, 1] = shift, lift
    return s


@jit(allocates=False, fastmath=FUSED)
def turn_back_wrenches(rails, shifts, wrenches, patches, counts):
    """Transform forces and moments from the frames of two rails (`rail_motions`) to absolute axes, in place.

    Positions of patches are shifted by the offsets of the rails, to the frame of the track."""
    for wheel in range(2):
        rail, wrench = rails[wheel], wrenches[wheel]
        store(turned_back(rail, wrench[0], wrench[1], wrench[2]), wrench)
        store(turned_back(rail, wrench[3], wrench[4], wrench[5]), wrench[3:])
        for k in range(counts[wheel]):
            patches[wheel, k, Y] += shifts[wheel, 0]
            patches[wheel, k, Z] += shifts[wheel, 1]


@jit(allocates=False, fastmath=FUSED)
def moving_frame(track, speed, t, offset, axes):
    """Return origin (m), velocity (m/s) and angular velocity (rad/s), in absolute axes, of the moving track frame.

    The frame moves along the track at constant speed and is at arc length ``offset`` (m) at t = 0. Its axes are written
    to ``axes`` (3, 3)."""
    station = track_frame(track.path, offset + speed * t, axes)
    along, left, up = frame_turn(station)
    velocity = (speed * axes[0, 0], speed * axes[1, 0], speed * axes[2, 0])
    return (station.x, station.y, station.z), velocity, turned_back(axes, speed * along, speed * left, speed * up)


@jit(allocates=False)
def arc_length_at(model, state, work, k):
    """Arc length of the k-th wheelset, m; valid after `rail_motions` of this evaluation."""
    return state[STATE_SIZE * model.bodies.wheelsets[k]] if model.track.tangent else work.arc_lengths[k]


@jit(allocates=False)
def fill_rail_friction(model, state, work):
    """Write the coefficients of friction of the rails under all wheels to the wheels' motions in ``work``.

    They are interpolated in the model's two schedules over arc length, for the left and the right rail."""
    for k in range(model.bodies.wheelsets.shape[0]):
        s = arc_length_at(model, state, work, k)
        for wheel in range(2):
            work.motions[k, wheel, MOTION.friction] = scheduled(model.friction, wheel, s)


@jit(allocates=False)
def angles_in(frame, body):
    """Return roll, yaw and pitch (rad) of a body in a frame of the track, from its rotation matrix ``body``."""
    ax, ay, az = turned_into(frame, body[0, 1], body[1, 1], body[2, 1])
    _, _, forward = turned_into(frame, body[0, 0], body[1, 0], body[2, 0])
    _, _, upward = turned_into(frame, body[0, 2], body[1, 2], body[2, 2])
    return math.asin(min(max(az, -1.0), 1.0)), math.atan2(-ax, ay), math.atan2(-forward, upward)


@jit
def track_poses(track, states, at, guess):
    """Return positions and attitudes (n, 6) of a body in the track's frame, and this frame (n, 3, 3), for each state.

    Columns are arc length s, y, z (m), roll, yaw and pitch (rad). The body's state starts at index ``at`` in each row
    of ``states``; the search for the first s starts from ``guess`` (m)."""
    poses, axes, body = np.empty((len(states), 6)), np.empty((len(states), 3, 3)), np.empty((3, 3))
    s = guess
    for i in range(len(states)):
        state, frame = states[i, at : at + STATE_SIZE], axes[i]
        s = arc_length_of(track.path, state[0], state[1], state[2], s)
        station = track_frame(track.path, s, frame)
        _, y, z = turned_into(frame, state[0] - station.x, state[1] - station.y, state[2] - station.z)
        rotation_matrix(state, 0, body)
        store((s, y, z), poses[i])
        store(angles_in(frame, body), poses[i, 3:])
    return poses, axes
