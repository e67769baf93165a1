"""Example scenes, vehicles, sweeps and wear plans: ``config/`` of the project, also part of the installed package."""

import os
import shutil
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from wrcore.errors import InputError, one_of
from wrcore.errors.checked_calls import checked

PACKAGE = Path(__file__).parents[1]
PARTS = ("scenes", "vehicles", "sweeps", "wear")


def examples_folder() -> Path:
    """Return the folder that holds `PARTS`: ``examples/`` of an installed package, or ``config/`` of a checkout."""
    inside = PACKAGE / "examples"
    return inside if inside.is_dir() else PACKAGE.parent / "config"


@checked
def example(name: str) -> Path:
    """Return the path of an example scene.

    Parameters
    ----------
    name : str
        Name of an example, such as ``wheelset``, ``suspended_wheelset``, ``trailer_vehicle``, ``metro_car`` or
        ``locomotive``.

    Returns
    -------
    Path
        Path of a YAML file, which :func:`wrcore.load_scene` and :func:`wrcore.simulate` accept.

    Raises
    ------
    InputError
        If no example has the name.

    Examples
    --------
    >>> import wrcore as wr
    >>> wr.load_scene(wr.example("trailer_vehicle"), speed=40)
    Scene 'trailer_vehicle': Manchester Benchmarks vehicle 1, S1002 on UIC60-MBench, 40 m/s, spatial detection, 10 s
    """
    known = {path.stem: path for path in sorted((examples_folder() / "scenes").glob("*.yaml"))}
    if name not in known:
        raise InputError("example", "", one_of(known, name))
    return known[name]


def copy_examples(folder: str | os.PathLike[str]) -> Path:
    """Copy the example scenes, vehicles, sweeps and wear plans into a folder and return the folder.

    An InputError is raised if a file or subfolder of such a name exists; no file is overwritten. If copying fails,
    such as on a full disk, the new folders are removed.
    """
    folder = Path(folder)
    for place in (folder, *(folder / part for part in PARTS)):
        if place.exists() and (place != folder or not place.is_dir()):
            raise InputError(place, "", "expected nothing of that name: what is there is not written over")
    made = [place for place in (folder, *folder.parents) if not place.exists()]  # innermost first
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(prefix=".init.", dir=folder) as stage:
            for path in (path for part in PARTS for path in (examples_folder() / part).rglob("*") if path.is_file()):
                copy = Path(stage, path.relative_to(examples_folder()))
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, copy)
            for part in PARTS:
                Path(stage, part).rename(folder / part)
    except BaseException as error:
        with suppress(OSError):
            for place in made:
                place.rmdir()
        if isinstance(error, OSError):
            raise OSError(error.errno, error.strerror or str(error), str(folder)) from None
        raise
    return folder
