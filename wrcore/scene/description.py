"""Scenes: a validated description becomes a compiled model and its initial state."""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, field
from functools import cached_property, partial
from os import PathLike
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from wrcore.balance.bodies import check_bodies
from wrcore.balance.initial import initial_state, rest
from wrcore.balance.initial import static_equilibrium as static_equilibrium
from wrcore.contact.detection import DETECTIONS
from wrcore.contact.normal import hertz_table
from wrcore.contact.patch.model import strip_model
from wrcore.contact.reduction import MOMENT, REDUCTIONS
from wrcore.contact.wheel_on_rail import WheelOnRail
from wrcore.creep.laws import LAWS, OWN, creep_data, own_law
from wrcore.creep.table import DEFAULT_TOLERANCE, ensure_table, kept_tables, load_table
from wrcore.dynamics.crossing import no_crossing
from wrcore.dynamics.marker import FRAME
from wrcore.dynamics.system import Model
from wrcore.dynamics.track import TrackModel
from wrcore.dynamics.wheel import ContactModel
from wrcore.errors import InputError
from wrcore.errors.checked_calls import OneOf, Within, checked
from wrcore.errors.checked_yaml import read_source, validate
from wrcore.errors.input_files import digest_of_all
from wrcore.geometry.corrugation import Corrugation
from wrcore.geometry.out_of_round import OutOfRound
from wrcore.geometry.profile import ProfileCurve
from wrcore.geometry.track import SIDES, Track, build_track
from wrcore.kernels.cache import say
from wrcore.kernels.told import tell
from wrcore.scene.changes import changes_of, of_a_change, set_at
from wrcore.scene.check_rail import read_check_rails
from wrcore.scene.control import outputs_of, read_controls
from wrcore.scene.crossing import LaidCrossing, read_corrugation, read_crossings, seen_by_wheels, warn_of_rigid_rails
from wrcore.scene.drive import read_drive
from wrcore.scene.examples import examples_folder
from wrcore.scene.friction import read_friction
from wrcore.scene.out_of_round import read_out_of_round
from wrcore.scene.pairs import differing_pairs, digests_of_files, find_file, wheel_and_rail
from wrcore.scene.support import check_support, track_support
from wrcore.vehicle.description import GRAVITY, Vehicle, vehicle_of
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
    crossings: tuple[LaidCrossing, ...] = ()
    out_of_round: tuple[tuple[OutOfRound | None, float], ...] = ()
    corrugation: Corrugation | None = None
    files: dict[str, str] = field(default_factory=dict)

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


def scene_of(run: Any, scene: Source | None, asker: str) -> Scene:
    """The scene of a run: what stands for it, or read anew by what the run says. Its files are in the working directory
    or, if they hold what the run's did, beside the examples. ``asker`` is named in errors."""
    if scene is not None:
        return as_scene(scene)
    try:
        return load_scene(run.scene)
    except InputError as error:
        with suppress(InputError):
            found = _checked(copy.deepcopy(run.scene), "scene", examples_folder() / "scenes")
            if digest_of_all(found.files) == run.settings.get("files_sha256"):
                return found
        raise InputError(asker, "scene", f"expected that of the run, as its files are not here ({error})") from None


@checked
def load_scene(scene: Source, overrides: Iterable[str] | Mapping[str, Any] = (), **changes: Any) -> Scene:
    """Read and check a scene.

    Parameters
    ----------
    scene : str, Path, dict or Scene
        Scene file, the content of one (then paths count from the working directory), or a scene to be changed.
    overrides : sequence of str, or dict
        ``key.path=value`` with the value in YAML, as ``wrcore simulate --set`` takes them; or values by ``key.path``.
        ``null`` (None) takes a key out of the scene.
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
    if isinstance(scene, Scene):
        source, folder, data = scene.source, Path(scene.source).parent, copy.deepcopy(scene.data)
    else:
        source, folder, data = read_source(scene, "scene")
    asked = changes_of(overrides, changes)
    for option, key, value in asked:
        set_at(data, key, value, option)
    try:
        return _checked(data, source, folder)
    except InputError as error:
        raise of_a_change(error, source, asked) from None


def _checked(data: dict[str, Any], source: str, folder: Path) -> Scene:
    """The scene of a file's content, with whatever other files it names."""
    data = validate(data, "scene", source)
    digests = digests_of_files(data, folder)  # before they are read: what changes meanwhile does not go unseen
    find = partial(find_file, folder=folder, source=source, field="vehicle.parameters")
    vehicle = vehicle_of(data["vehicle"], find, source)
    vehicle = train_of(vehicle, data["vehicle"]["count"], data["vehicle"].get("spacing"), source)
    wheel, rail = wheel_and_rail(data, folder, source)
    _check_creep(data["contact"], source, folder)
    track = build_track(_with_points(data["track"], folder, source), source, folder)
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
    read_friction(data["contact"]["friction"], source, folder)
    if "contact" not in (wanted := data["output"]["channels"]) and "wheel_motion" in wanted:
        raise InputError(source, "output.channels", "expected contact beside wheel_motion")
    read_controls(data, vehicle, folder, source)
    read_drive(data.get("drive"), vehicle, source, outputs_of(data.get("control")))
    digests |= digests_of_files(vehicle.data["elements"], folder)
    return Scene(data, source, vehicle, wheel, rail, track, pairs, crossings, shapes, corrugation, digests)


