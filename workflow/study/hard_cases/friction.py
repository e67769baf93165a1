"""Hard cases of tangential contact: friction from 0 to 0.8, sudden changes of friction, creep laws at their limits."""

from itertools import product

import numpy as np

from study.hard_cases.cases import Check, computed, contacts, prepare, refused, rows, run, sound
from wrcore.bodies.body import STATE_SIZE
from wrcore.contact.search import reduction
from wrcore.creep.laws import LAWS, creep_forces
from wrcore.scene.description import load_scene

TABLE_ERROR = 0.01
"""Accepted error of a creep force relative to mu N. It is the tolerance with which creep tables are computed."""

FRICTIONLESS = 1e-9
"""Coefficient of friction of a frictionless case; exactly 0 is refused."""

STEP = 1e-3
"""Length of track over which friction changes, m."""

UNBOUNDED = "linear theory knows no friction limit"
NO_SPIN_IN_BOUND = "Shen-Hedrick-Elkins and FASTSIM: the power of a large spin may come out wrong"


def used_friction(patches, friction):
    """Return the maximum ratio of creep force to friction limit over all patches; friction by patch or for all."""
    force = np.hypot(patches[..., reduction.FX], patches[..., reduction.FY])
    return float(np.nanmax(force / (friction * patches[..., reduction.NORMAL])))


def friction_ladder(vehicles, names, values, laws, duration, detections, unstable=()):
    """Release vehicles off the centre for a duration (s) with several coefficients of friction and creep laws.

    Returns rows of the table. The motion of ``unstable`` vehicles grows until they climb, so that they may derail.
    """
    entry = vehicles[names[0]]
    label = {"vehicle": names[0], "detection": "any", "integrator": "any"}
    found = refused("friction", "none", "friction 0", label, lambda: load_scene(entry["scene"], ["contact.friction=0"]))
    for name, value, law, detection in product(names, values, laws, detections):
        changes = {"contact.friction": value, "contact.creep.model": law, "contact.detection": detection}
        setting = prepare(vehicles, name, {**changes, "initial.y": 0.004})
        trajectory = run(setting, duration)
        used = used_friction(contacts(setting.model, trajectory.t, trajectory.states), value)
        checks = [
            *sound(setting, trajectory),
            Check("largest creep force over mu N", used, 1.0 + TABLE_ERROR, "1", "Coulomb, and the table's tolerance",
                  known_limit=UNBOUNDED if law == "linear" else ""),
        ]  # fmt: skip
        expected = "derailed" if name in unstable and trajectory.status == "derailed" else "completed"
        found += rows("friction", f"law {law}", f"friction {value:g}", setting, trajectory, checks, expected)
    return found


def frictionless(vehicles, name, duration, detections, methods):
    """Check that a wheelset without friction keeps its forward speed and its spin; return rows of the table."""
    found = []
    for detection, method in product(detections, methods):
        changes = {"contact.friction": FRICTIONLESS, "contact.detection": detection, "integration.method": method}
        setting = prepare(vehicles, name, changes)
        trajectory = run(setting, duration)
        states, speed = trajectory.states, setting.model.speed
        change = float(np.max(np.abs(states[:, 7] / states[0, 7] - 1.0)))
        limit = 2.0 * FRICTIONLESS * setting.model.gravity * duration / speed
        checks = [*sound(setting, trajectory), Check("change of the speed ahead", change, limit, "1", "2 mu g t/V")]
        found += rows("friction", "none", f"friction {FRICTIONLESS:g}", setting, trajectory, checks)
    return found


def friction_step(vehicles, names, values, part, detections, methods):
    """Run vehicles over a track with sudden changes of friction; return rows of the table.

    Friction is constant over parts that take ``part`` (s) each, and changes over the length `STEP` between them.
    """
    found = []
    for name, detection, method in product(names, detections, methods):
        changes = {"contact.detection": detection, "integration.method": method, "initial.y": 0.004}
        usual = prepare(vehicles, name, changes)
        speed, begin = usual.model.speed, usual.scene.vehicle.positions[0, 0]
        ends = begin + part * speed * np.arange(1, len(values))
        table = {
            "arc_length": [float(s) for end in ends for s in (end, end + STEP)],
            "mu": [float(mu) for pair in zip(values, values[1:], strict=False) for mu in pair],
        }
        setting = prepare(vehicles, name, {**changes, "contact.friction": table})
        trajectory = run(setting, len(values) * part, 1000.0)
        patches = contacts(setting.model, trajectory.t, trajectory.states)
        places = trajectory.states[:, STATE_SIZE * setting.model.bodies.wheelsets]
        used = used_friction(patches, np.interp(places, *table.values())[..., None, None])
        checks = [
            *sound(setting, trajectory),
            Check("largest creep force over mu N", used, 1.0 + TABLE_ERROR, "1", "Coulomb on every part"),
        ]
        condition = " to ".join(f"{value:g}" for value in values)
        found += rows("friction", "step along the track", condition, setting, trajectory, checks)
    return found


def law_ends(vehicles, name, ratios, sizes, tolerance=1e-3):
    """Check creep laws with a vehicle's table and material at the limits of their range; return rows of the table.

    The patches have semi-axes with the ``ratios`` a/b. Creepages and spin have the nondimensional ``sizes``, one at a
    time and all together. A relative change of a/b by 1e-4 may change a force by at most ``tolerance``, relative to
    mu N.
    """
    found = []
    directions = np.array([d for d in product((-1.0, 0.0, 1.0), repeat=3) if any(d)])
    for law, number in LAWS.items():
        setting = prepare(vehicles, name, {"contact.creep.model": law})
        g = np.repeat(np.asarray(ratios, float), len(sizes) * len(directions))
        creepages = np.tile(np.concatenate([size * directions for size in sizes]), (len(ratios), 1))
        forces, beside = np.full((len(g), 3), np.nan), np.full((len(g), 3), np.nan)
        outside = creep_forces(number, setting.model.contact.creep, g, np.zeros(len(g)), creepages, forces)
        creep_forces(number, setting.model.contact.creep, g * (1.0 + 1e-4), np.zeros(len(g)), creepages, beside)
        size, power = np.hypot(forces[:, 0], forces[:, 1]), np.sum(forces * creepages, axis=1)
        scale = np.maximum(np.linalg.norm(creepages, axis=1), 1e-300)
        jump = np.max(np.abs(beside - forces)[:, :2], initial=0.0) if law != "linear" else 0.0
        checks = [
            Check("results that are no numbers", float(np.sum(~np.isfinite(forces))), 0.0, "1", "always a number"),
            Check("largest force over mu N", float(np.max(size)), 1.0 + TABLE_ERROR, "1", "Coulomb",
                  known_limit=UNBOUNDED if law == "linear" else ""),
            Check("largest power gained, over mu N and creepage", float(np.max(power / scale)), TABLE_ERROR, "1",
                  "friction takes energy", known_limit=NO_SPIN_IN_BOUND if law in ("she", "fastsim") else ""),
            Check("step of the force over 1e-4 of a/b", float(jump), tolerance, "1", "continuous at a table's ends"),
        ]  # fmt: skip
        condition = f"a/b {min(ratios):g} to {max(ratios):g}, creepages to {max(sizes):g}; {outside} out of range"
        label = {"vehicle": "one patch", "detection": "none", "integrator": "none"}
        found += computed("friction", f"law {law} at its ends", condition, label, checks)
    return found
