"""The compiled engine: orders of convergence, independent solvers, repeatability to the bit, failures as values."""

import math
import pickle

import numpy as np
import pytest

from tests.conftest import ELLIPTIC, SCENES
from tests.equations.test_equations_of_motion import body_state, contact, make_model  # noqa: F401 (contact is a fixture)
from wrcore.bodies.marker import FRAME
from wrcore.equations.equations_of_motion import Equations
from wrcore.errors import InputError
from wrcore.integrate import engine
from wrcore.integrate.choice import fastest_rate
from wrcore.integrate.integrator import METHODS, integrate
from wrcore.integrate.reference import SOLVERS, integrate_function
from wrcore.integrate.tableaus import EXPLICIT, ROSENBROCK
from wrcore.run.simulate import output_times, simulate, simulate_many
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

ORDERS = {"rk45": 5, "tsit5": 5, "rk23": 3, "rk4": 4, "rodas5": 5, "rodas4": 4, "rodas4p2": 4, "ros34pw2": 3}
WHEELSET = ELLIPTIC / "suspended_wheelset.yaml"
CURVE = (
    "track={path: [{transition: 30}, {curve: 700, radius: 600, cant: 0.05}], irregularity: {fade_in: 10, fade_out: 10, "
    "spectrum: {level: low, seed: 2, length: 60, begin: 5}}}"
)


@pytest.fixture(scope="module")
def wheelset():
    """Suspended wheelset at 20 m/s, 2 mm off the centre: model and initial state."""
    return compile_scene(load_scene(WHEELSET, ["speed=20"]))


@pytest.fixture(scope="module")
def curve():
    """The same on an irregular track that goes into a curve."""
    return compile_scene(load_scene(WHEELSET, ["speed=20", CURVE]))


OSCILLATORS = [
    (10.0, (4e3, 9e3, 1e4), (30.0, 20.0, 50.0), (0.02, 0.01, -0.01), (0.1, 0.3, 0.0)),
    (4.0, (2e3, 1e3, 3e3), (10.0, 0.0, 1.0), (0.03, -0.05, 0.0), (-0.5, 0.0, 0.2)),
]
"""Mass (kg), stiffness (N/m), damping (N s/m), initial displacement (m) and velocity (m/s) relative to the frame."""


def oscillators(contact, speed):  # noqa: F811
    """Two bodies on springs to the moving frame: model and initial state."""
    springs = [
        ((b, FRAME), [[0, 0, 0], [5.0 * b, 0, 1.0]], k, c, (0, 0, 0), (0, 0, 0))
        for b, (_, k, c, _, _) in enumerate(OSCILLATORS)
    ]
    masses = [mass for mass, *_ in OSCILLATORS]
    model = make_model(contact, masses, [[1, 2, 3]] * 2, springs, gravity=0.0, speed=speed)
    states = [
        body_state(np.add((5.0 * b, 0, 1.0), d), velocity=np.add((speed, 0, 0), v))
        for b, (_, _, _, d, v) in enumerate(OSCILLATORS)
    ]
    return model, np.concatenate(states)


def oscillation(t, speed):
    """Exact positions of both bodies at a time: m d'' + c d' + k d = 0 on each axis."""
    places = []
    for b, (mass, k, c, d, v) in enumerate(OSCILLATORS):
        delta, omega = np.array(c) / (2 * mass), np.sqrt(np.array(k) / mass - (np.array(c) / (2 * mass)) ** 2)
        decay = np.exp(-delta * t)
        swing = np.array(d) * np.cos(omega * t) + (np.array(v) + delta * d) / omega * np.sin(omega * t)
        places.append(np.add((5.0 * b + speed * t, 0, 1.0), decay * swing))
    return np.array(places)


def thrown(model, start):
    """The same start with wheelsets that slide sideways: a start without transients has errors of the nodes' size."""
    start = start.copy()
    start[13 * model.bodies.wheelsets + 8] += 0.01
    return model, start


