"""Hard cases of flange contact: a lateral force pushes a wheelset until it climbs and derails; Nadal's limit."""

import math
from itertools import product

import numpy as np

from study.hard_cases.cases import Check, contacts, prepare, rows, run_in_parts, sound, wheel_forces, with_forces
from wrcore.bodies.body import STATE_SIZE
from wrcore.contact.search import reduction
from wrcore.run.simulation import DERAILED_Y

RATE = 500.0
"""Output rate, 1/s: one output per 20 mm of track at 10 m/s."""

PART = 0.02
"""Time for which a force is kept constant, s."""

AXLE_BOX = 1.0
"""Lateral distance of the forces from the wheelset's centre, m. They act in the plane of the rails. Forces at the axle
would lift the other wheel at Y/Q = 0.75/0.46 or less, which is below Nadal's limit for low friction."""

SLIDING_MEAN = 2.0
"""Distance over which Y/Q is averaged, m (EN 14363)."""

ON_THE_TIP = 0.04
"""Lateral displacement of the wheelset above which the flange tip is on the rail, m."""

NADAL_FLOOR = 0.97
"""Minimum Y/Q of a climbing wheel relative to Nadal's limit. It is below 1 because the mean over 2 m lags behind the
rising force."""

PLANAR_LIMIT = "planar detection misses the flange contact ahead of the axle's cross-section: the wheel climbs late"

NADAL_CEILING = 1.15
"""Maximum Y/Q relative to Nadal's limit at a large angle of attack. It is above 1 because longitudinal slip of the
flange uses part of the friction."""


def nadal_limit(friction, angle):
    """Return Nadal's limit of Y/Q: (tan g - mu)/(1 + mu tan g) with the maximum contact angle g (rad)."""
    return (math.tan(angle) - friction) / (1.0 + friction * math.tan(angle))


def flange_angle(scene):
    """Return the maximum contact angle of a scene's wheel profile on the flange, rad."""
    wheel = scene.wheel
    flank = (wheel.u > wheel.u[np.argmin(wheel.f)]) & (wheel.u < 0.0)  # from the flange's tip to the tape circle
    return float(math.atan(np.max(np.abs(wheel.df[flank]))))


def pushed(setting, body, turn, rate, largest, settle):
    """Return setting and trajectory of a wheelset that is yawed and pushed onto the left rail until it derails.

    Forces ``turn`` (N) act forwards on the right and backwards on the left end; they reach full size at half the time
    ``settle`` (s). After ``settle`` a force to the left rises at a rate (N/s) to ``largest`` (N).
    """
    low = -setting.scene.vehicle.rolling_radius
    setting, force = with_forces(setting, body, [[0.0, AXLE_BOX, low], [0.0, -AXLE_BOX, low]])

    def change(t, _):
        force[:, 0] = np.array([-turn, turn]) * min(1.0, 2.0 * t / settle)
        force[:, 1] = 0.5 * min(largest, rate * max(0.0, t - settle))

    return setting, run_in_parts(setting, settle + largest / rate, RATE, PART, change)


def flange_history(setting, trajectory, body):
    """Return the history of a pushed wheelset and its left wheel, arrays (n,) by name.

    They are t_s, y_m, yaw_rad, Y_over_Q (sliding mean over 2 m; NaN where the wheel is almost unloaded), patches
    (number) and contact_angle_rad (maximum).
    """
    k = int(np.flatnonzero(setting.model.bodies.wheelsets == body)[0])
    patches = contacts(setting.model, trajectory.t, trajectory.states)[:, k, 0]
    vertical, lateral = wheel_forces(patches)
    width = max(1, round(SLIDING_MEAN / setting.model.speed * RATE))
    kernel = np.ones(width) / width
    count = np.convolve(np.ones(len(vertical)), kernel, "same")
    mean_q, mean_y = (np.convolve(force, kernel, "same") / count for force in (vertical, lateral))
    loaded = mean_q > 0.1 * mean_q[0]
    ratio = np.divide(mean_y, mean_q, out=np.full(len(mean_q), np.nan), where=loaded)
    part = trajectory.states[:, STATE_SIZE * body : STATE_SIZE * (body + 1)]
    e0, e1, e2, e3 = part[:, 3:7].T
    yaw = np.arctan2(2.0 * (e0 * e3 - e1 * e2), 1.0 - 2.0 * (e1**2 + e3**2))
    return {
        "t_s": trajectory.t, "y_m": part[:, 1], "yaw_rad": yaw, "Y_over_Q": ratio,
        "patches": np.sum(np.isfinite(patches[..., reduction.NORMAL]), axis=1),
        "contact_angle_rad": np.nanmax(np.abs(patches[..., reduction.ANGLE]), axis=1, initial=0.0),
    }  # fmt: skip


