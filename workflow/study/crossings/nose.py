"""Static contact of a loaded wheelset along a crossing, for patch models and both detections."""

import time

import numpy as np
import pandas as pd

from wrcore.analysis.contact.on_slices import LoadedOnSlices
from wrcore.contact.changing_rails.sections import WheelOnSlices
from wrcore.contact.search import reduction as columns

SIDE = "right"  # side of the crossing


def wheel_on_crossing(scene):
    """Return the `WheelOnSlices` of the right side of a scene with ``track.crossing: {rail: right}``."""
    pair, slices = scene.alike, scene.crossings[0].rails[1]
    return WheelOnSlices(pair.wheel, slices, pair.rolling_radius, pair.half_distance, pair.rail_distance)


def over_the_nose(pair, models, places, load, yaw):
    """Compute the static contact of a wheel under a load (N) at positions along the nose, a row per model and position.

    ``models`` are dicts of ``patch`` and ``detection`` by name; ``places`` (n,) are positions from the beginning of the
    nose, m. Columns: height of the wheelset's centre (m), share of the load on the nose, maximum pressure (Pa), and
    processor time (s). The two detections differ only if the yaw (rad) is not zero."""
    begins, rows = pair.rail.begins()[0], []
    for name, model in models.items():
        wheels = LoadedOnSlices(pair, model["patch"], detection=model["detection"])
        for k, place in enumerate([places[0], *places]):  # the first position twice: its first pass compiles
            wheels.s, began = begins + place, time.process_time()
            z = wheels.height(SIDE, 0.0, load, yaw=yaw)
            found = wheels.at_height(SIDE, 0.0, z, yaw=yaw)
            seconds = time.process_time() - began
            if k:
                nose = sum(one.vertical for one in found if _on_nose(pair.rail, wheels.s, one.row)) / load
                largest = max(one.row[columns.P_MAX] for one in found)
                rows.append((name, place, z, nose, largest, seconds))
    return pd.DataFrame(rows, columns=["model", "place_m", "z_m", "share_of_nose", "p_max_Pa", "cpu_s"])


def _on_nose(rail, s, row):
    """Whether a patch lies on the nose, the inner one of two rail heads in a section."""
    heads = rail.heads(s + row[columns.X])
    if len(heads) < 2:
        return s + row[columns.X] >= rail.begins()[0]
    return row[columns.U_RAIL] < 0.5 * (heads[0].u[-1] + heads[1].u[0])


def summary(table):
    """Return errors of each model relative to the first model, which is exact, and its processor time.

    Columns: error of height (m, median and maximum), of the position at which the nose carries half the load (m), and
    relative error of the maximum pressure (median and maximum); processor time (s, median)."""
    by_model, rows = {name: part.set_index("place_m") for name, part in table.groupby("model", sort=False)}, []
    exact = next(iter(by_model.values()))
    for name, part in by_model.items():
        height, pressure = (part.z_m - exact.z_m).abs(), part.p_max_Pa / exact.p_max_Pa - 1.0
        rows.append((name, height.median(), height.max(), half_way(part) - half_way(exact), pressure.median(),
                     pressure.abs().max(), part.cpu_s.median()))  # fmt: skip
    return pd.DataFrame(rows, columns=["model", "height_median_m", "height_largest_m", "goes_over_later_m",
                                       "p_max_deviation", "p_max_worst", "cpu_s"])  # fmt: skip


def half_way(part):
    """Return the position at which the nose first carries half of the load, m; NaN if this is not within the table."""
    share, place = part.share_of_nose.to_numpy(), part.index.to_numpy()
    k = int(np.argmax(share >= 0.5))
    if k == 0:
        return np.nan
    return float(np.interp(0.5, share[k - 1 : k + 1], place[k - 1 : k + 1]))
