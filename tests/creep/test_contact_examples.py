"""Creep forces that ship with CONTACT as results of its examples, against the solver, the table and FASTSIM."""

import numpy as np
import pytest

from tests.creep.conftest import read
from wrcore.creep.halfspace import RollingContact
from wrcore.creep.laws import LAWS, creep_data, creep_force

EXAMPLES = read("contact_examples")
COLUMNS = ["Fx_over_muN", "Fy_over_muN"]


def scaled(rows):
    """a/b, nondimensional creepages (n, 3), and c in m."""
    c = np.sqrt(rows.a_m * rows.b_m).to_numpy()
    factor = (rows.G_Pa * c**2 / (rows.mu * rows.N_N)).to_numpy()
    creepages = np.column_stack([rows.xi * factor, rows.eta * factor, rows.phi_per_m * c * factor])
    return rows.a_m.iloc[0] / rows.b_m.iloc[0], creepages, c


def errors(rows, forces):
    """Size of the difference in force, over mu N."""
    return np.hypot(*(forces[:, :2] - rows[COLUMNS].to_numpy()).T)


def example(name):
    return EXAMPLES[EXAMPLES.example == name]


@pytest.mark.parametrize(
    ("name", "bound"), [("tractcurv", 0.006), ("fastsim", 0.006), ("catt_to_cart", 0.006), ("contact_nonhz", 0.012)]
)
def test_exact_solver_gives_the_shipped_forces(name, bound):
    """A traction curve of 30 creepages up to 25 %, spin, the end of a transient, a coarse grid (0.5 mm)."""
    rows = example(name)
    g, creepages, c = scaled(rows)
    forces = RollingContact(g, 0.0, 0.28).solve_many(creepages)[0]
    assert errors(rows, forces).max() < bound
    moments = forces[:, 2] * (rows.mu * rows.N_N).to_numpy() * c - rows.Mz_Nm.to_numpy()
    assert np.abs(moments / (rows.mu * rows.N_N * c)).max() < bound


@pytest.mark.parametrize("name", ["tractcurv", "fastsim", "catt_to_cart", "contact_nonhz"])
def test_table_gives_the_shipped_forces(ellipse_table, name):
    """Within twice the tolerance of the table that runs use, 0.005 of mu N."""
    rows = example(name)
    g, creepages, _ = scaled(rows)
    data = creep_data(0.28, ellipse_table)
    forces = np.array([creep_force(LAWS["table"], data, g, 0.0, *w)[:3] for w in creepages])
    assert errors(rows, forces).max() < 0.01


def test_fastsim_gives_the_shipped_traction_curve():
    """CONTACT's own FASTSIM (48 x 44, parabolic bound) on the same cases; coefficients from another table."""
    rows = example("tractcurv")
    g, creepages, _ = scaled(rows)
    data = creep_data(0.28)
    forces = np.array([creep_force(LAWS["fastsim"], data, g, 0.0, *w)[:3] for w in creepages])
    assert np.abs(forces[:, 0] - rows.fastsim_Fx_over_muN).max() < 0.01
