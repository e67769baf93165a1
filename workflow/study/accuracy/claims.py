"""What reports/accuracy.md promises, as medians and worst cases, and of which cases: from tables of the study."""

import pandas as pd

CONTACT = {
    "lateral_m": ("lateral contact position", 1e3, "mm"),
    "height_equal_normal_m": ("height at equal normal force", 1e6, "µm"),
    "height_equal_load_m": ("height at equal vertical load", 1e6, "µm"),
    "p_max_relative": ("greatest pressure", 100.0, "%"),
}
"""Columns of `study.contact.reference.compare_with_contact`: name, factor to the printed unit, and unit."""

NEAR = 6e-3
"""Lateral positions up to here are shown apart, m: beyond, wheels stand on their flanges."""


def _row(what, of, cases, values, unit):
    size = values.abs()
    spread = {"median": size.median(), "q95": size.quantile(0.95), "worst": size.max()}
    return {"what": what, "of": of, "cases": cases, "count": len(values), **spread, "unit": unit}


def contact_claims(cases):
    """Errors of the contact search and both reductions against CONTACT, from
    `study.contact.reference.compare_with_contact`: what, of (the reduction), cases, count, median, q95, worst, unit.
    """
    rows = []
    for (name, reduction), part in cases.groupby(["set", "reduction"], sort=False):
        near = part[part["y_m"].abs() <= NEAR + 1e-9]
        for column, (what, factor, unit) in CONTACT.items():
            for title, some in ((f"CONTACT, {name}", part), (f"CONTACT, {name}, y up to 6 mm", near)):
                rows.append(_row(what, reduction, title, factor * some[column], unit))
    return pd.DataFrame(rows)


def creep_claims(errors):
    """Errors of creep laws against CONTACT (`study.creep.laws.error_table`), file by file and in all cases together, %
    of mu N; columns as for `contact_claims`.
    """
    known = errors[errors["against"] == "CONTACT"]
    rows = []
    for model, part in known.groupby("model", sort=False):
        for title, some in [*part.groupby("cases", sort=False), ("all", part)]:
            rows.append(_row("creep force", model, f"CONTACT, {title}", 100.0 * some["force_error"], "% of μN"))
    return pd.DataFrame(rows)


def patch_claims(summary):
    """Errors of patch models against exact contact (`study.patch.tables.summary`); columns as for `contact_claims`."""
    named = summary.rename(columns={"quantity": "what", "model": "of"})
    return named.assign(cases="poses " + named["zone"])[
        ["what", "of", "cases", "count", "median", "q95", "worst", "unit"]
    ]


def speed_claims(front):
    """Real-time factors on the fronts of speed against error: least, median, greatest of each kind and accuracy."""
    sound = front[front["y_rms_m"] < 1e-5]
    rows = [
        {"what": f"times real time, {kind}", "of": "choices below 10 µm", "cases": f"{speed:g} m/s", "count": len(part),
         "least": part["real_time_factor"].min(), "median": part["real_time_factor"].median(),
         "best": part["real_time_factor"].max(), "unit": "1"}
        for (kind, speed), part in sound.groupby(["kind", "speed_m_per_s"])
    ]  # fmt: skip
    return pd.DataFrame(rows)


def claims(cases, errors, patches, front):
    """All of them in one table; arguments as for the parts."""
    parts = contact_claims(cases), creep_claims(errors), patch_claims(patches), speed_claims(front)
    return pd.concat(parts, ignore_index=True)


def claims_markdown(table):
    """The table for reading."""
    shown = table.astype(object).where(table.notna(), "")
    return shown.to_markdown(index=False, floatfmt=".3g") + "\n"
