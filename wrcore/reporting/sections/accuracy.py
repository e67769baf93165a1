"""Section of a report: how accurate a run is.

The integration error is the difference from the beginning of the run, integrated again with a smaller tolerance. The
error of the contact model is relative to exact contact, for motions of the same stretch.
"""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from wrcore.analysis.contact.errors_in_run import contact_errors
from wrcore.analysis.contact.in_run import check_laws, check_same_everywhere
from wrcore.analysis.to_accuracy import difference
from wrcore.errors import InputError
from wrcore.errors.input_files import digest_of_all
from wrcore.errors.messages import warnings_suppressed
from wrcore.reporting.page import Markup, Row, element, join, number, paragraph, quantities, table
from wrcore.reporting.subject import Report, Subject
from wrcore.run.checks.validity import LOOK_UP_ERRORS, MEANINGS
from wrcore.run.output.compute import ON_RAIL
from wrcore.run.output.run import Run
from wrcore.run.simulate import simulate
from wrcore.scene.description import Scene

TITLE = "Accuracy"

STRETCH, BUDGET = 2.0, 1.5
"""Longest stretch that is integrated again, s, and the computing time it may take, estimated from the run's, s."""

TIGHTER, COST = 1e-2, 3.0
"""Factor on the tolerance of the run, and the factor on computing time that it costs at most (order 4 or 5)."""

TIMES = 20
"""Number of output times at which contact is compared with exact contact."""

QUANTITIES = {
    "y": ("lateral position y of wheelsets", "µm", 1e6), "Q": ("vertical force Q of wheels", "N", 1.0),
    "Y": ("lateral force Y of wheels", "N", 1.0),
}  # fmt: skip
"""Name, printed unit and factor of each quantity whose integration error is estimated."""

ERRORS = {
    "N_error": ("normal force N", "relative to N"),
    "creep_force_error": ("creep force", "relative to friction limit μN"),
    "p_max_error": ("maximum pressure", "relative to exact pressure"),
    "contact_angle_error_rad": ("contact angle", "rad"),
}  # fmt: skip
"""Name and reference of each error of the contact model."""


class Again(NamedTuple):
    """The beginning of a run, integrated again."""

    scene: Scene
    run: Run
    rtol: float
    """Relative tolerance, or the step (s) of a run with fixed steps."""
    errors: dict[str, tuple[float, float]]
    """Root mean square of the difference of each quantity, and of the quantity itself, in SI units."""


def section(report: Report) -> Markup:
    """Return integration error and errors of the contact model of all runs for which they can be estimated."""
    stated = _stated(report)
    if not report.accuracy:
        return stated
    agains = {subject.label: again for subject, again in report.each("Integration error", integrated_again)}
    parts = [_integration(report, agains)] if agains else []
    errors = [
        (subject, found) for subject, found in
        report.each("Errors of the contact model", lambda s: errors_of_contact(s, agains.get(s.label)))
    ]  # fmt: skip
    parts += [_contact(report, errors)] if errors else []
    return join([*parts, stated])


def integrated_again(subject: Subject) -> Again:
    """Integrate the beginning of a run again with a smaller tolerance, and estimate the error of the run.

    InputError if the scene of the run is not complete, or may not be run.
    """
    run = subject.run
    scene = subject.scene
    if digest_of_all(scene.files) != run.settings.get("files_sha256", ""):
        raise InputError("report", "scene", "expected the files of the run, but some hold something else now")
    check_laws(run, scene, "report")
    if run.t[0] != 0.0 or len(run.t) < 3:
        raise InputError("report", "run", "expected a run that begins at 0 s, with at least three output times")
    wall, simulated = run.counters.get("wall_s", 0.0), float(run.t[-1])
    stretch = min(STRETCH, simulated)
    if wall > 0.0:
        stretch = min(stretch, BUDGET / COST / wall * simulated)
    last = int(np.searchsorted(run.t, stretch, side="right")) - 1
    stretch = float(run.t[max(last, 2)])
    data = copy.deepcopy(scene.data)
    integration = data["integration"]
    method = str(run.settings.get("method_used", integration["method"]))
    integration |= {"duration": stretch, "method": integration["method"] if "," in method else method}
    if integration.get("step"):
        integration["step"] *= 0.5
    else:
        integration["rtol"] *= TIGHTER
        integration["atol"] *= TIGHTER
    wanted = ["pose", "velocity", "contact", "wheel_motion"]
    data["output"]["channels"] = wanted
    tighter = replace(scene, data=data)
    with warnings_suppressed():
        again = simulate(tighter, progress=False)
    errors = {of: _error(run, again, of) for of in QUANTITIES}
    if not all(np.isfinite(first) for first, _ in errors.values()):
        raise InputError("report", "run", "expected pose and contact among the output channels")
    return Again(tighter, again, integration.get("step") or integration["rtol"], errors)


