"""A wheel over the nose of a crossing: on a table whose numbers are known, and at a few places."""

import numpy as np
import pandas as pd
import pytest

from study.crossings.figures import fig_nose
from study.crossings.nose import over_the_nose, summary, wheel_on_crossing
from tests.conftest import SCENES
from wrcore.geometry.changing_rails.crossing import Crossing
from wrcore.scene.description import load_scene


def made():
    place = np.linspace(0.0, 0.1, 11)
    parts = [
        pd.DataFrame({
            "model": name, "place_m": place, "z_m": 0.46 + lift, "p_max_Pa": pressure, "cpu_s": seconds,
            "share_of_nose": np.clip(20.0 * (place - late), 0.0, 1.0),
        })
        for name, lift, late, pressure, seconds in (("exact", 0.0, 0.03, 2e9, 0.02), ("other", 1e-5, 0.04, 3e9, 0.01))
    ]  # fmt: skip
    return pd.concat(parts, ignore_index=True)


def test_deviations_are_from_the_first_model():
    found = summary(made()).set_index("model")
    assert found.loc["exact", ["height_largest_m", "goes_over_later_m", "p_max_deviation"]].tolist() == [0.0, 0.0, 0.0]
    assert found.loc["other", "height_median_m"] == pytest.approx(1e-5)
    assert found.loc["other", "goes_over_later_m"] == pytest.approx(0.01)
    assert found.loc["other", "p_max_deviation"] == pytest.approx(0.5)
    assert found.loc["other", "cpu_s"] == 0.01


def test_the_figure_shows_what_the_table_has():
    axes = fig_nose(made()).axes
    assert [ax.get_ylabel() for ax in axes] == ["wheel centre / mm", "share of the nose", "greatest pressure / GPa"]
    np.testing.assert_allclose(axes[0].lines[1].get_ydata(), 0.01, rtol=1e-9)
    assert axes[2].lines[0].get_ydata()[0] == pytest.approx(2.0)


def test_the_nose_takes_the_load_over_where_it_has_risen():
    pair = wheel_on_crossing(load_scene(SCENES / "crossing.yaml"))
    assert pair.rail.begins()[0] == pytest.approx(Crossing().nose_begins)
    models = {"moment": {"patch": "moment", "detection": "spatial"}}
    table = over_the_nose(pair, models, np.array([-0.05, 0.01, 0.25]), 54546.0, 0.0)
    assert table.share_of_nose.tolist() == pytest.approx([0.0, 0.0, 1.0], abs=1e-6)
    assert table.z_m.iloc[1] < table.z_m.iloc[0]
    assert (table.cpu_s > 0.0).all()
