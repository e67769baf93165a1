"""Section of a report: what a run cost, and limits of the models that it exceeded."""

from __future__ import annotations

import numpy as np

from wrcore.reporting.page import Markup, Row, element, join, paragraph, quantities
from wrcore.reporting.subject import Report, Subject
from wrcore.run.checks.validity import LIMITS, MEANINGS

TITLE = "Cost and range of validity"

COSTS = {
    "wall_s": ("computing time", "of the integration, on the clock of the computer that made the run", "s", 1.0),
    "real_time_ratio": ("real time ratio", "simulated time over computing time", "", 1.0),
    "steps": ("steps", MEANINGS["steps"], "", 1.0),
    "rejected": ("rejected steps", MEANINGS["rejected"], "", 1.0),
    "rhs_evaluations": ("evaluations", MEANINGS["rhs_evaluations"], "", 1.0),
    "jacobians": ("Jacobians", MEANINGS["jacobians"], "", 1.0),
    "smallest_step_s": ("smallest step", "shortest accepted step", "ms", 1e3),
}  # fmt: skip
"""Name, definition, printed unit and factor of each number that a run counts about its cost."""

OF_PATCHES = ("half_space", "conformal", "profile_edge", "hollow_ahead", "not_parabolic")
"""Counters of patches at the output times, which are stated as shares of all patches at these times."""

OTHERS = {
    "patches_outside_training": "patches outside the training of the surrogate",
    "patches_not_tabulated": "patches outside the lookup table, solved directly",
    "patches_on_grid": "patches solved on a uniform grid",
    "patches_on_fixed_strips": "patches solved on fixed strips",
}
"""Further counters that are shown if they are not zero."""


def section(report: Report) -> Markup:
    """Return cost and counters of all runs as tables, and in words which limits were exceeded."""
    rows = []
    for key, (name, definition, unit, factor) in COSTS.items():
        values = [costs(subject).get(key, np.nan) for subject in report.subjects]
        if np.isfinite(values).any():
            rows.append(Row(key, name, definition, unit, factor, values))
    limits = [_row(report, key, name) for key, name in {**LIMITS, **OTHERS}.items()]
    parts = [quantities(rows, report.labels, "cost")] if rows else []
    if any("patches" in subject.run.counters for subject in report.subjects):
        parts += [element("h3", "Range of validity of the contact models"), words(report)]
        parts.append(quantities([row for row in limits if row is not None], report.labels, "limit and definition"))
    return join(parts)


def costs(subject: Subject) -> dict[str, float]:
    """Return the counters of a run about its cost, with the ratio of simulated time to computing time."""
    counters = subject.run.counters
    found = {name: counters[name] for name in COSTS if name in counters}
    if counters.get("wall_s", 0.0) > 0.0:
        found["real_time_ratio"] = counters.get("simulated_s", np.nan) / counters["wall_s"]
    return found


def exceeded(subject: Subject) -> list[str]:
    """Return in words which limits of the models a run exceeded."""
    return [name for key, name in LIMITS.items() if subject.run.counters.get(key)]


def _row(report: Report, key: str, name: str) -> Row | None:
    """Return the row of a counter: a count, or a share of the patches; None if no run has counted anything."""
    counts = [subject.run.counters.get(key, 0) for subject in report.subjects]
    if not any(counts):
        return None
    definition = MEANINGS.get(key, "").replace("`", "").partition(". ")[0]
    if key in OF_PATCHES:
        patches = [max(subject.run.counters.get("patches", 0), 1) for subject in report.subjects]
        shares = [float(count / whole) for count, whole in zip(counts, patches, strict=True)]
        return Row(key, name, f"{definition}; share of the patches at output times", "%", 100.0, shares)
    return Row(key, name, f"{definition}; count", "", 1.0, counts)


def words(report: Report) -> Markup:
    """Return a sentence for each run: which limits of the models it exceeded, with the share of its patches."""
    items = []
    for subject in report.subjects:
        counters = subject.run.counters
        patches = counters.get("patches", 0)
        texts = []
        for key, name in LIMITS.items():
            if count := counters.get(key, 0):
                share = f" ({100.0 * count / patches:.2g} % of the patches)" if key in OF_PATCHES and patches else ""
                texts.append(f"{count:g} {name}{share}")
        who = f"{subject.label}: " if report.several else ""
        if texts:
            counted = f"of {patches:g} patches at output times, the run counted {', '.join(texts)}."
            items.append(element("li", who, counted, class_="flag"))
        else:
            items.append(
                element("li", who, f"no limit of the models was exceeded in {patches:g} patches at output times.")
            )
    return element("ul", *items) if items else paragraph("")
