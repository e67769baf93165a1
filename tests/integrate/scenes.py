"""Scenes on which `auto` is measured: of the accuracy study, of nobody, and random ones."""

import numpy as np
import yaml

from tests.conftest import ROOT
from tests.conftest import SCENES as EXAMPLES
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

BOX, ARM, BUSHING, RELAXATION = 1.0, 0.46, 1.7e7, 6e-5
"""Of `trailing_arm_car`, all chosen: mass (kg) and every moment (kg m^2) of an axle box, which make its radius of
gyration 1 m; length of its arm, m; radial stiffness of the undamped bushing at the arm's end, N/m, on which it pitches
at 302 Hz; time in which its damper and the spring in series relax, s."""


def trailing_arm_car():
    """The metro car with light axle boxes: each is a trailing arm on an undamped bushing, with stiffly held dampers."""
    data = yaml.safe_load((ROOT / "config/vehicles/metro_car.yaml").read_text("utf-8"))
    arms = []
    for body in data["bodies"].values():
        if body["kind"] == "axle_box":
            data["bodies"][body["wheelset"]]["mass"] += body["mass"] - BOX
            body |= {"mass": BOX, "inertia": {"roll": BOX, "pitch": BOX, "yaw": BOX}}
    for element in data["elements"]:
        if element["name"].startswith("primary_damper"):
            element["series_stiffness"] = element["damping"] / RELAXATION
        elif element["name"].startswith("primary_spring"):
            x, y, z = element["at"]
            centre = data["bodies"][element["bodies"][1]]["position"][0]
            end = [x + float(np.copysign(ARM, centre - x)), y, z]
            stiffness, free = [BUSHING, 5e6, BUSHING], [0.0, 0.0, 0.0]
            name = element["name"].replace("spring", "arm")
            arms.append(element | {"name": name, "at": end, "stiffness": stiffness, "damping": free, "preload": free,
                                   "rotation_stiffness": free, "rotation_damping": free})  # fmt: skip
            element |= {"stiffness": [0.0, 0.0, 1.1e6], "rotation_stiffness": free, "rotation_damping": free}
    data["elements"] += arms
    return data


def compiled(name, speed, changes):
    """Model and initial state of a scene by its name, with patches as ellipses."""
    file = f"{name.split(',')[0].replace(' ', '_')}.yaml"
    return compile_scene(load_scene(EXAMPLES / file, {"speed": speed, "contact.patch": "moment", **changes}))


def rough(level="low", seed=1, begin=20.0):
    return {"track.irregularity": {"spectrum": {"level": level, "seed": seed, "length": 2000.0, "begin": begin}}}


def curve(radius, cant=0.1):
    ramp = {"transition": 40}
    return {"track.path": [{"tangent": 20}, ramp, {"curve": 60, "radius": radius, "cant": cant}, ramp, {"tangent": 99}]}


def kept_at(speed):
    return {"drive.controller.speed": speed, "drive.brakes": [], "contact.friction": 0.3}


BALLAST = {"track.support": {
    "rail": {"mass": 79.0, "lateral": {"stiffness": 4.34e7, "damping": 1.45e5},
             "vertical": {"stiffness": 1.88e8, "damping": 2.17e5}},
    "sleeper": {"mass": 544.0, "roll_inertia": 306.0, "lateral": {"stiffness": 6.0e7, "damping": 1.5e5},
                "vertical": {"stiffness": 2.87e8, "damping": 1.18e5}},
}}  # fmt: skip
FREE = {"contact.patch": "moment"}
STIFF = {"vehicle.elements": {"primary_damper_*": {"series_stiffness": 1.333e8}}}  # relaxes in 60 us
FALLING = {"contact.friction": {"mu": 0.35, "falling": {"ratio": 0.4, "decay": 0.6}}}
APART = {"vehicle.bodies": {f"wheelset_{k}": {"independent_wheels": True} for k in range(1, 5)}}
ARMS = {"vehicle.parameters": trailing_arm_car()}

