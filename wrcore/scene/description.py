"""Scenes: read, change and check the description of a simulation."""

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
from wrcore.forces.control import Controls
from wrcore.forces.drive import Drive
from wrcore.geometry.corrugation import Corrugation
from wrcore.geometry.out_of_round import OutOfRound
from wrcore.geometry.profiles.profile import ProfileCurve
from wrcore.geometry.track import SIDES, Track, build_track
from wrcore.kernels.named_laws import Laws
from wrcore.scene.changes import changes_of, of_a_change, set_at
from wrcore.scene.examples import examples_folder
from wrcore.scene.parts.changing_rails import PlacedCrossing, read_corrugation, read_crossings
from wrcore.scene.parts.check_rail import read_check_rails
from wrcore.scene.parts.control import outputs_of, read_controls
from wrcore.scene.parts.creep import check_creep
from wrcore.scene.parts.drive import read_drive
from wrcore.scene.parts.friction import Friction, read_friction
from wrcore.scene.parts.out_of_round import read_out_of_round
from wrcore.scene.parts.profiles import differing_pairs, wheel_and_rail
from wrcore.scene.parts.support import read_support
from wrcore.scene.reader import Reader
from wrcore.scene.stored import StoredScene, texts_in
from wrcore.scene.void_keys import ALL_OTHERS, leave_out_void_keys
from wrcore.track.check_rail import CheckRails
from wrcore.track.flexible_track import FlexibleTrack, track_size
from wrcore.vehicle.description import Vehicle, vehicle_of
from wrcore.vehicle.train import train_of


@dataclass(frozen=True, repr=False)
class Scene:
    """A checked scene: its data with all defaults, and the content of its files.

    Attributes
    ----------
    data : dict
        The scene file's content after overrides and defaults; plain JSON values.
    source : str
        Name of the scene in error messages.
    vehicle : Vehicle
    wheel, rail : ProfileCurve
    track : Track
    pairs : tuple of WheelOnRail
        One for each wheel, left and right, wheelset after wheelset; empty if all are equal.
    crossings : tuple of PlacedCrossing
        Stretches where rails change along the track.
    out_of_round : tuple
        Shape and initial angle (rad) of each wheel, in the order of ``pairs``; empty if all wheels are round.
    corrugation : Corrugation, optional
    files : dict
        SHA-256 of all files that were read for the scene, by path.
    laws : Laws
        User-defined functions that the scene names. They are read with the scene and first run when it is compiled.

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
        """Contact detection: ``planar``, ``spatial`` or ``auto``."""
        return self.data["contact"]["detection"]

    # Parts that follow from `data`: they are read once, when they are first needed. With other data they are read anew.

    @cached_property
    def alike(self) -> WheelOnRail:
        """`WheelOnRail` of the scene's ``wheel`` on its ``rail``, for wheels that do not differ."""
        return _alike(self.vehicle, self.wheel, self.rail, self.track)

    @cached_property
    def wheels(self) -> tuple[WheelOnRail, ...]:
        """`WheelOnRail` of all wheels, left and right, wheelset after wheelset; two in a vehicle without wheelsets."""
        return self.pairs or (self.alike,) * (2 * max(1, len(self.vehicle.bodies.wheelsets)))

    @property
    def changing(self) -> tuple[Any, Any, Any]:
        """Crossings, wheels out of round and corrugation: causes of rails that change under a wheel."""
        return self.crossings, self.out_of_round, self.corrugation

    @cached_property
    def support(self) -> FlexibleTrack:
        """Flexible track under each wheelset, or a rigid one."""
        wheel = self.wheels[0] if any(self.changing) else self.alike
        first_state = self.vehicle.elements.states
        return read_support(self.data["track"].get("support"), wheel.rail_distance, first_state, self.reader)

    @property
    def support_states(self) -> int:
        """Number of states of the flexible track under all wheelsets."""
        return len(self.vehicle.bodies.wheelsets) * track_size(self.support)

    @cached_property
    def check_rails(self) -> CheckRails:
        """Check rails of all wheelsets."""
        return read_check_rails(self.data, self.wheels, self.reader)

    @cached_property
    def friction(self) -> Friction:
        """Friction of the rails; at the first access user-defined laws of friction are called."""
        return self._read_friction()

    @cached_property
    def drive(self) -> Drive:
        """Motors, brakes and speed controller."""
        commanded = outputs_of(self.data.get("control"))
        return read_drive(self.data.get("drive"), self.vehicle, commanded, self.reader)

    @property
    def controls(self) -> Controls:
        """Control laws."""
        return self._controls_and_tests[0]

    def try_control_laws(self) -> None:
        """Call each control law with the values in the vehicle's nominal position; InputError if a call fails."""
        for test in self._controls_and_tests[1]:
            test()

    @cached_property
    def _read_friction(self):
        return read_friction(self.data["contact"]["friction"], self.reader)

    @cached_property
    def _controls_and_tests(self):
        return read_controls(self.data, self.vehicle, self.support_states, self.reader)

    @property
    def reader(self) -> Reader:
        """`Reader` of the scene, for errors that name it."""
        return Reader(self.source, self.laws, self.files)

    @checked
    def pair(self, side: Annotated[str, OneOf(SIDES)] = "left", wheelset: Annotated[int, Within(0)] = 0) -> WheelOnRail:
        """Return the `WheelOnRail` of one side of a wheelset; wheelsets are numbered from the front, from 0."""
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
"""Types that are accepted as a scene: a checked `Scene`, the path of its file, or the file's content."""


