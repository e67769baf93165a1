"""Digests of runs, tables and commands, to compare the code before and after a change that must not move a bit.

Both on one machine: another processor's code rounds differently. ``backwards`` takes the runs in reverse: with another
empty ``WRCORE_CACHE`` it shows whether bits depend on what was compiled before.

python tests/same_bits.py write before.json
python tests/same_bits.py compare before.json [backwards]
"""

import hashlib
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import wrcore as wr

CONFIG = Path(__file__).parents[1] / "config"
LOW = "{spectrum: {level: low, seed: 3, length: 200, begin: 5}}"
RUNS = {
    "wheelset": ("wheelset", ["integration.duration=1.2"]),
    "wheelset_planar": ("wheelset", ["integration.duration=0.5", "contact.detection=planar", "contact.patch=maximum"]),
    "suspended_60": ("suspended_wheelset", ["speed=60", "integration.duration=2", "integration.method=rk4"]),
    "suspended_ros": ("suspended_wheelset", ["integration.duration=2", "integration.method=ros34pw2"]),
    "suspended_rough": ("suspended_wheelset", ["integration.duration=1", f"track.irregularity={LOW}"]),
    "fastsim": ("suspended_wheelset", ["integration.duration=0.3", "contact.patch=moment",
                                      "contact.creep={model: fastsim}"]),
    "trailer_rough": ("trailer_vehicle", ["integration.duration=0.5", f"track.irregularity={LOW}",
                                          "integration.method=rodas4"]),
    "trailer_curve": ("trailer_vehicle", ["speed=16.7", "integration.duration=2",
                                          "track.path=[{tangent: 5}, {transition: 20}, {curve: 500, radius: 600}]"]),
    "metro_car": ("metro_car", ["integration.duration=0.1"]),
    "tabulated": ("suspended_wheelset", ["integration.duration=0.5", "contact.patch=tabulated", "initial.y=0.002"]),
    "crossing": ("crossing", ["integration.duration=0.05"]),
}  # fmt: skip
"""Scene and changes of each run."""

POSES = "pose_id,y_m,yaw_rad\n" + "".join(f"{k},{1e-3 * k - 7e-3},{2e-3 * (k % 3)}\n" for k in range(14))
COMMANDS = {
    "contact": ["contact", "--poses", "poses.csv", "--wheel", "S1002", "--rail", "UIC60-MBench", "--inclination",
                "1/40", "--gauge", "1.435", "--detection", "spatial", "--wheel-load", "54500", "--out", "out.csv"],
    "conicity": ["conicity", "--wheel", "S1002", "--rail", "60E1", "--inclination", "1/40", "--gauge", "1.435",
                 "--out", "out.csv"],
}  # fmt: skip


def digest(arrays):
    """SHA-256 over the bytes of float64 arrays."""
    sha = hashlib.sha256()
    for array in arrays:
        sha.update(np.ascontiguousarray(array, float).tobytes())
    return sha.hexdigest()[:16]


def digests(order=1):
    """Name and digest of everything that is compared; runs from the first or, with -1, from the last."""
    out = {}
    for name, (scene, changes) in list(RUNS.items())[::order]:
        run = wr.simulate(wr.load_scene(CONFIG / "scenes" / f"{scene}.yaml", changes), progress=False)
        channels = [array for group in sorted(run.keys()) for array in run[group].values()]
        out[f"run {name}: {run.status}"] = digest([run.t, *channels])
        print(name, file=sys.stderr)
    for planes in ("ellipse", "sdec"):
        table = wr.ensure_table(nu=0.3, planes=planes, tolerance=0.02)
        out[f"table {planes}"] = digest(_arrays(table.data))
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "poses.csv").write_text(POSES)
        for name, command in COMMANDS.items():
            subprocess.run([sys.executable, "-m", "wrcore", *command], cwd=folder, check=True)
            out[f"command {name}"] = hashlib.sha256((Path(folder) / "out.csv").read_bytes()).hexdigest()[:16]
    return out


def _arrays(data):
    """All numbers and arrays in nested tuples."""
    if isinstance(data, tuple):
        return [array for part in data for array in _arrays(part)]
    return [np.atleast_1d(data)]


def main(action, path, order="forwards"):
    """Write the digests, or compare them with those written before; exit status 1 where they differ."""
    now = digests({"forwards": 1, "backwards": -1}[order])
    if action == "write":
        Path(path).write_text(json.dumps(now, indent=1))
        return 0
    before = json.loads(Path(path).read_text())
    different = [name for name in sorted(before.keys() | now.keys()) if before.get(name) != now.get(name)]
    print(f"{len(now) - len(different)} of {len(before)} the same", *different, sep="\n")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
