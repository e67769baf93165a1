"""Scenes: a validated description becomes a compiled model and its initial state."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property, partial
from os import PathLike
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from wrcore.balance.bodies import check_bodies
from wrcore.balance.initial import static_equilibrium as static_equilibrium
from wrcore.bodies.marker import FRAME
from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.errors import InputError
from wrcore.errors.checked_calls import OneOf, Within, checked
from wrcore.errors.checked_yaml import read_source, validate
from wrcore.errors.input_files import digest_of_all
from wrcore.geometry.corrugation import Corrugation
from wrcore.geometry.out_of_round import OutOfRound
from wrcore.geometry.profiles.profile import ProfileCurve
from wrcore.geometry.track import SIDES, Track, build_track
from wrcore.kernels.named_laws import Laws
from wrcore.scene.changes import changes_of, of_a_change, set_at
from wrcore.scene.changing_rails import (
    PlacedCrossing,
    read_corrugation,
    read_crossings,
)
from wrcore.scene.check_rail import read_check_rails
from wrcore.scene.control import outputs_of, read_controls
from wrcore.scene.creep import check_creep
from wrcore.scene.drive import read_drive
from wrcore.scene.examples import examples_folder
from wrcore.scene.friction import Friction, read_friction
from wrcore.scene.out_of_round import read_out_of_round
from wrcore.scene.pairs import differing_pairs, digests_of_files, find_file, wheel_and_rail
from wrcore.scene.stored import StoredScene, texts_in
from wrcore.scene.support import check_support
from wrcore.scene.void_keys import ALL_OTHERS, leave_out_void_keys
from wrcore.vehicle.description import Vehicle, vehicle_of
from wrcore.vehicle.train import train_of


@dataclass(frozen=True, repr=False)
class Scene:
    """A checked scene: its data with all defaults, and what its files hold.

    Attributes
    ----------
    data : dict
        The scene file's content after overrides and defaults; plain JSON values.
    source : str
        Named in errors.
    vehicle : Vehicle
    wheel, rail : ProfileCurve
    track : Track
    pairs : tuple of WheelOnRail
        Of each wheel, left and right of wheelset after wheelset; empty where all are alike.
    crossings : tuple of LaidCrossing
        Stretches where rails change along the track.
    out_of_round : tuple
        Shape and angle at the beginning of each wheel, in the order of ``pairs``; empty where all are round.
    corrugation : Corrugation, optional
    files : dict
        SHA-256 of all files that were read for it, by path.
    laws : Laws
        Functions of the user that it names: read, and not run before the scene is compiled.

    Examples
    --------
    >>> import wrcore as wr
    >>> scene = wr.load_scene(wr.example("metro_car"), speed=25)
    >>> scene
    Scene 'metro_car': metro car, S1002 on UIC60-MBench, 25 m/s, spatial detection, 10 s
    >>> scene.vehicle.wheelset_names
    ('wheelset_1', 'wheelset_2', 'wheelset_3', 'wheelset_4')
    """

    data: dict[str, Any]
    source: str
    vehicle: Vehicle
    wheel: ProfileCurve
    rail: ProfileCurve
    track: Track
    pairs: tuple[WheelOnRail, ...] = ()
    crossings: tuple[PlacedCrossing, ...] = ()
    out_of_round: tuple[tuple[OutOfRound | None, float], ...] = ()
    corrugation: Corrugation | None = None
    files: dict[str, str] = field(default_factory=dict)
    laws: Laws = field(default_factory=Laws)

    @property
    def detection(self) -> str:
        """``planar``, ``spatial`` or ``auto``."""
        return self.data["contact"]["detection"]

    @cached_property
    def alike(self) -> WheelOnRail:
        """``wheel`` on ``rail``."""
        return _alike(self.vehicle, self.wheel, self.rail, self.track)[0]

    @checked
    def pair(self, side: Annotated[str, OneOf(SIDES)] = "left", wheelset: Annotated[int, Within(0)] = 0) -> WheelOnRail:
        """A side of a wheelset, counted from the front."""
        if wheelset >= len(self.vehicle.wheelset_names):
            raise InputError(self.source, "wheelset", f"expected a number below that of wheelsets, got {wheelset}")
        return self.pairs[2 * wheelset + list(SIDES).index(side)] if self.pairs else self.alike

    def __repr__(self) -> str:
        wheel, rail = (self.data[kind]["profile"] for kind in ("wheel", "rail"))
        return (
            f"Scene {self.data['name']!r}: {self.vehicle.name}, {wheel} on {rail}, {self.data['speed']:g} m/s,"
            f" {self.detection} detection, {self.data['integration']['duration']:g} s"
        )


Source = Scene | str | PathLike[str] | Mapping[str, Any]
"""What stands for a scene: a checked one, its file, or the file's content."""


