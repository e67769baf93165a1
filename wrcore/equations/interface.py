"""Interface of a model for integrators, besides its rates (`wrcore.equations.equations_of_motion.derivatives_at`).

===================================  ===================================================================================
`begin`, `places`                    starting values of searches and solvers, which a run has besides its state
`kept_size`                          number of these values that are saved before an attempted step
`before_attempt`, `after_rejection`  save these values; restore them after a rejected step
`outside`, `why_outside`             whether and why a state ends the run
`touching`                           number of contacts in the last evaluation: an increase in a step means impact
`turn_rate`                          turning rate of axes in which a steady motion is at rest
===================================  ===================================================================================

The coupling of unknowns is in :mod:`wrcore.jacobian.links`, the part of the Jacobian that changes fastest in
:mod:`wrcore.jacobian.wheels`.
"""

import math

from wrcore.bodies.body import STATE_SIZE, VELOCITY
from wrcore.bodies.vector import copy_into
from wrcore.geometry.path import arc_length_of, track_frame
from wrcore.kernels.jit import jit
from wrcore.track.track import track_poses

WILD = 10.0
"""Distance along the track, m; a step with a stage in which a wheelset moves farther than this is never accepted."""


def places(work):
    """Return the starting values of searches and solvers: the wheelsets' arc lengths (m), last solutions of patches."""
    return work.arc_lengths, work.strips.memory


def begin(work):
    """Delete the solutions of patches of earlier runs from the workspace."""
    work.strips.memory[...] = 0.0


def kept_size(model, work):
    """Number of values that `before_attempt` saves.

    Solutions of patches are included only if all patches are solved (a millisecond each). Interpolation in a lookup
    table is faster than copying them."""
    solved = model.contact.strips.strips and not model.contact.strips.looked_up
    return work.arc_lengths.size + (work.strips.memory.size if solved else 0)


@jit(allocates=False)
def before_attempt(work, kept):
    """Save the starting values of searches and solvers in ``kept`` (`kept_size`,)."""
    arcs = work.arc_lengths.shape[0]
    copy_into(kept[:arcs], work.arc_lengths)
    if kept.shape[0] > arcs:
        copy_into(kept[arcs:], work.strips.memory.reshape(-1))


@jit(allocates=False)
def after_rejection(work, kept):
    """Restore arc lengths after stages with far too large displacements, and solutions of patches after all stages.

    The search for a wheelset's arc length starts from the last one; on a path of several laps of a circle it would stay
    on a wrong lap. The normal problem can have several solutions, and a patch keeps the previous one. It is restored,
    so that a rejected step has no effect on the motion."""
    arcs = work.arc_lengths.shape[0]
    if kept.shape[0] > arcs:
        copy_into(work.strips.memory.reshape(-1), kept[arcs:])
    for k in range(arcs):
        if abs(work.arc_lengths[k] - kept[k]) > WILD or math.isnan(work.arc_lengths[k]):
            work.arc_lengths[k] = kept[k]


@jit(allocates=False)
def outside(limit, state, model, work):
    """Whether the lateral distance of a wheelset from the track's centre exceeds ``limit`` (m) or is NaN."""
    for k in range(model.bodies.wheelsets.shape[0]):
        at = STATE_SIZE * model.bodies.wheelsets[k]
        x, y, z = state[at], state[at + 1], state[at + 2]
        if not model.track.tangent:
            frame = work.frame
            s = arc_length_of(model.track.path, x, y, z, work.arc_lengths[k])
            station = track_frame(model.track.path, s, frame)
            y = (x - station.x) * frame[0, 1] + (y - station.y) * frame[1, 1] + (z - station.z) * frame[2, 1]
        if not abs(y) <= limit:
            return True
    return False


def why_outside(model, t, state, arc_lengths, limit=-1.0):
    """Return a message with the maximum lateral distance of a wheelset from the track's centre.

    ``arc_lengths`` (k,), m, may be approximate. The message is empty if no wheelset is beyond the limit (m)."""
    worst = 0.0
    for k, body in enumerate(model.bodies.wheelsets):
        y = state[STATE_SIZE * body + 1]
        if not model.track.tangent:
            y = track_poses(model.track, state[None, :], STATE_SIZE * body, arc_lengths[k])[0][0, 1]
        worst = abs(y) if not abs(y) <= worst else worst
    if worst <= limit:
        return ""
    return f"a wheelset is {1e3 * worst:.0f} mm off the track's centre at t = {t:.6g} s"


@jit(allocates=False)
def touching(work):
    """Return the number of contact patches in the last evaluation."""
    total = 0
    for k in range(work.counts.shape[0]):
        total += work.counts[k, 0] + work.counts[k, 1]
    return total


@jit(allocates=False)
def turn_rate(state, model, work):
    """Mean turning rate of the track's direction under the wheelsets, about the vertical, rad/s."""
    wheelsets, total, frame = model.bodies.wheelsets, 0.0, work.frame
    if model.track.tangent or not wheelsets.shape[0]:
        return 0.0
    for k in range(wheelsets.shape[0]):
        at = STATE_SIZE * wheelsets[k]
        s = arc_length_of(model.track.path, state[at], state[at + 1], state[at + 2], work.arc_lengths[k])
        station = track_frame(model.track.path, s, frame)
        total += station.curvature * (station.tx * state[at + VELOCITY] + station.ty * state[at + VELOCITY + 1])
    total /= wheelsets.shape[0]
    return total if math.isfinite(total) else 0.0
