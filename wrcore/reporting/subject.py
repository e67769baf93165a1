"""Runs of a report: their labels, colours and scenes, and what the report leaves out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from wrcore.analysis.assessment.wheels import output_times_after, wheelsets_of
from wrcore.errors import InputError
from wrcore.reporting.panels import BINS, LEAST_BINS
from wrcore.run.output.run import Run
from wrcore.scene.description import Scene, Source, scene_of

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#333333")
"""Colours of runs (Okabe-Ito)."""

MOST_RUNS = len(COLORS)

SIDE_COLORS = {"left": "#0072B2", "right": "#D55E00"}
"""Colours of the sides if the report has one run; with several runs lines of right wheels are dashed."""

MOST_WHEELSETS = 4
"""Largest number of wheelsets that are drawn."""

SIZE = 1.5e6
"""Size of all lines of a page, bytes, from which the number of points of a line follows."""

POINT = 14.0
"""Size of a point of a line, bytes."""

Found = TypeVar("Found")


@dataclass
class Subject:
    """A run with its label and colour."""

    run: Run
    label: str
    color: str
    source: Source | None = None
    trust: bool = False

    @cached_property
    def scene(self) -> Scene:
        """Scene of the run; InputError if its files are not found or differ."""
        return scene_of(self.run, self.source, "report", self.trust)

    @property
    def data(self) -> dict[str, Any]:
        """Content of the run's scene."""
        return self.run.scene

    @cached_property
    def wheelsets(self) -> list[str]:
        """Names of all wheelsets."""
        return wheelsets_of(self.run)


@dataclass
class Report:
    """What all sections need: the runs, the options, and the list of parts that are left out."""

    subjects: list[Subject]
    begin: float = 0.0
    channels: Sequence[str] = ()
    over: str = "time"
    accuracy: bool = True
    freight: bool = False
    omitted: list[tuple[str, str]] = field(default_factory=list)
    """Part of the report, and why it is not there."""

    @property
    def labels(self) -> list[str]:
        """Labels of the runs."""
        return [subject.label for subject in self.subjects]

    @property
    def several(self) -> bool:
        """Whether the report has more than one run."""
        return len(self.subjects) > 1

    @cached_property
    def wheelsets(self) -> list[str]:
        """Wheelsets that are drawn: all that some run has, or `MOST_WHEELSETS` of them from the first to the last."""
        names = list(dict.fromkeys(name for subject in self.subjects for name in subject.wheelsets))
        if len(names) <= MOST_WHEELSETS:
            return names
        return [names[i] for i in np.unique(np.linspace(0, len(names) - 1, MOST_WHEELSETS).round().astype(int))]

    @cached_property
    def bins(self) -> int:
        """Number of bins of a line with which all lines of wheels together have about `SIZE` bytes."""
        lines = len(self.subjects) * (12 * len(self.wheelsets) + 12 + len(self.channels))
        return int(np.clip(SIZE / (2.0 * POINT * max(lines, 1)), LEAST_BINS, BINS))

    def each(self, part: str, function: Callable[[Subject], Found]) -> Iterator[tuple[Subject, Found]]:
        """Yield each run with the result of a function of it; runs to which the function does not apply are left out,
        and the report says why."""
        for subject in self.subjects:
            try:
                yield subject, function(subject)
            except Exception as error:  # a damaged run must not prevent the report of the others
                self.omit(f"{part}, {subject.label}" if self.several else part, error)

    def omit(self, part: str, error: Exception | str) -> None:
        """Note that a part of the report is left out, and why."""
        reason = str(error) or type(error).__name__
        if isinstance(error, InputError):
            named = f"{error.field}: " if error.field not in ("", "run", "scene", "EN 14363") else ""
            reason = f"{named}{error.expected}"
        if isinstance(error, Exception) and not isinstance(error, InputError):
            reason = f"{type(error).__name__}: {reason}"
        if (part, reason) not in self.omitted:
            self.omitted.append((part, " ".join(reason.split())))

    def abscissa(self, subject: Subject, group: str) -> np.ndarray:
        """Return time (s) or the distance along the track (m) of a body, by the option ``over``."""
        if self.over == "time":
            return subject.run.t
        channels = subject.run.groups.get(group.rpartition("/")[0] or group, {})
        found = channels.get("s_m", channels.get("x_m"))
        if found is None:
            raise InputError("report", "over", f"expected a position along the track of {group}")
        return found

    @property
    def abscissa_label(self) -> str:
        """Label of the axis that `abscissa` belongs to."""
        return "time / s" if self.over == "time" else "distance / m"

    def late(self, subject: Subject) -> np.ndarray:
        """Whether each output time of a run is evaluated, shape (n,)."""
        return output_times_after(subject.run, self.begin, "report")


def labels_of(runs: Sequence[Run], names: Sequence[str]) -> list[str]:
    """Return a label for each run: its scene's name, or the name of its file if scenes' names are equal; numbered if
    these are equal, too."""
    labels = [str(run.scene.get("name", "run")) for run in runs]
    if len(set(labels)) < len(labels):
        labels = [name or label for name, label in zip(names, labels, strict=True)]
    if len(set(labels)) < len(labels):
        labels = [f"{label} ({number})" for number, label in enumerate(labels, 1)]
    return labels
