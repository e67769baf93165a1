"""Laws of elements as a user writes them."""

import math

import numpy as np
from numba import njit


@njit
def drag(stretch, speed, states, parameters, rates):
    """c v |v|, and a stop that catches on one side alone; its state adds the stretch up."""
    resistance, stiffness = parameters
    caught = min(stretch, 0.0)
    force = resistance * speed * abs(speed)
    rates[0] = stretch
    return force + stiffness * caught, 0.5 * stiffness * caught * caught, force * speed


def plain_drag(stretch, speed, states, parameters, rates):
    """The same in Python."""
    return drag.py_func(stretch, speed, states, parameters, rates)


@njit
def rod(stretch, speed, states, parameters, rates):
    """As a traction rod."""
    stiffness, damping = parameters
    return stiffness * stretch + damping * speed, 0.5 * stiffness * stretch * stretch, damping * speed * speed


def plain_rod(stretch, speed, states, parameters, rates):
    """The same in Python."""
    return rod.py_func(stretch, speed, states, parameters, rates)


@njit
def dashpot(stretch, speed, states, parameters, rates):
    """A force alone."""
    return parameters[0] * speed


@njit
def two_in_series(stretch, speed, states, parameters, rates):
    """Two halves of a damper in series with a spring, which act on each other through a weak third one."""
    stiffness, damping, coupling = parameters
    force = stored = lost = 0.0
    for i in range(2):
        apart = states[i] - states[1 - i]
        own = 0.5 * stiffness * (stretch - states[i])
        rates[i] = (own - coupling * apart) / (0.5 * damping)
        force += own
        stored += 0.25 * stiffness * (stretch - states[i]) ** 2 + 0.25 * coupling * apart**2
        lost += 0.5 * damping * rates[i] ** 2
    return force, stored, lost


@njit
def two_numbers(stretch, speed, states, parameters, rates):
    return stretch, speed


@njit
def no_number(stretch, speed, states, parameters, rates):
    return stretch / abs(stretch - 1e-4) if stretch else float("nan")


def words(stretch, speed, states, parameters, rates):
    return "much"


@njit
def beyond(stretch, speed, states, parameters, rates):
    rates[len(rates)] = 1.0
    return 0.0


def stumbles(stretch, speed, states, parameters, rates):
    raise RuntimeError("no such luck")


def late_fault(stretch, speed, states, parameters, rates):
    """Works on a test call."""
    if abs(stretch) > 2e-4:
        raise ValueError("too far")
    return 1e3 * stretch


number = 3.0


@njit
def lost_far(stretch, speed, states, parameters, rates):
    """Works on a test call."""
    return 1e3 * stretch if abs(stretch) < 2e-4 else math.nan


def aside(s):
    """Both rails go 2 mm aside from 5 m on."""
    deviation = 2e-3 * np.clip((s - 5.0) / 10.0, 0.0, 1.0)
    return np.array([deviation, 0.0 * s, deviation, 0.0 * s])


@njit
def lost_in_slip(ratio, psi, kalker, xi, eta, phi):
    """Linear, and not a number where the lateral creepage is large and rises; finite in test calls."""
    if 0.02 < abs(eta) < 0.05:
        return math.nan, 0.0, 0.0
    return -kalker[0] * xi, -kalker[1] * eta - kalker[2] * phi, 0.0
