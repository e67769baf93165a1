"""Speed of an evaluation, and of runs on irregular track: ``python -m tests.integrate.speed``.

Processor time, the best of four runs; nothing else should run. Errors: `snakemake speed_against_error`.
"""

import time

import numpy as np

from tests.conftest import SCENES
from wrcore.dynamics.system import Equations
from wrcore.integrate.integrator import integrate
from wrcore.scene.description import compile_scene, load_scene

SPECTRUM = {"spectrum": {"level": "low", "seed": 1, "length": 2000.0, "begin": 20.0}}
ROUGH = {"track.irregularity": SPECTRUM}
CURVE = {"track.path": [{"tangent": 20}, {"transition": 40}, {"curve": 250, "radius": 300, "cant": 0.1},
                        {"transition": 40}, {"tangent": 100}]}  # fmt: skip
RAIL = {"mass": 79, "lateral": {"stiffness": 4.34e7, "damping": 1.45e5},
        "vertical": {"stiffness": 1.88e8, "damping": 2.17e5}}  # fmt: skip
SLEEPER = {"mass": 544, "roll_inertia": 306, "lateral": {"stiffness": 6.0e7, "damping": 1.5e5},
           "vertical": {"stiffness": 2.87e8, "damping": 1.18e5}}  # fmt: skip
SOFT = {"lateral": {"stiffness": 1.8e7, "damping": 5.0e4}, "vertical": {"stiffness": 8.1e7, "damping": 6.0e4}}
GIVING = {"rigid track": {}, "track that gives": {"track.support": {"rail": RAIL, "sleeper": SLEEPER}},
          "rails without mass": {"track.support": {"rail": SOFT}}}  # fmt: skip
"""The values of `reports/tracks.md`."""
CASES = [
    *(
        ("trailer_vehicle", {"speed": v, **ROUGH, **track}, 5.0)
        for v in (20.0, 40.0, 60.0)
        for track in GIVING.values()
    ),
    ("trailer_vehicle", {"speed": 16.7, **CURVE, **ROUGH}, 20.0),
    ("metro_car", {"speed": 16.7, **CURVE, **ROUGH}, 20.0),
    ("suspended_wheelset", {"speed": 20.0}, 10.0),
    ("suspended_wheelset", {"speed": 60.0}, 10.0),
]
CHOICES = ("rodas5", 3e-4), ("rodas4p2", 3e-4), ("rk4", 3e-4), ("auto", 1e-4)
"""Near the cheapest that keep y to 1 um and N to 0.5 % (`tests.integrate.auto`), and the default."""


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
    for name, changes, duration in CASES:
        model, start = compile_scene(load_scene(SCENES / f"{name}.yaml", {"contact.patch": "moment", **changes}))
        times, best = np.linspace(0.0, duration, round(100 * duration) + 1), dict.fromkeys(CHOICES, np.inf)
        evaluations = {}
        for choice in CHOICES * 4:  # in turn
            begun = time.process_time()
            run = integrate(model, start, times, *choice)
            evaluations[choice] = run.rhs_evaluations / run.steps
            best[choice] = min(best[choice], time.process_time() - begun)
        support = {key: value for key, value in changes.items() if key == "track.support"}
        of = ", R 300" * ("track.path" in changes) + f", {next(name for name in GIVING if GIVING[name] == support)}"
        print(f"{name}, {changes['speed']:g} m/s{of}, times real time (evaluations a step):")
        print(*(f"    {choice[0]} {choice[1]:g}: {duration / best[choice]:.0f} ({evaluations[choice]:.0f})"
                for choice in CHOICES))  # fmt: skip


if __name__ == "__main__":
    main()
