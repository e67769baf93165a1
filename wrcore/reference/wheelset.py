"""Equations of motion of one wheelset on straight track, on springs to a moving frame or free."""

from dataclasses import dataclass

import numpy as np

from wrcore.creep.axes import CreepTableData
from wrcore.errors import InputError
from wrcore.reference.contact import Pair, find_patches
from wrcore.reference.forces import creep_force, damping_factor, hertz
from wrcore.vehicle.description import GRAVITY

SIDES = (1.0, -1.0)
"""Left and right."""

NODE_DISTANCE = 1e-4
"""Default distance of the wheel's strips, m."""


@dataclass(frozen=True)
class PlainWheelset:
    """A wheelset's scene in the terms of its equations.

    Attributes
    ----------
    pair : Pair
    contact : dict
        The scene's key ``contact``.
    creep : CreepTableData
        Kalker's coefficients and, for the law ``table``, the table.
    mass : float
        kg.
    inertia : numpy.ndarray, shape (3,)
        Roll, pitch, yaw, kg m^2.
    springs : list of dict
        Elements to the moving frame with ``at`` (m, in nominal position), ``stiffness`` (N/m), ``damping`` (N s/m) and
        ``preload`` (N), shapes (3,).
    nominal : numpy.ndarray, shape (3,)
        Nominal position, m.
    speed : float
        m/s.
    alpha : float
        Feedback of the Euler parameters' norm, 1/s.
    step : float
        Distance of the strips, m.
    """

    pair: Pair
    contact: dict
    creep: CreepTableData
    mass: float
    inertia: np.ndarray
    springs: list
    nominal: np.ndarray
    speed: float
    alpha: float
    step: float

    def rates(self, t, state):
        """Right-hand side of the equations of motion.

        Parameters
        ----------
        t : float
            s.
        state : numpy.ndarray, shape (13,)
            Position (m), Euler parameters, velocity (m/s), angular velocity (rad/s), track axes.

        Returns
        -------
        numpy.ndarray, shape (13,)
        """
        position, p, v, w = state[:3], state[3:7], state[7:10], state[10:]
        A = rotation_matrix(p)
        force, moment = np.array([0.0, 0.0, -self.mass * GRAVITY]), np.zeros(3)
        for side in SIDES:
            for arm, push, torque in self.contact_forces(side, position, A[:, 1], v, w):
                force += push
                moment += np.cross(arm, push) + torque
        turn = w - (w @ A[:, 1]) * A[:, 1]  # the frame does not spin with the wheelset
        for spring in self.springs:
            arm = A @ (spring["at"] - self.nominal)
            stretch = position + arm - [self.speed * t, 0.0, 0.0] - spring["at"]
            rate = v + np.cross(turn, arm) - [self.speed, 0.0, 0.0]
            push = spring["preload"] - spring["stiffness"] * stretch - spring["damping"] * rate
            force += push
            moment += np.cross(arm, push)
        J = A @ np.diag(self.inertia) @ A.T
        e0, e1, e2, e3 = p
        E = np.array([[-e1, e0, -e3, e2], [-e2, e3, e0, -e1], [-e3, -e2, e1, e0]])
        p_rate = 0.5 * E.T @ turn + self.alpha * (1.0 - p @ p) * p
        return np.concatenate([v, p_rate, force / self.mass, np.linalg.solve(J, moment - np.cross(w, J @ w))])

    def contact_forces(self, side, centre, axle, v, w):
        """Forces of the rail on one wheel.

        Parameters
        ----------
        side : float
            +1 left, -1 right.
        centre, axle, v, w : numpy.ndarray, shape (3,)
            Wheelset's centre (m), axle pointing left, velocity (m/s), angular velocity (rad/s).

        Returns
        -------
        list of (arm, force, moment)
            Per patch: its place relative to the wheelset's centre (m), force (N), spin moment (N m), shapes (3,).
        """
        contact, found = self.contact, []
        material, damping = contact["material"], contact["normal"]["damping"]
        shear, poisson = material["shear_modulus"], material["poisson_ratio"]
        section = np.array([0.0, centre[1], centre[2]])
        spatial = contact["detection"] == "spatial"
        for patch in find_patches(self.pair, side, section, axle, spatial, contact["patch"], self.step):
            arm = patch.point - section
            sine, cosine = np.sin(patch.angle), np.cos(patch.angle)
            lateral, normal = np.array([0.0, cosine, sine]), np.array([0.0, -sine, cosine])
            slip = v + np.cross(w, arm)
            factor = damping_factor(-slip @ normal, damping["c_e"], damping["v0"])
            # the ellipse belongs to the damped force: that of the elastic approach c_d^(2/3) delta
            approach = factor ** (2 / 3) * patch.penetration
            load, a, b = hertz(approach, patch.curvature_x, patch.curvature_y, shear / (1.0 - poisson))
            speed = max(abs(v[0]), contact["creep"]["least_speed"])
            limit, c = contact["friction"] * load, np.sqrt(a * b)
            creepages = np.array([slip[0], slip @ lateral, c * (w @ normal)]) / speed * shear * c**2 / limit
            fx, fy, mz = creep_force(contact["creep"]["model"], self.creep, np.log(a / b), creepages)
            push = load * normal + limit * np.array([fx, fy * cosine, fy * sine])
            found.append((arm, push, limit * c * mz * normal))
        return found


