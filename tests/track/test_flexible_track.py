"""The track that gives under each wheelset: against two masses on springs, in balance, in runs and in the Jacobian."""

import json

import numpy as np
import pytest
from scipy.linalg import expm

from tests.conftest import ELLIPTIC
from tests.energy_balance import energy_balance
from tests.jacobian import test_jacobian as jacobian_tests
from tests.track.giving_track import EXAMPLES
from wrcore.analysis.stability.stability import modes
from wrcore.bodies.body import STATE_SIZE
from wrcore.contact.search.reduction import ETA, Y, Z
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.model import internal_states
from wrcore.errors import InputError
from wrcore.integrate.integrator import integrate
from wrcore.kernels.jit import jit
from wrcore.run.simulate import simulate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene, static_equilibrium
from wrcore.track import flexible_track
from wrcore.track.flexible_track import RAILS, track_places

SCENE = ELLIPTIC / "suspended_wheelset.yaml"
MASSES, MASSLESS = (example["support"] for example in EXAMPLES)
BOTH = pytest.mark.parametrize("support", [MASSES, MASSLESS], ids=["masses", "massless"])
BASE = 0.75
ROUGH = {"spectrum": {"level": "low", "seed": 3, "length": 200, "begin": 5}}


def scene_on(support, **changes):
    """The suspended wheelset on a track."""
    return load_scene(SCENE, {"track": {"support": support}}, **changes)


def unloaded(support):
    """Matrix A (14, 14) of q and q' of a track whose wheelset hangs in the air, by the engine's equations."""
    model, state = compile_scene(scene_on(support))
    state[2] += 0.1
    places, equations = track_places(model)[0], Equations(model)
    state[places] = 0.0
    moved = state + 1e-3 * np.eye(len(state))[places]
    rates = 1e3 * equations.at(0.0, np.vstack([moved, state]))[:, places]
    np.testing.assert_array_equal(rates[-1], 0.0)
    return rates[:-1].T, model.contact.geometry.rail_distance


def spring(of, direction, omega=0.0):
    """Dynamic stiffness k + i omega c."""
    return of[direction]["stiffness"] + 1j * omega * of[direction]["damping"]


def patterns(support, base):
    """Shapes of rails and sleeper that go alone: freedoms, direction, and the sleeper's mass for each rail."""
    half = 0.5 * support["sleeper"]["mass"]
    return {
        "lateral in phase": ([1, 0, 1, 0, 1, 0, 0], "lateral", half),
        "gauge": ([1, 0, -1, 0, 0, 0, 0], "lateral", np.inf),
        "bounce": ([0, 1, 0, 1, 0, 1, 0], "vertical", half),
        "roll": ([0, 1, 0, -1, 0, 0, 1 / base], "vertical", 0.5 * support["sleeper"]["roll_inertia"] / base**2),
    }


@pytest.mark.parametrize("name", ["lateral in phase", "gauge", "bounce", "roll"])
def test_the_unloaded_track_has_the_receptance_of_two_masses(name):
    matrix, base = unloaded(MASSES)
    shape, direction, sleeper = patterns(MASSES, base)[name]
    push = np.zeros(14)
    push[7 : 7 + RAILS] = np.array(shape[:RAILS]) / MASSES["rail"]["mass"]  # unit forces on both rails
    rail = 0 if direction == "lateral" else 1
    for omega in 2.0 * np.pi * np.array([0.0, 10.0, 60.0, 110.0, 250.0, 400.0, 1000.0]):
        pad, ballast = (spring(MASSES[part], direction, omega) for part in ("rail", "sleeper"))
        below = 0.5 * ballast - omega**2 * sleeper if np.isfinite(sleeper) else np.inf
        carried = pad if np.isinf(np.real(below)) else pad * below / (pad + below)
        expected = 1.0 / (carried - omega**2 * MASSES["rail"]["mass"])
        found = np.linalg.solve(1j * omega * np.eye(14) - matrix, push)[rail]
        assert abs(found - expected) < 1e-6 * abs(expected)


