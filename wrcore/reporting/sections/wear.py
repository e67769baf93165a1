"""Section of a report: wear number and creep power of wheels."""

from __future__ import annotations

from wrcore.analysis.assessment.wheels import wear_number, wheel_table
from wrcore.reporting.page import Markup, grid, join, number, paragraph, table
from wrcore.reporting.sections.wheels import legend_of_sides, panel_of_sides
from wrcore.reporting.subject import Report, Subject

TITLE = "Wear number"

COLUMNS = {
    "T_gamma_mean_N": ("Tγ / N", 1.0), "T_gamma_spin_mean_N": ("with spin / N", 1.0),
    "creep_power_mean_W": ("power / W", 1.0),
}  # fmt: skip


def section(report: Report) -> Markup:
    """Return the wear number of wheels over time or distance, and its mean for all wheels of each run."""
    having = [s for s in report.subjects if s.wheelsets and s.run[f"{s.wheelsets[0]}/left"].follows("T_gamma_N")]
    if not having:
        return Markup("")
    parts = [
        panel_of_sides(report, name, "wear number", 1.0, "Tγ / N", lambda s, *wheel: wear_number(s.run, *wheel))
        for name in report.wheelsets
    ]
    tables = []
    for subject, found in report.each("Table of wear numbers", lambda subject: wheel_table(subject.run, report.begin)):
        rows = [
            [f"{row['wheelset'].replace('_', ' ')} {row['side']}",
             *(number(row[name], factor) for name, (_, factor) in COLUMNS.items())]
            for row in found.to_dict("records")
        ]  # fmt: skip
        tables.append(table(["wheel", *(name for name, _ in COLUMNS.values())], rows, _title(report, subject)))
    text = "Tγ = |Fx ξ + Fy η|, summed over the patches of a wheel: work of the creep forces per metre. With spin: "
    text += "|Fx ξ + Fy η + Mz φ|. Means of Tγ are over the distance, means of the dissipated power over time."
    return join([paragraph(text), legend_of_sides(report), grid(parts), grid(tables, "two")])


def _title(report: Report, subject: Subject) -> str:
    return f"Means{', ' + subject.label if report.several else ''}"
