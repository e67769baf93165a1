"""Bode plot of a frequency response."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from wrcore.analysis.pictures.plot_run import COLORS
from wrcore.analysis.pictures.style import styled
from wrcore.analysis.stability.modes import OVERDAMPED
from wrcore.errors import InputError
from wrcore.errors.checked_calls import checked


@checked
@styled
def plot_frequency_response(table: pd.DataFrame) -> Figure:
    """Draw a frequency response: amplitudes in one panel, phases in the panel below.

    Parameters
    ----------
    table : pandas.DataFrame
        Result of :func:`wrcore.frequency_response`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If it is another table.

    Examples
    --------
    >>> import wrcore as wr
    >>> scene = wr.example("suspended_wheelset")
    >>> table = wr.frequency_response(scene, ["alignment"], ["wheelset.y_m"], [1.0, 2.0, 4.0])
    >>> wr.plot_frequency_response(table).axes[0].get_ylabel()
    'output per unit of input (SI)'
    """
    if table.index.name != "frequency_Hz" or table.columns.names != ["input", "output"]:
        raise InputError("plot_frequency_response", "table", "expected a table of frequency_response")
    figure = Figure(figsize=(7.2, 4.6), layout="constrained")
    size, phase = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    for k, (source, output) in enumerate(table.columns):
        values, look = table[source, output].to_numpy(), {"color": COLORS[k % len(COLORS)]}
        size.loglog(table.index, np.abs(values), label=f"{source} to {output}", **look)
        phase.semilogx(table.index, np.degrees(np.unwrap(np.angle(values))), **look)
    size.set(ylabel="output per unit of input (SI)")
    phase.set(xlabel="frequency / Hz", ylabel="phase / deg")
    figure.legend(*size.get_legend_handles_labels(), loc="outside upper center", ncols=1 + (table.shape[1] > 3))
    return figure


LEAST_ENERGY = 0.05
"""Minimum share of the kinetic energy in any mode for a coordinate to be shown in the figure of modes."""


@styled
def fig_modes(table, title):
    """Plot frequency, damping and distribution of kinetic energy of the modes at one speed (first table of `modes`).

    Modes without oscillation are omitted; modes of equal name, frequency and damping share a row.
    """
    table = table[table["damping_ratio"] < OVERDAMPED]
    labels = pd.Series(
        f"{mode.name}   {mode.frequency_Hz:.2f} Hz   {100 * mode.damping_ratio:.1f} %".replace("-", "\N{MINUS SIGN}")
        for mode in table.itertuples()
    )
    times = labels.map(labels.value_counts())
    rows = np.flatnonzero(~labels.duplicated())  # equal modes of equal, nearly uncoupled wheelsets
    parts = table.iloc[rows, table.columns.get_loc("part") + 1 :]
    parts = parts.loc[:, parts.max() >= LEAST_ENERGY]
    labels = [labels[row] if times[row] == 1 else f"{times[row]} times {labels[row]}" for row in rows]
    figure = Figure(figsize=(max(2.6 + 0.27 * parts.shape[1], 4.6), 1.5 + 0.16 * len(rows)), layout="constrained")
    axes = figure.subplots()
    axes.imshow(parts, cmap="Greys", vmin=0.0, vmax=1.8, aspect="auto")
    for (row, column), part in np.ndenumerate(parts.to_numpy()):
        if part >= LEAST_ENERGY:
            axes.text(column, row, f"{100 * part:.0f}", ha="center", va="center", fontsize=6)
    axes.set_yticks(range(len(rows)), labels, fontsize=7)
    axes.set_xticks(range(parts.shape[1]), parts.columns, fontsize=7, rotation=90)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.grid(False)
    figure.suptitle(f"{title}: kinetic energy by coordinate / %", fontsize=9, x=0.01, ha="left")
    return figure
