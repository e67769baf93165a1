"""A report of one or several runs as one HTML page: ``wr.report``."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import field as dataclass_field
from html import escape
from pathlib import Path
from typing import Annotated

import numpy as np

from wrcore.errors import InputError, check_number
from wrcore.errors.checked_calls import OneOf, checked
from wrcore.errors.new_files import appearing
from wrcore.reporting.page import Markup, element, join, page, paragraph
from wrcore.reporting.panels import swatch
from wrcore.reporting.sections import (
    about,
    accuracy,
    assessment,
    cost,
    figures,
    motion,
    profiles,
    spectra,
    track,
    wear,
    wheels,
)
from wrcore.reporting.subject import COLORS, MOST_RUNS, Report, Subject, labels_of
from wrcore.run.output.files import load_run
from wrcore.run.output.run import Run
from wrcore.scene.description import Source

SECTIONS = {
    "scene": about, "figures": figures, "track": track, "motion": motion, "forces": wheels, "contact": profiles,
    "assessment": assessment, "wear": wear, "spectra": spectra, "cost": cost, "accuracy": accuracy,
}  # fmt: skip
"""Sections by their anchors in the page, in their order."""

OVER = ("auto", "time", "distance")


@dataclass(frozen=True)
class ReportPage:
    """A report (``html``); a notebook shows it.

    Examples
    --------
    >>> ReportPage("<!doctype html>", ("scene",), ())
    ReportPage(sections=('scene',), omitted=())
    """

    html: str = dataclass_field(repr=False)
    sections: tuple[str, ...]
    """Anchors of the sections."""
    omitted: tuple[tuple[str, str], ...]
    """Parts that are left out, with the reasons."""

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the page to a file, which appears under its name only when it is complete."""
        with appearing(path) as file:
            file.write(self.html.encode())

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{escape(self.html)}" width="100%" height="800" frameborder="0"></iframe>'


@checked
def report(
    runs: Run | str | os.PathLike[str] | Sequence[Run | str | os.PathLike[str]],
    channels: Sequence[str] = (),
    begin: float = 0.0,
    over: Annotated[str, OneOf(OVER)] = "auto",
    accuracy: bool = True,
    freight: bool = False,
    scene: Source | None = None,
    trust: bool = False,
) -> ReportPage:
    """Make a report of one or several runs: one HTML page without scripts, which any browser shows and prints.

    Sections for which the runs have no data are left out; the end of the page names them with the reason.

    Parameters
    ----------
    runs : Run, str, Path or sequence of these
        Runs or their files, at most 6. Tables have a column for each run, and figures a line.
    channels : sequence of str
        Channels that are drawn, such as ``"car_body.y_m"``; by default lateral position and yaw of wheelsets and the
        motion of the first other body.
    begin : float
        Start of the evaluation, s. Figures show the whole run.
    over : {"auto", "time", "distance"}
        Horizontal axis of figures. ``auto``: distance if curves, irregularity or a crossing lie along the track or if
        the runs have different speeds.
    accuracy : bool
        Whether the errors of the runs are estimated. The beginning of each run is integrated again with a smaller
        tolerance, and its contact is compared with exact contact (:func:`wrcore.contact_errors`). This takes some
        seconds; the first time the kernels of exact contact are compiled, which takes about a minute.
    freight : bool
        Whether the limits of freight wagons apply (EN 14363).
    scene : Scene, str, Path or dict, optional
        Scene of a single run; by default it is read from the description in the run.
    trust : bool
        Whether laws of the user that a run file names may be executed, to integrate its beginning again.

    Returns
    -------
    ReportPage
        ``.write("report.html")`` writes it; ``.html`` is its text.

    Raises
    ------
    InputError
        If a file is not a run, if there is no run or more than 6, if a run has no output times, if a run does not have
        one of the channels, or if ``begin`` is outside a run.

    Examples
    --------
    >>> import wrcore as wr
    >>> run = wr.simulate(wr.example("suspended_wheelset"), integration__duration=0.2)
    >>> page = wr.report(run, accuracy=False)
    >>> page.sections
    ('scene', 'figures', 'track', 'motion', 'forces', 'contact', 'wear', 'cost')
    >>> page.html.count("<script")
    0
    """
    given = [runs] if isinstance(runs, Run | str | os.PathLike) else list(runs)
    if not 1 <= len(given) <= MOST_RUNS:
        raise InputError("report", "runs", f"expected 1 to {MOST_RUNS} runs, got {len(given)}")
    if scene is not None and len(given) > 1:
        raise InputError("report", "scene", "expected a scene with a single run only")
    loaded = [one if isinstance(one, Run) else load_run(one) for one in given]
    names = ["" if isinstance(one, Run) else Path(one).stem for one in given]
    for run, name in zip(loaded, names, strict=True):
        if len(run.t) < 2:
            raise InputError("report", name or "run", "expected a run with at least two output times")
        check_number(begin, min(0.0, run.t[0]), run.t[-2], "report", "begin", "s")
    labels = labels_of(loaded, names)
    subjects = [Subject(*parts, scene, trust) for parts in zip(loaded, labels, COLORS, strict=False)]
    _check_channels(subjects, channels)
    over = _over(subjects) if over == "auto" else over
    return _page(Report(subjects, begin, tuple(channels), over, accuracy, freight))