def orders(errors):
    return np.log2(np.array(errors[:-1]) / errors[1:])


@pytest.mark.parametrize("method", METHODS)
def test_order_on_springs_that_run_ahead(contact, method):  # noqa: F811
    """Exact solution; the frame's motion makes the right-hand side depend on time."""
    model, start = oscillators(contact, 3.0)
    errors = []
    for step in (0.005, 0.0025, 0.00125):
        run = integrate(model, start, [0.0, 0.5], method, step=step)
        assert (run.steps, run.rejected) == (round(0.5 / step), 0)
        errors.append(np.abs(run.states[-1].reshape(2, 13)[:, :3] - oscillation(0.5, 3.0)).max())
    assert ORDERS[method] - 0.1 < orders(errors)[-1] < ORDERS[method] + 0.2


@pytest.mark.parametrize("method", METHODS)
def test_order_on_a_tumbling_body(contact, method):  # noqa: F811
    """Torque-free asymmetric top: nonlinear in Euler parameters and angular velocity."""
    model = make_model(contact, [1.0], [[1.0, 2.0, 3.5]], gravity=0.0, alpha=0.0)
    start = body_state(angles=(0.1, 0.2, 0.3), omega=(0.1, 3.0, 0.2))
    exact = integrate(model, start, [0.0, 2.0], "scipy_dop853", 1e-13, 1e-14, longest_step=math.inf).states[-1]
    steps = (0.05, 0.025, 0.0125) if method != "rodas5" else (0.1, 0.05, 0.025)  # its Jacobian's differences leave 1e-9
    errors = [np.abs(integrate(model, start, [0.0, 2.0], method, step=h).states[-1] - exact).max() for h in steps]
    # Rodas4 and both pairs of order 5 have not quite settled; they come from above
    assert orders(errors)[-1] > ORDERS[method] - 0.1


@pytest.mark.parametrize("method", METHODS)
def test_order_on_the_suspended_wheelset(wheelset, method):
    """The real contact for 40 ms. Patches gain and lose nodes, where forces have one continuous derivative only."""
    model, start = thrown(*wheelset)
    exact = integrate(model, start, [0.0, 0.04], "scipy_dop853", 1e-13, 1e-14).states[-1]
    steps = (4e-4, 2e-4, 1e-4) if ORDERS[method] < 5 else (16e-4, 8e-4) if method == "rodas5" else (8e-4, 4e-4)
    errors = [np.abs(integrate(model, start, [0.0, 0.04], method, step=h).states[-1] - exact).max() for h in steps]
    assert errors[-1] < 2e-8
    assert orders(errors).max() > ORDERS[method] - 0.4


def test_rodas4_keeps_its_order_on_irregular_track():
    """The vehicle at 20 m/s: fourfold error per halving if columns of the Jacobian did not belong to one motion."""
    rough = "track.irregularity={spectrum: {level: low, seed: 1, length: 200, begin: 5}}"
    model, start = compile_scene(load_scene(ELLIPTIC / "trailer_vehicle.yaml", ["speed=20", rough]))
    exact = integrate(model, start, [0.0, 1.5], "tsit5", 1e-10, 1e-13).states[-1]
    places = [13 * body + 1 for body in model.bodies.wheelsets]
    errors = [
        np.abs(integrate(model, start, [0.0, 1.5], "rodas4", step=h).states[-1] - exact)[places].max()
        for h in (4e-3, 2e-3)  # the reference is right to 1e-10
    ]
    assert errors[0] < 1e-7
    assert orders(errors)[-1] > 3.5


