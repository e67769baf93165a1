"""Runs to a wanted accuracy: tightened until two of them agree, so that the error is measured on the scene itself."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from wrcore.analysis.assessment.wheels import wear_number, wheel_forces, wheelsets_of
from wrcore.errors import InputError, check_number, one_of
from wrcore.errors.checked_calls import checked
from wrcore.geometry.track import SIDES
from wrcore.run.run import Run
from wrcore.run.simulate import simulate
from wrcore.scene.description import Source, as_scene

QUANTITIES = {"y": "m", "Y": "N", "Q": "N", "wear": "N"}
"""What an accuracy can be asked of, and its unit: lateral position of the wheelsets, lateral and vertical wheel forces
(root mean square over time and wheels), mean wear number T gamma of a wheel."""

MARGIN = 5.0
"""Two runs must differ by this much less than is asked for: mostly the tighter one errs by a tenth of their difference,
but it has erred by almost five times as much, where both missed an impact on rough rails (`accuracy/requests.csv`)."""

STEADY = 0.2
"""A tenth of the tolerance makes about a tenth of the difference. Where the difference before shrank by less than this,
impacts or instability decide, and that two runs agree may be chance: two in a row must."""

TIGHTER, SHORTER = 0.1, 0.6
"""From one run to the next: the tolerance, and the longest step, lest two runs take the same steps and agree."""

FIRST_RTOL = {"y": 30.0, "Y": 1e-7, "Q": 1e-7, "wear": 3e-4}
"""First tolerance per unit of accuracy: a position errs by tenths of a micrometre at 1e-4, a wheel force by 100 N."""

LOOSEST, TIGHTEST = 1e-4, 1e-11
"""Range of tolerances. Looser ones save little: stability, or the motion itself, bounds the steps there."""

SHRINKING, PATIENCE = 0.5, 4
"""A difference that is not less than this part of the least of so many before it does not come from the tolerance.
Impacts keep differences as large for some tolerances until all runs agree on when they happen."""

COMPLETE = ("completed", "derailed")


@dataclass(frozen=True)
class Accuracy:
    """How a run to an accuracy went."""

    of: str
    """A key of `QUANTITIES`."""
    asked: float
    found: float
    """Difference between the run and one of ten times its tolerance: nearly always more than its error."""
    reached: bool
    rtol: float
    """Relative tolerance of the run."""
    cost: float
    """Evaluations of the equations in all runs over those in the one that is handed out."""
    reason: str


@checked
def simulate_to_accuracy(
    scene: Source, accuracy: float, of: str = "y", progress: Callable | None = None
) -> tuple[Run, Accuracy]:
    """Run a scene until its error is below a bound, as two runs of different tolerance tell.

    The scene's model stays; method (`auto`), tolerance and longest step are chosen. Each run has a tenth of the
    tolerance of the one before, and the last one, the most accurate, is handed out; as each costs about twice the one
    before, all together cost two to three times the last.

    Parameters
    ----------
    scene : Scene, path or dict
        Its output must have the channels ``pose`` and ``contact``.
    accuracy : float
        Largest error, in the unit of the quantity.
    of : {"y", "Y", "Q", "wear"}
        See `QUANTITIES`.
    progress : callable, optional
        Called with one line per run.

    Returns
    -------
    run : Run
        Its settings hold the accuracy, too: ``accuracy_of``, ``accuracy_found`` and so on.
    accuracy : Accuracy
        ``reached`` is False beyond the prediction horizon (impacts, hunting that amplifies every difference), where no
        tolerance helps, and where runs fail.

    Raises
    ------
    InputError
        For an unknown quantity, an accuracy that is not positive, or channels that are missing.

    Examples
    --------
    >>> import wrcore as wr
    >>> scene = wr.load_scene("config/scenes/suspended_wheelset.yaml", {"integration.duration": 0.2})
    >>> run, accuracy = simulate_to_accuracy(scene, 1e-6)
    >>> accuracy.reached, accuracy.found < 1e-6
    (True, True)
    """
    if of not in QUANTITIES:
        raise InputError("--accuracy-of", "", one_of(QUANTITIES, of))
    scene = as_scene(scene)
    check_number(accuracy, 1e-300, 1e300, "--accuracy", "", QUANTITIES[of])
    if not {"pose", "contact"} <= set(scene.data["output"]["channels"]):
        raise InputError(scene.source, "output.channels", "expected pose and contact among them")
    rtol = min(max(FIRST_RTOL[of] * accuracy, TIGHTEST / TIGHTER), LOOSEST)
    before, spent, differences, longest = None, 0, [], 1.0
    while True:
        run = simulate(_at(scene, rtol, longest), progress=False)
        spent += run.counters["rhs_evaluations"]
        if before is not None:
            differences.append(difference(before, run, of))
            if progress is not None:
                progress(f"rtol {rtol:g}: {of} differs by {differences[-1]:.2g} {QUANTITIES[of]} from the run before")
            alike = run.status == before.status and run.status in COMPLETE
            alike &= abs(run.t.size - before.t.size) <= 1  # those that derail do so between the same output times
            reached = alike and _agree(differences, accuracy)
            why = "" if reached else _end(run, differences, rtol)
            if reached or why:
                break
        before, rtol, longest = run, max(rtol * TIGHTER, TIGHTEST), longest * SHORTER
    found = differences[-1]
    reason = f"{of} within {found:.2g} {QUANTITIES[of]} of a run with ten times the tolerance, {rtol:g}"
    if not reached:
        reason = f"{accuracy:g} {QUANTITIES[of]} not reached: {reason}; {why}"
    cost = spent / max(run.counters["rhs_evaluations"], 1)
    stated = Accuracy(of, accuracy, found, reached, rtol, cost, reason)
    run.settings |= {f"accuracy_{name}": value for name, value in vars(stated).items()}
    return run, stated


def _at(scene, rtol, longest):
    """The scene with another tolerance and longest step; steps are controlled."""
    data = copy.deepcopy(scene.data)
    integration = data["integration"]
    integration |= {"method": "auto", "rtol": rtol, "atol": 0.0, "step": 0.0}
    integration["longest_step"] *= longest
    return replace(scene, data=data)


def _agree(differences, accuracy):
    """Whether the last difference is small enough, and no chance."""
    last, *earlier = differences[::-1]
    steady = len(earlier) < 2 or earlier[0] <= max(STEADY * earlier[1], accuracy / MARGIN)
    return steady and MARGIN * last <= accuracy


def _end(run, differences, rtol):
    """Why there is no use in going on, or an empty string."""
    if run.status not in COMPLETE:
        return f"the run {run.status}: {run.reason}"
    *before, last = differences[-PATIENCE - 1 :]
    if len(before) == PATIENCE and last > SHRINKING * min(before):
        return "tighter runs do not come closer: beyond the prediction horizon of this motion"
    return "no tighter tolerance" if rtol <= 1.001 * TIGHTEST else ""


def difference(one: Run, other: Run, of: str = "y") -> float:
    """Difference of two runs of one scene in a quantity of `QUANTITIES`, over the times that both have reached: root
    mean square over times and wheelsets or wheels, for wear of the mean over time; infinite without a time in common.
    """
    count = min(len(one.t), len(other.t))
    if count == 0:
        return math.inf
    first, second = (np.array([series[:count] for series in _series(run, of)]) for run in (one, other))
    apart = first - second
    if of == "wear":
        apart = np.nanmean(apart, axis=1)
    return float(np.sqrt(np.nanmean(apart**2)))


def _series(run, of):
    """A quantity's time series, one per wheelset or wheel."""
    wheelsets = wheelsets_of(run)
    if of == "y":
        return [run[name].y_m for name in wheelsets]
    wheels = [(name, side) for name in wheelsets for side in SIDES]
    if of == "wear":
        return [wear_number(run, *wheel) for wheel in wheels]
    return [wheel_forces(run, *wheel)[0 if of == "Q" else 1] for wheel in wheels]
