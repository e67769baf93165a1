"""Rise and slip of one patch by another one through the half-space, against sums over pressures and tractions."""

import math

import numpy as np
import pytest

from wrcore.contact.half_space_coupling import Ellipse, rise_by_pressure, slip_by_friction

ONE, OTHER = Ellipse(0.0, 0.0, 0.0, 4e-3, 2e-3, 1.0, 0.0), Ellipse(2e-3, 1.4e-2, 0.0, 5e-3, 1.5e-3, 1.0, 0.0)
NU = 0.28


def points(ellipse, kind, n=60):
    """Places (n^2, 2), m, on an ellipse and their shares of Hertz's pressure, or of that under a rigid punch."""
    r, angle = (np.arange(n) + 0.5) / n, (np.arange(2 * n) + 0.5) * math.pi / n
    radius = np.sqrt(1.0 - r**2) if kind == "punch" else np.sqrt(1.0 - (1.0 - r) ** (2.0 / 3.0))
    x, y = (np.outer(radius, part(angle)).ravel() for part in (np.cos, np.sin))
    return np.column_stack([ellipse.x + ellipse.a * x, ellipse.y + ellipse.b * y])


def mean_inverse(one, other):
    """Mean of 1/r over a punch's pressure on one ellipse and Hertz's on the other, 1/m."""
    p, q = points(one, "punch", 16), points(other, "hertz", 16)
    return np.mean(1.0 / np.linalg.norm(p[:, None] - q[None], axis=2))


def test_rise_is_the_mean_of_the_inverse_distance():
    value, slope = rise_by_pressure(ONE, OTHER)
    assert value == pytest.approx(mean_inverse(ONE, OTHER), rel=5e-3)
    h = 1e-4
    moved = [mean_inverse(ONE._replace(y=y), OTHER) for y in (-h, h)]
    assert slope == pytest.approx((moved[1] - moved[0]) / (2.0 * h), rel=3e-2)


def test_rise_far_away_is_that_of_a_point_load():
    far = OTHER._replace(x=0.1, y=0.2)
    assert rise_by_pressure(ONE, far)[0] == pytest.approx(1.0 / math.hypot(0.1, 0.2), rel=1e-3)


def cerruti(dx, dy, fx, fy):
    """Displacement times pi G at (dx, dy) from a point force (Johnson, Contact Mechanics, 3.75 with z = 0)."""
    r = np.hypot(dx, dy)
    ux = fx * ((1.0 - NU) / r + NU * dx**2 / r**3) + fy * NU * dx * dy / r**3
    uy = fy * ((1.0 - NU) / r + NU * dy**2 / r**3) + fx * NU * dx * dy / r**3
    return ux, uy


@pytest.mark.parametrize(("fx", "fy"), [(1.0, 0.0), (0.0, 1.0)])
def test_slip_by_friction_is_the_fall_of_the_displacement_along_x(fx, fy):
    p, q, h = points(ONE, "hertz", 16), points(OTHER, "hertz", 16), 1e-5
    d = p[:, None] - q[None]
    ahead, back = (cerruti(d[..., 0] + s * h, d[..., 1], fx, fy) for s in (1.0, -1.0))
    expected = [-np.mean(a - b) / (2.0 * h) for a, b in zip(ahead, back, strict=True)]
    found = slip_by_friction(NU, ONE, OTHER, fx, fy, 0.0)
    np.testing.assert_allclose(found, expected, atol=0.03 * np.abs(expected).max())


def test_slip_by_a_moment_is_that_of_forces_across():
    """On a slender patch a friction moment is one of forces across it: positive ahead, negative behind."""
    one, slender, h = ONE._replace(a=1e-3, b=1e-3), Ellipse(0.0, 1.4e-2, 0.0, 4e-3, 3e-4, 1.0, 0.0), 1e-5
    p, q = points(one, "hertz", 16), points(slender, "hertz", 16)
    d, share = p[:, None] - q[None], q[:, 0] / np.sum(q[:, 0] ** 2)  # of 1 N m
    ahead, back = (cerruti(d[..., 0] + s * h, d[..., 1], 0.0, share)[1] for s in (1.0, -1.0))
    expected = -np.mean(np.sum(ahead - back, axis=1)) / (2.0 * h)
    xi, eta = slip_by_friction(NU, one, slender, 0.0, 0.0, 1.0)
    assert xi == 0.0 and eta == pytest.approx(expected, rel=0.15)
