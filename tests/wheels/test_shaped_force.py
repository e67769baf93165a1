"""Shape numbers of patches in runs: exact for two half parabolas, mirrored, zero where an overlap is symmetric."""

import math

import numpy as np
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC
from wrcore.analysis.contact.rolling_field import solve_patch
from wrcore.contact.search.reduction import (
    COSINE,
    CURVATURE_X,
    CURVATURE_Y,
    FX,
    FY,
    MZ,
    NORMAL,
    PATCH_COLUMNS,
    PENETRATION,
    SEMI_A,
    SEMI_B,
    Z,
)
from wrcore.creep.build import PSI_MAX
from wrcore.errors import InputError
from wrcore.kernels.handles import Handle
from wrcore.scene.compile import compile_scene
from wrcore.wheels import shaped_force as shaped_wheel
from wrcore.wheels.hertzian_force import patch_wrench
from wrcore.wheels.motion import WheelMotion
from wrcore.wheels.shaped_force import STEPS, overlap_skewness, shape_number

SCENE = ELLIPTIC / "suspended_wheelset.yaml"
SDEC = {"contact.creep.planes": "sdec", "contact.creep.tolerance": 0.05}


def moments_of_halves(psi, power):
    """Integral of e^power g^2 over half parabolas of depth 1 and widths 1 - psi and 1 + psi, by quadrature."""
    points, weights = np.polynomial.legendre.leggauss(20)
    t, w = 0.5 * (points + 1.0), 0.5 * weights
    return sum(width * np.sum(w * (side * width * t) ** power * (1.0 - t * t) ** 2)
               for side, width in ((-1.0, 1.0 - psi), (1.0, 1.0 + psi)))  # fmt: skip


@pytest.mark.parametrize("psi", [-0.9, -0.3, 0.0, 1e-3, 0.5, 0.95])
def test_shape_number_inverts_the_skewness_of_two_half_parabolas(psi):
    m0, m1, m2, m3 = (moments_of_halves(psi, k) for k in range(4))
    mean, square = m1 / m0, m2 / m0
    skewness = (m3 / m0 - 3 * square * mean + 2 * mean**3) / (square - mean**2) ** 1.5
    assert shape_number(skewness) == pytest.approx(psi, abs=1e-4)


def test_shape_number_ends_at_the_table():
    assert shape_number(5.0) == PSI_MAX
    assert shape_number(-5.0) == -PSI_MAX


def test_skewness_of_an_overlap_against_quadrature(monkeypatch):
    psi = 0.4

    def gap_at(_, __, u):
        width = 1.0 + psi if u > 0 else 1.0 - psi
        return (u / width) ** 2 - 1.0, 0.0

    monkeypatch.setattr(shaped_wheel, "gap_at", gap_at)
    found = overlap_skewness.py_func(None, None, 0.625 * psi, 1.0 / STEPS)
    assert shape_number(found) == pytest.approx(psi, abs=5e-3)


@pytest.mark.parametrize("psi", [-0.6, 0.5])
@pytest.mark.parametrize("creepages", [(0.0, 0.0, 1.0), (5e-4, 0.0, 1.0), (0.0, 5e-4, -0.7)])
def test_force_of_two_half_ellipses_against_the_solution_on_strips(psi, creepages):
    """Both with the load's centroid at the origin: a wrong sign of the shift to the middle errs by 20 % and more."""
    model, _ = compile_scene(wr.load_scene(SCENE, SDEC))
    speed, (xi, eta, phi), row = 20.0, creepages, np.zeros(PATCH_COLUMNS)
    row[[Z, PENETRATION, CURVATURE_X, CURVATURE_Y, COSINE]] = -0.46, 6e-5, 1.1, 1.4, 1.0
    velocity = speed, eta * speed, 0.0, 0.0, (1.0 - xi) * speed / 0.46, phi * speed
    patch_wrench(
        Handle(model.contact), WheelMotion(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, *velocity, 0.0, 0.0, 0.3), 0.0, 0.0, row, psi
    )
    a, b, load, limit = row[SEMI_A], row[SEMI_B], row[NORMAL], 0.3 * row[NORMAL]
    edges = np.linspace(-1.0, 1.0, 25) * b + 0.25 * b * psi  # the middle, seen from the load's centroid
    centre, crest = 0.5 * (edges[1:] + edges[:-1]), -0.75 * b * psi
    half = a * np.sqrt(1.0 - ((centre - crest) / (b * np.where(centre > crest, 1.0 + psi, 1.0 - psi))) ** 2)
    width, peak = np.diff(edges), half / np.sum(0.5 * np.pi * half**2 * np.diff(edges)) * load
    slip = xi - phi * centre, np.zeros(24), np.full(24, eta), np.full(24, phi)
    exact = solve_patch((centre, width, half, np.zeros(24), peak), slip, model.contact.shear_modulus, 0.3, "fine")
    found = np.array([row[FX], row[FY], row[MZ] / math.sqrt(a * b)]) / limit
    expected = np.array([exact.Fx, exact.Fs, exact.Mn / math.sqrt(a * b)]) / limit
    assert np.abs(found - expected).max() < 0.05  # the table's own tolerance
    assert np.hypot(*expected[:2]) > 0.2


def run(**changes):
    return wr.simulate(
        wr.load_scene(SCENE, {"speed": 30.0, "integration.duration": 0.5, "initial.y": 0.003, **changes})
    )


def test_mirrored_runs_have_mirrored_shape_numbers():
    one, other = run(**SDEC), run(**SDEC, **{"initial.y": -0.003})
    left, right = one.groups["wheelset/left"]["psi"][:, 0], other.groups["wheelset/right"]["psi"][:, 0]
    assert np.nanmax(np.abs(left)) > 0.02
    np.testing.assert_allclose(left, -right, atol=1e-4)  # steep where a lobe leaves
    y = one.groups["wheelset"]["y_m"]
    np.testing.assert_allclose(y, -other.groups["wheelset"]["y_m"], atol=1e-7)


@pytest.mark.check
def test_psi_moves_the_motion_but_little():
    plain, shaped = (run(**{**SDEC, "contact.creep.planes": planes}) for planes in ("ellipse", "sdec"))
    assert "psi" not in plain.groups["wheelset/left"]
    difference = np.abs(plain.groups["wheelset"]["y_m"] - shaped.groups["wheelset"]["y_m"]).max()
    assert 1e-7 < difference < 5e-4
    assert math.isfinite(difference)


@pytest.mark.parametrize("other", [{"contact.patch": "maximum"}, {"contact.creep.model": "polach"}])
def test_sdec_is_refused_where_it_means_nothing(other):
    with pytest.raises(InputError, match="contact.creep.planes"):
        wr.load_scene(SCENE, {**SDEC, **other})
