"""Motors, brakes and the speed controller against closed solutions, and their energy."""

import math

import numpy as np
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC, SCENES
from tests.energy_balance import energy_balance
from tests.equations.test_equations_of_motion import body_state, contact, make_model, run  # noqa: F401 (contact is a fixture)
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.many_models import with_kernels_of
from wrcore.equations.model import state_size
from wrcore.errors import InputError
from wrcore.errors.checked_yaml import read_yaml
from wrcore.forces.drive import BRAKE, GRIP, MOTOR, TIME, no_drive, undriven
from wrcore.scene.compile import compile_scene
from wrcore.track.schedule import pack_schedules, scheduled

LOCOMOTIVE = SCENES / "locomotive.yaml"
MASS, TRAIN, SPIN, RADIUS, GRAVITY = 84e3, 300e3, 400.0, 0.55, 9.81
"""Of config/vehicles/locomotive.yaml: kg, kg, kg m^2 in pitch of each wheelset, m; and m/s^2."""

INERT = MASS + TRAIN + 4 * SPIN / RADIUS**2
"""Mass that rolling accelerates, kg."""


def test_tables_are_linear_between_their_points_and_constant_beyond():
    tables = [np.array([[0.0, 3.0]]), np.array([[-1.0, 2.0], [0.5, -1.0], [0.6, 4.0], [7.0, 5.0]])]
    packed, x = pack_schedules(tables), np.linspace(-2.0, 8.0, 301)
    for k, table in enumerate(tables):
        found = [scheduled(packed, k, float(value)) for value in x]
        np.testing.assert_allclose(found, np.interp(x, *table.T), rtol=1e-14)


def turning(contact, kind, table):  # noqa: F811
    """One or two free bodies; the first turns about its y axis, and an actuator acts on it."""
    model = make_model(contact, [50.0, 80.0], [[30.0, 20.0, 30.0], [40.0, 60.0, 50.0]], gravity=0.0)
    rows = np.array([[0, 1, 0, kind, 0, TIME, 0]])
    return model._replace(drive=no_drive()._replace(rows=rows, lever=np.ones(1), tables=pack_schedules([table])))


def test_what_is_planned_for_equations_is_found_once_and_anew_for_another_drive(contact):  # noqa: F811
    model, seen = turning(contact, MOTOR, np.array([[0.0, 1.0]])), []

    def plan(model):
        seen.append(tuple(model.drive.rows[0]))
        return len(seen)

    equations = Equations(model)
    assert equations.planned(plan) == equations.planned(plan) == 1
    other = model._replace(drive=model.drive._replace(rows=np.array([[1, 0, 0, MOTOR, 0, TIME, 0]])))
    equations.turn_to(with_kernels_of(other, equations.arguments[1].value))
    assert equations.planned(plan) == 2 and seen[0] != seen[1]


def test_a_brake_stops_two_bodies_like_the_closed_solution(contact):  # noqa: F811
    # omega' = -(M/J) tanh(omega/g), J = J1 J2/(J1 + J2): sinh(omega/g) = sinh(omega0/g) exp(-M t/(J g))
    torque, inertia, start = 40.0, 20.0 * 60.0 / 80.0, 2.0
    model = turning(contact, BRAKE, np.array([[0.0, torque]]))
    result = run(model, np.concatenate([body_state(omega=(0, start, 0)), body_state()]), 0.9)
    exact = GRIP * np.arcsinh(math.sinh(start / GRIP) * np.exp(-torque / (inertia * GRIP) * result.t))
    relative = result.states[:, 11] - result.states[:, 24]
    np.testing.assert_allclose(relative, exact, atol=1e-7)
    assert abs(relative[-1]) < 1e-3 < relative[150] < 0.6  # it stopped, and only just
    momentum = 20.0 * result.states[:, 11] + 60.0 * result.states[:, 24]
    np.testing.assert_allclose(momentum, 20.0 * start, rtol=1e-9)


