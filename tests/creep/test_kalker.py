"""Linear coefficients against CONTACT, against Kalker's table, and against their own refinement."""

import numpy as np
import pytest

from tests.creep.conftest import read
from tests.creep.kalker_grid import extrapolated_coefficients
from wrcore.creep.kalker import kalker_coefficients, kalker_data

NAMES = ["C11", "C22", "C23", "C33"]


def coefficients(nu, ratios):
    data = kalker_data(nu)
    return np.array([kalker_coefficients(g, data) for g in ratios])


def test_agree_with_contact():
    """CONTACT's own accuracy is stated as 0.5 % (C11, C22, C23) and 1.5 % (C33), half of that at nu = 0.28."""
    rows = read("kalker_coefficients").query("nu == 0.28")
    error = abs(coefficients(0.28, rows.a_over_b) / rows[NAMES].to_numpy() - 1).max(axis=0)
    assert np.all(error < [0.005, 0.005, 0.005, 0.01])


@pytest.mark.parametrize("nu", [0, 0.25, 0.5])
def test_agree_with_kalkers_table(nu):
    """Two or three printed digits (C33 recalled, about 1 %)."""
    rows = read("kalker_table")
    rows = rows[np.isclose(rows.a_over_b.to_numpy()[:, None], [0.2, 0.5, 1, 2, 5]).any(axis=1)]
    printed = rows[[f"{name}_nu{nu:g}" for name in NAMES]].to_numpy()
    assert len(rows) == 5
    assert abs(coefficients(nu, rows.a_over_b) / printed - 1).max() < 0.011


@pytest.mark.parametrize("nu, g", [(0.28, 0.1), (0.05, 1.3), (0.28, 10.0), (0.5, 0.3)])
def test_stored_values_are_converged(nu, g):
    """Another pair of refinements, at ratios and nu between the stored ones, changes less than 0.2 %."""
    fresh = extrapolated_coefficients(g, nu, (24, 40))
    assert abs(coefficients(nu, [g])[0] / fresh - 1).max() < 0.002


def test_slender_limits():
    """a/b -> 0: C11 -> pi^2/(4 (1 - nu)), C22 -> pi^2/4 (Kalker's asymptotes); a/b = 1/32 is within 1 %."""
    c11, c22, _, _ = coefficients(0.28, [1 / 32])[0]
    assert c11 == pytest.approx(np.pi**2 / (4 * 0.72), rel=0.01)
    assert c22 == pytest.approx(np.pi**2 / 4, rel=0.01)


def test_smooth_in_the_axis_ratio():
    """No jump or kink at a node of the spline: second differences shrink with the square of the step."""
    for step in (1e-3, 1e-4):
        ratios = np.exp(np.log(2.0) + step * np.array([-1.0, 0.0, 1.0]))
        assert abs(np.diff(coefficients(0.28, ratios), 2, axis=0)).max() < 20 * step**2


def test_impossible_poisson_ratio_is_refused():
    with pytest.raises(ValueError, match="expected 0 to 0.5, got 0.6"):
        kalker_data(0.6)
