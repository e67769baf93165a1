"""Start sessions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal

import numpy as np

from wrcore.creep.table import show_progress
from wrcore.errors.checked_calls import checked
from wrcore.integrate.trajectory import Checkpoint
from wrcore.run.checks.reach import check_reach
from wrcore.run.session import Session
from wrcore.run.simulate import STARTS, opened
from wrcore.run.simulation import Simulation
from wrcore.scene.description import Source


@checked
def start(
    scene: Source,
    overrides: Iterable[str] | Mapping[str, Any] = (),
    start: Annotated[Checkpoint | np.ndarray | Literal["initial"], STARTS] = "initial",
    record: bool = True,
    **changes: Any,
) -> Session:
    """Start a session: a scene that the caller steps in time.

    Parameters
    ----------
    scene, overrides, start, **changes
        As for :func:`simulate`; ``integration.duration`` is ignored.
    record : bool
        Whether all steps are kept for :meth:`Session.run`; a step of a coach takes 1 kB.

    Returns
    -------
    Session
        The session at its first time.

    Raises
    ------
    InputError
        One line that names the file, the field and the expected value. Integration methods of other libraries are
        refused, too.

    Examples
    --------
    >>> import wrcore as wr
    >>> session = wr.start("config/scenes/suspended_wheelset.yaml", speed=30)
    >>> for _ in range(10):
    ...     session.step(0.01)
    >>> once = wr.simulate("config/scenes/suspended_wheelset.yaml", speed=30, integration__duration=0.1)
    >>> bool(session.channels("wheelset.y_m")["wheelset.y_m"] == once["wheelset"].y_m[-1])
    True
    """
    scene, begin_at, begin = opened("start", scene, overrides, start, changes)
    if begin_at is None:
        check_reach(scene)
    return Session(Simulation(scene, begin_at, show_progress), begin, record)
