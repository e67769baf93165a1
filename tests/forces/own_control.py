"""Control laws as a user writes them, for the guided car."""

import math

from numba import njit


@njit
def steer(t, inputs, states, parameters, outputs, following):
    """Torques of the wheels by y, yaw, the difference of rolling rates and an own state that follows y."""
    y, yaw, left, right = inputs
    torque = parameters[0] * y + parameters[1] * yaw + parameters[2] * states[0] - parameters[3] * (left - right)
    outputs[0], outputs[1] = torque, -torque
    following[0] = 30.0 * (y - states[0])


def plain_steer(t, inputs, states, parameters, outputs, following):
    """The same in Python."""
    steer.py_func(t, inputs, states, parameters, outputs, following)


@njit
def sampled_steer(t, inputs, states, parameters, outputs, following):
    """The same sampled."""
    steer(t, inputs, states, parameters, outputs, following)
    following[0] = states[0] + 0.3 * (inputs[0] - states[0])


def plain_sampled_steer(t, inputs, states, parameters, outputs, following):
    """The same in Python."""
    sampled_steer.py_func(t, inputs, states, parameters, outputs, following)


@njit
def count(t, inputs, states, parameters, outputs, following):
    """The number of the sample, and its time."""
    following[0], following[1] = states[0] + 1.0, t
    outputs[:] = following[0]


@njit
def wave(t, inputs, states, parameters, outputs, following):
    """A torque over time."""
    outputs[:] = parameters[0] * math.sin(parameters[1] * t)


@njit
def what_it_measures(t, inputs, states, parameters, outputs, following):
    """Its inputs, as states."""
    following[:] = inputs
    outputs[:] = 0.0


@njit
def beyond(t, inputs, states, parameters, outputs, following):
    for i in range(9):
        outputs[i] = 0.0


@njit
def not_finite(t, inputs, states, parameters, outputs, following):
    outputs[:] = math.inf


@njit
def answers(t, inputs, states, parameters, outputs, following):
    return 1.0


@njit
def lost_later(t, inputs, states, parameters, outputs, following):
    """Not a number from a time on."""
    outputs[:] = 0.0 if t < parameters[0] else math.nan
