"""Hard cases of the normal contact: jumps of the contact point, loss of contact, impacts."""

from dataclasses import replace
from itertools import product

import numpy as np
import pandas as pd
from scipy.integrate import quad
from scipy.optimize import brentq

from study.contact.tables import lateral_sweep, study_pair, sweep_jumps
from study.hard_cases.cases import (
    Check,
    computed,
    contacts,
    impulse_error,
    prepare,
    rows,
    run,
    run_in_parts,
    sound,
    wheel_forces,
    with_forces,
)
from wrcore.analysis.contact.poses import loaded_poses
from wrcore.bodies.body import STATE_SIZE
from wrcore.contact.hertz import damping_factor
from wrcore.contact.search import reduction
from wrcore.geometry.irregularity import irregularity_data
from wrcore.integrate.tolerances import LENGTH
from wrcore.vehicle.description import GRAVITY

SMOOTH = 2.0
"""A step of the force larger than so many times the steepest smooth change is a jump."""

RATE_SHARE = 0.6
"""Part of the lag of a slow push that may be left at half its rate: all of what is no hysteresis halves."""

RESTITUTION_ERROR = 0.01
"""Of the restitution at the scenes' relative tolerance of 1e-4."""

RESOLVED = 1e-3
"""Part of an impact's depth that a step may err by in heights; shallower ones need a smaller ``rtol`` than others."""

GAP = 2e-4
"""Gap from which a wheelset is dropped onto the rails, m."""

PLANAR_LOOP = "planar detection has two equilibria of a yawed wheelset where the contact jumps to the flange's root"

CRESTS = {"flat": 0.25, "steep": 2.0}
"""Largest V^2 kappa over load by unsprung mass on a crest. A quarter of it never unloads a wheel: the curvature sets in
suddenly at both ends, which doubles its effect at most, and changes by twice its size between. Above 1 wheels leave."""

IMPULSE_ERROR = 0.01
"""Of the load's impulse: sampled forces of impacts are integrated to no better than this."""

CREST_RATE = 2e4
"""Outputs per second of runs over a crest."""


def restitution(speed, c_e, v0):
    """Speed after over speed (m/s) before an impact by Eq. (7), without weight; c_e and v0 (m/s) are those of the
    damping factor.

    With m v v' = -c_d(v') f(d) and any elastic force f that depends on the penetration alone, int v/c_d(v) dv over the
    approach equals int v/c_d(-v) dv over the separation. For speeds far above v0 that is sqrt(c_e).
    """

    def stored(end, sign):
        return quad(lambda v: v / damping_factor(sign * v, c_e, v0), 0.0, end, points=[min(v0, end)])[0]

    given = stored(speed, 1.0)
    return brentq(lambda ratio: stored(ratio * speed, -1.0) - given, 1e-3, 1.0 + 1e-9)


def depth(setting, speed):
    """How deep (m) a wheelset goes in that hits the rails without weight: (5/4 m v^2/K)^(2/5) by Hertz, undamped."""
    patches = contacts(setting.model, np.zeros(1), setting.state[None, :])
    stiffness = np.nansum(patches[..., reduction.NORMAL] / patches[..., reduction.PENETRATION] ** 1.5)
    return float(1.25 * setting.model.bodies.mass[0] * speed**2 / stiffness) ** 0.4


def impacts(vehicles, name, speeds, detections, methods):
    """A free wheelset that hits the rails at vertical speeds (m/s) without weight, its restitution against that of the
    damping law: rows of the table, and curve of restitution and expected.

    Where the study's tolerance is no small part of how deep it goes in, ``rtol`` is made `RESOLVED` of that.
    """
    found, curve = [], []
    for detection, method, speed in product(detections, methods, speeds):
        changes = {"contact.detection": detection, "integration.method": method, "initial.y": 0.0}
        setting = prepare(vehicles, name, changes)
        damping, state = setting.scene.data["contact"]["normal"]["damping"], setting.state.copy()
        rtol = min(setting.control["rtol"], RESOLVED * depth(setting, speed) / LENGTH)
        state[2] += GAP
        state[9] = -speed
        setting = replace(setting, state=state, model=setting.model._replace(gravity=0.0))
        duration = 3.0 * GAP / speed + 0.02
        trajectory = run(setting, duration, 1000.0 / duration, rtol=rtol)
        after, expected = trajectory.states[-1, 9] / speed, restitution(speed, damping["c_e"], damping["v0"])
        label = {"detection": detection, "integrator": method, "speed_m_per_s": speed}
        curve.append(label | {"restitution": after, "expected": expected})
        checks = [
            *sound(setting, trajectory),
            Check("restitution off the law's", abs(after - expected), RESTITUTION_ERROR, "1",
                  "int v/c_d dv equal for approach and separation; 100 rtol"),
            Check("restitution", after, 1.0, "1", "energy never grows"),
        ]  # fmt: skip
        found += rows("lift-off", "impact", f"{speed:g} m/s", setting, trajectory, checks)
    return found, curve


