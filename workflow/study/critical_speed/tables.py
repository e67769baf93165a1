"""Tables of root loci, and of linear and nonlinear critical speeds."""

import pandas as pd

from wrcore.analysis.stability.limit_cycles import nonlinear_critical_speed
from wrcore.analysis.stability.stability import rising, root_locus, straight_ahead


def loci(scenes, speeds):
    """Return root loci of one vehicle at rising ``speeds`` (m/s), for several scenes by detection.

    A column ``detection`` precedes the columns of `root_locus`.
    """
    speeds = rising(speeds)
    tables = {name: root_locus(scene.vehicle, *straight_ahead(scene), speeds) for name, scene in scenes.items()}
    return pd.concat(tables, names=["detection"]).reset_index("detection").reset_index(drop=True)


def critical_table(linear, cycles):
    """Return linear and nonlinear critical speeds, a row per vehicle and detection.

    Both arguments are by vehicle: ``linear`` tables of `critical_speeds` with the variants ``planar`` and ``spatial``,
    ``cycles`` tables of `limit_cycles` with a column detection.
    """
    rows = []
    for vehicle, table in linear.items():
        for detection in ("planar", "spatial"):
            found = table[table["variant"] == detection].iloc[0].drop("variant").to_dict()
            part = cycles[vehicle][cycles[vehicle]["detection"] == detection]
            rows.append({"vehicle": vehicle, "detection": detection, **found, **nonlinear_critical_speed(part)})
    return pd.DataFrame(rows).rename(columns={"critical_speed_m_per_s": "linear_critical_speed_m_per_s"})
