"""Which functions of a user's own a run failed in."""

import numpy as np

from wrcore.creep.laws import with_user_law
from wrcore.equations.equations_of_motion import Equations
from wrcore.forces.control import OUTPUTS, OUTPUTS_END, STATES, STATES_END
from wrcore.kernels import own
from wrcore.kernels.named_laws import function_of, name_of, said

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
            held.append(name_of(digest))

    def look():
        creep = model.contact.creep
        watched = model._replace(
            contact=model.contact._replace(creep=with_user_law(creep) if len(creep.source) else creep)
        )
        equations = Equations(watched)
        for ahead in (*AHEAD, step):
            equations(t + ahead, state + ahead * rate)

    state, rate = (np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0) for values in (state, rate))
    names = list(dict.fromkeys([*held, *own.not_finite_in(look)]))
    return f", where {' and '.join(names)} gave a number that is not finite" if names else ""


class LawWatch:
    """The laws of the user in a model: what goes wrong in them while a kernel runs."""

    def __init__(self, model):
        elements, controls, creep = model.elements, model.controls, model.contact.creep
        digests = [*elements.own, *controls.own, *([creep.source] if len(creep.source) else [])]
        self.names = list(dict.fromkeys(map(name_of, digests)))
        self.in_python = any(not hasattr(function_of(digest), "py_func") for digest in digests)
        self._given = elements.parameters, controls.parameters
        self._before = [array.copy() for array in self._given]

    def fault_of(self, run, *arguments):
        """Outcome of a kernel (None where an error left it), and what went wrong in the laws; Ctrl-C in one is raised
        when the kernel has returned. Parameters that a law wrote to are what they were."""
        outcome, fault = None, ""
        own.take_fault()  # of channels that were read meanwhile
        try:
            outcome = run(*arguments)
        except Exception as error:  # of a compiled law
            fault = f"{' or '.join(self.names)} raised {said(error)}"
        fault = own.take_fault() or fault
        for given, before in zip(self._given, self._before, strict=True):
            if not np.array_equal(given, before):
                given[:] = before
                fault = fault or f"{' or '.join(self.names)} wrote to its parameters, which it may only read"
        return outcome, fault