SCENES = [  # name, which begins with that of a scene's file, speed (m/s), duration (s), changes
    ("suspended wheelset", 20, 10.0, {}),
    ("suspended wheelset", 60, 10.0, {}),
    ("wheelset", 20, 0.8, FREE),
    ("trailer vehicle", 20, 5.0, rough()),
    ("trailer vehicle", 40, 5.0, rough()),
    ("trailer vehicle", 60, 5.0, rough()),
    ("wheelset, friction 0.6", 10, 1.2, FREE | {"contact.friction": 0.6}),
    ("wheelset, friction 0.1", 45, 0.6, FREE | {"contact.friction": 0.1}),
    ("suspended wheelset, rough, friction 0.6", 10, 10.0, rough() | {"contact.friction": 0.6}),
    ("suspended wheelset, rough, friction 0.1", 45, 5.0, rough("high", 5) | {"contact.friction": 0.1}),
    ("suspended wheelset, hunting", 80, 0.3, {}),
    ("suspended wheelset, ballast, rough", 45, 5.0, rough() | BALLAST),
    ("trailer vehicle, rough, friction 0.6", 10, 5.0, rough("high", 7) | {"contact.friction": 0.6}),
    ("trailer vehicle", 45, 5.0, {}),
    ("trailer vehicle, rough, friction 0.1", 80, 3.0, rough("low", 3) | {"contact.friction": 0.1}),
    ("trailer vehicle, R 300", 16.7, 12.0, curve(300.0)),
    ("trailer vehicle, R 300, rough", 16.7, 12.0, curve(300.0) | rough()),
    ("trailer vehicle, R 1500, rough", 45, 5.0, curve(1500.0) | rough("high", 2)),
    ("trailer vehicle, ballast, rough", 20, 5.0, rough() | BALLAST),
    ("trailer vehicle, ballast, rough", 60, 3.0, rough() | BALLAST),
    ("trailer vehicle, independent wheels, rough", 20, 5.0, rough() | APART),
    ("trailer vehicle, independent wheels, rough", 50, 3.0, rough("low", 8) | APART),
    ("metro car, rough", 20, 5.0, {}),
    ("metro car, rough", 45, 3.0, rough("high", 2)),
    ("metro car, rough", 80, 3.0, rough("low", 6)),
    ("metro car, R 300, rough", 16.7, 12.0, curve(300.0) | rough()),
    ("metro car, stiff damper", 10, 5.0, STIFF),
    ("metro car, stiff damper, rough", 45, 3.0, STIFF),
    ("metro car, trailing arms, rough", 20, 5.0, ARMS | FALLING | rough()),
    ("metro car, trailing arms, rough", 45, 2.5, ARMS | FALLING | rough("low", 2)),
    ("metro car, trailing arms, R 300, rough", 16.7, 12.0, ARMS | FALLING | curve(300.0) | rough()),
    ("freight wagon laden, rough", 20, 5.0, rough()),
    ("freight wagon empty, rough", 20, 5.0, rough("low", 2)),
    ("freight wagon laden, rough", 30, 4.0, rough("high", 3)),
    ("locomotive, rough", 20, 3.0, kept_at(20.0) | rough()),
    ("locomotive, rough, friction 0.1", 45, 3.0, kept_at(45.0) | rough() | {"contact.friction": 0.1}),
]

KINDS = {
    "trailer vehicle": {"bodies": {"axle_box_*": ("mass", "inertia")},
                        "elements": {"primary_spring_*": ("stiffness", "damping"),
                                     "primary_damper_*": ("damping", "series_stiffness"),
                                     "secondary_spring_*": ("stiffness",)}},
    "metro car": {"bodies": {"axle_box_*": ("mass", "inertia"), "bolster_*": ("mass", "inertia")},
                  "elements": {"primary_spring_*": ("stiffness", "damping"),
                               "primary_damper_*": ("damping", "series_stiffness"),
                               "lateral_damper_*": ("series_stiffness",)}},
    "metro car, trailing arms": {"bodies": {"axle_box_*": ("mass", "inertia")},
                                 "elements": {"primary_arm_*": ("stiffness",), "yaw_damper_*": ("series_stiffness",),
                                              "primary_damper_*": ("damping", "series_stiffness")}},
    "freight wagon laden": {"bodies": {"car_body": ("mass", "inertia")}, "elements": {"spring_*": ("stiffness",)}},
}  # fmt: skip
"""What a random vehicle changes of which vehicle, each by a factor."""

FACTORS = {"mass": (0.02, 2.0), "inertia": (0.1, 1.0), "stiffness": (0.4, 2.5), "damping": (0.05, 2.0),
           "series_stiffness": (0.3, 30.0)}  # fmt: skip
CAR_BODY = (0.4, 1.1)


def random_scene(seed):
    """Name, speed, duration and changes of a scene with a random vehicle, of the kinds in turn, on a random track."""
    rng = np.random.default_rng(seed)
    kind = list(KINDS)[seed % len(KINDS)]
    speed, changes = float(np.round(np.exp(rng.uniform(*np.log([10.0, 60.0]))), 1)), {}
    for group, parts in KINDS[kind].items():
        for name, keys in parts.items():
            for key in keys:
                bounds = CAR_BODY if name == "car_body" else FACTORS[key]
                factor = float(np.exp(rng.uniform(*np.log(bounds))))
                if key == "inertia":  # an axle box, say, with its mass
                    least = changes[f"vehicle.{group}"][name]["mass"]["factor"]
                    factor, value = least * factor, {"roll": 1.0, "pitch": 1.0, "yaw": 1.0}
                    value = {axis: {"factor": factor} for axis in value}
                else:
                    value = {"factor": factor}
                changes.setdefault(f"vehicle.{group}", {}).setdefault(name, {})[key] = value
    changes["contact.friction"] = float(np.round(rng.uniform(0.15, 0.5), 2))
    changes |= ARMS if "arms" in kind else {}
    changes |= rough(str(rng.choice(["low", "high"])), seed)
    name = f"{kind}, random {seed}, rough"
    if rng.random() < 0.4:
        radius = float(np.round(max(300.0, speed**2 / 1.6) * rng.uniform(1.0, 3.0)))
        name, changes = f"{name}, R {radius:g}", changes | curve(radius)
    return name, speed, 2.0, changes
