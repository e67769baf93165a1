"""Control laws of the user: they compute torques of motors and forces of actuators from the motion of the vehicle.

A law is a function ``law(t, inputs, states, parameters, outputs, following)`` of the time (s), the measured inputs, the
states of the law and its parameters. The law writes its outputs. It also writes the rates of its states into
``following`` or, if it is sampled, the next states. A law that is not sampled is evaluated in each evaluation of the
equations of motion and of their Jacobian. A sampled law is called at multiples of its period (`take_samples`). Its
outputs, its states and the number of samples are internal states of the model, constant between samples, so that
checkpoints contain them and they are available at output times. No time step extends beyond a sample.

The measured inputs are channels of a run, in the axes of the track at the position of the body.
"""

import math
from typing import NamedTuple

import numpy as np

from wrcore.bodies.body import OMEGA, STATE_SIZE, VELOCITY
from wrcore.bodies.marker import FRAME
from wrcore.bodies.vector import load
from wrcore.forces.drive import COMMANDED, KIND, NUMBER, REACTION, TABLE, WHEEL, WHEELSET, add_drive
from wrcore.geometry.path import arc_length_of, track_frame
from wrcore.kernels import own
from wrcore.kernels.handles import Kernel, call_address
from wrcore.kernels.jit import jit
from wrcore.track.track import angles_in, turned_into

QUANTITIES = (
    "x_m", "y_m", "z_m", "roll_rad", "yaw_rad", "pitch_rad", "vx_m_per_s", "vy_m_per_s", "vz_m_per_s",
    "wx_rad_per_s", "wy_rad_per_s", "wz_rad_per_s", "rolling_rate_left_rad_per_s", "rolling_rate_right_rad_per_s",
)  # fmt: skip
"""Channels that a control law may measure; ``Controls.inputs`` holds an index of this tuple."""

PITCH, SPEEDS, TURNS, ROLLING = 5, 6, 9, 12  # last angle; first velocity, angular velocity, rolling rate

WHAT, BODY, NEAR, APART = range(4)
"""Columns of ``Controls.inputs``: quantity, body, wheelset near the body, difference of rolling rates."""

INPUTS, INPUTS_END, OUTPUTS, OUTPUTS_END, STATES, STATES_END, FIRST, LAST, SAMPLES = range(9)
"""Columns of ``Controls.rows``."""

EARLY = 1e-9
"""Part of the sampling period by which a sample may be taken early, because the time is rounded."""


class Controls(NamedTuple):
    """All control laws of a model as arrays for kernels."""

    rows: np.ndarray
    """(c, 9) int: ranges first <= k < end of the inputs, outputs, states (in the state vector) and parameters of each
    law; index of its number of samples in the state vector, -1 for a law that is not sampled."""
    period: np.ndarray  # (c,): sampling period, s; 0 for a law that is not sampled
    inputs: np.ndarray
    """(q, 4) int: quantity (index of `QUANTITIES`), body, a wheelset whose arc length is close to that of the body, and
    index in the state of half the difference of rolling rates, -1 for none."""
    places: np.ndarray  # (o,) int: index in the state of each sampled output; -1 for laws that are not sampled
    parameters: np.ndarray
    own: np.ndarray  # (c, 4) int: digests of the users' functions, see `wrcore.kernels.own`
    start: np.ndarray  # (s,): initial values of the internal states of all laws
    laws: np.ndarray = np.zeros(0, np.int64)  # (c,): addresses of the functions, see `with_control_laws`


class ControlWork(NamedTuple):
    """Work arrays of control laws, and results of the last evaluation."""

    inputs: np.ndarray  # (q,): measured values
    outputs: np.ndarray  # (o,): outputs of all laws
    following: np.ndarray  # (n,): next states of a sampled law
    sampling: np.ndarray  # (2,): whether a sample is due, and time of the next sample, s, see `take_samples`
    frame: np.ndarray  # (3, 3): axes of the track frame at the measured body
    place: np.ndarray  # (3,): arc length of the measured body, and its y and z in this frame, m


DUE, NEXT_SAMPLE = range(2)
"""Indices of ``ControlWork.sampling``."""


