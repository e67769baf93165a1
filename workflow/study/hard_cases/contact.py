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
"""Maximum ratio of a force step to the steepest smooth change; larger steps are jumps."""

RATE_SHARE = 0.6
"""Maximum width of the loop at half the rate of a slow push, relative to that at the full rate. A lag that depends on
the rate halves; hysteresis does not."""

RESTITUTION_ERROR = 0.01
"""Accepted error of the restitution at the scenes' relative tolerance of 1e-4."""

RESOLVED = 1e-3
"""Accepted error of the height in a step, relative to the penetration of an impact. Shallow impacts therefore need a
smaller ``rtol``."""

GAP = 2e-4
"""Gap from which a wheelset is dropped onto the rails, m."""

PLANAR_LOOP = "planar detection has two equilibria of a yawed wheelset where the contact jumps to the flange's root"

CRESTS = {"flat": 0.25, "steep": 2.0}
"""Maximum of V^2 kappa on a crest, relative to load over unsprung mass. Wheels lift off above 1. At 0.25 they never do:
the curvature starts suddenly, which at most doubles its effect, and changes by twice its size within the crest."""

IMPULSE_ERROR = 0.01
"""Accepted error of the impulse, relative to that of the load. It is the accuracy of integrals of sampled impact
forces."""

CREST_RATE = 2e4
"""Output rate of runs over a crest, 1/s."""


def restitution(speed, c_e, v0):
    """Return the restitution of an impact by Eq. (7) without weight: speed after over speed (m/s) before the impact.

    c_e and v0 (m/s) are parameters of the damping factor. With m v v' = -c_d(v') f(d) and any elastic force f of the
    penetration, int v/c_d(v) dv over the approach equals int v/c_d(-v) dv over the separation. For speeds far above v0
    the restitution is sqrt(c_e).
    """

    def stored(end, sign):
        return quad(lambda v: v / damping_factor(sign * v, c_e, v0), 0.0, end, points=[min(v0, end)])[0]

    given = stored(speed, 1.0)
    return brentq(lambda ratio: stored(ratio * speed, -1.0) - given, 1e-3, 1.0 + 1e-9)


def depth(setting, speed):
    """Return the maximum penetration (m) of an impact at a vertical speed (m/s), without weight and damping.

    By Hertz it is (5/4 m v^2/K)^(2/5).
    """
    patches = contacts(setting.model, np.zeros(1), setting.state[None, :])
    stiffness = np.nansum(patches[..., reduction.NORMAL] / patches[..., reduction.PENETRATION] ** 1.5)
    return float(1.25 * setting.model.bodies.mass[0] * speed**2 / stiffness) ** 0.4


def impacts(vehicles, name, speeds, detections, methods):
    """Compare the restitution of a free wheelset, which hits the rails without weight, with that of the damping law.

    The vertical speeds are in m/s. Returns rows of the table, and curve of restitution and expected. For impacts that
    the study's tolerance does not resolve, ``rtol`` is reduced to `RESOLVED` times the penetration.
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
    """Drop a free wheelset from a height (m) onto the rails; no bounce may be higher than the one before.

    The wheelset bounces and comes to rest within a duration (s). ``tolerances`` are relative; the absolute ones are a
    thousandth of them. Returns rows of the table, and curve of lift_m (above the static height) over t_s.
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
    """Return the irregularity of both rails: a hump (1 - cos) of given length (m) and curvature (1/m) at its top."""
    s = np.arange(0.0, length + 1e-9, 0.02)
    height = curvature * length**2 / (2.0 * np.pi) ** 2 * (1.0 - np.cos(2.0 * np.pi * s / length))
    zero = np.zeros_like(s)
    return irregularity_data(begin, 0.02, np.column_stack([zero, height, zero, height]))


def crests(vehicles, speed, length, duration, detections, methods):
    """Run vehicles over a hump of a length (m) at a speed (m/s) for a duration (s); return rows of the table.

    Wheels must lift off where V^2 kappa exceeds load over unsprung mass, and must return to the rail.
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
    """Return the checks of lift-off, return to the rail, and momentum balance of all bodies."""
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
    """Compute static lateral sweeps of wheel-rail pairs under a load (N per wheel).

    ``pairs`` are settings of :func:`study.contact.tables.study_pair`. A sweep at constant height (``step``, ``reach``)
    measures jumps of the force. A sweep to ``far`` and back at constant load (``far_step``) must give equal forces in
    both directions. Lengths are in m.

    Returns rows of the table, and curve of u_wheel_m (left wheel, most loaded patch) and force_N (lateral, both wheels)
    over y_m.
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
    """Return lateral force and the left wheel's most loaded patch of a wheelset under load at lateral positions (m)."""
    poses = pd.DataFrame({"pose_id": np.arange(len(y)), "y_m": y, "yaw_rad": 0.0, "roll_rad": np.nan, "z_m": np.nan})
    patches = loaded_poses(poses, geometry, load, "moment", detection=detection)
    lateral = (-patches.N_N * np.sin(patches.contact_angle_rad)).groupby(patches.pose_id).sum()
    left = patches[patches.side == "left"].sort_values("N_N").groupby("pose_id").last()
    table = pd.DataFrame({"y_m": y}).assign(force_N=lateral, u_wheel_m=left.u_wheel_m)
    return table


def slow_push(vehicles, name, largest, durations, detections, methods):
    """Measure the hysteresis of a wheelset that a slow force pushes to the left over its contact jumps and back.

    The force rises to ``largest`` (N) and falls again within a duration (s). The loop of y over the force is compared
    for two durations, of which the second is longer. Returns rows of the table, and curve of y_m over force_N.
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
    """Return setting, trajectory, and force at the output times for a lateral force that rises and falls in steps.

    The force acts on the first wheelset.
    """
    setting, force = with_forces(setting, int(setting.model.bodies.wheelsets[0]), np.zeros(3))
    part = duration / parts

    def change(t, _):
        force[0, 1] = largest * (1.0 - abs(2.0 * (t + 0.5 * part) / duration - 1.0))

    trajectory = run_in_parts(setting, duration, 1.0 / part, part, change)
    return setting, trajectory, largest * (1.0 - np.abs(np.linspace(-1.0, 1.0, parts + 1)))
