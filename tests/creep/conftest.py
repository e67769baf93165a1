"""Reference cases of CONTACT, and two tables."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wrcore.creep.build import RESOLUTIONS, build_data
from wrcore.creep.cases import check_cases, nondimensional
from wrcore.creep.table import ensure_table

DATA = Path(__file__).parent.parent / "data" / "creep"


def read(name):
    """One of the data files, without its provenance line."""
    return pd.read_csv(DATA / f"{name}.csv", comment="#")


class Reference:
    """Cases of one file: axis ratio, shape number, creepages, and CONTACT's forces, all nondimensional."""

    def __init__(self, name, every=1):
        frame = read(name).iloc[::every].reset_index(drop=True)
        self.frame = frame
        self.g, self.psi, self.creepages, self.c = nondimensional(check_cases(frame))
        size = (frame.mu * frame.N_N).to_numpy()
        moment = frame.Mz_Nm / (size * self.c)
        self.forces = np.stack([frame.Fx_N / size, frame.Fy_N / size, moment], axis=1)

    def errors(self, forces):
        """Lengths of the force error and sizes of the moment error."""
        difference = forces - self.forces
        return np.hypot(difference[:, 0], difference[:, 1]), abs(difference[:, 2])


@pytest.fixture(scope="session")
def ellipse_cases():
    return Reference("ellipse_cases")


@pytest.fixture(scope="session")
def sdec_cases():
    return Reference("sdec_cases")


@pytest.fixture(scope="session")
def extreme_cases():
    return Reference("kbt_extremes")


@pytest.fixture(scope="session")
def ellipse_table():
    """The package's own table, that of runs."""
    return ensure_table().data


@pytest.fixture(scope="session")
def sdec_table():
    """The five-input table of 75 231 cases."""
    return build_data(0.28, "sdec", RESOLUTIONS["sdec"][1][1])
