"""Errors of ellipses in local wear: ``python -m tests.analysis.wear.patches FOLDER [PLAN] [--resolution middle]``.

Each scene of a plan (config/wear/main_line.yaml) runs on its new wheels, once with contact from the lookup table
(``tabulated``) and once with ellipses (``moment``). Wear of the first wheelset's wheels is computed in three ways
(`WAYS`): over ellipses and over exact patches of the first motion, and over exact patches of the second motion. The
command prints a row per scene and wheel, and draws the depths.
"""

import argparse
import time
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from wrcore.analysis.pictures.style import save_figure, styled
from wrcore.analysis.wear.evolve import load_wear_plan
from wrcore.analysis.wear.local_wear import PATCHES, local_wear
from wrcore.geometry.track import SIDES
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene

WIDTH = 5e-4
"""Width of the bins of the profile, m."""
U = WIDTH * np.arange(-120, 80)
"""Positions on a wheel's profile at which depths are compared, m."""
WAYS = {**{patches: patches for patches in PATCHES}, "exact, on the motion of ellipses": "exact"}
"""Ways of computing wear, with the contact patches of each."""


def depths(wear):
    """Return the wear depth at the positions `U`, m per m of distance."""
    middles = 0.5 * (wear.wheel_edges[1:] + wear.wheel_edges[:-1])
    return np.interp(U, middles, wear.wheel_depth, 0.0, 0.0)


def compared(scene, begin, law, resolution):
    """Return, by way (`WAYS`), depths, volume (m^3/m) and processor time (s) for both wheels of the first wheelset."""
    found, elsewhere = {}, load_scene(scene, {"contact.patch": "moment"})
    runs = simulate(scene), simulate(elsewhere)
    assert all(run.status == "completed" for run in runs), [run.reason for run in runs]
    for way, run, of in zip(WAYS, (runs[0], *runs), (scene, scene, elsewhere), strict=True):
        began = time.process_time()
        worn = local_wear(run, begin, law, WIDTH, WAYS[way], resolution, of)
        seconds = time.process_time() - began
        wheels = [worn[scene.vehicle.wheelset_names[0], side] for side in SIDES]
        found[way] = [(depths(wheel), wheel.volume, seconds) for wheel in wheels]
    return found


@styled
def figure_of(found):
    """Draw the depths over the profile, a row per scene, for the left and the right wheel."""
    figure = Figure(figsize=(7.2, 1.7 * len(found)), layout="constrained")
    rows = figure.subplots(len(found), 2, squeeze=False, sharex=True)
    for axes, (name, ways) in zip(rows, found.items(), strict=True):
        for k, (one, side) in enumerate(zip(axes, SIDES, strict=True)):
            for way, line in zip(WAYS, ("--", "-", ":"), strict=True):
                one.plot(1e3 * U, 1e12 * ways[way][k][0], line, label=way)
            one.set_title(f"{name}, {side}", fontsize="small")
            one.set_xlim(-45.0, 25.0)
    figure.supylabel("depth / µm per 1000 km", fontsize="medium")
    for one in rows[-1]:
        one.set_xlabel("u, to the field side / mm")
    figure.legend(handles=rows[0, 0].lines, loc="outside upper center", ncols=len(WAYS))
    return figure


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("plan", nargs="?", default="config/wear/main_line.yaml")
    parser.add_argument("--resolution", default="coarse")
    asked = parser.parse_args()
    data, scenes = load_wear_plan(asked.plan, {"patches": "exact", "set": {"contact.patch": "tabulated"}})
    head = ["scene", "wheel", "deepest, exact over ellipse", "at u, mm: ellipse", "exact",
            "largest deviation, % of the deepest: ellipse", "exact on the motion of ellipses",
            "volume, %: exact over ellipse", "exact on the motion of ellipses over exact",
            "processor time, s: ellipse", "exact"]  # fmt: skip
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}")
    found = {}
    for scene in scenes:
        path = scene.data["track"]["path"]
        curve = "straight" if path == "tangent" else f"R {path[1]['radius']:g} m"
        name = f"{curve}, {scene.data['speed']:g} m/s, gauge {1e3 * scene.data['track']['gauge']:g} mm"
        found[name] = ways = compared(scene, data["begin"], data["law"], asked.resolution)
        for k, side in enumerate(SIDES):
            (flat, volume, took), (real, other, longer), (near, elsewhere, _) = (ways[way][k] for way in WAYS)
            deviation, less = (np.abs(real - one).max() / real.max() for one in (flat, near))
            print(f"| {name} | {side} | {real.max() / flat.max():.2f} | {1e3 * U[flat.argmax()]:.1f} |"
                  f" {1e3 * U[real.argmax()]:.1f} | {100 * deviation:.0f} | {100 * less:.0f} |"
                  f" {100 * (other / volume - 1):+.1f} | {100 * (elsewhere / other - 1):+.1f} |"
                  f" {took:.2f} | {longer:.1f} |", flush=True)  # fmt: skip
    save_figure(figure_of(found), asked.folder / "wear_patches.png")


if __name__ == "__main__":
    main()