def test_natural_frequencies_are_those_of_two_masses():
    undamped = json.loads(json.dumps(MASSES))
    for part in undamped.values():
        for direction in ("lateral", "vertical"):
            part[direction]["damping"] = 0.0
    matrix, base = unloaded(undamped)
    expected = []
    for _, direction, m2 in patterns(undamped, base).values():
        m1, (k1, k2) = MASSES["rail"]["mass"], (MASSES[part][direction]["stiffness"] for part in ("rail", "sleeper"))
        if np.isinf(m2):
            expected.append(k1 / m1)
            continue
        a, b = m1 * m2, m1 * (k1 + 0.5 * k2) + m2 * k1  # a w^4 - b w^2 + k1 k2/2 = 0
        root = np.sqrt(b * b - 2.0 * a * k1 * k2)
        expected += [(b - root) / (2.0 * a), (b + root) / (2.0 * a)]
    found = np.sort(np.abs(np.linalg.eigvals(matrix).imag))[::2]
    np.testing.assert_allclose(found, np.sqrt(np.sort(expected)), rtol=1e-6)


@pytest.mark.parametrize("method", ["tsit5", "rodas4"])
def test_a_track_let_go_swings_as_two_masses_do(method):
    model, state = compile_scene(scene_on(MASSES))
    state[2] += 0.1
    places = track_places(model)[0]
    state[places] = [1e-3, 2e-3, 0.0, 2e-3, *np.zeros(10)]
    times = np.linspace(0.0, 0.02, 21)
    found = integrate(model, state, times, method, 1e-9, 0.0).states[:, places]
    matrix, _ = unloaded(MASSES)
    expected = np.array([expm(t * matrix) @ state[places] for t in times])
    np.testing.assert_allclose(found[:, :7], expected[:, :7], rtol=0.0, atol=2e-9)


@BOTH
def test_at_rest_the_springs_carry_the_wheels(support):
    scene = scene_on(support, initial__y=0.0)
    model, _ = compile_scene(scene)
    found = static_equilibrium(scene, model)
    q = found.state[track_places(model)[0, : len(model.flexible_track.mass)]]
    softness = 1.0 / support["rail"]["vertical"]["stiffness"]
    if "sleeper" in support:
        softness += 2.0 / support["sleeper"]["vertical"]["stiffness"]
    np.testing.assert_allclose(q[1:RAILS:2], -found.wheel_loads[0] * softness, rtol=1e-6)
    assert q[0] == pytest.approx(-q[2], rel=1e-6) and q[0] > 1e-5  # inclined contacts push the rails apart


@BOTH
@pytest.mark.parametrize("method", ["tsit5", "rodas4"])
def test_energy_of_a_run_on_its_flanges_adds_up(support, method):
    changes = {
        "speed": 70.0, "initial.y": 0.006, "integration.duration": 0.5, "integration.method": method,
        "integration.rtol": 1e-7, "output.rate": 10000.0, "output.channels": ["pose", "contact", "energy"],
    }  # fmt: skip
    run = simulate(load_scene(scene_on(support), changes))
    energy = run.groups["energy"]
    balance = energy_balance(energy, run.t)
    angles = [run[f"wheelset/{side}"].contact_angle_rad for side in ("left", "right")]
    assert np.nanmax(np.abs(angles)) > 0.7  # on the flange
    assert np.abs(balance.imbalance).max() < 1e-5 * balance.turned_over[-1]  # found: 1e-6 to 4e-6
    assert np.abs(energy["input_by_joints_W"]).max() < 1e-6
    for name, values in energy.items():
        if name.startswith("dissipated"):
            assert values.min() > -1e-6 * energy["dissipated_by_creep_W"].max(), name


