"""Pictures of what a person has at hand: ``wr.draw``."""

import math
import os
from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from wrcore.analysis.animation import animate
from wrcore.analysis.evolve import TABLE, profiles_over_distance
from wrcore.analysis.plot_vehicle import plot_vehicle
from wrcore.analysis.plot_wear import plot_evolution
from wrcore.errors import InputError
from wrcore.run.results import load_run
from wrcore.run.run import Run
from wrcore.scene.description import Scene, load_scene


def draw(source, scene=None, factor=None, begin=0.0, end=math.inf):
    """Draw a scene's vehicle, put a run in motion, or show how a profile wears.

    Parameters
    ----------
    source : Scene, Run, str, Path or dict
        A scene (or its file, or content): side and plan view of its vehicle with all bodies, force elements and joints.
        A run (or its HDF5 file): an animation. A folder of :func:`wrcore.evolve`: the profile over the distance.
    scene : Scene, str, Path or dict, optional
        That of a run; left out: the one that the run names, with its files looked for from the working directory.
    factor : float, optional
        By which displacements are drawn larger in an animation from above; left out: a round one that shows them.
    begin, end : float
        Part of the run that is shown, s.

    Returns
    -------
    matplotlib.figure.Figure or Animation
        An animation is a page: ``.write("run.html")`` stores it, a notebook shows it.

    Raises
    ------
    InputError
        For what is none of these, and options that do not belong to it.

    Examples
    --------
    >>> import wrcore as wr
    >>> figure = wr.draw("config/scenes/trailer_vehicle.yaml")
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['z, up / m', 'y, to the left / m', '']
    """
    run = _run_of(source)
    if run is not None:
        return animate(run, _scene_of(run, scene), factor, begin, end)
    for name, value in (("scene", scene), ("factor", factor), ("begin", begin or None)):
        if value is not None:
            raise InputError("draw", name, "expected this with a run only")
    if isinstance(source, Scene | Mapping):
        return plot_vehicle(load_scene(source))
    if os.path.isdir(source):
        if not (Path(source) / TABLE).is_file():
            raise InputError("draw", source, f"expected a folder of evolve, with {TABLE}")
        return plot_evolution(profiles_over_distance(source), pd.read_csv(Path(source) / TABLE))
    return plot_vehicle(load_scene(source))


def _run_of(source):
    """A run, from its file where it is one."""
    if isinstance(source, Run):
        return source
    named = isinstance(source, str | os.PathLike) and Path(source).suffix.lower() in (".h5", ".hdf5")
    return load_run(source) if named else None


def _scene_of(run, scene):
    """The scene of a run."""
    if scene is not None:
        return load_scene(scene)
    try:
        return load_scene(run.scene)
    except InputError as error:
        raise InputError("draw", "scene", f"expected that of the run, as its files are not here ({error})") from None
