"""The trained network: its splines, its trust beyond the range of its training, and parabolic overlaps."""

import math

import numpy as np
import pytest

from wrcore.contact.surrogate import network
from wrcore.contact.surrogate.descriptors import N_DESCRIPTORS, describe
from wrcore.contact.surrogate.strips import new_strips


@pytest.fixture(scope="module")
def surrogate():
    return network.load_surrogate()


def outputs_at(surrogate, descriptors):
    work = network.surrogate_work(surrogate)
    work.descriptors[:] = descriptors
    trust = network.run_network(surrogate, work)
    return trust, work.outputs.copy()


def in_numpy(surrogate, descriptors):
    """Outputs of the layers in double precision."""
    x, layers = (descriptors - surrogate.median) * surrogate.per_scale, surrogate.layers
    x = x / (1.0 + x * x) ** 0.25
    for k in (1, 2, 3):
        x = x @ getattr(layers, f"weights_{k}").astype(float) + getattr(layers, f"biases_{k}")
        x = 0.5 * x * (1.0 + x / np.sqrt(x * x + 4.0))
    return x @ layers.weights_4.astype(float) + layers.biases_4


def in_range(surrogate, seed):
    random = np.random.default_rng(seed)
    descriptors = surrogate.median + 0.3 / surrogate.per_scale * random.normal(size=N_DESCRIPTORS)
    return np.clip(descriptors, surrogate.least, surrogate.greatest)


def test_outputs_are_those_of_the_layers_in_numpy(surrogate):
    descriptors = in_range(surrogate, 1)
    trust, found = outputs_at(surrogate, descriptors)
    assert trust == 1.0
    np.testing.assert_allclose(found, in_numpy(surrogate, descriptors), rtol=1e-12, atol=1e-12)


def test_splines_are_the_force_modes(surrogate):
    with np.load(network._WEIGHTS) as file:
        z = {name: file[name] for name in file.files}
    random = np.random.default_rng(2)
    r, angle = 0.95 * np.sqrt(random.random(200)), random.uniform(0.0, 2.0 * math.pi, 200)
    p, q = r * np.cos(angle), r * np.sin(angle)
    modes = network.force_modes(z, p, q)
    outputs = 0.3 * random.normal(size=network.N_CORRECTIONS + modes.shape[2])
    found = np.array([network.force_remainder(surrogate, outputs, *place) for place in zip(p, q, strict=True)])
    expected = modes @ outputs[network.N_CORRECTIONS :]
    assert np.abs(expected).max() > 5e-3  # of friction times load
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=3e-4)


def test_trust_falls_smoothly_beyond_the_training(surrogate):
    width = surrogate.greatest - surrogate.least
    for i in range(N_DESCRIPTORS):
        descriptors, trusts = surrogate.median.copy(), []
        for beyond in np.linspace(0.9, 2.5, 161):
            descriptors[i] = surrogate.greatest[i] + beyond * width[i]
            trusts.append(network.trust_in(surrogate, descriptors))
        assert trusts[0] == 1.0 and trusts[-1] == 0.0
        assert np.all(np.diff(trusts) <= 0.0) and np.abs(np.diff(trusts)).max() < 0.02


def parabola(depth, across, along, count=81):
    """Strips of a parabolic overlap of a ``depth`` (m), relative curvatures ``across`` and ``along`` (1/m)."""
    strips, half = new_strips(), math.sqrt(depth / across)
    s = np.linspace(-half, half, count)
    for values in strips:
        values[:] = 0.0
    strips.arc[:count], strips.lateral[:count], strips.cosine[:count] = s + half, s, 1.0
    strips.gap[:count] = across * s**2 - depth
    strips.weight[:count] = strips.gap[:count] ** 2 * (s[1] - s[0])
    strips.curvature[:count] = along
    return strips, count


def test_splines_of_strips_far_from_the_middle_are_quadratic_b_splines():
    """A patch with a small shoulder far beside it, up to 5 sigma."""
    strips, count = parabola(8e-5, 1.1, 1.09)
    for beside in (3.2, 3.6, 3.9, 4.2, 4.6, 5.0):
        out = np.zeros(N_DESCRIPTORS)
        sigma = math.sqrt(8e-5 / 1.1 / 7.0)
        strips.arc[count], strips.lateral[count] = beside * sigma + strips.arc[count // 2], beside * sigma
        strips.cosine[count], strips.curvature[count] = 1.0, 1.09
        strips.gap[count], strips.weight[count] = -1e-9, 1e-4 * strips.weight[:count].sum()
        describe(strips, count + 1, count, 0.46, 0.0, 0.3, out)
        w = strips.weight[: count + 1] / strips.weight[: count + 1].sum()
        arc = strips.arc[: count + 1] - w @ strips.arc[: count + 1]
        apart = np.abs(2.0 * (arc / math.sqrt(w @ arc**2))[:, None] + 7.5 - np.arange(16))
        splines = np.where(apart < 0.5, 0.75 - apart**2, np.where(apart < 1.5, 0.5 * (1.5 - apart) ** 2, 0.0))
        np.testing.assert_allclose(out[1:17], w @ splines, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("across", [0.3, 1.1, 20.0])
def test_shape_of_a_parabolic_overlap_is_that_of_hertz(across):
    depth, along, out = 8e-5, 1.09, np.zeros(N_DESCRIPTORS)
    strips, count = parabola(depth, across, along)
    shape = describe(strips, count, count, 0.46, 0.0, 0.3, out)
    half_width = math.sqrt(7.0) * shape.sigma
    assert half_width == pytest.approx(math.sqrt(depth / across), rel=1e-3)
    assert math.sqrt(0.9375 * shape.square / half_width) == pytest.approx(depth, rel=1e-3)
    assert shape.length == pytest.approx((16 / 15 * depth**2.5 / math.sqrt(across) / along**2) ** 0.2, rel=1e-3)
    # all but the first number and the splines vanish, and these are the same for all parabolas
    np.testing.assert_allclose(out[[17, 19, 21, 22, 23, 24, 25, 26, 27, 30, 31, 32, 33]], 0.0, atol=1e-9)
    assert out[1:17].sum() == pytest.approx(1.0, abs=1e-6)
    assert out[18] == pytest.approx(49.0 / 21.0, rel=2e-3)  # <e^4> where g^2 is (1 - t^2)^2
