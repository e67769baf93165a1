"""Every key of every schema has an effect: another legal value changes what is compiled, or the run that is made.

Bases are scenes, vehicles and plans in which keys apply. Each key of a schema must stand in one of them, so that a new
key without an entry fails here. A key is tried wherever it stands, until another value changes the record of its base;
values that are refused do not count. Keys that only name or describe are `LABELS`.
"""

import copy
import pickle
import re
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

import wrcore as wr
from tests.conftest import ELLIPTIC, SCENES
from tests.equations.test_energy import EVERYTHING
from wrcore.creep.table import ensure_table
from wrcore.errors import InputError
from wrcore.errors.checked_yaml import read_yaml, schema_of
from wrcore.errors.schema_keys import keys_of
from wrcore.forces.kinds import KINDS
from wrcore.geometry.profiles.standards import named_profile
from wrcore.run import simulation
from wrcore.run.checkpoints import digest_of, model_fingerprint
from wrcore.run.simulate import simulate
from wrcore.scene import compile as scene_compile
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.scene.parts import creep
from wrcore.vehicle.description import build_vehicle

SUSPENDED, VEHICLES = ELLIPTIC / "suspended_wheelset.yaml", ELLIPTIC.parent / "vehicles"

LABELS = {
    "scene": {"name", "description", "vehicle.model", "drive.motors[].name", "drive.brakes[].name"},
    "vehicle": {"name", "source", "templates", "elements[].name", "joints[].name", "bodies.*.kind", "elements[].kind"},
    "sweep": {"name", "description"},
    "wear": {"name", "description"},
}
"""Keys that name or describe, and kinds, which decide on the other keys, by schema."""

# ----------------------------------------------------------------------------------------------------- other values


def parts_of(pattern):
    return re.sub(r"\[\]", ".[]", pattern).split(".")


def concrete(data, parts):
    """Paths in data that a pattern means."""
    if not parts:
        return [()]
    first, *rest = parts
    if first == "[]":
        keys = range(len(data)) if isinstance(data, list) else ()
    elif first == "*":
        keys = list(data) if isinstance(data, dict) else ()
    else:
        keys = [first] if isinstance(data, dict) and first in data else ()
    return [(key, *path) for key in keys for path in concrete(data[key], rest)]


def at(data, path):
    for key in path:
        data = data[key]
    return data


def schema_at(schema, parts):
    """The part of a schema that describes a key, or an empty one."""
    for part in parts:
        inside = [schema, *schema.get("anyOf", ())]
        if part == "[]":
            found = [one["items"] for one in inside if "items" in one]
        elif part == "*":
            found = [one["additionalProperties"] for one in inside if isinstance(one.get("additionalProperties"), dict)]
        else:
            found = [one["properties"][part] for one in inside if part in one.get("properties", {})]
        if not found:
            return {}
        schema = found[0]
    return schema


def others(value, schema):
    """Values other than a key's that its schema allows, most of them."""
    if "enum" in schema:
        return [one for one in schema["enum"] if one != value]
    if isinstance(value, bool):
        return [not value]
    if isinstance(value, int) and schema.get("type") == "integer":
        return [value + 1, 2 * value]
    if isinstance(value, int | float):
        return [1.01 * value + 1e-3 * (value == 0), 0.97 * value - 1e-3 * (value == 0), 1.5 * value, 2.0]
    if isinstance(value, list) and value and all(isinstance(one, int | float) for one in value):
        return [[1.01 * one for one in value], [1.001 * one + 1e-3 for one in value]]
    if isinstance(value, list) and len(value) > 1:
        return [value[:-1], value[::-1]]
    if isinstance(value, list) and value and isinstance(value[0], list):
        return [[[1.01 * float(one) for one in row] for row in value]]
    return []


def changed(data, paths, value):
    data = copy.deepcopy(data)
    for path in paths:
        at(data, path[:-1])[path[-1]] = copy.deepcopy(value)
    return data


