"""Speed against error: run and time every modelling and integration choice on a scene; compare with a reference.

The reference runs use spatial detection, the moment reduction and the finest creep table at the tightest tolerance.
Two independent integrators compute them; their difference estimates the error of the reference.
"""

import dataclasses
from itertools import product
from typing import NamedTuple

import numpy as np
import pandas as pd

from wrcore.analysis.assessment.wheels import creep_power, wear_number, wheel_forces, wheelsets_of
from wrcore.contact.search.reduction import REDUCTIONS
from wrcore.creep.table import DEFAULT_TOLERANCE
from wrcore.errors import InputError
from wrcore.run.motion import amplitude, hunting_frequency
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene

SIDES = ("left", "right")


class Choice(NamedTuple):
    """Contact, creep and integration settings of one run of a scene."""

    detection: str
    patch: str
    creep: str
    """Name of the creep law; for a table, followed by its 99 % error tolerance: ``table 0.01``."""
    method: str
    rtol: float

    def overrides(self):
        """Return these settings as changes to a scene for :func:`wrcore.load_scene`."""
        law, _, tolerance = self.creep.partition(" ")
        changes = [
            f"contact.detection={self.detection}",
            f"contact.patch={self.patch}",
            f"contact.creep.model={law}",
            f"integration.method={self.method}",
            f"integration.rtol={self.rtol:g}",
            "integration.atol=0",
        ]
        if self.patch not in REDUCTIONS:
            if law != "table" or (tolerance and float(tolerance) != DEFAULT_TOLERANCE):
                expected = f"expected table {DEFAULT_TOLERANCE:g} with patch {self.patch}, which reads no other one"
                raise InputError("accuracy", "grids.creep", f"{expected}, got {self.creep}")
            return changes
        return [*changes, f"contact.creep.tolerance={tolerance}"] if tolerance else changes


def kind_of(scene):
    """Return the kind of a scene: ``vehicle``, ``suspended_wheelset`` or ``free_wheelset``."""
    vehicle = scene.vehicle
    if len(vehicle.body_names) > len(vehicle.wheelset_names):
        return "vehicle"
    return "suspended_wheelset" if len(vehicle.elements.pairs) else "free_wheelset"


def combinations(grids):
    """Return all distinct choices of several grids.

    Each grid is a dict with a list of values for each field of :class:`Choice`.
    """
    found = [Choice(*values) for grid in grids for values in product(*(grid[name] for name in Choice._fields))]
    return list(dict.fromkeys(found))


def run_errors(run, reference, until=np.inf):
    """Return the errors of a run relative to a reference with the same output times, up to ``until`` (s).

    RMS and maximum error of the lateral position (m) cover all wheelsets. RMS errors of Q and Y together (N), of Y (N),
    and of the normal force over its mean cover all wheels. Relative errors: mean wear number and creep power, and
    amplitude and frequency of the leading wheelset over the second half. All are NaN if the run ends too early.
    """
    if run.t[-1] < min(until, reference.t[-1]) - 1e-9:
        return dict.fromkeys(ERRORS, np.nan)  # the run stopped before `until`
    run, reference = (first_samples(r, min(run.t.size, reference.t.size)) for r in (run, reference))
    here = reference.t <= until
    names = wheelsets_of(reference)
    gaps = np.array([(run[name].y_m - reference[name].y_m)[here] for name in names])
    forces, normal, sure_normal = [], [], []
    for name, side in product(names, SIDES):
        forces.append(np.subtract(wheel_forces(run, name, side), wheel_forces(reference, name, side))[:, here])
        for r, found in ((run, normal), (reference, sure_normal)):
            found.append(np.nansum(r[f"{name}/{side}"].N_N, axis=1)[here])
    forces, normal, sure_normal = np.array(forces), np.array(normal), np.array(sure_normal)
    (wear, sure_wear), (power, sure_power) = (
        [np.sum([of(r, name, side)[here] for name, side in product(names, SIDES)]) for r in (run, reference)]
        for of in (wear_number, creep_power)
    )
    late = here & (reference.t >= 0.5 * min(until, reference.t[-1]))
    leading = names[0]
    motion = [(r.t[late], r[leading].y_m[late]) for r in (run, reference)]
    (size, sure_size), (beat, sure_beat) = (
        [amplitude(y) for _, y in motion],
        [hunting_frequency(t, y) for t, y in motion],
    )
    return {
        "y_rms_m": float(np.sqrt(np.mean(gaps**2))),
        "y_max_m": float(np.max(np.abs(gaps))),
        "force_rms_N": float(np.sqrt(np.mean(forces**2))),
        "N_rms_relative": float(np.sqrt(np.mean((normal - sure_normal) ** 2)) / np.mean(sure_normal)),
        "Y_rms_N": float(np.sqrt(np.mean(forces[:, 1] ** 2))),
        "T_gamma_relative": float(abs(wear / sure_wear - 1.0)),
        "creep_power_relative": float(abs(power / sure_power - 1.0)),
        "amplitude_relative": float(abs(size / sure_size - 1.0)),
        "frequency_relative": float(abs(beat / sure_beat - 1.0)),
    }


def first_samples(run, count):
    """Return a run cut to its first ``count`` samples."""
    if run.t.size == count:
        return run
    groups = {name: {key: values[:count] for key, values in group.items()} for name, group in run.groups.items()}
    return dataclasses.replace(run, t=run.t[:count], groups=groups)


