"""Choose detection, creep law, integrator and tolerance for a wanted accuracy, from measured speed against error.

The measurements are a table that the study writes and the package carries: for each of its scenes, the choices that no
other choice beats in both cost and error. A scene of one's own is matched to the measured one of the same kind at the
nearest speed.
"""

import math
from importlib.resources import files

import pandas as pd

from wrcore.analysis_accuracy import Choice, kind_of
from wrcore.errors import InputError

MARGIN = 3.0
"""A choice must have been this much more accurate than asked for: the scene at hand is not the measured one."""


def measured_front():
    """The table that the package carries: kind, speed_m_per_s, the fields of a choice, y_rms_m and real_time_factor."""
    with files("wrcore").joinpath("data", "accuracy_front.csv").open(encoding="utf-8") as file:
        return pd.read_csv(file)


def choose(scene, accuracy, front=None):
    """The cheapest measured choice whose error is small enough.

    Parameters
    ----------
    scene : Scene
    accuracy : float
        Largest RMS error of the wheelsets' lateral position that is accepted, m.
    front : pandas.DataFrame, optional
        Measurements; by default those that the package carries.

    Returns
    -------
    choice : Choice
    reason : str
        One line: which measurement it rests on.

    Raises
    ------
    InputError
        If nothing measured is that accurate; names the best that is.
    """
    front = measured_front() if front is None else front
    kind, speed = kind_of(scene), float(scene.data["speed"])
    same = front[front["kind"] == kind]
    if not len(same):
        measured = " or ".join(sorted(set(front["kind"])))
        raise InputError("--accuracy", f"{accuracy:g}", f"expected a {measured}; nothing was measured for a {kind}")
    nearest = min(same["speed_m_per_s"].unique(), key=lambda v: abs(math.log(v / speed)))
    same = same[same["speed_m_per_s"] == nearest]
    enough = same[MARGIN * same["y_rms_m"] <= accuracy]
    if not len(enough):
        best = MARGIN * same["y_rms_m"].min()
        raise InputError("--accuracy", f"{accuracy:g}", f"expected at least {best:.2g} m for a {kind} at {speed:g} m/s")
    row = enough.loc[enough["real_time_factor"].idxmax()]
    choice = Choice(*(row[name] for name in Choice._fields))
    reason = (
        f"{choice.detection} detection, {choice.patch} reduction, creep {choice.creep}, {choice.method} at rtol"
        f" {choice.rtol:g}: erred by {row['y_rms_m']:.2g} m at {row['real_time_factor']:.0f} times real time when"
        f" measured for a {kind} at {nearest:g} m/s"
    )
    return choice, reason.replace("_", " ")


def front_markdown(front=None, accuracies=(1e-4, 1e-5, 1e-6, 1e-7)):
    """The fastest measured choice for each accuracy as a table in Markdown, as the README quotes it.

    Parameters
    ----------
    front : pandas.DataFrame, optional
        Measurements; by default those that the package carries.
    accuracies : sequence of float
        RMS errors of the lateral position, m; left out are those that nothing reaches and those for which the choice
        is that of the next smaller one.

    Returns
    -------
    str
    """
    front = measured_front() if front is None else front
    head = ("scene", "error below", "detection, creep, method, rtol", "error", "times real time")
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for (kind, speed), rows in front.groupby(["kind", "speed_m_per_s"], sort=False):
        last = None
        for accuracy in sorted(accuracies):
            enough = rows[rows["y_rms_m"] <= accuracy]
            if not len(enough):
                continue
            row = enough.loc[enough["real_time_factor"].idxmax()]
            line = (
                f"{row['detection']}, {row['creep']}, {row['method']}, {row['rtol']:g} |"
                f" {1e6 * row['y_rms_m']:.2g} µm | {row['real_time_factor']:.3g} |"
            )
            scene = f"| {kind.replace('_', ' ')}, {speed:g} m/s | {1e6 * accuracy:g} µm | "
            if line != last:
                lines.append(scene + line)
            last = line
    return "\n".join(lines)
