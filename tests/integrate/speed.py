"""Steps, evaluations and speed of Rosenbrock runs on irregular track: ``python -m tests.integrate.speed``.

Processor time, the best of four runs; nothing else should run. Errors: `snakemake speed_against_error`.
"""

import time

import numpy as np

from tests.conftest import SCENES
from wrcore.dynamics.system import Equations
from wrcore.integrate.integrator import integrate
from wrcore.scene.description import compile_scene, load_scene

SPECTRUM = {"spectrum": {"level": "low", "seed": 1, "length": 2000.0, "begin": 20.0}}
CURVE = [{"tangent": 20}, {"transition": 40}, {"curve": 250, "radius": 300, "cant": 0.1}, {"transition": 40},
         {"tangent": 100}]  # fmt: skip
CASES = [
    *(("trailer_vehicle", {"speed": speed}, 5.0, rtol) for rtol in (1e-3, 3e-3) for speed in (20.0, 40.0, 60.0)),
    ("trailer_vehicle", {"speed": 16.7, "track.path": CURVE}, 20.0, 3e-4),
    ("metro_car", {"speed": 16.7, "track.path": CURVE}, 20.0, 1e-3),
]


def evaluation(name):
    """Processor time of one right-hand side, s: the least of sixty batches."""
    model, state = compile_scene(load_scene(SCENES / f"{name}.yaml", {"initial.y": 0.002}))
    equations, states, best = Equations(model), np.tile(state, (2000, 1)), np.inf
    equations.at(0.0, states[:2])
    for _ in range(60):
        begun = time.process_time()
        equations.at(0.0, states)
        best = min(best, time.process_time() - begun)
    return best / len(states)


def main():
    for name in ("suspended_wheelset", "trailer_vehicle"):
        print(f"{name}: {1e6 * evaluation(name):.3f} us an evaluation")
    for name, changes, duration, rtol in CASES:
        changes = changes | {"track.irregularity": SPECTRUM}
        model, start = compile_scene(load_scene(SCENES / f"{name}.yaml", changes))
        times, best = np.linspace(0.0, duration, round(100 * duration) + 1), np.inf
        for _ in range(4):
            begun = time.process_time()
            run = integrate(model, start, times, "rodas4", rtol)
            best = min(best, time.process_time() - begun)
        path = "R 300" if "track.path" in changes else "straight"
        print(f"{name}, {changes['speed']:g} m/s, {path}, rodas4 {rtol:g}: {run.steps} steps, {run.rejected} rejected, "
              f"{run.rhs_evaluations} evaluations, {1e6 * best / run.steps:.1f} us a step, "
              f"{duration / best:.0f} times real time")  # fmt: skip


if __name__ == "__main__":
    main()
