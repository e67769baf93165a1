"""Test of `simulate_to_accuracy` on random scenes: whether runs reach the requested accuracy.

Two runs at tight tolerance, by other methods than the tested runs, are the reference. A request is tested only if
their difference is well below the requested accuracy. Elsewhere (unstable hunting, impacts) no reference exists.
"""

import numpy as np
import pandas as pd

from wrcore.analysis.to_accuracy import difference, simulate_to_accuracy
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene

KINDS = {
    "wheelset": (0.3, 1.5), "suspended_wheelset": (1.0, 4.0), "trailer_vehicle": (1.0, 2.0), "metro_car": (1.0, 1.5),
}  # fmt: skip
"""Scenes by name and the range of their durations, s. A free wheelset soon reaches the flange, and after some impacts
the two reference runs differ."""

WHEELS, RAILS = ("S1002", "S1002", "cone:1/20"), ("UIC60-MBench", "60E1", "60E2", "54E1", "49E1")
SPEEDS, FRICTIONS, RADII = (10.0, 80.0), (0.15, 0.5), (300.0, 5000.0)
"""Ranges of speed, m/s; friction coefficient; curve radius, m."""

LATERAL, GRAVITY, BASE = 0.7, 9.81, 1.5
"""Maximum uncompensated lateral acceleration in curves, m/s²; gravity, m/s²; distance of the contact points, m."""

CANT, RAMP = 0.15, 0.01
"""Maximum cant, m, and its maximum gradient, m/m."""

DOUBT = 0.2
"""Maximum difference of the two tight runs as a fraction of the requested accuracy."""


def random_scene(seed, seconds=1.0):
    """Return the name of a scene file and random changes to it by key path.

    Speed, friction, profiles, track and duration (scaled by ``seconds``) are random; seeds take the kinds in turn.
    """
    rng = np.random.default_rng(seed)
    kind = list(KINDS)[seed % len(KINDS)]
    speed = float(np.round(np.exp(rng.uniform(*np.log(SPEEDS))), 1))
    changes = {
        "speed": speed,
        "contact.friction": float(np.round(rng.uniform(*FRICTIONS), 2)),
        "contact.patch": "moment",
        "wheel.profile": str(rng.choice(WHEELS)),
        "rail": {"profile": str(rng.choice(RAILS)), "inclination": str(rng.choice(["1/20", "1/40"]))},
        "integration.duration": seconds * float(np.round(rng.uniform(*KINDS[kind]), 1)),
        "initial.y": float(np.round(rng.uniform(-0.003, 0.003), 5)),
    }
    if rng.random() < 0.5:
        changes["track.path"] = _curve(rng, speed, changes["integration.duration"])
    if rng.random() < 0.6:
        spectrum = {"level": str(rng.choice(["low", "high"])), "seed": seed, "length": 400.0, "begin": 15.0}
        changes["track.irregularity"] = {"spectrum": spectrum}
    return kind, changes


def _curve(rng, speed, duration):
    """Return a track path with transition and curve that a run reaches, with a cant that suits the speed."""
    radius = max(float(np.exp(rng.uniform(*np.log(RADII)))), speed**2 / (LATERAL + GRAVITY * CANT / BASE))
    cant = min(CANT, max(0.0, (speed**2 / radius - rng.uniform(0.0, LATERAL)) * BASE / GRAVITY))
    lengths = np.round(speed * duration * np.array([0.2, 0.3]) + [1.0, 5.0], 1)
    cant = min(cant, np.floor(1e3 * RAMP * lengths[1]) / 1e3)
    sign = 1.0 if rng.random() < 0.5 else -1.0
    whole = {"curve": 1000.0, "radius": sign * float(np.ceil(radius)), "cant": float(np.round(cant, 3))}
    return [{"tangent": float(lengths[0])}, {"transition": float(lengths[1])}, whole]


def judged(source, changes, requests, tight):
    """Simulate one scene to each requested accuracy and compare with the first of two ``tight`` runs.

    ``requests`` are accuracies by quantity of `wrcore.analysis.to_accuracy.QUANTITIES`; ``tight`` contains method, rtol
    and longest_step of each tight run.

    A row per request: of (quantity), asked (accuracy), stated (error that the run reports), reached (as reported),
    rtol, cost, status, reason, error, doubt (difference of the tight runs), trusted, ratio (error over asked).
    """
    scene = load_scene(source, changes)
    sure, twin = (
        simulate(load_scene(scene, {f"integration.{key}": value for key, value in one.items()}), progress=False)
        for one in tight
    )
    rows = []
    for of, accuracies in requests.items():
        doubt = _apart(sure, twin, of)
        for asked in accuracies:
            run, found = simulate_to_accuracy(scene, asked, of)
            error = _apart(run, sure, of)
            rows.append({
                "of": of, "asked": asked, "stated": found.found, "reached": found.reached, "rtol": found.rtol,
                "cost": found.cost, "status": run.status, "reason": found.reason, "error": error, "doubt": doubt,
                "trusted": doubt <= DOUBT * asked, "ratio": error / asked,
            })  # fmt: skip
    return pd.DataFrame(rows)


def _apart(one, other, of):
    """Return the difference of two runs; infinite if status or end differ (by more than one output time)."""
    if one.status != other.status or abs(one.t.size - other.t.size) > 1:
        return np.inf
    return difference(one, other, of)


def summary(table):
    """Count the requests of `judged` that were reached, by quantity and accuracy.

    Columns: of, asked, requests, trusted; among the trusted requests reached (as reported), missed (reported as
    reached, but with a larger error) and worst_ratio; median and maximum cost of all requests.
    """
    rows = []
    for (of, asked), part in table.groupby(["of", "asked"], sort=False):
        said = part[part["trusted"] & part["reached"]]
        rows.append({
            "of": of, "asked": asked, "requests": len(part), "trusted": int(part["trusted"].sum()),
            "reached": len(said), "missed": int((said["ratio"] > 1.0).sum()), "worst_ratio": said["ratio"].max(),
            "cost_median": part["cost"].median(), "cost_largest": part["cost"].max(),
        })  # fmt: skip
    return pd.DataFrame(rows)
