"""Checks that a figure is legible: texts must not overlap, cross the page's edge or cover a line."""

import warnings
from itertools import combinations
from pathlib import Path

import numpy as np

from wrcore.analysis.pictures import style

BORDER = 1.0
"""Accepted overlap of texts with each other and with the page's edge, points."""


def save_figure(figure, *paths):
    """Write a figure with `style.save_figure`, with a UserWarning for each illegible text."""
    style.save_figure(figure, *paths)
    for finding in findings(figure):
        warnings.warn(f"figure {Path(paths[0]).name}: {finding}", stacklevel=2)


def findings(figure):
    """Return the list of faults of a figure, one line each.

    Faults are a text beyond the page, two overlapping texts, a text or legend on a line or mark, a duplicate entry of a
    legend, and an axis without numbers. Texts and numbers of three-dimensional axes are not checked.
    """
    figure.draw_without_rendering()
    border = BORDER * figure.dpi / 72.0
    boxes = [(_words(text), _box(text).padded(-border)) for text in _texts(figure)]
    page = figure.bbox.padded(2.0 * border)  # the boxes are smaller than their texts by the border
    found = [f"{words!r} leaves the page" for words, box in boxes if not _within(box, page)]
    for (one, box), (other, there) in combinations(boxes, 2):
        if box.overlaps(there):
            found.append(f"{one!r} and {other!r} overlap")
    legends = _legends(figure)
    for legend in legends:
        entries = [text.get_text() for text in legend.get_texts()]
        found += [f"the legend says {entry!r} twice" for entry in sorted(set(entries)) if entries.count(entry) > 1]
    for axes in figure.axes:
        found += [f"{name} axis of {axes.get_ylabel()!r} has no numbers" for name in "xy" if _mute(axes, name)]
        fixed = [("the legend", legend.get_window_extent()) for legend in legends if legend.axes is axes]
        fixed += [
            (repr(_words(text)), _box(text))
            for text in axes.texts
            if text.get_visible() and text.get_text().strip() and text.get_transform() == axes.transAxes
        ]
        found += [f"{name} covers {what}" for name, box in fixed for what in _covered(axes, box.padded(-border))]
    return found


def _legends(figure):
    from matplotlib.legend import Legend

    return [legend for legend in figure.findobj(Legend) if legend.get_visible()]


def _words(text):
    return " ".join(text.get_text().split())


def _within(box, page):
    return page.x0 <= box.x0 and page.y0 <= box.y0 and box.x1 <= page.x1 and box.y1 <= page.y1


def _box(text):
    """Return the bounding box of a text (pixels) without the arrow of an annotation."""
    from matplotlib.text import Text

    return Text.get_window_extent(text)


def _texts(figure):
    """Return the visible texts of a figure."""
    from matplotlib.text import Text

    hidden = {label for axes in figure.axes for axis in (axes.xaxis, axes.yaxis) for label in _undrawn(axes, axis)}
    seen = []
    for text in figure.findobj(Text):
        flat = not hasattr(text.axes, "get_zlim")
        if text.get_visible() and text.get_text().strip() and text not in hidden and flat and _shown(text):
            seen.append(text)
    return seen


def _undrawn(axes, axis):
    """Yield the labels of ticks beyond the ends of an axis, and all labels of axes that are switched off."""
    low, high = sorted(axis.get_view_interval())
    room = 1e-9 * (high - low)
    for tick in [*axis.get_major_ticks(), *axis.get_minor_ticks()]:
        if not axes.axison or not axes.get_visible() or not low - room <= tick.get_loc() <= high + room:
            yield from (tick.label1, tick.label2)
    if not axes.axison or not axes.get_visible():
        yield from (axis.label, axis.get_offset_text())


def _mute(axes, name):
    """Whether an axis with ticks shows no number although its labels are switched on.

    Inner panels have their labels switched off and are no fault."""
    axis = axes.xaxis if name == "x" else axes.yaxis
    side = ("bottom", "top") if name == "x" else ("left", "right")
    asked = [axis.get_tick_params(which="major").get(f"label{end}", False) for end in side]
    if hasattr(axes, "get_zlim") or not (axes.axison and axes.get_visible() and axis.get_visible() and any(asked)):
        return False
    hidden, ticks = set(_undrawn(axes, axis)), [*axis.get_major_ticks(), *axis.get_minor_ticks()]
    labels = [label for tick in ticks for label in (tick.label1, tick.label2)]
    return bool(ticks) and not any(
        label.get_visible() and label.get_text().strip() and label not in hidden for label in labels
    )


def _shown(text):
    """Whether the position of a text is inside the visible range of its panel."""
    axes = text.axes
    if axes is None:
        return True
    place = getattr(text, "xy", text.get_position())
    at = getattr(text, "xycoords", None)
    inside = axes.transData if at == "data" else text.get_transform() if at is None else None
    clipped = (text.get_clip_on() and text.get_clip_box() is not None) or at == "data"
    return not clipped or inside is None or bool(axes.bbox.padded(1.0).contains(*inside.transform(place)))


def _covered(axes, box):
    """Yield the lines, marks and bars of a panel that intersect a box (pixels)."""
    for line in axes.lines:
        if not line.get_visible() or not len(line.get_xydata()):
            continue
        places = line.get_transform().transform(line.get_xydata())
        solid = line.get_linestyle() not in ("None", "none", "", " ")
        if any(box.contains(*place) for place in places) or (solid and _crosses(places, box)):
            yield f"the line {line.get_label()!r}"
    for marks in axes.collections:
        offsets = np.ma.filled(np.ma.asarray(marks.get_offsets(), float), np.nan)
        if marks.get_visible() and marks.get_offset_transform() == axes.transData and offsets.size > 2:
            if any(box.contains(*place) for place in axes.transData.transform(offsets)):
                yield f"the marks {marks.get_label()!r}"
    for bar in axes.patches:
        if bar.get_visible() and bar.get_zorder() > 0 and bar.get_window_extent().overlaps(box):
            yield f"the bar {bar.get_label()!r}"


def _crosses(places, box):
    """Whether a polyline with gaps (pixels) intersects a box."""
    from matplotlib.path import Path

    whole = np.isfinite(places).all(axis=1)
    for part in np.split(np.arange(len(places)), np.flatnonzero(~whole)):
        part = part[whole[part]]
        if len(part) > 1 and Path(places[part]).intersects_bbox(box, filled=False):
            return True
    return False
