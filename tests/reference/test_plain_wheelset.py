"""The plain equations: against formulas where there are some, and as the oracle of the compiled ones."""

import numpy as np
import pytest

from tests.conftest import ELLIPTIC
from wrcore.bodies.body import euler_of, matrix_of
from wrcore.contact.hertz import contact_modulus, hertz_shape
from wrcore.contact.rigid.height_at_load import settle
from wrcore.creep.laws import LAWS, creep_data, creep_force
from wrcore.creep.table import ensure_table
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.model import workspace
from wrcore.errors import InputError
from wrcore.geometry.track import rotation
from wrcore.integrate.integrator import integrate
from wrcore.integrate.reference import integrate_function
from wrcore.reference.contact import cut_strips, find_patches
from wrcore.reference.forces import creep_force as plain_creep_force
from wrcore.reference.forces import hertz
from wrcore.reference.wheelset import plain_wheelset
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

LOAD, LEVER = 54546.0, 0.75
"""Wheel load (N) and tape circle (m): what differences of force and moment are measured by."""


def compiled(name, *overrides, step=1e-4):
    """Compiled model, its state at the start, and the plain equations of a scene."""
    scene = load_scene(ELLIPTIC / f"{name}.yaml", overrides)
    model, state = compile_scene(scene)
    return model, state, plain_wheelset(scene, model.contact.creep.table, step)


def random_state(rng, model, state, y, yaw):
    """A loaded wheelset at a lateral position (m) and yaw angle, creeping, off its nominal motion."""
    contact = model.contact
    modulus = contact_modulus(contact.shear_modulus, contact.poisson_ratio)
    roll, z = settle(
        contact.geometry, contact.geometry, contact.hertz, modulus, y, yaw, True, contact.reduction, LOAD, 0.46
    )
    state = state.copy()
    state[:7] = 3.0, y, z, *euler_of(rotation(roll, yaw))
    state[7:10] += rng.normal(size=3) * [0.01, 0.02, 0.005]
    state[10:13] = rotation(roll, yaw)[:, 1] * 20.0 / 0.46 + rng.normal(size=3) * [0.005, 0.1, 0.02]
    return state


def loaded_states(model, start, plain, places, count=12):
    """Random states in which no overlap has several deepest points: where it has, nodes decide which one is taken."""
    rng, states = np.random.default_rng(0), []
    u = np.arange(plain.pair.wheel.u[0], plain.pair.wheel.u[-1], 1e-4)
    while len(states) < count:
        state = random_state(rng, model, start, rng.uniform(*places), rng.uniform(-0.015, 0.015))
        section, axle = state[:3] * [0.0, 1.0, 1.0], matrix_of(state[3:7])[:, 1]
        clear = True
        for side in (1.0, -1.0):
            strips = cut_strips(plain.pair, side, section, axle, u, plain.contact["detection"] == "spatial")
            rising = np.sign(strips.slope - strips.rail_slope)
            deepest = (np.diff(rising) > 0.0) & (strips.gap[1:] < 0.0)
            overlaps = np.diff((strips.gap < 0.0).astype(int)) > 0
            clear &= np.count_nonzero(deepest) == np.count_nonzero(overlaps)
        if clear:
            states.append(state)
    return states


def differences(model, plain, states):
    """Differences of kinematic rates, of force over wheel load, of moment over wheel load and tape circle, (n, 3)."""
    work, found = workspace(model), []
    for state in states:
        difference = Equations(model, work)(0.15, state) - plain.rates(0.15, state)
        force = model.bodies.mass[0] * difference[7:10] / LOAD
        moment = model.bodies.inertia[0] * difference[10:13] / (LOAD * LEVER)
        found.append([np.abs(part).max() for part in (difference[:7], force, moment)])
    return np.array(found)


PLACES = pytest.mark.parametrize("places", [(-0.004, 0.004), (0.006, 0.0075)], ids=["tread", "flange"])
DETECTIONS = pytest.mark.parametrize("detection", ["planar", "spatial"])


@PLACES
@DETECTIONS
@pytest.mark.parametrize("name", ["wheelset", "suspended_wheelset"])
def test_compiled_rates_are_the_plain_ones(name, detection, places):
    """Reduction at the maximum: no quadrature. What is left is the kernels' tabulated Hertz, and their atan (1e-7)."""
    model, start, plain = compiled(name, f"contact.detection={detection}", "contact.patch=maximum")
    states = loaded_states(model, start, plain, places)
    kinematic, force, moment = differences(model, plain, states).T
    assert kinematic.max() < 1e-13
    assert force.max() < 1e-8
    assert moment.max() < 1e-8


@PLACES
@DETECTIONS
def test_compiled_rates_with_moments_are_the_plain_ones(detection, places):
    """Reduction by moments: what is left is the kernels' quadrature; the plain one has a strip every 10 um."""
    overrides = (f"contact.detection={detection}", "contact.patch=moment")
    model, start, plain = compiled("suspended_wheelset", *overrides, step=1e-5)
    states = loaded_states(model, start, plain, places)
    kinematic, force, moment = differences(model, plain, states).T
    assert kinematic.max() < 1e-13
    assert force.max() < 5e-4
    assert moment.max() < 5e-4


