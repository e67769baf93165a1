"""Vehicles from YAML files: bodies, force elements and joints for kernels."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wrcore.bodies.inertia import principal, tensor_of
from wrcore.bodies.joint import Joint, Joints, build_joints
from wrcore.bodies.marker import FRAME
from wrcore.equations.model import Bodies
from wrcore.errors import InputError
from wrcore.errors.checked_yaml import read_yaml, validate
from wrcore.errors.messages import warn
from wrcore.forces.suspension import PRELOAD, Elements
from wrcore.vehicle.changes import GROUPS, changed
from wrcore.vehicle.element_parts import check_element
from wrcore.vehicle.elements import compile_elements
from wrcore.vehicle.layout import Layout

GRAVITY = 9.81
"""Gravitational acceleration, m/s^2; the static wheel loads of Manchester vehicle 1 are based on this value."""

IMPOSSIBLE = 1.01
"""Ratio of a principal moment of inertia to the sum of the two others above which wrcore warns; 1 is the physical
limit."""

BODY_KEYS = {
    "wheelset": (("rolling_radius", "tape_circle_half_distance"), ("independent_wheels",)),
    "body": ((), ()),
    "axle_box": (("wheelset",), ()),
}
"""Required and optional keys of each kind of body, in addition to kind, mass, inertia and position."""

LARGEST_LIFT = 0.02
"""Largest accepted difference between the height of a wheelset's centre and its rolling radius, m; it detects wrong
positions."""


@dataclass(frozen=True, eq=False)
class Vehicle:
    """A vehicle in its nominal position."""

    name: str
    source_file: str
    body_names: tuple
    """Names of the bodies in the order of the state vector."""
    positions: np.ndarray
    """(n, 3): nominal centres of mass, m."""
    rolling_radius: float
    """Nominal rolling radius of the wheelsets, m; NaN for a vehicle without wheelsets."""
    half_distance: float
    """Half of the distance between the wheelsets' tape circles, m; NaN for a vehicle without wheelsets."""
    bodies: Bodies
    elements: Elements
    joints: Joints
    data: dict
    """Content of the vehicle file with defaults, for provenance."""
    unit: "Vehicle | None" = None
    """Single vehicle of a train of equal vehicles, else None."""
    directed: tuple = ()
    """Names of the force elements along one direction, row by row of ``elements.directed``."""

    @property
    def wheelset_names(self):
        """Names of the wheelsets from the front."""
        return tuple(self.body_names[b] for b in self.bodies.wheelsets)

    def nominal_wheel_load(self, body):
        """Estimate the vertical load of a wheel of a wheelset in nominal position, N.

        In a vehicle with further bodies the weight of all bodies is divided equally among the wheels, without bodies
        that joints hold at their height. For wheelsets only, the load is half of the wheelset's weight less its
        vertical preloads.
        """
        if len(self.bodies.mass) > len(self.bodies.wheelsets):
            joints = [(item["kind"], item.get("axis"), item["bodies"][0]) for item in self.data["joints"]]
            held = {body for kind, axis, body in joints if kind == "coordinate" and axis == "z"}
            carried = np.sum(self.bodies.mass[[name not in held for name in self.body_names]])
            return float(carried) * GRAVITY / (2 * len(self.bodies.wheelsets))
        pair = np.repeat(self.elements.pairs[:, 0], np.diff(self.elements.first_spring))
        return 0.5 * float(self.bodies.mass[body] * GRAVITY - np.sum(self.elements.springs[pair == body, PRELOAD + 2]))


def vehicle_of(spec, find, source, laws):
    """Return the vehicle of a scene's key ``vehicle`` with its changes (`wrcore.vehicle.changes`).

    The key holds the content of a vehicle file or its path, which ``find`` resolves. ``laws`` finds user-defined laws
    of the elements. An InputError names the element, the expected value, and the vehicle file or, if the error is in
    the scene, ``source``.
    """
    parameters = spec["parameters"]
    data, name = parameters, f"{source}: vehicle.parameters"
    if isinstance(parameters, str):
        path = find(parameters)
        data, name = _with_laws(read_yaml(path), Path(path).parent, laws), str(Path(path).name)
    changes = {group: spec[group] for group in GROUPS if spec.get(group)}
    if not changes:
        return build_vehicle(data, name, spec["axle_boxes"])
    data, reached = changed(_validated(data, name), changes, source)
    try:
        return build_vehicle(data, name, spec["axle_boxes"])
    except InputError as error:
        if any(f"{error.field}.".startswith(f"{field}.") for field in reached):
            raise InputError(source, f"vehicle.{error.field}", error.expected) from None
        raise