def _error(run: Run, again: Run, of: str) -> tuple[float, float]:
    """Return the root mean square of the difference of both runs in a quantity, and of the quantity."""
    count = min(len(run.t), len(again.t))
    if not np.allclose(run.t[:count], again.t[:count], rtol=0.0, atol=1e-9):
        raise InputError("report", "run", "expected output times at the rate of the scene")
    channel = {"y": "y_m", "Q": "Q_N", "Y": "Y_N"}[of]
    groups = [name for name in run.groups if ("/" in name) == (of != "y") and run[name].follows(channel)]
    groups = [name for name in groups if of != "y" or f"{name}/left" in run.groups]
    size = float(np.sqrt(np.mean([np.nanmean(again[name][channel] ** 2) for name in groups]))) if groups else np.nan
    return difference(run, again, of), size


def _integration(report: Report, agains: dict[str, Again]) -> Markup:
    rows = []
    for of, (name, unit, factor) in QUANTITIES.items():
        found = [agains[label].errors[of] if label in agains else (np.nan, np.nan) for label in report.labels]
        rows.append(
            Row(f"integration_{of}", name, "root mean square of the difference", unit, factor, [e for e, _ in found])
        )
        shares = [error / size if size > 0.0 else np.nan for error, size in found]
        rows.append(
            Row(f"integration_{of}_share", name, "relative to the root mean square of the quantity", "%", 100.0, shares)
        )
    stretches = [float(agains[label].run.t[-1]) if label in agains else np.nan for label in report.labels]
    about = "simulated time that was integrated again, from the beginning"
    rows.append(Row("integration_stretch_s", "stretch", about, "s", 1.0, stretches))
    text = (
        "The beginning of the run was integrated again with a tolerance 100 times smaller, or with half the step. The "
    )
    text += "difference is the error of the run there. In motions that amplify every difference it grows with time."
    return join([element("h3", "Integration error"), paragraph(text), quantities(rows, report.labels, "error")])


def errors_of_contact(subject: Subject, again: Again | None) -> pd.DataFrame:
    """Return :func:`wrcore.contact_errors` at `TIMES` output times.

    The motions are those of the run if it has the channels ``wheel_motion``, else those of the stretch that was
    integrated again.
    """
    run, scene = subject.run, subject.scene
    if run.scene["contact"]["patch"] == "exact":
        raise InputError("report", "run", "the run has exact contact, which is the reference")
    check_same_everywhere(scene, "report", "run")
    wheel = run.groups.get(f"{subject.wheelsets[0]}/left", {}) if subject.wheelsets else {}
    if not set(ON_RAIL) <= wheel.keys():
        if again is None:
            raise InputError(
                "report", "run", "expected wheel_motion among the output channels, or a scene that may be run"
            )
        run, scene = again.run, again.scene
    return contact_errors(run, TIMES, scene, subject.trust)


def _contact(report: Report, found: list[tuple[Subject, pd.DataFrame]]) -> Markup:
    tables = []
    for subject, errors in found:
        rows = [
            [join([name, element("small", f", {reference}")]), *_percentiles(errors[key])]
            for key, (name, reference) in ERRORS.items()
        ]
        times = errors["t_s"].nunique()
        title = f"{subject.data['contact']['patch']} against exact contact, {len(errors)} wheels at {times} "
        title += f"time{'s' if times > 1 else ''}{', ' + subject.label if report.several else ''}"
        tables.append(element("div", table(["absolute error of", "median", "95 %", "maximum"], rows, title),
                              data_row="contact_errors"))  # fmt: skip
    text = (
        "Contact was evaluated with the model of the run and with exact contact, for the same motions of the wheels. "
    )
    text += "Errors are those of the patch with the largest normal force."
    return join([element("h3", "Errors of the contact model"), paragraph(text), *tables])


def _percentiles(errors: pd.Series) -> list[Markup]:
    return [number(float(np.percentile(errors.abs(), percent))) for percent in (50.0, 95.0, 100.0)]


def _stated(report: Report) -> Markup:
    """Return the errors that the runs state themselves: of a lookup table, and of a required accuracy."""
    rows = []
    for key in LOOK_UP_ERRORS:
        values = [float(s.run.counters.get(key, np.nan)) for s in report.subjects]
        if np.isfinite(values).any():
            name = MEANINGS[key].partition(" in ")[0]
            rows.append(Row(key, name, "in the cells of the table that the run used", "%", 100.0, values))
    for subject in report.subjects:
        of, error = subject.run.settings.get("accuracy_of"), subject.run.settings.get("accuracy_found")
        if isinstance(of, str) and isinstance(error, int | float):
            values = [float(error) if s is subject else np.nan for s in report.subjects]
            rows.append(
                Row("accuracy_found", f"error of {of}", "estimated by wrcore simulate --accuracy", "SI", 1.0, values)
            )
    return (
        join([element("h3", "Errors that the run states"), quantities(rows, report.labels, "error")])
        if rows
        else Markup("")
    )
