"""The network of the surrogate: three hidden layers.

Weights are kept in single precision, and evaluated in double precision: implicit methods take differences of contact
forces, and the rounding of single precision (1e-7 of the load) makes a vehicle that runs quietly take 1.7 times the
steps with rodas5, even where its Jacobian is exact (109 instead of 66, measured once). Single precision would halve the
time of the network.

Activation x (1 + x / sqrt(x^2 + 4)) / 2: smooth, with a square root in place of an exponential. Inputs are shifted,
scaled, and compressed by x / (1 + x^2)^(1/4), which grows with the square root of a large input.
"""

import math
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wrcore.contact.search.geometry import LANES
from wrcore.contact.surrogate.descriptors import N_DESCRIPTORS
from wrcore.kernels import lanes
from wrcore.kernels.jit import FAST, FUSED, jit

N_CORRECTIONS = 8
"""ln N, ln a, ln b, ln p_max, place along and across the patch over l, contact angle (rad), height over l: what the
network adds to the contact of a parabolic overlap and to the parabolas of `PatchShape`."""

FORCE_CELLS = 36
"""Cells, in each direction, of the splines of force modes over the disk of creepages."""

WIDTH = 32
"""Layers are padded with zeros to a multiple of this width, which `wrcore.kernels.lanes.load32` loads."""

_WEIGHTS = Path(__file__).with_name("weights.npz")


class Layers(NamedTuple):
    """Weights (inputs, outputs), float32, and biases (outputs,) of the layers, padded with zeros to multiples of
    `WIDTH`. The outputs of the last one are the corrections (N_CORRECTIONS) and the coefficients of the force modes."""

    weights_1: np.ndarray
    biases_1: np.ndarray
    weights_2: np.ndarray
    biases_2: np.ndarray
    weights_3: np.ndarray
    biases_3: np.ndarray
    weights_4: np.ndarray
    biases_4: np.ndarray


class Surrogate(NamedTuple):
    """Arrays of a trained network, for kernels; all empty in a scene without it."""

    median: np.ndarray
    per_scale: np.ndarray
    """(N_DESCRIPTORS,): shift of the descriptors, and 1 over their scale."""
    least: np.ndarray
    greatest: np.ndarray
    """(N_DESCRIPTORS,): range of 99.8 % of the training data."""
    per_width: np.ndarray
    """(N_DESCRIPTORS,): 1 over the width of that range."""
    layers: Layers
    corrections: np.ndarray
    """(N_CORRECTIONS,): scales of the corrections."""
    modes: np.ndarray
    """(FORCE_CELLS + 2, FORCE_CELLS + 2, 3, modes): coefficients of quadratic B-splines of the force modes over
    the disk of creepages, for Fx and Fy (over friction times N) and Mz (over friction times N times c). The number of
    modes is a multiple of eight."""


class SurrogateWork(NamedTuple):
    """Scratch arrays of the network."""

    descriptors: np.ndarray
    """(N_DESCRIPTORS,)."""
    layer: np.ndarray
    next_layer: np.ndarray
    """(widest layer,)."""
    outputs: np.ndarray
    """(outputs,), padded: outputs of the network times their weight (`trust_in`)."""


def no_surrogate():
    """Return the empty `Surrogate` of a scene without a network."""
    none = np.zeros(0)
    layers = Layers(*[np.zeros((0, 0), np.float32), none] * 4)
    return Surrogate(*[none] * 5, layers, none, np.zeros((0,) * 4))


def surrogate_work(surrogate):
    """`SurrogateWork` of a `Surrogate`."""
    layers = surrogate.layers
    width = max(N_DESCRIPTORS, len(layers.biases_1), len(layers.biases_2), len(layers.biases_3))
    sizes = N_DESCRIPTORS, width, width, len(surrogate.layers.biases_4)
    return SurrogateWork(*(np.zeros(size) for size in sizes))


def _padded(values):
    """Array with the last axis filled with zeros to a multiple of `WIDTH`."""
    return np.pad(values, [(0, 0)] * (values.ndim - 1) + [(0, -values.shape[-1] % WIDTH)])


def packed(z):
    """Return the `Surrogate` from the arrays of a file of weights by name."""
    layers, inputs = [], N_DESCRIPTORS
    for k in (1, 2, 3, 4):
        weights, biases = _padded(z[f"weights_{k}"]), _padded(z[f"biases_{k}"])
        weights = np.pad(weights, [(0, inputs - len(weights)), (0, 0)])
        layers += [weights.astype(np.float32), biases.astype(float)]
        inputs = len(biases)
    return Surrogate(
        z["median"], 1.0 / z["scale"], z["least"], z["greatest"], 1.0 / (z["greatest"] - z["least"]), Layers(*layers),
        z["corrections"].astype(float), _mode_splines(z),
    )  # fmt: skip


@cache
def load_surrogate():
    """The trained network that comes with the package, see weights.md beside it."""
    with np.load(_WEIGHTS, allow_pickle=False) as file:
        return packed({name: file[name] for name in file.files})


def _activation(x):
    return 0.5 * x * (1.0 + x / np.sqrt(x * x + 4.0))