def test_a_motor_follows_its_table_and_turns_bodies_apart(contact):  # noqa: F811
    table = np.array([[0.1, 0.0], [0.3, 12.0], [0.6, -4.0]])
    result = run(turning(contact, MOTOR, table), np.concatenate([body_state(), body_state()]), 0.6)
    impulse = 0.5 * 0.2 * 12.0 + 0.5 * 0.3 * (12.0 - 4.0)
    assert result.states[-1, 11] == pytest.approx(impulse / 20.0, rel=1e-6)
    assert result.states[-1, 24] == pytest.approx(-impulse / 60.0, rel=1e-6)


def driven(changes, drive):
    """A run of the locomotive with another drive than its scene's."""
    content = read_yaml(LOCOMOTIVE)
    content["contact"]["friction"] = 0.4
    content["vehicle"]["parameters"] = str(ELLIPTIC.parent / "vehicles" / "locomotive.yaml")
    return wr.simulate(wr.load_scene({**content, "drive": drive}, changes))


@pytest.mark.parametrize("over", ["number", "arc_length"])
def test_a_torque_against_the_frame_pushes_the_vehicle_ahead(over):
    torque, table = 2000.0, {"arc_length": [0.0, 500.0], "torque": [2000.0, 2000.0]}
    motor = {"name": "m", "bodies": ["wheelset_1", "frame"], "torque": torque if over == "number" else table}
    found = driven({"speed": 10, "integration.duration": 8.0}, {"motors": [motor]})
    speeds = found["train"]["vx_m_per_s"]
    # the least squares line over what swings in the coupler: force over mass, less some drag of spin creepage
    assert np.polyfit(found.t, speeds, 1)[0] == pytest.approx(torque / RADIUS / INERT, rel=0.02)
    np.testing.assert_allclose(found["drive/m"]["torque_Nm"], torque, rtol=1e-12)


def test_a_table_over_arc_length_counts_at_the_wheelset():
    profile = {"arc_length": [-10.0, 0.0, 30.0], "torque": [0.0, 100.0, 700.0]}
    motors = [
        {"name": "front", "bodies": ["wheelset_1", "bogie_1"], "torque": profile},
        {"name": "rear", "bodies": ["wheelset_4", "bogie_2"], "torque": profile},
    ]
    found = driven({"speed": 10, "integration.duration": 1.0}, {"motors": motors})
    for name, wheelset in (("front", 1), ("rear", 4)):
        expected = np.interp(found[f"wheelset_{wheelset}"]["x_m"], *profile.values())
        np.testing.assert_allclose(found[f"drive/{name}"]["torque_Nm"], expected, rtol=1e-9)


def test_tables_over_arc_length_in_a_curve(contact):  # noqa: F811
    brake = {"name": "b", "bodies": ["wheelset_2", "bogie_1"], "torque": {"arc_length": [0, 100], "torque": [0, 1000]}}
    curve = [{"transition": 15}, {"curve": 100, "radius": 500, "cant": 0.05}]
    found = wr.simulate(
        wr.load_scene(
            ELLIPTIC / "trailer_vehicle.yaml",
            {"speed": 15, "track.path": curve, "drive": {"brakes": [brake]}, "integration.duration": 1.0},
        )
    )
    np.testing.assert_allclose(found["drive/b"]["torque_Nm"], -10.0 * found["wheelset_2"]["s_m"], rtol=1e-6)


def test_the_controller_settles_like_the_linear_loop():
    # m e'' + Kp e' + Ki e = 0 with e(0) = 1 m/s, and the integral zero at the start
    proportional, integral = 4e4, 6e3
    control = {"body": "car_body", "speed": 11.0, "proportional": proportional, "integral": integral, "limit": 1e6}
    motors = [{"name": f"m{k}", "bodies": [f"wheelset_{k}", "frame"]} for k in (1, 2, 3, 4)]
    found = driven({"speed": 10, "integration.duration": 40.0}, {"motors": motors, "controller": control})
    t, m = found.t, INERT
    decay, omega = proportional / (2 * m), np.sqrt(complex(integral / m - (proportional / (2 * m)) ** 2))
    error = np.real(np.exp(-decay * t) * (np.cos(omega * t) - decay / omega * np.sin(omega * t)))
    # momentum does not see the coupler's swing
    speed = (84 * found["car_body"]["vx_m_per_s"] + 300 * found["train"]["vx_m_per_s"]) / 384
    np.testing.assert_allclose(11.0 - speed, error, atol=0.005)
    assert error.min() < -0.1  # it overshoots: the integral acts


