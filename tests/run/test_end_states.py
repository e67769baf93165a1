"""A run in two pieces, by the state in which the first one ended, is the run in one piece."""

import copy
import pickle

import h5py
import numpy as np
import pytest

from tests.conftest import ELLIPTIC
from wrcore.contact.normal.strips import MEMORY
from wrcore.errors import InputError
from wrcore.run.checkpoints import read_checkpoint, write_checkpoint
from wrcore.run.output.files import load_run
from wrcore.run.simulate import simulate
from wrcore.run.state import State
from wrcore.scene.description import load_scene

CURVED = {
    "track.path": [{"transition": 20}, {"curve": 200, "radius": 600, "cant": 0.05}],
    "track.irregularity": {"spectrum": {"level": "low", "seed": 3, "length": 200, "begin": 1}},
}
DRIVEN = {
    "motors": [{"name": "m", "bodies": ["wheelset_1", "bogie_1"]}, {"name": "n", "bodies": ["wheelset_3", "bogie_2"]}],
    "brakes": [
        {"name": "b", "bodies": ["wheelset_2", "bogie_1"], "torque": {"time": [0.5, 1.0], "torque": [0.0, 4e3]}}
    ],  # fmt: skip
    "controller": {
        "body": "car_body",
        "speed": {"time": [0.0, 1.0], "speed": [20.0, 21.0]},
        "proportional": 1e5,
        "integral": 1e4,
        "limit": 1e5,
    },  # fmt: skip
}
FRICTION = {"contact.friction": {"arc_length": [10.0, 20.0, 30.0], "mu": [0.4, 0.2, 0.35]}}
CASES = {
    "frame": ("suspended_wheelset", {}),
    "frame in a curve, friction along the track": ("suspended_wheelset", CURVED | FRICTION),
    "frame, dampers in series, curve": ("trailer_vehicle", CURVED),
    "drive over time": ("trailer_vehicle", {"drive": DRIVEN} | FRICTION),
}
COMMON = {"integration.rtol": 1e-8, "contact.creep.model": "she", "speed": 20, "output.rate": 20}


def scene_of(case="frame", duration=0.75, **changes):
    name, own = CASES[case]
    changes = {key.replace("__", "."): value for key, value in changes.items()}
    return load_scene(ELLIPTIC / f"{name}.yaml", {**COMMON, **own, "integration.duration": duration, **changes})


@pytest.fixture(scope="module")
def first():
    return simulate(scene_of(initial__y=0.001), progress=False)


@pytest.mark.parametrize("case", CASES)
def test_two_pieces_are_one_run(case, tmp_path):
    start = {} if case == "drive over time" else {"initial__y": 0.001}
    whole = simulate(scene_of(case, 1.25, **start), progress=False)
    half = simulate(scene_of(case, 0.75, **start), progress=False)
    half.save(tmp_path / "half.h5")
    kept = load_run(tmp_path / "half.h5").end_state
    assert kept.t == half.end_t and kept.frame == pytest.approx(15.0) and kept.vehicle == half.end_state.vehicle
    rest = simulate(scene_of(case, 0.5), progress=False, start=kept)
    assert rest.status == "completed" and rest.t[0] == 0.75 and rest.t[-1] == pytest.approx(1.25)
    late = whole.t >= 0.75
    for group in (name for name in whole if "/" not in name):
        for channel, values in rest[group].items():
            theirs = whole[group][channel][late]
            floor = 2e-7 if channel.endswith("m_per_s") else 1e-8  # the tolerance times the speed
            assert np.max(np.abs(values - theirs)) < 1e-4 * np.max(np.abs(theirs)) + floor, (group, channel)
    for group in (name for name in whole if name.startswith("drive/") and "power_W" in whole[name]):
        np.testing.assert_allclose(rest[group]["power_W"], whole[group]["power_W"][late], rtol=1e-4, atol=1.0)


def test_the_frame_stays_where_it_is_at_another_speed(first):
    # nothing is torn: the frame only goes faster by 1 m/s, and springs swing beyond it by less than that
    scene = scene_of(duration=0.05, speed=21)
    rest = simulate(scene, progress=False, start=first.end_state)
    assert rest.status == "completed" and abs(rest["wheelset"].vx_m_per_s[-1] - 21.0) < 1.0
    assert rest.end_state.frame == pytest.approx(15.0 + 0.05 * 21.0, rel=1e-12)
    again = simulate(scene, progress=False, start=rest.end_state)
    assert again.status == "completed" and again.end_t == pytest.approx(0.85)


def test_an_array_is_at_time_0_or_no_start(first):
    with pytest.raises(InputError, match="start: expected one at time 0, wheelset beside the moving frame, got it 15"):
        simulate(scene_of(), progress=False, start=np.asarray(first.end_state))


def test_states_of_other_vehicles_are_refused(first):
    other = scene_of("frame, dampers in series, curve", 0.01)
    with pytest.raises(InputError, match="start: expected a state of this very vehicle, .*, got that of "):
        simulate(other, progress=False, start=first.end_state)
    with pytest.raises(InputError, match="start: expected a Checkpoint, or a state of 13 finite numbers, got a "):
        simulate(scene_of(), progress=False, start=first.end_state[:-1])
    boxes = simulate(scene_of("frame, dampers in series, curve", 0.01, vehicle__axle_boxes=True), progress=False)
    with pytest.raises(InputError, match="start: expected a state of this very vehicle, .*, got that of one of"):
        simulate(other, progress=False, start=boxes.end_state)


def test_what_is_made_of_a_state_knows_its_time():
    state = State(np.arange(13.0), 2.0, 40.0, ("vehicle", "body"))
    for other in (state + 0.1, state.copy(), copy.copy(state), copy.deepcopy(state), pickle.loads(pickle.dumps(state))):
        assert (other.t, other.frame, other.vehicle) == (2.0, 40.0, ("vehicle", "body"))
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(state)), state)


def test_patches_of_an_earlier_version_start_from_nothing(first, tmp_path):
    """Its checkpoint knew less of each of them."""
    with h5py.File(tmp_path / "end.h5", "w") as file:
        write_checkpoint(file, first.end)
        del file["patches"]
        file["patches"] = np.ones((1, 2, 3, 4))
        read = read_checkpoint(file)
    assert read.patches.shape == (1, 2, 3, MEMORY) and not read.patches.any()
    assert read.t == first.end.t and np.array_equal(read.memory.state, first.end.memory.state)