def has_effect(pattern, bases, record, schema, special=None):
    """Whether another value of a key changes the record of one of the bases; None where it stands in none."""
    found = None
    for base in bases:
        paths = concrete(base, parts_of(pattern))
        if not paths:
            continue
        found, before = False, record(base)
        for chosen in [*([path] for path in paths[:8]), paths]:
            value = at(base, chosen[0])
            for other in (special or {}).get(pattern, ()) or others(value, schema_at(schema, parts_of(pattern))):
                try:
                    if record(changed(base, chosen, other)) != before:
                        return True
                except InputError:
                    continue
    return found


def leaves(schema):
    """Keys of a schema below which there are no others, but those that are labels."""
    keys = list(dict.fromkeys(key for key, *_ in keys_of(schema)))
    inner = [key for key in keys if not any(other.startswith((f"{key}.", f"{key}[")) for other in keys)]
    return [key for key in inner if key not in LABELS.get(schema, ())]


# ------------------------------------------------------------------------------------------------------------ scenes

LAWS = """
import numpy as np
from numba import njit

def friction(s):
    return np.stack([0.3 + 0.001 * s, 0.3 - 0.001 * s])

def friction_2(s):
    return np.stack([0.3 + 0.002 * s, 0.3 - 0.001 * s])

def falling(w):
    return 0.4 + 0.6 * np.exp(-0.6 * w)

def falling_2(w):
    return 0.5 + 0.5 * np.exp(-0.6 * w)

def waves(s):
    return np.stack([0.001 * np.sin(0.5 * s), 0.0 * s, 0.001 * np.sin(0.5 * s), 0.0 * s])

def waves_2(s):
    return 2.0 * waves(s)

@njit
def push(stretch, speed, states, parameters, rates):
    return parameters[0] * stretch

@njit
def push_2(stretch, speed, states, parameters, rates):
    return parameters[0] * stretch + 1.0 * speed

@njit
def steer(t, inputs, states, parameters, outputs, following):
    outputs[:] = parameters[0] * inputs[0]

@njit
def steer_2(t, inputs, states, parameters, outputs, following):
    outputs[:] = parameters[0] * inputs[0] + 1.0
"""
SPRING = {"stiffness": 1e8, "damping": 1e5}
SPECTRUM = {"level": "low", "seed": 1, "length": 60.0, "begin": 1.0, "spacing": 0.25, "shortest": 3.0, "longest": 80.0}
CHECK_RAIL = {
    "rail": "left", "begin": 2.0, "length": 9.0, "flangeway": 0.04, "flare": {"length": 0.5, "opening": 0.03},
    "top": 0.02, "back_to_back": 1.36, "stiffness": 1e7, "friction": 0.3,
}  # fmt: skip
PATH = [
    {"tangent": 20.0}, {"transition": 60.0, "shape": "bloss"},
    {"curve": 150.0, "radius": 600.0, "cant": 0.08, "widening": 0.005},
    {"transition": 80.0, "radius": -900.0, "cant": 0.02, "widening": 0.0, "shape": "linear"},
    {"transition": 60.0}, {"curve": 60.0, "radius": -500.0}, {"transition": 60.0}, {"tangent": 10.0},
]  # fmt: skip
TABLE = {"arc_length": [0.0, 40.0]}
ROUND = {
    "flats": [{"length": 0.05, "depth": 1e-3, "at": 0.5}], "polygon": [{"order": 3, "amplitude": 1e-4, "phase": 0.2}],
    "angle": 3.0,
}  # fmt: skip