def test_a_limit_holds_and_nothing_winds_up():
    control = {"body": "train", "speed": 14.0, "proportional": 4e5, "integral": 6e4, "limit": 1e5}
    motors = [{"name": f"m{k}", "bodies": [f"wheelset_{k}", "frame"]} for k in (1, 2, 3, 4)]
    found = driven({"speed": 10, "integration.duration": 30.0}, {"motors": motors, "controller": control})
    force, speed = found["drive/controller"]["force_N"], found["train"]["vx_m_per_s"]
    assert force.max() == 1e5 and np.mean(force == 1e5) > 0.4
    # at worst all of the limit's force is the integral's when the error comes to nothing: m e'' + Kp e' + Ki e = 0 with
    # e = 0 and e' = -F/m. Wound up over 15 s, it would overshoot by metres a second.
    decay, t = 4e5 / (2 * INERT), np.linspace(0.0, 20.0, 2001)
    omega = np.sqrt(complex(6e4 / INERT - decay**2))
    worst = np.max(np.real(1e5 / INERT / omega * np.exp(-decay * t) * np.sin(omega * t)))
    assert 0.5 * worst < speed.max() - 14.0 < worst < 0.25
    assert speed[-1] == pytest.approx(14.0, abs=0.03)


def test_wheels_lock_slide_to_standstill_and_start_again():
    """From 40 m/s on mu = 0.05: sliding at mu g until the train stands, off again with wheels that spin."""
    channels = {"output.channels": ["pose", "velocity", "energy"]}
    found = wr.simulate(wr.load_scene(SCENES / "wheel_slide.yaml", channels))
    assert found.status == "completed"
    speed, t = found["train"]["vx_m_per_s"], found.t
    rims = RADIUS * np.array([found[f"wheelset_{k}"]["wy_rad_per_s"] for k in (1, 2, 3, 4)])
    sliding = (t > 10.0) & (t < 360.0)
    assert np.abs(rims[:, sliding]).max() < 0.02  # locked, but for what a brake of 0.05 rad/s of grip creeps
    deceleration = -np.polyfit(t[sliding], speed[sliding], 1)[0]
    assert deceleration == pytest.approx(0.05 * MASS * GRAVITY / (MASS + TRAIN), rel=2e-3)
    at_rest = (t > 376.7) & (t < 377.0)
    assert np.abs(speed[at_rest]).max() < 3e-3
    pulled = (t > 381.0) & (t < 388.0)
    assert rims[:, pulled].min() > 10.0 * speed[pulled].max()  # they spin
    assert np.polyfit(t[pulled], speed[pulled], 1)[0] == pytest.approx(deceleration, rel=0.01)
    balance = energy_balance(found["energy"], t)
    assert np.abs(balance.imbalance).max() < 1e-4 * balance.turned_over[-1]


def test_the_locomotive_spins_on_leaves_catches_and_slides():
    changes = {"output.rate": 1000.0, "output.channels": ["pose", "velocity", "energy"]}
    found = wr.simulate(wr.load_scene(LOCOMOTIVE, changes))
    assert found.status == "completed"
    t, speed = found.t, found["car_body"]["vx_m_per_s"]
    rims = RADIUS * np.array([found[f"wheelset_{k}"]["wy_rad_per_s"] for k in (1, 2, 3, 4)])
    before = (t > 2.0) & (found["wheelset_1"]["x_m"] < 19.0)
    assert np.abs(rims[:, before] - speed[before]).max() < 0.05
    assert (rims[0] - speed).max() > 10.0  # on the leaves
    caught = (t > 16.5) & (t < 17.0)
    assert np.abs(rims[3, caught] - speed[caught]).max() < 0.2  # the last wheelset rolls again
    assert np.abs(rims[:, t > 28.0]).max() < 0.02 < 5.0 < speed[-1]  # locked at the end
    brake = found["drive/brake_1"]
    np.testing.assert_allclose(
        brake["power_W"],
        brake["torque_Nm"] * _relative(found),
        rtol=1e-6, atol=1.0,
    )  # fmt: skip
    balance = energy_balance(found["energy"], t)
    assert np.abs(balance.imbalance).max() < 1e-4 * balance.turned_over[-1]
    assert found["energy"]["dissipated_by_brakes_W"].min() >= 0.0
    assert found["energy"]["input_by_motors_W"].max() > 1e6


