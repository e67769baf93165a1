"""What one number buys: the same error on straight track and in curves, for one vehicle and for a train."""

import numpy as np
import pytest

from tests.conftest import ELLIPTIC, SCENES
from tests.integrate.scenes import ARMS, FALLING, compiled, rough
from wrcore.bodies.body import OMEGA, STATE_SIZE, euler_parameters
from wrcore.contact.search import reduction
from wrcore.equations.pace import HALF_GAUGE, RATE, pace
from wrcore.forces.drive import GRIP
from wrcore.integrate.integrator import METHODS, STALL_ATTEMPTS, integrate
from wrcore.integrate.tableaus import ROSENBROCK
from wrcore.integrate.tolerances import LENGTH, SHARE, lightness, step_tolerances
from wrcore.run.output.compute import evaluated
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

ROUGH = {"spectrum": {"level": "low", "seed": 1, "length": 300.0, "begin": 20.0}}
TRACKS = {
    "straight": {"speed": 20.0},
    "R 600": {"speed": 25.0, "track.path": [{"transition": 60.0}, {"curve": 300.0, "radius": 600.0, "cant": 0.1}]},
}


def test_tolerances_by_kind():
    """A wheelset: all from 1e-4 of 1 cm, and atol on top; own states of elements count as positions."""
    model, _ = compile_scene(load_scene(ELLIPTIC / "suspended_wheelset.yaml"))
    lever = np.sqrt(1120.0 / 1813.0)  # roll and yaw moment of inertia, mass
    bound = 1e-4 * LENGTH
    expected = np.zeros((2, STATE_SIZE))  # at any speed, and per 1/s
    expected[0, :7] = [bound] * 3 + [bound / (2 * lever)] * 4
    expected[1, 7:] = [bound] * 3 + [bound / lever] * 3
    np.testing.assert_allclose(step_tolerances(model, 1e-4), expected, rtol=1e-12)
    np.testing.assert_allclose(step_tolerances(model, 1e-4, 2 * bound), 3 * expected, rtol=1e-12)
    for method in METHODS:
        share = SHARE.get(method, 1.0)
        np.testing.assert_allclose(step_tolerances(model, 1e-4, 0.0, method), share * expected, rtol=1e-12)
    metro, start = compile_scene(load_scene(ELLIPTIC / "metro_car.yaml"))
    found = step_tolerances(metro, 1e-4)[0]
    assert len(found) == len(start) and np.all(found[STATE_SIZE * len(metro.bodies.mass) :] == bound)


def test_bodies_lighter_than_a_wheelset_may_err_by_equal_energy():
    """Axle boxes of 120 kg, bolsters of 800 kg beside wheelsets of 1834 kg; heavier bodies as wheelsets."""
    model, _ = compile_scene(load_scene(ELLIPTIC / "metro_car.yaml"))
    found, mass = step_tolerances(model, 1e-4), model.bodies.mass
    of_bodies = found[:, : STATE_SIZE * len(mass)].reshape(2, len(mass), STATE_SIZE)
    allowed = 1e-4 * LENGTH * np.sqrt(np.maximum(1.0, 1834.0 / mass))
    assert set(mass) == {30549.0, 3952.0, 1834.0, 800.0, 120.0}
    np.testing.assert_allclose(of_bodies[0, :, :3], np.tile(allowed, (3, 1)).T, rtol=1e-12)
    np.testing.assert_allclose(of_bodies[1, :, 7:10], np.tile(allowed, (3, 1)).T, rtol=1e-12)
    assert np.all(lightness(model.bodies._replace(wheelsets=model.bodies.wheelsets[:0])) == 1.0)


def test_rails_without_mass_may_err_by_a_tenth_where_steps_are_explicit():
    rail = {side: {"stiffness": 8e7, "damping": 6e4} for side in ("lateral", "vertical")}
    for mass, share in (({}, 0.1), ({"mass": 79.0}, 1.0)):
        support = {"track.support": {"rail": rail | mass}}
        model, _ = compile_scene(load_scene(ELLIPTIC / "suspended_wheelset.yaml", support))
        of_rails, of_body = slice(STATE_SIZE, STATE_SIZE + 4), slice(0, 3)
        for method, own in (("rk4", share), ("tsit5", share), ("rodas5", 1.0)):
            allowed = step_tolerances(model, 1e-4, method=method)[0]
            np.testing.assert_allclose(allowed[of_body], SHARE.get(method, 1.0) * 1e-4 * LENGTH)
            np.testing.assert_allclose(allowed[of_rails], own * allowed[0])


