"""The passages of reports/crossings.md: `python -m tests.track.crossing_passage FOLDER` prints the tables and draws.

Every vehicle begins in steady running and goes over the crossing of config/scenes/crossing.yaml."""

import copy
import sys
import time
from pathlib import Path

import numpy as np

from tests.conftest import ELLIPTIC, SCENES
from wrcore.analysis.assessment.wheels import wheelsets_of
from wrcore.analysis.pictures.plot_crossing import plot_crossing
from wrcore.analysis.pictures.style import save_figure
from wrcore.equations.equations_of_motion import Equations
from wrcore.run.simulate import simulate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

TRAILER = {
    "vehicle": {"model": "trailer_vehicle", "parameters": "vehicles/trailer_vehicle.yaml", "axle_boxes": False},
    "track.crossing.at": 14.0, "integration.duration": 1.8, "output.rate": 2000,
}  # fmt: skip
SWITCH = {"track.crossing.slices": "switch:500", "integration.duration": 1.0}
OFF = {"track.path": [{"tangent": 5.75}, {"transition": 0.5}, {"curve": 100.0, "radius": 500.0}]}
TURNOUT = {
    "track.crossing": [{"slices": "switch:190", "at": 6.0}, {"slices": "crossing:1/9", "at": 29.07}],
    "speed": 10.0, "integration.duration": 3.3,
}  # fmt: skip
DIVERGING = {"track.path": [{"tangent": 5.75}, {"transition": 0.5}, {"curve": 20.6, "radius": 190.0},
                            {"transition": 0.5}, {"tangent": 50.0}]}  # fmt: skip
CASES = {
    "suspended wheelset, facing": {},
    "suspended wheelset, trailing": {"track.crossing.reversed": True, "track.crossing.at": 7.5},
    "suspended wheelset, facing, exact": {"contact.patch": "exact"},
    "trailer vehicle, facing": TRAILER,
    "trailer vehicle, trailing": TRAILER | {"track.crossing.reversed": True, "track.crossing.at": 15.5},
    "switch, suspended wheelset, through": SWITCH,
    "switch, suspended wheelset, leaving": SWITCH | OFF,
    "turnout at 10 m/s, suspended wheelset, through": TURNOUT,
    "turnout at 10 m/s, suspended wheelset, leaving": TURNOUT | DIVERGING,
}


def passage(changes):
    """Scene, run, and of its first wheelset static and largest load (kN), time without contact (ms) and depth of the
    lowest point (mm)."""
    scene = load_scene(SCENES / "crossing.yaml", changes)
    run = simulate(scene)
    name = wheelsets_of(run)[0]
    load = np.nan_to_num(run[f"{name}/right"]["N_N"]).sum(axis=1)
    z, step = run[name]["z_m"], run.t[1] - run.t[0]
    return scene, run, (1e-3 * load[0], 1e-3 * load.max(), 1e3 * step * np.sum(load == 0.0), 1e3 * (z[0] - z.min()))


def cost(changes):
    """Time of a metre of rough track on which a wheelset is on the crossing, over that of a metre without it."""
    rough = {"spectrum": {"level": "low", "seed": 3, "length": 300, "begin": -60}}
    scene = load_scene(SCENES / "crossing.yaml", changes | {"track.irregularity": rough})
    plain = copy.deepcopy(scene.data)
    del plain["track"]["crossing"]
    plain["vehicle"]["parameters"] = str(ELLIPTIC.parent / plain["vehicle"]["parameters"])
    low, high = scene.crossings[0].ends
    inside = (high - low) * len(scene.vehicle.wheelset_names)
    walls = [min(simulate(load_scene(one)).counters["wall_s"] for _ in range(5)) for one in (plain, scene)]
    whole = scene.data["speed"] * scene.data["integration"]["duration"]
    return 1.0 + (walls[1] / walls[0] - 1.0) * whole / inside


def evaluations():
    """Processor time (us) of a right-hand side of a wheelset: without a crossing, beside it, on it; on wheels that are
    polygons, and with a flat where they are round."""
    plain = copy.deepcopy(load_scene(SCENES / "crossing.yaml").data)
    plain["vehicle"]["parameters"] = str(ELLIPTIC.parent / plain["vehicle"]["parameters"])
    del plain["track"]["crossing"]
    polygon, flat = {"polygon": [{"order": 10, "amplitude": 2e-5}]}, {"flats": [{"length": 0.06}]}
    shapes = [plain | {"wheel": plain["wheel"] | {side: {"out_of_round": shape} for side in ("left", "right")}}
              for shape in (polygon, flat)]  # fmt: skip
    cases = {"plain": (plain, 0.5), "beside": (SCENES / "crossing.yaml", 0.5), "on it": (SCENES / "crossing.yaml", 6.4),
             "polygons": (shapes[0], 3.0), "beside flats": (shapes[1], 0.5)}  # fmt: skip
    return {name: _evaluation(*case) for name, case in cases.items()}


def _evaluation(scene, place):
    """Least processor time (us) of a right-hand side about a place (m)."""
    model, state = compile_scene(load_scene(scene))
    equations, states, tries = Equations(model), np.repeat(state[None, :], 2000, axis=0), []
    states[:, 0] += np.linspace(place - 0.2, place + 0.2, len(states))
    for _ in range(20):
        began = time.process_time()
        equations.at(0.0, states)
        tries.append(time.process_time() - began)
    return 1e6 * min(tries) / len(states)


PICTURES = {"suspended wheelset, facing": "crossing.png", "switch, suspended wheelset, leaving": "switch.png"}


def main(folder):
    print("| passage | static N kN | greatest N kN | in the air ms | lowest mm |\n|---|---|---|---|---|")
    for name, changes in CASES.items():
        scene, run, (static, largest, air, low) = passage(changes)
        assert run.status == "completed", run.reason
        print(f"| {name} | {static:.1f} | {largest:.0f} | {air:.1f} | {low:.2f} |")
        if name in PICTURES:
            save_figure(plot_crossing(run, scene=scene), Path(folder) / PICTURES[name])
    methods = "rk4", "rodas5", "auto"
    print(f"\n| cost of a metre on it, over rough track | {' | '.join(methods)} |\n|---|---|---|---|")
    for name in ("suspended wheelset, facing", "trailer vehicle, facing"):
        costs = [f"{cost(CASES[name] | {'integration.method': method}):.1f}" for method in methods]
        print(f"| {name} | {' | '.join(costs)} |")
    times = evaluations()
    print("\nA right-hand side, over that without a crossing: " + ", ".join(
        f"{name} {value / times['plain']:.2f}" for name, value in times.items()
    ))  # fmt: skip


if __name__ == "__main__":
    main(sys.argv[1])
