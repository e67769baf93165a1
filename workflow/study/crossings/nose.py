"""A loaded wheelset laid on a crossing, place by place, by every patch model and both detections."""

import time

import numpy as np
import pandas as pd

from wrcore.analysis.contact.on_slices import LoadedOnSlices
from wrcore.contact.changing_rails.sections import WheelOnSlices
from wrcore.contact.search import reduction as columns

SIDE = "right"  # that of the crossing


def wheel_on_crossing(scene):
    """`WheelOnSlices` of the side of a scene with ``track.crossing: {rail: right}``."""
    pair, slices = scene.alike, scene.crossings[0].rails[1]
    return WheelOnSlices(pair.wheel, slices, pair.rolling_radius, pair.half_distance, pair.rail_distance)


def over_the_nose(pair, models, places, load, yaw):
    """Table of a wheel under a load (N), with a row per model, a dict of ``patch`` and ``detection`` by its name, and
    place (n,), m from where the nose begins: height of the wheelset's centre (m), share of the load on the nose,
    greatest pressure (Pa), and processor time (s). Detections differ in a yaw (rad)."""
    begins, rows = pair.rail.begins()[0], []
    for name, model in models.items():
        wheels = LoadedOnSlices(pair, model["patch"], detection=model["detection"])
        for k, place in enumerate([places[0], *places]):  # the first one once more: compilation
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
    """Whether a patch lies on the nose, the inner one of two heads."""
    heads = rail.heads(s + row[columns.X])
    if len(heads) < 2:
        return s + row[columns.X] >= rail.begins()[0]
    return row[columns.U_RAIL] < 0.5 * (heads[0].u[-1] + heads[1].u[0])


def summary(table):
    """What each model errs against the first one, which is exact: height (m, median and greatest), place at which the
    nose carries half (m), greatest pressure (part, median and worst); and its cost (s, median)."""
    by_model, rows = {name: part.set_index("place_m") for name, part in table.groupby("model", sort=False)}, []
    exact = next(iter(by_model.values()))
    for name, part in by_model.items():
        height, pressure = (part.z_m - exact.z_m).abs(), part.p_max_Pa / exact.p_max_Pa - 1.0
        rows.append((name, height.median(), height.max(), half_way(part) - half_way(exact), pressure.median(),
                     pressure.abs().max(), part.cpu_s.median()))  # fmt: skip
    return pd.DataFrame(rows, columns=["model", "height_median_m", "height_largest_m", "goes_over_later_m",
                                       "p_max_deviation", "p_max_worst", "cpu_s"])  # fmt: skip


def half_way(part):
    """Place at which the nose first carries half of the load, m."""
    share, place = part.share_of_nose.to_numpy(), part.index.to_numpy()
    k = int(np.argmax(share >= 0.5))
    if k == 0:
        return np.nan
    return float(np.interp(0.5, share[k - 1 : k + 1], place[k - 1 : k + 1]))