@pytest.mark.parametrize("method", METHODS)
def test_dense_output_is_as_good_as_its_order(contact, method):  # noqa: F811
    """Errors between the steps fall at least as h^4 (the interpolants are of third order or higher) on springs."""
    model, start = oscillators(contact, 3.0)
    times, errors = np.linspace(0.0, 0.4, 401), []
    for step in (0.008, 0.004, 0.002):
        states = integrate(model, start, times, method, step=step).states
        exact = np.array([oscillation(t, 3.0) for t in times])
        errors.append(np.abs(states.reshape(len(times), 2, 13)[:, :, :3] - exact).max())
    assert orders(errors)[-1] > min(4, ORDERS[method]) - 0.25


@pytest.mark.parametrize("method", [*METHODS, *SOLVERS])
def test_all_methods_agree(wheelset, method):
    model, start = wheelset
    times = np.linspace(0.0, 0.5, 101)
    exact = integrate(model, start, times, "tsit5", 1e-10, 1e-13).states
    rtol = 1e-7 if method in ("scipy_bdf", "scipy_lsoda") else 1e-6  # multistep methods: 1.7e-7 m at 1e-6
    run = integrate(model, start, times, method, rtol, 1e-3 * rtol)
    assert run.status == "completed" and run.method == method
    assert np.ptp(exact[:, 1]) > 2e-3
    assert np.abs(run.states[:, 1] - exact[:, 1]).max() < 1e-7


def test_cvode_agrees(wheelset):
    pytest.importorskip("sksundae")
    model, start = wheelset
    times = np.linspace(0.0, 0.5, 101)
    exact, run = (integrate(model, start, times, method, 1e-6, 1e-9) for method in ("tsit5", "cvode"))
    assert run.status == "completed"
    np.testing.assert_allclose(run.states[:, 1], exact.states[:, 1], atol=1e-7)
    high = compile_scene(load_scene(SCENES / "wheelset.yaml", LEAVES))
    run = integrate(*high, times, "cvode", 1e-5, 1e-8, derailed_y=0.05)
    assert run.status == "derailed" and run.t[-1] < 0.5


def test_cvode_without_its_package_says_how_to_get_it(wheelset, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "sksundae.cvode", None)
    with pytest.raises(InputError, match=r"wrcore\[sundials\]"):
        integrate(*wheelset, [0.0, 0.1], "cvode")


def test_stiff_scenes_cost_rosenbrock_methods_little():
    """At 1 m/s creep damps at some 1e5/s: explicit steps are bound to 6e-5 s, Rosenbrock steps by the motion."""
    model, start = compile_scene(load_scene(WHEELSET, ["speed=1"]))
    times = np.linspace(0.0, 2.0, 101)
    exact = integrate(model, start, times, "scipy_radau", 1e-10, 1e-13).states[:, 1]
    runs = {method: integrate(model, start, times, method, 1e-5) for method in ("tsit5", "rodas4", "ros34pw2")}
    for run in runs.values():
        assert np.abs(run.states[:, 1] - exact).max() < 3e-7
    assert runs["tsit5"].rhs_evaluations > 30 * max(runs[name].rhs_evaluations for name in ("rodas4", "ros34pw2"))
    assert runs["tsit5"].smallest_step < 1e-4 < runs["rodas4"].t[-1] / runs["rodas4"].steps


KEPT = [
    "speed=45", "drive.controller.speed=45", "contact.friction=0.3",
    "track.irregularity={spectrum: {level: low, seed: 1, length: 100, begin: 20}}",
]  # fmt: skip


def test_auto_sees_a_stiff_damper(contact):  # noqa: F811
    """A rate of 16667/s, whatever the speed: what a Maxwell element with a relaxation time of 60 us has."""
    model, start = oscillators(contact, 60.0)
    equations = Equations(model)
    counters = equations.work.counters.copy()
    assert fastest_rate(model, equations, 0.0, start) == pytest.approx(np.sqrt(1e4 / 10.0), rel=0.1)
    np.testing.assert_array_equal(equations.work.counters, counters)
    damped = model._replace(elements=model.elements._replace(springs=model.elements.springs.copy()))
    damped.elements.springs[:, 9:12] = 16667.0 * 10.0  # N s/m, on 10 kg
    assert fastest_rate(damped, Equations(damped), 0.0, start) == pytest.approx(
        16667.0 * 2.5, rel=0.1
    )  # the one of 4 kg
    assert integrate(damped, start, [0.0, 1e-3]).method == "rodas5"


