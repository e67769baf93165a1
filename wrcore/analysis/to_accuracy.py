"""Simulate to a required accuracy: estimate the error of the last run from differences of runs at several tolerances.

Errors are proportional to a power p of the tolerance. If runs whose tolerances have the ratio r differ by d, the run
with the smaller tolerance has an error of d/(r^p - 1). The last two differences determine p. It is limited to 1,
although errors of smooth motion decrease faster. It is smaller if impacts make errors decrease slowly. After the first
two runs p = 1 is assumed.
"""

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
from wrcore.run.output.run import Run
from wrcore.run.simulate import simulate
from wrcore.scene.description import Source, as_scene

QUANTITIES = {"y": "m", "Y": "N", "Q": "N", "wear": "N"}
"""Quantities for which an accuracy can be required, with their units: lateral position of the wheelsets, lateral and
vertical wheel forces (root mean square over time and wheels), mean wear number T gamma of a wheel."""

SAFETY = 5.0
"""Safety factor on the estimated error of a run, tuned on 15 random scenes. With 2 the error of one of them is 2.9 µm
instead of 1 µm; with 9 all runs to 1 µm cost a quarter more."""

STEADY, BELIEVED = 0.7, (1.0, 9.0)
"""Power of the tolerance below which differences do not decrease steadily: impacts or instability dominate. Then two
runs may agree by chance, so two successive pairs must agree. Second: bounds of the ratio of a difference to the error
of the run with the smaller tolerance: a wheelset on rough rails had 2.4, where the power 1 predicts 14."""

FIRST_RTOL = {"y": 1e3, "Y": 1e-4, "Q": 1e-5, "wear": 0.3}
"""First tolerance per unit of accuracy, chosen so that half of the scenes need no third run."""

LOOSEST, TIGHTEST = 1e-2, 1e-11
"""Range of relative tolerances. Larger ones save no time: stability or the motion itself limits the steps there."""

TIGHTER, FINER = 0.1, (10.0**-0.5, 10.0**-1.5)
"""Ratio of the second tolerance to the first, also used later if differences do not decrease steadily; largest and
smallest ratio of successive tolerances otherwise."""

SHORTER = 0.2
"""Power of the tolerance to which the longest step is proportional, so that two runs do not agree because they take the
same steps."""

ORDER = 1.3
"""Power of the tolerance with which errors are expected to decrease, for the choice of the next tolerance."""

RELIABLE = 1e-4
"""Largest relative tolerance at which a failed run is final: at larger ones a smaller tolerance may help."""

SHRINKING, PATIENCE = 0.5, 4
"""If none of the last 4 differences is below 0.5 times the smallest earlier one, the tolerance has no effect on the
error. Impacts keep differences equally large over some tolerances, until all runs agree on the times of impacts."""

COMPLETE = ("completed", "derailed")


@dataclass(frozen=True)
class Accuracy:
    """Result of a simulation to a required accuracy: estimated error, tolerance and cost."""

    of: str
    """A key of `QUANTITIES`."""
    asked: float
    found: float
    """Estimated error of the run times `SAFETY`; the true error is nearly always smaller."""
    reached: bool
    rtol: float
    """Relative tolerance of the run."""
    cost: float
    """Evaluations of the equations in all runs over those in the returned run."""
    reason: str


