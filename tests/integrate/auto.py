"""Is `auto` at its default tolerance near the best choice? ``python -m tests.integrate.auto [words | random N]``.

First table, per scene: what `auto` takes and errs (root mean squares against Tsit5 at 1e-9: lateral position of the
wheelsets; normal force of the wheels over its mean, and over its standard deviation in time, its dynamic part), the
cheapest of all methods and tolerances that keeps y to 1 um and N to 0.5 % (where `auto` errs more: that errs no
more), and the ratio of their costs. The last column asks for 0.5 % of the dynamic part, too: the cost of `auto`, at the
tolerance that keeps that (in brackets), over that of the cheapest choice that does.

Cost: what was done, in evaluations, whatever the machine does beside (:func:`wrcore.integrate.choice.work`). Processor
times are of one run each. The twin of the reference (RK45 at 1e-8) says how far its errors can be trusted. ``random N``
measures N random vehicles.

Second table: the error of y that the default tolerance buys, by method and kind of scene: median and most. Left out are
doubtful scenes and choices too dear for a scene.
"""

import sys
import time

import numpy as np

from tests.integrate.scenes import SCENES, compiled, random_scene
from wrcore.bodies.body import STATE_SIZE
from wrcore.contact.search import reduction
from wrcore.integrate.choice import work, work_of
from wrcore.integrate.integrator import METHODS, integrate
from wrcore.integrate.tableaus import EXPLICIT, ROSENBROCK
from wrcore.run.output.compute import evaluated
from wrcore.track.track import track_poses

RTOLS = (3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6)
DEFAULT = ("auto", 1e-4)
BARS, DYNAMIC = np.array([1e-6, 5e-3]), 5e-3
"""Of y (m) and of N over its mean; of N over its dynamic part."""
KINDS = {"wheelset": "wheelsets", "trailer": "coach, straight", "metro": "metro car, straight", "freight": "wagons",
         "loco": "locomotive", "R ": "curves", "ballast": "rails that give", "random": "random vehicles"}  # fmt: skip
"""Kinds of scenes by what their names hold; the last one counts."""
REFERENCE, TWIN = ("tsit5", 1e-9), ("rk45", 1e-8)
TOO_DEAR = 4.0
"""A choice that takes this many times as many evaluations as `auto` is given up."""


def cost(model, run):
    """What a run did, in evaluations."""
    if run.end is not None and len(run.end.notes):
        return work_of(model, run.end)
    return work(model, run.method, run.rhs_evaluations, run.steps + run.rejected, run.jacobians)


class Measured:
    """Runs of a scene by all choices, their processor times and errors."""

    def __init__(self, model, start, duration):
        self.model, self.start = model, start
        self.times = np.linspace(0.0, duration, round(200 * duration) + 1)
        self.sure = self.outputs(self.run(REFERENCE)[1])
        self.doubt = self.errors(self.run(TWIN)[1])
        self.taken, self.found, self.runs = {}, {}, {}

    def run(self, choice, most=0):
        began = time.process_time()
        trajectory = integrate(self.model, self.start, self.times, *choice, derailed_y=0.05, most_steps=most)
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
        """Of y in m, of N over its mean and over its dynamic part; infinite where the run ends before the reference."""
        (y, normal), (sure_y, sure_normal) = self.outputs(trajectory), self.sure
        if len(y) < len(sure_y):
            return np.full(3, np.inf)
        gap = np.sqrt(np.mean((normal[: len(sure_y)] - sure_normal) ** 2))
        y_error = np.sqrt(np.mean((y[: len(sure_y)] - sure_y) ** 2))
        return np.array([y_error, gap / sure_normal.mean(), gap / np.sqrt(sure_normal.var(axis=0).mean())])

    def all_choices(self):
        """Run all choices; the cheapest one within the bars, and the cheapest one and `auto` within that of the dynamic
        part, too (None where nothing is)."""
        default = self.once(DEFAULT)
        for method in ("auto", *METHODS):
            tableau = (EXPLICIT | ROSENBROCK)["rk4" if method == "auto" else method]
            most = round(TOO_DEAR * cost(self.model, default) / len(tableau.nodes))
            for rtol in RTOLS:
                if self.once((method, rtol), most).status == "stalled":
                    break  # tighter ones are dearer
        bars = np.maximum(BARS, self.found[DEFAULT][:2])
        self.doubtful = bool(np.any(self.doubt[:2] > 0.2 * bars))
        asked = [choice for choice in self.found if choice[0] != "auto" or choice == DEFAULT]
        enough = [choice for choice in asked if np.all(self.found[choice][:2] <= bars)]
        strict = [choice for choice in self.found if np.all(self.found[choice] <= [*BARS, DYNAMIC])]
        own = [choice for choice in strict if choice[0] == "auto"]
        return [min(group, key=self.cost, default=None) for group in (enough, strict, own)]

    def cost(self, choice):
        return cost(self.model, self.runs[choice])

    def once(self, choice, most=0):
        self.taken[choice], run = self.run(choice, most)
        self.runs[choice] = run
        self.found[choice] = np.full(3, np.inf) if run.status == "stalled" else self.errors(run)
        return run


