"""Linear and nonlinear critical speeds side by side."""

import pandas as pd

from wrcore.analysis.stability.limit_cycles import nonlinear_critical_speed


def critical_table(linear, cycles):
    """Linear (`critical_speeds`; variants ``planar`` and ``spatial``) and nonlinear critical speeds (`limit_cycles`
    with a column detection), both by vehicle: a row per vehicle and detection.
    """
    rows = []
    for vehicle, table in linear.items():
        for detection in ("planar", "spatial"):
            found = table[table["variant"] == detection].iloc[0].drop("variant").to_dict()
            part = cycles[vehicle][cycles[vehicle]["detection"] == detection]
            rows.append({"vehicle": vehicle, "detection": detection, **found, **nonlinear_critical_speed(part)})
    return pd.DataFrame(rows).rename(columns={"critical_speed_m_per_s": "linear_critical_speed_m_per_s"})
