"""Single bodies at the start: what a scene says of them is what the run begins with."""

import numpy as np
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC, SCENES
from wrcore.equations.equations_of_motion import Equations
from wrcore.errors import InputError
from wrcore.scene.compile import compile_scene

CHANNELS = {
    "x": "x_m", "y": "y_m", "z": "z_m", "roll": "roll_rad", "yaw": "yaw_rad", "vx": "vx_m_per_s", "vy": "vy_m_per_s",
    "vz": "vz_m_per_s", "wx": "wx_rad_per_s", "wy": "wy_rad_per_s", "wz": "wz_rad_per_s",
}  # fmt: skip
TRAILER = ELLIPTIC / "trailer_vehicle.yaml"
BOXES = {"vehicle.axle_boxes": True}
BODIES = {
    "car_body": {"x": 0.001, "y": 0.01, "z": 1.81, "roll": 0.01, "yaw": -0.002, "vx": 20.1, "vy": 0.3, "wz": 0.01},
    "wheelset_2": {"y": 0.003, "z": 0.4601, "roll": 1e-4, "yaw": 0.002, "vz": 0.01, "wx": 0.02, "wy": 43.0, "vy": 0.01},
}


def beginning(changes):
    scene = wr.load_scene(TRAILER, {"speed": 20, "integration.duration": 0.01, **changes})
    return wr.simulate(scene)


def test_every_value_is_there_at_the_start():
    found, usual = beginning({"initial.bodies": BODIES}), beginning({})
    for name, values in BODIES.items():
        for key, channel in CHANNELS.items():
            expected = values.get(key, usual[name][channel][0])
            if key in values or name == "car_body":
                assert found[name][channel][0] == pytest.approx(expected, rel=1e-9, abs=1e-12), (name, key)
    for name in (
        "bogie_1",
        "wheelset_1",
        "wheelset_3",
    ):  # others are balanced anew
        for key, channel in CHANNELS.items():
            if name == "bogie_1" or key in ("x", "y", "yaw", "vx", "vy", "vz"):
                assert found[name][channel][0] == pytest.approx(usual[name][channel][0], abs=1e-9), (name, channel)


def test_in_a_curve_places_are_relative_to_the_track():
    curve = [{"transition": 5}, {"curve": 300, "radius": 600, "cant": 0.05}]
    body = {"x": 40.0, "y": 0.02, "z": 1.85, "roll": 0.01, "yaw": 0.003}
    found = beginning({"track.path": curve, "initial.bodies": {"car_body": body}})["car_body"]
    for key, channel in (("x", "s_m"), ("y", "y_m"), ("z", "z_m"), ("roll", "roll_rad"), ("yaw", "yaw_rad")):
        assert found[channel][0] == pytest.approx(body[key], rel=1e-6), key


CURVE = [{"tangent": 5}, {"transition": 20}, {"curve": 300, "radius": 1500, "cant": 0.04}]
CLIMBING = [{"gradient": 0.0, "length": 10.0}, {"gradient": 0.02, "radius": 3000.0}]


def bodies_at(run, i):
    """What the channels of a run say of its bodies at an output, as a scene's ``initial.bodies``."""
    keys = CHANNELS | {"pitch": "pitch_rad"}
    names = [name for name in run if "/" not in name]
    return {name: {key: float(run[name][keys[key]][i]) for key in keys if keys[key] in run[name]} for name in names}