def drops(vehicles, name, height, duration, detections, methods, tolerances):
    """A free wheelset that falls from a height (m) onto the rails, bounces and comes to rest within a duration (s) at
    relative tolerances (the absolute one is a thousandth): it never gets higher than before. Rows of the table, and
    curve of lift_m (above the static height) over t_s.
    """
    found, curve = [], []
    for detection, method, rtol in product(detections, methods, tolerances):
        changes = {"contact.detection": detection, "integration.method": method, "initial.y": 0.0}
        changes |= {"integration.rtol": rtol, "integration.atol": 1e-3 * rtol}
        setting = prepare(vehicles, name, changes)
        rest, state = setting.state[2], setting.state.copy()
        state[2] += height
        setting = replace(setting, state=state)
        trajectory = run(setting, duration, 2000.0)
        lift, speed = trajectory.states[:, 2] - rest, trajectory.states[:, 9]
        energy = GRAVITY * lift + 0.5 * speed**2
        flying = ~np.isfinite(contacts(setting.model, trajectory.t, trajectory.states)[..., reduction.NORMAL])
        flying = np.all(flying, axis=(1, 2, 3))
        growth = np.max(np.diff(energy[flying]), initial=0.0) / energy[0]
        late = np.max(np.abs(lift[trajectory.t > 0.8 * duration]))
        allowed = np.sqrt(STATE_SIZE) * rtol * (rest + 1e-3) / height
        checks = [
            *sound(setting, trajectory),
            Check("flights", np.count_nonzero(np.diff(flying.astype(int)) == -1), 2, "1",
                  "a drop at restitution 0.9 bounces several times", least=True),
            Check("growth of energy from flight to flight, of m g h", float(growth), float(allowed), "1",
                  "0 within the tolerance of the height, sqrt(13) (rtol z + atol)/h"),
            Check("lift over the last fifth", float(late), 0.01 * height, "m", "it comes to rest: 1 % of the drop"),
        ]  # fmt: skip
        condition = f"{1e3 * height:g} mm, rtol {rtol:g}"
        found += rows("lift-off", "drop", condition, setting, trajectory, checks)
        label = {"detection": detection, "integrator": method, "rtol": rtol}
        curve += [label | {"t_s": t, "lift_m": z} for t, z in zip(trajectory.t[::4], lift[::4], strict=True)]
    return found, curve


def crest(length, curvature, begin):
    """Irregularity of both rails, a hump (1 - cos) of the given length whose top has the given curvature (1/m)."""
    s = np.arange(0.0, length + 1e-9, 0.02)
    height = curvature * length**2 / (2.0 * np.pi) ** 2 * (1.0 - np.cos(2.0 * np.pi * s / length))
    zero = np.zeros_like(s)
    return irregularity_data(begin, 0.02, np.column_stack([zero, height, zero, height]))


def crests(vehicles, speed, length, duration, detections, methods):
    """Vehicles that run over a hump of a length (m) at a speed (m/s) for a duration (s): wheels take off where V^2
    kappa exceeds what presses them down, and come back; rows of the table.
    """
    found = []
    for name, detection, method, kind in product(vehicles, detections, methods, CRESTS):
        changes = {"speed": speed, "contact.detection": detection, "integration.method": method, "initial.y": 0.0}
        setting, share = prepare(vehicles, name, changes), CRESTS[kind]
        front = int(setting.model.bodies.wheelsets[0])
        load = np.sum(wheel_forces(contacts(setting.model, np.zeros(1), setting.state[None, :]))[0][0, 0])
        curvature = share * float(load) / setting.model.bodies.mass[front] / speed**2
        bump = crest(length, curvature, setting.scene.vehicle.positions[front, 0] + 3.0)
        track = setting.model.track._replace(tangent=False, irregularity=bump)
        setting = replace(setting, model=setting.model._replace(track=track))
        trajectory = run(setting, duration, CREST_RATE)
        condition = f"V^2 kappa = {share:g} load/mass, {speed:g} m/s"
        checks = [*sound(setting, trajectory), *_crest_checks(setting, trajectory, share)]
        found += rows("lift-off", f"{kind} crest", condition, setting, trajectory, checks)
    return found


def _crest_checks(setting, trajectory, share):
    """Lift-off where it must be and nowhere else, return, and impulse of the rails against momentum of all bodies."""
    patches = contacts(setting.model, trajectory.t, trajectory.states)
    front = np.all(~np.isfinite(patches[:, 0, ..., reduction.NORMAL]), axis=2)
    away = float(np.mean(np.all(front, axis=1)))
    off = impulse_error(setting, trajectory, patches)
    source = "Newton's law for all bodies"
    checks = [Check("impulse of the rails less load and momentum, of the load's", off, IMPULSE_ERROR, "1", source)]
    if share < 1.0:
        return [*checks, Check("share of time off the rails", away, 0.0, "1", "a quarter of the load's acceleration")]
    landings = float(np.min(np.count_nonzero(np.diff(front.astype(int), axis=0) == -1, axis=0)))
    return [
        *checks,
        Check("share of time off the rails", away, 1e-3, "1", "V^2 kappa above load by mass", least=True),
        Check("landings", landings, 1, "1", "each wheel comes back", least=True),
    ]


