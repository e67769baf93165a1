"""Section of a report: plan and profile of the track."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from wrcore.geometry.irregularity import irregularity_at
from wrcore.geometry.path import centreline
from wrcore.geometry.path_pieces import CANT_BASE
from wrcore.geometry.track import build_track
from wrcore.reporting.page import Markup, figure, grid, join, paragraph
from wrcore.reporting.panels import legend, line, panel
from wrcore.reporting.sections.about import part
from wrcore.reporting.subject import Report, Subject
from wrcore.run.motion import path_of

TITLE = "Track"

SAMPLES = 600
"""Number of positions along the track at which it is drawn."""

ROUGH = ("alignment", "longitudinal level", "cross level", "gauge")


class Line(NamedTuple):
    """The track of a run over the arc length."""

    s: np.ndarray
    """Arc length, m."""
    profile: dict[str, np.ndarray]
    """By name in `PROFILE`, in SI units; quantities that are zero everywhere are omitted."""
    plan: np.ndarray
    """Position on the ground, shape (n, 2), m."""
    rough: dict[str, np.ndarray]
    """Irregularity by name, m."""


PROFILE = {
    "curvature": (1e3, "curvature / (1/km)", "Curvature, positive to the left."),
    "cant": (1e3, "cant / mm", "Cant: height of the right rail above the left rail."),
    "gradient": (1e3, "gradient / ‰", "Gradient of the centre line, upwards positive."),
    "height": (1.0, "height / m", "Height of the centre line."),
    "widening": (1e3, "widening / mm", "Gauge widening."),
    "friction": (1.0, "friction", "Coefficient of friction of the rails."),
}
"""Factor to the printed unit, label and caption of each quantity."""


def section(report: Report) -> Markup:
    """Return plan, profile and irregularity of the tracks; a sentence where all are straight, level and smooth."""
    lines = [(subject, found) for subject, found in report.each(TITLE, _line) if found is not None]
    if not lines:
        return Markup("")
    shown = [(subject, found) for subject, found in lines if found.profile or found.rough]
    if not shown:
        return paragraph("Straight, level track without irregularity.")
    parts = [_plan(lines)] if any("curvature" in found.profile for _, found in lines) else []
    for name, (factor, label, caption) in PROFILE.items():
        curves = [(subject, found.s, factor * found.profile[name]) for subject, found in lines if name in found.profile]
        parts.append(_panel(curves, label, caption))
    for name in ROUGH:
        curves = [(subject, found.s, 1e3 * found.rough[name]) for subject, found in lines if name in found.rough]
        parts.append(_panel(curves, f"{name} / mm", f"Irregularity: {name}{MEANT.get(name, '')}."))
    shared = legend([(s.label, s.color, False) for s in report.subjects]) if report.several else Markup("")
    return join([shared, grid(parts)])


MEANT = {
    "alignment": ", mean of both rails to the left", "longitudinal level": ", mean of both rails upwards",
    "cross level": ", left rail above right rail", "gauge": ", change from the nominal gauge",
}  # fmt: skip


def _panel(curves: list[tuple[Subject, np.ndarray, np.ndarray]], label: str, caption: str) -> Markup:
    if not curves:
        return Markup("")

    def draw(axes: Any) -> None:
        for subject, s, values in curves:
            line(axes, s, values, color=subject.color)
        axes.set(xlabel="distance / m", ylabel=label, xmargin=0)

    return figure(panel(draw, f"{label} over the distance"), caption)


def _plan(lines: list[tuple[Subject, Line]]) -> Markup:
    def draw(axes: Any) -> None:
        for subject, found in lines:
            axes.plot(*found.plan.T, color=subject.color)
            axes.plot(*found.plan[0], "o", color=subject.color, markersize=3.5)
        axes.set(xlabel="x / m", ylabel="y / m")
        axes.set_aspect("equal", adjustable="datalim")

    return figure(panel(draw, "Plan of the track"), "Plan of the track, true to scale; the dot is its beginning.")


def _line(subject: Subject) -> Line | None:
    """Return the track between the ends of a run; None if the run has no positions."""
    run = subject.run
    places = [channels.get("s_m", channels.get("x_m")) for name, channels in run.groups.items() if "/" not in name]
    known = [place for place in places if place is not None and np.isfinite(place).any()]
    if not known:
        return None
    low, high = min(np.nanmin(place) for place in known), max(np.nanmax(place) for place in known)
    s, path = np.linspace(low, max(high, low + 1.0), SAMPLES), path_of(run)
    stations = [centreline(path, float(at)) for at in s]
    columns = {name: np.array([getattr(one, name) for one in stations]) for name in ("x", "y", "z", "curvature")}
    profile = {
        "curvature": columns["curvature"],
        "cant": -CANT_BASE * np.array([one.sin_roll for one in stations]),
        "gradient": np.array([one.slope for one in stations]),
        "widening": np.array([one.widening for one in stations]),
    }
    if part(run.scene, "track").get("gradients"):
        profile["height"] = columns["z"]
    profile |= _friction(run, s)
    return Line(
        s, {name: values for name, values in profile.items() if np.ptp(values) > 1e-9 or np.abs(values).max() > 1e-9},
        np.column_stack([columns["x"], columns["y"]]), _rough(subject, s),
    )  # fmt: skip


def _friction(run: Any, s: np.ndarray) -> dict[str, np.ndarray]:
    """Return the friction over the arc length if it varies along the track."""
    friction = part(part(run.scene, "contact"), "friction")
    if "arc_length" in friction and "mu" in friction:
        return {"friction": np.interp(s, friction["arc_length"], friction["mu"])}
    return {}


def _rough(subject: Subject, s: np.ndarray) -> dict[str, np.ndarray]:
    """Return the irregularity at arc lengths by name; empty without irregularity, or where it is a user's law."""
    described = part(part(subject.data, "track"), "irregularity")
    if not described or "own" in described:
        return {}
    if "points" in described:
        data = subject.scene.track.irregularity  # its files are found with the scene
    else:
        track = {key: value for key, value in subject.data["track"].items() if key not in ("support", "crossing")}
        data = build_track(track, "report").irregularity
    out, rows = np.zeros((3, 4)), np.zeros((len(s), 4))
    for row, at in zip(rows, s, strict=True):
        irregularity_at(data, float(at), out)
        row[:] = out[0]
    return {name: values for name, values in _named(rows).items() if np.ptp(values) > 0.0}


def _named(rows: np.ndarray) -> dict[str, np.ndarray]:
    """Return means and differences of both rails by their names in `ROUGH`, m, from channels (n, 4) in the order of
    `wrcore.geometry.irregularity.CHANNELS`."""
    left_y, left_z, right_y, right_z = rows.T
    return dict(zip(ROUGH, (0.5 * (left_y + right_y), 0.5 * (left_z + right_z), left_z - right_z, left_y - right_y),
                    strict=True))  # fmt: skip
