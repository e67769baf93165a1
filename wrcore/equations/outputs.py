"""What an evaluation of the equations of motion leaves besides the rates, at many states."""

import numpy as np

from wrcore.equations.equations_of_motion import derivatives_at
from wrcore.forces.drive import actuator, controlled_force
from wrcore.kernels.jit import jit
from wrcore.track.check_rail import check_force
from wrcore.track.flexible_track import displacement
from wrcore.track.track import arc_length_at


@jit(allocates=False, nogil=True)
def evaluations_at(times, states, equations, model, work, rates, patches, bounds):
    """Fill ``rates`` (n, size), ``patches`` (n, k, 2, MAX_PATCHES, PATCH_COLUMNS; where there is one) and ``bounds`` of
    planar detection's error (n, k, 2; m) at n times (s) and states; wheelsets in the model's order, left and right."""
    for i in range(times.shape[0]):
        derivatives_at(equations, times[i], states[i], model, work, rates[i])
        for k in range(work.counts.shape[0]):
            for side in range(2):
                bounds[i, k, side] = work.bounds[k, side]
                for patch in range(work.counts[k, side]):
                    for column in range(patches.shape[4]):
                        patches[i, k, side, patch, column] = work.patches[k, side, patch, column]


@jit(allocates=False)
def _fill_drives(times, states, equations, model, work, rate, torques, rates, control, outputs):
    for i in range(times.shape[0]):
        derivatives_at(equations, times[i], states[i], model, work, rate)
        force, wanted, _ = controlled_force(model, times[i], states[i], work)
        control[i, 0], control[i, 1] = force, wanted
        for k in range(outputs.shape[1]):
            outputs[i, k] = work.control.outputs[k]
        for k in range(torques.shape[1]):
            torques[i, k], rates[i, k] = actuator(model, k, force, times[i], states[i], work)


@jit(allocates=False)
def _fill_check_rails(times, states, equations, model, work, rate, wrench, forces):
    for i in range(times.shape[0]):
        derivatives_at(equations, times[i], states[i], model, work, rate)
        for k in range(forces.shape[1]):
            s = arc_length_at(model, states[i], work, k)
            for wheel in range(2):
                aside, _ = displacement(model, states[i], k, wheel)
                for j in range(model.check_rails.rows.shape[1]):
                    row, motion = model.check_rails.rows[k, j], work.motions[k, wheel]
                    forces[i, k, wheel] += check_force(row, s, aside, motion, wrench)


def check_rail_history(equations, times, states):
    """Forces of check rails on the backs of all wheels (n, k, 2; N), by `Equations`, whose scratch arrays are
    overwritten, at n times (s) and states."""
    forces = np.zeros((len(times), len(equations.work.motions), 2))
    _fill_check_rails(times, states, *equations.arguments, np.empty(states.shape[1]), np.zeros(6), forces)
    return forces


def motion_history(equations, times, states):
    """`WheelMotion` of all wheels (n, k, 2, 15), by `Equations`, whose scratch arrays are overwritten, at n times (s)
    and states."""
    motions = np.empty((len(times), *equations.work.motions.shape))
    for t, state, found in zip(times, states, motions, strict=True):
        equations(t, state)
        found[:] = equations.work.motions
    return motions


def drive_history(equations, times, states):
    """What motors, brakes and the speed controller did at n times (s) and states, by `Equations`, whose scratch arrays
    are overwritten: torques on the wheelsets along their axles (N m) and relative rotation rates about these (rad/s),
    (n, m) each; the controller's force at the rims (N) and the speed that it wants (m/s), (n, 2), zeros without one;
    and the outputs of control laws, (n, o)."""
    model, rate = equations.arguments[1].value, np.empty(states.shape[1])
    shape = len(times), len(model.drive.rows)
    torques, rates, control = np.zeros(shape), np.zeros(shape), np.zeros((len(times), 2))
    outputs = np.zeros((len(times), len(model.controls.places)))
    _fill_drives(times, states, *equations.arguments, rate, torques, rates, control, outputs)
    return torques, rates, control, outputs
