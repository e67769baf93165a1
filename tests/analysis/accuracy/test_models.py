"""Errors of models apart from those of integration, on motions whose answers are known."""

import numpy as np
import pandas as pd
import pytest

from tests.analysis.accuracy.test_choices import worn_run
from wrcore.analysis.accuracy import choices as errors
from wrcore.analysis.accuracy import models
from wrcore.analysis.accuracy.plot_choices import speed_against_error

CHOICES = [
    errors.Choice("spatial", "moment", "table 0.01", "rk23", 1e-3),
    errors.Choice("planar", "moment", "she", "rk23", 1e-3),
]


def shifted(by, **kwargs):
    run = worn_run(**kwargs)
    run.groups["wheelset"]["y_m"] = run["wheelset"].y_m + by
    return run


def test_a_longer_run_is_compared_up_to_the_end_of_the_shorter_one():
    long, short = shifted(1e-5, duration=4.0), worn_run(duration=2.0)
    assert errors.run_errors(long, short, short.t[-1])["y_rms_m"] == pytest.approx(1e-5)


def test_normal_and_guiding_force_have_errors_of_their_own():
    run, reference = worn_run(), worn_run()
    run.groups["wheelset/left"]["N_N"][:, 0] *= 1.01
    found = errors.run_errors(run, reference)
    assert found["N_rms_relative"] == pytest.approx(0.01 / np.sqrt(2.0))
    assert found["Y_rms_N"] == pytest.approx(89.0 * np.sin(0.03) / np.sqrt(2.0))


def test_every_choice_gets_the_error_of_its_model():
    tight = {models.model_of(choice): shifted(by) for choice, by in zip(CHOICES, (1e-5, 3e-4), strict=True)}
    table = pd.DataFrame([choice._asdict() for choice in (*CHOICES, CHOICES[0]._replace(method="rk45"))])
    found = models.with_model_errors(table, tight, worn_run(duration=1.0))
    assert found["model_y_rms_m"].to_numpy() == pytest.approx([1e-5, 3e-4, 1e-5])
    assert models.with_model_errors(table, tight)["model_y_rms_m"].isna().all()


def test_models_are_listed_once_after_exact_contacts_own_resolution():
    tight = {models.model_of(choice): shifted(1e-5) for choice in CHOICES}
    table = pd.DataFrame([choice._asdict() for choice in (*CHOICES, *CHOICES)])
    table = models.with_model_errors(table, tight, worn_run())
    own = models.exact_row(worn_run(), shifted(2e-6))
    found = models.model_table({"one": table, "other": table}, {"one": own})
    assert found["patch"].tolist() == ["exact, coarser", "moment", "moment"] and set(found["scene"]) == {"one"}
    assert found["model_y_rms_m"].iloc[0] == pytest.approx(2e-6)
    assert models.model_table({}, {}).empty


def test_the_chart_shows_both_errors_in_words():
    tight = {models.model_of(choice): shifted(1e-5) for choice in CHOICES}
    table = pd.DataFrame([choice._asdict() for choice in CHOICES])
    table = models.with_model_errors(table, tight, worn_run())
    table = table.assign(status="completed", y_rms_m=1e-6, integration_y_rms_m=1e-7, real_time_factor=100.0, wall_s=0.1)
    figure = speed_against_error({"one": table}, "table 0.01", {"one": 1e-9}, {"one": 1e-6})
    texts = {text.get_text() for legend in figure.legends for text in legend.get_texts()}
    assert {"error of the integration", "error of the model", "resolution of exact contact"} <= texts