def test_velocities_count_by_the_speed_of_the_slowest_wheelset_in_the_step():
    model, state = compile_scene(load_scene(ELLIPTIC / "trailer_vehicle.yaml", {"speed": 20.0}))
    paced = model.bodies.wheelsets, model.contact.least_speed
    front, rear = (STATE_SIZE * body for body in model.bodies.wheelsets[[0, -1]])
    assert pace(*paced, state, state) == pytest.approx(20.0 / HALF_GAUGE, rel=1e-9)
    for speed, rate in ((60.0, RATE), (2.0, 2.0 / HALF_GAUGE), (0.0, model.contact.least_speed / HALF_GAUGE)):
        for sign in (1.0, -1.0):
            new, yaw = state.copy(), 0.8
            for at in STATE_SIZE * model.bodies.wheelsets:
                new[at + 7] = 60.0
            new[rear + 3 : rear + 7] = euler_parameters(0.0, 0.0, yaw)
            new[rear + 7 : rear + 10] = sign * speed * np.array([np.cos(yaw), np.sin(yaw), 0.0])
            new[rear + 7 : rear + 10] += [-np.sin(yaw), np.cos(yaw), 5.0]  # across and up it may move
            assert pace(*paced, new, new) == pytest.approx(rate, rel=1e-9)
            assert pace(*paced, state, new) == pace(*paced, new, state) == pytest.approx(min(rate, 20.0 / HALF_GAUGE))
            new[front + 7] = 0.5
            assert pace(*paced, new, new) == pytest.approx(min(rate, 0.5 / HALF_GAUGE), rel=1e-9)


IDLE = {"suspended_wheelset": ("wheelset", "frame"), "trailer_vehicle": ("wheelset_1", "bogie_1"),
        "metro_car": ("wheelset_1", "frame_1")}  # fmt: skip


@pytest.mark.parametrize("method", ["rodas5", "rodas4p2", "ros34pw2", "tsit5", "auto"])
@pytest.mark.parametrize("name", IDLE)
def test_a_motor_that_does_nothing_costs_nothing(name, method):
    """Smooth and rough: as many steps, and the same method, as without it (with the tolerances of 1 mm/s: 13 to 35)."""
    idle = {"drive.motors": [{"name": "m", "bodies": list(IDLE[name]), "torque": 0.0}]}
    for track in ({}, {"track.irregularity": ROUGH}):
        runs = []
        for more in ({}, idle):
            scene = load_scene(ELLIPTIC / f"{name}.yaml", {"speed": 20.0, "initial.y": 0.001, **track, **more})
            runs.append(integrate(*compile_scene(scene), [0.0, 0.5], method))
        assert runs[1].method == runs[0].method and runs[1].steps <= 1.1 * runs[0].steps


@pytest.mark.parametrize("rtol", [1e-4, 1e-6])
def test_a_braked_wheelset_comes_to_rest_and_stays(rtol):
    """Its speed follows the closed solution of a brake whose torque goes through zero, then it stands."""
    torque, speed, radius, mass, spin = 300.0, 0.1, 0.46, 1813.0, 112.0
    brake = {"name": "b", "bodies": ["wheelset", "frame"], "torque": torque}
    scene = load_scene(SCENES / "wheelset.yaml", {"speed": speed, "initial.y": 0.0, "drive.brakes": [brake]})
    times = np.linspace(0.0, 3.0, 301)
    run = integrate(*compile_scene(scene), times, "rodas4", rtol)
    assert run.status == "completed" and run.steps < (2000 if rtol == 1e-4 else 20_000)
    # omega' = -(M/J) tanh(omega/GRIP), J = m r^2 + I
    pull = np.exp(-torque / ((mass * radius**2 + spin) * GRIP) * times)
    rolling = GRIP * np.arcsinh(np.sinh(speed / radius / GRIP) * pull)
    np.testing.assert_allclose(run.states[:, 11], rolling, atol=0.01 * speed / radius)
    assert np.abs(run.states[times > 2.0, 7]).max() < 1e-6 < np.abs(run.states[times < 0.5, 7]).min()
    assert np.ptp(run.states[times > 2.0, :3], axis=0).max() < 1e-6


def test_an_explicit_method_gets_on_at_standstill():
    """Steps of 50 ns, as stability asks for at the least speed of creepages, are no stall."""
    model, start = compile_scene(load_scene(ELLIPTIC / "suspended_wheelset.yaml", {"speed": 1e-3}))
    run = integrate(model, start, [0.0, 3e-3], "tsit5")
    assert run.status == "completed" and run.steps > STALL_ATTEMPTS