def as_scene(scene: Source) -> Scene:
    """A scene as it is, or what stands for one as :func:`load_scene` reads it."""
    return scene if isinstance(scene, Scene) else load_scene(scene)


def scene_of(run: Any, scene: Source | None, asker: str, trust: bool = False) -> Scene:
    """The scene of a run: what stands for it, or read anew by what the run says. Its files are in the working directory
    or, if they hold what the run's did, beside the examples. ``asker`` is named in errors; with ``trust`` the laws that
    a run of a file names may be run."""
    if scene is not None:
        return as_scene(scene)
    try:
        return _loaded(run.scene, (), (), (), trust or not isinstance(run.scene, StoredScene), ALL_OTHERS)
    except InputError as error:
        with suppress(InputError):
            laws = Laws(examples_folder() / "scenes", trusted=trust or not isinstance(run.scene, StoredScene))
            found = _checked(copy.deepcopy(run.scene), "scene", laws, undecided=ALL_OTHERS)
            if digest_of_all(found.files) == run.settings.get("files_sha256"):
                return found
        raise InputError(asker, "scene", f"expected that of the run, as its files are not here ({error})") from None


@checked
def load_scene(
    scene: Source, overrides: Iterable[str] | Mapping[str, Any] = (), trust: bool = False, **changes: Any
) -> Scene:
    """Read and check a scene. Laws of the user that it names are read, and run when the scene is simulated.

    Parameters
    ----------
    scene : str, Path, dict or Scene
        Scene file, the content of one (then paths count from the working directory), or a scene to be changed.
    overrides : sequence of str, or dict
        ``key.path=value`` with the value in YAML, as ``wrcore simulate --set`` takes them; or values by ``key.path``.
        ``null`` (None) takes a key out of the scene. Keys of the scene that a change makes void, such as
        ``contact.resolution`` beside ``contact.patch=moment``, are left out, and one line says so.
    trust : bool
        Whether the scene of a run file (``wr.load_run(path).scene``) may run the laws that it names.
    **changes
        Further values by key: ``speed=30``, ``integration__duration=2.0`` (two underscores stand for the dot) or
        ``initial={"y": 0.003, "yaw": 0.001}`` (what the mapping does not name stays).

    Returns
    -------
    Scene

    Raises
    ------
    InputError
        One line that names file, field and expectation.

    Examples
    --------
    >>> scene = load_scene("config/scenes/wheelset.yaml", ["speed=30", "contact.detection=planar"])
    >>> scene.data["speed"], scene.detection
    (30, 'planar')
    >>> load_scene("config/scenes/wheelset.yaml", speed=30, contact__friction=0.4)
    Scene 'wheelset': Manchester wheelset, S1002 on UIC60-MBench, 30 m/s, spatial detection, 10 s
    """
    return _asked_for(scene, changes_of(overrides, changes), trust)


def changed_by_caller(scene: Scene, overrides: Iterable[str] | Mapping[str, Any], undecided: Iterable[str]) -> Scene:
    """Change a scene as :func:`load_scene` does; keys that values of ``undecided`` keys may make void stay."""
    return _asked_for(scene, changes_of(overrides, {}), False, undecided)


def _asked_for(scene, asked, trust, undecided=()):
    return _loaded(scene, asked, (), texts_in([value for _, _, value in asked]), trust, undecided)


def changed_by_file(scene: Source, changes: Mapping[str, Any], *folders: Path, undecided: Iterable[str] = ()) -> Scene:
    """A scene with changes, as :func:`load_scene` takes them, that a file in ``folders`` says (a sweep, a plan): laws
    that they name lie there, or where those of the scene do. Keys that ``undecided`` keys may make void stay."""
    return _loaded(scene, changes_of(changes, {}), folders, undecided=undecided)


