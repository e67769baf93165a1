"""Choice of a model's kernels: only kernels that a scene needs are compiled; they are called by address."""

import numpy as np

from wrcore.bodies.joint_forces import add_reactions
from wrcore.equations.model import Kernels
from wrcore.forces.control import with_controls
from wrcore.forces.drive import add_drive
from wrcore.forces.suspension import with_laws
from wrcore.kernels.handles import Handles, Kernel, Kind
from wrcore.track.changing_rails import lay_sections, shorten_step, with_copied_arrays
from wrcore.track.check_rail import press_check_rails, shorten_near_check_rails
from wrcore.track.flexible_track import flexible_wrenches
from wrcore.track.track import fill_rail_friction
from wrcore.wheels.contact_model import shaped, without_wheels
from wrcore.wheels.hertzian_force import wheel_wrenches
from wrcore.wheels.modes import FRESH


def looked_up(model):
    """Return the coefficients of friction of the lookup tables for the left and the right rail; 0 without a table.

    If friction changes along a rail, its maximum is used."""
    strips, friction = model.contact.strips, model.friction
    if not strips.looked_up or not len(friction.points):
        return [strips.looked_up] * 2
    return [float(rail[:, 1].max()) for rail in np.split(friction.points, friction.starts[1:-1])]


def with_wheels(model):
    """Return the contact model of a model with wheel-specific contact models, if wheels or rails differ.

    Patches on strips also get their lookup tables and late-compiled kernels."""
    contact, of_rails = model.contact, looked_up(model)
    if contact.geometries or of_rails[0] != of_rails[1] or len(contact.friction_across_right):
        across = contact.friction_across, contact.friction_across_right
        wheels, bare = [], without_wheels(contact, friction_across_right=np.zeros((0, 2)))
        for k, geometry in enumerate(contact.geometries or (contact.geometry,) * (2 * len(model.bodies.wheelsets))):
            strips = contact.strips._replace(looked_up=of_rails[k % 2])
            if strips.looked_up and contact.plain:
                from wrcore.wheels.table.store import with_pair

                strips = with_pair(bare._replace(geometry=contact.plain[k], strips=strips)).strips
            geometry = with_copied_arrays(geometry) if len(model.crossing.tables) else geometry
            factors = across[k % 2] if len(across[1]) else across[0]
            wheels.append(bare._replace(geometry=geometry, strips=strips, friction_across=factors))
        contact = bare._replace(wheels=np.asarray(Handles(wheels)))
    if contact.strips.strips:
        from wrcore.wheels.kernels import with_late

        contact = with_late(contact)
    return contact


def with_kernels(model, work):
    """Return the model with the addresses of its kernels (wheels, elements, joints, ...).

    Only kernels that the model needs are compiled."""
    wrenches, contact = wheel_wrenches, model.contact
    if contact.strips.strips and len(work.motions):
        from wrcore.wheels.exact_force import strip_wrenches
        from wrcore.wheels.kernels import with_groups

        wrenches, contact = strip_wrenches, with_groups(contact, work.strips)
    elif len(contact.surrogate.median):
        from wrcore.wheels.surrogate_force import surrogate_wrenches

        wrenches = surrogate_wrenches
    elif shaped(contact):
        from wrcore.wheels.shaped_force import shaped_wrenches

        wrenches = shaped_wrenches
    # kernels below are compiled for the type of the final model
    model = model._replace(contact=with_wheels(model._replace(contact=contact)), elements=with_laws(model.elements))
    kind, scratch, state, kernels = Kind(model), Kind(work), np.empty(0), {}
    if model.joints.equations:
        kernels["joint_reactions_kernel"] = Kernel(add_reactions, kind, 0.0, state, scratch)
    if len(model.controls.rows):
        model, own = with_controls(model, kind, scratch, state)
        kernels |= own
    elif len(model.drive.rows):
        kernels["drive_torques_kernel"] = Kernel(add_drive, kind, 0.0, state, scratch, state)
    if len(model.friction.points):
        kernels["rail_friction_kernel"] = Kernel(fill_rail_friction, kind, state, scratch)
    if len(model.crossing.tables):
        kernels["rail_sections_kernel"] = Kernel(lay_sections, kind, state, scratch)
        kernels["step_limit_kernel"] = Kernel(shorten_step, kind, state, scratch, state, 0)
    if len(model.check_rails.rows):
        kernels["check_rails_kernel"] = Kernel(press_check_rails, kind, state, scratch)
        kernels["step_limit_kernel"] = Kernel(shorten_near_check_rails, kind, state, scratch, state, 0)
    if len(model.bodies.wheelsets) and len(model.flexible_track.mass):
        kernels["flexible_track_kernel"] = Kernel(flexible_wrenches, kind, state, scratch, state, FRESH)
    if len(model.bodies.wheelsets):
        kernels["wheel_forces_kernel"] = Kernel(
            wrenches, Kind(model.contact), work.motions, work.patches, work.counts, work.bounds, work.rail_wrenches,
            work.counters, Kind(work.strips), FRESH,
        )  # fmt: skip
    addresses = {name: getattr(kernel, "address", kernel) for name, kernel in kernels.items()}
    return model._replace(kernels=Kernels(**addresses))