def files(folder):
    """Files that bases name, beside a scene."""
    data = read_yaml(SUSPENDED) | {"vehicle": {"parameters": read_yaml(VEHICLES / "suspended_wheelset.yaml")}}
    (folder / "scene.yaml").write_text(yaml.safe_dump(data))
    (folder / "laws.py").write_text(LAWS)
    s = 0.25 * np.arange(200)
    for name, size in (("one", 1e-3), ("two", 2e-3)):
        rows = "".join(f"{a + 100:.2f},{size * np.sin(a):.6f}\n" for a in s)
        (folder / f"{name}.csv").write_text(f"s_m,level_m\n{rows}")
        angles = np.linspace(0.0, 2.0 * np.pi, 73)[:-1]
        rows = "".join(f"{a:.9f},{0.1 * size * np.sin(2 * a):.9f}\n" for a in angles)
        (folder / f"{name}_round.csv").write_text(f"angle_rad,deviation_m\n{rows}")
    for name, size in (("wheel", 0.0), ("worn", 2e-4)):
        curve = named_profile("S1002", "wheel")
        worn = curve.f - size * np.exp(-((curve.u / 0.01) ** 2))
        np.savetxt(folder / f"{name}.csv", np.column_stack([curve.u, worn])[::2], delimiter=",", header="u_m,f_m",
                   comments="")  # fmt: skip
    for name, last in (("slices", "wheel"), ("other", "worn")):
        rows = "".join(f"{a:.6f},{'worn' if k == 3 else last if k == 5 else 'wheel'}.csv\n"
                       for k, a in enumerate(np.linspace(0.0, 2.0 * np.pi, 13)[:-1]))  # fmt: skip
        (folder / f"{name}.csv").write_text(f"angle_rad,profile\n{rows}")
    named = ("one", "two", "one_round", "two_round", "slices", "other", "worn")
    return {name: str(folder / f"{name}.csv") for name in named} | {"scene": str(folder / "scene.yaml")}


def wheels(**one):
    """A scene's wheels of which one differs, in each of the places where that can be said."""
    profile = {"profile": "S1002"}
    both = [{**profile, side: one} for side in ("left", "right")]
    return [{"wheel": spec} for spec in both + [{**profile, "wheelsets": {"wheelset": {side: one}}} for side in
                                                ("left", "right")]]  # fmt: skip


def scene_bases(names):
    """Changes of the suspended wheelset, in each of which some keys apply."""
    motor = {"name": "m", "bodies": ["wheelset", "frame"]}
    law = {"law": "laws.py:steer", "inputs": ["wheelset.y_m", "wheelset.vy_m_per_s"], "outputs": ["m"],
           "parameters": [1.0, 2.0, 3.0], "states": [0.0]}  # fmt: skip
    guided = {"name": "left", "bodies": ["wheelset_1", "car_body"], "wheel": "left"}
    turning = [guided, {**guided, "name": "right", "wheel": "right"}]
    steered = {**law, "inputs": ["wheelset_1.y_m", "wheelset_1.vy_m_per_s"], "outputs": ["left", "right"]}
    locomotive = {"parameters": read_yaml(VEHICLES / "locomotive.yaml")}
    pulled = {"name": "b", "bodies": ["wheelset_1", "bogie_1"], "force": 5.0}
    table = {**TABLE, "mu": [0.3, 0.2]}
    across = {"angle": [0.1, 0.5], "factor": [0.8, 0.3]}
    return [
        {"speed": 20.0, "wheel": {"profile": "S1002"}, "rail": {"profile": "60E1", "inclination": "1/40"}},
        {"contact": {"detection": "spatial", "patch": "maximum", "creep": {"model": "table"}}},
        {"contact": {"detection": "auto", "detection_tolerance": 1e-7, "patch": "moment", "creep": {
            "model": "polach", "least_speed": 1e-3, "k_A": 0.8, "k_S": 0.4},
            "normal": {"damping": {"c_e": 0.8, "v0": 0.05}},
            "material": {"shear_modulus": 8.2e10, "poisson_ratio": 0.28}}},
        {"contact": {"patch": "exact", "resolution": "middle", "slip": "surfaces"}},
        {"contact": {"patch": "moment", "creep": {"model": "table", "planes": "ellipse", "tolerance": 0.004}}},
        {"contact": {"patch": "moment", "creep": {"model": "table", "table": names["table"]}}},
        *({"contact": {"patch": "moment", "friction": friction}} for friction in (
            {"mu": 0.3, "falling": {"ratio": 0.4, "decay": 0.6}}, table,
            {"mu": 0.3, "across": across}, {"mu": 0.3, "across": {"left": across, "right": across}},
            {"left": 0.3, "right": table}, {"left": table, "right": 0.2},
            {"mu": 0.3, "falling": {"law": "laws.py:falling", "length": 5.0, "spacing": 0.01}},
            {"law": "laws.py:friction", "begin": -5.0, "length": 40.0, "spacing": 0.5})),
        {"rail": {"profile": "60E1", "inclination": "1/40", "left": {"profile": "54E1", "inclination": "1/20"},
                  "right": {"profile": "54E1", "inclination": "1/20"}}},
        *wheels(profile="cone:1/40", rolling_radius=0.459),
        {"drive": {"motors": [{**motor, "torque": 5.0}], "brakes": [{**motor, "name": "b", "force": 5.0}]}},
        {"drive": {"motors": [{**motor, "force": 5.0}], "brakes": [{**motor, "name": "b", "torque": 5.0}]}},
        {"drive": {"motors": [motor], "controller": {"body": "wheelset", "speed": 20.0, "proportional": 1e4,
                                                     "integral": 10.0, "limit": 1e5, "brake_limit": 9e4}}},
        {"drive": {"motors": [motor]}, "control": {"law": {**law, "rate": 100.0}}},
        {"vehicle": {"parameters": read_yaml(VEHICLES / "guided_car.yaml")},
         "drive": {"motors": turning, "brakes": [{**guided, "name": "b", "force": 5.0}]}, "control": {"law": steered}},
        {"vehicle": locomotive, "drive": {"brakes": [pulled], "motors": [{**pulled, "name": "m"}]}},
        {"vehicle": locomotive, "drive": {
            "motors": [{"name": "m", "bodies": ["wheelset_1", "bogie_1"]}],
            "controller": {"body": "bogie_1", "speed": 20.0, "proportional": 1e4, "limit": 1e5}}},
        {"vehicle": {"count": 2, "spacing": 30.0}},
    ]  # fmt: skip