@pytest.mark.parametrize("method", METHODS)
def test_counters(wheelset, method):
    run = integrate(*wheelset, np.linspace(0.0, 0.5, 11), method, 1e-5, 1e-8)
    attempts = run.steps + run.rejected
    if method in EXPLICIT:
        stages = len(EXPLICIT[method].nodes) - 1
        assert run.rhs_evaluations == 1 + stages * attempts
        assert (run.jacobians, run.factorisations) == (0, 0)
    else:
        later = len(ROSENBROCK[method].nodes) - 1
        full, contact = 14, 1  # at the state, 12 columns, along the drift; along the drift
        assert run.rejected == 0  # so that each step was looked at once, and has the rate at its end
        looks = run.steps if ROSENBROCK[method].looked_at else 0
        refreshed = full + (run.jacobians - 1) * contact + (run.jacobians - 1) // 20 * (full - contact)
        assert run.rhs_evaluations == later * attempts + run.steps + looks + 1 + refreshed
        assert run.jacobians <= run.steps and run.factorisations <= attempts
    assert 0.0 < run.smallest_step < 0.5 / run.steps
    assert run.out_of_range == 0 and run.wall_s > 0.0


@pytest.mark.parametrize("method", ["tsit5", "ros34pw2"])
@pytest.mark.parametrize("scene", ["wheelset", "curve"])
def test_repeats_chunks_and_output_times_do_not_change_a_bit(request, scene, method):
    model, start = request.getfixturevalue(scene)
    times = np.arange(41) / 40
    run = integrate(model, start, times, method)
    overrides = ["speed=20", *([CURVE] if scene == "curve" else [])]
    for again in (
        integrate(model, start, times, method),
        integrate(model, start, times, method, chunk=1),
        integrate(*compile_scene(load_scene(WHEELSET, overrides)), times, method),
    ):
        np.testing.assert_array_equal(again.states, run.states)
    fine = integrate(model, start, np.arange(401) / 400, method)
    np.testing.assert_array_equal(fine.states[::10], run.states)
    assert fine.rhs_evaluations == run.rhs_evaluations


@pytest.mark.parametrize("method", ["rk45", "rodas4", "ros34pw2"])
@pytest.mark.parametrize("scene", ["wheelset", "curve"])
def test_a_run_taken_up_again_goes_on_bit_by_bit(request, scene, method):
    model, start = request.getfixturevalue(scene)
    times = np.arange(101) / 100
    whole = integrate(model, start, times, method)
    first = integrate(model, start, times[:42], method)
    stored = pickle.loads(pickle.dumps(first.end))
    second = integrate(model, stored, times[41:], method)
    np.testing.assert_array_equal(np.vstack([first.states, second.states[1:]]), whole.states)
    assert first.steps + second.steps == whole.steps
    assert first.rhs_evaluations + second.rhs_evaluations == whole.rhs_evaluations
    np.testing.assert_array_equal(integrate(model, stored, times[41:], method).states, second.states)  # not used up


def test_fixed_steps_go_on_with_another_length(contact):  # noqa: F811
    model, start = oscillators(contact, 3.0)
    first = integrate(model, start, [0.0, 0.1], "rk4", step=0.001)
    second = integrate(model, first.end, [0.1, 0.2], "rk4", step=0.0005)
    assert second.steps == 200 and second.smallest_step == 0.0005
    np.testing.assert_allclose(second.states[-1].reshape(2, 13)[:, :3], oscillation(0.2, 3.0), atol=1e-9)


