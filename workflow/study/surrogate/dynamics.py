"""Compare critical speeds and limit cycles with the surrogate with those of exact contact.

    python -m study.surrogate.dynamics [--cycles]

prints the linear critical speed of the suspended wheelset on each pair of profiles with the surrogate, with ellipses
(``moment``) and with exact contact. With --cycles it prints the amplitude of the limit cycle at some speeds instead,
with the surrogate, with ellipses and with the table of exact contact. A critical speed depends on slopes of the contact
over lateral position and yaw, a limit cycle on the contact over its whole amplitude.
"""

import argparse
import tempfile

import numpy as np
import pandas as pd

import wrcore as wr
from study.patch.visited_errors import with_hollow

SCENE = "suspended_wheelset"

PAIRS = {
    "S1002, UIC60 1:40": {},
    "S1002, 60E2 1:40": {"rail.profile": "60E2"},
    "S1002, 54E1 1:40": {"rail.profile": "54E1"},
    "S1002, 50E6 1:40": {"rail.profile": "50E6"},
    "S1002, 49E1 1:40": {"rail.profile": "49E1"},
    "S1002, UIC60 1:30": {"rail.inclination": "1/30"},
    "cone 1:20, UIC60 1:40": {"wheel.profile": "cone:1/20"},
    "hollow of 1 mm, UIC60 1:40": {"wheel.profile": "hollow"},
}
"""Changes of the scene; the hollow wheel is that of `study.patch.look_up_errors`."""

SPEEDS = np.linspace(10.0, 150.0, 15)
"""Speeds between which the critical speed is searched for, m/s."""

CYCLE_SPEEDS = 59.0, 60.0, 62.0
"""Speeds at which the wheelset hunts in a limit cycle on S1002 and UIC60, m/s."""


def scene_of(pair, patch, folder):
    """Return the scene of a pair of profiles with a patch model."""
    return wr.load_scene(wr.example(SCENE), with_hollow(PAIRS[pair], folder) | {"contact.patch": patch})


def critical_speeds(folder):
    """Return linear critical speeds, m/s, with a row per pair of profiles."""
    rows = {}
    for pair in PAIRS:
        scenes = {patch: scene_of(pair, patch, folder) for patch in ("exact", "moment", "surrogate")}
        found = wr.critical_speeds(scenes, SPEEDS)
        rows[pair] = dict(zip(found["variant"], found["critical_speed_m_per_s"], strict=True))
        print(pair, rows[pair], flush=True)
    return pd.DataFrame(rows).T


def amplitudes(folder):
    """Return the amplitude of the wheelset on S1002 and UIC60 after 20 s, mm, with a row per speed."""
    rows = {}
    for speed in CYCLE_SPEEDS:
        for patch in ("tabulated", "moment", "surrogate"):
            changes = {
                "contact.patch": patch,
                "speed": speed,
                "initial.y": 3e-3,
                "integration.duration": 20.0,
                "integration.rtol": 1e-6,
            }
            run = wr.simulate(wr.load_scene(wr.example(SCENE), changes))
            rows.setdefault(speed, {})[patch] = 1e3 * np.abs(run["wheelset"].y_m[run.t > run.t[-1] - 1.0]).max()
    return pd.DataFrame(rows).T


def main():
    """Print the table that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cycles", action="store_true", help="limit cycles in place of critical speeds")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        print((amplitudes if asked.cycles else critical_speeds)(folder).round(3).to_string())


if __name__ == "__main__":
    main()
