"""Limit cycles, forces on flanges and critical speeds with rigid rails and on the tracks of reports/tracks.md.

``python -m tests.track.giving_track`` prints the tables of that page.
"""

import re

import numpy as np

from tests.conftest import ELLIPTIC, ROOT
from wrcore.analysis.assessment.wheels import wheelset_channels
from wrcore.analysis.stability.stability import critical_speeds
from wrcore.errors.checked_yaml import parse_value
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene

TEXT = (ROOT / "reports" / "tracks.md").read_text(encoding="utf-8")
EXAMPLES = [
    example for example in map(parse_value, re.findall(r"```yaml\n(.*?)```", TEXT, re.DOTALL)) if "support" in example
]
"""The page's tracks that give: with masses, and without."""

TRACKS = {"rigid": {}, "masses": {"support": EXAMPLES[0]["support"]}, "massless": {"support": EXAMPLES[1]["support"]}}
SPEEDS = (60.0, 70.0, 80.0)
"""m/s; it hunts above some 55 m/s."""


def hunting(track, speed):
    """A run of the suspended wheelset into its limit cycle."""
    changes = {"contact.patch": "moment", "track": track, "speed": speed, "initial.y": 0.005,
               "integration.duration": 4.0, "integration.rtol": 1e-5, "output.rate": 5000.0}  # fmt: skip
    return simulate(load_scene(ELLIPTIC / "suspended_wheelset.yaml", changes))


def row(name, speed):
    """Amplitude and frequency of the last second, greatest Q and Y of the run."""
    run = hunting(TRACKS[name], speed)
    late, forces = run.t > run.t[-1] - 1.0, wheelset_channels(run, "wheelset")
    y = run["wheelset"].y_m[late]
    crossings = np.count_nonzero(np.diff(np.sign(y - y.mean())) > 0)
    greatest = [max(forces[f"{force}_{side}_N"].max() for side in ("left", "right")) for force in ("Q", "Y")]
    return (
        f"| {speed:g} | {name} | {500.0 * np.ptp(y):.2f} | {crossings} |"
        f" {1e-3 * greatest[0]:.0f} | {1e-3 * greatest[1]:.0f} |"
    )


def stiffer(lateral, vertical):
    """The track without mass, its springs and dampers times a factor in each direction."""
    rail, factors = TRACKS["massless"]["support"]["rail"], {"lateral": lateral, "vertical": vertical}
    return {"support": {"rail": {way: {key: factor * value for key, value in rail[way].items()}
                                 for way, factor in factors.items()}}}  # fmt: skip


STIFFER = {f"massless, {a} x lateral, {b} x vertical": stiffer(a, b) for a, b in ((10, 10), (1, 100), (100, 1))}


def critical(vehicle, tracks):
    """Rows of the linear critical speeds of a vehicle on tracks."""
    start, names = ELLIPTIC / f"{vehicle}.yaml", list(tracks)
    scenes = {
        name: load_scene(start, {"contact.patch": "moment", "initial.y": 0.0, "track": tracks[name]}) for name in names
    }
    found = critical_speeds(scenes, np.linspace(50.0, 90.0, 5)).set_index("variant")["critical_speed_m_per_s"]
    return [f"| {vehicle} | {name} | {found[name]:.1f} |" for name in names]


def main():
    print("| m/s | rails | amplitude mm | Hz | greatest Q kN | greatest Y kN |")
    print("|---|---|---|---|---|---|")
    for speed in SPEEDS:
        for name in TRACKS:
            print(row(name, speed), flush=True)
    print("\n| vehicle | rails | critical speed m/s |\n|---|---|---|")
    for vehicle in ("suspended_wheelset", "trailer_vehicle"):
        print("\n".join(critical(vehicle, TRACKS | (STIFFER if vehicle == "trailer_vehicle" else {}))), flush=True)


if __name__ == "__main__":
    main()