def test_the_tolerance_does_not_loosen_along_the_track(contact):  # noqa: F811
    """After 8 km a spring needs its bodies' positions as accurately as at the start."""
    model, start = oscillators(contact, 20.0)
    there = 8000.0
    later = start.copy()
    later[[0, 13]] += there
    times = np.linspace(0.0, 0.5, 51)
    runs = [integrate(model, y, times + t0, "rk45", 1e-5, 1e-9) for y, t0 in ((start, 0.0), (later, there / 20.0))]
    assert abs(runs[0].steps - runs[1].steps) <= 0.03 * runs[0].steps
    for run, t0 in zip(runs, (0.0, there / 20.0), strict=True):
        exact = np.array([oscillation(t, 20.0) for t in times])
        found = run.states.reshape(len(times), 2, 13)[:, :, :3] - [20.0 * t0, 0.0, 0.0]
        assert np.abs(found - exact).max() < 1e-5


def test_a_step_is_as_good_as_its_worst_body():
    """The norm of known errors of two bodies and an own state; no infinity slips through."""
    tolerances, rate = np.linspace(1.0, 2.0, 27), 4.0
    places = np.arange(27) % 13 < 7
    split = np.array([tolerances * places, tolerances / rate * ~places])  # what counts at any speed, and per 1/s
    new, errors = np.ones(27), np.zeros(27)
    errors[[0, 4, 20]] = 2e-3, 3e-3, 5e-3
    first, second = (errors[:13] / tolerances[:13]), (errors[13:26] / tolerances[13:26])
    expected = max(math.sqrt(sum(part**2) / 13) for part in (first, second))
    assert engine.error_size(split, rate, 2, new, errors) == pytest.approx(expected, rel=1e-14)
    errors[26] = 0.01
    assert engine.error_size(split, rate, 2, new, errors) == pytest.approx(0.01 / 2.0, rel=1e-14)
    for place in (3, 17, 26):
        for number in (math.inf, math.nan):
            spoiled = new.copy()
            spoiled[place] = number
            assert not math.isfinite(engine.error_size(split, rate, 2, spoiled, errors))


LEAVES = ["initial.yaw=0.09", "contact.friction=0.9", "speed=10", "integration.duration=0.5"]
"""The free wheelset climbs the rail."""


@pytest.mark.parametrize("method", ["rk45", "ros34pw2", "scipy_rk45"])
def test_a_wheelset_off_the_rails_ends_the_run(method):
    model, start = compile_scene(load_scene(SCENES / "wheelset.yaml", LEAVES))
    times = np.arange(101) / 200
    run = integrate(model, start, times, method, 1e-5, 1e-8, derailed_y=0.05)
    assert run.status == "derailed" and "mm off the track's centre" in run.reason
    free = integrate(model, start, times, method, 1e-5, 1e-8)
    np.testing.assert_array_equal(run.states, free.states[: len(run.t)])
    off = np.flatnonzero(np.abs(free.states[:, 1]) > 0.05)[0]
    assert len(run.t) in (off, off + 1) or method == "scipy_rk45"  # which looks at the ends of its steps only


def test_derailment_counts_from_the_track_in_a_curve(curve):
    """500 m round a 600 m curve the wheelset is 160 m off the straight line, and on the rails."""
    run = integrate(*curve, np.arange(6.0) * 5, derailed_y=0.05)
    assert run.status == "completed" and abs(run.states[-1, 1]) > 100.0


