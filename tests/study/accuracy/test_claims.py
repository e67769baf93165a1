"""What reports/accuracy.md promises: medians and worst cases of stated cases."""

import pandas as pd
import pytest

from study.accuracy.claims import claims, claims_markdown, contact_claims, creep_claims, speed_claims
from tests.conftest import ROOT


def test_each_claim_names_its_cases_and_its_worst():
    contact = pd.DataFrame({
        "set": "light", "reduction": "moment", "y_m": [0.0, -0.006, 0.009], "lateral_m": [1e-6, -3e-6, 8e-6],
        "height_equal_normal_m": 0.0, "height_equal_load_m": 0.0, "p_max_relative": -0.1,
    })  # fmt: skip
    found = contact_claims(contact).set_index(["what", "cases"])
    assert found.loc[("lateral contact position", "CONTACT, light"), "worst"] == pytest.approx(8e-3)
    near = found.loc[("lateral contact position", "CONTACT, light, y up to 6 mm")]
    assert (near["count"], near["median"], near["worst"]) == (2, pytest.approx(2e-3), pytest.approx(3e-3))
    creep = pd.DataFrame({"cases": ["a", "b"], "model": "Polach", "against": "CONTACT", "force_error": [0.1, 0.4]})
    rows = creep_claims(creep).set_index("cases")
    assert rows.loc["CONTACT, all", "worst"] == pytest.approx(40.0) and rows.loc["CONTACT, a", "count"] == 1
    front = pd.read_csv(ROOT / "wrcore" / "run" / "accuracy_front.csv")
    patches = pd.DataFrame({"model": ["exact, coarse"], "zone": "everywhere", "quantity": "normal force", "unit": "%",
                            "count": 4, "median": 0.1, "q95": 0.2, "worst": 0.3, "worst_y_m": 0.0})  # fmt: skip
    whole = claims(contact, creep, patches, front)
    assert "Polach" in claims_markdown(whole) and len(whole) == 8 + 3 + 1 + len(speed_claims(front))
    assert whole[whole["of"] == "exact, coarse"]["cases"].tolist() == ["poses everywhere"]
