"""Compilation of a checked scene to a model for kernels and its initial state."""

import json
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import numpy as np

from wrcore.balance.initial import equilibrium_positions, initial_state
from wrcore.contact.hertz import hertz_table
from wrcore.contact.patch.model import strip_model
from wrcore.contact.search.detection import DETECTIONS
from wrcore.contact.search.reduction import MOMENT, REDUCTIONS
from wrcore.contact.surrogate.network import load_surrogate, no_surrogate
from wrcore.creep.laws import LAWS, USER_LAW
from wrcore.equations.model import Model
from wrcore.errors.messages import tell
from wrcore.scene.description import Scene
from wrcore.scene.parts.changing_rails import sections_under_wheels, warn_of_rigid_rails
from wrcore.scene.parts.creep import creep_of
from wrcore.track.changing_rails import no_crossing
from wrcore.track.track import TrackModel
from wrcore.vehicle.description import GRAVITY
from wrcore.vehicle.element_parts import try_laws
from wrcore.wheels.contact_model import ContactModel

LIKE_FRICTION = 0.8
"""Fraction of a rail's largest friction coefficient: if friction falls below it, a warning states the error of the
lookup table."""


def _allow_laws(scene):
    """Test-call the user-defined laws of a scene's force elements; InputError if the scene's laws may not be run."""
    with scene.reader.errors_of("trust"):
        scene.laws.allow()
    with scene.laws.present():
        try_laws(scene.vehicle.data["elements"], scene.vehicle.source_file)
    return True


def compile_scene(
    scene: Scene,
    progress: Callable | None = None,
    shared: dict[Any, Any] | None = None,
    meanwhile: Callable[[Model], AbstractContextManager] = nullcontext,
) -> tuple[Model, np.ndarray]:
    """Return a scene's model for kernels and its initial state (13 n,).

    In the initial state the wheelsets are in vertical and roll equilibrium on the rails and roll forward without slip.

    ``progress`` wraps the list of patches if a creep table has to be built, e.g. ``tqdm.tqdm``. ``shared`` caches parts
    that do not change from one scene of a series to the next: contact geometry, creep table, static equilibrium. Its
    keys are the identities of vehicles, profiles and tracks. ``meanwhile(model)`` returns a context manager in which
    the equilibrium and the initial state are computed.
    """
    shared = {} if shared is None else shared
    data, contact = scene.data, scene.data["contact"]
    model = model_of(scene, progress, shared)
    track = _track(scene, shared)
    parts = scene.vehicle, scene.wheel, scene.rail, track, scene.pairs, *scene.changing
    decisive = (
        parts, scene.detection, contact["detection_tolerance"], contact["patch"], *contact["material"].values(),
        *contact["normal"]["damping"].values(), *data["integration"]["baumgarte"].values(),
        json.dumps(data["track"].get("support")),
    )  # fmt: skip
    with meanwhile(model):
        at_rest = _kept(shared, "equilibrium_positions", decisive, lambda: equilibrium_positions(scene, model))
        return model, initial_state(scene, model, at_rest, shared)


def model_of(scene: Scene, progress: Callable | None = None, shared: dict[Any, Any] | None = None) -> Model:
    """Return a scene's model for kernels, without the search for its initial state; arguments as for `compile_scene`.

    With exact contact this search takes half a minute for a vehicle with four wheelsets.
    """
    shared = {} if shared is None else shared
    data, vehicle = scene.data, scene.vehicle
    contact, integration = data["contact"], data["integration"]
    material, damping = contact["material"], contact["normal"]["damping"]
    changing = scene.changing
    if contact["patch"] == "tabulated" and scene.detection != "spatial":
        tell(
            f"{scene.source}: contact.detection {scene.detection} beside contact.patch tabulated: each patch is solved,"
            " some hundred times as slow as the table; set contact.patch to moment, or contact.detection to spatial"
        )
    _kept(shared, "laws", (vehicle, scene.laws), lambda: _allow_laws(scene))
    track = _track(scene, shared)
    parts = vehicle, scene.wheel, scene.rail, track, scene.pairs, *changing  # keys of ``shared`` by identity
    friction = scene.friction
    if contact["patch"] == "tabulated" and friction.least_share < LIKE_FRICTION:
        tell("contact.friction falls along a rail: looked-up creep forces err where it is low, at half of the "
             "largest one by 2 to 3 % of mu N, at a sixth by 14 to 19; contact.patch exact does not")  # fmt: skip
    geometry = _kept(shared, "geometry", parts, lambda: scene.alike.geometry)
    geometries, plain, crossing = tuple(pair.geometry for pair in scene.pairs), (), no_crossing()
    if any(changing):
        starts = vehicle.positions[vehicle.bodies.wheelsets, 0]
        geometries, crossing = _kept(
            shared, "crossing", parts, lambda: sections_under_wheels(*changing, scene.wheels, starts)
        )
        geometry, plain = geometries[0], tuple(pair.geometry for pair in scene.wheels)  # of the type of all
        if "support" not in data["track"]:
            warn_of_rigid_rails(scene.source)
    elements = vehicle.elements._replace(states=vehicle.elements.states + scene.support_states)
    scene.try_control_laws()
    return Model(
        vehicle.bodies,
        ContactModel(
            geometry, hertz_table(), LAWS.get(contact["creep"]["model"], USER_LAW),
            _kept(shared, "creep", (*contact["creep"].values(), *material.values()),
                  lambda: creep_of(scene, progress)),
            DETECTIONS[scene.detection], float(contact["detection_tolerance"]),
            REDUCTIONS.get(contact["patch"], MOMENT),
            float(material["shear_modulus"]), float(material["poisson_ratio"]), friction.largest,
            float(damping["c_e"]), float(damping["v0"]), float(contact["creep"]["least_speed"]),
            strip_model(contact["patch"], contact["resolution"], contact["slip"], material["poisson_ratio"],
                        friction.largest),
            friction.ratio, friction.decay,
            geometries, plain, friction_factors=friction.factors,
            surrogate=load_surrogate() if contact["patch"] == "surrogate" else no_surrogate(),
            friction_across=friction.across[0], friction_across_right=friction.across[1],
        ),
        elements, vehicle.joints,
        TrackModel(bool(track.tangent), track.path, track.irregularity),
        float(data["speed"]), GRAVITY,
        float(integration["baumgarte"]["alpha"]), float(integration["baumgarte"]["beta"]),
        friction=friction.rails, flexible_track=scene.support, drive=scene.drive, controls=scene.controls,
        crossing=crossing, check_rails=scene.check_rails,
    )  # fmt: skip


def _track(scene, shared):
    """Return the scene's track with the irregularity of its user-defined law."""
    return _kept(shared, "track", (scene.track,), lambda: scene.track.with_laws(scene.laws))


def _kept(shared, name, key, make):
    """Return the part stored in ``shared`` under name and key; make and store it if it is missing."""
    if (name, key) not in shared:
        shared[name, key] = make()
    return shared[name, key]
