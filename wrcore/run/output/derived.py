"""Channels derived from those of contacts: forces on the rails, wear, pressure and rolling radius of wheels, sum of Y
and conicity of wheelsets.

Definitions. Q: vertical force of a wheel on its rail, positive downwards. Y: lateral force of a wheel on its rail in
the plane of the track, positive to the field side (a flange pushes with positive Y). Y/Q: quotient of both for each
wheel. Sum of Y: lateral force of a wheelset on the track, to the left. Wear number T gamma: |Fx xi + Fy eta| summed
over the patches (N), and with spin |Fx xi + Fy eta + Mz phi|. Creep power: power dissipated by friction,
-V (Fx xi + Fy eta + Mz phi) summed over the patches (W). Maximum pressure: of each patch; in ellipses 3 N/(2 pi a b).
Rolling radius: distance of a wheel's contact points from the axle, averaged with their normal forces as weights.
Rolling radius difference: left minus right, positive if it steers a wheelset displaced to the left back to the centre
(EN 15302). Effective conicity: this difference over twice the wheelset's displacement from the middle of both rails in
contact (Wickens, Fundamentals of Rail Vehicle Dynamics (2003)). For a cone it is the slope, to first order.

The work of a patch per metre run, -(Fx xi + Fy eta + Mz phi), is dissipated as heat and wear and never negative
(Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), section 1.3). T gamma is its absolute value without
the part of spin, the common form in wear models (Pearce and Sherratt, Wear 144 (1991) 343-351), or with it. The
products have signs: if spin drives the lateral force along its creepage (mostly on a flange), one of them is negative
work.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial

import numpy as np

from wrcore.geometry.track import SIDES

UNLOADED = 1e3  # Q below which a wheel is unloaded and Y/Q is NaN, N
CENTRED = 1e-4  # displacement from the middle of the rails below which conicity is NaN, m

OF_WHEELS = {
    "Q": "Q_N", "Y": "Y_N", "Y_over_Q": "Y_over_Q", "T_gamma": "T_gamma_N", "T_gamma_spin": "T_gamma_spin_N",
    "creep_power": "creep_power_W", "p_max": "p_max_Pa", "rolling_radius": "rolling_radius_m",
}  # fmt: skip
OF_WHEELSETS = {
    "sum_Y": "sum_Y_N", "rolling_radius_difference": "rolling_radius_difference_m",
    "effective_conicity": "effective_conicity",
}  # fmt: skip
"""Channels of wheels and of wheelsets, by their names in ``output.channels`` of a scene."""

POSE = {"y_m", "z_m", "roll_rad", "yaw_rad"}
PLACES = {"x_m", "y_m", "z_m", "u_rail_m", "N_N"}
"""Channels of wheelsets and of wheels from which rolling radii follow."""

Groups = Mapping[str, Mapping[str, np.ndarray]]


def forces_on_rail(contact: Mapping[str, np.ndarray], side: str) -> tuple[np.ndarray, np.ndarray]:
    """Return vertical (Q, downwards) and lateral (Y, to the field side) force (n,) of a wheel on its rail, N, from the
    channels N_N, Fy_N and contact_angle_rad (n, patches) of its contacts.
    """
    loads = contact["N_N"]
    vertical, lateral = np.zeros(len(loads)), np.zeros(len(loads))
    for patch in range(loads.shape[1]):
        rows = np.flatnonzero(~np.isnan(loads[:, patch]))  # few have a second patch
        normal, aside, angle = (contact[name][rows, patch] for name in ("N_N", "Fy_N", "contact_angle_rad"))
        cosine, sine = np.cos(angle), np.sin(angle)
        vertical[rows] += normal * cosine + aside * sine
        lateral[rows] += aside * cosine - normal * sine
    return vertical, -SIDES[side] * lateral


def creep_work(fx, fy, mz, xi, eta, phi):
    """Return sums over the patches of creep work per metre, each of shape (...).

    They are the sums of abs(Fx xi + Fy eta), N, of abs(Fx xi + Fy eta + Mz phi), N, and of -(Fx xi + Fy eta + Mz phi),
    J/m; the last one times the rolling speed is the dissipated power. Forces (N), spin moment (N m), creepages and spin
    creepage (1/m) have shape (..., patches), NaN where there is no patch.
    """
    sliding = fx * xi + fy * eta
    whole = sliding + mz * phi
    return tuple(np.nansum(part, axis=-1) for part in (np.abs(sliding), np.abs(whole), -whole))


def rolling_radius(body: Mapping[str, np.ndarray], contact: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the rolling radius (n,) of a wheel, m, from channels of its wheelset and its contacts.

    It is NaN without contact.
    """
    roll, yaw = body["roll_rad"][:, None], body["yaw_rad"][:, None]
    ahead, aside, up = contact["x_m"], contact["y_m"] - body["y_m"][:, None], contact["z_m"] - body["z_m"][:, None]
    along = np.cos(roll) * (np.cos(yaw) * aside - np.sin(yaw) * ahead) + np.sin(roll) * up
    return _by_load(contact, np.sqrt(ahead**2 + aside**2 + up**2 - along**2))


def _by_load(contact, values):
    """Return means (n,) of values of patches (n, patches), weighted by normal force; NaN where there is no patch."""
    load = np.nansum(contact["N_N"], axis=-1)
    return np.nansum(contact["N_N"] * values, axis=-1) / np.where(load > 0.0, load, np.nan)


