"""Plot of the passage of a wheel over a crossing: height, contact points, and load transfer between the heads."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from scipy.signal import find_peaks

from wrcore.analysis.assessment.wheels import wheelsets_of
from wrcore.analysis.pictures.plot_run import COLORS
from wrcore.analysis.pictures.style import ACCENT, MM, RAIL, styled
from wrcore.errors import InputError, one_of
from wrcore.errors.checked_calls import checked
from wrcore.geometry.profiles.profile import SPACING
from wrcore.geometry.track import SIDES
from wrcore.run.output.run import Run
from wrcore.scene.description import Source, scene_of

LEAST = 1.0
"""Smallest load of a patch that is drawn, N."""

COARSE, NODES = 0.01, 8 * SPACING
"""Distances along and across the rail at which heads are evaluated, m."""

NOTCH = 5e-4
"""Depth of a notch that separates adjacent heads, m."""


@checked
@styled
def plot_crossing(
    run: Run, wheelset: str | None = None, scene: Source | None = None, stretch: int = 0, trust: bool = False
) -> Figure:
    """Draw the passage of a wheel over rails that vary along the track (`track.crossing`).

    Parameters
    ----------
    run : Run
        Run with the channels pose and contact.
    wheelset : str, optional
        Name of the wheelset; default: the first.
    scene : Scene, str, Path or dict, optional
        Scene of the run; default: the scene that the run names, with files relative to the working directory.
    stretch : int, optional
        Index of the section of track on which rails vary, from 0 along the track.
    trust : bool
        Whether packages that a run file names may be imported for its kinds of elements.

    Returns
    -------
    matplotlib.figure.Figure
        Over the arc length of the wheelset's cross-section: the height of the wheelset's centre, rolling radius and
        load of the patches on each head; and, in plan, the heads with the path of the patches, y to the left.

    Raises
    ------
    InputError
        If the run has no such rails, or not the channels that are drawn.

    Examples
    --------
    >>> import wrcore as wr
    >>> scene = wr.load_scene(wr.example("crossing"), integration__duration=0.4, output__rate=2000)
    >>> [axes.get_ylabel() for axes in wr.plot_crossing(wr.simulate(scene), scene=scene).axes]
    ['height / mm', 'radius / mm', 'load / kN', 'share', 'y / mm']
    """
    scene = scene_of(run, scene, "plot_crossing", trust)
    if not scene.crossings:
        raise InputError("plot_crossing", "run", "expected a run with track.crossing")
    if not 0 <= stretch < len(scene.crossings):
        expected = f"expected the number of one of {len(scene.crossings)}, from 0, got {stretch}"
        raise InputError("plot_crossing", "stretch", expected)
    crossing = scene.crossings[stretch]
    names = wheelsets_of(run)
    wheelset = wheelset or names[0]
    if wheelset not in names:
        raise InputError("plot_crossing", "wheelset", one_of(names, wheelset))
    side = next(side for side, rail in zip(SIDES, crossing.rails, strict=True) if rail is not None)
    passage = _Passage(run, wheelset, side, scene, crossing)
    figure = Figure(figsize=(7.2, 8.0), layout="constrained")
    axes = figure.subplots(5, 1, sharex=True, height_ratios=[1.0, 1.0, 1.2, 1.0, 1.6])
    axes[0].plot(passage.s, MM * (passage.height - passage.height[0]), color="0.1")
    for head, color in zip(range(passage.most), COLORS[1:], strict=False):
        on = passage.head == head
        load = np.where(on, passage.load, 0.0).sum(axis=1)
        name = ("outer head", "inner head")[head] if passage.most < 3 else f"head {head + 1} from outside"
        whole = passage.load.sum(axis=1)
        axes[1].plot(*passage.over_s(on, MM * passage.radius), ".", markersize=2, color=color)
        axes[2].plot(passage.s, 1e-3 * load, color=color, label=name)
        axes[3].plot(passage.s, load / np.where(whole > LEAST, whole, np.nan), color=color)
        axes[4].plot(passage.where[on], MM * passage.y[on], ".", markersize=2, color=color)
    for s, inner, outer in passage.plan(crossing):
        axes[4].fill_between(s, inner, outer, color=RAIL, alpha=0.5, linewidth=0.0)
    for begin in passage.begins:
        for one in axes:
            one.axvline(begin, color=ACCENT, linewidth=0.6, linestyle="--")
    for one, label in zip(axes, ("height", "radius", "load", "share", "y"), strict=True):
        one.set_ylabel(label + {"load": " / kN", "share": ""}.get(label, " / mm"))
    axes[2].legend(fontsize=7)
    axes[4].set(xlabel="arc length / m", xlim=crossing.ends)
    return figure


class _Passage:
    """Channels of a wheel between the ends of a crossing, and the head of each patch, counted from outside."""

    def __init__(self, run, wheelset, side, scene, crossing):
        motion, group = run[wheelset], f"{wheelset}/{side}"
        if group not in run or "x_m" not in motion:
            raise InputError("plot_crossing", "run", "expected the channels pose and contact")
        patches = run[group]
        s = motion["s_m"] if "s_m" in motion else motion["x_m"]
        low, high = crossing.ends
        inside = (s > low) & (s < high)
        if not inside.any():
            raise InputError("plot_crossing", "run", f"expected outputs between s = {low:g} and {high:g} m, got none")
        self.s, self.height = s[inside], motion["z_m"][inside]
        pair = scene.pair(side, scene.vehicle.wheelset_names.index(wheelset))
        self.slices, self._sign = dict(zip(SIDES, crossing.rails, strict=True))[side], SIDES[side]
        self._turn, self._at, self._distance = -1.0 if crossing.backwards else 1.0, crossing.at, pair.rail_distance
        self.load = np.nan_to_num(patches["N_N"][inside])
        self.radius = pair.rolling_radius - pair.wheel(patches["u_wheel_m"][inside])
        self.where, self.y = self.s[:, None] + patches["x_m"][inside], patches["y_m"][inside]
        self.head = self._heads(patches["u_rail_m"][inside])
        self.most = int(self.head.max(initial=0)) + 1
        self.begins = self._at + self._turn * self.slices.begins()

    def over_s(self, on, values):
        return np.broadcast_to(self.s[:, None], on.shape)[on], values[on]

    def _runs(self, s):
        """Return the ends (n, 2), m, of the heads at an arc length of the track, m, from the innermost head on."""
        low, high = self.slices.lateral
        u = np.arange(low, high, NODES)
        f = self.slices.heights(self._turn * (s - self._at), u)[0, 0]
        there = np.isfinite(f)
        there[find_peaks(-np.where(there, f, -1.0), prominence=NOTCH)[0]] = False
        return u[np.flatnonzero(np.diff(there.astype(int), prepend=0, append=0)).reshape(-1, 2) - [0, 1]]

    def _heads(self, u):
        """Return the number of the head of each patch, counted from outside; -1: none."""
        heads = np.full(u.shape, -1)
        for i, k in np.argwhere(self.load > LEAST):
            ends = self._runs(self.where[i, k])
            nearest = np.argmin(np.maximum(ends[:, 0] - u[i, k], u[i, k] - ends[:, 1]))
            heads[i, k] = len(ends) - 1 - nearest
        return heads

    def plan(self, crossing):
        """Yield pieces of the heads in plan view: arc lengths (2,), m, and y of the inner and the outer edge, mm."""
        low, high = crossing.ends
        for s in np.arange(low, high, COARSE):
            for ends in self._runs(s):
                yield (s, s + COARSE), *(MM * self._sign * (self._distance + ends))