def no_controls():
    """Return `Controls` without any control law."""
    whole, empty = np.zeros((0, 4), np.int64), np.zeros(0)
    return Controls(np.zeros((0, 9), np.int64), empty, whole, np.zeros(0, np.int64), empty, whole, empty)


def control_work(controls):
    """Allocate the work arrays of the control laws."""
    longest = int(np.max(controls.rows[:, STATES_END] - controls.rows[:, STATES], initial=0))
    sizes = len(controls.inputs), len(controls.places), longest
    return ControlWork(*map(np.zeros, sizes), np.zeros(2), np.eye(3), np.zeros(3))


def samples(model):
    """Whether any control law is sampled."""
    return bool(np.any(model.controls.period > 0.0))


def wrapped(function, note):
    """Return a kernel that calls a control law and passes sums of its inputs and results to ``note``."""

    def call(t, inputs, states, parameters, outputs, following):
        given = sum_of(inputs) + sum_of(states)
        function(t, inputs, states, parameters, outputs, following)
        if sum_of(inputs) + sum_of(states) != given:  # the law wrote into its inputs or states, which are read-only
            outputs[:] = np.nan
        note(given, sum_of(outputs) + sum_of(following[: states.shape[0]]))

    def sum_of(values):
        total = 0.0
        for i in range(values.shape[0]):
            total += values[i]
        return total

    sum_of = own.uncached(sum_of)
    return call


def with_control_laws(controls):
    """Return the controls with the addresses of the compiled laws."""
    if not len(controls.own):
        return controls
    example = tuple(map(own.Example, (0.0, *[np.empty(0)] * 5)))
    found = [own.addressed(wrapped, tuple(map(int, row)), 1, 5, example, own.NOTHING).address for row in controls.own]
    return controls._replace(laws=np.array(found, np.int64))


def with_controls(model, kind, scratch, state):
    """Return the model with the addresses of its control laws, and a dict of the kernels that evaluate them.

    The arguments are examples that determine the types of the kernels' arguments."""
    kernels = {"drive_torques_kernel": Kernel(add_controlled, kind, 0.0, state, scratch, state).address}
    if samples(model):
        kernels["control_samples_kernel"] = Kernel(take_samples, kind, 0.0, state, scratch, False).address
    return model._replace(controls=with_control_laws(model.controls)), kernels


def control_links(model):
    """Return the sets of bodies and of internal states that each law that is not sampled couples.

    These are the bodies that the law measures or on which its outputs act, and the internal states that it reads or
    changes. Arc lengths are neglected, see `wrcore.forces.drive.drive_links`."""
    controls, drive, found, inner = model.controls, model.drive, [], STATE_SIZE * len(model.bodies.mass)
    independent = {int(wheelset): int(state) for wheelset, state in model.bodies.independent}
    for row, period in zip(controls.rows, controls.period, strict=True):
        if period > 0.0:
            continue
        measured = controls.inputs[row[INPUTS] : row[INPUTS_END]]
        bodies = {int(one[BODY]) for one in measured if one[WHAT] > 0}
        states = {int(one[APART]) - inner for one in measured if one[APART] >= 0}
        states |= set(range(int(row[STATES]) - inner, int(row[STATES_END]) - inner))
        for one in drive.rows[drive.rows[:, KIND] == COMMANDED]:
            if row[OUTPUTS] <= one[TABLE] < row[OUTPUTS_END]:
                bodies |= {int(one[WHEELSET]), int(one[REACTION])} - {FRAME}
                states |= {independent[int(one[NUMBER])]} if one[WHEEL] else set()
        found.append((bodies, states))
    return found


@jit(allocates=False)
def _go_to(model, body, near, state, work):
    """Compute the track frame and the coordinates of a body in this frame; ``near`` is a wheelset close to the body."""
    at, path, frame, place = STATE_SIZE * body, model.track.path, work.control.frame, work.control.place
    x, y, z = load(state, at)
    if not model.track.tangent:
        s = arc_length_of(path, x, y, z, work.arc_lengths[near])
        station = track_frame(path, s, frame)
        _, y, z = turned_into(frame, x - station.x, y - station.y, z - station.z)
        x = s
    place[0], place[1], place[2] = x, y, z


