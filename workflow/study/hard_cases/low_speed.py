"""Hard cases at low speed: creepages and the stiffness of the equations of motion grow in proportion to 1/V."""

from itertools import product

import numpy as np

from study.hard_cases.cases import Check, contacts, prepare, rows, run, run_in_parts, sound, with_forces
from wrcore.analysis.stability.stability import straight_ahead
from wrcore.balance.linear import steady_running
from wrcore.bodies.body import STATE_SIZE, matrix_of
from wrcore.bodies.marker import FRAME
from wrcore.contact.search import reduction

DETECTIONS = ("planar", "spatial")

STEPS_PER_TIME_SCALE = 20.0
"""Maximum number of steps in the fastest time scale of the linearised motion. ROS34PW2 needs most, because its
optimistic error estimate is limited to a tenth of the tolerance."""

ROLLING_ERROR = 1e-3
"""Maximum share of slip in the speed lost by braking. The force that decelerates the rotation of the wheels needs much
smaller creepages."""


def fastest_time_scale(setting):
    """Return 1/|lambda| (s) of the fastest mode of small motion about steady running."""
    motion = steady_running(*straight_ahead(setting.scene))
    return 1.0 / float(np.max(np.abs(np.linalg.eigvals(motion.matrix))))


def ladder(vehicles, speeds, methods, duration):
    """Release vehicles off the centre for a duration (s) at decreasing speeds (m/s); return rows of the table.

    ``methods`` contains the lowest speed (m/s) of each integrator. Motions must stay bounded, and steps must not
    collapse.
    """
    found = []
    for name, detection, speed, method in product(vehicles, DETECTIONS, speeds, methods):
        if speed < methods[method]:
            continue
        changes = {"speed": speed, "contact.detection": detection, "integration.method": method}
        setting = prepare(vehicles, name, changes)
        trajectory = run(setting, duration)
        step, scale = trajectory.smallest_step, fastest_time_scale(setting)
        source = "a twentieth of the linearised motion's fastest time scale"
        checks = [
            *sound(setting, trajectory),
            Check("smallest step", step, scale / STEPS_PER_TIME_SCALE, "s", source, least=True),
        ]
        found += rows("low speed", "released", f"{speed:g} m/s", setting, trajectory, checks)
    return found


def slow_path(vehicles, name, speeds, distance, critical_speed):
    """Compare the paths of a suspended wheelset over a distance (m) at decreasing speeds (m/s).

    Forces of springs and rolling depend only on the distance. Inertia forces are proportional to V^2 and reach the size
    of the others at the critical speed (m/s). At low speeds the path therefore equals that at the lowest speed. Returns
    rows of the table.
    """
    found = []
    for detection in DETECTIONS:
        settings = [prepare(vehicles, name, {"speed": speed, "contact.detection": detection}) for speed in speeds]
        runs = [run(s, distance / v, rate=50.0 * v / distance) for s, v in zip(settings, speeds, strict=True)]
        slowest = runs[-1].states[:, 1]
        for speed, setting, trajectory in zip(speeds, settings, runs, strict=True):
            y = trajectory.states[:, 1]
            gap = np.max(np.abs(y - slowest)) / abs(y[0]) if len(y) == len(slowest) else np.nan
            limit = (speed / critical_speed) ** 2 + setting.control["rtol"]
            checks = [
                *sound(setting, trajectory),
                Check("path off that at the lowest speed, of y(0)", gap, limit, "1", "(V/V_critical)^2 + rtol"),
            ]
            found += rows("low speed", "same path at all speeds", f"{speed:g} m/s", setting, trajectory, checks)
    return found


def regularisation(vehicles, name, speeds, least_speeds, distance):
    """Measure the influence of the minimum speed by which creepages are divided, over a distance (m).

    ``least_speeds`` are values of ``contact.creep.least_speed`` (m/s). The first value is below all ``speeds`` (m/s)
    and is the reference. Returns rows of the table, and curve of y_off_m (maximum deviation from the reference).
    """
    found, curve, reference = [], [], {}
    for speed, least in product(speeds, least_speeds):
        setting = prepare(vehicles, name, {"speed": speed, "contact.creep.least_speed": least})
        trajectory = run(setting, distance / speed, rate=50.0 * speed / distance)
        y = trajectory.states[:, STATE_SIZE * int(setting.model.bodies.wheelsets[0]) + 1]
        off = float(np.max(np.abs(y - reference.setdefault(speed, y))))
        curve.append({"vehicle": name, "speed_m_per_s": speed, "least_speed_m_per_s": least, "y_off_m": off})
        limit = setting.control["rtol"] * abs(y[0]) if least < speed else np.inf
        source = "creepages are the same: rtol y(0)" if least < speed else "measured, not limited"
        influence = Check("y off that with the smallest least_speed", off, limit, "m", source)
        condition = f"{speed:g} m/s, least_speed {least:g} m/s"
        checks = [*sound(setting, trajectory), influence]
        found += rows("low speed", "regularisation", condition, setting, trajectory, checks)
    return found, curve


