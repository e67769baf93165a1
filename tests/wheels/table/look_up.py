"""Speed and errors of contact from the table: ``python -m tests.wheels.table.look_up [SCENE ...]``.

Each scene runs with ``moment``, ``tabulated`` and ``exact``. Times real time are of the integration of a second run.
Errors are RMS differences from the run with ``exact``: of the lateral position of the first wheelset, and of the normal
forces over their mean. ``filled`` is the time by which the first run was longer, without compilation, and ``solved``
the number of patches that the solver computed because the table had no entry.
"""

import argparse
import time

import numpy as np
import pandas as pd

import wrcore as wr
from study.patch.look_up import SCENES

PATCHES = ("moment", "tabulated", "exact")


def compared(name, settings):
    """One row per patch model."""
    runs, rows = {}, []
    for patch in PATCHES:
        choice = {"contact.patch": patch, **settings}
        wr.simulate(wr.example(name), **(choice | {"integration.duration": 0.01}))
        times = []
        for _ in range(2 if patch != "exact" else 1):
            begin = time.process_time()
            runs[patch] = wr.simulate(wr.example(name), **choice)
            times.append(time.process_time() - begin)
        rows.append(
            {
                "patch": patch,
                "times real time": settings["integration.duration"] / runs[patch].counters["wall_s"],
                "filled, s": times[0] - times[-1],
            }
        )
    wheels = [key for key in runs["exact"] if key.endswith(("/left", "/right"))]
    first = wheels[0].rpartition("/")[0]
    normal = {patch: np.array([np.nansum(run[wheel].N_N, axis=1) for wheel in wheels]) for patch, run in runs.items()}
    for row in rows:
        patch = row["patch"]
        row["y, um"] = 1e6 * np.sqrt(np.mean((runs[patch][first].y_m - runs["exact"][first].y_m) ** 2))
        row["solved"] = runs[patch].counters["patches_not_tabulated"]
        row["N, %"] = 100.0 * np.sqrt(np.mean((normal[patch] - normal["exact"]) ** 2)) / normal["exact"].mean()
    return rows


def main():
    """Print a table of the scenes that are asked for, or all."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("scenes", nargs="*", default=list(SCENES))
    parser.add_argument("--duration", type=float, help="of the runs, s")
    arguments = parser.parse_args()
    for name in arguments.scenes:
        scene, settings = SCENES[name]
        duration = arguments.duration or settings["integration.duration"]
        table = pd.DataFrame(compared(scene, settings | {"integration.duration": duration}))
        table.insert(0, "scene", name)
        print(table.to_markdown(index=False, floatfmt=".3g"), flush=True)


if __name__ == "__main__":
    main()