SPECIAL = {
    "wheel.profile": ["cone:1/40"], "rail.profile": ["54E1"], "rail.inclination": ["1/20"],
    **{f"rail.{side}.profile": ["60E1"] for side in ("left", "right")},
    **{f"rail.{side}.inclination": ["1/40"] for side in ("left", "right")},
    **{f"wheel.{where}.profile": ["cone:1/20"] for where in ("left", "right", "wheelsets.*.left", "wheelsets.*.right")},
    "contact.creep.model": ["linear"], "contact.friction.law": ["laws.py:friction_2"],
    "contact.friction.falling.law": ["laws.py:falling_2"],
    "control.*.law": ["laws.py:steer_2"], "control.*.inputs": [["wheelset.y_m", "wheelset.yaw_rad"]],
    "contact.creep.planes": ["sdec"], "drive.controller.body": ["bogie_2"], "control.*.outputs": [["right", "left"]],
    **{f"drive.{kind}[].bodies": [["wheelset_2", "bogie_1"]] for kind in ("motors", "brakes")},
}  # fmt: skip


class Stop(Exception):
    """Raised with a model instead of going on."""


@pytest.fixture
def record(monkeypatch, names):
    """Function of a scene's changes: digest of its compiled model, and of what is asked of creep tables."""
    table, asked = ensure_table(0.28), []

    def instead(*arguments):
        asked.append(arguments[:3])
        nu = arguments[0] if isinstance(arguments[0], float) else 0.28
        return SimpleNamespace(nu=nu, kernel_data=table.kernel_data)

    def stop(model):
        raise Stop(model)

    monkeypatch.setattr(creep, "ensure_table", instead)
    monkeypatch.setattr(creep, "load_table", instead)
    monkeypatch.setattr(creep, "kept_tables", lambda *_: ["a table"])
    monkeypatch.setattr(scene_compile, "warn_of_rigid_rails", lambda *_: None)

    def made(changes):
        asked.clear()
        scene = load_scene(names["scene"], changes)
        try:
            compile_scene(scene, meanwhile=stop)
        except Stop as stopped:
            return model_fingerprint(stopped.args[0]), repr(asked)

    return made


