"""Addresses of the kernels of patches on strips.

Kernels that solve a patch are compiled at the start of a run; with a lookup table, when the first patch is solved."""

import ctypes

import numpy as np

from wrcore.contact.normal.gap import Frame
from wrcore.contact.patch.model import ELLIPSES, KERNEL, LOAD, LOBES, MODEL, strip_work, with_tables
from wrcore.contact.patch.solution import solve_on_grid
from wrcore.contact.search.approach import Pressed
from wrcore.contact.search.reduction import PATCH_COLUMNS
from wrcore.contact.search.strip import Pose
from wrcore.errors.messages import say_if_long
from wrcore.kernels.handles import Handle, Handles, Kernel, Kind, values_of
from wrcore.kernels.interrupts import handed_on, interrupted
from wrcore.wheels.contact_model import COUNTERS, without_wheels
from wrcore.wheels.exact_force import add_group
from wrcore.wheels.hertzian_force import wheel_wrenches
from wrcore.wheels.modes import FRESH
from wrcore.wheels.motion import MOTION, WheelMotion
from wrcore.wheels.normal_damping import Lift
from wrcore.wheels.table.store import WITHOUT, with_pair
from wrcore.wheels.table_force import add_tabulated
from wrcore.wheels.table_force_apart import look_lobes_up


def with_fallback(contact):
    """Return the contact model with the address of the grid solver, which is used if strips do not converge."""
    m, pose, frame = (kind(*np.zeros(len(kind._fields))) for kind in (WheelMotion, Pose, Frame))
    solver = Kernel(
        solve_on_grid, Kind(without_wheels(contact)), m, pose, frame, (0.0, 0.0, 0.0), 0.0,
        np.zeros(PATCH_COLUMNS),
    )  # fmt: skip
    return contact._replace(strips=contact.strips._replace(grid_kernel=solver.address))


def with_groups(contact, work):
    """Return the contact model with the address of the kernel that computes the forces of a patch on strips."""
    looked_up = contact.strips.looked_up > 0.0
    contact = contact if looked_up else with_fallback(contact)
    group = _of_patches(add_tabulated if looked_up else add_group, contact, work)
    return contact._replace(strips=contact.strips._replace(patch_forces_kernel=group))


def with_late(contact):
    """Return the contact model with its lookup tables and `LateKernels`, also in its wheel-specific models."""
    if len(contact.wheels):
        contact = contact._replace(wheels=np.asarray(Handles(map(_with_own, values_of(contact.wheels)))))
    return _with_own(contact)


def _with_own(contact):
    if contact.strips.looked_up and not len(contact.wheels) and not len(contact.strips.table.keys):
        contact = with_pair(contact)
    late = LateKernels(contact)
    return contact._replace(strips=contact.strips._replace(late=np.asarray(late)))


def _of_patches(kernel, contact, work):
    """Return the address of ``kernel``, compiled for the signature of a kernel of patches (`add_group`)."""
    m, row = WheelMotion(*np.zeros(len(WheelMotion._fields))), np.zeros(PATCH_COLUMNS)
    kind, counters = Kind(without_wheels(contact)), np.zeros(COUNTERS, np.int64)
    return Kernel(kernel, kind, m, True, row[None], 0, 0, row, row, counters, row, Kind(work)).address


class LateKernels:
    """Kernels that are compiled or loaded when a run first calls them, see `StripModel.late`."""

    def __init__(self, contact):
        self._contact, self._call = contact, ctypes.CFUNCTYPE(None, ctypes.c_int64)(self.find)
        self._places = np.zeros(5, np.int64)
        self._places[LOAD] = ctypes.cast(self._call, ctypes.c_void_p).value

    @property
    def __array_interface__(self):
        """Array interface of the addresses `StripModel.late`; an array made from it keeps this object alive."""
        return self._places.__array_interface__

    def find(self, which):
        """Compile and store a kernel: that of ellipses, that of separate sub-patches, or the solver with its model.

        ``which`` is an index of `StripModel.late`."""
        if interrupted():
            return
        what = {ELLIPSES: "ellipses", LOBES: "lobes that are apart"}.get(which, "the solver of exact contact")
        text = f"{what}: compiled, once, for {'some minutes' if which == KERNEL else 'seconds'} of one core; {WITHOUT}"
        with handed_on("it has no solver"), say_if_long(text):
            if which == ELLIPSES:
                self._places[ELLIPSES] = self._with_ellipses()
            elif which == LOBES:
                self._places[LOBES] = self._of_lobes()
            else:
                strips = with_tables(self._contact.strips)
                contact = with_fallback(self._contact._replace(strips=strips))
                self._model = Handle(contact)
                kernel = _of_patches(add_group, contact, strip_work(strips, 1))
                self._places[[MODEL, KERNEL]] = self._model.address, kernel

    def _of_lobes(self):
        m, pressed, lift = (kind(*np.zeros(len(kind._fields))) for kind in (WheelMotion, Pressed, Lift))
        kind, work = Kind(without_wheels(self._contact)), Kind(strip_work(self._contact.strips, 1))
        counters = np.zeros(COUNTERS, np.int64)
        return Kernel(look_lobes_up, kind, m, pressed, lift, (0.0, 0.0), 0.0, counters, work).address

    def _with_ellipses(self):
        work, counts = Kind(strip_work(self._contact.strips, 1)), np.zeros((1, 2), np.int64)
        motions, patches, bounds = np.zeros((1, 2, len(MOTION))), np.zeros((1, 2, 1, PATCH_COLUMNS)), np.zeros((1, 2))
        return Kernel(
            wheel_wrenches, Kind(self._contact), motions, patches, counts, bounds, motions, counts[0], work, FRESH
        ).address
