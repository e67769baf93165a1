"""Check rails: a spring between a wheel's back and an upright face, with friction."""

import math

import numpy as np
import pytest

from tests.conftest import ELLIPTIC
from tests.jacobian import test_jacobian as jacobian_tests
from wrcore.bodies.body import STATE_SIZE
from wrcore.equations.equations_of_motion import Equations
from wrcore.errors import InputError
from wrcore.geometry.profiles.standards import named_profile
from wrcore.integrate.integrator import integrate
from wrcore.run.simulate import simulate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.track.check_rail import CHORD, DOWN, STRIDE
from wrcore.track.flexible_track import track_places

SCENE = ELLIPTIC / "suspended_wheelset.yaml"
RADIUS, REACH, TOP = 0.46, -named_profile("S1002", "wheel").f[0], 0.02
STIFFNESS, FRICTION = 5e7, 0.25
RAIL = {
    "rail": "left", "begin": -5.0, "length": 1000.0, "flangeway": 0.038, "back_to_back": 1.360,
    "stiffness": STIFFNESS, "friction": FRICTION,
}  # fmt: skip
FACE = 0.7175 - 0.038 - 0.680  # from a wheel's back, where the wheelset is in the middle


def wrenches(y=0.0, yaw=0.0, **changes):
    """What acts on the left wheel, with and without a check rail: (6,) each."""
    found = []
    for rails in ([RAIL | changes], []):
        model, state = compile_scene(load_scene(SCENE, {"track.check_rails": rails, "initial.y": 0.0}))
        equations, at = Equations(model), STATE_SIZE * model.bodies.wheelsets[0]
        state[at + 1] += y
        state[at + 3 : at + 7] = math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)
        equations(0.0, state)
        found.append(equations.work.rail_wrenches[0].copy())
    assert np.array_equal(found[0][1], found[1][1])  # the right wheel
    return found[0][0] - found[1][0]


def test_it_presses_a_back_as_a_spring_and_rubs_on_it():
    lateral = wrenches(y=FACE - 1e-3)
    normal, chord = STIFFNESS * 1e-3, math.sqrt((RADIUS + REACH) ** 2 - (RADIUS - TOP) ** 2)
    assert lateral[1] == pytest.approx(normal, rel=1e-9)
    ahead, down = 20.0 * TOP / RADIUS, 20.0 * chord / RADIUS  # sliding velocities of the two points, m/s
    slip = math.sqrt(ahead**2 + down**2 + 0.02**2)
    assert lateral[0] == pytest.approx(-FRICTION * normal * ahead / slip, rel=5e-3)
    assert abs(lateral[2]) < 1e-3 * normal  # up ahead, down behind: a moment that brakes the wheel
    brakes = FRICTION * normal * down / slip * chord
    assert lateral[4] == pytest.approx(-brakes - lateral[0] * (RADIUS - TOP), rel=1e-3)


def test_each_wheel_is_touched_where_its_own_back_ends():
    changes = {"track.check_rails": [RAIL], "wheel.wheelsets": {"wheelset_2": {"left": {"rolling_radius": 0.44}}}}
    wrenches, yaw = [], 0.004
    for rails in ([RAIL | {"begin": -100.0, "friction": 0.0}], []):
        scene = load_scene(ELLIPTIC / "trailer_vehicle.yaml", changes | {"track.check_rails": rails})
        model, state = compile_scene(scene)
        for at in STATE_SIZE * model.bodies.wheelsets:
            state[at + 1], state[at + 3 : at + 7] = FACE, (math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw))
        equations = Equations(model)
        equations(0.0, state)
        wrenches.append(equations.work.rail_wrenches[:, 0, 1].copy())
    model, _ = compile_scene(load_scene(ELLIPTIC / "trailer_vehicle.yaml", changes))
    chords = [math.sqrt((r + REACH) ** 2 - (r - TOP) ** 2) for r in (RADIUS, 0.44, RADIUS, RADIUS)]
    np.testing.assert_allclose(model.check_rails.rows[:, 0, CHORD], chords, rtol=1e-12)
    depths = math.tan(yaw) * np.array(chords) - 0.680 * (
        1.0 / math.cos(yaw) - 1.0
    )  # of the point ahead; that behind: none
    np.testing.assert_allclose(wrenches[0] - wrenches[1], 0.5 * STIFFNESS * depths, rtol=1e-4)
    np.testing.assert_allclose(model.check_rails.rows[:, 0, DOWN], [RADIUS - TOP, 0.44 - TOP] + 2 * [RADIUS - TOP])


@pytest.mark.parametrize("yaw", [0.004, -0.004])
def test_a_wheel_that_yaws_is_touched_ahead_or_behind(yaw):
    chord = math.sqrt((RADIUS + REACH) ** 2 - (RADIUS - TOP) ** 2)
    found = wrenches(y=FACE, yaw=yaw)  # left: y of the back ahead grows with yaw, that behind falls
    normal = 0.5 * STIFFNESS * 0.004 * chord
    assert found[1] == pytest.approx(normal, rel=0.02)
    assert found[5] + 0.68 * found[0] == pytest.approx(-math.copysign(chord, yaw) * normal, rel=0.02)


def test_it_is_as_long_as_it_is_and_its_flares_open():
    there = {"begin": 0.0, "length": 10.0, "flare": {"length": 2.0, "opening": 0.02}}
    deep = FACE - 2e-3
    for begin, share in ((-1.5, 0.0), (-2.5, 1.0), (-1.95, 0.5), (5.0, 0.0), (-11.0, 0.0)):
        normal = wrenches(y=deep, **there | {"begin": begin})[1]
        assert normal == pytest.approx(share * STIFFNESS * 2e-3, rel=1e-6, abs=1e-9)