@pytest.mark.parametrize("method", ["tsit5", "ros34pw2"])
def test_failures_are_values(wheelset, contact, method):  # noqa: F811
    model, start = wheelset
    broken = model._replace(gravity=math.nan)
    for step in (0.0, 1e-4):
        run = integrate(broken, start, [0.0, 1.0], method, step=step)
        assert run.status == "failed" and "not finite at t = 0 s" in run.reason
        assert len(run.t) == 1 and run.steps == 0
    run = integrate(model, start, [0.0, 1.0], method, 1e-30)
    assert run.status == "failed" and "resolution of time" in run.reason and run.steps < 10
    # a step beyond the bound of stability blows up: no state that is not finite is ever accepted
    free, state = oscillators(contact, 0.0)
    stiff = free._replace(bodies=free.bodies._replace(mass=np.array([1e-200, 1e-200])))
    run = integrate(stiff, state, np.linspace(0.0, 1.0, 101), "tsit5", step=0.01)
    assert run.status == "failed" and "state is not finite" in run.reason
    assert np.isfinite(run.states).all() and np.isfinite(run.end.memory.state).all()


@pytest.mark.parametrize("method", ["tsit5", "ros34pw2", "scipy_rk45"])
def test_a_run_that_is_told_to_stop_keeps_what_was_reached(wheelset, method):
    model, start = wheelset
    times = np.linspace(0.0, 1.0, 201)
    asked = []

    def stop():
        asked.append(1)
        return "enough" if len(asked) == 5 else ""

    run = integrate(model, start, times, method, chunk=10, stop=stop)
    assert (run.status, run.reason) == ("stalled", "enough") and 0 < len(run.t) < 201
    whole = integrate(model, start, times, method)
    np.testing.assert_array_equal(run.states, whole.states[: len(run.t)])
    assert run.t[-1] <= run.end_t < 1.0 and np.isfinite(run.end_state).all()
    assert (whole.end_t, whole.status) == (1.0, "completed")
    np.testing.assert_array_equal(whole.end_state, whole.states[-1])
    if method != "scipy_rk45":
        rest = integrate(model, run.end, times[times > run.t[-1]])
        np.testing.assert_array_equal(rest.states, whole.states[len(run.t) :])


@pytest.mark.parametrize("method", ["tsit5", "ros34pw2", "scipy_rk45"])
def test_most_steps(wheelset, method):
    run = integrate(*wheelset, np.linspace(0.0, 10.0, 11), method, most_steps=37)
    assert run.status == "stalled" and "37 steps" in run.reason and "most_steps" in run.reason
    assert run.steps + (run.rejected if method != "scipy_rk45" else 0) == 37
    if method != "scipy_rk45":  # steps before a checkpoint count
        more = integrate(wheelset[0], run.end, np.linspace(1.0, 10.0, 10), most_steps=50)
        assert more.steps + more.rejected == 13


def test_no_headway_is_a_stall(wheelset, monkeypatch):
    """Steps as short as they would be below `STALL_STEP`: the bound is set above what this run needs."""
    monkeypatch.setattr("wrcore.integrate.integrator.STALL_ATTEMPTS", 50)
    calm = integrate(*wheelset, np.linspace(0.0, 1.0, 11), "tsit5")
    assert calm.status == "completed"
    monkeypatch.setattr("wrcore.integrate.integrator.STALL_STEP", 1.0)
    run = integrate(*wheelset, np.linspace(0.0, 1.0, 11), "tsit5")
    assert run.status == "stalled" and "50 steps brought it" in run.reason and run.steps + run.rejected == 50
    assert np.isfinite(run.end_state).all()
    fixed = integrate(*wheelset, np.linspace(0.0, 0.1, 11), "tsit5", step=1e-4)  # as short as they were asked for
    assert fixed.status == "completed" and fixed.steps > 50


def test_collapses_are_rejections_three_in_a_row(wheelset):
    """A calm run rejects nothing; an attempt of 100 s is shortened fivefold at most: seven times to reach 2 ms."""
    calm = integrate(*wheelset, [0.0, 0.5], "tsit5")
    assert (calm.rejected, calm.collapses) == (0, 0)
    for attempt, least, collapses in ((4e-3, 1, 0), (100.0, 7, 1)):
        end = pickle.loads(pickle.dumps(calm.end))
        end.memory.clock[engine.NEXT] = attempt
        run = integrate(wheelset[0], end, [0.5, 1.0], "tsit5")
        assert run.rejected >= least and run.collapses == collapses