# ------------------------------------------------------------------------------------------- jumps of the contact point


def pose_sweeps(pairs, load, step, reach, far_step, far):
    """Static sweeps of pairs (settings of :func:`study.contact.tables.study_pair`) under a load (N per wheel): how far
    the force steps at constant height (``step``, ``reach``), and whether the way back is the way there at constant load
    (``far_step``, ``far``), all m.

    Rows of the table, and curve of u_wheel_m (left, most loaded patch) and force_N (lateral, both wheels) over y_m.
    """
    found, curve = [], []
    for pair, settings in pairs.items():
        geometry = study_pair(settings).left.geometry
        for detection in ("planar", "spatial"):
            label = {"vehicle": "wheelset", "detection": detection, "integrator": "statics"}
            jumps = sweep_jumps(lateral_sweep(geometry, reach, step, load, detection), [reach])
            for row in jumps.itertuples():
                checks = [Check(
                    "largest over steepest smooth step of the force", row.ratio, SMOOTH, "1", "a continuous force",
                    known_limit="the point of greatest penetration jumps" if row.reduction == "maximum" else "",
                )]  # fmt: skip
                condition = f"+-{1e3 * reach:g} mm at constant height, {row.reduction}"
                found += computed("contact jumps", pair, condition, label, checks)
            there, back = (_at_load(geometry, detection, load, y) for y in _there_and_back(far, far_step))
            off = float(np.max(np.abs(there.force_N - back.force_N[::-1].to_numpy())))
            checks = [
                Check("force on the way back less that on the way there", off, 0.0, "N", "no memory in the contact"),
                Check("positions without equilibrium", float(there.force_N.isna().sum()), 0.0, "1", "it is loaded"),
            ]
            condition = f"0 to {1e3 * far:g} mm and back at constant load"
            found += computed("contact jumps", pair, condition, label, checks)
            curve += there.assign(pair=pair, detection=detection).to_dict("records")
    return found, curve


def _there_and_back(far, step):
    there = step * np.arange(round(far / step) + 1)
    return there, there[::-1]


def _at_load(geometry, detection, load, y):
    """Lateral force and the left wheel's most loaded patch of a wheelset under load at lateral positions."""
    poses = pd.DataFrame({"pose_id": np.arange(len(y)), "y_m": y, "yaw_rad": 0.0, "roll_rad": np.nan, "z_m": np.nan})
    patches = loaded_poses(poses, geometry, load, "moment", detection=detection)
    lateral = (-patches.N_N * np.sin(patches.contact_angle_rad)).groupby(patches.pose_id).sum()
    left = patches[patches.side == "left"].sort_values("N_N").groupby("pose_id").last()
    table = pd.DataFrame({"y_m": y}).assign(force_N=lateral, u_wheel_m=left.u_wheel_m)
    return table


def slow_push(vehicles, name, largest, durations, detections, methods):
    """A wheelset pushed to the left by a force up to ``largest`` (N) over its contact jumps and back in two durations
    (s, the second longer): what is left of the loop at no rate. Rows of the table, and curve of y_m over force_N.
    """
    found, curve = [], []
    for detection, method in product(detections, methods):
        widths = []
        for duration in durations:
            changes = {"contact.detection": detection, "integration.method": method, "initial.y": 0.0}
            setting, trajectory, force = _push_and_return(prepare(vehicles, name, changes), largest, duration)
            y = trajectory.states[:, STATE_SIZE * int(setting.model.bodies.wheelsets[0]) + 1]
            widths.append(np.sqrt(np.mean((y - y[::-1]) ** 2)) if len(y) == len(force) else np.nan)
            label = {"detection": detection, "integrator": method, "duration_s": duration}
            curve += [label | {"force_N": f, "y_m": at} for f, at in zip(force, y, strict=False)]
        loop = Check(
            "loop in y (rms) at half the rate, of that at the full one", widths[1] / widths[0], RATE_SHARE, "1",
            "what depends on the rate alone halves with it", known_limit=PLANAR_LOOP if detection == "planar" else "",
        )  # fmt: skip
        condition = f"0 to {1e-3 * largest:g} kN and back"
        found += rows("contact jumps", "slow push", condition, setting, trajectory, [*sound(setting, trajectory), loop])
    return found, curve


def _push_and_return(setting, largest, duration, parts=400):
    """The first wheelset under a force that rises and falls in small steps, and that force at the output times."""
    setting, force = with_forces(setting, int(setting.model.bodies.wheelsets[0]), np.zeros(3))
    part = duration / parts

    def change(t, _):
        force[0, 1] = largest * (1.0 - abs(2.0 * (t + 0.5 * part) / duration - 1.0))

    trajectory = run_in_parts(setting, duration, 1.0 / part, part, change)
    return setting, trajectory, largest * (1.0 - np.abs(np.linspace(-1.0, 1.0, parts + 1)))
