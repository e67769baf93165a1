"""Splines of small tables, against scipy's."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from wrcore.geometry.spline import clamped_cubics, spline_cubics, spline_slopes


@pytest.mark.parametrize("nodes", [4, 5, 30])
def test_the_spline_is_scipys_that_is_no_knot_at_its_ends(nodes):
    values = np.random.default_rng(nodes).normal(size=(nodes, 3))
    expected = CubicSpline(0.3 * np.arange(nodes), values)
    np.testing.assert_allclose(spline_slopes(0.3, values), expected(0.3 * np.arange(nodes), 1), atol=1e-12)
    np.testing.assert_allclose(spline_cubics(0.3, values), np.moveaxis(expected.c[::-1], 0, 1), atol=1e-11)


@pytest.mark.parametrize("nodes", [2, 3, 30])
def test_clamped_spline_equals_that_of_scipy(nodes):
    random = np.random.default_rng(nodes)
    x, values = np.cumsum(random.uniform(0.1, 1.0, nodes)), random.normal(size=(nodes, 4))
    expected = CubicSpline(x, values, bc_type="clamped")
    np.testing.assert_allclose(clamped_cubics(x, values), np.moveaxis(expected.c[::-1], 0, 1), rtol=1e-11, atol=1e-11)
