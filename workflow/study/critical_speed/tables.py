"""Linear and nonlinear critical speeds side by side."""

import pandas as pd

from wrcore.analysis.stability.limit_cycles import nonlinear_critical_speed
from wrcore.analysis.stability.stability import rising, root_locus, straight_ahead


def loci(scenes, speeds):
    """Tables of `root_locus` of one vehicle at rising ``speeds`` (m/s) in several scenes by detection, after a column
    of that name.
    """
    speeds = rising(speeds)
    tables = {name: root_locus(scene.vehicle, *straight_ahead(scene), speeds) for name, scene in scenes.items()}
    return pd.concat(tables, names=["detection"]).reset_index("detection").reset_index(drop=True)


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
