"""The network of the surrogate and its loss in JAX.

Outputs are `wrcore.contact.surrogate.network.N_CORRECTIONS` corrections and the coefficients of force modes, which a
second small network defines over the disk of creepages. Errors are divided by the scales `CORRECTION_ERRORS` and
`FORCE_ERRORS` of `study.surrogate.training_data`.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from study.surrogate.training_data import OUTPUT_SCALE
from wrcore.contact.surrogate.descriptors import N_DESCRIPTORS
from wrcore.contact.surrogate.network import N_CORRECTIONS

N_REST = 5
"""Number of creepages near rest: forward, backward, left, right and zero creepage."""

BEND = 3.0
"""Scaled error above which the loss grows linearly instead of quadratically."""

TWIN_STEP = 1e-4
"""Distance between twins to which `TWIN_ERRORS` refer, m. The scales grow in proportion to the distance and have a
lower bound at half of this distance."""

TWIN_ERRORS = np.array([0.3, 0.15, 0.15, 0.5, 0.3, 0.3, 0.15, 0.1])
"""Scales of the difference between the errors of twins: one per correction, relative to `CORRECTION_ERRORS`."""

TWIN_FORCE_ERRORS = np.array([0.06, 0.06, 0.1])
"""Scales of the difference between the errors of twins in the forces near rest, relative to `FORCE_ERRORS`."""

REST_WEIGHT, DISK_WEIGHT, SLOPE_WEIGHT, TWIN_WEIGHT = 0.6, 1.4, 0.3, 0.5
"""Weights of the loss: forces near rest, forces at random creepages, derivatives of the force at rest, and twins."""

SLOPES_PER_FORCE = 1.0 / 0.36
"""Factor from the difference of the scaled forces at opposite creepages near rest to the relative derivative of the
force at rest. The creep table is linear over these creepages."""


class Batch(NamedTuple):
    """Arrays of one training step. The last patches are the first patch of each pair of twins, then the second one."""

    inputs: jax.Array
    corrections: jax.Array
    forces: jax.Array
    disk: jax.Array
    step: jax.Array
    """(twins,): distance between the two patches, m."""
    weight: jax.Array
    """(twins,): weight of each pair of twins in the loss."""


def _layers(key, sizes, last):
    keys = jax.random.split(key, len(sizes) - 1)
    gains = [1.4] * (len(sizes) - 2) + [last]
    return [
        [gain * jax.random.normal(one, (a, b)) / np.sqrt(a), jnp.zeros(b)]
        for one, gain, a, b in zip(keys, gains, sizes[:-1], sizes[1:], strict=True)
    ]


def new_parameters(seed, width, modes, mode_width=48):
    """Return random parameters: the layers of the network and those of the force modes."""
    one, other = jax.random.split(jax.random.PRNGKey(seed))
    return {
        "network": _layers(one, [N_DESCRIPTORS, width, width, width, N_CORRECTIONS + modes], 0.5),
        "modes": _layers(other, [5, mode_width, mode_width, 3 * modes], 1.0),
    }


def run(layers, x):
    """Return the outputs of layers with the activation x (1 + x / sqrt(x^2 + 4)) / 2 between them."""
    for weights, biases in layers[:-1]:
        x = x @ weights + biases
        x = 0.5 * x * (1.0 + x * jax.lax.rsqrt(x * x + 4.0))
    return x @ layers[-1][0] + layers[-1][1]


def modes_at(parameters, disk):
    """Return the force modes (..., 3, modes) at positions (..., 2) in the disk of creepages."""
    x = jnp.concatenate([2.0 * disk, 2.0 * disk * disk, 2.0 * disk[..., :1] * disk[..., 1:]], -1)
    return run(parameters["modes"], x).reshape(*disk.shape[:-1], 3, -1)


def predict(parameters, inputs, disk):
    """Return corrections (n, N_CORRECTIONS) and remainders (n, points, 3).

    The first `N_REST` positions in the disk are equal for all patches."""
    outputs = run(parameters["network"], inputs)
    corrections, coefficients = OUTPUT_SCALE * outputs[:, :N_CORRECTIONS], outputs[:, N_CORRECTIONS:]
    rest, other = modes_at(parameters, disk[0, :N_REST]), modes_at(parameters, disk[:, N_REST:])
    at_rest = jnp.einsum("nk,pck->npc", coefficients, rest)
    return corrections, jnp.concatenate([at_rest, jnp.einsum("nk,npck->npc", coefficients, other)], 1)


def bent(errors):
    """Return the pseudo-Huber loss of each error: quadratic for small errors, linear for large ones."""
    return BEND**2 * (jnp.sqrt(1.0 + errors * errors / BEND**2) - 1.0)


def slopes(forces):
    """Return the relative errors (n, 2) of the derivatives of Fx and Fy at rest, from errors of forces."""
    along, across = forces[:, 0, 0] - forces[:, 1, 0], forces[:, 2, 1] - forces[:, 3, 1]
    return SLOPES_PER_FORCE * jnp.stack([along, across], 1)


def loss(parameters, batch):
    """Return the mean loss of a `Batch`."""
    corrections, forces = predict(parameters, batch.inputs, batch.disk)
    e, d = corrections - batch.corrections, forces - batch.forces
    value = bent(e).mean() + REST_WEIGHT * bent(d[:, :N_REST]).mean() + DISK_WEIGHT * bent(d[:, N_REST:]).mean()
    value += SLOPE_WEIGHT * bent(slopes(d)).mean()
    n = batch.step.shape[0]
    if n == 0:
        return value
    far = jnp.maximum(batch.step / TWIN_STEP, 0.5)[:, None]
    first, second = slice(-2 * n, -n), slice(-n, None)
    de = (e[first] - e[second]) / (TWIN_ERRORS * far)
    dd = (d[first, :N_REST] - d[second, :N_REST]) / (TWIN_FORCE_ERRORS * far[:, None])
    each = 0.5 * bent(de).mean(1) + bent(dd).mean((1, 2))
    return value + TWIN_WEIGHT * (batch.weight * each).mean()
