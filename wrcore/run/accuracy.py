"""Measured speed against error: for each scene of the study, the choices that no other one beats in cost and error."""

from importlib.resources import files
from typing import NamedTuple

import pandas as pd


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
            "integration.atol=0",
        ]
        return [*changes, f"contact.creep.tolerance={tolerance}"] if tolerance else changes


def kind_of(scene):
    """``vehicle``, ``suspended_wheelset`` or ``free_wheelset``."""
    vehicle = scene.vehicle
    if len(vehicle.body_names) > len(vehicle.wheelset_names):
        return "vehicle"
    return "suspended_wheelset" if len(vehicle.elements.pairs) else "free_wheelset"


def measured_front():
    """The table that the package carries: kind, speed_m_per_s, the fields of a choice, errors, real_time_factor.

    ``y_rms_m`` is that of the lateral position, ``N_rms_relative`` that of the wheels' normal force over its mean.
    """
    with files("wrcore").joinpath("run", "accuracy_front.csv").open(encoding="utf-8") as file:
        return pd.read_csv(file)