@pytest.fixture(scope="module")
def names(tmp_path_factory):
    folder = tmp_path_factory.mktemp("keys")
    found = files(folder)
    for name in ("table", "another"):
        (folder / f"{name}.h5").write_bytes(b"")
        found[name] = str(folder / f"{name}.h5")
    return found


STATE = ("initial.", "integration.", "output.")
ROUND_KEY = ".out_of_round."
WITH_BOXES = {"parameters": read_yaml(VEHICLES / "trailer_vehicle.yaml"), "axle_boxes": True}
"""A vehicle whose bodies pitch."""

ELSEWHERE = {"track", *(f"vehicle.{key}" for key in ("parameters", "axle_boxes", "bodies", "elements", "joints"))}
"""Keys of other schemas, or of the vehicle's test."""

SCENE_KEYS = [key for key in leaves("scene") if not key.startswith(STATE) and ROUND_KEY not in key]


@pytest.mark.parametrize("key", [key for key in SCENE_KEYS if key not in ELSEWHERE])
def test_scene_key_changes_the_model(key, record, names):
    special = SPECIAL | {"contact.creep.table": [names["another"]]}
    assert has_effect(key, scene_bases(names), record, schema_of("scene"), special)


@pytest.mark.parametrize("key", [key for key in leaves("scene") if ROUND_KEY in key])
def test_key_of_a_wheel_out_of_round_changes_its_shape(key, names):
    shapes = (ROUND, {"table": names["one_round"]}, {"slices": names["slices"]})
    bases = [base for shape in shapes for base in wheels(out_of_round=shape)]
    where = key.partition(ROUND_KEY)[0]
    special = {
        f"{where}.out_of_round.{kind}": [names[other]] for kind, other in (("table", "two_round"), ("slices", "other"))
    }

    def record(changes):
        return pickle.dumps(load_scene(names["scene"], changes).out_of_round)

    assert has_effect(key, bases, record, schema_of("scene"), special)


@pytest.fixture
def begun(names, monkeypatch):
    """Function of a scene's changes: what the integration begins with."""

    def stop(model, start, times, *settings, **more):
        raise Stop(model_fingerprint(model), digest_of((start, times)).hexdigest(), settings[:5], more["most_steps"])

    def record(changes):
        simulated = simulation.Simulation(load_scene(names["scene"], changes))
        monkeypatch.setattr(simulation, "integrate", stop)
        scene = simulated.scene.data
        times = np.arange(0.0, scene["integration"]["duration"], 1.0 / scene["output"]["rate"])
        with pytest.raises(Stop) as stopped:
            simulated.advance(times)
        return repr(stopped.value.args)

    return record


@pytest.mark.parametrize("key", [key for key in leaves("scene") if key.startswith(STATE)])
def test_key_of_the_run_reaches_the_integration(key, names, begun):
    bases = [
        {"contact.patch": "moment", "initial": {"y": 2e-3, "yaw": 1e-3}},
        {"contact.patch": "moment", "initial": {"bodies": {"wheelset": dict.fromkeys(
            ("x", "y", "z", "roll", "yaw", "vx", "vy", "vz", "wx", "wy", "wz"), 0.0)
            | {"z": 0.46, "vx": 20.0, "wy": 43.0}}}},
        {"contact.patch": "moment", "vehicle": WITH_BOXES, "initial": {"bodies": {"axle_box_1_left": {"pitch": 0.01}}}},
        {"contact.patch": "moment", "integration": {"duration": 0.02, "method": "rk4", "rtol": 1e-4, "atol": 1e-8,
            "longest_step": 0.01, "most_steps": 1000, "baumgarte": {"alpha": 5.0, "beta": 5.0}}},
        {"contact.patch": "moment", "integration": {"duration": 0.02, "method": "rk4", "step": 1e-4}},
        {"contact.patch": "moment", "output": {"rate": 200.0, "channels": ["pose", "velocity"]},
         "integration.duration": 0.02},
    ]  # fmt: skip

    def record(changes):
        if key == "output.channels":
            run = simulate(names["scene"], changes, progress=False)
            return [(group, list(run.groups[group])) for group in sorted(run.groups)]
        return begun(changes)

    special = {"output.channels": [["pose", "contact"]], "integration.method": ["rodas5"]}
    assert has_effect(key, bases, record, schema_of("scene"), special)


