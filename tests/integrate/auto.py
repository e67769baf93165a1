"""Is `auto` at its default tolerance near the best choice? ``python -m tests.integrate.auto [words of scenes]``.

First table, per scene: what `auto` takes and errs (lateral position of the wheelsets; normal force of the wheels over
its mean; root mean squares against Tsit5 at 1e-9), the cheapest of all methods and tolerances that errs no more in
either, and the ratio of their costs. Cost: processor time, the least of five runs in turn, evaluations beside it. The
twin of the reference (RK45 at 1e-9) says how far its errors can be trusted.

Second table: the error of y that the default tolerance buys, by method and kind of scene: median and most. Left out are
doubtful scenes and choices too dear for a scene.
"""

import sys
import tempfile
import time
from itertools import product
from pathlib import Path

import numpy as np

from wrcore.contact import reduction
from wrcore.dynamics.body import STATE_SIZE
from wrcore.dynamics.track import track_poses
from wrcore.integrate.integrator import METHODS, integrate
from wrcore.run.simulation import evaluated
from wrcore.scene.description import compile_scene, load_scene

RTOLS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6)
DEFAULT = ("auto", 1e-4)
KINDS = {"wheelset": "wheelsets", "trailer": "coach, straight", "metro": "metro car, straight", "loco": "locomotive",
         "R ": "curves", "ballast": "rails that give"}  # fmt: skip
"""Kinds of scenes by what their names hold; the last one counts."""
REFERENCE, TWIN = ("tsit5", 1e-9), ("rk45", 1e-9)
TOO_DEAR, REPETITIONS = 4.0, 5
"""A choice that takes this many times as long as `auto` is given up; those that may be the cheapest run so often."""


def rough(level="low", seed=1, begin=20.0):
    return {"track.irregularity": {"spectrum": {"level": level, "seed": seed, "length": 2000.0, "begin": begin}}}


def curve(radius, cant=0.1):
    ramp = {"transition": 40}
    return {"track.path": [{"tangent": 20}, ramp, {"curve": 60, "radius": radius, "cant": cant}, ramp, {"tangent": 99}]}


def kept_at(speed):
    return {"drive.controller.speed": speed, "contact.friction": 0.3}


BALLAST = {"track.support": {
    "rail": {"mass": 79.0, "lateral": {"stiffness": 4.34e7, "damping": 1.45e5},
             "vertical": {"stiffness": 1.88e8, "damping": 2.17e5}},
    "sleeper": {"mass": 544.0, "roll_inertia": 306.0, "lateral": {"stiffness": 6.0e7, "damping": 1.5e5},
                "vertical": {"stiffness": 2.87e8, "damping": 1.18e5}},
}}  # fmt: skip
FREE = {"contact.patch": "moment"}
STIFF = "stiff damper"

SCENES = [  # of the accuracy study; of nobody
    ("suspended wheelset", 20, 10.0, {}),
    ("suspended wheelset", 60, 10.0, {}),
    ("wheelset", 20, 0.8, FREE),
    ("trailer vehicle", 20, 5.0, rough()),
    ("trailer vehicle", 40, 5.0, rough()),
    ("trailer vehicle", 60, 5.0, rough()),
    ("wheelset, friction 0.6", 10, 1.2, FREE | {"contact.friction": 0.6}),
    ("wheelset, friction 0.1", 45, 0.6, FREE | {"contact.friction": 0.1}),
    ("suspended wheelset, rough, friction 0.6", 10, 10.0, rough() | {"contact.friction": 0.6}),
    ("suspended wheelset, rough, friction 0.1", 45, 5.0, rough("high", 5) | {"contact.friction": 0.1}),
    ("suspended wheelset, hunting", 80, 0.3, {}),
    ("suspended wheelset, ballast, rough", 45, 5.0, rough() | BALLAST),
    ("trailer vehicle, rough, friction 0.6", 10, 5.0, rough("high", 7) | {"contact.friction": 0.6}),
    ("trailer vehicle", 45, 5.0, {}),
    ("trailer vehicle, rough, friction 0.1", 80, 3.0, rough("low", 3) | {"contact.friction": 0.1}),
    ("trailer vehicle, R 300", 16.7, 12.0, curve(300.0)),
    ("trailer vehicle, R 300, rough", 16.7, 12.0, curve(300.0) | rough()),
    ("trailer vehicle, R 1500, rough", 45, 5.0, curve(1500.0) | rough("high", 2)),
    ("trailer vehicle, ballast, rough", 20, 5.0, rough() | BALLAST),
    ("trailer vehicle, ballast, rough", 60, 3.0, rough() | BALLAST),
    ("metro car, rough", 20, 5.0, {}),
    ("metro car, rough", 45, 3.0, rough("high", 2)),
    ("metro car, rough", 80, 3.0, rough("low", 6)),
    ("metro car, R 300, rough", 16.7, 12.0, curve(300.0) | rough()),
    (f"metro car, {STIFF}", 10, 5.0, {}),
    (f"metro car, {STIFF}, rough", 45, 3.0, {}),
    ("locomotive, rough", 20, 3.0, kept_at(20.0) | rough()),
    ("locomotive, rough, friction 0.1", 45, 3.0, kept_at(45.0) | rough() | {"contact.friction": 0.1}),
]


def stiff_metro_car(folder):
    """The metro car with primary dampers in series with a spring so stiff that they relax in 60 us."""
    text = Path("config/vehicles/metro_car.yaml").read_text()
    path = Path(folder, "metro_car.yaml")
    path.write_text(text.replace("series_stiffness: 2.0e+6 ", "series_stiffness: 1.333e+8 ", 1))
    return {"vehicle.parameters": str(path)}


