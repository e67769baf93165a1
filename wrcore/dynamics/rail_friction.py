"""Friction that differs from rail to rail or changes along the track; scenes with one coefficient run none of this."""

from wrcore.dynamics.body import STATE_SIZE
from wrcore.dynamics.schedule import scheduled
from wrcore.dynamics.wheel import FRICTION
from wrcore.kernels.jit import jit


@jit(allocates=False)
def arc_length_at(model, state, work, k):
    """Arc length of the k-th wheelset after its rails were looked up in this evaluation, m."""
    return state[STATE_SIZE * model.bodies.wheelsets[k]] if model.track.tangent else work.arc_lengths[k]


@jit(allocates=False)
def fill_rail_friction(model, state, work):
    """Write the friction coefficients of the rails under all wheels into the wheels' motions, which are those of
    ``state``, from the model's two schedules over arc length: left and right rail."""
    for k in range(model.bodies.wheelsets.shape[0]):
        s = arc_length_at(model, state, work, k)
        for wheel in range(2):
            work.motions[k, wheel, FRICTION] = scheduled(model.friction, wheel, s)