@BOTH
def test_mirrored_scenes_give_mirrored_runs(support):
    runs = [
        simulate(scene_on(support, initial__y=y, speed=50.0, integration__duration=0.4, integration__rtol=1e-7))
        for y in (0.004, -0.004)
    ]
    one, other = (run["wheelset"] for run in runs)
    for name, mirror, sign in (
        ("y_m", "y_m", -1), ("yaw_rad", "yaw_rad", -1), ("z_m", "z_m", 1), ("rail_y_left_m", "rail_y_right_m", -1),
        ("rail_z_left_m", "rail_z_right_m", 1),
    ):  # fmt: skip
        np.testing.assert_allclose(one[name], sign * other[mirror], rtol=0.0, atol=1e-8, err_msg=name)
    assert np.ptp(one.rail_z_left_m) > 1e-5


@BOTH
def test_a_centred_run_begins_in_steady_running(support):
    model, state = compile_scene(scene_on(support, initial__y=0.0, speed=33.0))
    n = len(model.bodies.mass)
    rate = Equations(model)(0.0, state)
    moves = np.concatenate([rate[: STATE_SIZE * n].reshape(n, STATE_SIZE)[:, 7:].ravel(), rate[STATE_SIZE * n :]])
    assert np.abs(moves).max() < 1e-6  # without spin's lateral forces: some 0.01 m/s^2


@BOTH
def test_modes_of_the_track_are_named_after_it(support):
    table, _ = modes(scene_on(support), 40.0)
    own = table[table["name"].str.startswith(("rails", "sleeper"))]
    kinds = own["name"].str.split(",").str[0]
    expected = {"rails lateral", "rails vertical"}
    if "sleeper" in support:
        expected |= {"sleeper lateral", "sleeper vertical", "sleeper roll"}
    assert set(kinds) == expected and (own["most_energy"] == kinds).all()
    names = set(table["name"])
    assert {"rails vertical, in phase", "rails vertical, in antiphase"} < names
    assert {"wheelset hunting", "wheelset contact bounce", "wheelset contact roll"} < names


def test_a_stiffer_track_tends_to_rigid_rails_at_first_order():
    def run(factor):
        rail = {
            way: {key: factor * value for key, value in MASSLESS["rail"][way].items()}
            for way in ("lateral", "vertical")
        }
        track = {"support": {"rail": rail}} if factor else {}
        settings = {"integration.duration": 0.3, "integration.rtol": 1e-8, "integration.method": "rodas4"}
        return simulate(load_scene(SCENE, settings | {"track": track}))["wheelset"]

    rigid = run(0)
    gaps = [np.abs(run(factor).y_m - rigid.y_m).max() for factor in (1e2, 1e3)]
    assert gaps[0] / gaps[1] == pytest.approx(10.0, rel=0.1) and gaps[1] < 1e-6


@BOTH
def test_methods_agree_on_rough_track(support):
    changes = {"track": {"support": support, "irregularity": ROUGH}, "integration.duration": 0.6,
               "integration.rtol": 1e-6}  # fmt: skip
    one, other = (simulate(load_scene(SCENE, changes | {"integration.method": name})) for name in ("tsit5", "rodas4"))
    for name in ("y_m", "z_m", "rail_y_left_m", "rail_z_right_m"):
        np.testing.assert_allclose(one["wheelset"][name], other["wheelset"][name], rtol=0, atol=2e-7, err_msg=name)


@pytest.mark.parametrize("patch", ["moment", "exact"])
def test_rails_without_mass_are_in_balance(patch):
    model, state = compile_scene(scene_on(MASSLESS, contact__patch=patch))
    places, equations = track_places(model)[0], Equations(model)
    random = np.random.default_rng(1)
    for _ in range(5):
        moved = state.copy()
        moved[1:3] += random.normal(0.0, [2e-3, 3e-5])
        moved[7:13] += random.normal(0.0, 0.1, 6)
        rate, forces = equations(0.0, moved), equations.work.flexible_track.forces[0].ravel()
        left = model.flexible_track.damping @ rate[places] + model.flexible_track.stiffness @ moved[places] - forces
        assert np.abs(left).max() < 1e-6 * np.abs(forces).max() and np.abs(rate[places]).max() > 1e-3