def _loaded(scene, asked, folders, named=(), trust=False, undecided=()):
    """The scene after the changes ``asked``; other arguments as for `Laws` and `load_scene`."""
    before, trusted = None, trust or not isinstance(scene, StoredScene)
    if isinstance(scene, Scene):
        source, data, before, trusted = scene.source, copy.deepcopy(scene.data), scene.laws.known, scene.laws.trusted
        folders = dict.fromkeys((*scene.laws.folders, *folders))
    else:
        source, folder, data = read_source(scene, "scene")
        folders = folder, *folders
    for option, key, value in asked:
        set_at(data, key, value, option)
    try:
        laws = Laws(*folders, asked=named, before=before, trusted=trusted)
        return _checked(data, source, laws, {key: value for _, key, value in asked}, undecided)
    except InputError as error:
        raise of_a_change(error, source, asked) from None


def _checked(data: dict[str, Any], source: str, laws: Laws, changes=None, undecided=()) -> Scene:
    """The scene of a file's content, with whatever other files it names; ``laws`` finds those of the user."""
    data, folder = validate(data, "scene", source), laws.folders[0]
    leave_out_void_keys(data, source, changes, undecided)
    digests = digests_of_files(data, folder)  # before they are read: what changes meanwhile does not go unseen
    find = partial(find_file, folder=folder, source=source, field="vehicle.parameters")
    with laws.present():
        vehicle = vehicle_of(data["vehicle"], find, source, laws)
        vehicle = train_of(vehicle, data["vehicle"]["count"], data["vehicle"].get("spacing"), source)
    wheel, rail = wheel_and_rail(data, folder, source)
    check_creep(data["contact"], source, laws)
    track = build_track(_with_points(data["track"], folder, source), source, folder, laws)
    data["track"] = validate(data["track"], "track", source)
    pairs = differing_pairs(data, vehicle, wheel, rail, track, folder, source)
    check_support(data["track"].get("support"), source)
    read_check_rails(data, pairs or _alike(vehicle, wheel, rail, track), source)
    crossings = read_crossings(data, vehicle, pairs or _alike(vehicle, wheel, rail, track), folder, source)
    shapes = read_out_of_round(data, vehicle, pairs, crossings, folder, source)
    corrugation = read_corrugation(data, crossings, shapes, source)
    if track.path.pieces.size and np.any(vehicle.joints.bodies == FRAME):
        expected = "expected 'tangent', as this vehicle has joints to the moving frame: elements to it may stay"
        raise InputError(source, "track.path", expected)
    check_bodies(data["initial"]["bodies"], vehicle, source)
    read_friction(data["contact"]["friction"], source, laws, call=False)
    if "contact" not in (wanted := data["output"]["channels"]) and "wheel_motion" in wanted:
        raise InputError(source, "output.channels", "expected contact beside wheel_motion")
    read_controls(data, vehicle, laws, source, call=False)
    read_drive(data.get("drive"), vehicle, source, outputs_of(data.get("control")))
    digests |= laws.files
    return Scene(data, source, vehicle, wheel, rail, track, pairs, crossings, shapes, corrugation, digests, laws)


def _alike(vehicle, wheel, rail, track):
    """The `WheelOnRail` of either side of every wheelset where all are alike."""
    distance = track.rail_distance(rail)
    return (WheelOnRail(wheel, rail, vehicle.rolling_radius, vehicle.half_distance, distance),) * 2


def _with_points(track, folder, source):
    """The scene's track with the place of its measured irregularity, which is looked for as all other files are."""
    irregularity = track.get("irregularity")
    points = irregularity.get("points") if isinstance(irregularity, dict) else None
    names = [points] if isinstance(points, str) else points
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        return track
    found = [str(find_file(name, folder, source, "track.irregularity.points").resolve()) for name in names]
    return {**track, "irregularity": {**irregularity, "points": found[0] if isinstance(points, str) else found}}


def friction_of(scene: Scene) -> Friction:
    """Friction of a scene's rails; a law of the user is called."""
    return read_friction(scene.data["contact"]["friction"], scene.source, scene.laws)