@pytest.mark.parametrize("body", ["car_body", "bogie_1"])
def test_pitch_of_a_body_reaches_the_integration(body, begun):
    still, turned = (
        begun({"contact.patch": "moment", "vehicle": WITH_BOXES, "initial.bodies": {body: {"pitch": pitch}}})
        for pitch in (0.0, 0.01)
    )
    assert still != turned


# ------------------------------------------------------------------------------------------------------------ tracks


def track_bases(names):
    gradients = [{"gradient": 0.0, "length": 100.0}, {"gradient": 0.02, "radius": 3000.0, "vertical_curve": "parabola"}]
    fades = {"fade_in": 5.0, "fade_out": 5.0}
    return [
        {"gauge": 1.435, "gauge_depth": 0.013},
        {"rounding": 4.0, "path": PATH, "cant_about": "lower_rail", "rail_climb": True, "widened": "both"},
        {"gradients": gradients},
        {"irregularity": {"points": names["one"], "chainage_at_start": 100.0, **fades}},
        {"irregularity": {"spectrum": SPECTRUM, **fades}},
        {"irregularity": {"own": {"law": "laws.py:waves", "begin": 0.0, "length": 50.0, "spacing": 0.25}, **fades}},
        {"support": {"rail": {"mass": 60.0, "lateral": SPRING, "vertical": SPRING}, "sleeper": {
            "mass": 300.0, "roll_inertia": 80.0, "lateral": SPRING, "vertical": SPRING}}},
        {"check_rails": [CHECK_RAIL]},
        {"crossing": {"slices": "crossing:1/12", "at": 9.0, "rail": "right", "reversed": False}},
        {"corrugation": {"wavelength": 0.1, "amplitude": 1e-5, "begin": 3.0, "length": 9.0, "fade": 1.0,
                         "rail": "both"}},
    ]  # fmt: skip


@pytest.mark.parametrize("key", leaves("track"))
def test_track_key_changes_the_model(key, record, names):
    special = {
        "irregularity.points": [names["two"]], "irregularity.own.law": ["laws.py:waves_2"],
        "crossing.slices": ["crossing:1/9"],
    }  # fmt: skip

    def of_track(track):
        changes = {"rail": {"profile": "60E1", "inclination": 0}, "track": track, "contact.patch": "moment"}
        if {"crossing", "corrugation"} & set(track):  # what wheels see of it is a table that takes seconds
            scene = load_scene(names["scene"], changes)
            return pickle.dumps((scene.crossings, scene.corrugation))
        return record(changes)

    assert has_effect(key, track_bases(names), of_track, schema_of("track"), special)


# ---------------------------------------------------------------------------------------------------------- vehicles


def made(data, axle_boxes=True):
    vehicle = build_vehicle(data, "vehicle", axle_boxes=axle_boxes)
    parts = vehicle.bodies, vehicle.elements, vehicle.joints, vehicle.positions
    return vehicle.body_names, digest_of((*parts, vehicle.rolling_radius, vehicle.half_distance)).hexdigest()


def vehicle_bases():
    """Vehicle files of the examples, one of them with products of inertia and all joints."""
    named = [path.stem for path in sorted(VEHICLES.glob("*.yaml"))]
    found = [read_yaml(VEHICLES / f"{name}.yaml") for name in named]
    trailer = copy.deepcopy(found[named.index("trailer_vehicle")])
    trailer["bodies"]["car_body"]["inertia"] |= {"xy": 1.0, "xz": 2.0, "yz": 3.0}
    turn = {"name": "turn", "kind": "revolute", "bodies": ["car_body", "bogie_1"], "axis": "z", "at": [9.5, 0.0, 0.6]}
    return [{**trailer, "joints": [*trailer.get("joints", []), turn]}, *found]