def _with_laws(data, folder, laws):
    """Return the content of a vehicle file with absolute paths of files of user-defined laws in the same folder."""
    elements = data.get("elements")
    for item in elements if isinstance(elements, list) else ():
        if isinstance(item, dict) and isinstance(item.get("law"), str):
            item["law"] = laws.beside(item["law"], folder)
    return data


def build_vehicle(data, source, axle_boxes=True):
    """Check and compile the content of a vehicle file, which errors name ``source``.

    Without ``axle_boxes`` the mass of each box is added to its wheelset, with m y^2 and the box's moments of inertia in
    roll and yaw. The wheelset's pitch inertia is unchanged, because the box does not turn with it. Force elements of
    the box act on the wheelset.
    """
    data = _validated(data, source)
    _check_bodies(data["bodies"], source)
    _check_names(data, source)
    for item in data["elements"]:
        check_element(item, source)
    if not axle_boxes:
        data = {**data, "bodies": _lumped(data["bodies"])}
    return compile_vehicle(data, source)


def compile_vehicle(data, source):
    """Compile a checked vehicle description to bodies, force elements and joints for kernels."""
    layout = _layout(data, source)
    parts = [data["bodies"][name] for name in layout.names]
    wheelsets = np.flatnonzero(layout.spins)
    wheelsets = wheelsets[np.argsort(-layout.positions[wheelsets, 0], kind="stable")]  # numbered from the front
    apart = [k for k, body in enumerate(wheelsets) if parts[body].get("independent_wheels")]
    first = parts[wheelsets[0]] if wheelsets.size else {}
    joints = data["joints"] + [
        {"name": name, "kind": "revolute", "bodies": [part["wheelset"], name], "axis": "y",
         "at": [data["bodies"][part["wheelset"]]["position"][0], part["position"][1],
                data["bodies"][part["wheelset"]]["position"][2]]}
        for name, part in zip(layout.names, parts, strict=True) if part["kind"] == "axle_box"
    ]  # fmt: skip
    compiled = _joints(joints, layout, source)
    elements, directed = compile_elements(data["elements"], layout, joints, GRAVITY)
    independent = np.stack((np.array(apart, np.int64), elements.states + np.arange(len(apart))), axis=-1)
    moments, axes = principal([tensor_of(part["inertia"]) for part in parts], layout.spins)
    bodies = Bodies(layout.mass, moments, layout.spins.astype(np.int64), wheelsets, independent, axes)
    return Vehicle(
        data["name"], source, layout.names, layout.positions, float(first.get("rolling_radius", np.nan)),
        float(first.get("tape_circle_half_distance", np.nan)), bodies,
        elements._replace(states=elements.states + len(apart)), compiled, data, directed=directed,
    )  # fmt: skip


def _validated(data, source):
    """Return the data checked against the schema; errors name an element or joint instead of its list index."""
    try:
        return validate(data, "vehicle", source)
    except InputError as error:
        group, *path = error.field.split(".")
        if group in ("elements", "joints") and path:
            item = data[group][int(path[0])]
            if isinstance(item, dict) and isinstance(item.get("name"), str) and item["name"]:
                path[0] = item["name"]
        raise InputError(source, ".".join([group, *path]), error.expected) from None


RESERVED = {
    "t": "the times of a run", "end": "the end of a run", "energy": "the energies of a run",
    "drive": "motors and brakes of a run", "control": "control laws of a run",
}  # fmt: skip
"""Names that no body may have, because runs and their files use them, with their meaning there."""


def _check_names(data, source):
    """Raise an InputError if two elements or two joints share a name, or if a body has a name in `RESERVED`."""
    for name in sorted(RESERVED.keys() & data["bodies"]):
        raise InputError(source, f"bodies.{name}", f"expected another name, as {name} stands for {RESERVED[name]}")
    for group in ("elements", "joints"):
        names = [item["name"] for item in data[group]]
        for k, name in enumerate(names):
            if name in names[:k]:
                raise InputError(source, f"{group}.{name}", f"expected a name of its own for each of the {group}")


