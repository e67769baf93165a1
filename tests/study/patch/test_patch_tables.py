"""Tables of patch models, on numbers whose answers are known."""

import numpy as np
import pandas as pd
import pytest

from study.contact.tables import study_pair
from study.patch import page, reference, tables
from tests.conftest import ROOT
from wrcore.analysis.contact.loaded import Found, Rolling
from wrcore.contact.search import reduction as columns

PAIR = {"wheel": "S1002", "rail": "UIC60-MBench", "inclination": 0.025, "gauge": 1.435, "rolling_radius": 0.46,
        "half_distance": 0.75}  # fmt: skip


def found(normal, xi, y, angle=0.0, fy=0.0, p_max=1e9):
    row = np.zeros(columns.PATCH_COLUMNS)
    row[[columns.NORMAL, columns.XI, columns.Y, columns.ANGLE]] = normal, xi, y, angle
    row[[columns.FX, columns.FY, columns.P_MAX]] = 1e3, fy, p_max
    return Found(row, (0.0, 0.0, 0.0), 0.0, 0.0)


def test_a_wheel_is_the_sum_of_its_patches():
    patches = [found(3e4, 1e-3, 0.75), found(1e4, -1e-3, 0.71, np.pi / 2, 2e3, 2e9)]
    wheel = tables.carried(patches, Rolling(20.0, 40.0))
    assert (wheel.normal, wheel.p_max) == (4e4, 2e9)
    assert wheel.lateral == pytest.approx(0.74) and wheel.radius == pytest.approx(0.5 * (1 - 0.5e-3))
    assert wheel.creep == pytest.approx([2e3, 0.0, 2e3])
    assert np.isnan(tables.carried([], Rolling(20.0, 40.0)).radius)


def cone(slope=0.05, load=1e4):
    """Radii of a left wheel that is a cone, by shift."""
    y = np.linspace(-0.006, 0.006, 25)
    return pd.DataFrame({"load_N": load, "model": "cone", "y_m": y, "radius_m": 0.46 + slope * y})


def test_a_cone_has_its_slope_as_conicity_at_every_amplitude():
    differences = tables.radius_differences(cone())
    assert differences["slope"].to_numpy() == pytest.approx(np.full(12, 0.05))
    found = tables.conicity_under_load(differences, [0.001, 0.0033, 0.006, 0.007])
    assert found["conicity"][:3].to_numpy() == pytest.approx(np.full(3, 0.05), rel=1e-4)
    assert np.isnan(found["conicity"][3])


def test_a_cubic_difference_has_three_quarters_of_its_end_as_conicity():
    table = cone()
    table["radius_m"] = 0.46 + 1e3 * table["y_m"] ** 3
    found = tables.conicity_under_load(tables.radius_differences(table), [0.006])
    assert found["conicity"][0] == pytest.approx(0.75 * 1e3 * 0.006**2, rel=0.01)


def test_summary_has_median_and_worst_place_of_each_zone():
    places = pd.DataFrame({"load_N": [1e4] * 4, "y_m": [-0.001, 0.0, 0.001, 0.005], "model": "moment"})
    for name in list(tables.QUANTITIES)[:4]:
        places[name] = [0.01, -0.03, 0.02, 0.5]
    forces = places.assign(same_motion=0.1, same_creepage=0.2)
    both = pd.concat([places.assign(model=tables.REFERENCE), places])
    costs = pd.DataFrame({"model": ["moment"], "us_per_patch": [1.5]})
    found = tables.summary(both, forces, {"centre": (-0.001, 0.001), "all": (-1.0, 1.0)}, costs)
    row = found[(found["quantity"] == "normal force at equal height") & (found["zone"] == "centre")].iloc[0]
    assert (row["count"], row["worst_y_m"], row["us_per_patch"]) == (3, 0.0, 1.5)
    assert (row["median"], row["worst"]) == pytest.approx((2.0, 3.0))
    assert set(found["model"]) == {"moment"} and len(found) == 2 * len(tables.QUANTITIES)


def test_exact_contact_is_nearer_to_contact_than_ellipses():
    cases = pd.read_csv(ROOT / "tests/data/contact/mbench_contact.csv", comment="#")
    some = cases[(cases["set"] == "load10kN") & cases["y_ws_mm"].isin([0, 2])]
    models = {"moment": {"model": "moment"}, "exact": {"model": "exact", "resolution": "fine"}}
    geometry = study_pair(PAIR).left.geometry
    found = reference.distributions(reference.compare_with_contact(geometry, some, models))
    worst = found.pivot(index="quantity", columns="model", values="worst")
    assert (worst.loc["normal force at CONTACT's height", "exact"]) < 0.3
    assert (worst["exact"] <= worst["moment"]).all()
    assert set(found["cases"]) == {len(some)}


@pytest.mark.parametrize(("roll", "yaw"), [(0.0, 0.02), (0.01, 0.0), (0.01, -0.024)])
def test_angles_describe_the_same_axle(roll, yaw):
    one, other = reference.angles_of_contact(roll, yaw)
    axle = -np.sin(other) * np.cos(one), np.cos(other) * np.cos(one), np.sin(one)
    assert axle == pytest.approx((-np.sin(yaw), np.cos(yaw) * np.cos(roll), np.cos(yaw) * np.sin(roll)))


def test_the_page_has_a_table_of_each_zone_and_vehicle():
    spread = {"count": 3, "median": 0.123, "q95": 1.0, "worst": 20.0, "unit": "%"}
    summary = pd.DataFrame([{"model": "moment", "zone": "tread", "quantity": "force", "us_per_patch": 0.44} | spread])
    conicity = pd.DataFrame({"load_N": 5e4, "model": ["moment", tables.REFERENCE], "amplitude_m": 1e-3,
                             "conicity": [0.2, 0.25]})  # fmt: skip
    contact = pd.DataFrame([{"set": "A22", "model": "moment", "quantity": "length"} | spread])
    models = pd.DataFrame({"vehicle": ["trailer_vehicle"], "model": ["exact"]}).assign(**dict.fromkeys(page.RUNS, 0.5))
    text = page.page(summary, conicity, contact, models)
    assert "0.12 / 1 / 20" in text and "moment (0.44 µs)" in text and "trailer vehicle" in text
    assert text.index(tables.REFERENCE) < text.index("0.250") < text.index("0.200")
