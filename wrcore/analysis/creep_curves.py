"""Creep forces of all laws along lines of creepage, with the exact solution.

All quantities are nondimensional (see `wrcore.creep.laws`): creepages xi', eta', phi', forces over mu N, moments over
mu N c, c = sqrt(a b).
"""

from typing import NamedTuple

import numpy as np

from wrcore.contact.rolling.ellipse import RollingContact
from wrcore.creep.laws import LAWS, CreepData, creep_data, creep_forces


class Model(NamedTuple):
    """A creep law with its data; ``family`` is the law, for a table with its planes ("table ellipse", "table sdec")."""

    name: str
    family: str
    law: int
    data: CreepData


def creep_models(nu, tables, grids):
    """Return models of linear law, SHE, Polach, FASTSIM on each n x n grid, and tables, for Poisson's ratio nu."""
    plain = {"linear": "linear", "she": "SHE", "polach": "Polach"}
    models = [Model(name, law, LAWS[law], creep_data(nu)) for law, name in plain.items()]
    models += [Model(f"FASTSIM {n} x {n}", "fastsim", LAWS["fastsim"], creep_data(nu, grid=n)) for n in grids]
    return models + [table_model(name, table) for name, table in tables.items()]


def table_model(name, table):
    """Return a `CreepTable` as a `Model`."""
    return Model(name, f"table {table.planes}", LAWS["table"], creep_data(table.nu, table.kernel_data()))


def law_forces(model, g, psi, creepages):
    """Return forces (n, 3) of a `Model` and the number of patches outside the range of its data.

    g and psi are scalars or (n,), creepages (n, 3).
    """
    forces = np.empty((len(creepages), 3))
    g, psi = (np.broadcast_to(np.asarray(value, dtype=float), len(creepages)).copy() for value in (g, psi))
    outside = creep_forces(model.law, model.data, g, psi, np.ascontiguousarray(creepages, dtype=float), forces)
    return forces, outside


def curve_creepages(points, translation=1.0, spin=4.0, held_spin=0.6):
    """Return lines of creepages (points, 3) by name, each with the index of the creepage that varies."""
    up, through, zero = np.linspace(0, 1, points), np.linspace(-1, 1, points), np.zeros(points)
    return {
        "longitudinal": (np.stack([translation * up, zero, zero], axis=1), 0),
        "lateral": (np.stack([zero, translation * up, zero], axis=1), 1),
        "spin": (np.stack([zero, zero, spin * up], axis=1), 2),
        "combined": (np.stack([zero, translation * through, held_spin + zero], axis=1), 1),
    }


def creep_curves(models, nu, a_over_b, level, points):
    """Compute forces of all laws and of the exact solver (family "exact") at a level along lines of creepage.

    Lines are "longitudinal", "lateral", "spin" and "combined" (lateral at constant spin). Columns: line, model, family,
    xi, eta, phi, fx, fy, mz.
    """
    import pandas as pd

    patch, parts = RollingContact(a_over_b, 0.0, nu, level), []
    for line, (creepages, _) in curve_creepages(points).items():
        found = [(f"exact, level {level}", "exact", patch.solve_many(creepages)[0])]
        found += [(model.name, model.family, law_forces(model, a_over_b, 0.0, creepages)[0]) for model in models]
        for name, family, forces in found:
            numbers = pd.DataFrame(np.hstack([creepages, forces]), columns=["xi", "eta", "phi", "fx", "fy", "mz"])
            parts.append(numbers.assign(line=line, model=name, family=family))
    return pd.concat(parts, ignore_index=True)
