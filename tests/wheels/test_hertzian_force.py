"""The wrench of a wheel against vector algebra on its patches."""

import numpy as np
import pytest

from tests.conftest import ELLIPTIC, SCENES
from wrcore.contact.hertz import damping_factor, hertz_ellipse
from wrcore.contact.patch.model import strip_work
from wrcore.contact.search import reduction as columns
from wrcore.creep.laws import LAWS, creep_force
from wrcore.geometry.track import rotation
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.wheels.contact_model import OUT_OF_RANGE
from wrcore.wheels.hertzian_force import wheel_wrenches
from wrcore.wheels.motion import MOTION

POSES = [  # side, y, roll, yaw: tread, both sides, and a flange contact
    (1.0, 0.002, 1e-4, 0.004), (-1.0, 0.002, 1e-4, 0.004), (-1.0, -0.0068, -1.5e-3, -0.006),
]  # fmt: skip


@pytest.mark.parametrize(("side", "y", "roll", "yaw"), POSES)
@pytest.mark.parametrize("patch", ["maximum", "moment"])
def test_wrench_is_the_sum_of_its_patches(side, y, roll, yaw, patch):
    scene = load_scene(ELLIPTIC / "suspended_wheelset.yaml", ["contact.creep.model=fastsim", f"contact.patch={patch}"])
    model = compile_scene(scene)[0].contact
    v, w = np.array([20.0, 0.03, -0.01]), np.array([0.02, 43.6, 0.05])
    axle = rotation(roll, yaw)[:, 1]
    z = next(z for z in np.arange(0.4625, 0.4590, -2e-5) if _loaded(model, side, y, z, axle))
    wrench, rows, _ = one_wheel(model, [side, y, z, *axle, *v, *w, 0.0, 0.0, 0.3])
    assert len(rows) >= 1
    force, moment = np.zeros(3), np.zeros(3)
    for row in rows:
        angle, delta = row[columns.ANGLE], row[columns.PENETRATION]
        t1, t2, n = np.array([[1, 0, 0], [0, np.cos(angle), np.sin(angle)], [0, -np.sin(angle), np.cos(angle)]])
        arm = row[[columns.X, columns.Y, columns.Z]] - [0.0, y, z]
        slip = v + np.cross(w, arm)  # velocity of the wheel's material at the contact; the rail is at rest
        np.testing.assert_allclose(row[[columns.XI, columns.ETA]], [slip @ t1 / 20, slip @ t2 / 20], atol=1e-12)
        assert row[columns.PHI] == pytest.approx(w @ n / 20, rel=1e-12)
        # Eq. (7), and the creep law in its own, nondimensional terms
        factor = damping_factor(-slip @ n, 0.8, 0.05)
        stiffness, p, q = hertz_ellipse(model.hertz, row[columns.CURVATURE_X], row[columns.CURVATURE_Y])
        normal = factor * 8.2e10 / 0.72 * stiffness * delta**1.5
        assert row[columns.NORMAL] == pytest.approx(normal, rel=1e-12)
        a, b = np.array([p, q]) * (normal / (8.2e10 / 0.72 * stiffness)) ** (1 / 3)  # the ellipse that carries N
        np.testing.assert_allclose(row[[columns.SEMI_A, columns.SEMI_B]], [a, b], rtol=1e-12)
        c, limit = np.sqrt(a * b), 0.3 * normal
        xi, eta, phi = row[[columns.XI, columns.ETA, columns.PHI]] * 8.2e10 * c**2 / limit * [1, 1, c]
        f1, f2, m3, _ = creep_force(LAWS["fastsim"], model.creep, a / b, 0.0, xi, eta, phi)
        np.testing.assert_allclose(
            row[[columns.FX, columns.FY, columns.MZ]], limit * np.array([f1, f2, c * m3]), rtol=1e-9, atol=1e-9
        )
        push = row[columns.NORMAL] * n + row[columns.FX] * t1 + row[columns.FY] * t2
        force += push
        moment += np.cross(arm, push) + row[columns.MZ] * n
    np.testing.assert_allclose(wrench[:3], force, rtol=1e-12)
    np.testing.assert_allclose(wrench[3:], moment, rtol=1e-9, atol=1e-9 * np.abs(moment).max())


def one_wheel(model, motion):
    """Wrench, patches and bound of a wheel whose neighbour is far above its rail."""
    motions = np.array([[motion, motion]])
    motions[0, 1, MOTION.z] += 1.0
    patches = np.zeros((1, 2, columns.MAX_PATCHES, columns.PATCH_COLUMNS))
    counts, bounds, wrenches = np.zeros((1, 2), int), np.zeros((1, 2)), np.zeros((1, 2, 6))
    wheel_wrenches(model, motions, patches, counts, bounds, wrenches, np.zeros(3, int), strip_work(model.strips, 1))
    assert counts[0, 1] == 0 and not wrenches[0, 1].any()
    return wrenches[0, 0], patches[0, 0, : counts[0, 0]], bounds[0, 0]


def _loaded(model, side, y, z, axle):
    return one_wheel(model, [side, y, z, *axle, 20.0, 0, 0, 0, 43.6, 0, 0.0, 0.0, 0.3])[0][2] > 4e4


@pytest.mark.parametrize("detection", ["spatial", "planar", "auto"])
@pytest.mark.parametrize(("patch", "creep"), [("moment", "table"), ("maximum", "she")])
def test_many_wheels_at_once_are_the_single_ones(detection, patch, creep):
    overrides = [f"contact.detection={detection}", f"contact.patch={patch}", f"contact.creep.model={creep}"]
    model = compile_scene(load_scene(SCENES / "wheelset.yaml", overrides))[0].contact
    rng = np.random.default_rng(0)
    motions = np.empty((40, len(MOTION)))
    for m in motions:
        axle = rotation(1e-3 * rng.normal(), 5e-3 * rng.normal())[:, 1]
        position = [rng.choice([-1.0, 1.0]), rng.uniform(-0.008, 0.008), 0.46 + rng.uniform(-1e-3, 5e-4)]
        m[:] = (
            *position,
            *axle,
            20.0,
            *rng.normal(size=2) * 0.05,
            *(rng.normal(size=3) * 0.1 + [0, 43.6, 0]),
            1e-3,
            1e-4,
            0.3,
        )
    motions = motions.reshape(20, 2, len(MOTION))
    patches = np.zeros((20, 2, columns.MAX_PATCHES, columns.PATCH_COLUMNS))
    counts, bounds, wrenches = np.zeros((20, 2), int), np.zeros((20, 2)), np.zeros((20, 2, 6))
    counters = np.zeros(3, int)
    wheel_wrenches(model, motions, patches, counts, bounds, wrenches, counters, strip_work(model.strips, len(motions)))
    assert counters[OUT_OF_RANGE] == 0
    for place in np.ndindex(20, 2):
        wrench, rows, bound = one_wheel(model, motions[place])
        assert (len(rows), bound) == (counts[place], bounds[place])
        np.testing.assert_allclose(wrenches[place], wrench, rtol=1e-12, atol=1e-9)
        np.testing.assert_allclose(patches[place][: len(rows)], rows, rtol=1e-12, atol=1e-12)
    assert 0 < (counts > 0).sum() < 40
