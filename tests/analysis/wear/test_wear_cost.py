"""Cost of a distance: its parts add up, the whole is in proportion."""

import pytest

from wrcore.analysis.wear.cost import cost_table


def test_parts_add_up():
    table = cost_table("config/wear/smoke.yaml", 5e4, 5e5).set_index("part")
    parts = table.loc[["simulate", "wear", "rest"]]
    assert (parts["cpu_s"] > 0.0).all() and parts["share"].sum() == pytest.approx(1.0)
    assert table.loc["all", "extrapolated_cpu_h"] == pytest.approx(table.loc["all", "cpu_s"] * 10.0 / 3600.0)
    assert (table["steps"] >= 1).all() and table["wall_s"].nunique() == 1
