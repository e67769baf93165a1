"""Control laws of the user's own: what they measure, when, what they hold, and motors of single wheels."""

import numpy as np
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC, SCENES
from tests.energy_balance import energy_balance
from wrcore.errors import InputError
from wrcore.errors.checked_yaml import read_yaml
from wrcore.run.checkpoints import model_fingerprint
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import static_equilibrium
from wrcore.vehicle.description import GRAVITY

GUIDED = SCENES / "guided_car.yaml"
LAWS = "tests/forces/own_control.py:"
MOTORS = read_yaml(GUIDED)["drive"]["motors"]
STEERING = {
    "law": f"{LAWS}steer", "outputs": ["left_1", "right_1"], "states": [0.001], "parameters": [2e5, 1e5, 5e4, 300.0],
    "inputs": ["wheelset_1.y_m", "wheelset_1.yaw_rad", "wheelset_1.rolling_rate_left_rad_per_s",
               "wheelset_1.rolling_rate_right_rad_per_s"],
}  # fmt: skip


def car(control, changes=(), drive=None):
    """The guided car with other control laws."""
    data = read_yaml(GUIDED)
    data["vehicle"]["parameters"] = str(ELLIPTIC.parent / "vehicles" / "guided_car.yaml")
    data["control"] = control
    used = {name for law in control.values() for name in law["outputs"]}
    motors = [item for item in data["drive"]["motors"] if item["name"] in used]
    data["drive"] = drive or {"motors": motors}
    return wr.load_scene({**data, "integration": {"duration": 1.0}}, dict(changes))


def run(*arguments, **more):
    return wr.simulate(car(*arguments, **more), progress=False)


def test_the_guided_car_stands_on_its_masses():
    scene = wr.load_scene(GUIDED)
    loads = static_equilibrium(scene, compile_scene(scene)[0]).wheel_loads
    np.testing.assert_allclose(loads, (18600 + 2 * 1813) * GRAVITY / 4, rtol=1e-6)


def test_guided_wheels_follow_the_curve_and_others_run_on_the_flange():
    guided, free = wr.simulate(GUIDED, progress=False), run({}, {"integration.duration": 10.0})
    for wheelset in ("wheelset_1", "wheelset_2"):
        aside = [np.sqrt(np.mean(one[wheelset].y_m ** 2)) for one in (guided, free)]
        assert aside[0] < 0.05 * aside[1] and aside[1] > 5e-3
    torque = guided["control/front"].left_1_Nm
    np.testing.assert_array_equal(torque, guided["drive/left_1"].torque_Nm)
    np.testing.assert_array_equal(torque, -guided["drive/right_1"].torque_Nm)
    assert np.abs(torque).max() < 3000.0 and np.abs(np.diff(torque)).max() < 200.0 + 1e-9


@pytest.mark.parametrize("method", ["rodas4", "ros34pw2"])
def test_a_law_in_the_equations_gives_the_same_motion_by_every_method(method):
    changes = {"initial.y": 0.001, "integration.rtol": 1e-6, "output.channels": ["pose", "velocity"]}
    one, other = (run({"front": STEERING}, {**changes, "integration.method": name}) for name in ("tsit5", method))
    for wheelset, name in (("wheelset_1", "y_m"), ("wheelset_1", "rolling_rate_left_rad_per_s"), ("wheelset_2", "y_m")):
        np.testing.assert_allclose(other[wheelset][name], one[wheelset][name], rtol=0, atol=2e-5, err_msg=name)
    np.testing.assert_allclose(other["control/front"].state_0, one["control/front"].state_0, rtol=0, atol=1e-6)
    assert np.ptp(one["control/front"].left_1_Nm) > 100.0


@pytest.mark.parametrize("sampled", [{}, {"rate": 100}], ids=str)
def test_python_gives_the_motion_of_what_is_compiled(sampled):
    changes = {"initial.y": 0.001, "integration.duration": 0.3, "integration.method": "rodas4"}
    name = "sampled_steer" if sampled else "steer"
    laws = (LAWS + name, f"{LAWS}plain_{name}")
    one, other = (run({"front": {**STEERING, **sampled, "law": law}}, changes) for law in laws)
    np.testing.assert_allclose(other["wheelset_1"].y_m, one["wheelset_1"].y_m, rtol=0, atol=1e-12)
    assert np.ptp(one["control/front"].left_1_Nm) > 10.0