def compiled(name, speed, changes, folder):
    if STIFF in name:
        changes = changes | stiff_metro_car(folder)
    file = f"config/scenes/{name.split(',')[0].replace(' ', '_')}.yaml"
    return compile_scene(load_scene(file, {"speed": speed, **changes}))


class Measured:
    """Runs of a scene by all choices: least processor time, errors, evaluations."""

    def __init__(self, model, start, duration):
        self.model, self.start = model, start
        self.times = np.linspace(0.0, duration, round(200 * duration) + 1)
        integrate(model, start, self.times[:2], "tsit5")  # loads kernels
        integrate(model, start, self.times[:2], "rodas4")
        self.sure = self.outputs(self.run(REFERENCE)[1])
        self.doubt = self.errors(self.run(TWIN)[1])
        self.cost, self.found, self.runs = {}, {}, {}

    def run(self, choice, longest=np.inf):
        began = time.process_time()

        def stop():
            return "too dear" if time.process_time() - began > longest else ""

        trajectory = integrate(self.model, self.start, self.times, *choice, derailed_y=0.05, stop=stop, chunk=500)
        return time.process_time() - began, trajectory

    def outputs(self, trajectory):
        """Lateral position in the track's axes (n, wheelsets) and normal forces (n, wheelsets, 2)."""
        states, wheelsets = trajectory.states, self.model.bodies.wheelsets
        y = states[:, STATE_SIZE * wheelsets + 1].copy()
        if not self.model.track.tangent:
            for k, body in enumerate(wheelsets):
                at = STATE_SIZE * body
                y[:, k] = track_poses(self.model.track, states, at, states[0, at])[0][:, 1]
        return y, np.nansum(evaluated(self.model, trajectory)[0][..., reduction.NORMAL], axis=-1)

    def errors(self, trajectory):
        """Of y in m, of N over its mean; infinite where the run ends before the reference."""
        (y, normal), (sure_y, sure_normal) = self.outputs(trajectory), self.sure
        if len(y) < len(sure_y):
            return np.full(2, np.inf)
        gap = normal[: len(sure_y)] - sure_normal
        y_error = np.sqrt(np.mean((y[: len(sure_y)] - sure_y) ** 2))
        return np.array([y_error, np.sqrt(np.mean(gap**2)) / sure_normal.mean()])

    def all_choices(self):
        self.once(DEFAULT)
        for choice in product(METHODS, RTOLS):
            self.once(choice, TOO_DEAR * self.cost[DEFAULT])
        enough = [choice for choice in self.found if np.all(self.found[choice] <= self.found[DEFAULT])]
        least = min(self.cost[choice] for choice in enough)
        contenders = [choice for choice in enough if self.cost[choice] <= 1.5 * least] + [DEFAULT]
        for choice in (REPETITIONS - 1) * contenders:
            self.cost[choice] = min(self.cost[choice], self.run(choice)[0])
        self.doubtful = bool(np.any(self.doubt > 0.2 * self.found[DEFAULT]))
        return min(contenders, key=self.cost.get)

    def once(self, choice, longest=np.inf):
        self.cost[choice], run = self.run(choice, longest)
        self.runs[choice] = run
        self.found[choice] = np.full(2, np.inf) if run.status == "stalled" else self.errors(run)


def row(scene, best):
    """Cells of the first table, after the scene's name and speed."""
    cells = []
    for choice in (DEFAULT, best):
        run, (y, normal) = scene.runs[choice], scene.found[choice]
        title = run.method if choice is DEFAULT else f"{choice[0]}, {choice[1]:g}"
        cells += [title, f"{1e6 * y:.2g}", f"{100 * normal:.2g}", str(run.rhs_evaluations),
                  f"{1e3 * scene.cost[choice]:.1f}"]  # fmt: skip
    return [*cells, f"{scene.cost[DEFAULT] / scene.cost[best]:.2f}" + " (doubtful)" * scene.doubtful]


def print_table(head, rows):
    for cells in (head, ["---"] * len(head)):
        print("| " + " | ".join(cells) + " |")
    for cells in rows:
        print("| " + " | ".join(cells) + " |", flush=True)


def measured(wanted, errors):
    """Rows of the first table; fills errors of y (um) at the default tolerance by method and kind of scene."""
    with tempfile.TemporaryDirectory() as folder:
        for name, speed, duration, changes in SCENES:
            if wanted and not any(word in f"{name} {speed}" for word in wanted):
                continue
            scene = Measured(*compiled(name, speed, changes, folder), duration)
            yield [name, f"{speed:g}", *row(scene, scene.all_choices())]
            kind = [title for word, title in KINDS.items() if word in name][-1]
            for method in METHODS:
                found = scene.found[method, DEFAULT[1]][0]
                if np.isfinite(found) and not scene.doubtful:
                    errors.setdefault(method, {}).setdefault(kind, []).append(1e6 * found)


def main():
    errors = {}
    head = [
        "scene",
        "m/s",
        "auto",
        "y, µm",
        "N, %",
        "evaluations",
        "ms",
        "cheapest",
        "y, µm",
        "N, %",
        "evaluations",
        "ms",
    ]
    print_table([*head, "ratio"], measured(sys.argv[1:], errors))
    print()
    kinds = list(dict.fromkeys(kind for by_kind in errors.values() for kind in by_kind))
    rows = [
        [method, *(f"{np.median(y):.2g}, {max(y):.2g} ({len(y)})" for y in (by_kind.get(k, [np.nan]) for k in kinds))]
        for method, by_kind in errors.items()
    ]
    print_table(["method", *kinds], rows)


if __name__ == "__main__":
    main()
