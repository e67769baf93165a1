"""Equations of motion for a series of runs, which share kernels and scratch arrays."""

import threading

import numpy as np

from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.kernels import looked_up, with_wheels
from wrcore.equations.model import internal_states, workspace
from wrcore.forces.control import with_control_laws
from wrcore.forces.law import LAW
from wrcore.forces.suspension import with_laws
from wrcore.kernels.handles import Kind, values_of
from wrcore.wheels.contact_model import shaped


def equations_of(model, shared=None):
    """Return the equations of motion of a model, with scratch arrays as if newly allocated.

    Each thread reuses its equations for the next model of the same structure. ``shared`` is the cache of these
    equations; the next call in a thread changes the equations that the last one returned."""
    if shared is None:
        return Equations(model)
    thread = "equations", threading.get_ident()
    last, equations, scratch = shared.get(thread, (None, None, ()))
    if model is not last:
        key = *thread, *structure(model)
        if key not in shared:
            equations, new = Equations(model), workspace(model)
            shared[key] = equations, list(zip(_arrays(equations.work), _arrays(new), strict=True))
        else:
            equations, scratch = shared[key]
            equations.turn_to(with_kernels_of(model, equations.arguments[1].value))
        shared[thread] = model, *shared[key]
    for array, values in scratch:
        array[...] = values
    return equations


def structure(model):
    """Return the properties of a model that determine its kernels and scratch arrays.

    Models of equal structure can use both in turn."""
    contact, strips = model.contact, model.contact.strips
    sizes = tuple(array.shape for array in _arrays(strips)) if strips.strips else ()
    return (
        Kind(model)._numba_type_, id(model.bodies), id(model.joints), internal_states(model), len(model.drive.rows),
        len(model.friction.points), len(model.flexible_track.mass), len(contact.geometries), shaped(contact),
        len(contact.friction_across_right) > 0,
        len(contact.surrogate.median), strips[:3], sizes, len(set(looked_up(model))), *model.controls.period,
        *map(np.shape, model.controls), model.crossing.tables.shape, model.check_rails.rows.shape,
    )  # fmt: skip


def with_kernels_of(model, other):
    """Return the model with the addresses of the kernels of another one of the same structure.

    The other model comes from `wrcore.equations.kernels.with_kernels`."""
    contact = model.contact
    if contact.strips.strips:
        contact = contact._replace(strips=contact.strips._replace(**_addresses(other.contact)))
    contact = with_wheels(model._replace(contact=contact))
    elements, controls = _with_laws_of(model.elements, other.elements), with_control_laws(model.controls)
    return model._replace(contact=contact, elements=elements, controls=controls, kernels=other.kernels)


def _with_laws_of(elements, other):
    """Return the elements with the addresses of their force laws, copied from ``other`` if the laws are equal."""
    if np.array_equal(elements.law[:, LAW], other.law[:, LAW]) and np.array_equal(elements.own, other.own):
        return elements._replace(laws=other.laws, own_laws=other.own_laws)
    return with_laws(elements)


def _addresses(contact):
    """Return the addresses of the kernels of patches on strips from a contact model or its wheel-specific models."""
    strips = (*values_of(contact.wheels), contact)[0].strips
    return {"grid_kernel": strips.grid_kernel, "patch_forces_kernel": strips.patch_forces_kernel}


def _arrays(part):
    """Yield all arrays of a nested tuple of arrays, tuples and numbers."""
    if isinstance(part, np.ndarray):
        yield part
    elif isinstance(part, tuple):
        for item in part:
            yield from _arrays(item)