def rotation_matrix(p):
    """A(p) of Euler parameters (4,), shape (3, 3)."""
    e0, e = p[0], p[1:]
    cross = np.array([[0.0, -e[2], e[1]], [e[2], 0.0, -e[0]], [-e[1], e[0], 0.0]])
    return np.eye(3) + 2.0 * e0 * cross + 2.0 * cross @ cross


def plain_wheelset(scene, creep, step=NODE_DISTANCE):
    """The plain equations of a scene.

    Parameters
    ----------
    scene : Scene
        One wheelset, free or on spring-dampers to the moving frame, on a tangent, perfect track.
    creep : CreepTableData
        As the scene's compiled model has it (``model.contact.creep.table``).
    step : float
        Distance of the wheel's strips, m.

    Returns
    -------
    PlainWheelset

    Raises
    ------
    InputError
        For a scene with anything else in it.
    """
    vehicle, data = scene.vehicle, scene.vehicle.data
    if len(vehicle.body_names) != 1 or len(vehicle.wheelset_names) != 1:
        raise InputError(scene.source, "vehicle", "expected one wheelset and no other body for the plain equations")
    if not scene.track.tangent or "support" in scene.data["track"]:
        raise InputError(scene.source, "track", "expected a tangent, perfect, rigid track for the plain equations")
    if isinstance(scene.data["contact"]["friction"], dict) or "drive" in scene.data:
        raise InputError(scene.source, "contact.friction", "expected a number, and no drive, for the plain equations")
    if scene.detection == "auto":
        raise InputError(scene.source, "contact.detection", "expected planar or spatial for the plain equations")
    if others := sorted({item["kind"] for item in data["elements"]} - {"spring_damper"}):
        expected = f"expected spring_damper elements only for the plain equations, got {', '.join(others)}"
        raise InputError(scene.source, "vehicle.elements", expected)
    keys, zero = ("at", "stiffness", "damping", "preload"), [0.0, 0.0, 0.0]
    springs = [{key: np.array(item.get(key, zero), float) for key in keys} for item in data["elements"]]
    body = data["bodies"][vehicle.body_names[0]]
    rail_distance = scene.track.rail_distance(scene.rail)
    return PlainWheelset(
        Pair(scene.wheel, scene.rail, vehicle.rolling_radius, vehicle.half_distance, rail_distance),
        scene.data["contact"], creep, body["mass"], np.array([body["inertia"][k] for k in ("roll", "pitch", "yaw")]),
        springs, np.array(body["position"]), float(scene.data["speed"]),
        float(scene.data["integration"]["baumgarte"]["alpha"]), step,
    )  # fmt: skip
