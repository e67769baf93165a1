"""Distributions that the comparison with CONTACT prints."""

import numpy as np
import pandas as pd

from tests.contact.patch.compare_contact import comparable, distributions


def test_worst_case_and_percentages_are_those_of_the_errors():
    table = pd.DataFrame({"name": ["a", "b"], "side": "left", "y": 0.002, "yaw": 0.0, "normal": [1e-3, -3e-3],
                          "p_max": [0.0, 0.0], "force": np.nan, "surface_force": [0.02, 0.01]})  # fmt: skip
    found = distributions(table).set_index("quantity")
    assert len(found) == 3 and found["cases"].eq(2).all()
    row = found.loc["normal force at CONTACT's height"]
    assert np.allclose([row["median"], row["worst"]], [0.2, 0.3]) and row["in"].startswith("b (left, y 2 mm")
    assert found.loc["creep force, whole model", "in"].startswith("a")


def test_joined_and_light_cases_are_left_out():
    cases = comparable("mbench_contact")
    assert len(cases) > 50 and all(c.patches == 1 and not c.subset.startswith("light") for c in cases)
    assert not any(4.8e-3 < c.sign * c.y < 5.2e-3 for c in cases)
