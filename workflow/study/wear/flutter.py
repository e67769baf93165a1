"""Flutter of a worn wheel on a worn rail: ``python -m study.wear.flutter FOLDER STEP [--scene 5]``.

A scene of a plan runs with ``moment`` on the wheels and rails of ``wrcore evolve PLAN --out FOLDER`` at the start of a
step, and continues with each patch model. For the first wheelset's wheels the command prints the number of loaded
patches and the rate of its changes. For the resultant of the normal forces it prints mean and standard deviation of
size and angle, and how often per second the angle rises through its mean.
"""

import argparse
import time
from pathlib import Path

import numpy as np

from wrcore.analysis.wear.evolve import load_wear_plan
from wrcore.analysis.wear.worn_profiles import file_of
from wrcore.analysis.wear.worn_rails import rails_of_step
from wrcore.errors import InputError
from wrcore.geometry.track import SIDES
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene


def flutter(t, normal, angle):
    """Return the measures of flutter of a wheel from times (n,), s, normal forces (n, m), N, and contact angles (n, m),
    rad, of its patches (NaN for absent patches).

    They are mean number of patches, its changes (1/s), mean and standard deviation of the resultant normal force (N)
    and of its angle (rad), and the rate (1/s) at which the angle rises through its mean."""
    force, angle = np.nan_to_num(normal), np.nan_to_num(angle)
    across, up = (force * np.sin(angle)).sum(axis=1), (force * np.cos(angle)).sum(axis=1)
    count, size, turned = (force > 0.0).sum(axis=1), np.hypot(across, up), np.arctan2(across, up)
    turned *= np.copysign(1.0, turned.mean())  # equal sign for left and right wheels
    above, whole = turned > turned.mean(), t[-1] - t[0]
    rises = np.count_nonzero(above[1:] & ~above[:-1]) / whole
    changes = np.count_nonzero(np.diff(count)) / whole
    return count.mean(), changes, size.mean(), size.std(), turned.mean(), turned.std(), rises


def worn_scene(plan, folder, step, place, changes):
    """Return the scene with the index ``place`` of a plan, on the wheels and rails at the start of a step."""
    _, scenes = load_wear_plan(plan, {"set": changes, "rate": 1000.0})
    if not 0 <= place < len(scenes):
        raise InputError(plan, "scenes", f"expected a scene from 0 to {len(scenes) - 1}, got {place}")
    wheel = {"wheel.profile": {"points": str(file_of(folder, "profile", step).resolve()), "unit": "m"}}
    laid = rails_of_step(folder, step, place, scenes[place]).changes
    return load_scene(scenes[place], {**wheel, **laid, "output.channels": ["pose", "contact"]})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("step", type=int)
    parser.add_argument("--plan", default="config/wear/main_line.yaml", help="one whose rails wear")
    parser.add_argument("--scene", type=int, default=5, help="its place in the plan")
    parser.add_argument("--patches", nargs="+", default=["moment", "exact"])
    parser.add_argument("--resolution", default="coarse")
    parser.add_argument("--begin", type=float, default=4.0, help="s with moment, before")
    parser.add_argument("--duration", type=float, default=0.15, help="s with each model from there")
    parser.add_argument("--settle", type=float, default=0.03, help="s of these that do not count")
    asked = parser.parse_args()
    if not 0.0 <= asked.settle < asked.duration:
        parser.error(f"--settle: expected less than the duration of {asked.duration:g} s, got {asked.settle:g} s")
    begin, asked_of = None, (asked.plan, asked.folder, asked.step, asked.scene)
    settings = {one: {"contact.patch": one} for one in (*asked.patches, "moment")}
    for strips in {"exact", "tabulated"} & set(settings):
        settings[strips]["contact.resolution"] = asked.resolution
    try:
        scenes = {patch: worn_scene(*asked_of, changes) for patch, changes in settings.items()}
    except InputError as error:
        parser.error(str(error))
    head = ["contact", "wheel", "patches", "changes, 1/s", "normal force, kN", "its deviation", "its angle, rad",
            "its deviation", "its rises, 1/s", "processor time, s"]  # fmt: skip
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}")
    for patch in ("moment", *asked.patches):
        began, scene = time.process_time(), scenes[patch]
        try:
            if begin is None:
                run = simulate(scene, **{"integration.duration": asked.begin})
            else:
                run = simulate(scene, start=begin, **{"integration.duration": asked.duration})
        except InputError as error:
            parser.error(str(error))
        seconds = time.process_time() - began
        if run.status != "completed":
            parser.exit(1, f"{patch}: expected a run to its end, got {run.status}: {run.reason}\n")
        if begin is None:
            begin = run.end_state
            continue
        late = run.t >= run.t[0] + asked.settle
        if late.sum() < 2:
            parser.error(f"--settle: expected output times after it, got {asked.settle:g} s")
        for side in SIDES:
            wheel = run[f"{scene.vehicle.wheelset_names[0]}/{side}"]
            normal, angle = (value[late].reshape(late.sum(), -1) for value in (wheel.N_N, wheel.contact_angle_rad))
            count, changed, size, spread, turned, swing, rises = flutter(run.t[late], normal, angle)
            print(f"| {patch} | {side} | {count:.2f} | {changed:.0f} | {1e-3 * size:.1f} | {1e-3 * spread:.1f} |"
                  f" {turned:.3f} | {swing:.3f} | {rises:.0f} | {seconds:.1f} |", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
