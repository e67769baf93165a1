"""What an integrator asks of a model besides its rates (`wrcore.equations.equations_of_motion.derivatives_at`).

===================================  ===================================================================================
`begin`, `places`                    what a run knows beside its state: where the next searches start
`kept_size`                          numbers that are kept of it before a step is tried
`before_attempt`, `after_rejection`  keep them; undo what stages of a step that was none have made of it
`outside`, `why_outside`             whether, and why, a state ends the run
`touching`                           contacts of the last evaluation: more of them after a step are an impact in it
`turn_rate`                          of axes in which a steady motion rests
===================================  ===================================================================================

Which unknowns act on which is in :mod:`wrcore.jacobian.links`, the part of the Jacobian that changes fastest in
:mod:`wrcore.jacobian.wheels`.
"""

import math

from wrcore.bodies.body import STATE_SIZE, VELOCITY
from wrcore.bodies.vector import copy_into
from wrcore.geometry.path import arc_length_of, track_frame
from wrcore.kernels.jit import jit
from wrcore.track.track import track_poses

WILD = 10.0
"""A stage whose wheelset is so far along the track from where it was, m, is none of a step that is accepted."""


def places(work):
    """Where the next searches start: arc lengths of the wheelsets (m) and last solutions of patches on strips."""
    return work.arc_lengths, work.strips.memory


def begin(work):
    """Forget the patches of earlier runs."""
    work.strips.memory[...] = 0.0


def kept_size(model, work):
    """Numbers of `before_attempt`: solutions are kept where all patches are solved, a millisecond each; what is looked
    up is quicker than to copy them."""
    solved = model.contact.strips.strips and not model.contact.strips.looked_up
    return work.arc_lengths.size + (work.strips.memory.size if solved else 0)


@jit(allocates=False)
def before_attempt(work, kept):
    """Keep in ``kept`` (`kept_size`,) where searches start."""
    arcs = work.arc_lengths.shape[0]
    copy_into(kept[:arcs], work.arc_lengths)
    if kept.shape[0] > arcs:
        copy_into(kept[arcs:], work.strips.memory.reshape(-1))


@jit(allocates=False)
def after_rejection(work, kept):
    """Undo arc lengths that wild stages have found, and solutions that any have. The search for a wheelset's arc length
    starts from the last one. On a circle that its path goes round more than once, one that a wild stage has led to
    another lap would be kept. Where several sets of windows fit, a patch keeps its own: that of a step that was tried
    in vain would be no part of the motion."""
    arcs = work.arc_lengths.shape[0]
    if kept.shape[0] > arcs:
        copy_into(work.strips.memory.reshape(-1), kept[arcs:])
    for k in range(arcs):
        if abs(work.arc_lengths[k] - kept[k]) > WILD or math.isnan(work.arc_lengths[k]):
            work.arc_lengths[k] = kept[k]


@jit(allocates=False)
def outside(limit, state, model, work):
    """Whether a wheelset is farther than a distance (m) from the track's centre."""
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
    """Say how far the farthest wheelset is off the track's centre, from its rough arc lengths (k,); empty if none is
    farther than the limit (m)."""
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
    """Patches in the last evaluation."""
    total = 0
    for k in range(work.counts.shape[0]):
        total += work.counts[k, 0] + work.counts[k, 1]
    return total


@jit(allocates=False)
def turn_rate(state, model, work):
    """Rate at which the track turns under the wheelsets on average, about the vertical, rad/s."""
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
