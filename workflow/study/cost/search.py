"""Time of the contact search of one wheel on tread and flange, by detection (planar, spatial) and reduction."""

from functools import partial

import numpy as np

from study.cost.recorded import lasting
from study.cost.stages import search_all
from study.cost.timing import compare
from wrcore.contact.hertz import contact_modulus
from wrcore.contact.rigid.height_at_load import height_at_load
from wrcore.contact.search.detection import PLANAR, SPATIAL, axle_direction
from wrcore.contact.search.reduction import MAX_PATCHES, MOMENT, PATCH_COLUMNS, REDUCTIONS
from wrcore.kernels.handles import Handle
from wrcore.wheels.motion import MOTION

PLACES = {"tread": ((-0.003, 0.003), (-0.003, 0.003)), "flange": ((0.0068, 0.0078), (-0.015, 0.015))}
"""Ranges of lateral position (m) and yaw (rad) of the left wheel."""

LOAD = 5e4
"""Mean load of the wheel, N; loads vary by ± 20 %."""


def loaded_wheels(contact, place, count):
    """Return random motions of left wheels at rest that carry `LOAD` on tread or flange (``place``, key of `PLACES`).

    The array (count, 15) is an argument of `wrcore.wheels.hertzian_force.wheel_wrenches`.
    """
    rng, rows, motions = np.random.default_rng(0), np.empty((MAX_PATCHES, PATCH_COLUMNS)), []
    (low, high), (least, most) = PLACES[place]
    modulus = contact_modulus(contact.shear_modulus, contact.poisson_ratio)
    for _ in range(count):
        y, yaw, load = rng.uniform(low, high), rng.uniform(least, most), LOAD * rng.uniform(0.8, 1.2)
        z = height_at_load(
            contact.geometry, contact.hertz, modulus, 1.0, y, 0.0, yaw, True, MOMENT, load,
            contact.geometry.rolling_radius, rows,
        )  # fmt: skip
        motions.append([1.0, y, z, *axle_direction(0.0, yaw)])
    padded = np.pad(motions, ((0, 0), (0, len(MOTION) - len(motions[0]))))
    padded[:, MOTION.friction] = contact.friction
    return padded


def search_costs(contact, count, passes):
    """Time the contact search for ``count`` random wheels; return rows of `compare` by place and reduction."""
    rows, patches = [], np.zeros((count, MAX_PATCHES, PATCH_COLUMNS))
    for place in PLACES:
        motions = loaded_wheels(contact, place, count)
        for name, reduction in REDUCTIONS.items():
            contenders = []
            for label, detection in (("spatial", SPATIAL), ("planar", PLANAR)):
                model = Handle(contact._replace(detection=detection, reduction=reduction))
                contenders.append(lasting(label, partial(search_all, model), (motions, patches), count))
            rows += compare(f"search: {place}, {name}", "wheel", contenders, passes, "ns")
    return rows
