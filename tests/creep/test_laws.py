"""The simple laws: published numbers, and the two limits that all laws share."""

import numpy as np
import pytest

from wrcore.creep.fastsim import fastsim
from wrcore.creep.kalker import kalker_coefficients, kalker_data
from wrcore.creep.laws import LAWS, creep_data, creep_force
from wrcore.creep.table import ensure_table

A, B, N, MU, G = 8e-3, 4e-3, 82e3, 0.3, 82e9
SIMPLE = [name for name in LAWS if name != "table"]


def scaled(eta, phi_per_m):
    """Creepages of the patch of CONTACT's example "fastsim" (a = 8 mm, b = 4 mm, 82 kN, mu = 0.3), nondimensional."""
    c = np.sqrt(A * B)
    factor = G * c * c / (MU * N)
    return 0.0, eta * factor, phi_per_m * c * factor


@pytest.fixture(scope="module")
def data():
    return creep_data(0.28, ensure_table().kernel_data(), grid=200)


def lateral(law, data, eta, phi):
    return creep_force(LAWS[law], data, A / B, 0.0, *scaled(eta, phi))[1]


@pytest.mark.parametrize(
    "law, published, tolerance", [("linear", -0.670, 0.002), ("she", -0.532, 0.001), ("polach", -0.647, 0.001)]
)
def test_example_of_contact(data, law, published, tolerance):
    """FACTS 6.4-6.6: lateral creepage -6.25e-4 with spin 0.625/m."""
    assert lateral(law, data, -6.25e-4, 0.625) == pytest.approx(published, abs=tolerance)


@pytest.mark.parametrize(
    "phi, published, tolerance", [(0.1, -0.1589, 5e-4), (0.3, -0.445, 1e-3), (0.625, -0.730, 1e-3)]
)
def test_polach_with_pure_spin(data, phi, published, tolerance):
    assert lateral("polach", data, 0.0, phi) == pytest.approx(published, abs=tolerance)


@pytest.mark.parametrize("adhesion, slip", [(1.0, 1.0), (1.0, 0.4), (0.3, 0.1)])
def test_polach_reduced_in_adhesion_and_slip(adhesion, slip):
    """FACTS 6.5 and Polach (2005): (2/pi) (k_A e/(1 + (k_A e)^2) + atan(k_S e)), e = (pi/4) C11 xi' without spin."""
    data, g = creep_data(0.28, factors=(adhesion, slip)), 1.7
    c11 = kalker_coefficients(g, data.table.kalker)[0]
    for xi in (1e-6, 0.3, 2.0, 40.0):
        e = 0.25 * np.pi * c11 * xi
        exact = 2 / np.pi * (adhesion * e / (1 + (adhesion * e) ** 2) + np.arctan(slip * e))
        assert creep_force(LAWS["polach"], data, g, 0.0, xi, 0.0, 0.0)[0] == pytest.approx(-exact, rel=1e-14)
    slope = -creep_force(LAWS["polach"], data, g, 0.0, 1e-6, 0.0, 0.0)[0] / 1e-6
    assert slope == pytest.approx(0.5 * (adhesion + slip) * c11, rel=1e-6)  # of Kalker's


def test_pure_lateral_creepage(data):
    """FACTS 6.5: Polach 0.317, FASTSIM 0.299 of mu N (FASTSIM depends on the grid: 1.5 %)."""
    assert lateral("polach", data, 6.25e-4, 0.0) == pytest.approx(-0.317, abs=0.001)
    assert lateral("fastsim", data, 6.25e-4, 0.0) == pytest.approx(-0.299, abs=0.005)


