"""The table of measured choices, from measurements made up here."""

import pandas as pd

from docs.page_tables import front_markdown

ROWS = [
    # kind, speed, detection, patch, creep, method, rtol, errors of y and N, real-time factor
    ("suspended_wheelset", 20.0, "planar", "moment", "she", "rk23", 1e-2, 1e-4, 2e-3, 5000.0),
    ("suspended_wheelset", 20.0, "spatial", "moment", "table 0.01", "rodas4", 1e-4, 1e-6, 2e-3, 2000.0),
    ("suspended_wheelset", 20.0, "spatial", "moment", "table 0.003", "rodas4", 1e-6, 1e-8, 2e-3, 500.0),
    ("suspended_wheelset", 60.0, "spatial", "moment", "table 0.01", "tsit5", 1e-4, 1e-6, 2e-3, 1000.0),
    ("vehicle", 20.0, "spatial", "moment", "table 0.01", "tsit5", 1e-5, 1e-7, 2e-3, 90.0),
]
COLUMNS = ["kind", "speed_m_per_s", "detection", "patch", "creep", "method", "rtol", "y_rms_m", "N_rms_relative",
           "real_time_factor"]  # fmt: skip
FRONT = pd.DataFrame(ROWS, columns=COLUMNS)


def test_the_table_of_choices_has_a_row_for_each_accuracy_that_needs_another_choice():
    head, _, *rows = front_markdown(FRONT, [1e-3, 1e-4, 1e-6, 1e-9]).splitlines()
    assert head.count("|") == 7 and all(row.count("|") == 7 for row in rows)
    assert [row.split(" | ")[:2] for row in rows] == [
        ["| suspended wheelset, 20 m/s", "1 µm"],
        ["| suspended wheelset, 20 m/s", "100 µm"],
        ["| suspended wheelset, 60 m/s", "1 µm"],
        ["| vehicle, 20 m/s", "1 µm"],
    ]
    assert "planar, she, rk23, 0.01 | 1e+02 µm | 0.2 % | 5e+03 |" in rows[1]