def test_a_wheelset_is_held_off_the_other_rail_and_nothing_changes_where_it_is_not_touched():
    changes = {"initial.y": 0.0, "initial.yaw": -0.004, "integration.duration": 0.4, "output.rate": 1000.0}
    there = RAIL | {"begin": 1.0, "length": 6.0, "flangeway": 0.0385, "flare": {"length": 0.5, "opening": 0.03}}
    free = simulate(load_scene(SCENE, changes))
    held = simulate(load_scene(SCENE, changes | {"track.check_rails": [there]}))
    force, lateral = held["wheelset"]["check_rail_left_N"], held["wheelset"]["y_m"]
    assert free["wheelset"]["y_m"].min() < -0.003
    assert force.max() > 1e3
    assert not held["wheelset"]["check_rail_right_N"].any()
    assert lateral.min() > free["wheelset"]["y_m"].min() + 2e-4
    before = held["wheelset"]["x_m"] < held["wheelset"]["x_m"][np.flatnonzero(force)[0]] - 2.0 * STRIDE
    assert np.abs(lateral - free["wheelset"]["y_m"])[before].max() < 1e-6


def test_left_and_right_are_mirror_images():
    runs = [
        simulate(load_scene(SCENE, {
            "initial.y": -sign * 0.002, "initial.yaw": -sign * 0.002, "integration.duration": 0.2,
            "integration.method": "rk4",  # no Jacobian by one-sided differences
            "track.check_rails": [RAIL | {"rail": side, "begin": 1.0, "length": 6.0}],
        }))
        for side, sign in (("left", 1), ("right", -1))
    ]  # fmt: skip
    left, right = (run["wheelset"] for run in runs)
    assert left["check_rail_left_N"].max() > 1e3
    assert np.abs(left["check_rail_left_N"] - right["check_rail_right_N"]).max() < 1e-6 * STIFFNESS * 1e-3
    assert np.abs(left["y_m"] + right["y_m"]).max() < 1e-8


def test_scenes_without_one_compile_nothing_of_it():
    model, _ = compile_scene(load_scene(SCENE))
    assert Equations(model).arguments[1].value.kernels.check_rails_kernel == 0


@pytest.mark.parametrize(
    ("changes", "field", "expected"),
    [
        ({"length": 0.9}, "track.check_rails[0].length", "at least two flares of 0.5 m"),
        ({"top": -0.015}, "track.check_rails[0].top", "down to where the wheel's profile ends"),
        ({"flangeway": 0.0374}, "track.check_rails[0].flangeway", "more than 37.5 mm, so that it does not press"),
        ({"flangeway": 0.5}, "track.check_rails.0.flangeway", "0.02 to 0.12"),
        ({"stiff": 1.0}, "track.check_rails.0.stiff", "stiffness"),
    ],
)  # fmt: skip
def test_bad_input_names_its_key(changes, field, expected):
    with pytest.raises(InputError, match=expected) as error:
        load_scene(SCENE, {"track.check_rails": [RAIL | changes]})
    assert error.value.field == field


def test_its_friction_has_no_account_of_energy():
    with pytest.raises(InputError, match="no energy with track.check_rails"):
        load_scene(SCENE, {"track.check_rails": [RAIL], "output.channels": ["energy"]})


def test_the_jacobian_of_a_wheelset_that_leans_on_one():
    """Beside one, and elsewhere, steps take no more evaluations than without."""
    model, state = compile_scene(load_scene(SCENE, {"track.check_rails": [RAIL], "initial.y": 0.0, "speed": 20.0}))
    at = STATE_SIZE * model.bodies.wheelsets[0]
    state[at + 1] += FACE - 1e-3
    state[at + 8 : at + 13] += [0.02, 0.01, 0.01, 0.02, 0.01]
    equations = Equations(model)
    moving = model, 0.0, state, equations(0.0, state), equations
    assert abs(equations.work.rail_wrenches[0, 0, 1]) > 4e4
    jacobian_tests.test_every_entry_against_central_differences(moving)
    jacobian_tests.test_stages_are_solved_as_a_dense_system_would_be(moving)
    run = integrate(model, state, [0.0, 0.5], "rodas5", 1e-4)
    assert run.rhs_evaluations < 16 * run.steps


def test_it_stands_on_the_ground_beside_a_rail_that_gives():
    """Its force is that of where the wheel is, wherever its own rail has moved."""
    support = {"rail": {way: {"stiffness": 5e7, "damping": 1e5} for way in ("lateral", "vertical")}}
    forces = []
    for aside in (0.0, 2e-4):
        for rails in ([RAIL], []):
            changes = {"track": {"check_rails": rails, "support": support}, "initial.y": 0.0}
            model, state = compile_scene(load_scene(SCENE, changes))
            state[STATE_SIZE * model.bodies.wheelsets[0] + 1] += FACE - 1e-3
            state[track_places(model)[0, 0]] += aside
            equations = Equations(model)
            equations(0.0, state)
            forces.append(equations.work.rail_wrenches[0, 0, 1])
    assert forces[0] - forces[1] == pytest.approx(STIFFNESS * 1e-3, rel=1e-6)
    assert forces[2] - forces[3] == pytest.approx(STIFFNESS * 1e-3, rel=1e-6)
