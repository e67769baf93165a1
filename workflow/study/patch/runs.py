"""What the patch model does to vehicles: limit cycle, forces and wear on irregular track, critical speed."""

import numpy as np
import pandas as pd

from wrcore.analysis.assessment.wheels import wheel_table, wheelsets_of
from wrcore.analysis.stability.limit_cycles import Settling, settle_motion, shifted
from wrcore.analysis.stability.stability import at_speed, straight_ahead
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene

MEASURES = ("linear_critical_speed_m_per_s", "cycle_amplitude_m", "cycle_frequency_Hz", "y_rms_m", "Q_max_N", "Y_max_N",
            "T_gamma_mean_N")  # fmt: skip
"""Columns whose deviation from exact contact is given."""


def limit_cycle(source, overrides, cycle, start=None):
    """What a large disturbance settles to at one speed, on perfect track; ``cycle`` holds speed (m/s), shift (m, of the
    vehicle, sideways) and settling, and ``start`` changes to a scene that is cheaper to run: what the disturbance
    settles to there is what it starts from.
    """
    settling = Settling(**cycle["settling"])

    def straight(*changes):
        scene = load_scene(source, [*overrides, "initial.y=0.0", *changes])
        return at_speed(*straight_ahead(scene), cycle["speed"])

    if start is None:
        model, state = straight()
        disturbed = shifted(model, state, cycle["shift"])
    else:
        cheap, state = straight(*start)
        _, disturbed = settle_motion(cheap, shifted(cheap, state, cycle["shift"]), settling)
        model, _ = straight()
    found, _ = settle_motion(model, disturbed, settling)
    return {f"cycle_{name}": found[name] for name in ("speed_m_per_s", "amplitude_m", "frequency_Hz", "status")}


def irregular_run(source, overrides, changes, begin):
    """Motion, forces and wear of a run from ``begin`` (s) on, and its cost; ``changes`` are by key path."""
    scene = load_scene(source, [*overrides, *(f"{key}={value}" for key, value in changes.items())])
    if scene.data["contact"]["patch"] == "tabulated":
        simulate(scene)  # what it meets is solved, once: no cost of the run that counts
    run = simulate(scene)
    wheels, late = wheel_table(run, begin), run.t >= begin
    y = np.concatenate([run[name].y_m[late] for name in wheelsets_of(run)])
    return {
        "status": run.status, "y_rms_m": float(np.sqrt(np.mean(y**2))), "Q_max_N": wheels["Q_max_N"].max(),
        "Y_max_N": wheels["Y_max_N"].max(), "T_gamma_mean_N": wheels["T_gamma_mean_N"].mean(),
        "real_time_factor": float(run.t[-1]) / run.counters["wall_s"],
    }  # fmt: skip


def model_runs(source, overrides, cycle, track, begin, start=None):
    """`limit_cycle` and `irregular_run` of one vehicle with one patch model: a table of one row."""
    cycle = limit_cycle(source, overrides, cycle, start)
    return pd.DataFrame([cycle | irregular_run(source, overrides, track, begin)])


def compared(rows, exact):
    """Models of each vehicle (rows: vehicle, model and the measures) with relative deviations of the measures from the
    model ``exact`` in columns that end in ``_deviation``.
    """
    sure = rows[rows["model"] == exact].set_index("vehicle")
    table = rows.copy()
    for name in MEASURES:
        table[f"{name}_deviation"] = table[name] / table["vehicle"].map(sure[name]) - 1.0
    return table


def linear_speeds(variants, titles, names):
    """Linear critical speeds by (vehicle, model) from the variants (vehicle's title, variant, critical_speed_m_per_s)
    of the study of critical speeds; models without a variant's name are left out.
    """
    found = variants.set_index(["vehicle", "variant"])["critical_speed_m_per_s"]
    return {(vehicle, model): float(found[title, variant])
            for vehicle, title in titles.items() for model, variant in names.items()}  # fmt: skip