def _alike(vehicle, wheel, rail, track):
    """The `WheelOnRail` of either side of every wheelset where all are alike."""
    distance = track.rail_distance(rail)
    return (WheelOnRail(wheel, rail, vehicle.rolling_radius, vehicle.half_distance, distance),) * 2


def _check_creep(contact, source, folder):
    """Complete what a scene says of its creep law, and refuse what does not belong to the law."""
    creep = contact["creep"]
    creep.setdefault("tolerance", DEFAULT_TOLERANCE)
    if creep["model"] not in LAWS:
        try:
            own_law(creep["model"], folder)
        except InputError as error:
            raise InputError(source, "contact.creep.model", error.expected) from None
        if contact["patch"] not in REDUCTIONS:
            expected = f"expected {' or '.join(REDUCTIONS)} with a creep law of your own, got {contact['patch']}:"
            expected += " set contact.patch to one of them"
            raise InputError(source, "contact.patch", expected)
    elif creep["model"] != "table" and contact["patch"] not in REDUCTIONS:
        expected = f"expected 'table' with contact.patch {contact['patch']}, which has creep forces of its own"
        got = f"got {creep['model']}; set contact.patch to {' or '.join(REDUCTIONS)}, which take any, beside it"
        raise InputError(source, "contact.creep.model", f"{expected}, {got}")
    if creep["planes"] == "sdec" and (contact["patch"] != "moment" or creep["model"] != "table"):
        raise InputError(source, "contact.creep.planes", "expected 'ellipse': 'sdec' is for 'moment' and a creep table")
    for key in ("k_A", "k_S"):
        if key in creep and creep["model"] != "polach":
            raise InputError(source, f"contact.creep.{key}", f"expected model polach with it, got {creep['model']}")
    if creep.get("k_S", 0.0) > creep.get("k_A", 1.0):
        expected = f"expected no more than k_A, {creep['k_A']:g}, got {creep['k_S']:g}"
        raise InputError(source, "contact.creep.k_S", expected)
    if "table" in creep:
        creep["table"] = str(find_file(creep["table"], folder, source, "contact.creep.table"))


def _with_points(track, folder, source):
    """The scene's track with the place of its measured irregularity, which is looked for as all other files are."""
    irregularity = track.get("irregularity")
    points = irregularity.get("points") if isinstance(irregularity, dict) else None
    names = [points] if isinstance(points, str) else points
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        return track
    found = [str(find_file(name, folder, source, "track.irregularity.points").resolve()) for name in names]
    return {**track, "irregularity": {**irregularity, "points": found[0] if isinstance(points, str) else found}}


LIKE_FRICTION = 0.8
"""Of a rail's largest friction: where it falls below, it is said what looked-up contact errs by."""


def announce(text):
    """One line on stderr before work that takes long, whoever listens; none with ``WRCORE_PROGRESS=0``."""
    if os.environ.get("WRCORE_PROGRESS") != "0":
        say(text)


def _creep(scene, progress):
    """Data of the scene's creep law; only the law ``table`` loads (or builds) a table.

    What is looked up lies beside one creep table, whichever the scene names: that for which nodes come with the
    package."""
    contact = scene.data["contact"]
    creep, nu = contact["creep"], contact["material"]["poisson_ratio"]
    factors = creep.get("k_A", 1.0), creep.get("k_S", creep.get("k_A", 1.0))
    if creep["model"] != "table":
        law = None if creep["model"] in LAWS else own_law(creep["model"], Path(scene.source).parent)
        return creep_data(nu, factors=factors, law=law)
    looked_up = contact["patch"] == "tabulated"
    if "table" in creep and not looked_up:
        table = load_table(creep["table"])
    else:
        tolerance = DEFAULT_TOLERANCE if looked_up else creep["tolerance"]
        if not kept_tables(nu, creep["planes"], tolerance):
            announce(f"building a creep table ({creep['planes']}, {tolerance:g}): some ten seconds, once")
        table = ensure_table(nu, creep["planes"], tolerance, progress)
    if abs(table.nu - nu) > 1e-9:
        expected = f"expected a table for Poisson's ratio {nu:g}, got one for {table.nu:g}"
        raise InputError(scene.source, "contact.creep.table", expected)
    return creep_data(nu, table.kernel_data(), factors=factors)