def row(scene, best, strict, own):
    """Cells of the first table, after the scene's name and speed."""
    cells = []
    for choice in (DEFAULT, best):
        run, (y, normal, dynamic) = scene.runs[choice], scene.found[choice]
        title = run.method if choice is DEFAULT else f"{choice[0]}, {choice[1]:g}"
        cells += [title, f"{1e6 * y:.2g}", f"{100 * normal:.2g}", f"{100 * dynamic:.2g}", f"{scene.cost(choice):.0f}",
                  f"{1e3 * scene.taken[choice]:.1f}"]  # fmt: skip
    cells.append(f"{scene.cost(DEFAULT) / scene.cost(best):.2f}" + " (doubtful)" * scene.doubtful)
    if own is None:
        return [*cells, "-" if strict is None else "inf"]
    return [*cells, f"{scene.cost(own) / scene.cost(strict):.2f} ({own[1]:g})"]


def print_table(head, rows):
    for cells in (head, ["---"] * len(head)):
        print("| " + " | ".join(cells) + " |")
    for cells in rows:
        print("| " + " | ".join(cells) + " |", flush=True)


def measured(scenes, errors):
    """Rows of the first table; fills errors of y (um) at the default tolerance by method and kind of scene."""
    for name, speed, duration, changes in scenes:
        scene = Measured(*compiled(name, speed, changes), duration)
        yield [name, f"{speed:g}", *row(scene, *scene.all_choices())]
        kind = [title for word, title in KINDS.items() if word in name][-1]
        for method in METHODS:
            found = scene.found.get((method, DEFAULT[1]), [np.inf])
            if np.isfinite(found[0]) and not scene.doubtful:
                errors.setdefault(method, {}).setdefault(kind, []).append(1e6 * found[0])


def wanted(words):
    if words[:1] == ["random"]:
        return [random_scene(seed) for seed in range(int(words[1]))]
    return [scene for scene in SCENES if not words or any(word in f"{scene[0]} {scene[1]}" for word in words)]


def main():
    errors, quantities = {}, ["y, µm", "N, %", "of its dynamic part", "cost", "ms"]
    head = [
        "scene",
        "m/s",
        "auto",
        *quantities,
        "cheapest",
        *quantities,
        "ratio",
        "ratio with 0.5 % of the dynamic part",
    ]
    print_table(head, measured(wanted(sys.argv[1:]), errors))
    print()
    kinds = list(dict.fromkeys(kind for by_kind in errors.values() for kind in by_kind))
    rows = [
        [method, *(f"{np.median(y):.2g}, {max(y):.2g} ({len(y)})" for y in (by_kind.get(k, [np.nan]) for k in kinds))]
        for method, by_kind in errors.items()
    ]
    print_table(["method", *kinds], rows)


if __name__ == "__main__":
    main()