def _relative(found):
    return found["wheelset_1"]["wy_rad_per_s"] - found["bogie_1"]["wy_rad_per_s"]


def test_a_run_begins_in_the_steady_state_of_the_undriven_vehicle():
    model, state = compile_scene(wr.load_scene(LOCOMOTIVE, speed=10))
    assert len(state) == state_size(model) and state[-1] == 0.0
    rates = Equations(undriven(model))(0.0, state[:-1])
    n = len(model.bodies.mass)
    accelerations = rates[: 13 * n].reshape(n, 13)[:, 7:]
    assert np.abs(accelerations).max() < 1e-3


def test_a_train_of_driven_vehicles_names_them_one_by_one():
    brake = {"name": "b", "bodies": ["vehicle_2_wheelset_1", "vehicle_2_bogie_1"], "torque": 1000.0}
    changes = {"vehicle.count": 2, "vehicle.spacing": 27.0, "drive": {"brakes": [brake]}, "integration.duration": 0.5}
    found = wr.simulate(wr.load_scene(ELLIPTIC / "trailer_vehicle.yaml", changes))
    np.testing.assert_allclose(found["drive/b"]["torque_Nm"], -1000.0, rtol=1e-9)
    first, second = (found[f"vehicle_{k}_wheelset_1"]["wy_rad_per_s"] for k in (1, 2))
    assert second[-1] < first[-1]


BAD = [
    ({"drive.motors": [{"name": "m", "bodies": ["bogie_1", "wheelset_1"]}]}, "drive.motors.m.bodies", "wheelset_1"),
    ({"drive.motors": [{"name": "m", "bodies": ["wheelset_1", "cab"]}]}, "drive.motors.m.bodies", "car_body"),
    ({"drive.motors": [{"name": "m", "bodies": ["wheelset_1", "wheelset_2"]}]}, "drive.motors.m.bodies", "a body"),
    ({"drive.brakes": [{"name": "b", "bodies": ["wheelset_1", "bogie_1"]}]}, "drive.brakes.b", "torque or force"),
    ({"drive.brakes": [{"name": "b", "bodies": ["wheelset_1", "bogie_1"], "force": -1.0}]}, "drive.brakes.b.force",
     "negative"),
    ({"drive.brakes": [{"name": "b", "bodies": ["wheelset_1", "bogie_1"],
                        "force": {"time": [0, 0], "force": [1, 2]}}]}, "drive.brakes.b.force.time", "rising"),
    ({"drive.brakes": [{"name": "b", "bodies": ["wheelset_1", "bogie_1"],
                        "force": {"time": [0, 1], "torque": [1, 2]}}]}, "drive.brakes.b.force", "time or arc_length"),
    ({"drive.brakes": [{"name": "motor_1", "bodies": ["wheelset_1", "bogie_1"], "force": 1.0}]},
     "drive.brakes.motor_1", "as drive.motors.motor_1 is a motor"),
    ({"drive.brakes": [{"name": "controller", "bodies": ["wheelset_1", "bogie_1"], "force": 1.0}]},
     "drive.brakes.controller", "drive.controller"),
    ({"drive.motors": []}, "drive.controller", "controller"),
    ({"drive.controller.body": "cab"}, "drive.controller.body", "car_body"),
    ({"drive.controller.gain": 1.0}, "drive.controller.gain", "unknown key"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "field", "expected"), BAD, ids=[row[1] + " " + row[2] for row in BAD])
def test_bad_drives_are_named(changes, field, expected):
    with pytest.raises(InputError) as caught:
        wr.load_scene(LOCOMOTIVE, changes)
    assert caught.value.field == field and expected in caught.value.expected