def compile_scene(
    scene: Scene,
    progress: Callable | None = None,
    shared: dict[Any, Any] | None = None,
    meanwhile: Callable[[Model], AbstractContextManager] = nullcontext,
) -> tuple[Model, np.ndarray]:
    """A scene's model, as kernels take it, and its initial state (13 n,): wheelsets at rest on the rails vertically and
    in roll, rolling forward without slip.

    ``progress`` wraps the list of patches if a creep table has to be built, e.g. ``tqdm.tqdm``. ``shared`` keeps what
    does not change from one scene of a series to the next (contact geometry, creep table, static equilibrium); it knows
    vehicles, profiles and tracks by their identity. ``meanwhile`` makes of the model a context for what follows on it.
    """
    shared = {} if shared is None else shared
    data, vehicle = scene.data, scene.vehicle
    contact, integration = data["contact"], data["integration"]
    material, damping = contact["material"], contact["normal"]["damping"]
    changing = scene.crossings, scene.out_of_round, scene.corrugation
    if contact["patch"] == "tabulated" and scene.detection != "spatial":
        tell(
            f"{scene.source}: contact.detection {scene.detection} beside contact.patch tabulated: each patch is solved,"
            " some hundred times as slow as the table; set contact.patch to moment, or contact.detection to spatial"
        )
    parts = vehicle, scene.wheel, scene.rail, scene.track, scene.pairs, *changing  # known by their identity
    folder = Path(scene.source).parent
    friction = read_friction(contact["friction"], scene.source, folder)
    if contact["patch"] == "tabulated" and friction.least_share < LIKE_FRICTION:
        tell("contact.friction falls along a rail: looked-up creep forces err where it is low, at half of the "
             "largest one by 2 to 3 % of mu N, at a sixth by 14 to 19; contact.patch exact does not")  # fmt: skip
    geometry = _kept(shared, "geometry", parts, lambda: scene.alike.geometry)
    geometries, plain, crossing = tuple(pair.geometry for pair in scene.pairs), (), no_crossing()
    pairs = scene.pairs or (scene.alike,) * (2 * len(vehicle.bodies.wheelsets))
    if any(changing):
        starts = vehicle.positions[vehicle.bodies.wheelsets, 0]
        geometries, crossing = _kept(shared, "crossing", parts, lambda: seen_by_wheels(*changing, pairs, starts))
        geometry, plain = geometries[0], tuple(pair.geometry for pair in pairs)  # of the type of all
        if "support" not in data["track"]:
            warn_of_rigid_rails(scene.source)
    support, elements = track_support(
        data["track"].get("support"), geometry.rail_distance, vehicle.elements, len(vehicle.bodies.wheelsets)
    )
    model = Model(
        vehicle.bodies,
        ContactModel(
            geometry, hertz_table(), LAWS.get(contact["creep"]["model"], OWN),
            _kept(shared, "creep", (*contact["creep"].values(), *material.values(), contact["patch"] == "tabulated"),
                  lambda: _creep(scene, progress)),
            DETECTIONS[scene.detection], float(contact["detection_tolerance"]),
            REDUCTIONS.get(contact["patch"], MOMENT),
            float(material["shear_modulus"]), float(material["poisson_ratio"]), friction.largest,
            float(damping["c_e"]), float(damping["v0"]), float(contact["creep"]["least_speed"]),
            strip_model(contact["patch"], contact["resolution"], contact["slip"], material["poisson_ratio"],
                        friction.largest),
            friction.ratio, friction.decay,
            geometries, plain, friction_factors=friction.factors,
        ),
        elements, vehicle.joints,
        TrackModel(bool(scene.track.tangent), scene.track.path, scene.track.irregularity),
        float(data["speed"]), GRAVITY,
        float(integration["baumgarte"]["alpha"]), float(integration["baumgarte"]["beta"]),
        friction=friction.rails, flexible_track=support,
        drive=read_drive(data.get("drive"), vehicle, scene.source, outputs_of(data.get("control"))),
        controls=read_controls(data, vehicle, folder, scene.source), crossing=crossing,
        check_rails=read_check_rails(data, pairs, scene.source),
    )  # fmt: skip
    decisive = (
        parts, scene.detection, contact["detection_tolerance"], contact["patch"], *material.values(),
        *damping.values(), *integration["baumgarte"].values(), json.dumps(data["track"].get("support")),
    )  # fmt: skip
    with meanwhile(model):
        at_rest = _kept(shared, "rest", decisive, lambda: rest(scene, model))
        return model, initial_state(scene, model, at_rest, shared)


def _kept(shared, name, key, make):
    """The part of a name that was made for a key before, or is made now."""
    if (name, key) not in shared:
        shared[name, key] = make()
    return shared[name, key]
