"""Rolling at small creepage, on strips by every resolvent and on the grid: the force of adhesion everywhere."""

import numpy as np
import pytest

import wrcore as wr
from tests.contact.grid.test_traction import MU, NU, G, ellipse_patch
from tests.contact.patch.strip_contact import NormalContact
from wrcore.contact.grid.traction import slip_influence, solve_traction
from wrcore.contact.rolling.library import make_library
from wrcore.contact.rolling.rolling import AUTO, BAND, BOUND, DIRECT, LENGTH, LEVELS, LIMIT, rolling_force, rolling_work

LATERAL = (-6e-3, -3e-3, -1e-3, 0.0, 0.5e-3, 1e-3, 2e-3, 4.5e-3, 5e-3, 6.3e-3)
"""Tread, two lobes as one window and as two, flange root, and a slender patch."""


@pytest.fixture(scope="module")
def normal():
    pair = wr.WheelsetOnTrack.alike(wr.named_profile("S1002", "wheel"), wr.named_profile("60E1", "rail", 1 / 40))
    return NormalContact(pair.left.geometry, G / (1 - NU), "coarse")


def slip_of_creepages(s, x, xi, eta, phi):
    """Rigid slip of creepages on strips at s and x, and its slope along x: (4, strips)."""
    none = np.zeros(len(s))
    return np.stack([xi - phi * s, none, eta + phi * x, none + phi])


def matrices(patch, method, far):
    """d(Fx, Fs, Mn/c)/d(xi, eta, phi c) of a patch at ``far`` of saturation, that of adhesion, and the residual.

    About the load's centroid; with what a run takes for the patch, for the library's number of strips.
    """
    count, a, b = (
        len(patch.centre),
        *(
            np.sqrt(5 * (square - mean**2))
            for square, mean in ((patch.mean_xx, patch.mean_x), (patch.mean_ss, patch.mean_s))
        ),
    )
    windows = len(set(patch.window))
    level = LEVELS["slender" if a > 3 * b else "coarse"]
    library = make_library(level._replace(strips=max(level.strips, count // windows)), NU)
    n, work, c = library.panels.n, rolling_work(count, library.panels.n), np.sqrt(a * b)
    size, centre, middle = 2 * n * count, patch.centre - patch.mean_s, patch.middle - patch.mean_x
    found, stuck, unit = np.zeros((3, 3)), np.zeros((3, 3)), far * MU * patch.normal_force / (G * c * c)
    for k, creepage in enumerate(unit * np.diag([1, 1, 1 / c])):
        slip = slip_of_creepages(centre, middle, *creepage)
        strips = centre, patch.width, patch.half_length, middle, patch.peak
        *force, residual, _ = rolling_force(*strips, *slip, G, MU, library, work, method)
        found[:, k] = np.array(force) / (G * unit) / [c * c, c * c, c**3]
        matrix, step = work.matrix[: size * size].reshape(size, size).astype(float), work.step[:size].astype(float)
        panel = np.linalg.solve(matrix, -work.rigid[0, :size] / step).reshape(count, 2, n)
        x = work.strip.middle[:count, None] + work.strip.half[:count, None] * library.panels.load
        moment = (x * panel[:, 1] - work.strip.line[:count, None] * panel[:, 0]).sum() * work.scale[LENGTH] / c
        stuck[:, k] = np.array([panel[:, 0].sum(), panel[:, 1].sum(), moment]) * work.scale[BOUND] / (G * unit * c * c)
    return found, stuck, residual


@pytest.mark.parametrize(("method", "bound"), [(AUTO, 0.003), (BAND, 0.005), (DIRECT, 1e-3)])
@pytest.mark.parametrize("yaw", [0.0, 5e-3])
def test_tangent_of_strips_is_that_of_adhesion(normal, method, bound, yaw):
    """C11, C22, C23, C32, C33 on real patches within 0.3 % (by the band, which a run rarely takes, 0.5 %)."""
    shapes = set()
    for y in LATERAL:
        for patch in normal.at_load("left", y, 5e4, yaw=yaw)[0]:
            found, stuck, residual = matrices(patch, method, 1e-8)
            size = np.maximum(abs(stuck), 0.3 * np.sqrt(stuck[1, 1] * stuck[2, 2]))
            error = (abs(found - stuck) / size)[[0, 1, 1, 2, 2], [0, 1, 2, 1, 2]]
            assert error.max() < bound, (y, error)
            assert residual < LIMIT
            shapes.add((len(set(patch.window)), patch.half_length.max() > 2 * np.ptp(patch.centre)))
    assert shapes >= {(1, False), (1, True), (2, False)}


@pytest.mark.parametrize("far", [1e-8, 1e-5])
def test_residual_of_strips_is_relative_to_the_traction(normal, far):
    """What decides on a second solution says as much at a small creepage as at a large one."""
    (patch,) = normal.at_load("left", 3e-3, 5e4)[0]
    few = [matrices(patch, method, far)[2] for method in (AUTO, DIRECT)]
    assert few[0] > 1e-5 > few[1] > 0


@pytest.mark.parametrize("far", [1e-8, 1e-4])
def test_grid_at_small_creepage_is_adhesion(far):
    """Against a dense solution of the same discrete equations over the touching elements, 0.3 %."""
    patch, a, b, load = ellipse_patch(1.0, 2.0, 16)
    bound, unit = MU * patch.pressure, far * MU * load / (G * a * b)
    at = np.argwhere(bound > 0)
    table = slip_influence(32, 32, patch.dx, patch.ds, G, NU)
    xx, ss, xs = table[:, at[:, None, 0] - at[:, 0], at[:, None, 1] - at[:, 1]]
    x, s = patch.x[at[:, 0]], patch.s[at[:, 1]]
    for xi, eta, phi in unit * np.diag([1, 1, 1 / np.sqrt(a * b)]):
        wx, ws = np.full(bound.shape, xi) - phi * patch.s, np.full(bound.shape, eta) + phi * patch.x[:, None]
        px, ps, sx, ss_ = (np.zeros_like(bound) for _ in range(4))
        assert solve_traction(bound, wx, ws, patch.dx, patch.ds, G, NU, 1e-4, px, ps, sx, ss_) > 0
        stuck = np.linalg.solve(np.block([[xx, xs], [xs, ss]]), -np.concatenate([xi - phi * s, eta + phi * x]))
        found = np.array([px.sum(), ps.sum()])
        expected = stuck.reshape(2, -1).sum(axis=1)
        assert np.hypot(*(found - expected)) < 0.003 * np.hypot(*expected)
