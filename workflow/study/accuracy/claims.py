"""Errors that reports/accuracy.md states, as median, 95 % and maximum over named cases, from tables of the study."""

import pandas as pd

CONTACT = {
    "lateral_m": ("lateral contact position", 1e3, "mm"),
    "height_equal_normal_m": ("height at equal normal force", 1e6, "µm"),
    "height_equal_load_m": ("height at equal vertical load", 1e6, "µm"),
    "p_max_relative": ("greatest pressure", 100.0, "%"),
}
"""Columns of `study.contact.reference.compare_with_contact`: name, factor to the printed unit, and unit."""

NEAR = 6e-3
"""Largest lateral position of the rows "y up to 6 mm", m; at larger positions wheels stand on their flanges."""


def _row(what, of, cases, values, unit):
    size = values.abs()
    spread = {"median": size.median(), "q95": size.quantile(0.95), "worst": size.max()}
    return {"what": what, "of": of, "cases": cases, "count": len(values), **spread, "unit": unit}


def contact_claims(cases):
    """Return errors of both reductions relative to CONTACT, from `study.contact.reference.compare_with_contact`.

    Columns: what (the quantity), of (the reduction), cases, count, median, q95 (95 % quantile), worst, unit.
    """
    rows = []
    for (name, reduction), part in cases.groupby(["set", "reduction"], sort=False):
        near = part[part["y_m"].abs() <= NEAR + 1e-9]
        for column, (what, factor, unit) in CONTACT.items():
            for title, some in ((f"CONTACT, {name}", part), (f"CONTACT, {name}, y up to 6 mm", near)):
                rows.append(_row(what, reduction, title, factor * some[column], unit))
    return pd.DataFrame(rows)


def creep_claims(errors):
    """Return errors of the creep force of each creep law relative to CONTACT, in % of μN.

    Cases (`study.creep.laws.error_table`) are grouped by file, then all together; columns as for `contact_claims`.
    """
    known = errors[errors["against"] == "CONTACT"]
    rows = []
    for model, part in known.groupby("model", sort=False):
        for title, some in [*part.groupby("cases", sort=False), ("all", part)]:
            rows.append(_row("creep force", model, f"CONTACT, {title}", 100.0 * some["force_error"], "% of μN"))
    return pd.DataFrame(rows)


def patch_claims(summary):
    """Return errors of patch models relative to exact contact, from `study.patch.tables.summary`.

    Columns are those of `contact_claims`.
    """
    named = summary.rename(columns={"quantity": "what", "model": "of"})
    return named.assign(cases="poses " + named["zone"])[
        ["what", "of", "cases", "count", "median", "q95", "worst", "unit"]
    ]


def speed_claims(front):
    """Return minimum, median and maximum real-time factor by kind of scene and speed.

    Only choices on the Pareto fronts with an error of y below 10 µm (RMS) are included.
    """
    sound = front[front["y_rms_m"] < 1e-5]
    rows = [
        {"what": f"times real time, {kind}", "of": "choices below 10 µm", "cases": f"{speed:g} m/s", "count": len(part),
         "least": part["real_time_factor"].min(), "median": part["real_time_factor"].median(),
         "best": part["real_time_factor"].max(), "unit": "1"}
        for (kind, speed), part in sound.groupby(["kind", "speed_m_per_s"])
    ]  # fmt: skip
    return pd.DataFrame(rows)


def claims(cases, errors, patches, front):
    """Concatenate the tables of contact, creep, patch and speed; arguments as for these functions."""
    parts = contact_claims(cases), creep_claims(errors), patch_claims(patches), speed_claims(front)
    return pd.concat(parts, ignore_index=True)


def claims_markdown(table):
    """Format the table of `claims` as Markdown."""
    shown = table.astype(object).where(table.notna(), "")
    return shown.to_markdown(index=False, floatfmt=".3g") + "\n"
