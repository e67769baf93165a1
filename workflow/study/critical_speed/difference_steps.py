"""How far a linear critical speed is that of exact contact, and not of the step of its difference quotients.

``python -m study.critical_speed.difference_steps`` prints the critical speed of the suspended wheelset by patch model,
resolution and step: strips follow a patch's outline only so far, so that the slopes of exact contact depend on over how
much they are taken; looked-up contact is a smooth function.
"""

import numpy as np
import pandas as pd

import wrcore as wr
from wrcore.analysis.stability.stability import steady_motion, straight_ahead
from wrcore.balance import linear

SPEEDS = 57.0, 59.0
"""m/s: either side of the critical speed, over which the growth is a straight line."""

STEPS = 1e-7, 1e-6, 1e-5, 2e-5
"""m and rad."""

MODELS = ("moment", ""), ("exact", "coarse"), ("exact", "middle"), ("exact", "fine"), ("tabulated", "middle")

HUNTING = 38.0, 60.0
"""Between these frequencies lies the wheelset's hunting at those speeds, 1/s; the frame's modes lie below."""


def growth(patch, resolution, speed, step):
    """Growth of the hunting mode, 1/s."""
    changes = {"contact.patch": patch} | ({"contact.resolution": resolution} if resolution else {})
    model, state = straight_ahead(wr.load_scene(wr.example("suspended_wheelset"), changes))
    usual, linear.STEP = linear.STEP, step
    try:
        values = np.linalg.eigvals(steady_motion(model, state, speed).matrix)
    finally:
        linear.STEP = usual
    return max(value.real for value in values if HUNTING[0] < value.imag < HUNTING[1])


def table():
    """Critical speeds, m/s: a row per model, a column per step."""
    rows = {}
    for patch, resolution in MODELS:
        for step in STEPS:
            low, high = (growth(patch, resolution, speed, step) for speed in SPEEDS)
            found = SPEEDS[0] - low * (SPEEDS[1] - SPEEDS[0]) / (high - low)
            rows.setdefault(f"{patch} {resolution}".strip(), {})[f"{step:g}"] = round(found, 2)
    return pd.DataFrame(rows).T


if __name__ == "__main__":
    print(table().to_string())