def _check_channels(subjects: list[Subject], channels: Sequence[str]) -> None:
    from wrcore.analysis.pictures.plot_run import values_of

    for name in channels:
        for subject in subjects:
            try:
                values_of(subject.run, name)
            except InputError as error:
                raise InputError("report", error.field, error.expected) from None


def _over(subjects: list[Subject]) -> str:
    """Return what figures are drawn over: distance if the track varies along it or the speeds differ, else time."""
    speeds = {str(subject.data.get("speed")) for subject in subjects}
    tracks = [about.part(subject.data, "track") for subject in subjects]
    varies = any(track.get("path", "tangent") != "tangent" or track.get("irregularity") or track.get("crossing")
                 for track in tracks)  # fmt: skip
    placed = all({"x_m", "s_m"} & channels.keys() for s in subjects for name, channels in s.run.groups.items()
                 if f"{name}/left" in s.run.groups)  # fmt: skip
    return "distance" if (varies or len(speeds) > 1) and placed else "time"


def _page(report: Report) -> ReportPage:
    found = []
    for anchor, module in SECTIONS.items():
        try:
            content = module.section(report)
        except Exception as error:  # one section must not prevent the others
            report.omit(module.TITLE, error)
            continue
        if content:
            found.append((anchor, module.TITLE, content))
    if report.omitted:
        reasons: dict[str, list[str]] = {}
        for part, reason in report.omitted:
            reasons.setdefault(reason, []).append(part)
        items = [element("li", element("strong", "; ".join(parts)), f": {reason}") for reason, parts in reasons.items()]
        found.append(("omitted", "Not in this report", element("ul", *items)))
    title = f"Report: {', '.join(report.labels)}"
    versions = sorted({str(s.run.settings.get("wrcore_version", "")) for s in report.subjects} - {""})
    text = "Made by wrcore" + (f" from runs of version {', '.join(versions)}" if versions else "")
    text += ". y and ΣY are positive to the left, Y of a wheel to the field side, z upwards."
    footer = element("footer", paragraph(text, class_="note"))
    html = page(title, _header(report), found, footer)
    return ReportPage(html, tuple(anchor for anchor, _, _ in found if anchor != "omitted"), tuple(report.omitted))


def _header(report: Report) -> Markup:
    """Return title, runs with their colours, and how they ended."""
    items = []
    for subject in report.subjects:
        run = subject.run
        state = element("span", run.status, class_="status" if run.status == "completed" else "status bad")
        reason = f": {run.reason}" if run.reason else ""
        speed = subject.data.get("speed")
        at = f", {speed:g} m/s at the beginning" if isinstance(speed, int | float) and np.isfinite(speed) else ""
        mark = swatch(subject.color) if report.several else ""
        name = join([element("strong", subject.label), " "]) if report.several else ""
        limits = ", ".join(cost.exceeded(subject))
        about_limits = f"Limits of the models exceeded: {limits}." if limits else "No limit of the models was exceeded."
        note = element("small", about_limits if "patches" in run.counters else "")
        items.append(element("li", mark, name, state, f"{reason}, {run.t[-1] - run.t[0]:g} s{at}. ", note))
    title = report.labels[0] if not report.several else f"{len(report.labels)} runs side by side"
    kind = element("p", "Report of a simulation" if not report.several else "Report of simulations", class_="kind")
    return element("header", kind, element("h1", title.replace("_", " ")), join([element("ul", *items, class_="runs")]))