@pytest.mark.parametrize(("patch", "step", "accuracy"), [("maximum", 1e-4, 1e-8), ("moment", 1e-5, 5e-4)])
@pytest.mark.parametrize(("y", "yaw"), [(0.0045, 0.0), (0.0061, 0.03)], ids=["tread and root", "root and flange"])
def test_two_patches_on_one_wheel(y, yaw, patch, step, accuracy):
    model, start, plain = compiled("suspended_wheelset", f"contact.patch={patch}", step=step)
    state = random_state(np.random.default_rng(0), model, start, y, yaw)
    section, axle = state[:3] * [0.0, 1.0, 1.0], matrix_of(state[3:7])[:, 1]
    patches = find_patches(plain.pair, 1.0, section, axle, True, patch, step)
    assert len(patches) == 2
    assert patches[0].angle - patches[1].angle > 0.1
    assert differences(model, plain, [state]).max() < accuracy


def test_conformal_flange_root_is_within_the_limit_that_the_readme_states():
    """The worst of 60 random loaded states at y = 6 to 7.5 mm, found 0.125; the tests above hold no such state."""
    model, start, plain = compiled("wheelset", "contact.patch=moment", step=1e-5)
    state = start.copy()
    state[:7] = 0.0, 0.006303, 0.4602590, *euler_of(rotation(0.000777, 0.01314))
    _, force, _ = differences(model, plain, [state])[0]
    assert 5e-4 < force < 0.15


def test_short_runs_are_the_same():
    model, start, plain = compiled("suspended_wheelset", "contact.patch=maximum", "speed=60")
    times = np.linspace(0.0, 0.02, 5)
    run = integrate(model, start, times, "rk45", 1e-8, 1e-11)
    slow = integrate_function(plain.rates, start, times, rtol=1e-8, atol=1e-11)
    assert np.abs(run.states - slow.states).max() < 1e-6


@pytest.mark.parametrize(("law", "accuracy"), [("linear", 1e-12), ("she", 1e-12), ("table", 1e-6)])
def test_creep_laws_are_the_compiled_ones(law, accuracy):
    rng = np.random.default_rng(0)
    data = creep_data(0.28, ensure_table().kernel_data())
    for _ in range(500):
        log_g, creepages = rng.uniform(-2.0, 2.0), rng.normal(size=3) * np.exp(rng.uniform(-5.0, 3.0))
        fast = creep_force(LAWS[law], data, np.exp(log_g), 0.0, *creepages)[:3]
        slow = plain_creep_force(law, data.table, log_g, creepages)
        np.testing.assert_allclose(slow, fast, rtol=accuracy, atol=accuracy)


def test_sphere_on_plane():
    """Hertz, sphere of radius R: N = 4/3 E* sqrt(R) delta^1.5, a = sqrt(R delta)."""
    modulus, radius, approach = 1e11, 0.3, 2e-5
    force, a, b = hertz(approach, 0.5 / radius, 0.5 / radius, modulus)
    assert force == pytest.approx(4 / 3 * modulus * np.sqrt(radius) * approach**1.5, rel=1e-12)
    assert (a, b) == pytest.approx([np.sqrt(radius * approach)] * 2, rel=1e-12)


@pytest.mark.parametrize("ratio", [1.5, 10.0, 400.0])
def test_ellipse_is_that_of_the_elliptic_integrals(ratio):
    """Against the shape functions that the kernels' table is made from; the axes turn with the curvatures."""
    force, a, b = hertz(2e-5, 1.0, ratio, 1e11)
    p_large, p_small, k = hertz_shape(ratio)
    root = np.sqrt(2e-5 / (1.0 + ratio))
    assert (a, b) == pytest.approx((p_large * root, p_small * root), rel=1e-9)
    assert force == pytest.approx(4 / 3 * 1e11 * k * 2e-5 * root, rel=1e-9)
    assert hertz(2e-5, ratio, 1.0, 1e11) == (force, b, a)


@pytest.mark.parametrize(
    ("name", "override", "field"),
    [
        ("trailer_vehicle", "speed=20", "vehicle"),
        ("wheelset", "contact.detection=auto", "contact.detection"),
        ("wheelset", "track.path=[{tangent: 10}, {transition: 20}, {curve: 100, radius: 500}]", "track"),
    ],
)
def test_other_scenes_are_refused(name, override, field):
    scene = load_scene(ELLIPTIC / f"{name}.yaml", [override])
    with pytest.raises(InputError) as error:
        plain_wheelset(scene, None)
    assert error.value.field == field


def test_other_laws_are_refused():
    with pytest.raises(InputError, match="expected table, linear or she"):
        plain_creep_force("polach", creep_data(0.28).table, 0.0, [0.0, 0.0, 0.0])