@jit(allocates=False)
def _measured(model, q, state, work):
    """Return the value of the q-th input; `_go_to` must have moved the track frame in ``work`` to its body."""
    row, frame = model.controls.inputs[q], work.control.frame
    what, at = row[WHAT], STATE_SIZE * row[BODY]
    if what >= ROLLING:
        axes, (wx, wy, wz) = work.rotations[row[BODY]], load(state, at + OMEGA)
        return wx * axes[0, 1] + wy * axes[1, 1] + wz * axes[2, 1] + (1 - 2 * (what - ROLLING)) * state[row[APART]]
    if what >= SPEEDS:
        x, y, z = load(state, at + (VELOCITY if what < TURNS else OMEGA))
        return turned_into(frame, x, y, z)[(what - SPEEDS) % 3]
    if what >= 3:
        return angles_in(frame, work.rotations[row[BODY]])[what - 3]
    return work.control.place[what]


@jit(allocates=False)
def _run_law(model, c, t, state, work, following):
    """Measure the inputs of the c-th law and call the law."""
    controls, row = model.controls, model.controls.rows[c]
    inputs, outputs, body = work.control.inputs, work.control.outputs, -1
    for q in range(row[INPUTS], row[INPUTS_END]):
        if controls.inputs[q, BODY] != body:
            body = controls.inputs[q, BODY]
            _go_to(model, body, controls.inputs[q, NEAR], state, work)
        inputs[q] = _measured(model, q, state, work)
    call_address(
        controls.laws[c], t, inputs[row[INPUTS] : row[INPUTS_END]], state[row[STATES] : row[STATES_END]],
        controls.parameters[row[FIRST] : row[LAST]], outputs[row[OUTPUTS] : row[OUTPUTS_END]], following,
    )  # fmt: skip


@jit(allocates=False)
def add_controlled(model, t, state, work, rate):
    """Compute the outputs of all laws and the rates of their states, and add the torques of motors and brakes."""
    controls = model.controls
    for c in range(controls.rows.shape[0]):
        row = controls.rows[c]
        if controls.period[c] > 0.0:
            rate[row[STATES] : row[STATES_END]] = 0.0
            rate[row[SAMPLES]] = 0.0
            for o in range(row[OUTPUTS], row[OUTPUTS_END]):
                work.control.outputs[o] = state[controls.places[o]]
                rate[controls.places[o]] = 0.0
        else:
            _run_law(model, c, t, state, work, rate[row[STATES] : row[STATES_END]])
    add_drive(model, t, state, work, rate)


@jit(allocates=False)
def take_samples(model, t, state, work, taking):
    """Write into ``work`` whether a sample is due at the time t (s), and the time of the next sample.

    If ``taking``, call the laws that are due and write their samples into ``state``. The rotations and arc lengths in
    ``work`` must be those of this state."""
    controls, sampling = model.controls, work.control.sampling
    sampling[DUE], sampling[NEXT_SAMPLE] = 0.0, math.inf
    for c in range(controls.rows.shape[0]):
        row, period = controls.rows[c], controls.period[c]
        if period == 0.0:
            continue
        count = state[row[SAMPLES]]
        if t >= (count - EARLY) * period or t < (count - 1.0 - EARLY) * period:  # or time went back
            sampling[DUE] = 1.0
            count = math.floor(t / period + EARLY) + 1.0
            if taking:
                following = work.control.following[: row[STATES_END] - row[STATES]]
                for i in range(following.shape[0]):
                    following[i] = state[row[STATES] + i]
                _run_law(model, c, t, state, work, following)
                for i in range(following.shape[0]):
                    state[row[STATES] + i] = following[i]
                for o in range(row[OUTPUTS], row[OUTPUTS_END]):
                    state[controls.places[o]] = work.control.outputs[o]
                state[row[SAMPLES]] = count
        sampling[NEXT_SAMPLE] = min(sampling[NEXT_SAMPLE], count * period)
