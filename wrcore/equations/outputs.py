"""Results of evaluations of the equations of motion besides the rates, at many states."""

import numpy as np

from wrcore.equations.equations_of_motion import derivatives_at
from wrcore.forces.drive import actuator, controlled_force
from wrcore.kernels.jit import jit
from wrcore.track.check_rail import check_force
from wrcore.track.flexible_track import displacement
from wrcore.track.track import arc_length_at


@jit(allocates=False, nogil=True)
def evaluations_at(times, states, equations, model, work, rates, patches, bounds):
    """Fill rates, contact patches and error bounds of planar detection at n times (s) and states.

    Shapes: ``rates`` (n, size), ``patches`` (n, k, 2, MAX_PATCHES, PATCH_COLUMNS; only rows in contact are written),
    ``bounds`` (n, k, 2; m). Wheelsets are in the model's order, wheels left and right."""
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
    """Return the forces of check rails on the backs of all wheels (n, k, 2; N) at n times (s) and states.

    The scratch arrays of the `Equations` are overwritten."""
    forces = np.zeros((len(times), len(equations.work.motions), 2))
    _fill_check_rails(times, states, *equations.arguments, np.empty(states.shape[1]), np.zeros(6), forces)
    return forces


def motion_history(equations, times, states):
    """Return the `WheelMotion` of all wheels (n, k, 2, 15) at n times (s) and states.

    The scratch arrays of the `Equations` are overwritten."""
    motions = np.empty((len(times), *equations.work.motions.shape))
    for t, state, found in zip(times, states, motions, strict=True):
        equations(t, state)
        found[:] = equations.work.motions
    return motions


def drive_history(equations, times, states):
    """Return torques and rates of motors and brakes, and outputs of controllers, at n times (s) and states.

    Returns torques on the wheelsets along their axles (N m) and relative rotation rates about these (rad/s), (n, m)
    each; the speed controller's force at the rims (N) and set speed (m/s), (n, 2), zeros without a controller; and the
    outputs of control laws, (n, o). The scratch arrays of the `Equations` are overwritten."""
    model, rate = equations.arguments[1].value, np.empty(states.shape[1])
    shape = len(times), len(model.drive.rows)
    torques, rates, control = np.zeros(shape), np.zeros(shape), np.zeros((len(times), 2))
    outputs = np.zeros((len(times), len(model.controls.places)))
    _fill_drives(times, states, *equations.arguments, rate, torques, rates, control, outputs)
    return torques, rates, control, outputs
