"""The choice for a wanted accuracy, from measurements made up here."""

import pandas as pd
import pytest

from study.accuracy.front import front_markdown
from wrcore.errors import InputError
from wrcore.integrate.integrator import METHODS
from wrcore.run.accuracy import MARGIN, choose
from wrcore.scene.description import load_scene

ROWS = [
    # kind, speed, detection, patch, creep, method, rtol, error, real-time factor
    ("suspended_wheelset", 20.0, "planar", "moment", "she", "rk23", 1e-2, 1e-4, 5000.0),
    ("suspended_wheelset", 20.0, "spatial", "moment", "table 0.01", "rodas4", 1e-4, 1e-6, 2000.0),
    ("suspended_wheelset", 20.0, "spatial", "moment", "table 0.003", "rodas4", 1e-6, 1e-8, 500.0),
    ("suspended_wheelset", 60.0, "spatial", "moment", "table 0.01", "tsit5", 1e-4, 1e-6, 1000.0),
    ("vehicle", 20.0, "spatial", "moment", "table 0.01", "tsit5", 1e-5, 1e-7, 90.0),
]
COLUMNS = ["kind", "speed_m_per_s", "detection", "patch", "creep", "method", "rtol", "y_rms_m", "real_time_factor"]
FRONT = pd.DataFrame(ROWS, columns=COLUMNS)


def scene(name, speed):
    return load_scene(f"config/scenes/{name}.yaml", [f"speed={speed}"])


@pytest.mark.parametrize(("accuracy", "method"), [(1e-3, "rk23"), (2e-4, "rodas4"), (MARGIN * 1.001e-6, "rodas4")])
def test_the_fastest_that_is_accurate_enough_with_the_margin(accuracy, method):
    assert choose(scene("suspended_wheelset", 20.0), accuracy, FRONT)[0].method == method


def test_the_nearest_measured_speed_of_the_same_kind():
    assert choose(scene("suspended_wheelset", 50.0), 1e-5, FRONT)[0].method == "tsit5"
    assert choose(scene("suspended_wheelset", 30.0), 1e-5, FRONT)[0].method == "rodas4"  # in ratio nearer to 20 than 60
    choice, reason = choose(scene("trailer_vehicle", 80.0), 1e-5, FRONT)
    assert choice.rtol == 1e-5 and "vehicle" in reason and "20 m/s" in reason


def test_nothing_measured_for_this_kind():
    with pytest.raises(InputError, match="expected a suspended_wheelset or vehicle"):
        choose(scene("wheelset", 20.0), 1e-3, FRONT)


def test_the_measurements_of_the_package_serve_its_own_scene():
    choice, _ = choose(scene("suspended_wheelset", 20.0), 1e-5)
    assert choice.method in METHODS


def test_nothing_measured_is_that_accurate():
    with pytest.raises(InputError, match="3e-08 m"):
        choose(scene("suspended_wheelset", 20.0), 1e-9, FRONT)


def test_the_table_of_choices_has_a_row_for_each_accuracy_that_needs_another_choice():
    head, _, *rows = front_markdown(FRONT, [1e-3, 1e-4, 1e-6, 1e-9]).splitlines()
    assert head.count("|") == 6 and all(row.count("|") == 6 for row in rows)
    assert [row.split(" | ")[:2] for row in rows] == [
        ["| suspended wheelset, 20 m/s", "1 µm"],
        ["| suspended wheelset, 20 m/s", "100 µm"],
        ["| suspended wheelset, 60 m/s", "1 µm"],
        ["| vehicle, 20 m/s", "1 µm"],
    ]
    assert "planar, she, rk23, 0.01 | 1e+02 µm | 5e+03 |" in rows[1]