ERRORS = (
    "y_rms_m", "y_max_m", "force_rms_N", "N_rms_relative", "Y_rms_N", "T_gamma_relative", "creep_power_relative",
    "amplitude_relative", "frequency_relative",
)  # fmt: skip


SHOWN = ("y_rms_m", "N_rms_relative", "Y_rms_N", "T_gamma_relative")
"""Errors listed separately for integration and model: lateral position, normal force, guiding force, wear number."""


def part_of(errors, of):
    """Return the errors of `SHOWN` with the prefix ``of``: ``integration`` or ``model``."""
    return {f"{of}_{name}": errors[name] for name in SHOWN}


COSTS = ("wall_s", "rhs_evaluations", "steps", "rejected", "jacobians")


def reference_runs(source, overrides, reference):
    """Return the scene, its reference run and a second run with another integration method and tolerance.

    ``reference`` contains creep (as in :class:`Choice`), methods and rtols (two each).
    """
    scenes = [
        load_scene(source, [*overrides, *Choice("spatial", "moment", reference["creep"], method, rtol).overrides()])
        for method, rtol in zip(reference["methods"], reference["rtols"], strict=True)
    ]
    return scenes[0], *map(simulate, scenes)


def reference_row(scene, run, twin, until=np.inf):
    """Return one row with kind, speed and status of a reference run, and differences of its twin from it."""
    facts = {"kind": kind_of(scene), "speed_m_per_s": run.scene["speed"], "status": run.status}
    counters = {
        f"{name}_of_{which}": r.counters[name] for which, r in (("run", run), ("twin", twin)) for name in COSTS[:2]
    }
    return pd.DataFrame([facts | run_errors(twin, run, until) | counters])


def run_choices(source, overrides, choices, reference, until=np.inf, repetitions=1, progress=None, twins=None):
    """Run and time every choice on a scene and compare each with the reference.

    Each timed pass runs all choices in turn, so that a slow moment of the machine affects all of them. Each row
    contains a choice's fields, status, errors relative to the reference up to ``until`` (s), minimum wall time (s), its
    spread (maximum less minimum, over the median), real-time factor and counters. A first run with the lookup table
    of exact contact includes the time to solve its entries.

    ``twins``, tight runs by model (`wrcore.analysis.accuracy.models.twins`), add the errors of the integration relative
    to them. ``progress`` wraps the choices of each pass.
    """
    scenes = {choice: load_scene(source, [*overrides, *choice.overrides()]) for choice in choices}
    rows, times = {}, {choice: [] for choice in choices}
    for repetition in range(repetitions):
        for choice in (progress or iter)(list(choices)):
            run = simulate(scenes[choice])
            times[choice].append(run.counters["wall_s"])
            if repetition == 0:
                costs = {name: run.counters.get(name, 0) for name in COSTS}
                errors = run_errors(run, reference, until)
                twin = None if twins is None else twins[choice[:3]]
                own = {} if twin is None else part_of(run_errors(run, twin, until), "integration")
                rows[choice] = choice._asdict() | {"status": run.status} | errors | own | costs
    for choice, row in rows.items():
        wall = np.array(times[choice])
        row["wall_s"] = float(np.min(wall))
        row["wall_spread"] = float(np.ptp(wall) / np.median(wall))
        row["real_time_factor"] = float(scenes[choice].data["integration"]["duration"]) / row["wall_s"]
    return pd.DataFrame(list(rows.values()))


def pareto_front(table, error="y_rms_m", cost="wall_s"):
    """Return the Pareto front of error and cost: rows in order of rising cost and falling error."""
    usable = table[(table["status"] == "completed") & table[error].notna()].sort_values([cost, error])
    return usable[usable[error] < usable[error].cummin().shift(fill_value=np.inf)]


def recommendations(table, accuracies, error="y_rms_m", cost="wall_s"):
    """Return the cheapest choice of a table of :func:`run_choices` for each accuracy, the maximum accepted error.

    Accuracies have the unit of the column ``error``. Accuracies that no choice reaches have no row.
    """
    front = pareto_front(table, error, cost)
    rows = []
    for accuracy in sorted(accuracies, reverse=True):
        enough = front[front[error] <= accuracy]
        if len(enough):
            rows.append({"accuracy_m": accuracy} | enough.iloc[0].to_dict())
    return pd.DataFrame(rows)


def recommendation_table(tables, accuracies):
    """Return the cheapest choices (:func:`recommendations`) of several scenes for accuracies in m, by title."""
    found = {title: recommendations(table, accuracies) for title, table in tables.items()}
    table = pd.concat([rows.assign(scene=title) for title, rows in found.items()])
    apart = [f"{of}_{name}" for of in ("integration", "model") for name in SHOWN if f"{of}_{name}" in table]
    return table[["scene", "accuracy_m", *Choice._fields, "y_rms_m", "real_time_factor", "rhs_evaluations", *apart]]


def front_table(tables, references):
    """Return the Pareto fronts of scenes, from tables of :func:`run_choices` and :func:`reference_row` by title.

    Columns: kind, speed_m_per_s, the fields of a choice, y_rms_m, N_rms_relative and real_time_factor.
    """
    columns = [*Choice._fields, "y_rms_m", "N_rms_relative", "real_time_factor"]
    parts = [
        pareto_front(table)[columns].assign(**references[title].iloc[0][["kind", "speed_m_per_s"]].to_dict())
        for title, table in tables.items()
    ]
    return pd.concat(parts)[["kind", "speed_m_per_s", *columns]]