@checked
def simulate_to_accuracy(
    scene: Source, accuracy: float, of: str = "y", progress: Callable | None = None
) -> tuple[Run, Accuracy]:
    """Simulate a scene at smaller and smaller tolerances until its estimated error is below a bound.

    The scene's model is not changed; method (`auto`), tolerance and longest step are chosen. The last run, which is the
    most accurate, is returned. All runs together cost about twice as much as this run, at most about four times.

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
        The most accurate run. Its settings contain the accuracy, too: ``accuracy_of``, ``accuracy_found`` and so on.
    accuracy : Accuracy
        ``reached`` is False if runs fail, or beyond the prediction horizon (impacts, hunting that amplifies every
        difference), where a smaller tolerance does not help.

    Raises
    ------
    InputError
        If the quantity is unknown, the accuracy is not positive, or channels are missing.

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
    first = rtol = min(max(FIRST_RTOL[of] * accuracy, TIGHTEST / TIGHTER), LOOSEST)
    before, spent, differences, ratios = None, 0, [], [TIGHTER]
    while True:
        run = simulate(_at(scene, rtol, (rtol / first) ** SHORTER), progress=False)
        spent += run.counters["rhs_evaluations"]
        if before is not None:
            alike = run.status == before.status and run.status in COMPLETE
            alike &= abs(run.t.size - before.t.size) <= 1  # derailed runs must end between the same output times
            differences.append(difference(before, run, of) if alike else math.inf)
            if progress is not None:
                progress(f"rtol {rtol:g}: {of} differs by {differences[-1]:.2g} {QUANTITIES[of]} from the run before")
            error, order = _estimated(differences, ratios)
            reached = error <= accuracy and _is_steady(differences, ratios, accuracy)
            why = "" if reached else _end(run, differences, rtol)
            if reached or why:
                break
            ratios.append(_next_ratio(error / accuracy, order))
        before, tighter = run, max(rtol * ratios[-1], TIGHTEST)
        rtol, ratios[-1] = tighter, tighter / rtol
    reason = f"{of} within {error:.2g} {QUANTITIES[of]}, estimated from runs at {len(differences) + 1} tolerances"
    reason += f" down to {rtol:.2g}"
    if not reached:
        reason = f"{accuracy:g} {QUANTITIES[of]} not reached: {reason}; {why}"
    cost = spent / max(run.counters["rhs_evaluations"], 1)
    stated = Accuracy(of, accuracy, error, reached, rtol, cost, reason)
    run.settings |= {f"accuracy_{name}": value for name, value in vars(stated).items()}
    return run, stated


def _at(scene, rtol, longest):
    """Return the scene with another relative tolerance, longest step times ``longest`` and step size control."""
    data = copy.deepcopy(scene.data)
    integration = data["integration"]
    integration |= {"method": "auto", "rtol": rtol, "atol": 0.0, "step": 0.0}
    integration["longest_step"] *= longest
    return replace(scene, data=data)


def _order(before, last, ratio):
    """Return the power of the tolerance with which differences decrease, from two successive ones; the tolerances of
    the second have the factor ``ratio``."""
    if not 0.0 < last < math.inf or before == 0.0:
        return 1.0
    fallen = math.log(last / before) / math.log(ratio) if before < math.inf else 0.0
    return min(max(fallen, 0.0), 1.0)


def _estimated(differences, ratios):
    """Return the error of the last run times `SAFETY`, and the power of the tolerance with which errors decrease.

    Arguments are the differences of all successive runs and the ratios of their tolerances.
    """
    *earlier, last = differences
    order = _order(earlier[-1], last, ratios[-2]) if earlier else 1.0
    return SAFETY * last / min(max(ratios[-1] ** -order - 1.0, BELIEVED[0]), BELIEVED[1]), order


def _is_steady(differences, ratios, accuracy):
    """Whether the last difference is not small by chance: differences decrease steadily, or two in a row are small."""
    if len(differences) < 3:
        return True
    first, second, _ = differences[-3:]
    return _order(first, second, ratios[-3]) >= STEADY or SAFETY * second <= accuracy


def _next_ratio(missing, order):
    """Return the ratio of the next tolerance to the last one; ``missing`` is the estimated error over the required
    accuracy."""
    if order < STEADY or not 1.0 < missing < math.inf:
        return TIGHTER
    return min(max(missing ** (-1.0 / (ORDER if order == 1.0 else order)), FINER[1]), FINER[0])


def _end(run, differences, rtol):
    """Return the reason why smaller tolerances do not help, or an empty string."""
    if run.status not in COMPLETE and rtol <= RELIABLE:
        return f"the run {run.status}: {run.reason}"
    before, late = differences[:-PATIENCE], differences[-PATIENCE:]
    if before and min(late) > SHRINKING * min(before) and rtol <= RELIABLE:
        return "tighter runs do not come closer: beyond the prediction horizon of this motion"
    return "no tighter tolerance" if rtol <= 1.001 * TIGHTEST else ""


def difference(one: Run, other: Run, of: str = "y") -> float:
    """Return the difference of two runs of one scene in a quantity of `QUANTITIES`, over their common times.

    It is the root mean square over times and wheelsets or wheels; for wear that of the mean over time. It is infinite
    without a common time.
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
    """Return the time series of a quantity, one per wheelset or wheel."""
    wheelsets = wheelsets_of(run)
    if of == "y":
        return [run[name].y_m for name in wheelsets]
    wheels = [(name, side) for name in wheelsets for side in SIDES]
    if of == "wear":
        return [wear_number(run, *wheel) for wheel in wheels]
    return [wheel_forces(run, *wheel)[0 if of == "Q" else 1] for wheel in wheels]