@pytest.mark.parametrize("kind", KINDS)
def test_bodies_of_an_element_decide_where_it_acts(kind):
    outcomes = []
    for item in [one for one in [*EVERYTHING, *MORE] if one["kind"] == kind]:
        base = vehicle_with(item)
        before = made(base)
        for bodies in (["lower", "upper"], ["upper", "frame"], ["lower", "frame"]):
            base["elements"][-1]["bodies"] = bodies
            try:
                outcomes.append(made(base) != before)
            except InputError:  # as of friction whose other element acts between the bodies that were
                continue
    assert outcomes and all(outcomes)


def test_axle_boxes_change_the_bodies():
    trailer = read_yaml(VEHICLES / "trailer_vehicle.yaml")
    assert made(trailer) != made(trailer, axle_boxes=False)


VEHICLE_KEYS = [key for key in leaves("vehicle") if not key.startswith("elements[].")]


@pytest.mark.parametrize("key", VEHICLE_KEYS)
def test_vehicle_key_changes_the_bodies_or_joints(key):
    special = {
        "bodies.*.kind": ["body"], "bodies.*.wheelset": ["wheelset_2"], "joints[].kind": ["spherical"],
        "joints[].bodies": [["car_body", "bogie_2"]], "joints[].at": [[9.4, 0.0, 0.6]], "joints[].axis": ["x", "y"],
    }  # fmt: skip
    if key == "bodies.*.wheelset":
        special["bodies.*.wheelset"] = [f"wheelset_{k}" for k in range(1, 5)]
    assert has_effect(key, vehicle_bases(), made, schema_of("vehicle"), special)


AIR = {
    "kind": "air_spring", "at": [0, 0, 1.5], "bending_stiffness": 6.0, "preload": [0, 0, 600.0],
    "effective_area": 0.2, "volume": 0.02, "reservoir": 0.03,
    "orifice_damping": 2e4, "orifice_exponent": 1.5, "area_change": 0.1, "polytropic_exponent": 1.3,
    "shear_stiffness": 1e5,
}  # fmt: skip
OWN_LAW = {
    "kind": "own_law", "direction": "y", "at": [0.1, 0.3, 1.5], "law": "tests/forces/own_laws.py:two_in_series",
    "parameters": [30.0, 5.0, 4.0], "states": 2,
}  # fmt: skip
MORE = [
    AIR, {"kind": "shear_spring", "at": [[0, 0.2, 1.8], [0, 0.2, 1.2]], "stiffness": [20.0, 30.0, 40.0],
          "bending_stiffness": 6.0, "damping": [1.0, 2.0, 3.0], "preload": [1.0, 2.0, 3.0]},
    {"kind": "bump_stop", "direction": "y", "at": [0, 0.2, 1.5], "gap": 0.02, "stiffness": 1e4},
    {"kind": "own_law", "direction": "y", "at": [0.1, 0.3, 1.5], "law": "tests/forces/own_laws.py:drag",
     "parameters": [30.0, 5.0], "states": 1},
    {"kind": "traction_rod", "at": [[0.5, 0.1, 1.9], [-0.4, 0, 1.1]], "stiffness": 60.0, "damping": 2.0,
     "preload": 4.0},
    {"kind": "bushing", "at": [0.2, 0.2, 1.5], "stiffness": [5.0, 2.0, 3.0], "rotation_stiffness": [2.0, 3.0, 4.0],
     "rotation_damping": [1.0, 2.0, 3.0], "preload": [1.0, 2.0, 3.0]},
    {"kind": "anti_roll_bar", "stiffness": 9.0, "damping": 0.4, "at": [0.1, 0.0, 1.0]},
]  # fmt: skip
"""Elements with the keys that those of `EVERYTHING` leave out."""


