"""What pairs of runs say of the motion: flange contact, differences, how far ahead a run can be trusted."""

import numpy as np

from wrcore.geometry.track import SIDES

FLANGE_ANGLE = 0.7
"""Contact angle from which a contact counts as flange contact, rad. S1002 on UIC60 at 1:40 jumps across this value:
from the flange root to the flange, whose face stands at 1.22 rad (70 degrees)."""


def first_flange_contact(run, body="wheelset", angle=FLANGE_ANGLE):
    """First output time (s) at which a wheelset has a patch of at least a contact angle (rad) on either side; NaN if
    there is none.
    """
    steep = [np.nanmax(np.abs(_patches(run[f"{body}/{side}"].contact_angle_rad)), axis=1) >= angle for side in SIDES]
    when = np.flatnonzero(np.logical_or(*steep))
    return float(run.t[when[0]]) if when.size else np.nan


def _patches(values):
    """Channels of shape (n, patches) with NaN for an absent patch, as numbers that never win a maximum."""
    return np.where(np.isnan(values), 0.0, values)


def difference(run, other, channel="y_m", group="wheelset", until=np.inf):
    """Root mean square and maximum of the difference of two runs in a channel (n,), in its unit, over their common
    output times up to ``until`` (s); ValueError if the output times differ.
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
    """Last output time (s) up to which a run agrees in a channel (n,) with its twin, run to a tighter tolerance, within
    a bound in the channel's unit; the end of the shorter run if it always does, NaN if they differ from the start.
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
