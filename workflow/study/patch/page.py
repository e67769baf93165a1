"""What was found of the patch models, as tables in Markdown: `reports/patch.md` quotes them."""

import pandas as pd

from study.patch.tables import REFERENCE

CELL = ("median", "q95", "worst")


def spread_table(table, rows, columns):
    """Median / 95 % / worst (CELL, with a unit) of a long table as a wide one, named by ``rows`` and ``columns``."""
    cells = [" / ".join(f"{value:.2g}" for value in row) for row in table[list(CELL)].itertuples(index=False)]
    return table.assign(cell=cells).pivot_table(index=rows, columns=columns, values="cell", aggfunc="first", sort=False)


def error_tables(summary):
    """One table per zone: quantities down, models across, their cost in the heads."""
    costs = summary.drop_duplicates("model").set_index("model")["us_per_patch"]
    heads = {name: f"{name} ({cost:.2g} µs)" if cost == cost else name for name, cost in costs.items()}
    named = summary.assign(model=summary["model"].map(heads), quantity=summary["quantity"] + ", " + summary["unit"])
    return {zone: spread_table(part, "quantity", "model") for zone, part in named.groupby("zone", sort=False)}


def conicity_table(conicity):
    """Load and amplitude down, models across, exact contact in front."""
    wide = conicity.assign(load_kN=1e-3 * conicity["load_N"], amplitude_mm=1e3 * conicity["amplitude_m"])
    wide = wide.pivot_table(index=["load_kN", "amplitude_mm"], columns="model", values="conicity", sort=False)
    return wide[[REFERENCE, *(name for name in wide if name != REFERENCE)]]


def runs_table(models):
    """Vehicles with each model, units for reading."""
    shown = {"vehicle": models["vehicle"].str.replace("_", " "), "model": models["model"]}
    for name, (head, factor) in RUNS.items():
        shown[head] = [f"{factor * value:.3g}" for value in models[name]]
    return pd.DataFrame(shown).set_index(["vehicle", "model"])


RUNS = {
    "linear_critical_speed_m_per_s": ("linear critical speed, m/s", 1.0),
    "cycle_speed_m_per_s": ("hunting at, m/s", 1.0),
    "cycle_amplitude_m": ("amplitude, mm", 1e3),
    "cycle_frequency_Hz": ("frequency, Hz", 1.0),
    "y_rms_m": ("irregular track: y rms, mm", 1e3),
    "Q_max_N": ("Q, kN", 1e-3),
    "Y_max_N": ("Y, kN", 1e-3),
    "T_gamma_mean_N": ("wear number, N", 1.0),
    "real_time_factor": ("times real time", 1.0),
}
"""Columns of the table of vehicles: head and factor to its unit."""


def page(summary, conicity, contact, models):
    """All in Markdown: `summary`, `conicity_under_load`, CONTACT's cases (`distributions`), runs (`compared`)."""
    parts = []
    for zone, table in error_tables(summary).items():
        parts += [f"Errors {zone}, median / 95 % / worst", table]
    parts += ["Equivalent conicity under load", conicity_table(conicity).map(lambda value: f"{value:.3f}")]
    against = contact.assign(quantity=contact["quantity"] + ", " + contact["unit"])
    parts += ["Against CONTACT, median / 95 % / worst", spread_table(against, ["set", "quantity"], "model")]
    parts += ["Vehicles", runs_table(models)]
    texts = [
        part if isinstance(part, str) else part.reset_index().to_markdown(index=False, disable_numparse=True)
        for part in parts
    ]
    return "\n\n".join(texts) + "\n"
