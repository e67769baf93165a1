"""Draw scenes, runs, profiles and folders of worn profiles: ``wr.draw``."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
from matplotlib.figure import Figure

from wrcore.analysis.pictures.animation import Animation, animate
from wrcore.analysis.pictures.plot_profile import plot_profile
from wrcore.analysis.pictures.plot_vehicle import plot_vehicle
from wrcore.analysis.pictures.plot_wear import plot_evolution
from wrcore.analysis.wear.evolve import profiles_over_distance
from wrcore.analysis.wear.wear_folder import TABLE, rows_of
from wrcore.errors import InputError
from wrcore.errors.checked_calls import Within, checked
from wrcore.geometry.profiles.profile import ProfileCurve
from wrcore.run.output.files import load_run
from wrcore.run.output.run import Run
from wrcore.scene.description import Scene, Source, as_scene, scene_of


@checked
def draw(
    source: Source | Run | ProfileCurve,
    scene: Source | None = None,
    factor: Annotated[float | None, Within(1.0, 1e6)] = None,
    begin: float = 0.0,
    end: Annotated[float, Within(high=math.inf)] = math.inf,
    trust: bool = False,
) -> Figure | Animation:
    """Draw a scene's vehicle, a profile or the wear of a profile, or animate a run.

    Parameters
    ----------
    source : Scene, Run, ProfileCurve, str, Path or dict
        A scene (or its file, or content): side and plan view of its vehicle with all bodies, force elements and joints.
        A run (or its HDF5 file): an animation. A folder of :func:`wrcore.evolve`: the profile over the distance.
        A profile (:func:`wrcore.named_profile`): its curve and, if from a file, the points it follows and those
        omitted.
    scene : Scene, str, Path or dict, optional
        Scene of a run; default: the scene that the run names, with files relative to the working directory.
    factor : float, optional
        Magnification of displacements in the animation's plan view; default: a round number that makes them visible.
    begin, end : float
        Part of the run that is shown, s.
    trust : bool
        Whether installed packages that a run file names for its kinds of elements may be imported. Laws of the user in
        a scene or a run file are never executed for a picture.

    Returns
    -------
    matplotlib.figure.Figure or Animation
        An animation is a page: ``.write("run.html")`` writes it, a notebook shows it.

    Raises
    ------
    InputError
        If the source is none of these, or an option does not apply to it.

    Examples
    --------
    >>> import wrcore as wr
    >>> figure = wr.draw("config/scenes/trailer_vehicle.yaml")
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['z, up / m', 'y, to the left / m', '']
    """
    if isinstance(source, str | os.PathLike) and Path(source).suffix.lower() in (".h5", ".hdf5"):
        source = load_run(source)
    if isinstance(source, Run):
        return animate(source, scene_of(source, scene, "draw", trust), factor, begin, end)
    options: dict[str, Any] = {"scene": scene, "factor": factor, "begin": begin or None, "trust": trust or None}
    for name, value in options.items():
        if value is not None:
            raise InputError("draw", name, "expected this with a run only")
    if isinstance(source, ProfileCurve):
        return plot_profile(source)
    if not isinstance(source, Scene | Mapping) and os.path.isdir(source):
        if not (Path(source) / TABLE).is_file():
            raise InputError("draw", source, f"expected a folder of evolve, with {TABLE}")
        return plot_evolution(profiles_over_distance(source), pd.DataFrame(rows_of(Path(source))))
    return plot_vehicle(as_scene(source))
