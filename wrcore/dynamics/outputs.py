"""What an evaluation of the equations of motion leaves besides the rates, at many states."""

from wrcore.dynamics.system import derivatives_at
from wrcore.kernels.jit import jit


@jit(allocates=False, nogil=True)
def evaluations_at(times, states, equations, model, work, rates, patches, bounds):
    """Rates and contact patches of all wheels at given states.

    Parameters
    ----------
    times : numpy.ndarray, shape (n,)
        s.
    states : numpy.ndarray, shape (n, size)
    equations : Kernel
        The right-hand side.
    model : Model
    work : Workspace
    rates : numpy.ndarray, shape (n, size)
        Filled.
    patches : numpy.ndarray, shape (n, k, 2, MAX_PATCHES, PATCH_COLUMNS)
        Filled where there is a patch: wheelsets in the model's order, left and right.
    bounds : numpy.ndarray, shape (n, k, 2)
        Filled: bound of planar detection's error, m.
    """
    for i in range(times.shape[0]):
        derivatives_at(equations, times[i], states[i], model, work, rates[i])
        for k in range(work.counts.shape[0]):
            for side in range(2):
                bounds[i, k, side] = work.bounds[k, side]
                for patch in range(work.counts[k, side]):
                    for column in range(patches.shape[4]):
                        patches[i, k, side, patch, column] = work.patches[k, side, patch, column]
