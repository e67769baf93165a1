"""Quantities that change along the track or over time: tables with linear interpolation between their points."""

from typing import NamedTuple

import numpy as np

from wrcore.kernels.jit import jit


class Schedules(NamedTuple):
    """Several tables, for kernels."""

    starts: np.ndarray  # (n + 1,) int: points of table k are starts[k] <= i < starts[k + 1]
    points: np.ndarray  # (p, 2): abscissa (s or m), strictly rising in a table, and value


def pack_schedules(tables):
    """Pack tables, each an array (q, 2) of at least one point, into one `Schedules`."""
    return Schedules(
        np.cumsum([0, *map(len, tables)], dtype=np.int64), np.concatenate([np.zeros((0, 2)), *tables]).astype(float)
    )


@jit(allocates=False)
def scheduled(schedules, table, x):
    """Value of a table at the abscissa ``x``: linear between its points, constant beyond its ends."""
    points, low, high = schedules.points, schedules.starts[table], schedules.starts[table + 1] - 1
    if not x > points[low, 0]:
        return points[low, 1]
    if x >= points[high, 0]:
        return points[high, 1]
    while high - low > 1:
        middle = (low + high) // 2
        if x < points[middle, 0]:
            high = middle
        else:
            low = middle
    part = (x - points[low, 0]) / (points[high, 0] - points[low, 0])
    return points[low, 1] + part * (points[high, 1] - points[low, 1])
