"""Which functions of a user's own a run failed in."""

import numpy as np

from wrcore.creep.laws import with_own_law
from wrcore.dynamics.control import OUTPUTS, OUTPUTS_END, STATES, STATES_END
from wrcore.dynamics.system import Equations
from wrcore.kernels import own

AHEAD = 0.0, 1e-9, 1e-6, 1e-3
"""Times after the last accepted state at which the equations are looked at again, s."""


def blame(model, t, state, rate, step=0.0):
    """Words that name the own functions which give numbers that are not finite for finite ones at a time (s), a state
    and its rate, both (size,), or soon after; ``step`` (s): the next one tried. Empty if there are none."""
    controls = model.controls
    if not (len(model.elements.own) or len(controls.own) or len(model.contact.creep.source)):
        return ""
    held = []  # by sampled laws
    for row, period, digest in zip(controls.rows, controls.period, controls.own, strict=True):
        places = [*controls.places[row[OUTPUTS] : row[OUTPUTS_END]], *range(row[STATES], row[STATES_END])]
        if period > 0.0 and not np.isfinite(state[places]).all():
            held.append(own.name_of(digest))

    def look():
        creep = model.contact.creep
        watched = model._replace(
            contact=model.contact._replace(creep=with_own_law(creep) if len(creep.source) else creep)
        )
        equations = Equations(watched)
        for ahead in (*AHEAD, step):
            equations(t + ahead, state + ahead * rate)

    state, rate = (np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0) for values in (state, rate))
    names = list(dict.fromkeys([*held, *own.not_finite_in(look)]))
    return f", where {' and '.join(names)} gave a number that is not finite" if names else ""
