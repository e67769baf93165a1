"""Runs as trees of xarray: the groups, channels and units of the run."""

import sys

import numpy as np
import pytest

import wrcore as wr
from tests.synthetic import hunting_run


def test_a_tree_has_the_groups_and_channels_with_units():
    pytest.importorskip("xarray")
    run = hunting_run(flange_at=1.0)
    tree = run.to_xarray()
    assert {path.strip("/") for path in tree.groups} == {"", *run.keys()}
    assert tree["wheelset"].y_m.dims == ("t_s",) and tree["wheelset/left"].N_N.dims == ("t_s", "patch")
    for group in run:
        assert set(tree[group].data_vars) == set(run.groups[group])
        for name, values in run.groups[group].items():
            np.testing.assert_array_equal(tree[group][name], values)
    assert tree["wheelset"].y_m.attrs["units"] == "m" and "lateral" in tree["wheelset"].y_m.attrs["long_name"]
    late = tree["wheelset"].y_m.sel(t_s=slice(3.0, None))
    assert late.size == np.sum(run.t >= 3.0) and tree.attrs["status"] == "completed" and tree.attrs["method"] == "rk45"


def test_without_xarray_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(wr.InputError, match="to_xarray: xarray: expected it installed: pip install xarray$"):
        hunting_run().to_xarray()
