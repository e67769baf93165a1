"""Plot of any channels of one run over time, with units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wrcore.analysis.assessment.wheels import wheel_forces, wheelsets_of
from wrcore.analysis.pictures.style import plain, styled
from wrcore.errors import InputError, similar
from wrcore.errors.checked_calls import checked
from wrcore.geometry.track import SIDES
from wrcore.run.output.channels import UNIT_SUFFIXES, unit_of
from wrcore.run.output.run import Run

PRINTED = {
    "m": (1e3, "mm"), "rad": (1e3, "mrad"), "N": (1e-3, "kN"), "N m": (1.0, "N m"), "J": (1e-3, "kJ"),
    "W": (1e-3, "kW"), "Pa": (1e-6, "MPa"), "1": (1.0, ""),
}  # fmt: skip
"""Factor to the printed unit, and the printed unit; other units are printed unchanged."""

LARGE = ("x_m", "s_m", "z_m")  # channels in m that are printed in m

WIDTH, HEIGHT = 7.2, 1.7
COLORS = ("0.1", "#0072B2", "#E69F00", "#56B4E9", "#CC79A7", "0.6")
"""Okabe-Ito, by wheelset or line; beyond the last, lines change their dashes."""

DASHES: tuple[Any, ...] = ("-", (0, (4, 2)), (0, (1, 1)), (0, (6, 1, 1, 1)))
"""A wheelset's left wheel has full lines, its right one dashes."""

MOST_ENTRIES = 8  # in one column of a legend


@checked
@styled
def plot_run(run: Run, channels: Sequence[str] = ()) -> Figure:
    """Draw channels of a run over time, one panel each.

    Parameters
    ----------
    run : Run
    channels : sequence of str
        ``"<group>.<channel>"``, such as ``"wheelset/left.N_N"``. Empty: lateral position and yaw of all wheelsets, and
        vertical and lateral force of each wheel if the run has contacts.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the run does not have a channel.

    Examples
    --------
    >>> import wrcore as wr
    >>> run = wr.simulate(wr.example("suspended_wheelset"), integration__duration=0.1)
    >>> figure = wr.plot_run(run, ["wheelset.y_m", "wheelset/left.N_N"])
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['y / mm', 'N / kN']
    """
    panels = [(name.rpartition(".")[2], {name: values_of(run, name)}) for name in channels] or _overview(run)
    figure = Figure(figsize=(WIDTH, 0.7 + HEIGHT * len(panels)), layout="constrained")
    rows = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (quantity, lines) in zip(rows, panels, strict=True):
        _draw(axes, run, quantity, lines)
    rows[-1].set_xlabel("time / s")
    figure.suptitle(plain(f"{run.scene.get('name', 'run')}: {run.status}"), x=0.01, ha="left")
    return figure


def values_of(run: Run, channel: str) -> np.ndarray:
    """Return the values of a channel such as ``wheelset/left.N_N``; InputError if the run does not have it."""
    group, _, name = channel.rpartition(".")
    try:
        return run[group][name]
    except KeyError:
        known = [f"{one}.{channel}" for one in run for channel in run[one].names()]
        near = similar(channel, known) or similar(f"{next(iter(run), '')}.{name}", known)
        has = f"{group}.{', '.join(run[group].names())}" if group in run else f"a channel of {', '.join(run)}"
        raise InputError("plot", channel, f"expected {has}{near}") from None


def _overview(run: Run) -> list[tuple[str, dict[str, np.ndarray]]]:
    """Return the default panels (quantity, lines by label) of a run with the channels that it has."""
    names = wheelsets_of(run) or [name for name, group in run.groups.items() if "y_m" in group]
    motion = {q: {name: run.groups[name][q] for name in names if q in run.groups[name]} for q in ("y_m", "yaw_rad")}
    wheels = {f"{name} {side}": wheel_forces(run, name, side) for name in wheelsets_of(run) for side in SIDES}
    forces = {q: {label: pair[at] for label, pair in wheels.items()} for at, q in enumerate(("Q_N", "Y_N"))}
    panels = [(quantity, lines) for quantity, lines in (motion | forces).items() if lines]
    if not panels:
        first = next(((group, name) for group, names in run.groups.items() for name in names), None)
        if first is None:
            raise InputError("plot", "", "expected a run with output channels")
        panels.append((first[1], {".".join(first): run.groups[first[0]][first[1]]}))
    return panels


def printed(quantity: str) -> tuple[float, str]:
    """Return the factor from a channel's unit to the printed unit, and the label of an axis with the printed unit."""
    unit, symbol = unit_of(quantity), quantity
    factor, name = (1.0, "m") if quantity in LARGE else PRINTED.get(unit, (1.0, unit))
    if unit != "1":
        symbol = quantity.removesuffix(next(end for end in UNIT_SUFFIXES if quantity.endswith(end)))
    symbol = symbol.replace("_", " ")
    return factor, f"{symbol} / {name}" if name else symbol


def _draw(axes: Axes, run: Run, quantity: str, lines: dict[str, np.ndarray]) -> None:
    factor, ylabel = printed(quantity)
    for style, (label, values) in zip(looks(list(lines)), lines.items(), strict=True):
        if values.ndim > 1:  # a patch may last for a single output
            style |= {"marker": ".", "markersize": 3}
        for patch, column in enumerate(np.reshape(values, (len(run.t), -1)).T):
            if patch == 0 or not np.isnan(column).all():
                axes.plot(run.t, factor * column, label=plain(label).replace("_", " ") if patch == 0 else None, **style)
    axes.set(ylabel=ylabel, xmargin=0)
    if len(lines) > 1:
        look = {"fontsize": 7 if len(lines) > MOST_ENTRIES // 2 else 9, "ncols": -(-len(lines) // MOST_ENTRIES)}
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), **look)
    else:
        axes.set_title(plain(next(iter(lines)).removesuffix(f".{quantity}")).replace("_", " "), loc="left")


def looks(labels: Sequence[str]) -> list[dict[str, Any]]:
    """Return a line style for each label: colours by wheelset, dashes by side, so that lines differ in greyscale,
    too."""
    stems = [label.removesuffix(" left").removesuffix(" right") for label in labels]
    firsts = list(dict.fromkeys(stems))
    styles = []
    for label, stem in zip(labels, stems, strict=True):
        turn, color = divmod(firsts.index(stem), len(COLORS))
        dash = 2 * turn + label.endswith(" right")
        if stem == label:
            dash = firsts.index(stem)
        styles.append({"color": COLORS[color], "linestyle": DASHES[dash % len(DASHES)]})
    return styles
