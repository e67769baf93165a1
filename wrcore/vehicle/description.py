"""Vehicles from data: a YAML file becomes bodies, force elements and joints."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wrcore.checked_yaml import read_yaml, validate
from wrcore.dynamics.joint import EQUATIONS, KINDS, Joints
from wrcore.dynamics.marker import FRAME
from wrcore.dynamics.suspension import SpringDampers
from wrcore.dynamics.system import Bodies
from wrcore.errors import InputError

FRAME_NAME = "frame"


@dataclass(frozen=True)
class Vehicle:
    """A vehicle in its nominal position.

    Attributes
    ----------
    name, source_file : str
    body_names : tuple of str
        In the order of the state vector.
    positions : numpy.ndarray, shape (n, 3)
        Nominal centres of mass, m.
    rolling_radius, half_distance : float
        Of the wheelsets, m.
    bodies : Bodies
    springs : SpringDampers
    joints : Joints
    data : dict
        The file's content with defaults, for provenance.
    """

    name: str
    source_file: str
    body_names: tuple
    positions: np.ndarray
    rolling_radius: float
    half_distance: float
    bodies: Bodies
    springs: SpringDampers
    joints: Joints
    data: dict

    def axle_load(self, body, gravity):
        """Vertical force (N) that the rails carry for a wheelset in nominal position: weight less preloads."""
        preload = sum(
            np.where(self.springs.bodies[:, end] == body, sign, 0.0) @ self.springs.preload[:, 2]
            for end, sign in ((0, 1.0), (1, -1.0))
        )
        return self.bodies.mass[body] * gravity - float(preload)


def load_vehicle(path):
    """Read and check a vehicle file.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Vehicle

    Raises
    ------
    InputError
        Naming the file, the element and what was expected.
    """
    return build_vehicle(read_yaml(path), str(Path(path).name))


def build_vehicle(data, source):
    """Compile a vehicle description (the content of a vehicle file) that ``source`` names in errors."""
    data = validate(data, "vehicle", source)
    names = tuple(data["bodies"])
    parts = list(data["bodies"].values())
    wheelset = parts[0]
    for name, part in data["bodies"].items():
        for key in ("rolling_radius", "tape_circle_half_distance"):
            if part[key] != wheelset[key]:
                raise InputError(source, f"bodies.{name}.{key}", f"expected {wheelset[key]} as for {names[0]}")
    positions = np.array([part["position"] for part in parts], float)
    bodies = Bodies(
        np.array([part["mass"] for part in parts], float),
        np.array([[part["inertia"][k] for k in ("roll", "pitch", "yaw")] for part in parts], float),
        np.array([part["kind"] == "wheelset" for part in parts], np.int64),
        np.array([i for i, part in enumerate(parts) if part["kind"] == "wheelset"], np.int64),
    )
    for name, moments in zip(names, bodies.inertia, strict=True):
        if moments[0] != moments[2]:
            raise InputError(
                source, f"bodies.{name}.inertia", "expected equal roll and yaw moments (body of revolution)"
            )
    return Vehicle(
        data["name"], source, names, positions, float(wheelset["rolling_radius"]),
        float(wheelset["tape_circle_half_distance"]), bodies,
        _springs(data["elements"], names, positions, source), _joints(data["joints"], names, positions, source), data,
    )  # fmt: skip


def _ends(item, field, names, source):
    """Body numbers of the two ends of an element or joint."""
    numbers = []
    for name in item["bodies"]:
        if name != FRAME_NAME and name not in names:
            raise InputError(
                source, f"{field}.bodies", f"expected {FRAME_NAME} or one of {', '.join(names)}, got {name!r}"
            )
        numbers.append(FRAME if name == FRAME_NAME else names.index(name))
    if numbers[0] == numbers[1]:
        raise InputError(source, f"{field}.bodies", f"expected two different bodies, got {item['bodies'][0]!r} twice")
    return numbers


def _markers(point, ends, positions, field, source):
    """The point in the axes of both bodies. Wheelset frames do not spin: their markers must lie on the axle."""
    markers = np.array([np.array(point, float) - (0.0 if b == FRAME else positions[b]) for b in ends])
    for body, marker in zip(ends, markers, strict=True):
        if body != FRAME and (abs(marker[0]) > 1e-9 or abs(marker[2]) > 1e-9):
            raise InputError(source, f"{field}.at", f"expected a point on the axle's axis, got {list(point)}")
    return markers


def _springs(elements, names, positions, source):
    n = len(elements)
    bodies, markers = np.zeros((n, 2), np.int64), np.zeros((n, 2, 3))
    for k, item in enumerate(elements):
        field = f"elements.{item['name']}"
        bodies[k] = _ends(item, field, names, source)
        markers[k] = _markers(item["at"], bodies[k], positions, field, source)
    vectors = [
        np.array([item[key] for item in elements], float).reshape(n, 3) for key in ("stiffness", "damping", "preload")
    ]
    return SpringDampers(bodies, markers, *vectors, np.zeros((n, 3)))


def _joints(joints, names, positions, source):
    n = len(joints)
    bodies, markers = np.zeros((n, 2), np.int64), np.zeros((n, 2, 3))
    for k, item in enumerate(joints):
        field = f"joints.{item['name']}"
        bodies[k] = _ends(item, field, names, source)
        if item["kind"] == "coordinate":
            if bodies[k, 0] == FRAME or bodies[k, 1] != FRAME or "axis" not in item:
                raise InputError(source, field, "expected bodies: [a body, frame] and an axis")
            markers[k, 1] = positions[bodies[k, 0]]
        else:
            if "at" not in item:
                raise InputError(source, field, "expected the joint's point 'at'")
            markers[k] = _markers(item["at"], bodies[k], positions, field, source)
    return Joints(
        np.array([KINDS[item["kind"]] for item in joints], np.int64), bodies, markers,
        np.array(["xyz".index(item.get("axis", "x")) for item in joints], np.int64),
        sum(EQUATIONS[item["kind"]] for item in joints),
    )  # fmt: skip
