"""Section of a report: positions of contact on the profiles of wheels and rails."""

from __future__ import annotations

from typing import Any

import numpy as np

from wrcore.geometry.track import SIDES
from wrcore.reporting.page import Markup, figure, grid, join, paragraph
from wrcore.reporting.panels import legend, panel
from wrcore.reporting.subject import Report, Subject

TITLE = "Contact positions"

BIN = 5e-4
"""Width of the parts of a profile in which patches are counted, m."""

LARGEST = 60.0
"""Area of the mark for a position at which all patches lie, points squared."""

GAP = 4e-3
"""Distance by which the wheel is drawn above its rail, m."""

MOST = 2
"""Largest number of wheelsets that are drawn."""


def section(report: Report) -> Markup:
    """Return the profiles of the first wheelsets with the positions at which they had contact."""
    parts = [_panel(report, name, side) for name in report.wheelsets[:MOST] for side in SIDES]
    if not any(parts):
        return Markup("")
    shared = legend([(s.label, s.color, False) for s in report.subjects]) if report.several else Markup("")
    text = (
        "Profiles of wheel (black) and rail (grey), seen in the direction of travel. The area of a mark is the share "
    )
    text += f"of the patches in {1e3 * BIN:g} mm of the profile; wheel and rail are drawn {1e3 * GAP:g} mm apart."
    return join([paragraph(text), shared, grid(parts, "two")])


def _panel(report: Report, wheelset: str, side: str) -> Markup:
    having = [subject for subject in report.subjects if wheelset in subject.wheelsets]
    curves = [
        (subject, *found) for subject, found in report.each(
            f"Contact positions of {wheelset}/{side}",
            lambda subject: _found(report, subject, wheelset, side) if subject in having else None,
        ) if found is not None
    ]  # fmt: skip
    if not curves:
        return Markup("")
    sign = SIDES[side]

    def draw(axes: Any) -> None:
        _, pair, _ = curves[0]
        apart = pair.half_distance - pair.rail_distance  # of the origins of both profiles, at a centred wheelset
        drawn = [(pair.rail, "u_rail_m", 0.0, 0.0, "0.55"), (pair.wheel, "u_wheel_m", apart, GAP, "0.2")]
        for curve, channel, aside, up, shade in drawn:
            u = np.linspace(curve.u[0], curve.u[-1], 200)
            axes.plot(-sign * 1e3 * (u + aside), 1e3 * (curve(u) + up), color=shade, linewidth=1.2)
            for subject, _, shares in curves:
                places, share = shares[channel]
                look = {"color": subject.color, "alpha": 0.55, "linewidths": 0, "zorder": 3}
                size = LARGEST * share + 2.0
                axes.scatter(-sign * 1e3 * (places + aside), 1e3 * (curve(places) + up), s=size, **look)
        ticks = np.arange(-75.0, 76.0, 25.0)
        axes.set_xticks(ticks, [f"{-sign * tick + 0.0:g}" for tick in ticks])
        axes.set(xlabel="lateral coordinate of the rail / mm", ylabel="height / mm", xlim=(-85.0, 85.0))

    label = f"Contact positions of {wheelset} {side}"
    return figure(panel(draw, label), f"{wheelset.replace('_', ' ')}, {side} wheel.")


def _found(report: Report, subject: Subject, wheelset: str, side: str) -> tuple[Any, dict[str, Any]]:
    """Return the pair of a wheel, and by channel the positions (m) of its patches on a profile and their shares."""
    scene = subject.scene
    pair, late = scene.pair(side, scene.vehicle.wheelset_names.index(wheelset)), report.late(subject)
    shares = {}
    for channel in ("u_rail_m", "u_wheel_m"):
        values = subject.run[f"{wheelset}/{side}"][channel][late]
        cells, counts = np.unique(np.round(values[np.isfinite(values)] / BIN), return_counts=True)
        shares[channel] = BIN * cells, counts / max(counts.sum(), 1)
    return pair, shares