@pytest.mark.parametrize("method", METHODS)
def test_the_default_keeps_wheelsets_within_a_micrometre(method):
    """Every method, on irregular rails, straight and in a curve: at most 1 um over the run, and not for nothing."""
    for track in TRACKS.values():
        scene = load_scene(ELLIPTIC / "trailer_vehicle.yaml", {**track, "track.irregularity": ROUGH})
        model, start = compile_scene(scene)
        times = np.linspace(0.0, 3.0, 61)
        exact = integrate(model, start, times, "tsit5", 1e-9).states
        places = np.ravel([STATE_SIZE * body + np.arange(1, 3) for body in model.bodies.wheelsets])
        run = integrate(model, start, times, method)
        assert np.sqrt(np.mean((run.states - exact)[:, places] ** 2)) < 1e-6
        assert run.steps < 4000


def test_no_light_part_dictates_the_steps():
    """Boxes of 1 kg on undamped bushings, 302 Hz, on rough track: `auto` takes less than 6.5 steps a metre and
    keeps y to 1 um and N to 0.5 %. So does Rodas4: with old Jacobians in place of the drift's derivative y would err by
    20 um, with Rodas5 by 60."""
    model, start = compiled("metro car, trailing arms", 20.0, ARMS | FALLING | rough())
    times, choices = np.linspace(0.0, 2.0, 401), (("tsit5", 1e-8), ("auto",), ("rodas4",), ("rodas4p2",))
    runs = exact, auto, *_ = [integrate(model, start, times, *choice) for choice in choices]
    y = [run.states[:, STATE_SIZE * model.bodies.wheelsets + 1] for run in runs]
    normal = [np.nansum(evaluated(model, run)[0][..., reduction.NORMAL], axis=-1) for run in runs]
    assert auto.method == "rodas5" and auto.steps < 6.5 * 40.0
    for k in (1, 2, 3):
        assert np.sqrt(np.mean((y[k] - y[0]) ** 2)) < 1e-6
        assert np.sqrt(np.mean((normal[k] - normal[0]) ** 2)) < 5e-3 * normal[0].mean()


def test_a_train_is_integrated_as_accurately_as_its_vehicles():
    """Three coaches far apart take as many steps as one: the body that errs most counts, not the mean of all."""
    steps = []
    for count in (1, 3):
        more = {"vehicle.count": count, "vehicle.spacing": 40.0} if count > 1 else {}
        scene = load_scene(ELLIPTIC / "trailer_vehicle.yaml", {"speed": 20.0, **more})
        steps.append(integrate(*compile_scene(scene), [0.0, 2.0], "rodas4", 1e-5).steps)
    assert abs(steps[1] - steps[0]) <= 2


@pytest.mark.parametrize("path", ["tangent", [{"transition": 20}, {"curve": 60, "radius": 300, "cant": 0.1}]])
def test_a_look_between_the_stages_finds_little_where_motion_is_smooth(monkeypatch, path):
    """1.04 times the steps, in the curve 1.3 for kinks of cant. A wrong sign or place of the output's rate, or of
    the axes and the drift that it is counted in, would be an error in each step."""
    model, start = compiled("trailer vehicle", 16.7, {"track.path": path})
    runs, tableau = [], ROSENBROCK["rodas5"]
    for looked_at in (tableau.looked_at, 0.0):
        monkeypatch.setitem(ROSENBROCK, "rodas5", tableau._replace(looked_at=looked_at))
        runs.append(integrate(model, start, np.linspace(0.0, 3.0, 31), "rodas5"))
    assert runs[1].steps <= runs[0].steps < 1.5 * runs[1].steps


def test_a_torque_that_is_switched_within_a_step_is_not_missed():
    """It rises to 3 kNm within 10 ms on slippery rails, wherever in a step: where its dense output is not looked at,
    Rodas5 misses it by up to 0.07 rad/s."""
    for begin in np.linspace(0.15, 0.25, 21):
        torque = {"time": [0.0, begin, begin + 0.01, 1.0], "torque": [0.0, 0.0, 3e3, 3e3]}
        motor = {"name": "motor", "bodies": ["wheelset", "frame"], "torque": torque}
        changes = {"speed": 20.0, "contact.friction": 0.05, "contact.patch": "moment", "drive.motors": [motor]}
        model, start = compile_scene(load_scene(ELLIPTIC / "suspended_wheelset.yaml", changes))
        exact, found = (
            integrate(model, start, [0.0, begin + 0.02], *choice).states[-1, OMEGA + 1]
            for choice in (("tsit5", 1e-8), ("rodas5",))
        )
        assert abs(found - exact) < 2e-3