@jit(allocates=False)
def _slip_before_and_after(model, work, slips):
    for k in range(2):
        flexible_track._press(model, work, -1, 0)
        for wheel in range(2):
            slips[k, wheel] = work.patches[0, wheel, 0, ETA]
        if k == 0:
            flexible_track._follow_where_sliding(model, work)


@pytest.mark.parametrize("drift", [0.02, -0.02])
def test_rails_follow_wheels_that_slide(drift):
    """Left and right, either way: at the speed where Newton's method begins neither slips."""
    model, state = compile_scene(scene_on(MASSLESS, speed=1.0, initial__y=0.003))
    equations, slips = Equations(model), np.zeros((2, 2))
    state[8] += drift
    equations(0.0, state)
    equations.work.flexible_track.speeds[:] = 0.0
    _slip_before_and_after(*equations.arguments[1:], slips)
    np.testing.assert_allclose(slips, [[drift, drift], [0.0, 0.0]], atol=1e-4)


@pytest.mark.parametrize("speed", [1.0, 0.1])
def test_rails_without_mass_under_a_slow_wheelset_that_slides(speed):
    """Their springs push the wheels sideways until they slide, where friction hardly changes with the slip."""
    run = simulate(scene_on(MASSLESS, speed=speed, initial__y=0.002, integration__duration=0.3))
    assert run.status == "completed" and run.counters["steps"] < 500
    assert run.counters["rails_unbalanced"] < 0.02 * run.counters["rhs_evaluations"]


@pytest.mark.parametrize(("damping", "counted"), [(None, False), (1.0, True)], ids=["as given", "next to none"])
def test_evaluations_without_a_balance_are_counted(damping, counted):
    rail = json.loads(json.dumps(MASSLESS["rail"]))
    for way in rail.values():
        way["damping"] = damping or way["damping"]
    run = simulate(scene_on({"rail": rail}, initial__y=0.004, integration__duration=0.01))
    assert (run.counters["rails_unbalanced"] > 0) == counted


def test_a_wheelset_that_moves_with_its_rails_feels_rigid_ones():
    aside, up, moving, rising = 3e-4, -2e-4, 0.02, -0.01
    _, start = compile_scene(load_scene(SCENE))
    found = []
    for support in (None, MASSES):
        model, _ = compile_scene(load_scene(SCENE, {"track": {"support": support} if support else {}}))
        state = np.concatenate([start, np.zeros(internal_states(model))])
        if support:
            q = track_places(model)[0]
            state[1:3] += aside, up
            state[8:10] += moving, rising
            state[q[:RAILS]], state[q[7 : 7 + RAILS]] = [aside, up] * 2, [moving, rising] * 2
        equations = Equations(model)
        equations(0.0, state)
        found.append((equations.work.rail_wrenches[0], equations.work.patches[0, :, 0][:, [Y, Z]].T.copy()))
    (rigid, places), (carried, moved) = found
    assert rigid[:, 2].min() > 1e4
    np.testing.assert_allclose(carried, rigid, rtol=1e-6, atol=1e-6 * np.abs(rigid).max())
    np.testing.assert_allclose(moved - places, np.full((2, 2), [[aside], [up]]), rtol=0.0, atol=1e-9)


CURVED = {"path": [{"transition": 5}, {"curve": 300, "radius": 500, "cant": 0.05}]}
MOVING = pytest.mark.parametrize("changes", [{}, {"track": CURVED}], ids=["straight", "curve"])


