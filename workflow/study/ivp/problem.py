"""Data of the problem "Wheelset" of the Test Set for IVP Solvers: parameters, work arrays, and file of all numbers."""

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wrcore.errors import InputError

STATE = ("x", "y", "z", "theta", "phi", "vx", "vy", "vz", "vtheta", "vphi", "beta")
CONTACT = ("psi_left", "xi_left", "psi_right", "xi_right")
MULTIPLIERS = ("left", "right")
UNITS = dict(zip(STATE, ["m"] * 3 + ["rad"] * 2 + ["m/s"] * 3 + ["rad/s"] * 3, strict=True))
UNITS |= {name: "rad" if name.startswith("psi") else "m" for name in CONTACT}


class Wheelset(NamedTuple):
    """Parameters of the problem in SI units, with the Test Set's names in brackets."""

    mass: float
    """Mass of the wheelset, kg (MR)."""
    gravity: float
    """Acceleration of gravity, m/s^2 (G)."""
    speed: float
    """Forward speed, m/s (V)."""
    radius: float
    """Nominal radius of the wheels, m (RN0)."""
    inertia_axle: float
    """Moment of inertia about the axle, kg m^2 (LI1)."""
    inertia_across: float
    """Moment of inertia about the other axes, kg m^2 (LI2)."""
    friction: float
    """Coefficient of friction (MU)."""
    spring_arm: float
    """Distance of the springs from the centre, m (XL)."""
    stiffness_lateral: float
    """Lateral stiffness of each spring, N/m (CX)."""
    stiffness_longitudinal: float
    """Longitudinal stiffness of each spring, N/m (CZ)."""
    hertz_e: float
    """First constant of the contact ellipse (E)."""
    hertz_g: float
    """Second constant of the contact ellipse (GG)."""
    poisson_ratio: float
    """Poisson's ratio (SIGMA)."""
    shear_modulus: float
    """Shear modulus, N/m^2 (GM)."""
    c11: float
    """Kalker's coefficient C11; the following fields are C22 and C23."""
    c22: float
    c23: float
    cone_angle: float
    """Cone angle of the wheels, rad (DELTA0)."""
    half_distance: float
    """Distance along the axle from the centre to the nominal point of contact, m (AR)."""
    rail_radius: float
    """Radius of the rail heads, m (RS)."""
    pi: float
    """Rounded value of pi that the Test Set's program uses for the contact ellipse (PI)."""
    alpha: float
    """Baumgarte's parameter alpha, 1/s; the next field is beta. Both are no part of the Test Set."""
    beta: float


PARAMETERS = (
    "MR", "G", "V", "RN0", "LI1", "LI2", "MU", "XL", "CX", "CZ", "E", "GG", "SIGMA", "GM", "C11", "C22", "C23",
    "DELTA0", "AR", "RS", "PI",
)  # fmt: skip
"""Names of the parameters in the file, in the order of `Wheelset`."""


class Work(NamedTuple):
    """Results of an evaluation; rows are left and right wheel.

    Contacts and multipliers are the initial values of the next evaluation."""

    contact: np.ndarray
    """(2, 2): contact coordinates psi (rad) and xi (m)."""
    multipliers: np.ndarray
    """(2,): multipliers lambda, N."""
    phi: np.ndarray
    """(2,): gaps, m."""
    phi_rate: np.ndarray
    """(2,): rates D v of the gaps, m/s."""
    gamma: np.ndarray
    """(2,): right-hand side -(dD/dt) v of the constraints, m/s^2."""
    jacobian: np.ndarray
    """(2, 5): Jacobian D of the gaps."""
    rail: np.ndarray
    """(2, 2): first derivative (1) and second derivative (1/m) of the rail head at the point of contact."""
    creep: np.ndarray
    """(2, 3): arguments of the creep law."""
    traction: np.ndarray
    """(2, 2, 6): generalised force of a unit longitudinal and of a unit lateral creep force."""
    force: np.ndarray
    """(6,): generalised force on x, y, z, theta, phi, beta."""
    matrix: np.ndarray
    residual: np.ndarray
    counters: np.ndarray
    """(3,) int: numbers of evaluations, of Newton steps for the contacts, and of those for the multipliers."""


class Reference(NamedTuple):
    """The Test Set's solution at one time, with the arrays of `Problem`."""

    time: float
    """Time of the solution, s."""
    state: np.ndarray
    contact: np.ndarray
    multipliers: np.ndarray
    effort: dict
    """Effort of the solver that computed the solution: solver, steps, accepted, evaluations, jacobians."""


class Problem(NamedTuple):
    """The benchmark: parameters (with Baumgarte's parameters zero), initial values and reference."""

    wheelset: Wheelset
    state: np.ndarray
    """(11,): initial state in the order of `STATE`."""
    contact: np.ndarray
    """(2, 2): initial contact coordinates in the order of `CONTACT`."""
    multipliers: np.ndarray
    """(2,): initial multipliers, left and right, N."""
    reference: Reference


def workspace(problem):
    """Allocate the work arrays for a run from the initial values of a `Problem`."""
    return Work(
        problem.contact.copy(), problem.multipliers.copy(), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros((2, 5)),
        np.zeros((2, 2)), np.zeros((2, 3)), np.zeros((2, 2, 6)), np.zeros(6), np.zeros((2, 2)), np.zeros(2),
        np.zeros(3, np.int64),
    )  # fmt: skip


def read_problem(path):
    """Read the benchmark's JSON file (``config/benchmarks/ivp_wheelset.json``).

    The file contains parameters with the Test Set's names, initial values and reference. InputError if it cannot be
    read or a number is missing.
    """
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(path, "", f"expected a JSON file of the benchmark ({error})") from None
    wheelset = Wheelset(*_numbers(data, "parameters", PARAMETERS, path).tolist(), alpha=0.0, beta=0.0)
    reference = _part(data, "reference", path)
    time = float(_numbers(data, "reference", ("time",), path)[0])
    solution = Reference(time, *_unknowns(reference, "reference", path), _part(reference, "effort", path))
    return Problem(wheelset, *_unknowns(_part(data, "initial", path), "initial", path), solution)


def _unknowns(data, place, path):
    """Return state (11,), contact coordinates (2, 2) and multipliers (2,) from a part of the file."""
    names = {"state": STATE, "contact": CONTACT, "multipliers": MULTIPLIERS}
    state, contact, multipliers = (_numbers(data, key, names[key], path, place) for key in names)
    return state, contact.reshape(2, 2), multipliers


def _part(data, key, path, place=""):
    if not isinstance(data, dict) or key not in data:
        raise InputError(path, f"{place}.{key}".strip("."), "expected this key, but it is missing")
    return data[key]


def _numbers(data, key, names, path, place=""):
    place = f"{place}.{key}".strip(".")
    values = [_part(_part(data, key, path), name, path, place) for name in names]
    for name, value in zip(names, values, strict=True):
        if not isinstance(value, (int, float)) or not np.isfinite(value):
            raise InputError(path, f"{place}.{name}", f"expected a finite number, got {value!r}")
    return np.array(values, float)