def rectangular_fastsim(data, elements, elliptic):
    """FASTSIM on a rectangular grid over the bounding box, as the published numbers were made; Fy/(mu N)."""
    xi, eta, phi = scaled(-6.25e-4, 0.625)
    c11, c22, c23, _ = kalker_coefficients(A / B, data.table.kalker)
    a, b = np.sqrt(A / B), np.sqrt(B / A)
    dx, dy = 2 * a / elements, 2 * b / elements
    y = -b + (np.arange(elements) + 0.5) * dy
    px, py, total = np.zeros(elements), np.zeros(elements), 0.0
    for x in a - (np.arange(elements) + 0.5) * dx:
        height = np.maximum(1 - (x / a) ** 2 - (y / b) ** 2, 0)
        bound = 1.5 / np.pi * np.sqrt(height) if elliptic else 2 / np.pi * height
        px = px - (3 * c11 / (8 * a) * xi - 4 * c23 / (np.pi * a * a) * phi * y) * dx
        py = py - (3 * c22 / (8 * a) * eta + 4 * c23 / (np.pi * a * a) * phi * x) * dx
        scale = np.minimum(1, bound / np.maximum(np.hypot(px, py), 1e-300))
        px, py = px * scale, py * scale
        total += py.sum() * dx * dy
    return total


@pytest.mark.parametrize("elliptic, published", [(False, -0.6383), (True, -0.5953)])
def test_fastsim_example(data, elliptic, published):
    """FACTS 6.4 at 200 x 200: a plain rectangular grid gives the published number, and tends to our strips' value."""
    assert rectangular_fastsim(data, 200, elliptic) == pytest.approx(published, abs=2e-4)
    ours = creep_data(0.28, grid=200, elliptic=elliptic)
    coarse, fine = rectangular_fastsim(data, 400, elliptic), rectangular_fastsim(data, 800, elliptic)
    assert lateral("fastsim", ours, -6.25e-4, 0.625) == pytest.approx(2 * fine - coarse, abs=0.005)


@pytest.mark.parametrize("grid", [1, 3, 10, 40])
@pytest.mark.parametrize("elliptic", [False, True])
def test_fastsim_bears_no_more_than_friction(grid, elliptic):
    """Its cells' bounds carry mu N: all of it in full slip, to rounding, and never more."""
    data, rng = creep_data(0.28, grid=grid, elliptic=elliptic), np.random.default_rng(3)
    for g in (0.1, 1.0, 3.7, 10.0):
        for psi in (0.0, -0.6):
            full = fastsim(data.fastsim, data.table.kalker, g, psi, 3e6, -4e6, 0.0)
            assert np.hypot(*full[:2]) == pytest.approx(1.0, abs=1e-12)
            for xi, eta, phi in rng.normal(size=(100, 3)) * 10.0 ** rng.uniform(-1, 3, (100, 3)):
                forces = fastsim(data.fastsim, data.table.kalker, g, psi, xi, eta, phi)
                assert np.hypot(*forces[:2]) <= 1.0 + 1e-14


def test_fastsim_on_a_skewed_patch():
    """Full slip carries mu N whatever the shape, and mirroring the shape mirrors the force."""
    data = creep_data(0.28, grid=60)
    settings, kalker = data.fastsim, data.table.kalker
    assert fastsim(settings, kalker, 0.7, 0.8, 1e6, 0.0, 0.0)[0] == pytest.approx(-1, abs=2e-3)
    fx, fy, mz = fastsim(settings, kalker, 0.7, 0.8, 0.2, 0.1, 0.5)
    assert fastsim(settings, kalker, 0.7, -0.8, 0.2, -0.1, -0.5) == pytest.approx((fx, -fy, -mz), abs=1e-12)


@pytest.mark.parametrize("law", list(LAWS))
@pytest.mark.parametrize("g", [0.2, 1.0, 5.0])
def test_every_law_starts_as_linear_theory(data, law, g):
    """Translation only: Polach combines the stiffnesses with spin in its own way; FASTSIM's grid costs 0.1 %."""
    c11, c22, _, _ = kalker_coefficients(g, kalker_data(0.28))
    size = 1e-7
    assert creep_force(LAWS[law], data, g, 0.0, size, 0.0, 0.0)[0] / size == pytest.approx(-c11, rel=1e-3)
    assert creep_force(LAWS[law], data, g, 0.0, 0.0, size, 0.0)[1] / size == pytest.approx(-c22, rel=1e-3)


