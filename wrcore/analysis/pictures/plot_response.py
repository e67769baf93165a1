"""Bode plot of a frequency response."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from wrcore.analysis.pictures.plot_run import COLORS
from wrcore.analysis.pictures.style import styled
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
