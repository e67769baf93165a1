"""From a scene to a run."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np


@dataclass
class Run:
    """One simulated scene: the channels over time, how it ended and what it cost.

    Parameters
    ----------
    scene : dict
        The resolved scene, made of plain JSON values.
    status : str
        ``completed``, ``derailed``, ``stalled`` or ``failed``.
    reason : str
        One line on why the run ended where it did; empty for a completed one.
    t : ndarray, shape (n,)
        Output times, s.
    groups : dict of str to dict of str to ndarray
        Channels by group. A body's group (``wheelset``) holds arrays of shape (n,); a contact's group
        (``wheelset/left``) arrays of shape (n, patches), NaN where a patch is absent. Names carry the unit.
    counters : dict
        Plain numbers: steps, rejected, rhs_evaluations, wall_s, compile_s and others.
    settings : dict
        Flat record of the numerical choices, with the package version.

    Examples
    --------
    ``run["wheelset"].y_m`` is the lateral position in m, ``run["wheelset/left"].N_N`` the normal forces in N.
    """

    scene: dict
    status: str
    reason: str
    t: np.ndarray
    groups: dict[str, dict[str, np.ndarray]]
    counters: dict = field(default_factory=dict)
    settings: dict = field(default_factory=dict)

    def __getitem__(self, group):
        """Channels of one group as attributes; KeyError names the groups that exist."""
        if group not in self.groups:
            raise KeyError(f"no group {group!r} in this run; it has {', '.join(sorted(self.groups))}")
        return SimpleNamespace(**self.groups[group])