def vehicle_with(element):
    """Two bodies and an element between them, and one that presses on friction."""
    inertia = {"roll": 20.0, "pitch": 30.0, "yaw": 40.0}
    body = {"kind": "body", "mass": 50.0, "inertia": inertia}
    pressed = {**EVERYTHING[0], "name": "e0", "bodies": ["upper", "lower"]}
    other = {**EVERYTHING[0], "name": "e1", "bodies": ["upper", "lower"]}
    stop = next(item for item in EVERYTHING if item.get("name") == "stop") | {"bodies": ["upper", "lower"]}
    return {
        "name": "two",
        "bodies": {"upper": {**body, "position": [0, 0, 2.0]}, "lower": {**body, "position": [0, 0, 1.0]}},
        "elements": [pressed, other, stop, {**element, "name": "tried", "bodies": ["upper", "lower"]}],
        "joints": [
            {"name": f"hold_{name}", "kind": "rigid", "bodies": [name, "frame"], "at": [0, 0, 1.5]}
            for name in ("upper", "lower")
        ],
    }  # fmt: skip


@pytest.mark.parametrize(("kind", "key"), [(kind, key) for kind in KINDS for key in KINDS[kind].keys])
def test_element_key_changes_the_forces(kind, key):
    schema, bases = KINDS[kind].keys[key], [item for item in [*EVERYTHING, *MORE] if item["kind"] == kind]
    values = {
        "normal": ["e1"], "direction": ["z", "x"], "law": ["tests/forces/own_laws.py:plain_drag"], "states": [3],
        "characteristic": [], "at": [[0.2, 0.1, 1.4], [[0.3, 0.2, 1.7], [-0.4, 0.2, 1.1]]],
    }  # fmt: skip
    if "characteristic" in (key,):
        values["characteristic"] = [
            {name: [1.1 * number for number in numbers] for name, numbers in item[key].items()}
            for item in bases if key in item
        ]  # fmt: skip
    bases = [vehicle_with(item) for item in bases if key in item]
    special = {f"elements[].{key}": values[key]} if key in values else None

    def record(data):
        return made(data)

    data = [{**base, "elements": base["elements"][::-1]} for base in bases]  # the one that is tried comes first
    assert has_effect(f"elements[].{key}", data, record, {"properties": {"elements": {"items": {"properties": {
        key: schema}}}}}, special)  # fmt: skip


# ------------------------------------------------------------------------------------------------------------ sweeps


def sweep_bases():
    keys = {"speed": {"from": 20.0, "to": 40.0, "steps": 3, "scale": "linear"}, "initial.y": {"values": [0.001, 2e-3]}}
    plan = {
        "scene": str(SUSPENDED), "set": {"contact.patch": "moment", "integration.duration": 0.03}, "keys": keys,
        "batch": 2, "begin": 0.0, "window": 0.01, "measures": ["y_rms_m", "amplitude_m"],
    }  # fmt: skip
    drawn = {"kind": "latin_hypercube", "runs": 4, "seed": 3}
    return [{"name": "s", **plan, "sampling": sampling} for sampling in ({"kind": "grid"}, drawn)]


@pytest.mark.parametrize("key", leaves("sweep"))
def test_sweep_key_changes_the_runs_or_the_table(key):
    special = {
        "scene": [str(SCENES / "wheelset.yaml")], "set": [{"contact.patch": "moment", "integration.duration": 0.04}],
        "sampling.kind": ["list", "sobol"], "keys.*.values": [[0.001, 0.003]], "measures": [["y_max_m"]],
        "begin": [0.02], "window": [0.02], "keys.*.from": [21.0], "keys.*.to": [39.0],
    }  # fmt: skip

    def record(plan):
        sweep = wr.load_sweep({"name": "s", **plan})
        if key in ("begin", "window", "measures"):
            return wr.run_sweep(sweep).to_csv()
        return sweep.runs.to_csv(), sweep.batches, sweep.scene.data["integration"], sweep.scene.data["name"]

    assert has_effect(key, sweep_bases(), record, schema_of("sweep"), special)
