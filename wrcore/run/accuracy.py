"""Measured speed against error: for each scene of the study, the choices that no other one beats in cost and error."""

from importlib.resources import files

import pandas as pd


def measured_front():
    """The table that the package carries: kind, speed_m_per_s, the fields of a choice, errors, real_time_factor.

    ``y_rms_m`` is that of the lateral position, ``N_rms_relative`` that of the wheels' normal force over its mean.
    """
    with files("wrcore").joinpath("run", "accuracy_front.csv").open(encoding="utf-8") as file:
        return pd.read_csv(file)