@pytest.mark.parametrize("method", ["tsit5", "rodas4"])
def test_samples_are_taken_on_time_and_held(method):
    counting = {"law": f"{LAWS}count", "rate": 40, "inputs": [], "outputs": ["left_1"], "states": [0.0, 0.0]}
    changes = {"integration.method": method, "output.rate": 1000, "integration.duration": 0.5}
    found = run({"front": counting}, changes)
    control, between = found["control/front"], np.abs(found.t * 40 - np.round(found.t * 40)) > 1e-6
    expected = np.floor(found.t * 40)[between]
    assert len(expected) > 450  # at a sample's very instant either may show
    np.testing.assert_array_equal(control.left_1_Nm[between], expected + 1)
    np.testing.assert_allclose(control.state_1[between], expected / 40, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(control.left_1_Nm, found["drive/left_1"].torque_Nm)


def test_a_fixed_step_samples_at_its_own_times():
    counting = {"law": f"{LAWS}count", "rate": 40, "inputs": [], "outputs": ["left_1"], "states": [0.0, 0.0]}
    found = run({"front": counting}, {"integration.method": "tsit5", "integration.step": 1e-3, "output.rate": 1000,
                                      "integration.duration": 0.1})  # fmt: skip
    np.testing.assert_allclose(np.unique(found["control/front"].state_1), [0, 0.025, 0.05, 0.075, 0.1], atol=1e-9)


@pytest.mark.parametrize("method", ["tsit5", "rodas4"])
def test_a_run_goes_on_from_a_checkpoint_bit_by_bit(method):
    changes = {"initial.y": 0.001, "integration.method": method, "output.channels": ["pose"]}
    control = {"front": {**STEERING, "law": f"{LAWS}sampled_steer", "rate": 70}}
    whole = run(control, {**changes, "integration.duration": 0.5})
    half = run(control, {**changes, "integration.duration": 0.233})
    rest = wr.simulate(car(control, {**changes, "integration.duration": 0.5 - half.end.t}), start=half.end)
    shared = [t for t in rest.t if t in whole.t]
    assert len(shared) > 50
    for name in ("wheelset_1", "wheelset_2"):
        one, other = (r[name].y_m[np.isin(r.t, shared)] for r in (whole, rest))
        np.testing.assert_array_equal(one, other)
    one, other = (r["control/front"].left_1_Nm[np.isin(r.t, shared)] for r in (whole, rest))
    np.testing.assert_array_equal(one, other)


def test_inputs_are_the_channels_of_the_run():
    names = ["x_m", "s_m", "y_m", "z_m", "roll_rad", "yaw_rad", "vx_m_per_s", "vy_m_per_s", "vz_m_per_s",
             "wx_rad_per_s", "wy_rad_per_s", "wz_rad_per_s"]  # fmt: skip
    inputs = [f"{body}.{name}" for body in ("wheelset_2", "car_body") for name in names]
    inputs += ["car_body.pitch_rad", "wheelset_1.rolling_rate_left_rad_per_s"]
    watching = {"law": f"{LAWS}what_it_measures", "rate": 50, "inputs": inputs, "outputs": ["left_1"],
                "states": [0.0] * len(inputs)}  # fmt: skip
    path = [{"transition": 20, "shape": "bloss"}, {"curve": 100, "radius": 400, "cant": 0.05}]
    for track in ("tangent", path):
        found = run({"watch": watching}, {"track.path": track, "initial.y": 0.002, "output.rate": 100})
        for k, text in enumerate(inputs):
            body, _, channel = text.partition(".")
            known, kept = found[body]["x_m" if channel == "s_m" else channel], found["control/watch"][f"state_{k}"]
            # every second output is at a sample's instant, the next one shows it
            scale = np.ptp(known) + 1e-3
            np.testing.assert_allclose(kept[1::2], known[:-1:2], rtol=0, atol=1e-7 * scale, err_msg=text)


def test_an_actuator_is_held_between_two_bodies(tmp_path):
    data = read_yaml(ELLIPTIC.parent / "vehicles" / "guided_car.yaml")
    for k, (wheelset, x) in enumerate((("wheelset_1", 3.5), ("wheelset_2", -3.5))):
        data["elements"].append({"name": f"push_{k}", "kind": "actuator", "direction": "y", "at": [x, 0.0, 0.46],
                                 "bodies": ["car_body", wheelset]})  # fmt: skip
    (tmp_path / "pushed.yaml").write_text(repr(data))
    law = {"law": f"{LAWS}count", "rate": 100, "inputs": [], "outputs": ["push_1", "push_0"], "states": [0.0, 0.0]}
    changes = {"vehicle.parameters": str(tmp_path / "pushed.yaml"), "integration.duration": 0.5,
               "track.path": "tangent",
               "output.channels": ["pose", "velocity", "acceleration", "energy"], "output.rate": 4000,
               "integration.rtol": 1e-7}  # fmt: skip
    scene = wr.load_scene(car({}, {}), {**changes, "control": {"push": law}})
    found, still = (wr.simulate(wr.load_scene(scene, more), progress=False) for more in ({}, {"control.push.rate": 1}))
    assert found.status == "completed"
    np.testing.assert_array_equal(found["control/push"].push_0_N, found["control/push"].state_0)
    # both push the car body to the left with the number of the sample, springs and inertia give way
    assert found["car_body"].y_m[-1] > still["car_body"].y_m[-1] + 1e-7
    balance = energy_balance(found.groups["energy"], found.t)
    assert np.abs(balance.imbalance).max() < 1e-4 * balance.turned_over[-1]


def test_the_energy_of_controlled_wheels_adds_up():
    changes = {"initial.y": 0.002, "integration.rtol": 1e-9, "output.rate": 20000, "integration.duration": 0.2,
               "output.channels": ["pose", "velocity", "energy"]}  # fmt: skip
    found = run({"front": STEERING}, changes)
    energy = found["energy"]
    power = sum(found[f"drive/{name}"].power_W for name in ("left_1", "right_1"))
    np.testing.assert_allclose(energy.input_by_motors_W, power, rtol=1e-12, atol=1e-9)
    assert np.abs(power).max() > 10.0
    balance = energy_balance(found.groups["energy"], found.t)
    assert np.abs(balance.imbalance).max() < 1e-6 * balance.turned_over[-1]  # found: 1e-7


def test_a_torque_turns_its_own_wheel():
    motor = {"name": "m", "bodies": ["wheelset_1", "frame"], "torque": 200.0}
    changes = {"contact.friction": 1e-6, "track.path": "tangent", "integration.duration": 0.2}
    found = run({}, changes, drive={"motors": [{**motor, "wheel": "left"}]})
    left, right = (found["wheelset_1"][f"rolling_rate_{side}_rad_per_s"] for side in ("left", "right"))
    assert left[-1] - left[0] == pytest.approx(200.0 * 0.2 / 56.0, rel=1e-3)  # half of 112 kg m^2
    assert abs(right[-1] - right[0]) < 1e-3
    np.testing.assert_allclose(found["drive/m"].power_W, 200.0 * left, rtol=1e-9)


def test_a_brake_holds_its_own_wheel():
    brake = {"name": "b", "bodies": ["wheelset_1", "frame"], "torque": 5000.0, "wheel": "right"}
    changes = {"contact.friction": 0.01, "track.path": "tangent", "integration.duration": 3.0, "integration.rtol": 1e-5}
    for method in ("tsit5", "rodas4"):
        found = run({}, {**changes, "integration.method": method}, drive={"brakes": [brake]})
        left, right = (found["wheelset_1"][f"rolling_rate_{side}_rad_per_s"] for side in ("left", "right"))
        assert found.status == "completed" and abs(right[-1]) < 0.05 < 0.9 * left[0] < left[-1]


BAD = {
    "a motor without its wheel": (
        {"drive.motors": [{k: v for k, v in MOTORS[0].items() if k != "wheel"}, *MOTORS[1:]]},
        "drive.motors.left_1.wheel", "left or right"),
    "an unknown body": ({"control.front.inputs": ["bogie.y_m"]}, "control.front.inputs.0", "wheelset_1"),
    "an unknown channel": ({"control.front.inputs": ["wheelset_1.y"]}, "control.front.inputs.0", "one of x_m, y_m"),
    "pitch of what spins": ({"control.front.inputs": ["wheelset_1.pitch_rad"]}, "control.front.inputs.0", "one of"),
    "an unknown output": ({"control.front.outputs": ["left_9"]}, "control.front.outputs.0", "left_1"),
    "an output twice": ({"control.rear.outputs": ["left_1"]}, "control", "each output once"),
    "writing beyond": ({"control.front.law": f"{LAWS}beyond"}, "control.front.law", "IndexError"),
    "not finite": ({"control.front.law": f"{LAWS}not_finite"}, "control.front.law", "finite numbers"),
    "an answer": ({"control.front.law": f"{LAWS}answers"}, "control.front.law", "returns nothing"),
    "too few inputs": ({"control.front.inputs": []}, "control.front.law", "ValueError"),
    "nowhere": ({"control.front.law": "lost.py:guide"}, "control.front.law", "an existing file"),
    "a reference": ({"integration.method": "scipy_radau"}, "integration.method", "compiled engine"),
    "a torque beside": (
        {"drive.motors": [{**MOTORS[0], "torque": 1.0}, *MOTORS[1:]]}, "drive.motors.left_1.torque",
        "a control law commands"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_control_is_refused_in_one_line(name):
    changes, field, expected = BAD[name]
    with pytest.raises(InputError) as caught:
        compile_scene(wr.load_scene(wr.load_scene(GUIDED), changes))
    assert caught.value.field == field and expected in caught.value.expected and "\n" not in str(caught.value)


def test_a_motor_of_solid_wheels_has_no_wheel():
    motor = {"name": "m", "bodies": ["wheelset", "frame"], "torque": 1.0, "wheel": "left"}
    with pytest.raises(InputError) as caught:
        wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml", {"drive.motors": [motor]})
    assert caught.value.field == "drive.motors.m.wheel" and "turn together" in caught.value.expected


def test_a_function_may_stand_for_its_name():
    from tests.forces.own_control import wave

    law = {"law": wave, "inputs": [], "outputs": ["left_1"], "parameters": [100.0, 6.0]}
    given = car({"front": law})
    assert given.data["control"]["front"]["law"] == "tests.forces.own_control:wave"
    again = wr.load_scene(given, control={"front": law | {"law": f"{LAWS}wave"}})
    assert again.laws.digests.keys() == {"own_control.py:wave"}
    again = wr.load_scene(again, control={"front": law})
    assert model_fingerprint(compile_scene(given)[0]) == model_fingerprint(compile_scene(again)[0])
    found = wr.simulate(given, integration__duration=0.2)
    np.testing.assert_allclose(found["drive/left_1"].torque_Nm, 100.0 * np.sin(6.0 * found.t), rtol=0, atol=1e-9)
