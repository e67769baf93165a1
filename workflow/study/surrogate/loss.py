"""The network of the surrogate and its loss in JAX.

Outputs are `wrcore.contact.surrogate.network.N_CORRECTIONS` corrections and the coefficients of force modes, which a
second small network defines over the disk of creepages. Errors are in units of what counts as one, see
`study.surrogate.training_data`.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from study.surrogate.training_data import OUTPUT_SCALE
from wrcore.contact.surrogate.descriptors import N_DESCRIPTORS
from wrcore.contact.surrogate.network import N_CORRECTIONS

N_REST = 5
"""Creepages near rest: probes forward, back, left and right, and none."""

BEND = 3.0
"""Error at which the loss turns from a parabola into a straight line."""

TWIN_STEP = 1e-4
"""Distance of twins for which `TWIN_ERRORS` hold, m; for others in proportion, from half of it on."""

TWIN_ERRORS = np.array([0.3, 0.15, 0.15, 0.5, 0.3, 0.3, 0.15, 0.1])
"""Difference of the errors of twins that counts as one, over the errors that do."""

TWIN_FORCE_ERRORS = np.array([0.06, 0.06, 0.1])
"""Difference of the errors of twins in the forces near rest that counts as one."""

REST_WEIGHT, DISK_WEIGHT, SLOPE_WEIGHT, TWIN_WEIGHT = 0.6, 1.4, 0.3, 0.5

SLOPES_PER_FORCE = 1.0 / 0.36
"""Relative slope at rest for a difference of the force over both probes, where the creep table is linear."""


class Batch(NamedTuple):
    """Arrays of one step; the last patches are first twins, then second twins."""

    inputs: jax.Array
    corrections: jax.Array
    forces: jax.Array
    disk: jax.Array
    step: jax.Array
    """(twins,): distance, m."""
    weight: jax.Array
    """(twins,)."""


def _layers(key, sizes, last):
    keys = jax.random.split(key, len(sizes) - 1)
    gains = [1.4] * (len(sizes) - 2) + [last]
    return [
        [gain * jax.random.normal(one, (a, b)) / np.sqrt(a), jnp.zeros(b)]
        for one, gain, a, b in zip(keys, gains, sizes[:-1], sizes[1:], strict=True)
    ]


def new_parameters(seed, width, modes, mode_width=48):
    """Random parameters: layers of the network, and of the force modes."""
    one, other = jax.random.split(jax.random.PRNGKey(seed))
    return {
        "network": _layers(one, [N_DESCRIPTORS, width, width, width, N_CORRECTIONS + modes], 0.5),
        "modes": _layers(other, [5, mode_width, mode_width, 3 * modes], 1.0),
    }


def run(layers, x):
    """Outputs of layers with the activation x (1 + x / sqrt(x^2 + 4)) / 2 between them."""
    for weights, biases in layers[:-1]:
        x = x @ weights + biases
        x = 0.5 * x * (1.0 + x * jax.lax.rsqrt(x * x + 4.0))
    return x @ layers[-1][0] + layers[-1][1]


def modes_at(parameters, disk):
    """Force modes (..., 3, modes) at places (..., 2) in the disk."""
    x = jnp.concatenate([2.0 * disk, 2.0 * disk * disk, 2.0 * disk[..., :1] * disk[..., 1:]], -1)
    return run(parameters["modes"], x).reshape(*disk.shape[:-1], 3, -1)


def predict(parameters, inputs, disk):
    """Corrections (n, N_CORRECTIONS) and remainders (n, points, 3). The first `N_REST` places are those of all."""
    outputs = run(parameters["network"], inputs)
    corrections, coefficients = OUTPUT_SCALE * outputs[:, :N_CORRECTIONS], outputs[:, N_CORRECTIONS:]
    rest, other = modes_at(parameters, disk[0, :N_REST]), modes_at(parameters, disk[:, N_REST:])
    at_rest = jnp.einsum("nk,pck->npc", coefficients, rest)
    return corrections, jnp.concatenate([at_rest, jnp.einsum("nk,npck->npc", coefficients, other)], 1)


def bent(errors):
    """Square of small errors, straight line of large ones (pseudo-Huber)."""
    return BEND**2 * (jnp.sqrt(1.0 + errors * errors / BEND**2) - 1.0)


def slopes(forces):
    """Relative error of the slopes of Fx and Fy at rest (n, 2), from errors of forces."""
    along, across = forces[:, 0, 0] - forces[:, 1, 0], forces[:, 2, 1] - forces[:, 3, 1]
    return SLOPES_PER_FORCE * jnp.stack([along, across], 1)


def loss(parameters, batch):
    """Mean loss of a `Batch`."""
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
