"""Rolling radius difference and equivalent conicity (EN 15302, UIC 519).

The rolling radius difference dr(y) = r_left - r_right is positive where it steers a wheelset that is shifted to the
left (y > 0) back. Klingel's kinematic motion with it keeps

    psi^2 / 2 + Phi(y) / (e r0) = const,   Phi = integral of dr,   y' = psi,

so a half wave is x = integral of dy / sqrt(2 (E - Phi) / (e r0)) between the turning points Phi = E. The equivalent
conicity is that of the cone with the same wavelength L = 2 x: (pi / L)^2 2 e r0.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from wrcore.contact.rigid.first_touch import first_touch
from wrcore.contact.rigid.wheel_on_rail import WheelsetOnTrack
from wrcore.errors import InputError
from wrcore.errors.checked_calls import LEAST, Within, checked
from wrcore.errors.messages import warn

if TYPE_CHECKING:
    import pandas as pd

STEP = {True: 5e-5, False: 1e-4}
"""Default step of dr(y) with and without roll, m. A contact jump is smeared over one step, so the conicity just beyond
a jump depends on the step by some per cent. Without roll the whole procedure is the standard's, 0.1 mm: a finer step
comes closer to the rigid profiles, but moves away from the reference values.

On this grid a jump next to a node is decided by micrometres. In the standard's combination E3 the wheel jumps at
y = 2.4958 and 6.6989 mm, and the dr(y) behind the reference values at once beyond 2.5 and 6.7 mm: one node later, which
puts 2.5, 2.6 and 2.7 mm outside the band (0.078 for 0.025). A gauge wider by 0.01 mm puts all amplitudes inside."""

REACH = 0.010
"""Range of the table of dr(y) beyond the maximum amplitude, m: with different sides the centre of motion is shifted."""

_FLANK = 10e-3
"""Depth below the tape circle at which the distance between the flanks of both flanges is measured, m."""

_PLAY = 5e-4
"""Smallest difference of gauge and distance between the flanks of both flanges that causes no warning, m. Trams have
3 mm."""

_NOISE = 1e-9
"""Rolling radius difference below which it is set to 0, m: symmetric profiles with play have rounding errors."""


class _Well:
    """Potential Phi of a rolling radius difference that is linear between its nodes; it is quadratic in each cell."""

    def __init__(self, y, difference):
        self.y, self.difference = y, np.where(np.abs(difference) < _NOISE, 0.0, difference)
        steps = 0.5 * np.diff(y) * (self.difference[1:] + self.difference[:-1])
        self.potential = np.concatenate(([0.0], np.cumsum(steps)))

    def __call__(self, y):
        i = min(max(int(np.searchsorted(self.y, y, side="right")) - 1, 0), self.y.size - 2)
        part = (y - self.y[i]) / (self.y[i + 1] - self.y[i])
        here = self.difference[i] + part * (self.difference[i + 1] - self.difference[i])
        return float(self.potential[i] + 0.5 * (y - self.y[i]) * (self.difference[i] + here))

    def centre(self):
        """Position (m) nearest to y = 0 where the difference rises through zero, in the middle of play; NaN if none."""
        d = self.difference
        cells = np.flatnonzero((d[:-1] <= 0.0) & (d[1:] >= 0.0))
        if not cells.size:
            return math.nan
        rise = d[cells + 1] - d[cells]
        part = np.divide(-d[cells], rise, out=np.full(cells.size, 0.5), where=rise > 0.0)
        zeros = self.y[cells] + part * np.diff(self.y)[cells]
        groups = np.split(zeros, np.flatnonzero(np.diff(cells) > 1) + 1)
        return float(min((0.5 * (group[0] + group[-1]) for group in groups), key=abs))

    def turning_points(self, amplitude, centre):
        """Ends (m) of the motion about ``centre`` of peak-to-peak value 2 ``amplitude``; NaN outside the table."""

        def excess(start):
            return self(start + 2.0 * amplitude) - self(start)

        low = max(centre - 2.0 * amplitude, self.y[0])
        high = min(centre, self.y[-1] - 2.0 * amplitude)
        if not low <= high:  # the table is too short, or has no centre
            return math.nan, math.nan
        start = min(max(centre - amplitude, low), high)
        if abs(excess(start)) > _NOISE**2:
            if excess(low) > 0.0 or excess(high) < 0.0:
                return math.nan, math.nan
            start = brentq(excess, low, high, xtol=1e-15, rtol=1e-14)
        return start, start + 2.0 * amplitude

    def conicity(self, start, end):
        """Equivalent conicity of the motion between two turning points of equal potential.

        With T = integral of dy / sqrt(E - Phi), L = 2 T sqrt(e r0 / 2), so that e and r0 cancel: (pi / T)^2.
        In each cell E - Phi = q is quadratic with q'' = -dr' and the integral is 2 atan(w) / sqrt(dr' / 2) with
        w = sqrt(dr' / 2) h / (sqrt(q0) + sqrt(q1)): exact at the turning points, where q = 0, and in steep cells
        (contact jumps). For dr' < 0 the same with atanh."""
        margin = 1e-6 * (end - start)  # a node on a turning point would make a cell without length
        inside = np.flatnonzero((self.y > start + margin) & (self.y < end - margin))
        y = np.concatenate(([start], self.y[inside], [end]))
        q = np.concatenate(([0.0], 0.5 * (self(start) + self(end)) - self.potential[inside], [0.0]))
        tiny = _NOISE * margin
        if q.min() < -tiny or q.max() <= tiny:
            return 0.0 if q.max() <= tiny and q.min() >= -tiny else math.nan
        h = np.diff(y)
        bend = 0.5 * np.diff(np.interp(y, self.y, self.difference)) / h
        root = np.sqrt(np.maximum(q, 0.0))
        time = float(np.sum(_cell_time(bend, h, root[1:] + root[:-1])))
        return (math.pi / time) ** 2


def _cell_time(bend, h, speed):
    """Integral of dy / sqrt(q) over cells of length ``h``, q'' = -2 ``bend``; ``speed``: sum of sqrt(q) at the ends."""
    root = np.sqrt(np.abs(bend))
    with np.errstate(divide="ignore", invalid="ignore"):  # speed 0: the motion takes forever, or spans the whole cell
        w = root * h / speed
        curved = np.where(bend > 0.0, np.arctan(w), np.arctanh(np.minimum(w, 1.0))) / root
        straight = h / speed * (1.0 - np.sign(bend) * w**2 / 3.0)
    return 2.0 * np.where(w > 1e-4, curved, straight)


def equivalent_conicity(y, difference, amplitudes):
    """Return equivalent conicities (m,) by Klingel's integral (EN 15302 annex B, UIC 519), and turning points (m, 2).

    ``amplitudes`` (m,) are in m. ``difference`` is r_left - r_right (m), linear between increasing positions ``y`` (m).
    Turning points (m) have equal potential, around the zero nearest to y = 0. The conicity is 0 if the
    difference is 0 over the whole motion (play). It is NaN if the table is too short, or if there is no such wave
    because the difference has the wrong sign."""
    y, difference = np.asarray(y, dtype=float), np.asarray(difference, dtype=float)
    amplitudes = np.atleast_1d(np.asarray(amplitudes, dtype=float))
    if y.ndim != 1 or y.shape != difference.shape or y.size < 2 or not np.all(np.diff(y) > 0.0):
        raise InputError("equivalent_conicity", "y", "expected increasing positions and a difference for each")
    if not np.all(np.isfinite(difference)):
        raise InputError("equivalent_conicity", "difference", "expected finite numbers")
    if not np.all(amplitudes > 0.0):
        raise InputError("equivalent_conicity", "amplitudes", "expected lengths above 0 m")
    well = _Well(y, difference)
    centre = well.centre()
    ends = np.array([well.turning_points(a, centre) for a in amplitudes])
    conicity = np.array([math.nan if math.isnan(start) else well.conicity(start, end) for start, end in ends])
    return conicity, ends


@checked
def conicity_curve(
    pair: WheelsetOnTrack,
    amplitudes: Annotated[ArrayLike, Within(LEAST, 0.05, "m", dimensions=1)],
    roll: bool = False,
    step: Annotated[float | None, Within(1e-6, 1e-3, "m")] = None,
) -> pd.DataFrame:
    """Equivalent conicity of a wheelset on its track over the amplitude, as in EN 15302.

    Parameters
    ----------
    pair : WheelsetOnTrack
    amplitudes : array_like, shape (m,)
        m, > 0.
    roll : bool
        See `first_touch`. The standard goes without; a wheelset that stands on both rails rolls, which raises the
        conicity by some 3 % on the tread and far more from the flange root on.
    step : float, optional
        Step of the tabulated rolling radius difference, m; default `STEP`.

    Returns
    -------
    pandas.DataFrame
        amplitude_m, equivalent_conicity, wavelength_m (infinite for conicity 0), y_min_m, y_max_m (turning points).
        Flags, 0 or 1: profile_edge, a wheel would touch with the end of a profile before this amplitude, and the
        conicity is NaN; no_wave, the rolling radius difference lets no wave of this amplitude exist, and it is NaN.

    Raises
    ------
    InputError
        Amplitudes or step out of range, or a wheelset whose profiles do not meet near its centre.

    Examples
    --------
    >>> import wrcore as wr
    >>> pair = wr.WheelsetOnTrack.alike(wr.named_profile("S1002", "wheel"), wr.named_profile("60E1", "rail", 1 / 40))
    >>> wr.conicity_curve(pair, [0.001, 0.003])["equivalent_conicity"].round(2).tolist()
    [0.35, 0.17]
    """
    import pandas as pd

    amplitudes = np.atleast_1d(np.asarray(amplitudes, dtype=float))
    step = STEP[bool(roll)] if step is None else step
    half = math.ceil((amplitudes.max() + REACH) / step)
    table = first_touch(pair, step * np.arange(-half, half + 1), roll)
    positions = table.y_m.to_numpy()
    y, difference = _around_centre(positions, table.rolling_radius_difference_m.to_numpy())
    _warn_without_play(pair)
    conicity, ends = equivalent_conicity(y, difference, amplitudes)
    with np.errstate(divide="ignore"):
        wavelength = math.pi * np.sqrt(2.0 * pair.base * pair.mean_radius / conicity)
    columns = {"amplitude_m": amplitudes, "equivalent_conicity": conicity, "wavelength_m": wavelength}
    cut = y[0] > positions[0] or y[-1] < positions[-1]
    edge = np.isnan(ends[:, 0]) & cut
    columns |= {"y_min_m": ends[:, 0], "y_max_m": ends[:, 1], "profile_edge": edge.astype(int)}
    return pd.DataFrame(columns | {"no_wave": (np.isnan(conicity) & ~edge).astype(int)})


def _warn_without_play(pair):
    """Warn of a wheelset whose flanges do not fit between the rails."""
    flanks = [_flank(one.wheel) for one in (pair.left, pair.right)]
    apart = 2.0 * pair.half_distance + sum(flanks)
    if apart > pair.gauge - _PLAY:
        cause = "expected another gauge or half_distance, or profiles with u = 0 on their tape circle"
        warn(f"conicity: no play of the flanges, {apart:.4g} m apart, in gauge {pair.gauge:g} m: {cause}")


def _flank(wheel):
    """Return the lateral coordinate (m) of the flank of the flange `_FLANK` below the tape circle; -inf without one."""
    inside = (wheel.u < 0.0) & (wheel.f < float(wheel(0.0)) - _FLANK)
    return float(wheel.u[inside].max(initial=-math.inf))


def _around_centre(y, difference):
    """Return positions and differences of the range around y = 0 in which both wheels touch inside their profiles."""
    bad = np.flatnonzero(~np.isfinite(difference))
    home = int(np.argmin(np.abs(y)))
    first, last = bad[bad <= home].max(initial=-1) + 1, bad[bad >= home].min(initial=y.size)
    if last - first < 2:
        raise InputError("conicity", "profiles", "expected wheels that touch their rails at y = 0, got none")
    return y[first:last], difference[first:last]


def en15302_tolerance(conicity):
    """Permitted deviation from reference conicities of EN 15302: min(0.05, half of them), 0.01 where they are zero."""
    return np.clip(0.5 * np.asarray(conicity, dtype=float), 0.01, 0.05)
