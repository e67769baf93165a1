"""Scenes, vehicles, sweeps and wear plans to start from: ``config/`` of the project, which a wheel carries along."""

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
    """The folder that holds `PARTS`: in an installed package its own, in a checkout ``config/``."""
    inside = PACKAGE / "examples"
    return inside if inside.is_dir() else PACKAGE.parent / "config"


@checked
def example(name: str) -> Path:
    """Path of an example scene.

    Parameters
    ----------
    name : str
        Such as ``wheelset``, ``suspended_wheelset``, ``trailer_vehicle``, ``metro_car``, ``locomotive``.

    Returns
    -------
    Path
        Of a YAML file, which :func:`wrcore.load_scene` and :func:`wrcore.simulate` take.

    Raises
    ------
    InputError
        For a name that no example has.

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
    """Copy scenes, vehicles, sweeps and wear plans into a folder (returned), to start from; an InputError where there
    is already something of that name: nothing is written over. Where the disk is full nothing stays behind."""
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