def with_track(name, support, changes):
    """A moving vehicle for the tests of the Jacobian; rails heavy enough for differences to tell them from rounding."""
    support = json.loads(json.dumps(support))
    support["rail"]["mass"] = 10.0 * support["rail"].get("mass", 0.0)
    changes = {"speed": 20.0} | changes | {"track": changes.get("track", {}) | {"support": support}}
    model, start = compile_scene(load_scene(ELLIPTIC / f"{name}.yaml", changes))
    end = integrate(model, start, [0.0, 0.5], "tsit5", 1e-6, 1e-9).end.memory
    t, state, equations = end.clock[0], end.state, Equations(model)
    return model, t, state, equations(t, state), equations


@BOTH
@MOVING
def test_each_entry_of_the_jacobian(support, changes):
    jacobian_tests.test_every_entry_against_central_differences(with_track("suspended_wheelset", support, changes))


@BOTH
@MOVING
def test_refreshing_the_contacts_is_taking_the_whole_anew(support, changes):
    moving = with_track("trailer_vehicle", support, changes)
    jacobian_tests.test_refreshing_the_contacts_is_taking_the_whole_anew(moving)


@BOTH
def test_stages_are_solved_as_a_dense_system_would_be(support):
    jacobian_tests.test_stages_are_solved_as_a_dense_system_would_be(with_track("trailer_vehicle", support, {}))


@pytest.mark.parametrize("patch", ["moment", "tabulated"])
def test_a_track_that_gives_takes_hardly_more_steps_than_a_rigid_one(patch):
    """Nor more evaluations in a step: found 1.01 times with masses and 1.25 without, and 13."""
    steps, evaluations = [], []
    for support in (None, MASSES, MASSLESS):
        track = {"irregularity": ROUGH} | ({"support": support} if support else {})
        scene = load_scene(ELLIPTIC / "trailer_vehicle.yaml", {"contact.patch": patch, "speed": 20.0, "track": track})
        run = integrate(*compile_scene(scene), [0.0, 2.0], "rodas5", 1e-4)
        steps.append(run.steps)
        evaluations.append(run.rhs_evaluations / run.steps)
    assert max(steps) < 1.5 * steps[0] and max(evaluations) < 16.0


@pytest.mark.parametrize(("method", "part"), [("rodas5", 0.2), ("rodas4p2", 0.1)])
def test_speeds_that_stages_imply_keep_the_order_of_a_method(method, part):
    """Rails without mass, rough track, fixed steps, error with half the step: order 4 of rodas4p2; rodas5 has less than
    its own wherever motion is stiff."""
    changes = {"speed": 20.0, "contact.patch": "moment", "track": {"support": MASSLESS, "irregularity": ROUGH}}
    model, start = compile_scene(load_scene(ELLIPTIC / "suspended_wheelset.yaml", changes))
    begun = integrate(model, start, [0.0, 0.6], "rodas5", 1e-6).states[-1]
    exact = integrate(model, begun, [0.6, 0.72], "tsit5", 1e-10).states[-1]
    errors = [
        np.abs(integrate(model, begun, [0.6, 0.72], method, step=0.12 / count).states[-1] - exact)[1:3].max()
        for count in (12, 24, 48)
    ]
    assert errors[0] < 1e-7 and errors[1] < part * errors[0] and errors[2] < part * errors[1]


def test_beside_a_drive():
    brake = {"name": "brake", "bodies": ["wheelset", "frame"], "torque": 500.0}
    changes = {"track": {"support": MASSES}, "drive.brakes": [brake], "integration.duration": 0.2}
    ours, rigid = (simulate(load_scene(SCENE, part)) for part in (changes, changes | {"track": {}}))
    gap = ours["wheelset"].wy_rad_per_s[-1] - rigid["wheelset"].wy_rad_per_s[-1]
    assert ours.status == "completed" and abs(gap) < 0.01 * abs(np.ptp(rigid["wheelset"].wy_rad_per_s)) + 1e-3


