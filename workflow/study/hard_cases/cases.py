"""Common parts of the hard cases: preparation of a vehicle, simulation, invariants, and rows of the table.

A case simulates one vehicle with one detection and one integrator, and checks invariants. Each invariant is a number
with a limit that follows from mechanics, from the law in use or from the integrator's tolerance. The table contains the
source of the limit. The families of cases are the other modules of this package.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from scipy.integrate import simpson

from study.creep_table import with_creep_table
from wrcore.bodies.body import STATE_SIZE
from wrcore.bodies.marker import FRAME
from wrcore.contact.search import reduction
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.outputs import evaluations_at
from wrcore.errors import InputError
from wrcore.integrate.integrator import integrate
from wrcore.run.simulate import output_times
from wrcore.run.simulation import DERAILED_Y
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

COLUMNS = (
    "family", "case", "condition", "vehicle", "detection", "integrator", "outcome", "status", "reason", "simulated_s",
    "steps", "rejected", "collapses", "smallest_step_s", "wall_s", "out_of_range", "invariant", "value", "unit",
    "relation", "limit", "source", "passed", "known_limit",
)  # fmt: skip
"""Columns of the table of hard cases."""

NORM_LIMIT = 1e-6
"""Maximum deviation of the norm of Euler parameters from 1. The error of a rotation is then a hundredth of the scenes'
relative tolerance of 1e-4."""


@dataclass(frozen=True)
class Check:
    """One invariant of a case.

    ``limit`` is the maximum value that passes (the minimum if ``least``), and ``source`` is the origin of the limit.
    ``known_limit`` is the reason for which the models in use cannot pass, if it is known.
    """

    invariant: str
    value: float
    limit: float
    unit: str
    source: str
    least: bool = False
    known_limit: str = ""

    @property
    def passed(self):
        """Whether the value is within the limit; False for NaN."""
        return bool(self.value >= self.limit if self.least else self.value <= self.limit)


@dataclass(frozen=True)
class Setting:
    """A vehicle that is ready to run from ``state``.

    Arrays of the model may be changed between parts of a run. ``label`` has the columns vehicle, detection and
    integrator of the table.
    """

    scene: object
    model: object
    state: np.ndarray
    label: dict

    @property
    def control(self):
        """Return the keyword arguments for `integrate`."""
        chosen = self.scene.data["integration"]
        names = ("method", "rtol", "atol", "step", "longest_step")
        return {name: chosen[name] for name in names} | {"derailed_y": DERAILED_Y}


def prepare(vehicles, name, changes=(), **parts):
    """Return a vehicle of the study as a `Setting`, with further changes to the scene.

    For each name, ``vehicles`` contains ``scene``, ``set`` (changes to the scene) and ``table`` (path of a creep table;
    the default one if omitted). ``parts`` are attributes of the scene to be replaced, such as ``wheel`` or ``track``.
    """
    entry = vehicles[name]
    chosen = {**entry.get("set", {}), **dict(changes)}
    overrides = [f"{key}={value}" for key, value in chosen.items()]
    if "table" in entry:
        overrides = with_creep_table(entry["scene"], overrides, entry["table"])
    scene = load_scene(entry["scene"], overrides)
    scene = replace(scene, **parts) if parts else scene
    model, state = compile_scene(scene)
    label = {"vehicle": name, "detection": scene.detection, "integrator": scene.data["integration"]["method"]}
    return Setting(scene, model, state, label)


def with_forces(setting, body, markers):
    """Return a copy of a setting with constant forces on one body, and a view (n, 3) of these forces.

    Forces act at the markers (n, 3), relative to the body's centre (m). They are in N along the axes of the moving
    frame, and zero until the caller sets them.
    """
    elements, markers = setting.model.elements, np.atleast_2d(np.asarray(markers, float))
    rows = np.zeros((len(markers), elements.springs.shape[1]))
    rows[:, :3] = markers
    first = len(elements.springs)
    elements = elements._replace(
        pairs=np.vstack([elements.pairs, [[body, FRAME]]]), offset=np.append(elements.offset, setting.state[0] * 0.0),
        turning=np.concatenate([elements.turning, np.zeros((1, 3, 3))]),
        springs=np.vstack([elements.springs, rows]),
        first_spring=np.append(elements.first_spring, first + len(markers)),
        first_directed=np.append(elements.first_directed, elements.first_directed[-1]),
    )  # fmt: skip
    return replace(setting, model=setting.model._replace(elements=elements)), elements.springs[first:, 12:15]


def run(setting, duration, rate=200.0, begin=0.0, **control):
    """Integrate a setting; keyword arguments replace those of `Setting.control`."""
    times = output_times(begin, duration, rate)
    return integrate(setting.model, setting.state, times, **{**setting.control, **control})


def run_in_parts(setting, duration, rate, part, change, **control):
    """Integrate for a duration (s) at an output rate (1/s) in successive parts of ``part`` seconds.

    Before each part ``change`` is called with time and state. It may change the model's arrays, and it ends the run if
    it returns True.
    """
    done, at, state = [], 0.0, setting.state
    for index in range(math.ceil(duration / part - 1e-9)):
        if change(at, state):
            break
        done.append(run(replace(setting, state=state), part, rate, at, **control))
        if done[-1].status != "completed":
            break
        at, state = (index + 1) * part, done[-1].states[-1]
    return joined(done)


def joined(parts):
    """Join successive trajectories to one."""
    counted = (
        "steps", "rejected", "rhs_evaluations", "jacobians", "factorisations", "out_of_range", "wall_s", "collapses",
    )  # fmt: skip
    starts = [1 if index else 0 for index in range(len(parts))]
    return replace(
        parts[-1],
        t=np.concatenate([part.t[start:] for part, start in zip(parts, starts, strict=True)]),
        states=np.concatenate([part.states[start:] for part, start in zip(parts, starts, strict=True)]),
        smallest_step=float(np.nanmin([part.smallest_step for part in parts])),
        **{name: sum(getattr(part, name) for part in parts) for name in counted},
    )


def contacts(model, times, states):
    """Return the contact patches of all wheels along a trajectory; NaN for absent patches.

    The shape is (n, wheelsets, 2, MAX_PATCHES, PATCH_COLUMNS).
    """
    shape = (len(times), len(model.bodies.wheelsets), 2, reduction.MAX_PATCHES, reduction.PATCH_COLUMNS)
    patches, bounds, rates = np.full(shape, np.nan), np.full(shape[:3], np.nan), np.empty(states.shape)
    states = np.ascontiguousarray(states)
    evaluations_at(times, states, *Equations(model).arguments, rates, patches, bounds)
    return patches


def wheel_forces(patches):
    """Return the force of each wheel on its rail, vertical (downwards) and lateral (to the left).

    Both have the shape (n, wheelsets, 2) and the unit N.
    """
    normal, lateral, angle = (patches[..., k] for k in (reduction.NORMAL, reduction.FY, reduction.ANGLE))
    vertical = np.nansum(normal * np.cos(angle) + lateral * np.sin(angle), axis=-1)
    return vertical, -np.nansum(lateral * np.cos(angle) - normal * np.sin(angle), axis=-1)


def impulse_error(setting, trajectory, patches):
    """Return the error of the vertical momentum balance over a trajectory, relative to the impulse of the load.

    The error is the impulse of the rails minus that of the load and minus the momentum gained by all bodies. The load
    is the weight plus the preloads of elements to the moving frame, which have no vertical stiffness. ``patches`` are
    from :func:`contacts`; the sampling must resolve the forces.
    """
    bodies, elements = setting.model.bodies, setting.model.elements
    preloads = [
        elements.springs[first:last, 14].sum()
        for (_, second), first, last in zip(
            elements.pairs, elements.first_spring[:-1], elements.first_spring[1:], strict=True
        )
        if second == FRAME
    ]
    load = (np.sum(bodies.mass) * setting.model.gravity - sum(preloads)) * (trajectory.t[-1] - trajectory.t[0])
    given = simpson(np.sum(wheel_forces(patches)[0], axis=(1, 2)), x=trajectory.t)
    rise = trajectory.states[[0, -1], 9 : STATE_SIZE * len(bodies.mass) : STATE_SIZE]
    return float(abs(given - load - np.diff(rise @ bodies.mass)[0]) / load)


def sound(setting, trajectory):
    """Return the checks for every run: finite states, no tensile normal force, Euler parameters with norm 1."""
    states = trajectory.states[:, : STATE_SIZE * len(setting.model.bodies.mass)]
    parameters = states.reshape(len(states), -1, STATE_SIZE)[:, :, 3:7]
    patches = contacts(setting.model, trajectory.t, trajectory.states)
    least = np.nanmin(patches[..., reduction.NORMAL], initial=np.inf)
    broken = float(np.sum(~np.isfinite(trajectory.states)) + (least < 0.0) * 1.0)
    norm = float(np.max(np.abs(np.linalg.norm(parameters, axis=2) - 1.0)))
    return [
        Check("states that are no numbers, wheels under tension", broken, 0.0, "1", "Eq. (7) never pulls"),
        Check("Euler parameters' norm less 1", norm, NORM_LIMIT, "1", "a hundredth of rtol = 1e-4"),
    ]


def rows(family, case, condition, setting, trajectory, checks, expected="completed", known_limit=""):
    """Return the rows of the table for one run, one per check.

    ``expected`` is a status that is accepted as survived, in addition to "completed". ``known_limit`` is a reason for
    which a run may end otherwise.
    """
    used = trajectory.method
    label = setting.label | {"integrator": used if setting.control["step"] == 0.0 else f"{used}, fixed step"}
    outcome = "survived" if trajectory.status in ("completed", expected) else "failed"
    cost = {
        "outcome": outcome, "status": trajectory.status, "reason": trajectory.reason,
        "simulated_s": float(trajectory.t[-1] - trajectory.t[0]) if len(trajectory.t) else 0.0,
        "steps": trajectory.steps, "rejected": trajectory.rejected, "collapses": trajectory.collapses,
        "smallest_step_s": trajectory.smallest_step, "wall_s": trajectory.wall_s,
        "out_of_range": trajectory.out_of_range,
    }  # fmt: skip
    finished = Check(
        "ends as expected",
        float(trajectory.status != expected),
        0.0,
        "1",
        f"expected: {expected}",
        known_limit=known_limit,
    )
    return [_row(family, case, condition, label | cost, check) for check in (finished, *checks)]


def computed(family, case, condition, label, checks, wall=np.nan):
    """Return the rows for a case without time integration, such as a sweep of positions."""
    cost = {"outcome": "survived", "status": "completed", "reason": "", "wall_s": wall}
    return [_row(family, case, condition, label | cost, check) for check in checks]


def refused(family, case, condition, label, attempt):
    """Return the row for a case that must be refused; the case passes if ``attempt()`` raises InputError."""
    try:
        attempt()
        cost = {"outcome": "failed", "status": "accepted", "reason": "expected a refusal"}
    except InputError as error:
        cost = {"outcome": "refused", "status": "refused", "reason": str(error)}
    check = Check("lines of the refusal", float(len(cost["reason"].splitlines())), 1.0, "1", "one line that names why")
    kept = _row(family, case, condition, label | cost, check)
    return [kept | {"passed": kept["passed"] and cost["outcome"] == "refused"}]


def _row(family, case, condition, known, check):
    verdict = {
        "invariant": check.invariant, "value": check.value, "unit": check.unit,
        "relation": ">=" if check.least else "<=", "limit": check.limit, "source": check.source,
        "passed": check.passed, "known_limit": "" if check.passed else check.known_limit,
    }  # fmt: skip
    row = {"family": family, "case": case, "condition": condition, **known, **verdict}
    return {name: row.get(name, np.nan) for name in COLUMNS}


def table(rows_of_cases):
    """Return the table of the study (`COLUMNS`) from the rows of all cases."""
    return pd.DataFrame(rows_of_cases, columns=COLUMNS)