@pytest.mark.parametrize("law", ["linear", "she", "fastsim", "table"])
def test_spin_starts_as_linear_theory(data, law):
    """Lateral force by spin; FASTSIM's flexibility L3 is chosen for it (grid 0.5 %)."""
    _, _, c23, _ = kalker_coefficients(1.0, kalker_data(0.28))
    assert creep_force(LAWS[law], data, 1.0, 0.0, 0.0, 0.0, 1e-7)[1] / 1e-7 == pytest.approx(-c23, rel=5e-3)


@pytest.mark.parametrize("law", ["she", "polach", "fastsim", "table"])
@pytest.mark.parametrize("g", [0.2, 1.0, 5.0])
def test_every_bounded_law_ends_at_coulomb(data, law, g):
    """abs(F) = mu N; against the slip, but along the linear force for the two laws that keep its direction (SHE by
    design, FASTSIM by its two flexibilities). 1 % for the table's interpolation and FASTSIM's strips."""
    c11, c22, _, _ = kalker_coefficients(g, data.table.kalker)
    against = np.array([-6.0, 8.0]) * ([c11, c22] if law in ("she", "fastsim") else [1, 1])
    fx, fy, _, _ = creep_force(LAWS[law], data, g, 0.0, 6e5, -8e5, 0.0)
    assert (fx, fy) == pytest.approx(tuple(against / np.hypot(*against)), abs=0.01)


@pytest.mark.parametrize("law", list(LAWS))
def test_no_creepage_no_force(data, law):
    assert creep_force(LAWS[law], data, 1.3, 0.0, 0.0, 0.0, 0.0)[:3] == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("law", list(LAWS))
def test_mirror_and_turn(data, law):
    """F(-w) = -F(w); mirrored in y: eta, phi, fy, mz change sign."""
    fx, fy, mz, _ = creep_force(LAWS[law], data, 1.7, 0.0, 0.2, 0.3, 0.4)
    assert creep_force(LAWS[law], data, 1.7, 0.0, -0.2, -0.3, -0.4)[:3] == pytest.approx((-fx, -fy, -mz), abs=1e-12)
    assert creep_force(LAWS[law], data, 1.7, 0.0, 0.2, -0.3, -0.4)[:3] == pytest.approx((fx, -fy, -mz), abs=1e-6)


@pytest.mark.parametrize("law", SIMPLE)
def test_ratio_beyond_the_coefficients_is_flagged(data, law):
    assert creep_force(LAWS[law], data, 40.0, 0.0, 0.1, 0.1, 0.1)[3] == 1
    assert creep_force(LAWS[law], data, 30.0, 0.0, 0.1, 0.1, 0.1)[3] == 0


def test_she_joins_the_bound_smoothly(data):
    """Value and slope at u = 3: 1 - u/3 + u^2/27 meets 1/u with equal slope."""
    c11 = kalker_coefficients(1.0, data.table.kalker)[0]
    u = 3 + np.array([-2e-5, -1e-5, 1e-5, 2e-5])
    force = [-creep_force(LAWS["she"], data, 1.0, 0.0, v / c11, 0.0, 0.0)[0] for v in u]
    assert force == pytest.approx([1.0] * 4, abs=1e-9)


@pytest.mark.parametrize("factors", [(1.0, 1.0), (1.0, 0.4), (0.03, 0.02), (0.004, 0.002)])
@pytest.mark.parametrize("law", list(LAWS))
def test_every_law_takes_power_whatever_the_spin(law, factors):
    """Dissipated power, spin's included, over random patches and creepages; zero but for rounding is the least."""
    if law != "polach" and factors != (1.0, 1.0):
        pytest.skip("factors are those of Polach's law")
    table = ensure_table().kernel_data() if law == "table" else None
    data, random = creep_data(0.28, table, grid=20, factors=factors), np.random.default_rng(7)
    for _ in range(3000):
        g, size = np.exp(random.uniform(np.log(0.1), np.log(10.0))), 10.0 ** random.uniform(-4.0, 1.5)
        creepages = size * random.normal(size=3) * 10.0 ** random.uniform(-2.0, 0.0, 3)
        work = np.array(creep_force(LAWS[law], data, g, 0.0, *creepages)[:3]) * creepages
        assert -work.sum() >= -1e-14 * np.abs(work).sum(), (g, creepages)