def quotient(vertical: np.ndarray, lateral: np.ndarray) -> np.ndarray:
    """Return Y/Q; NaN where Q is not above `UNLOADED`."""
    return np.divide(lateral, vertical, out=np.full(np.shape(vertical), np.nan), where=np.asarray(vertical) > UNLOADED)


def rolling_speed(body: Mapping[str, np.ndarray], speed: float) -> np.ndarray | float:
    """Return the speed of a wheelset, m/s, from its channels, or the scene's speed if a run has no velocities."""
    return np.linalg.norm([body[f"v{axis}_m_per_s"] for axis in "xyz"], axis=0) if "vx_m_per_s" in body else speed


def derived_channels(groups: Groups, group: str, speed: float) -> dict[str, Callable[[], np.ndarray]]:
    """Return functions that compute the derived channels of a group, by channel name.

    The group is that of a wheel, ``wheelset/left``, or of a wheelset. Channels that it already contains are omitted.
    ``speed`` is the scene's speed, m/s.
    """
    wheelset, _, side = group.rpartition("/")
    if side not in SIDES or not wheelset:
        return _of_wheelset(groups, group, speed)
    contact = groups[group]
    found: dict[str, Callable[[], np.ndarray]] = {}
    if {"N_N", "Fy_N", "contact_angle_rad"} <= contact.keys():
        found |= {name: partial(_force, contact, side, at) for at, name in enumerate(("Q_N", "Y_N"))}
    if {"Q_N", "Y_N"} <= contact.keys() | found.keys():
        forces = dict(found)  # a copy: a dict that refers to itself would keep its arrays alive
        found["Y_over_Q"] = partial(_quotient, contact, forces)
    if {"Fx_N", "Fy_N", "Mz_Nm", "xi", "eta", "phi_per_m"} <= contact.keys():
        found |= {name: partial(_work, contact, at) for at, name in enumerate(("T_gamma_N", "T_gamma_spin_N"))}
        found["creep_power_W"] = partial(_power, contact, groups[wheelset], speed)
    if {"N_N", "a_m", "b_m"} <= contact.keys():
        found["p_max_Pa"] = partial(_pressure, contact)
    if PLACES <= contact.keys() and POSE <= groups[wheelset].keys():
        found["rolling_radius_m"] = partial(rolling_radius, groups[wheelset], contact)
    return {name: compute for name, compute in found.items() if name not in contact}


def _of_wheelset(groups, group, speed):
    wheels = {side: groups.get(f"{group}/{side}") for side in SIDES}
    if None in wheels.values():
        return {}
    known = {side: (wheel, derived_channels(groups, f"{group}/{side}", speed)) for side, wheel in wheels.items()}
    found: dict[str, Callable[[], np.ndarray]] = {}
    if all("Y_N" in stored or "Y_N" in derived for stored, derived in known.values()):
        found["sum_Y_N"] = partial(_sum, known, "Y_N")
    if all("rolling_radius_m" in stored or "rolling_radius_m" in derived for stored, derived in known.values()):
        found["rolling_radius_difference_m"] = partial(_sum, known, "rolling_radius_m")
        if "y_m" in groups[group] and all(PLACES <= wheel.keys() for wheel in wheels.values()):
            found["effective_conicity"] = partial(_conicity, known, groups[group])
    return {name: compute for name, compute in found.items() if name not in groups[group]}


def _known(stored, derived, name):
    return stored[name] if name in stored else derived[name]()


def _sum(known, name):  # here and below: functions at module level, so that other processes can unpickle them
    return sum(SIDES[side] * _known(*known[side], name) for side in SIDES)


def _conicity(known, body):
    wheels = {side: stored for side, (stored, _) in known.items()}
    rails = (_by_load(wheel, wheel["y_m"] - SIDES[side] * wheel["u_rail_m"]) for side, wheel in wheels.items())
    displacement = body["y_m"] - 0.5 * sum(rails)
    off = np.where(np.abs(displacement) > CENTRED, displacement, np.nan)
    return _sum(known, "rolling_radius_m") / (2.0 * off)


def _quotient(contact, forces):
    return quotient(*(_known(contact, forces, name) for name in ("Q_N", "Y_N")))


def _power(contact, body, speed):
    return _work(contact, 2) * rolling_speed(body, speed)


def _force(contact, side, at):
    return forces_on_rail(contact, side)[at]


def _work(contact, at):
    return creep_work(*(contact[name] for name in ("Fx_N", "Fy_N", "Mz_Nm", "xi", "eta", "phi_per_m")))[at]


def _pressure(contact):
    a, b = contact["a_m"], contact["b_m"]
    return 1.5 * contact["N_N"] / (np.pi * np.where(a > 0.0, a * b, np.nan))


def asked_for(wanted: Iterable[str], groups: Groups, speed: float) -> dict[str, dict[str, np.ndarray]]:
    """Return the derived channels that a scene requests (``output.channels``), by group.

    ``groups`` are those of a wheelset and its wheels with all channels of contacts. Groups without requested channels
    are omitted.
    """
    found = {}
    for group, stored in groups.items():
        kinds = OF_WHEELS if "/" in group else OF_WHEELSETS
        if kinds.keys().isdisjoint(wanted):
            continue
        derived = derived_channels(groups, group, speed)
        found[group] = {kinds[name]: _known(stored, derived, kinds[name]) for name in wanted if name in kinds}
    return found