@pytest.mark.parametrize("at", [10, 30], ids=["transition", "curve"])
def test_in_a_curve_too_a_run_goes_on_from_the_channels_of_another(at):
    # a free wheelset; ground axes, as velocities once were: derailed at once
    changes = {
        "speed": 20, "integration.rtol": 1e-8, "output.rate": 20, "contact.creep.model": "she", "initial.y": 0.002,
        "track.path": CURVE, "track.gradients": CLIMBING, "integration.duration": 0.05 * at + 0.25,
    }  # fmt: skip
    whole = wr.simulate(SCENES / "wheelset.yaml", changes)
    later = {**changes, "initial.y": 0.0, "integration.duration": 0.25, "initial.bodies": bodies_at(whole, at)}
    rest = wr.simulate(SCENES / "wheelset.yaml", later)
    assert rest.status == "completed"
    for channel in ("y_m", "yaw_rad", "roll_rad", "vx_m_per_s", "vy_m_per_s", "wz_rad_per_s"):
        ours, theirs = rest["wheelset"][channel], whole["wheelset"][channel][at:]
        assert np.max(np.abs(ours - theirs)) < 1e-3 * np.max(np.abs(theirs)) + 1e-6, channel


def test_all_channels_of_bodies_can_be_written_as_a_beginning():
    changes = {"integration.duration": 1.5, "output.rate": 20, "track.path": CURVE, "track.gradients": CLIMBING}
    changes["contact.creep.model"] = "she"
    bodies = bodies_at(beginning(changes), -1)
    again = bodies_at(beginning({**changes, "integration.duration": 0.01, "initial.bodies": bodies}), 0)
    for name, values in bodies.items():
        assert again[name] == pytest.approx(values, rel=1e-9, abs=1e-10), name


def test_a_body_that_follows_the_curve_moves_along_it_and_turns_and_accelerates_as_circles_say():
    speed, radius, cant = 20.0, 400.0, 0.06
    run = beginning({"speed": speed, "track.path": [{"transition": 20}, {"curve": 900, "radius": radius, "cant": cant}],
                     "integration.duration": 30.0, "output.rate": 20, "contact.creep.model": "she",
                     "output.channels": ["pose", "velocity", "acceleration"]})  # fmt: skip
    roll = np.arcsin(cant / 1.5)  # of the track: about t, negative in a curve to the left
    body = {name: float(np.mean(values[-100:])) for name, values in run["car_body"].items()}
    centre = (
        radius - body["y_m"] * np.cos(roll) - body["z_m"] * np.sin(roll)
    )  # horizontal distance of the body's centre
    rate = body["vx_m_per_s"] / centre
    assert body["vx_m_per_s"] == pytest.approx(speed, rel=0.02)
    assert abs(body["vy_m_per_s"]) < 1e-4 and abs(body["vz_m_per_s"]) < 1e-4
    assert body["wz_rad_per_s"] == pytest.approx(rate * np.cos(roll), rel=1e-4)
    assert body["wy_rad_per_s"] == pytest.approx(-rate * np.sin(roll), rel=1e-2)
    assert body["ay_m_per_s2"] == pytest.approx(rate**2 * centre * np.cos(roll), rel=1e-3)
    assert body["az_m_per_s2"] == pytest.approx(rate**2 * centre * np.sin(roll), rel=1e-2)
    np.testing.assert_allclose(run["car_body"]["x_m"], run["car_body"]["s_m"], rtol=0, atol=0)


def test_a_moved_wheelset_stands_on_the_rails_and_carries_its_axle_boxes():
    alone = {"wheelset_1": {"y": 0.003, "vx": 20.4, "vy": 0.1, "wz": 0.02}}
    scene = wr.load_scene(TRAILER, {"speed": 20, "initial.bodies": alone, "integration.duration": 0.02, **BOXES})
    model, state = compile_scene(scene)
    at = 13 * scene.vehicle.body_names.index("wheelset_1")
    assert state[at + 11] == pytest.approx(20.4 / 0.46, rel=1e-3)
    rates = Equations(model)(0.0, state)
    assert abs(rates[at + 9]) < 0.05  # left at its old height: some 10 m/s^2
    found = wr.simulate(scene)
    axle, box = (
        np.array([found[name][channel] for channel in ("x_m", "y_m", "z_m")])
        for name in ("wheelset_1", "axle_box_1_left")
    )
    np.testing.assert_allclose(np.linalg.norm(box - axle, axis=0), 1.0, atol=1e-6)  # a velocity off would part them


