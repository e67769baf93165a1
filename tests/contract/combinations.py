"""Combinations of patch model, creep law, detection and integrator, and the models and states that tests share."""

from itertools import product

import numpy as np

import wrcore as wr
from tests.conftest import ROOT
from wrcore.equations.equations_of_motion import Equations
from wrcore.scene.compile import compile_scene

SCENE = ROOT / "config" / "scenes" / "suspended_wheelset.yaml"

ELLIPSES, STRIPS, NETWORK = ("maximum", "moment"), ("tabulated", "exact"), ("surrogate",)
LAWS = "table", "linear", "she", "polach", "fastsim"
DETECTIONS = "spatial", "planar", "auto"
METHODS = "tsit5", "rk4", "rodas5", "ros34pw2", "auto"

FORCES = [*product(ELLIPSES, LAWS, DETECTIONS), *product(STRIPS + NETWORK, ("table",), DETECTIONS)]
"""Patch model, creep law and detection that a scene may combine."""

REFUSED = list(product(STRIPS + NETWORK, LAWS[1:]))
"""Patch model and creep law that a scene may not combine: exact contact has creep forces of its own."""

MOTIONS = [
    ("maximum", "linear", "spatial", "tsit5"), ("maximum", "fastsim", "planar", "rodas5"),
    ("maximum", "she", "auto", "ros34pw2"), ("moment", "table", "spatial", "ros34pw2"),
    ("moment", "polach", "planar", "rk4"), ("moment", "she", "auto", "rodas5"), ("moment", "table", "auto", "auto"),
    ("tabulated", "table", "spatial", "tsit5"), ("tabulated", "table", "spatial", "rk4"),
    ("tabulated", "table", "spatial", "rodas5"), ("tabulated", "table", "spatial", "ros34pw2"),
    ("exact", "table", "spatial", "auto"), ("exact", "table", "planar", "tsit5"),
    ("surrogate", "table", "spatial", "rodas5"), ("surrogate", "table", "auto", "rk4"),
]  # fmt: skip
"""Each patch model, law, detection and method, and each method with the default patch model, in short runs."""

SHARED = {}
"""What models have in common: creep table, contact geometry, static equilibria."""

MIRROR = np.array([1, -1, 1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1], float)
"""Signs of a body's state in the mirror image about the track's vertical middle plane."""

FORCE_MIRROR = np.array([1, -1, 1, -1, 1, -1], float)
"""Signs of force and moment in the mirror image."""


def scene_of(patch, law="table", detection="spatial", **changes):
    """The suspended wheelset with these models."""
    changes = {f.replace("__", "."): value for f, value in changes.items()}
    models = {"contact.patch": patch, "contact.creep.model": law, "contact.detection": detection}
    return wr.load_scene(SCENE, models | changes)


def equations_of(patch, law="table", detection="spatial"):
    """Equations of motion of the suspended wheelset with these models."""
    key = patch, law, detection
    if key not in SHARED:
        model, _ = compile_scene(scene_of(*key, initial__y=0.0), shared=SHARED)
        SHARED[key] = model, Equations(model)
    return SHARED[key]


def states():
    """States of wheelsets that stand on the rails from flange to flange, with creepages in all directions, (n, 13)."""
    if "states" not in SHARED:
        rows, random = [], np.random.default_rng(7)
        for y, yaw in ((0.0, 0.0), (5e-4, 1e-3), (-2e-3, 2e-3), (4e-3, -3e-3), (-5.5e-3, 4e-3), (6.2e-3, 5e-3)):
            _, state = compile_scene(scene_of("moment", initial__y=y, initial__yaw=yaw), shared=SHARED)
            state[7:13] += random.uniform(-1, 1, 6) * np.array([0.05, 0.05, 1e-3, 1e-3, 0.1, 0.05])
            rows.append(state)
        SHARED["states"] = np.array(rows)
    return SHARED["states"].copy()


def wheel_patches(equations):
    """Patches of the last evaluation as (sign of the side, row of the patch array)."""
    work = equations.work
    return [(1 - 2 * side, row) for side in range(2) for row in work.patches[0, side, : work.counts[0, side]]]