def _let_go(setting):
    """Remove the longitudinal coupling of a vehicle to the moving frame; other couplings stay."""
    elements = setting.model.elements
    for pair in np.flatnonzero(elements.pairs[:, 1] == FRAME):
        own = slice(elements.first_spring[pair], elements.first_spring[pair + 1])
        elements.springs[own, [6]] = elements.springs[own, [9]] = 0.0


def rolling_momentum(setting, states):
    """Return the longitudinal momentum plus the wheelsets' angular momentum over the rolling radius, kg m/s, (n,)."""
    bodies, total = setting.model.bodies, 0.0
    for body, mass in enumerate(bodies.mass):
        part = states[:, STATE_SIZE * body : STATE_SIZE * (body + 1)]
        total = total + mass * part[:, 7]
        if bodies.spins[body]:
            axles = np.array([matrix_of(row[3:7])[:, 1] for row in part])
            spin = np.sum(axles * part[:, 10:13], axis=1)
            total = total + bodies.inertia[body, 1] * spin / setting.scene.vehicle.rolling_radius
    return total


def largest_drag(setting):
    """Return an upper bound of the drag by spin creep: the sum of mu N c sin(contact angle)/r over all wheels, N."""
    patches = contacts(setting.model, np.zeros(1), setting.state[None, :])
    size = np.sqrt(patches[..., reduction.SEMI_A] * patches[..., reduction.SEMI_B])
    moment = patches[..., reduction.NORMAL] * size * np.abs(np.sin(patches[..., reduction.ANGLE]))
    return float(setting.model.contact.friction * np.nansum(moment) / setting.scene.vehicle.rolling_radius)


def braking(vehicles, speed, deceleration, rest, least_speeds):
    """Brake vehicles with a constant force to standstill; then they must stand still for ``rest`` (s).

    The initial speed is in m/s, the deceleration in m/s^2. Returns rows of the table, and curve of v_m_per_s over t_s
    for each ``contact.creep.least_speed`` (m/s).

    The moving frame has constant speed. Therefore the vehicle is uncoupled from it along the track, and the force acts
    on the heaviest body. For rolling wheels the momentum, with spin, is m v + J omega/r = P0 - F t.
    """
    found, curves = [], []
    for name, detection, least in product(vehicles, DETECTIONS, least_speeds):
        changes = {"speed": speed, "contact.detection": detection, "contact.creep.least_speed": least}
        setting = prepare(vehicles, name, {**changes, "initial.y": 0.001})
        body = int(np.argmax(setting.model.bodies.mass))
        setting, force = with_forces(setting, body, np.zeros(3))
        _let_go(setting)
        start, stop = rolling_momentum(setting, setting.state[None, :])[0], speed / deceleration
        force[0, 0] = -start / stop
        trajectory = _stopped(setting, force, stop, rest)
        momentum = rolling_momentum(setting, trajectory.states)
        error = np.max(np.abs(momentum - start * np.clip(1.0 - trajectory.t / stop, 0.0, None))) / start
        rolling = Check(
            "momentum off P0 - F t, then 0, of P0", float(error), ROLLING_ERROR + largest_drag(setting) * stop / start,
            "1", "rolling without slip; spin moments below mu N c turn against it",
        )  # fmt: skip
        condition = f"{speed:g} m/s to 0 at {deceleration:g} m/s^2, least_speed {least:g} m/s"
        checks = [*sound(setting, trajectory), rolling]
        found += rows("low speed", "braking to standstill", condition, setting, trajectory, checks)
        label = {"vehicle": name, "detection": detection, "least_speed_m_per_s": least}
        speeds = trajectory.states[:, STATE_SIZE * body + 7]
        curves += [label | {"t_s": t, "v_m_per_s": v} for t, v in zip(trajectory.t, speeds, strict=True)]
    return found, curves


def _stopped(setting, force, stop, rest):
    """Return the trajectory under a force that ends at the time ``stop`` (s), and for ``rest`` (s) after it."""

    def change(t, _):
        force[:] *= t < stop - 1e-9

    return run_in_parts(setting, stop + rest, 100.0, stop, change)
