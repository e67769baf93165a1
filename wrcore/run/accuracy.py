"""Measured Pareto front of computing speed and error: for each scene of the study, the choices that are not dominated
by another choice in both cost and error."""

from importlib.resources import files

import pandas as pd


def measured_front():
    """Return the shipped table of measured choices as a DataFrame.

    Columns are kind, speed_m_per_s, the fields of a choice, errors and real_time_factor. ``y_rms_m`` is the error of
    the lateral position, ``N_rms_relative`` the error of the wheels' normal force relative to its mean.
    """
    with files("wrcore").joinpath("run", "accuracy_front.csv").open(encoding="utf-8") as file:
        return pd.read_csv(file)