def all_own_states(support, tmp_path):
    """Changes to a scene with all kinds of own states: wheels that turn apart, track, the controller's integral."""
    text = (ELLIPTIC.parent / "vehicles" / "suspended_wheelset.yaml").read_text()
    vehicle = tmp_path / "independent.yaml"
    vehicle.write_text(text.replace("    kind: wheelset\n", "    kind: wheelset\n    independent_wheels: true\n"))
    drive = {
        "motors": [{"name": side, "bodies": ["wheelset", "frame"], "wheel": side} for side in ("left", "right")],
        "controller": {"body": "wheelset", "speed": 20.0, "proportional": 1e4, "integral": 1e3, "limit": 1e4},
    }
    return {"vehicle.parameters": str(vehicle), "drive": drive, "track": {"support": support} | CURVED}


@BOTH
def test_methods_agree_with_independent_wheels_a_controller_and_a_curve(support, tmp_path):
    changes = all_own_states(support, tmp_path) | {"integration.duration": 0.5, "integration.rtol": 1e-6}
    one, other = (simulate(load_scene(SCENE, changes | {"integration.method": name})) for name in ("tsit5", "rodas4"))
    for name in ("y_m", "rolling_rate_left_rad_per_s", "rail_y_left_m", "rail_z_right_m"):
        np.testing.assert_allclose(one["wheelset"][name], other["wheelset"][name], rtol=0, atol=2e-6, err_msg=name)
    assert np.ptp(one["wheelset"].rail_z_right_m) > 1e-5


@BOTH
def test_the_jacobian_with_all_own_states(support, tmp_path):
    moving = with_track("suspended_wheelset", support, all_own_states(support, tmp_path))
    jacobian_tests.test_every_entry_against_central_differences(moving)
    jacobian_tests.test_stages_are_solved_as_a_dense_system_would_be(moving)


def test_a_scene_without_has_none():
    model, state = compile_scene(load_scene(SCENE))
    compiled = Equations(model).arguments[1].value
    assert internal_states(model) == 0 and len(state) == STATE_SIZE and compiled.kernels.wheel_forces_kernel
    for name in ("flexible_track", "drive_torques", "rail_friction", "joint_reactions"):  # not even compiled
        assert getattr(compiled.kernels, f"{name}_kernel") == 0, name
    assert not compiled.contact.geometries and not compiled.contact.strips.strips


BAD = [
    ({"rail": {"lateral": MASSLESS["rail"]["lateral"]}}, "track.support.rail", "vertical"),
    (MASSLESS | {"sleeper": MASSES["sleeper"]}, "track.support.rail.mass", "above 0"),
    ({"rail": MASSLESS["rail"] | {"lateral": {"stiffness": 1e7, "damping": 0.0}}}, "track.support.rail.lateral.damping",
     "without mass"),
    ({"rail": MASSLESS["rail"] | {"lateral": {"stiffness": -1e7, "damping": 1.0}}},
     "track.support.rail.lateral.stiffness", "N/m"),
]  # fmt: skip


@pytest.mark.parametrize(("support", "field", "expected"), BAD)
def test_bad_descriptions_name_their_field(support, field, expected):
    with pytest.raises(InputError) as caught:
        scene_on(support)
    assert caught.value.field.startswith(field) and expected in str(caught.value)


