"""Whether a worn wheel flutters on a worn rail: ``python -m study.wear.flutter FOLDER STEP [--scene 5]``.

A scene of a plan runs on the wheels and rails that ``wrcore evolve PLAN --out FOLDER`` has at the start of a step, with
each patch model. Prints of the first wheelset's wheels how many patches carry, how often a second their number changes,
the steepest contact angle among them, and how often a second it steps by more than `STEP` between output times.
"""

import argparse
import time
from pathlib import Path

import numpy as np

from wrcore.analysis.wear.evolve import load_wear_plan
from wrcore.analysis.wear.worn_profiles import file_of
from wrcore.analysis.wear.worn_rails import laid_rails
from wrcore.errors import InputError
from wrcore.geometry.track import SIDES
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene

STEP = 0.05
"""Of the contact angle, rad."""


def flutter(t, normal, angle):
    """Mean number of patches, changes of it (1/s), mean and standard deviation of the steepest contact angle (rad) and
    its steps (1/s), from times (n,), s, normal forces (n, m), N, and contact angles (n, m), rad, of a wheel's patches;
    NaN: none."""
    carries = np.nan_to_num(normal) > 0.0
    count, steepest = carries.sum(axis=1), np.where(carries, np.abs(angle), 0.0).max(axis=1)
    whole = t[-1] - t[0]
    steps = np.abs(np.diff(steepest)) > STEP
    return count.mean(), np.count_nonzero(np.diff(count)) / whole, steepest.mean(), steepest.std(), steps.sum() / whole


def worn_scene(plan, folder, step, place, changes):
    """Scene of a plan, by its place, on the wheels and rails of the start of a step."""
    _, scenes = load_wear_plan(plan, {"set": changes, "rate": 1000.0})
    if not 0 <= place < len(scenes):
        raise InputError(plan, "scenes", f"expected a scene from 0 to {len(scenes) - 1}, got {place}")
    wheel = {"wheel.profile": {"points": str(file_of(folder, "profile", step).resolve()), "unit": "m"}}
    laid = laid_rails(folder, step, place, scenes[place]).changes
    return load_scene(scenes[place], {**wheel, **laid, "output.channels": ["pose", "contact"]})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("step", type=int)
    parser.add_argument("--plan", default="config/wear/main_line.yaml", help="one whose rails wear")
    parser.add_argument("--scene", type=int, default=5, help="its place in the plan")
    parser.add_argument("--patches", nargs="+", default=["moment", "exact"])
    parser.add_argument("--resolution", default="coarse")
    parser.add_argument("--begin", type=float, default=4.0, help="s")
    parser.add_argument("--duration", type=float, default=6.0, help="s")
    asked = parser.parse_args()
    if not 0.0 <= asked.begin < asked.duration:
        parser.error(f"--begin: expected less than the duration of {asked.duration:g} s, got {asked.begin:g} s")
    head = ["contact", "wheel", "patches", "changes, 1/s", "steepest angle, rad", "its deviation", "its steps, 1/s",
            "processor time, s"]  # fmt: skip
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}")
    for patch in asked.patches:
        changes = {"contact.patch": patch, "contact.resolution": asked.resolution}
        try:
            scene = worn_scene(asked.plan, asked.folder, asked.step, asked.scene, changes)
            began = time.process_time()
            run = simulate(scene, **{"integration.duration": asked.duration})
        except InputError as error:
            parser.error(str(error))
        seconds = time.process_time() - began
        if run.status != "completed":
            parser.exit(1, f"{patch}: expected a run to its end, got {run.status}: {run.reason}\n")
        late = run.t > asked.begin
        if late.sum() < 2:
            parser.error(f"--begin: expected output times after it, got {asked.begin:g} s")
        for side in SIDES:
            wheel = run[f"{scene.vehicle.wheelset_names[0]}/{side}"]
            normal, angle = (value[late].reshape(late.sum(), -1) for value in (wheel.N_N, wheel.contact_angle_rad))
            count, changed, mean, deviation, steps = flutter(run.t[late], normal, angle)
            print(f"| {patch} | {side} | {count:.2f} | {changed:.0f} | {mean:.3f} | {deviation:.3f} | {steps:.0f} |"
                  f" {seconds:.1f} |", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
