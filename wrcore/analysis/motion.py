"""Motion of a run: flange contact and hunting; of two runs: differences, and the time up to which they agree."""

import numpy as np

from wrcore.geometry.track import SIDES
from wrcore.run.motion import growth_rate, hunting_frequency

FLANGE_ANGLE = 0.7
"""Minimum contact angle of flange contact, rad. For S1002 on UIC60 at 1:40 the contact jumps across this value: from
the flange root to the flange, whose face is at 1.22 rad (70 degrees)."""


def first_flange_contact(run, body="wheelset", angle=FLANGE_ANGLE):
    """Return the first output time (s) at which a wheelset has flange contact on either side; NaN if there is none.

    Flange contact is a patch whose contact angle is at least ``angle`` (rad).
    """
    angles = [zero_where_absent(run[f"{body}/{side}"].contact_angle_rad) for side in SIDES]
    steep = [np.max(np.abs(values), axis=1) >= angle for values in angles]
    when = np.flatnonzero(np.logical_or(*steep))
    return float(run.t[when[0]]) if when.size else np.nan


def zero_where_absent(values):
    """Return channels of shape (n, patches) with 0 in place of NaN, so that absent patches do not affect a maximum."""
    return np.where(np.isnan(values), 0.0, values)


def difference(run, other, channel="y_m", group="wheelset", until=np.inf):
    """Return root mean square and maximum of the difference between two runs in a channel (n,), in its unit.

    They are taken over the common output times up to ``until`` (s). ValueError if the output times differ.
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
    """Return the last output time (s) up to which a run agrees with its twin, a run with a tighter tolerance.

    They agree if the difference in a channel (n,) is within a bound, in the channel's unit. The result is the end of
    the shorter run if they always agree, and NaN if they differ from the start.
    """
    t, gap = _gap(run, twin, channel, group)
    apart = np.flatnonzero(~(gap <= bound))
    if not apart.size:
        return float(t[-1])
    return float(t[apart[0] - 1]) if apart[0] else np.nan


def mirror_defect(run, mirrored, until=np.inf, group="wheelset"):
    """Return the maximum of |y + y'| (m) between a run and the run started on the other side of the track.

    It is zero for a program that is symmetric in left and right, as long as rounding errors are not amplified.
    """
    t, gap = _gap(run, mirrored, "y_m", group, sign=-1.0)
    return float(np.max(gap[t <= until]))


def horizons(cases, bound):
    """Return the prediction horizons (s, by case) of the ``spatial`` runs with a tighter twin (``spatial_tight``).

    ``bound`` (m) is the accepted difference of the lateral positions.
    """
    paired = {case: runs for case, runs in cases.items() if "spatial_tight" in runs}
    return {case: prediction_horizon(runs["spatial"], runs["spatial_tight"], bound) for case, runs in paired.items()}


SMALLEST = 1e-6
"""Amplitude below which frequency and damping of a motion are not determined, m."""


def hunting(t, y):
    """Return frequency (Hz), growth (1/s) and damping ratio of a lateral motion y (m) over t (s) after release.

    The motion may decay, be steady or grow. Results are NaN if it ends before it has oscillated.
    """
    swinging = np.flatnonzero(np.abs(y) > SMALLEST)
    end = swinging[-1] + 1 if swinging.size else 0
    frequency, growth = hunting_frequency(t[:end], y[:end]), growth_rate(t[:end], y[:end])
    return frequency, growth, -growth / np.hypot(growth, 2.0 * np.pi * frequency)
