"""Data of the Test Set's problem "Wheelset": parameters, scratch arrays, and the file that holds all numbers."""

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
    """Parameters in SI units, by the Test Set's names where they end in brackets."""

    mass: float
    """(MR)"""
    gravity: float
    """(G)"""
    speed: float
    """(V)"""
    radius: float
    """Nominal radius of the wheels (RN0)."""
    inertia_axle: float
    """About the axle (LI1)."""
    inertia_across: float
    """About the other axes (LI2)."""
    friction: float
    """(MU)"""
    spring_arm: float
    """Distance of the springs from the centre (XL)."""
    stiffness_lateral: float
    """Of either spring (CX)."""
    stiffness_longitudinal: float
    """Of either spring (CZ)."""
    hertz_e: float
    """(E)"""
    hertz_g: float
    """Constants of the contact ellipse (GG)."""
    poisson_ratio: float
    """(SIGMA)"""
    shear_modulus: float
    """(GM)"""
    c11: float
    """Kalker's coefficients (C11, C22, C23)."""
    c22: float
    c23: float
    cone_angle: float
    """Of the wheels (DELTA0)."""
    half_distance: float
    """Nominal point of contact from the centre, along the axle (AR)."""
    rail_radius: float
    """(RS)"""
    pi: float
    """As the Test Set's program rounds it in the contact ellipse (PI)."""
    alpha: float
    """Baumgarte's parameters, 1/s; no part of the Test Set."""
    beta: float


PARAMETERS = (
    "MR", "G", "V", "RN0", "LI1", "LI2", "MU", "XL", "CX", "CZ", "E", "GG", "SIGMA", "GM", "C11", "C22", "C23",
    "DELTA0", "AR", "RS", "PI",
)  # fmt: skip
"""Names in the file, in the order of `Wheelset`."""


class Work(NamedTuple):
    """What an evaluation leaves behind; its contacts and multipliers start the next one. Rows: left, right wheel."""

    contact: np.ndarray
    """(2, 2): psi (rad) and xi (m)."""
    multipliers: np.ndarray
    """(2,): lambda, N."""
    phi: np.ndarray
    """(2,): gaps, m."""
    phi_rate: np.ndarray
    """(2,): D v, m/s."""
    gamma: np.ndarray
    """(2,): -(dD/dt) v, m/s^2."""
    jacobian: np.ndarray
    """(2, 5): D."""
    rail: np.ndarray
    """(2, 2): slope (1) and second derivative (1/m) of the rail head at the point of contact."""
    creep: np.ndarray
    """(2, 3): arguments of the creep law."""
    traction: np.ndarray
    """(2, 2, 6): generalised force of a unit longitudinal and of a unit lateral creep force."""
    force: np.ndarray
    """(6,): generalised force on x, y, z, theta, phi, beta."""
    matrix: np.ndarray
    residual: np.ndarray
    counters: np.ndarray
    """(3,) int: evaluations, Newton steps for the contacts and for the multipliers."""


class Reference(NamedTuple):
    """The Test Set's solution at one time, in the form of `Problem`."""

    time: float
    """s"""
    state: np.ndarray
    contact: np.ndarray
    multipliers: np.ndarray
    effort: dict
    """Of the solver that computed it: solver, steps, accepted, evaluations, jacobians."""


class Problem(NamedTuple):
    """The benchmark: parameters (Baumgarte's are zero), initial values and reference."""

    wheelset: Wheelset
    state: np.ndarray
    """(11,): in the order of `STATE`."""
    contact: np.ndarray
    """(2, 2): in the order of `CONTACT`."""
    multipliers: np.ndarray
    """(2,): left, right; N."""
    reference: Reference


def workspace(problem):
    """Allocate the scratch arrays for a run from the initial values of a `Problem`."""
    return Work(
        problem.contact.copy(), problem.multipliers.copy(), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros((2, 5)),
        np.zeros((2, 2)), np.zeros((2, 3)), np.zeros((2, 2, 6)), np.zeros(6), np.zeros((2, 2)), np.zeros(2),
        np.zeros(3, np.int64),
    )  # fmt: skip


def read_problem(path):
    """Read the benchmark's JSON file, the Test Set's parameters by their own names, initial values and reference
    (``config/benchmarks/ivp_wheelset.json``); InputError if it cannot be read or a number is missing.
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
    """State (11,), contact coordinates (2, 2) and multipliers (2,)."""
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
