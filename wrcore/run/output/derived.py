"""Channels that follow from those of contacts: forces on the rails, wear, pressure and rolling radius of wheels, sum of
Y and conicity of wheelsets.

Definitions. Q: vertical force of a wheel on its rail, positive downwards. Y: its lateral force on the rail in the plane
of the track, positive to the field side (a flange pushes with positive Y). Y/Q: their quotient wheel by wheel. Sum of
Y: lateral force of a wheelset on the track, to the left. Wear number T gamma: |Fx xi + Fy eta| summed over the patches
(N), and with spin |Fx xi + Fy eta + Mz phi|. Creep power: what friction dissipates, -V (Fx xi + Fy eta + Mz phi) summed
over the patches (W). Greatest pressure: of each patch; of ellipses 3 N/(2 pi a b). Rolling radius: distance of a
wheel's contact points from the axle, by their normal forces where there are several. Its difference, left less right,
is positive where it steers a wheelset back that is off to the left (EN 15302). Effective conicity: this difference over
twice the wheelset's displacement from the middle of both contacts' rails (Wickens, Fundamentals of Rail Vehicle
Dynamics (2003)); of a cone its slope, to first order.

The work of a patch per metre run, -(Fx xi + Fy eta + Mz phi), is what friction turns into heat and wear, never negative
(Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990), section 1.3). T gamma is its amount without the
spin's part, as wear models take it (Pearce and Sherratt, Wear 144 (1991) 343-351), or with it. The products carry
signs: where spin drives the lateral force along its creepage (on a flange, mostly), one of them gives work back.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial

import numpy as np

from wrcore.geometry.track import SIDES

UNLOADED = 1e3  # below this Q counts as no contact and Y/Q is left out, N
CENTRED = 1e-4  # nearer to the middle of its rails a wheelset has no conicity, m

OF_WHEELS = {
    "Q": "Q_N", "Y": "Y_N", "Y_over_Q": "Y_over_Q", "T_gamma": "T_gamma_N", "T_gamma_spin": "T_gamma_spin_N",
    "creep_power": "creep_power_W", "p_max": "p_max_Pa", "rolling_radius": "rolling_radius_m",
}  # fmt: skip
OF_WHEELSETS = {
    "sum_Y": "sum_Y_N", "rolling_radius_difference": "rolling_radius_difference_m",
    "effective_conicity": "effective_conicity",
}  # fmt: skip
"""Names in ``output.channels`` of a scene, and the channels of wheels or wheelsets that they stand for."""

POSE = {"y_m", "z_m", "roll_rad", "yaw_rad"}
PLACES = {"x_m", "y_m", "z_m", "u_rail_m", "N_N"}
"""Channels of wheelsets and of wheels from which rolling radii follow."""

Groups = Mapping[str, Mapping[str, np.ndarray]]


def forces_on_rail(contact: Mapping[str, np.ndarray], side: str) -> tuple[np.ndarray, np.ndarray]:
    """Vertical (Q, downwards) and lateral (Y, to the field side) force (n,) of a wheel on its rail, N, from the
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
    """Creep work of wheels, shape (...), from forces (N), spin moment (N m), creepages and spin (1/m) of patches (...,
    patches), NaN where there is none: sums of abs(Fx xi + Fy eta), N, of abs(Fx xi + Fy eta + Mz phi), N, and of -(Fx
    xi + Fy eta + Mz phi), J/m, which times the rolling speed is the dissipated power.
    """
    sliding = fx * xi + fy * eta
    whole = sliding + mz * phi
    return tuple(np.nansum(part, axis=-1) for part in (np.abs(sliding), np.abs(whole), -whole))


def rolling_radius(body: Mapping[str, np.ndarray], contact: Mapping[str, np.ndarray]) -> np.ndarray:
    """Rolling radius (n,) of a wheel, m, from its wheelset's pose and its contacts; NaN off the rail."""
    roll, yaw = body["roll_rad"][:, None], body["yaw_rad"][:, None]
    ahead, aside, up = contact["x_m"], contact["y_m"] - body["y_m"][:, None], contact["z_m"] - body["z_m"][:, None]
    along = np.cos(roll) * (np.cos(yaw) * aside - np.sin(yaw) * ahead) + np.sin(roll) * up
    return _by_load(contact, np.sqrt(ahead**2 + aside**2 + up**2 - along**2))


def _by_load(contact, values):
    """Means (n,) of what patches (n, patches) have, by their normal forces; NaN where there is none."""
    load = np.nansum(contact["N_N"], axis=-1)
    return np.nansum(contact["N_N"] * values, axis=-1) / np.where(load > 0.0, load, np.nan)


def quotient(vertical: np.ndarray, lateral: np.ndarray) -> np.ndarray:
    """Y/Q; NaN where the wheel is as good as unloaded."""
    return np.divide(lateral, vertical, out=np.full(np.shape(vertical), np.nan), where=np.asarray(vertical) > UNLOADED)


def rolling_speed(body: Mapping[str, np.ndarray], speed: float) -> np.ndarray | float:
    """Speed of a wheelset, m/s: that of its channels, or the scene's where a run does not hold velocities."""
    return np.linalg.norm([body[f"v{axis}_m_per_s"] for axis in "xyz"], axis=0) if "vx_m_per_s" in body else speed


def derived_channels(groups: Groups, group: str, speed: float) -> dict[str, Callable[[], np.ndarray]]:
    """Channels that a group (of a wheel, ``wheelset/left``, or of a wheelset) does not hold but that follow from those
    that it and its wheels hold: what computes each, by name; the scene's speed in m/s.
    """
    wheelset, _, side = group.rpartition("/")
    if side not in SIDES or not wheelset:
        return _of_wheelset(groups, group, speed)
    contact = groups[group]
    found: dict[str, Callable[[], np.ndarray]] = {}
    if {"N_N", "Fy_N", "contact_angle_rad"} <= contact.keys():
        found |= {name: partial(_force, contact, side, at) for at, name in enumerate(("Q_N", "Y_N"))}
    if {"Q_N", "Y_N"} <= contact.keys() | found.keys():
        forces = dict(found)  # a copy: what refers to itself keeps its arrays alive
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


def _sum(known, name):  # here and below: functions of the file, which other processes find
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
    """Derived channels by group that a scene asks for (``output.channels``), from groups of a wheelset and its wheels
    with all channels of contacts; groups without any are left out.
    """
    found = {}
    for group, stored in groups.items():
        kinds = OF_WHEELS if "/" in group else OF_WHEELSETS
        if kinds.keys().isdisjoint(wanted):
            continue
        derived = derived_channels(groups, group, speed)
        found[group] = {kinds[name]: _known(stored, derived, kinds[name]) for name in wanted if name in kinds}
    return found
