"""Speed of an evaluation, and of runs on irregular track: ``python -m tests.integrate.speed``.

Processor time, the best of four runs; nothing else should run. Beside it evaluations a step, and errors as in
`tests.integrate.auto`: root mean squares of y, and of N over its mean. A star: y to 1 um and N to 0.5 %.
"""

import time

import numpy as np

from tests.conftest import ELLIPTIC
from tests.integrate.auto import BARS, Measured
from tests.track.giving_track import EXAMPLES
from wrcore.equations.equations_of_motion import Equations
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

SPECTRUM = {"spectrum": {"level": "low", "seed": 1, "length": 2000.0, "begin": 20.0}}
ROUGH = {"track.irregularity": SPECTRUM}
CURVE = {"track.path": [{"tangent": 20}, {"transition": 40}, {"curve": 250, "radius": 300, "cant": 0.1},
                        {"transition": 40}, {"tangent": 100}]}  # fmt: skip
GIVING = {"rigid track": {}} | {
    name: {"track.support": example["support"]}
    for name, example in zip(("track that gives", "rails without mass"), EXAMPLES, strict=True)
}
"""The examples of `reports/tracks.md`."""
CASES = [
    *((f"trailer_vehicle, {track}", {"speed": v, **ROUGH, **GIVING[track]}, 5.0)
      for v in (20.0, 40.0, 60.0) for track in GIVING),
    ("trailer_vehicle, R 300", {"speed": 16.7, **CURVE, **ROUGH}, 20.0),
    ("metro_car, R 300", {"speed": 16.7, **CURVE, **ROUGH}, 20.0),
    ("guided_car, independent wheels", {"speed": 15.0, "track.path": "tangent", **ROUGH}, 10.0),
    ("suspended_wheelset, smooth", {"speed": 20.0}, 10.0),
    ("suspended_wheelset, smooth", {"speed": 60.0}, 10.0),
]  # fmt: skip
CHOICES = [*(("rodas5", rtol) for rtol in (6e-4, 3e-4, 1e-4)), ("rodas4p2", 3e-4), ("rk4", 1e-3), ("rk4", 3e-4),
           ("auto", 1e-4)]  # fmt: skip
"""Near the cheapest that keep y to 1 um and N to 0.5 %, and the default."""


def evaluation(name):
    """Processor time of one right-hand side, s: the least of sixty batches."""
    model, state = compile_scene(load_scene(ELLIPTIC / f"{name}.yaml", {"initial.y": 0.002}))
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
    for title, changes, duration in CASES:
        scene = load_scene(ELLIPTIC / f"{title.split(',')[0]}.yaml", {"contact.patch": "moment", **changes})
        measured, best = Measured(*compile_scene(scene), duration), dict.fromkeys(CHOICES, np.inf)
        for choice in CHOICES * 4:  # in turn
            measured.once(choice)
            best[choice] = min(best[choice], measured.taken[choice])
        print(f"{title}, {changes['speed']:g} m/s, times real time (evaluations a step; y in um, N in %):")
        for choice in CHOICES:
            run, (y, normal) = measured.runs[choice], measured.found[choice][:2]
            star, each = "*" if np.all([y, normal] <= BARS) else " ", run.rhs_evaluations / run.steps
            speed = f"{star} {choice[0]} {choice[1]:g}: {duration / best[choice]:.0f}"
            print(f"  {speed} ({each:.0f}; {1e6 * y:.2g}, {100 * normal:.2g})", flush=True)


if __name__ == "__main__":
    main()
