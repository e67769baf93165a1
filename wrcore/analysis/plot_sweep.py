"""Figures of sweeps: a result of every run over each varied key of the scene."""

from __future__ import annotations

from pathlib import PurePath
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wrcore.analysis.pictures.plot_run import PRINTED
from wrcore.analysis.pictures.style import shared_legend, styled
from wrcore.sweep.batch import column_unit

ENDS: dict[str, dict[str, Any]] = {
    "completed": {"color": "#0072B2", "marker": "o", "s": 3, "linewidths": 0, "alpha": 0.5},
    "derailed": {"color": "#CC3311", "marker": "x", "s": 14, "linewidths": 0.8},
    "stalled": {"color": "0.5", "marker": "^", "s": 14, "linewidths": 0},
    "failed": {"color": "0.1", "marker": "+", "s": 20, "linewidths": 0.8},
}
"""Marker styles of runs by their status at the end."""

MOST_COLUMNS = 3
FEW = 300
"""Number of runs below which points are drawn larger."""


@styled
def sweep_scatter(table: pd.DataFrame, keys: list[str], measure: str) -> Figure:
    """Draw one result of all runs of a sweep's table over each key, a panel per key; text values are categories."""
    columns = min(MOST_COLUMNS, len(keys))
    rows = -(-len(keys) // columns)
    figure = Figure(figsize=(0.8 + 2.4 * columns, 0.6 + 2.3 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, sharey=True, squeeze=False)
    values, label = _printed(measure, table[measure])
    for axes, key in zip(panels.flat, keys, strict=False):
        _over(axes, table, key, values)
    for axes in list(panels.flat)[len(keys) :]:
        axes.set_axis_off()
    for axes in panels[:, 0]:
        axes.set_ylabel(label)
    shared_legend(figure, panels.flat)
    return figure


def _over(axes: Axes, table: pd.DataFrame, key: str, values: np.ndarray) -> None:
    numeric = pd.api.types.is_numeric_dtype(table[key]) and not pd.api.types.is_bool_dtype(table[key])
    if numeric:
        places, label = _printed(key, table[key])
    else:
        codes, names = pd.factorize(table[key].astype(str))
        spread = (np.arange(len(table)) % 29 - 14) / 50  # spreads runs of one category laterally
        places, label = codes + spread, key.rpartition(".")[2]
        axes.set_xticks(range(len(names)), [_short(name) for name in names])
    for end, style in ENDS.items():
        here = (table["status"] == end).to_numpy()
        if here.any():
            size = style["s"] * (4.0 if len(table) < FEW else 1.0)
            axes.scatter(places[here], values[here], label=end, rasterized=True, **{**style, "s": size})
    axes.set(xlabel=label.replace("_", " "))


def _short(name: str) -> str:
    """Return a text, or a file's name without folder and ending, broken into lines at underscores."""
    return PurePath(name).stem.replace("_", "\n") if "/" in name and name.endswith((".yaml", ".csv")) else name


def _printed(column: str, values: pd.Series) -> tuple[np.ndarray, str]:
    """Return the values in the printed unit, and the label."""
    unit = column_unit(column)
    name = column.removeprefix("contact.").removeprefix("integration.").replace(".", " ")
    for end in ("_m", "_rad", "_N"):
        name = name.removesuffix(end)
    factor, printed = PRINTED.get(unit, (1.0, unit))
    return factor * values.to_numpy(float), f"{name.replace('_', ' ')} / {printed}" if printed else name
