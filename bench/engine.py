"""What a run costs at a given accuracy: ``python bench/engine.py [SCENE ...] [--speeds V,...] [--methods M,...]``.

Every method runs the scene over a ladder of tolerances (atol = rtol/1000). The error is the root mean square over the
outputs of the first wheelset's lateral position against a run at rtol 1e-11 by a method of another family. A row shows
the cheapest run within a micrometre, or the most accurate one where none is: evaluations, steps, Jacobians,
factorisations, error, and the processor time of the fastest of several repetitions, compilation excluded. Set
OPENBLAS_NUM_THREADS=1 for one core.
"""

import argparse
import time
from pathlib import Path

import numpy as np

from wrcore.dynamics.body import STATE_SIZE
from wrcore.dynamics.integrate import METHODS, integrate
from wrcore.scene import compile_scene, load_scene

SCENES = Path(__file__).parent.parent / "config" / "scenes"
ROUGH = "track.irregularity={spectrum: {level: low, seed: 1, length: 600, begin: 10}}"
LADDER = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
WANTED = 1e-6  # m


def lateral(trajectory, model):
    """Lateral position of the first wheelset, m."""
    return trajectory.states[:, STATE_SIZE * model.bodies.wheelsets[0] + 1]


def measure(model, state, times, method, rtol, repeat):
    """A run and the least processor time of some, s."""
    seconds = []
    for _ in range(repeat):
        started = time.process_time()
        trajectory = integrate(model, state, times, method, rtol, 1e-3 * rtol)
        seconds.append(time.process_time() - started)
    return trajectory, min(seconds)


def compare(name, speed, duration, overrides, methods, repeat):
    """Print the cheapest accurate run of each method for one scene and speed."""
    model, state = compile_scene(load_scene(SCENES / f"{name}.yaml", [f"speed={speed}", *overrides]))
    times = np.arange(round(200 * duration) + 1) / 200
    stiff = speed < 10
    reference = integrate(model, state, times, "rodas4" if stiff else "tsit5", 1e-11, 1e-14)
    check = integrate(model, state, times, "ros34pw2" if stiff else "rk4", 1e-8, 1e-12)
    truth = lateral(reference, model)
    doubt = np.sqrt(np.mean((lateral(check, model) - truth) ** 2))
    print(f"{name}, {speed:g} m/s, {duration:g} s{', irregular' if overrides else ''}: {reference.status}, last second "
          f"within {1e3 * np.abs(truth[-200:]).max():.3g} mm, references agree to {1e6 * doubt:.2g} um")  # fmt: skip
    for method in methods:
        best = None
        for rtol in LADDER:
            integrate(model, state, times[:2], method, rtol)  # compiles
            trajectory, seconds = measure(model, state, times, method, rtol, repeat)
            if trajectory.status != "completed":
                continue
            error = np.sqrt(np.mean((lateral(trajectory, model) - truth) ** 2))
            found = (error > WANTED, seconds if error <= WANTED else error, rtol, trajectory, error, seconds)
            best = found if best is None or found[:2] < best[:2] else best
            if error < 1e-2 * WANTED:
                break
        if best is not None:
            _, _, rtol, run, error, seconds = best
            print(f"  {method:9s} rtol {rtol:.0e}: {run.rhs_evaluations:7d} evaluations, {run.steps:6d} steps, "
                  f"{run.rejected:5d} rejected, {run.jacobians:5d} J, {run.factorisations:5d} LU, "
                  f"{1e6 * error:8.3g} um, {1e3 * seconds:7.2f} ms, "
                  f"{1e6 * seconds / run.rhs_evaluations:.2f} us/evaluation")  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", default=["suspended_wheelset", "trailer_vehicle"])
    parser.add_argument("--speeds", default="1,20,60")
    parser.add_argument("--methods", default=",".join(METHODS))
    parser.add_argument("--duration", type=float, default=10.0)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--irregular", action="store_true", help="on irregular track instead of perfect track")
    options = parser.parse_args()
    for name in options.scenes:
        for speed in options.speeds.split(","):
            compare(name, float(speed), options.duration, [ROUGH] if options.irregular else [],
                    options.methods.split(","), options.repeat)  # fmt: skip


if __name__ == "__main__":
    main()
