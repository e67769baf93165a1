"""Choose detection, creep law, integrator and tolerance for a wanted accuracy, from measured speed against error.

The measurements are a table that the study writes and the package carries: for each of its scenes, the choices that no
other choice beats in both cost and error. A scene of one's own is matched to the measured one of the same kind at the
nearest speed.
"""

import math
from importlib.resources import files
from typing import NamedTuple

import pandas as pd

from wrcore.errors import InputError

ATOL_PER_RTOL = 1e-3
"""Absolute tolerance (m, m/s, rad/s) for a relative one of 1."""


class Choice(NamedTuple):
    """One way to run a scene."""

    detection: str
    patch: str
    creep: str
    """Creep law; a table with the 99 % error it is built for, as in ``table 0.01``."""
    method: str
    rtol: float

    def overrides(self):
        """Changes to a scene, as :func:`wrcore.load_scene` takes them."""
        law, _, tolerance = self.creep.partition(" ")
        changes = [
            f"contact.detection={self.detection}",
            f"contact.patch={self.patch}",
            f"contact.creep.model={law}",
            f"integration.method={self.method}",
            f"integration.rtol={self.rtol:g}",
            f"integration.atol={ATOL_PER_RTOL * self.rtol:g}",
        ]
        return [*changes, f"contact.creep.tolerance={tolerance}"] if tolerance else changes


def kind_of(scene):
    """``vehicle``, ``suspended_wheelset`` or ``free_wheelset``."""
    vehicle = scene.vehicle
    if len(vehicle.body_names) > len(vehicle.wheelset_names):
        return "vehicle"
    return "suspended_wheelset" if len(vehicle.elements.pairs) else "free_wheelset"


MARGIN = 3.0
"""A choice must have been this much more accurate than asked for: the scene at hand is not the measured one."""


def measured_front():
    """The table that the package carries: kind, speed_m_per_s, the fields of a choice, y_rms_m and real_time_factor."""
    with files("wrcore").joinpath("run", "accuracy_front.csv").open(encoding="utf-8") as file:
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
