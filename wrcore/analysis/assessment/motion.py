"""What runs say of the motion: flange contact, differences between runs, how far a run can be trusted."""

import numpy as np

FLANGE_ANGLE = 0.7
"""Contact angle from which a contact counts as flange contact, rad. S1002 on UIC60 at 1:40 jumps across this value:
from the flange root to the flange, whose face stands at 1.22 rad (70 degrees)."""


SIDES = ("left", "right")


def first_flange_contact(run, body="wheelset", angle=FLANGE_ANGLE):
    """Time of the first contact on a flange.

    Parameters
    ----------
    run : Run
    body : str
        Wheelset whose contacts are searched.
    angle : float
        Contact angle from which a patch counts as flange contact, rad.

    Returns
    -------
    float
        First output time with such a patch on either side, s; NaN if there is none.
    """
    steep = [np.nanmax(np.abs(_patches(run[f"{body}/{side}"].contact_angle_rad)), axis=1) >= angle for side in SIDES]
    when = np.flatnonzero(np.logical_or(*steep))
    return float(run.t[when[0]]) if when.size else np.nan


def _patches(values):
    """Channels of shape (n, patches) with NaN for an absent patch, as numbers that never win a maximum."""
    return np.where(np.isnan(values), 0.0, values)


def difference(run, other, channel="y_m", group="wheelset", until=np.inf):
    """Root mean square and maximum of the difference between two runs over their common output times.

    Parameters
    ----------
    run, other : Run
        Runs with the same output rate.
    channel, group : str
        What to compare; a channel of shape (n,).
    until : float
        End of the comparison, s.

    Returns
    -------
    rms, maximum : float
        In the channel's unit.

    Raises
    ------
    ValueError
        If the output times differ.
    """
    t, gap = _gap(run, other, channel, group)
    gap = gap[t <= until]
    return float(np.sqrt(np.mean(gap**2))), float(np.max(gap))


def _gap(run, other, channel, group, sign=1.0):
    n = min(run.t.size, other.t.size)
    if n == 0 or not np.allclose(run.t[:n], other.t[:n], rtol=0, atol=1e-9):
        raise ValueError("the runs have no common output times")
    return run.t[:n], np.abs(run.groups[group][channel][:n] - sign * other.groups[group][channel][:n])


def prediction_horizon(run, twin, bound, channel="y_m", group="wheelset"):
    """Time up to which a run agrees with its twin, run to a tighter tolerance, within a bound.

    Parameters
    ----------
    run, twin : Run
        Two runs of one scene with the same output rate.
    bound : float
        Largest difference that still counts as agreement, in the channel's unit.
    channel, group : str
        What to compare; a channel of shape (n,).

    Returns
    -------
    float
        Last output time before the bound is first exceeded, s; the end of the shorter run if it never is; NaN if
        they differ from the start.
    """
    t, gap = _gap(run, twin, channel, group)
    apart = np.flatnonzero(~(gap <= bound))
    if not apart.size:
        return float(t[-1])
    return float(t[apart[0] - 1]) if apart[0] else np.nan


def mirror_defect(run, mirrored, until=np.inf, group="wheelset"):
    """Largest |y + y'| between a run and the run started on the other side of the track, m.

    Zero for a program that treats left and right alike, as long as rounding has not been amplified.
    """
    t, gap = _gap(run, mirrored, "y_m", group, sign=-1.0)
    return float(np.max(gap[t <= until]))