def climbing(history):
    """Return the maximum Y/Q (mean over 2 m) until the last time at which the displacement is below 8 mm.

    Beyond 8 mm the wheelset has climbed, because the flange ends there.
    """
    on_flange = history["y_m"] < 0.008
    last = np.flatnonzero(on_flange)[-1] + 1
    return float(np.nanmax(history["Y_over_Q"][:last], initial=0.0))


def _recognised(setting, trajectory):
    """Return the checks of a derailment: lateral positions of the wheelsets at the end of the run."""
    places = trajectory.states[:, 1 : STATE_SIZE * len(setting.model.bodies.mass) : STATE_SIZE]
    places = np.abs(places[:, setting.model.bodies.wheelsets])
    return [
        Check("farthest wheelset but for the last state", float(np.max(places[:-1])), DERAILED_Y, "m", "DERAILED_Y"),
        Check(
            "farthest wheelset in the last state", float(np.max(places[-1])), ON_THE_TIP, "m", "tip on the rail", True
        ),
    ]


def derailments(vehicles, speeds, detections, methods, pushes):
    """Push the first wheelset of vehicles over the rail at several speeds (m/s); return rows of the table.

    For each vehicle, ``pushes`` contains the ``largest`` force (N) and the ``rate`` (N/s).
    """
    found = []
    for name, speed, detection, method in product(pushes, speeds, detections, methods):
        changes = {"speed": speed, "contact.detection": detection, "integration.method": method, "initial.y": 0.0}
        setting = prepare(vehicles, name, changes)
        body = int(setting.model.bodies.wheelsets[0])
        limit = NADAL_FLOOR * nadal_limit(setting.model.contact.friction, flange_angle(setting.scene))
        setting, trajectory = pushed(setting, body, 0.0, settle=0.2, **pushes[name])
        ratio = climbing(flange_history(setting, trajectory, body))
        checks = [
            *sound(setting, trajectory),
            *_recognised(setting, trajectory),
            Check("Y/Q before it climbs", ratio, limit, "1", "0.97 of Nadal's limit", least=True),
        ]
        condition = f"{speed:g} m/s"
        found += rows("flange", "pushed until it derails", condition, setting, trajectory, checks, "derailed")
    return found


def nadal(vehicles, name, speed, frictions, detections, turn, push):
    """Compute Y/Q at which a wheelset with a large angle of attack climbs, over the coefficient of friction.

    The speed is in m/s, and ``turn`` (N) is that of :func:`pushed`. The ``push`` has the ``largest`` force (N) and the
    ``rate`` (N/s). Returns rows of the table, and curve of Y_over_Q, nadal, and yaw_rad at climbing.
    """
    found, curve = [], []
    for detection, friction in product(detections, frictions):
        changes = {"speed": speed, "contact.detection": detection, "contact.friction": friction, "initial.y": 0.0}
        setting = prepare(vehicles, name, changes)
        limit = nadal_limit(friction, flange_angle(setting.scene))
        setting, trajectory = pushed(setting, 0, turn, settle=1.0, **push)
        history = flange_history(setting, trajectory, 0)
        ratio, two = climbing(history), int(np.max(history["patches"]))
        yaw = float(history["yaw_rad"][np.flatnonzero(history["y_m"] < 0.008)[-1]])
        label = {"detection": detection, "friction": friction}
        curve.append(label | {"Y_over_Q": ratio, "nadal": limit, "yaw_rad": yaw})
        checks = [
            *sound(setting, trajectory),
            *_recognised(setting, trajectory),
            Check("patches at once", two, 2, "1", "tread and flange carry together before it climbs", least=True),
            Check("Y/Q before it climbs", ratio, NADAL_FLOOR * limit, "1", "0.97 of Nadal's limit", least=True),
            Check("Y/Q before it climbs", ratio, NADAL_CEILING * limit, "1", "1.15 of Nadal's limit",
                  known_limit=PLANAR_LIMIT if detection == "planar" else ""),
        ]  # fmt: skip
        found += rows("flange", "Nadal's limit", f"friction {friction:g}", setting, trajectory, checks, "derailed")
    return found, curve