def test_an_error_in_a_reference_is_a_failed_run(monkeypatch):
    def broken(t, y):
        return np.array([np.nan if t > 0.5 else 1.0])

    for method in ("scipy_radau", "scipy_bdf", "scipy_rk45", "scipy_lsoda"):
        run = integrate_function(broken, [0.0], np.linspace(0.0, 1.0, 11), method)
        assert run.status == "failed" and run.reason and np.isfinite(run.states).all(), method
        assert run.end_t <= 0.5 and np.isfinite(run.end_state).all()
    run = integrate_function(lambda t, y: np.array([np.nan]), [0.0], [0.0, 1.0], "scipy_radau")
    assert run.status == "failed" and len(run.t) == 1


def test_any_function_can_be_integrated_by_the_references():
    times = np.linspace(0, 3, 7)
    run = integrate_function(lambda t, y: np.array([y[1], -y[0]]), [0.0, 1.0], times, "scipy_radau", 1e-9)
    np.testing.assert_allclose(run.states[:, 0], np.sin(run.t), atol=1e-7)
    assert run.rhs_evaluations > run.steps > 0 and run.jacobians > 0 and run.factorisations > 0
    stopped = integrate_function(
        lambda t, y: np.ones(1), [0.0], times, stop=lambda t, y: "enough" if y[0] > 1.1 else ""
    )
    assert (stopped.status, stopped.reason) == ("derailed", "enough") and stopped.t[-1] < 3.0


def same(run, other):
    """Whether two runs' channels agree to the bit."""
    return run.groups.keys() == other.groups.keys() and all(
        np.array_equal(channel, other.groups[group][name], equal_nan=True)
        for group, channels in run.groups.items()
        for name, channel in channels.items()
    )


def test_many_runs_are_the_single_ones():
    scenes = [load_scene(WHEELSET, [f"speed={v}", "integration.duration=0.5"]) for v in (5, 20, 80)]
    single = [simulate(scene) for scene in scenes]
    seen = []
    many = simulate_many(scenes, progress=lambda items: (seen.append(item) or item for item in items))
    assert seen == scenes
    for runs in (many, simulate_many(scenes, threads=2)):
        assert [run.settings["method_used"] for run in runs] == ["rodas5", "rodas5", "rodas5, rk4"]
        assert all(map(same, runs, single))
    assert not same(single[0], single[1])


def test_a_scene_goes_on_where_its_run_ended():
    whole = simulate(load_scene(WHEELSET, ["integration.duration=1.0"]))
    half = load_scene(WHEELSET, ["integration.duration=0.5"])
    first = simulate(half)
    second = simulate(half, start=first.end)
    assert second.t[0] == 0.5 and second.t[-1] == 1.0 and second.counters["simulated_s"] == 0.5
    for group, channels in whole.groups.items():
        for name, channel in channels.items():
            halves = np.concatenate([first.groups[group][name], second.groups[group][name][1:]])
            np.testing.assert_array_equal(halves, channel, err_msg=f"{group} {name}")
    model, state = compile_scene(half)
    state[1] += 1e-3
    assert simulate(half, start=state)["wheelset"].y_m[0] == state[1]


def test_output_times():
    np.testing.assert_array_equal(output_times(0.0, 10.0, 200.0), np.arange(2001) / 200)
    np.testing.assert_array_equal(output_times(5.0, 5.0, 200.0), np.arange(1000, 2001) / 200)
    np.testing.assert_array_equal(output_times(0.0, 0.0123, 200.0), [0.0, 0.005, 0.01, 0.0123])
    np.testing.assert_array_equal(output_times(0.0123, 0.01, 200.0), [0.0123, 0.015, 0.02, 0.0123 + 0.01])
    np.testing.assert_array_equal(output_times(0.0, 0.001, 200.0), [0.0, 0.001])
