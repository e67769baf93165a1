"""Compute contacts of a wheelset at many positions and attitudes at once, from arrays."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from wrcore.analysis.contact.loaded import DEEPEST, LOWEST, SMOOTH, LoadedWheels
from wrcore.analysis.contact.poses import ROLLING
from wrcore.contact.rigid.height_at_load import height_at_load, is_not_loaded, settle
from wrcore.contact.rigid.wheel_on_rail import WheelOnRail, WheelsetOnTrack
from wrcore.contact.search import reduction as columns
from wrcore.contact.search.detection import axle_direction
from wrcore.contact.search.reduction import MAX_PATCHES, PATCH_COLUMNS, REDUCTIONS
from wrcore.errors import InputError
from wrcore.errors.checked_calls import OneOf, Within, checked, same_shape
from wrcore.geometry.track import SIDES
from wrcore.run.checks.validity import flags
from wrcore.run.output.run import Channels
from wrcore.wheels.contact_model import COUNTERS
from wrcore.wheels.hertzian_force import wheel_wrenches
from wrcore.wheels.motion import MOTION as _MOTION

MOTION: Any = _MOTION  # columns of motions
OUT_OF_REACH = 1.0  # lift of a wheelset that removes all contact, m


@lru_cache(maxsize=8)
def _wheels(side: WheelOnRail, patch: str, detection: str) -> LoadedWheels:
    """Return the cached `LoadedWheels` of a wheel on its rail, of which callers use only constant parts."""
    return LoadedWheels(side.geometry, patch, detection=detection)


@checked
def contacts(
    pair: WheelsetOnTrack,
    y: Annotated[ArrayLike, Within(-0.1, 0.1, "m")],
    z: Annotated[ArrayLike, Within(-2.0, 2.0, "m")] | None = None,
    roll: Annotated[ArrayLike, Within(-0.5, 0.5, "rad")] | None = None,
    yaw: Annotated[ArrayLike, Within(-0.5, 0.5, "rad")] = 0.0,
    load: Annotated[ArrayLike, Within(1e-9, 1e6, "N")] | None = None,
    speed: Annotated[ArrayLike, Within(1e-6, 200.0, "m/s")] | None = None,
    omega: Annotated[ArrayLike, Within(-4e3, 4e3, "rad/s")] | None = None,
    vy: Annotated[ArrayLike, Within(-200.0, 200.0, "m/s")] = 0.0,
    yaw_rate: Annotated[ArrayLike, Within(-1e3, 1e3, "rad/s")] = 0.0,
    mu: Annotated[ArrayLike, Within(1e-9, 2.0)] = 0.3,
    detection: Annotated[str, OneOf(("planar", "spatial"))] = "spatial",
    patch: Annotated[str, OneOf(REDUCTIONS)] = "moment",
) -> Channels:
    """Return contacts of a wheelset at given positions, at rest or rolling; arguments broadcast to the shape ``(...)``.

    Parameters
    ----------
    pair : WheelsetOnTrack
    y, z, roll, yaw : array_like
        Position and attitude of the wheelset's centre, m and rad; roll first, then yaw about the vertical. If z is
        given, the wheelset is at that height (default roll: 0). If only roll is given, each wheel is at the height at
        which it carries ``load``. If neither is given, roll and height are those at which both wheels carry it.
    load : array_like, optional
        Vertical load of a wheel at rest, N, if z is not given.
    speed : array_like, optional
        Speed along the track, m/s; by default the wheelset is at rest, and there is no creep.
    omega : array_like, optional
        Rate of rolling, rad/s, positive forward; by default that of free rolling of each wheel.
    vy, yaw_rate, mu : array_like
        Lateral velocity (m/s), yaw rate (rad/s), coefficient of friction.
    detection : {"planar", "spatial"}
    patch : {"moment", "maximum"}
        Method that fits an ellipse to an overlap. Creep forces are those of the creep table for Poisson's ratio 0.28
        and the shear modulus 82 GPa.

    Returns
    -------
    Channels
        Channels of a run's contacts by name (``N_N``, ``y_m``, ``contact_angle_rad``, ``Fx_N`` and so on) and
        ``p_max_Pa``, each of shape ``(..., 2, 3)``: left and right wheel, patches from the flange to the field side,
        NaN where absent. ``roll_rad``, shape ``(...)``, and ``z_wheelset_m``, shape ``(..., 2)``, by wheel: NaN if
        there is no height for the load. ``load_residual_N``, shape ``(..., 2)``: carried minus required load of each
        wheel, NaN if z is given. Flags are 0 or 1. ``not_loaded``, shape ``(..., 2)``: a wheel does not carry its load.
        ``half_space``, ``conformal``, ``profile_edge`` and ``hollow_ahead`` of patches, and ``search_fallback`` and
        ``both_flanges``, shape ``(...)``: a limit of validity is exceeded, which a run counts by the same name.

    Raises
    ------
    InputError
        If arrays do not broadcast, a number has another unit, neither z nor load is given, or a wheel penetrates its
        rail by more than 1 mm at the given z.

    Examples
    --------
    >>> import wrcore as wr
    >>> pair = wr.WheelsetOnTrack.alike(wr.named_profile("S1002", "wheel"), wr.named_profile("60E1", "rail", 1 / 40))
    >>> found = contacts(pair, [0.0, 0.003], load=5e4, speed=20.0, omega=20.0 / 0.46)
    >>> found.N_N.shape, found.N_N[0, :, 0].round(-3).tolist()
    ((2, 2, 3), [50000.0, 50000.0])
    >>> found.Fx_N[1, :, 0].round(-2).tolist()
    [9600.0, -4600.0]
    """
    if z is None and load is None:
        raise InputError("contacts", "z load", "expected either heights or a load")
    if z is not None and load is not None:
        raise InputError("contacts", "z load", "expected either heights or a load, got both")
    if speed is None and (omega is not None or np.any(vy) or np.any(yaw_rate)):
        raise InputError("contacts", "speed", "expected a speed beside omega, vy or yaw_rate")
    given = {"y": y, "z": z, "roll": roll, "yaw": yaw, "load": load, "speed": speed, "omega": omega, "vy": vy}
    given |= {"yaw_rate": yaw_rate, "mu": mu}
    whole = same_shape("contacts", **{key: np.nan if value is None else value for key, value in given.items()})
    sides = [_wheels(getattr(pair, name), patch, detection) for name in SIDES]
    found = _found(sides, *(np.array(one, float).ravel() for one in whole))
    shape = whole[0].shape  # results have this shape instead of (n,)
    return Channels("contacts", {name: values.reshape((*shape, *values.shape[1:])) for name, values in found.items()})


def _found(sides, y, z, roll, yaw, load, speed, omega, vy, yaw_rate, mu):
    """Return channels of n positions, by name; NaN marks arguments that were not given."""
    roll, heights = _placed(sides, y, yaw, z, roll, load)
    motions, rolls = np.zeros((len(y), 2, len(MOTION))), not np.isnan(speed).any()
    axle = np.array([axle_direction(*angles) for angles in zip(roll, yaw, strict=True)]).reshape(-1, 1, 3)
    motions[..., MOTION.side], motions[..., MOTION.y] = list(SIDES.values()), y[:, None]
    motions[..., MOTION.z] = np.where(np.isnan(heights), sides[0].geometry.rolling_radius + OUT_OF_REACH, heights)
    motions[..., MOTION.ex : MOTION.ez + 1], motions[..., MOTION.friction] = axle, SMOOTH
    if not np.isnan(z).any():
        _refuse_deep(sides, motions)
    if rolls:
        _set_rolling(sides, motions, axle, speed, omega, vy, yaw_rate)
        motions[..., MOTION.friction] = mu[:, None]
    rows = _pressed(sides, motions, rolls)
    limits = {name: one.astype(float) for name, one in _limits(sides, rows, roll, yaw).items()}
    vertical = np.nansum(rows[..., columns.NORMAL] * np.cos(rows[..., columns.ANGLE]), axis=-1)
    residual = vertical - load[:, None]
    found = {name: rows[..., column] for name, column in columns.CHANNELS.items() if rolls or name not in ROLLING}
    found["p_max_Pa"] = 1.5 * found["N_N"] / (math.pi * found["a_m"] * found["b_m"])
    limits["not_loaded"] = is_not_loaded(residual, load[:, None], rows[..., columns.PENETRATION]).astype(float)
    return found | {"roll_rad": roll, "z_wheelset_m": heights, "load_residual_N": residual} | limits


def _limits(sides, rows, roll, yaw):
    """Return flags of :func:`wrcore.run.checks.validity.flags` of n positions from patches ``rows``
    (n, 2, MAX_PATCHES, PATCH_COLUMNS)."""
    contact = sides[0]._still._replace(geometries=tuple(one.geometry for one in sides))
    return {name: one[:, 0] for name, one in flags(contact, rows[:, None], roll[:, None], yaw[:, None]).items()}


def _placed(sides, y, yaw, z, roll, load):
    """Return roll (n,), rad, and heights (n, 2), m, of the wheelset: given ones, or those at which it carries the
    load."""
    if not np.isnan(z).any():
        return np.where(np.isnan(roll), 0.0, roll), np.stack([z, z], axis=-1)
    heights, scratch = np.full((len(y), 2), np.nan), np.empty((MAX_PATCHES, PATCH_COLUMNS))
    still, roll = sides[0]._still, roll.copy()
    left, right = (one.geometry for one in sides)
    solver = still.hertz, sides[0].modulus
    for k in range(len(y)):
        how = sides[0].spatial, still.reduction, load[k], left.rolling_radius
        if math.isnan(roll[k]):
            roll[k], heights[k] = settle(left, right, *solver, y[k], yaw[k], *how)
            continue
        for wheel, sign in enumerate(SIDES.values()):
            geometry = sides[wheel].geometry
            heights[k, wheel] = height_at_load(geometry, *solver, sign, y[k], roll[k], yaw[k], *how, scratch)
    return roll, heights


def _refuse_deep(sides, motions):
    """Raise InputError if a wheel penetrates its rail by more than `DEEPEST`."""
    lifted = motions.copy()
    lifted[..., MOTION.z] += DEEPEST
    radii = np.array([one.geometry.rolling_radius for one in sides])
    deep = np.isfinite(_pressed(sides, lifted, False)[..., columns.NORMAL]).any(axis=-1)
    deep |= motions[..., MOTION.z] < radii - LOWEST
    if deep.any():
        k = int(np.argmax(deep.any(axis=-1)))
        got = f"z = {motions[k, 0, MOTION.z]:g} m in pose {k}"
        raise InputError("contacts", "z", f"expected at most {1e3 * DEEPEST:g} mm of overlap, got {got}")


def _set_rolling(sides, motions, axle, speed, omega, vy, yaw_rate):
    """Set the velocities of rolling wheels in ``motions``; without a rate of rolling, that of free rolling is computed.

    The longitudinal slip is linear in this rate, so two evaluations determine it.
    """
    motions[..., MOTION.vx], motions[..., MOTION.vy] = speed[:, None], vy[:, None]

    def turned(rates):  # (n, 2)
        motions[..., MOTION.wx : MOTION.wz + 1] = rates[..., None] * axle
        motions[..., MOTION.wz] += yaw_rate[:, None]

    if not np.isnan(omega).any():
        turned(np.stack([omega, omega], axis=-1))
        return
    usual, means = speed[:, None] / np.array([one.geometry.rolling_radius for one in sides]), []
    for rates in (usual, 1.001 * usual):
        turned(rates)
        rows = _pressed(sides, motions, False)
        means.append(np.nansum(rows[..., columns.NORMAL] * rows[..., columns.XI], axis=-1))
    change = means[0] - means[1]
    turned(usual + 1e-3 * usual * np.divide(means[0], change, out=np.zeros_like(change), where=change != 0.0))


def _pressed(sides, motions, with_creep):
    """Return patches (n, 2, MAX_PATCHES, PATCH_COLUMNS) of wheels with given motions, NaN where absent."""
    count = len(motions)
    out = np.full((count, 2, MAX_PATCHES, PATCH_COLUMNS), np.nan)
    for wheel in (slice(0, 2),) if sides[0] is sides[1] else (0, 1):
        one = sides[0] if wheel != 1 else sides[1]
        model = one._at_work() if with_creep else one._still_handle
        rows, counts = np.zeros_like(out), np.zeros((count, 2), np.int64)
        wheel_wrenches(model, motions, rows, counts, np.zeros((count, 2)), np.zeros((count, 2, 6)),
                       np.zeros(COUNTERS, np.int64), one._work_handle)  # fmt: skip
        there = np.arange(MAX_PATCHES) < counts[..., None]
        out[:, wheel] = np.where(there[..., None], rows, np.nan)[:, wheel]
    return out