def as_scene(scene: Source) -> Scene:
    """Return a `Scene` unchanged; read a file or its content with :func:`load_scene`."""
    return scene if isinstance(scene, Scene) else load_scene(scene)


def scene_of(run: Any, scene: Source | None, asker: str, trust: bool = False) -> Scene:
    """Return the scene of a run: the given ``scene``, or the scene that the run stores.

    Files that a stored scene names are read from the working directory, or from the examples if they have the digest
    that the run stores. ``asker`` is named in errors. With ``trust`` the laws that a run file names may be run.
    """
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
    """Read and check a scene. User-defined laws that it names are read, and are run when the scene is simulated.

    Parameters
    ----------
    scene : str, Path, dict or Scene
        Scene file, its content (then paths are relative to the working directory), or a scene to be changed.
    overrides : sequence of str, or dict
        ``key.path=value`` with the value in YAML, as ``wrcore simulate --set`` takes them; or values by ``key.path``.
        ``null`` (None) removes a key from the scene. Keys of the scene that a change makes void, such as
        ``contact.resolution`` with ``contact.patch=moment``, are left out; a line on stderr names them.
    trust : bool
        Whether the scene of a run file (``wr.load_run(path).scene``) may run the laws that it names.
    **changes
        Further values by key: ``speed=30``, ``integration__duration=2.0`` (two underscores stand for the dot) or
        ``initial={"y": 0.003, "yaw": 0.001}`` (other keys of the mapping are unchanged).

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
    """Return a scene with changes as in :func:`load_scene`; keys that ``undecided`` keys may make void are kept."""
    return _asked_for(scene, changes_of(overrides, {}), False, undecided)


def _asked_for(scene, asked, trust, undecided=()):
    return _loaded(scene, asked, (), texts_in([value for _, _, value in asked]), trust, undecided)


def changed_by_file(scene: Source, changes: Mapping[str, Any], *folders: Path, undecided: Iterable[str] = ()) -> Scene:
    """Return a scene with the changes that a file in ``folders``, such as a sweep or a wear plan, states.

    ``changes`` are as in :func:`load_scene`. Laws that they name are searched in ``folders`` and in the folders of the
    scene. Keys that ``undecided`` keys may make void are kept.
    """
    return _loaded(scene, changes_of(changes, {}), folders, undecided=undecided)


def _loaded(scene, asked, folders, named=(), trust=False, undecided=()):
    """Return the scene after the changes ``asked``; the other arguments are those of `Laws` and `load_scene`."""
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
    """Return the checked scene of a file's content and of the files that it names; ``laws`` finds user functions."""
    data, reader = validate(data, "scene", source), Reader(source, laws, {})
    leave_out_void_keys(data, source, changes, undecided)
    with laws.present():
        vehicle = vehicle_of(data["vehicle"], partial(reader.file, key="vehicle.parameters"), source, laws)
        vehicle = train_of(vehicle, data["vehicle"]["count"], data["vehicle"].get("spacing"), source)
    wheel, rail = wheel_and_rail(data, reader)
    check_creep(data["contact"], reader)
    data["track"] = validate(data["track"], "track", source, above="track")
    track = build_track(_with_points(data["track"], reader), source, reader.folder, laws)
    pairs = differing_pairs(data, vehicle, wheel, rail, track, reader)
    crossings = read_crossings(data, vehicle, pairs or (_alike(vehicle, wheel, rail, track),) * 2, reader)
    shapes = read_out_of_round(data, vehicle, pairs, crossings, reader)
    corrugation = read_corrugation(data, crossings, shapes, reader)
    if track.path.pieces.size and np.any(vehicle.joints.bodies == FRAME):
        expected = "expected 'tangent', as this vehicle has joints to the moving frame: elements to it may stay"
        raise reader.error("track.path", expected)
    check_bodies(data["initial"]["bodies"], vehicle, source)
    if "contact" not in (wanted := data["output"]["channels"]) and "wheel_motion" in wanted:
        raise reader.error("output.channels", "expected contact beside wheel_motion")
    files = reader.files
    scene = Scene(data, source, vehicle, wheel, rail, track, pairs, crossings, shapes, corrugation, files, laws)
    for part in ("support", "check_rails", "_read_friction", "_controls_and_tests", "drive"):
        getattr(scene, part)  # reads and checks the part
    files |= laws.files
    return scene


def _alike(vehicle, wheel, rail, track):
    """Return the `WheelOnRail` of both sides, where all wheels and rails are equal."""
    return WheelOnRail(wheel, rail, vehicle.rolling_radius, vehicle.half_distance, track.rail_distance(rail))


def _with_points(track, reader):
    """Return the scene's track with the absolute paths of its irregularity files."""
    names = track.get("irregularity", {}).get("points", [])
    names = [names] if isinstance(names, str) else names
    found = [str(reader.file(name, "track.irregularity.points").resolve()) for name in names]
    return {**track, "irregularity": {**track["irregularity"], "points": found}} if found else track