def _check_bodies(bodies, source):
    """Raise an InputError for wrong keys of bodies, impossible inertia or unequal wheelsets.

    Wheelset frames do not spin, so a wheelset's products of inertia xy and yz must be 0.
    """
    wheelsets = {name: part for name, part in bodies.items() if part["kind"] == "wheelset"}
    for name, part in bodies.items():
        needed, optional = BODY_KEYS[part["kind"]]
        for key in needed:
            if key not in part:
                raise InputError(source, f"bodies.{name}.{key}", f"expected a value, as kind {part['kind']} needs one")
        for key in part:
            if key not in ("kind", "mass", "inertia", "position", *needed, *optional):
                raise InputError(source, f"bodies.{name}.{key}", f"unknown for kind {part['kind']}")
        moments = np.linalg.eigvalsh(tensor_of(part["inertia"]))
        if moments[0] <= 0.0:
            expected = f"expected products that leave all principal moments above 0, got one of {moments[0]:.4g} kg m^2"
            raise InputError(source, f"bodies.{name}.inertia", expected)
        if part["kind"] == "wheelset":  # its pitch inertia may include a motor's rotor, times the gear ratio squared
            low, high = sorted(part["inertia"][key] for key in ("roll", "yaw"))
            moments = low, part["inertia"]["pitch"], high
        if moments[2] > IMPOSSIBLE * (moments[0] + moments[1]):
            warn(f"{source}: bodies.{name}.inertia: no mass has a moment of {moments[2]:.4g} kg m^2 beside two of"
                 f" {moments[0]:.4g} and {moments[1]:.4g}: it is at most their sum")  # fmt: skip
        if part["kind"] == "axle_box" and part["wheelset"] not in wheelsets:
            raise InputError(source, f"bodies.{name}.wheelset", f"expected a wheelset, got {part['wheelset']!r}")
    for name, part in wheelsets.items():
        for key in ("rolling_radius", "tape_circle_half_distance"):
            first = next(iter(wheelsets))
            if part[key] != wheelsets[first][key]:
                raise InputError(source, f"bodies.{name}.{key}", f"expected {wheelsets[first][key]} as for {first}")
        x, y, z = part["position"]
        if y != 0.0 or abs(z - part["rolling_radius"]) > LARGEST_LIFT:
            expected = f"expected y = 0 and z within {LARGEST_LIFT:g} m of the rolling radius, got {[x, y, z]}"
            raise InputError(source, f"bodies.{name}.position", expected)
        for key in ("xy", "yz"):
            if part["inertia"].get(key):
                expected = "expected no such key in a wheelset: what does not turn with its axle may have xz alone"
                raise InputError(source, f"bodies.{name}.inertia.{key}", expected)


def _lumped(bodies):
    """Return the bodies with each axle box lumped into its wheelset.

    The boxes stay in the dict as kind ``lumped``, so that elements can name them.
    """
    bodies = {name: {**part, "inertia": dict(part["inertia"])} for name, part in bodies.items()}
    for part in bodies.values():
        if part["kind"] == "axle_box":
            wheelset = bodies[part["wheelset"]]
            wheelset["mass"] += part["mass"]
            across = part["mass"] * (part["position"][1] - wheelset["position"][1]) ** 2
            for key in ("roll", "yaw"):
                wheelset["inertia"][key] += across + part["inertia"][key]
            wheelset["inertia"]["xz"] = wheelset["inertia"].get("xz", 0.0) + part["inertia"].get("xz", 0.0)
            part["kind"] = "lumped"
    return bodies


def _layout(data, source):
    """Return the `Layout` of a checked description; lumped axle boxes are aliases of their wheelsets."""
    parts = {name: part for name, part in data["bodies"].items() if part["kind"] != "lumped"}
    return Layout(
        source, tuple(parts), np.array([part["position"] for part in parts.values()], float),
        np.array([part["mass"] for part in parts.values()], float),
        np.array([part["kind"] == "wheelset" for part in parts.values()]),
        {name: part["wheelset"] for name, part in data["bodies"].items() if part["kind"] == "lumped"},
    )  # fmt: skip


def _joints(joints, layout, source):
    """Check joints and compile them to `Joints`."""
    items = []
    for item in joints:
        field, length = f"joints.{item['name']}", 0.0
        bodies = layout.ends(item, field)
        if item["kind"] in ("coordinate", "revolute") and "axis" not in item:
            raise InputError(source, field, "expected an axis: x, y or z")
        if item["kind"] == "coordinate":
            if bodies[1] != FRAME:
                raise InputError(source, f"{field}.bodies", "expected [a body, frame]")
            markers = [np.zeros(3), layout.positions[bodies[0]]]
        else:
            if "at" not in item:
                raise InputError(source, field, "expected the joint's point 'at'")
            at = np.array(item["at"], float).reshape(-1, 3)
            if len(at) != (2 if item["kind"] == "rigid_link" else 1):
                raise InputError(source, f"{field}.at", "expected two points for a rigid link, one for other joints")
            length = float(np.linalg.norm(at[0] - at[-1]))
            if item["kind"] == "rigid_link" and length < 1e-3:
                raise InputError(source, f"{field}.at", "expected two points at least 1 mm apart")
            markers = [layout.marker(point, body, field) for point, body in zip(at[[0, -1]], bodies, strict=True)]
        axis = "xyz".index(item.get("axis", "x"))
        if item["kind"] == "rigid":
            kinds, axis = ("no_turn", "revolute"), 1
        else:
            kinds = (item["kind"],)
        items += [Joint(item["name"], kind, tuple(bodies), np.array(markers), axis, length) for kind in kinds]
    return build_joints(items, layout.spins, source)