@pytest.mark.parametrize("path", ["tangent", CURVE], ids=["tangent", "curve"])
def test_axle_box_begins_with_its_pitch_and_stays_on_its_axle(path):
    bodies = {
        "axle_box_1_left": {"pitch": 0.02, "wy": 0.5},
        "wheelset_1": {"x": 40.0, "y": 0.002, "yaw": 0.003, "wz": 0.01},
    }
    changes = {"speed": 20, "initial.bodies": bodies, "track.path": path, **BOXES}
    scene = wr.load_scene(SCENES / "trailer_vehicle.yaml", {**changes, "integration.duration": 0.01})
    found = wr.simulate(scene)["axle_box_1_left"]
    # the track's axes are those at the wheelset; channels take those at the box, 3 mm away as the wheelset is yawed
    assert found["pitch_rad"][0] == pytest.approx(0.02, rel=1e-5)
    assert found["wy_rad_per_s"][0] == pytest.approx(0.5, rel=1e-3)
    model, state = compile_scene(scene)
    equations = Equations(model)
    equations(0.0, state)
    joints, box = equations.work.constraints.joints, scene.vehicle.body_names.index("axle_box_1_left")
    held = np.flatnonzero((model.joints.bodies == box).any(axis=1))
    assert np.max(np.abs(joints.phi[held])) < 1e-12 and np.max(np.abs(joints.rate[held])) < 1e-12


def test_a_run_goes_on_from_the_channels_of_another():
    scene = ELLIPTIC / "suspended_wheelset.yaml"
    changes = {"speed": 20, "integration.duration": 1.0, "integration.rtol": 1e-6, "initial.y": 0.003}
    whole = wr.simulate(wr.load_scene(scene, changes))
    i = len(whole.t) // 2
    half = {key: float(whole["wheelset"][channel][i]) for key, channel in CHANNELS.items() if key != "x"}
    later = {**changes, "initial.y": 0.0, "integration.duration": 0.5, "initial.bodies": {"wheelset": half}}
    rest = wr.simulate(wr.load_scene(scene, later))
    np.testing.assert_allclose(
        rest["wheelset"]["y_m"], whole["wheelset"]["y_m"][i:], atol=1e-6
    )  # both err by some 0.1 um


def test_a_wheelset_may_begin_rolling_back():
    model, state = compile_scene(
        wr.load_scene(SCENES / "suspended_wheelset.yaml", {"speed": 20, "initial.bodies": {"wheelset": {"vx": -20.0}}})
    )
    assert state[7] == -20.0 and state[11] == pytest.approx(-20.0 / 0.46, rel=1e-3)
    assert abs(Equations(model)(0.0, state)[11]) < 1e-2  # it rolls


BAD = [
    ({"cab": {"y": 0.0}}, "initial.bodies.cab", "car_body"),
    ({"axle_box_1_left": {"y": 0.0}}, "initial.bodies.axle_box_1_left.y", "set y of wheelset_1"),
    ({"axle_box_1_left": {"pitch": 0.0, "wz": 0.1}}, "initial.bodies.axle_box_1_left.wz", "pitch and wy alone"),
    ({"wheelset_1": {"pitch": 0.1}}, "initial.bodies.wheelset_1.pitch", "wy"),
    ({"car_body": {"height": 0.1}}, "initial.bodies.car_body.height", "unknown key"),
    ({"car_body": {"roll": 2.0}}, "initial.bodies.car_body.roll", "within 0.5"),
]


@pytest.mark.parametrize(("bodies", "field", "expected"), BAD)
def test_bad_bodies_are_named(bodies, field, expected):
    with pytest.raises(InputError) as caught:
        wr.load_scene(TRAILER, {"initial.bodies": bodies, **BOXES})
    assert caught.value.field == field and expected in caught.value.expected
