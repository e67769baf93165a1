"""The rolling problem of one patch that is given as strips, with its fields."""

from typing import NamedTuple

import numpy as np

from wrcore.contact.rolling.library import make_library
from wrcore.contact.rolling.rolling import AUTO, read_field, read_forces, rolling_force, rolling_work


class RollingField(NamedTuple):
    """Creep force on the wheel (N, N m) and fields over panels, (strips, panels), from the leading edge backwards."""

    Fx: float
    Fs: float
    Mn: float
    residual: float
    method: int
    """Both as `rolling.rolling_force` returns them."""
    x: np.ndarray
    s: np.ndarray
    """Centroid of the panel's normal load, m."""
    traction_x: np.ndarray
    traction_s: np.ndarray
    pressure: np.ndarray
    """Means over the panel, Pa; tractions on the wheel."""
    slip_x: np.ndarray
    slip_s: np.ndarray
    """Slip of the wheel relative to the rail over V."""
    slides: np.ndarray
    power: np.ndarray
    """Dissipated power over area and V, Pa."""
    force: np.ndarray
    """(3, strips): along x and s, N, and the moment of the latter about the strip's middle, N m."""


def solve_patch(strips, slip, shear_modulus, mu, level="middle", nu=0.28, method=AUTO):
    """Creep force and fields (`RollingField`) of one patch from ``strips`` (centre, width, half_length, middle, peak)
    and ``slip`` (slip_x, slip_x_dx, slip_s, slip_s_dx), as `rolling.rolling_force` takes them.
    """
    library = make_library(level, nu)
    arrays = [np.array(part, dtype=float) for part in (*strips, *slip)]
    count, n = arrays[0].size, library.panels.n
    work = rolling_work(count, n)
    result = rolling_force(*arrays, float(shear_modulus), float(mu), library, work, method)
    field = np.empty((9, count * n))
    read_field(library.panels, count, work, field)
    rows, force = field.reshape(9, count, n), np.empty((3, count))
    read_forces(count, work, force)
    return RollingField(*result, *rows[:7], rows[7] > 0, rows[8], force)
