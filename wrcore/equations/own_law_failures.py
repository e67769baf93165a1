"""Diagnosis of runs that fail in a user's function: name the function and the fault."""

import numpy as np

from wrcore.creep.laws import with_user_law
from wrcore.equations.equations_of_motion import Equations
from wrcore.forces.control import OUTPUTS, OUTPUTS_END, STATES, STATES_END
from wrcore.kernels import own
from wrcore.kernels.named_laws import function_of, name_of, said

AHEAD = 0.0, 1e-9, 1e-6, 1e-3
"""Times after the last accepted state at which the equations are evaluated again, s."""


def blame(model, t, state, rate, step=0.0):
    """Return a part of a message that names the user's functions which return non-finite numbers for finite input.

    They are evaluated at time ``t`` (s), ``state`` and ``rate`` (both (size,)), at the times `AHEAD` after it and after
    ``step`` (s), the next attempted step. Empty if there is no such function."""
    controls = model.controls
    if not (len(model.elements.own) or len(controls.own) or len(model.contact.creep.source)):
        return ""
    held = []  # names of sampled laws with non-finite held outputs or states
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
    """Monitor of the user's laws in a model, which reports their faults during a kernel call."""

    def __init__(self, model):
        elements, controls, creep = model.elements, model.controls, model.contact.creep
        digests = [*elements.own, *controls.own, *([creep.source] if len(creep.source) else [])]
        self.names = list(dict.fromkeys(map(name_of, digests)))
        self.in_python = any(not hasattr(function_of(digest), "py_func") for digest in digests)
        self._given = elements.parameters, controls.parameters
        self._before = [array.copy() for array in self._given]

    def fault_of(self, run, *arguments):
        """Run a kernel and return its outcome (None after an error) and a description of the fault in the user's laws.

        Ctrl-C in a law is raised after the kernel has returned. Parameters that a law has changed are restored."""
        outcome, fault = None, ""
        own.take_fault()  # discard faults of output channels evaluated before this call
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