def test_the_values_on_the_page_follow_from_their_sources():
    bending, spacing, length = 2.059e11 * 3.217e-5, 0.6, 2.6
    pads, ground = [(65e6, 75e3)], [(137.75e6, 58.8e3), (77.5e6, 31.15e3)]

    def in_series(*springs):  # of dampers what counts at low frequency
        k = 1.0 / sum(1.0 / stiffness for stiffness, _ in springs)
        return np.array([k, k * k * sum(damping / stiffness**2 for stiffness, damping in springs)])

    beta = (in_series(*pads, *ground)[0] / spacing / (4.0 * bending)) ** 0.25
    seats, sleepers = 2.0 / beta / spacing, 1.5 / beta / spacing
    rail, sleeper = MASSES["rail"], MASSES["sleeper"]

    def values(part):
        return [part["stiffness"], part["damping"]]

    close = {"rtol": 5e-3}
    np.testing.assert_allclose(values(rail["vertical"]), seats * in_series(*pads), **close)
    np.testing.assert_allclose(values(rail["lateral"]), seats * np.array([15e6, 50e3]), **close)
    np.testing.assert_allclose(values(sleeper["vertical"]), 2.0 * seats * in_series(*ground), **close)
    masses = [rail["mass"], sleeper["mass"], sleeper["roll_inertia"]]
    expected = [1.5 / beta * 60.64, sleepers * 251.0, sleepers * 251.0 * length**2 / 12.0]
    np.testing.assert_allclose(masses, expected, **close)
    for way in ("lateral", "vertical"):
        both = in_series(values(rail[way]), [0.5 * value for value in values(sleeper[way])])
        np.testing.assert_allclose(values(MASSLESS["rail"][way]), both, rtol=0.02)


def test_where_patches_are_solved_stages_find_their_balance():
    """Slopes are those of ellipses there: a step of Newton's method with them is no balance, and takes 27 times as many
    steps. Found: 0.87 times those on rigid rails."""
    steps = []
    for track in ({"support": MASSLESS}, {}):
        changes = {"speed": 20.0, "contact.patch": "exact", "track": {"irregularity": ROUGH} | track}
        steps.append(integrate(*compile_scene(load_scene(SCENE, changes)), [0.0, 0.35], "rodas5", 1e-4).steps)
    assert steps[0] < 1.3 * steps[1]


def test_a_slow_wheelset_on_rails_without_mass_takes_no_more_steps():
    """Friction saturates at a speed of the rails of 0.2 mm/s there, which no stage implies that well (10 times as many
    steps); `rodas4p2`, too, whose stages are not looked at in between."""
    for method in ("rodas5", "rodas4p2"):
        steps = []
        for track in ({"support": MASSLESS}, {}):
            changes = {"speed": 0.1, "contact.patch": "moment", "track": track}
            steps.append(integrate(*compile_scene(load_scene(SCENE, changes)), [0.0, 2.0], method, 1e-4).steps)
        assert steps[0] < 1.5 * steps[1]


def test_implied_speeds_are_part_of_what_a_step_may_err():
    """Low friction, high irregularity: 0.19 um; without their error 1.1 um, in half the steps."""
    rough = {"spectrum": {"level": "high", "seed": 3, "length": 200, "begin": 20}}
    changes = {"speed": 45.0, "contact": {"patch": "moment", "friction": 0.05},
               "track": {"support": MASSLESS, "irregularity": rough}}  # fmt: skip
    model, start = compile_scene(load_scene(SCENE, changes))
    times = np.linspace(0.0, 2.0, 401)
    exact, found = (integrate(model, start, times, *how).states[:, 1] for how in (("tsit5", 1e-8), ("rodas5", 1e-4)))
    assert np.sqrt(np.mean((found - exact) ** 2)) < 5e-7


def test_auto_goes_by_the_cheaper_method_on_rails_without_mass():
    """An evaluation by rk4 is four there."""
    changes = {"speed": 45.0, "contact.patch": "moment", "track": {"support": MASSLESS, "irregularity": ROUGH}}
    run = integrate(*compile_scene(load_scene(ELLIPTIC / "trailer_vehicle.yaml", changes)), [0.0, 2.0], "auto")
    assert run.method == "rodas5"


def test_steps_do_not_grow_ever_shorter_where_speeds_of_rails_jump():
    """Hunting on the flanges: smallest step found 20 us, 443 attempts; 50 ns and 779 where speeds count in full."""
    model, start = compile_scene(scene_on(MASSLESS, speed=80.0, initial__y=0.006, contact__patch="moment"))
    run = integrate(model, start, [0.0, 0.3], "rodas5", 1e-4)
    assert run.steps + run.rejected < 600
