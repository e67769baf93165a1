"""Rolling contact fatigue: damage by the wear number, and the index of surface fatigue on the shakedown map.

Sources are recalled, not read. Damage per passage over T gamma, whole life rail model: Burstow (RSSB, 2003/2004). It is
zero below 15 N, has its maximum, 1e-5, at 65 N and is zero at 175 N. Beyond, wear removes cracks faster than they grow
(0 here; the model's negative branch is omitted). Index of surface fatigue: Ekberg, Kabo and Andersson, Fatigue and
Fracture of Engineering Materials and Structures 25 (2002) 899-909: FI = |T|/N - 2 pi a b k/(3 N) = |T|/N - k/p_max. It
is positive where the shakedown limit of the surface, p_max/k = N/|T|, is exceeded (Johnson, Wear 35 (1975) 1-24). Both
apply to a patch; for a wheel the worst patch is used.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from wrcore.analysis.assessment.wheels import (
    maximum_pressure,
    output_times_after,
    way_shares,
    wear_number,
    wheelsets_of,
)
from wrcore.analysis.pictures.style import styled
from wrcore.errors import InputError
from wrcore.errors.checked_calls import ABOVE_ZERO, checked
from wrcore.geometry.track import SIDES
from wrcore.run.output.run import Run

YIELD_IN_SHEAR = 300e6  # shear yield stress of a work-hardened wheel or rail steel, Pa (chosen)
BREAKS, DAMAGE = (15.0, 65.0, 175.0), (0.0, 1e-5, 0.0)  # whole life rail model: N, and damage per passage


def rcf_damage(wear_number):
    """Return the fraction (at most 1e-5) of the life to first cracks consumed by a passage with T gamma (N); 0 where
    wear prevails."""
    return np.interp(wear_number, BREAKS, DAMAGE)


def utilised_friction(run, wheelset, side):
    """Return the utilised friction |T|/N of a wheel's patches over time, shape (n, patches); NaN without contact."""
    c = run[f"{wheelset}/{side}"]
    return np.hypot(c.Fx_N, c.Fy_N) / np.where(c.N_N > 0.0, c.N_N, np.nan)


def passage_damage(run, wheelset, side):
    """Return the damage of a passage (`rcf_damage`) by a wheel's worst patch over time, shape (n,); 0 without
    contact."""
    c = run[f"{wheelset}/{side}"]
    return np.max(rcf_damage(np.nan_to_num(np.abs(c.Fx_N * c.xi + c.Fy_N * c.eta))), axis=1)


def fatigue_index(run, wheelset, side, shear_yield=YIELD_IN_SHEAR):
    """Return the index of surface fatigue FI (n,) of a wheel's worst patch; k is ``shear_yield`` (Pa); -inf without
    contact."""
    index = utilised_friction(run, wheelset, side) - shear_yield / run[f"{wheelset}/{side}"].p_max_Pa
    return np.max(np.where(np.isnan(index), -np.inf, index), axis=1)


@checked
def damage_table(
    run: Run, begin: float = 0.0, shear_yield: Annotated[float, ABOVE_ZERO] = YIELD_IN_SHEAR
) -> pd.DataFrame:
    """Return measures of rolling contact fatigue of each wheel and the rail under it over a run.

    Parameters
    ----------
    run : Run
    begin : float
        Start of the evaluation, s.
    shear_yield : float
        Shear yield stress k, Pa.

    Returns
    -------
    pandas.DataFrame
        A row per wheel: wheelset, side, T_gamma_mean_N, rcf_damage_mean (per passage), FI_max, share_above_shakedown
        (fraction of the distance with FI above 0), p_max_Pa. Damage and FI are those of the worst patch at each time; T
        gamma is the sum over patches. Means are over the distance, so that they apply to positions on the rail.

    Raises
    ------
    InputError
        If the run has no wheels, or ``begin`` is outside the run.

    Examples
    --------
    >>> import wrcore as wr
    >>> run = wr.simulate(wr.example("suspended_wheelset"), integration__duration=0.1)
    >>> wr.damage_table(run)[["wheelset", "side"]].values.tolist()
    [['wheelset', 'left'], ['wheelset', 'right']]
    """
    if not wheelsets_of(run):
        raise InputError("damage_table", "run", "expected the channels of wheels")
    late, rows = output_times_after(run, begin, "damage_table"), []
    for wheelset in wheelsets_of(run):
        share = way_shares(run, wheelset, late)
        for side in SIDES:
            index = fatigue_index(run, wheelset, side, shear_yield)[late]
            rows.append({
                "wheelset": wheelset, "side": side, "T_gamma_mean_N": share @ wear_number(run, wheelset, side)[late],
                "rcf_damage_mean": share @ passage_damage(run, wheelset, side)[late], "FI_max": index.max(),
                "share_above_shakedown": share @ (index > 0.0),
                "p_max_Pa": maximum_pressure(run, wheelset, side)[late].max(),
            })  # fmt: skip
    return pd.DataFrame(rows)


@checked
@styled
def plot_shakedown(run: Run, begin: float = 0.0, shear_yield: Annotated[float, ABOVE_ZERO] = YIELD_IN_SHEAR) -> Figure:
    """Draw the shakedown map: maximum pressure over k against utilised friction, for all patches and times.

    Parameters
    ----------
    run, begin, shear_yield
        Arguments of `damage_table`.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import wrcore as wr
    >>> run = wr.simulate(wr.example("suspended_wheelset"), integration__duration=0.1)
    >>> wr.plot_shakedown(run).axes[0].get_xlabel()
    'utilised friction |T|/N'
    """
    figure = Figure(figsize=(5.2, 4.2), layout="constrained")
    axes, late, top = figure.subplots(), output_times_after(run, begin, "plot_shakedown"), 0.0
    for wheelset in wheelsets_of(run):
        for side, mark in zip(SIDES, ("o", "^"), strict=True):
            pressure = run[f"{wheelset}/{side}"].p_max_Pa[late].ravel() / shear_yield
            axes.plot(utilised_friction(run, wheelset, side)[late].ravel(), pressure, mark, markersize=2.5, alpha=0.5,
                      markeredgewidth=0.0, label=f"{wheelset.replace('_', ' ')}, {side}")  # fmt: skip
            top = max(top, np.max(np.nan_to_num(pressure)))
    friction = np.linspace(0.1, 0.6, 200)
    axes.plot(friction, 1.0 / friction, "k-", label="shakedown limit of the surface")
    axes.set(xlabel="utilised friction |T|/N", ylabel="greatest pressure over k", xlim=(0.0, 0.6),
             ylim=(0.0, max(5.0, 1.1 * top)))  # fmt: skip
    figure.legend(fontsize=7, ncols=3, loc="outside upper center")
    return figure
