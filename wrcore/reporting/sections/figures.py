"""Section of a report: key figures with their definitions."""

from __future__ import annotations

import numpy as np

from wrcore.analysis.assessment.wheels import maximum_pressure, wheel_table
from wrcore.reporting.page import Markup, Row, join, paragraph, quantities
from wrcore.reporting.subject import Report, Subject
from wrcore.run.motion import amplitude, hunting_frequency

TITLE = "Key figures"

FIGURES = {
    "simulated_s": ("simulated time", "from the first to the last output time", "s", 1.0),
    "distance_m": ("distance", "travelled by the first wheelset along the track", "m", 1.0),
    "speed_mean_m_per_s": ("mean speed", "distance over time", "m/s", 1.0),
    "Q_mean_N": ("mean Q", "vertical force of a wheel on its rail, mean of all wheels over time", "kN", 1e-3),
    "Q_max_N": ("maximum Q", "largest vertical force of all wheels", "kN", 1e-3),
    "Q_min_N": ("minimum Q", "smallest vertical force of all wheels; 0 where a wheel lifts off", "kN", 1e-3),
    "Y_max_N": ("maximum |Y|", "largest lateral force of a wheel on its rail, in the plane of the track", "kN", 1e-3),
    "Y_over_Q_max": ("maximum |Y/Q|", "largest quotient of both forces, of wheels with Q above 1 kN", "", 1.0),
    "sum_Y_max_N": ("maximum |ΣY|", "largest lateral force of a wheelset on the track", "kN", 1e-3),
    "p_max_Pa": ("maximum pressure", "largest pressure in all contact patches", "MPa", 1e-6),
    "T_gamma_mean_N": (
        "mean wear number Tγ", "|Fx ξ + Fy η| of the patches of a wheel, mean over distance, largest of all wheels",
        "N", 1.0,
    ),
    "creep_power_mean_W": ("creep power", "power that creep dissipates: mean over time, sum of all wheels", "kW", 1e-3),
    "y_amplitude_m": (
        "lateral amplitude", "half of the range of y of a wheelset, largest of all wheelsets", "mm", 1e3,
    ),
    "yaw_max_rad": ("maximum yaw", "largest yaw angle of a wheelset relative to the track", "mrad", 1e3),
    "frequency_Hz": (
        "frequency of y", "of the lateral motion of the first wheelset, from its swings; none without oscillation",
        "Hz", 1.0,
    ),
}  # fmt: skip
"""Name, definition, printed unit and factor of each key figure."""


def section(report: Report) -> Markup:
    """Return the key figures of all runs; a figure that no run has is omitted."""
    by_run = report.each(TITLE, lambda subject: key_figures(subject, report.begin))
    found = {subject.label: values for subject, values in by_run}
    rows = []
    for key, (name, definition, unit, factor) in FIGURES.items():
        values = [found.get(label, {}).get(key, np.nan) for label in report.labels]
        if np.isfinite(values).any():
            rows.append(Row(key, name, definition, unit, factor, [float(value) for value in values]))
    if not rows:
        return Markup("")
    since = f" from {report.begin:g} s on" if report.begin else ""
    note = f"All values are those at the output times{since}, without a filter."
    return join([quantities(rows, report.labels, "figure and definition"), paragraph(note, class_="note")])


def key_figures(subject: Subject, begin: float = 0.0) -> dict[str, float]:
    """Return the key figures of a run from ``begin`` (s) on, in SI units, by the names of `FIGURES`; those for which
    the run has no channels are omitted."""
    run = subject.run
    late = run.t >= begin
    t = run.t[late]
    found = {"simulated_s": float(run.t[-1] - run.t[0])}
    for part in (_motion, _forces):
        found |= part(subject, late, t, begin)
    return found


def _motion(subject: Subject, late: np.ndarray, t: np.ndarray, begin: float) -> dict[str, float]:
    run = subject.run
    bodies = subject.wheelsets or [
        name for name, channels in run.groups.items() if "x_m" in channels and "/" not in name
    ]
    found: dict[str, float] = {}
    if bodies and (place := run.groups[bodies[0]].get("s_m", run.groups[bodies[0]].get("x_m"))) is not None:
        found["distance_m"] = float(np.abs(np.diff(place[late])).sum())
        if t[-1] > t[0]:
            found["speed_mean_m_per_s"] = found["distance_m"] / float(t[-1] - t[0])
    lateral = [run.groups[name]["y_m"][late] for name in subject.wheelsets if "y_m" in run.groups[name]]
    if lateral:
        found["y_amplitude_m"] = max(amplitude(values) for values in lateral)
        found["frequency_Hz"] = hunting_frequency(t, lateral[0])
    yaw = [run.groups[name]["yaw_rad"][late] for name in subject.wheelsets if "yaw_rad" in run.groups[name]]
    if yaw:
        found["yaw_max_rad"] = max(float(np.abs(values).max()) for values in yaw)
    return found


def _forces(subject: Subject, late: np.ndarray, t: np.ndarray, begin: float) -> dict[str, float]:
    run, wheels = subject.run, [f"{name}/{side}" for name in subject.wheelsets for side in ("left", "right")]
    if not wheels or not all(run[wheel].follows("Q_N") and run[wheel].follows("Y_N") for wheel in wheels):
        return {}
    found = {"sum_Y_max_N": max(float(np.abs(run[name].sum_Y_N[late]).max()) for name in subject.wheelsets)}
    if all(run[wheel].follows("T_gamma_N") for wheel in wheels):
        table = wheel_table(run, begin)
        found |= {"Q_mean_N": table["Q_mean_N"].mean(), "Q_max_N": table["Q_max_N"].max()}
        found |= {"Q_min_N": table["Q_min_N"].min(), "Y_max_N": table["Y_max_N"].max()}
        found |= {"Y_over_Q_max": table["Y_over_Q_max"].max(), "T_gamma_mean_N": table["T_gamma_mean_N"].max()}
        found["creep_power_mean_W"] = table["creep_power_mean_W"].sum()
    if all(run[wheel].follows("p_max_Pa") for wheel in wheels):
        sides = [(name, side) for name in subject.wheelsets for side in ("left", "right")]
        found["p_max_Pa"] = max(float(maximum_pressure(run, *pair)[late].max()) for pair in sides)
    return {name: float(value) for name, value in found.items()}