def force_modes(z, p, q):
    """Force modes at places (n,) in the disk of creepages, shape (n, 3, modes), by the network that defines them: the
    arrays ``z`` with the names mode_weights_k and mode_biases_k."""
    x = np.stack([2 * p, 2 * q, 2 * p * p, 2 * q * q, 2 * p * q], -1)
    for k in (1, 2, 3):
        x = x @ z[f"mode_weights_{k}"].astype(float) + z[f"mode_biases_{k}"]
        x = _activation(x) if k < 3 else x
    return x.reshape(len(p), 3, -1) * z["force_scales"].astype(float)[:, None]


def _mode_splines(z):
    """Coefficients of the force modes' quadratic B-splines with equal steps from -1 to 1."""
    nodes = (np.arange(FORCE_CELLS) + 0.5) * 2.0 / FORCE_CELLS - 1.0  # centres of cells, and both ends
    nodes = np.concatenate([[-1.0], nodes, [1.0]])
    p, q = (part.ravel() for part in np.meshgrid(nodes, nodes, indexing="ij"))
    values = force_modes(z, p, q).reshape(len(nodes), len(nodes), 3, -1)
    splines = np.zeros((len(nodes), len(nodes)))  # values of the splines at the nodes
    for i, of_cell in enumerate(splines[1:-1]):
        of_cell[i : i + 3] = 0.125, 0.75, 0.125
    splines[0, :2] = splines[-1, -2:] = 0.5
    inverse = np.linalg.inv(splines)
    return np.ascontiguousarray(np.einsum("ip,jq,pqck->ijck", inverse, inverse, values, optimize=True))


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _dense(inputs, weights, biases, outputs, bend):
    """Evaluate one layer of the network, with activation if ``bend``; sums of `WIDTH` outputs stay in registers."""
    for start in range(0, len(biases), WIDTH):
        j = np.uint64(start)
        x = lanes.take32(biases, j)
        for i in range(weights.shape[0]):
            x = x + inputs[i] * lanes.load32(weights, np.uint64(i), j)
        if bend:
            x = 0.5 * x * (1.0 + x / lanes.root(x * x + 4.0))
        lanes.put32(outputs, j, x)


@jit(allocates=False, fastmath=FAST)
def trust_in(surrogate, descriptors):
    """Weight of the network's outputs: 1 in the range of the training and up to one width beyond it, then falling
    smoothly to 0 over the next width.

    The weight depends on the sum of squared distances of the descriptors beyond these limits, over the width of their
    ranges. Just outside the range the network is still better than its base: on a curve of 250 m, 95 % of the
    errors in N are below 0.9 %, and below 5 % where the share begins to fall at the range itself (measured once)."""
    outside = 0.0
    for i in range(N_DESCRIPTORS):
        below, above = surrogate.least[i] - descriptors[i], descriptors[i] - surrogate.greatest[i]
        excess = max(max(below, above) * surrogate.per_width[i] - 1.0, 0.0)
        outside += excess * excess
    rest = max(1.0 - outside, 0.0)
    return rest * rest


@jit(allocates=False, fastmath=FUSED)
def run_network(surrogate, work):
    """Fill ``work.outputs`` from ``work.descriptors``, and return their weight (`trust_in`)."""
    layers = surrogate.layers
    for i in range(N_DESCRIPTORS):
        x = (work.descriptors[i] - surrogate.median[i]) * surrogate.per_scale[i]
        work.layer[i] = x / math.sqrt(math.sqrt(1.0 + x * x))
    _dense(work.layer, layers.weights_1, layers.biases_1, work.next_layer, True)
    _dense(work.next_layer, layers.weights_2, layers.biases_2, work.layer, True)
    _dense(work.layer, layers.weights_3, layers.biases_3, work.next_layer, True)
    _dense(work.next_layer, layers.weights_4, layers.biases_4, work.outputs, False)
    trust = trust_in(surrogate, work.descriptors)
    for k in range(len(work.outputs)):
        work.outputs[k] *= trust
    return trust


@jit(allocates=False, forceinline=True, fastmath=FUSED)
def _spline_factor(f, r):
    """Factor of the r-th of three quadratic B-splines at the place f, 0 to 1, in a cell."""
    return 0.5 * (1.0 - f) * (1.0 - f) if r == 0 else 0.5 + f * (1.0 - f) if r == 1 else 0.5 * f * f


@jit(allocates=False, fastmath=FUSED)
def force_remainder(surrogate, outputs, p, q):
    """Fx, Fy (over friction times N) and Mz (over friction times N times c) that the force modes add at a place in the
    disk of creepages."""
    u, v = 0.5 * (p + 1.0) * FORCE_CELLS, 0.5 * (q + 1.0) * FORCE_CELLS
    i, j = min(max(int(u), 0), FORCE_CELLS - 1), min(max(int(v), 0), FORCE_CELLS - 1)
    f, g = u - i, v - j
    fx = fy = mz = 0.0
    for start in range(0, surrogate.modes.shape[3], LANES):
        m, zero = np.uint64(start), lanes.lanes8(0.0)
        x, y, z = zero, zero, zero
        for r in range(3):
            for s in range(3):
                modes, factor = surrogate.modes[i + r, j + s], _spline_factor(f, r) * _spline_factor(g, s)
                x = x + factor * lanes.load8(modes, np.uint64(0), m)
                y = y + factor * lanes.load8(modes, np.uint64(1), m)
                z = z + factor * lanes.load8(modes, np.uint64(2), m)
        some = lanes.take8(outputs, np.uint64(N_CORRECTIONS + start))
        fx, fy, mz = fx + lanes.total(x * some), fy + lanes.total(y * some), mz + lanes.total(z * some)
    return fx, fy, mz
