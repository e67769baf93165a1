"""Dependence of the linear critical speed with exact contact on the step of the difference quotients.

``python -m tests.analysis.stability.difference_steps`` prints the critical speed of the suspended wheelset by patch
model, resolution and step. Strips of finite width approximate a patch's outline, so that difference quotients of exact
contact depend on their step. Contact from the lookup table is a smooth function.
"""

import numpy as np
import pandas as pd

import wrcore as wr
from wrcore.analysis.stability.stability import steady_motion, straight_ahead
from wrcore.balance import linear

SPEEDS = 57.0, 59.0
"""Speeds below and above the critical speed, m/s; the growth rate is interpolated linearly between them."""

STEPS = 1e-7, 1e-6, 1e-5, 2e-5
"""Steps of the difference quotients, m and rad."""

MODELS = ("moment", ""), ("exact", "coarse"), ("exact", "middle"), ("exact", "fine"), ("tabulated", "middle")

HUNTING = 38.0, 60.0
"""Range of the angular frequency of hunting at these speeds, rad/s; modes of the frame have lower frequencies."""


def growth(patch, resolution, speed, step):
    """Return the growth rate of the hunting mode, 1/s."""
    changes = {"contact.patch": patch} | ({"contact.resolution": resolution} if resolution else {})
    model, state = straight_ahead(wr.load_scene(wr.example("suspended_wheelset"), changes))
    usual, linear.STEP = linear.STEP, step
    try:
        values = np.linalg.eigvals(steady_motion(model, state, speed).matrix)
    finally:
        linear.STEP = usual
    return max(value.real for value in values if HUNTING[0] < value.imag < HUNTING[1])


def table():
    """Return critical speeds, m/s, with a row per model and a column per step."""
    rows = {}
    for patch, resolution in MODELS:
        for step in STEPS:
            low, high = (growth(patch, resolution, speed, step) for speed in SPEEDS)
            found = SPEEDS[0] - low * (SPEEDS[1] - SPEEDS[0]) / (high - low)
            rows.setdefault(f"{patch} {resolution}".strip(), {})[f"{step:g}"] = round(found, 2)
    return pd.DataFrame(rows).T


if __name__ == "__main__":
    print(table().to_string())
