"""Runs written as they go: blocks, kills, signals and a second process change nothing in the result."""

import json
import os
import signal
import subprocess
import sys
import time
import tracemalloc
from contextlib import nullcontext

import h5py
import numpy as np
import pytest

import wrcore as wr
from tests.conftest import SCENES
from wrcore.cli import main
from wrcore.errors import InputError
from wrcore.errors.checked_hdf5 import sign
from wrcore.run.output.files import load_run
from wrcore.run.simulate import output_blocks, output_times, simulate
from wrcore.run.streaming import Blocks, Interrupts, simulate_to
from wrcore.scene.description import load_scene

HUNTING = {
    "speed": 60.0,
    "integration.duration": 4.0,
    "contact.creep.model": "she",
    "contact.patch": "moment",  # as the law wants ellipses
    "integration.rtol": 1e-6,
}  # several chunks of steps
LOOKED_UP = {"speed": 40.0, "integration.duration": 2.0, "initial.y": 0.003}  # as the example is
CURVE = HUNTING | {
    "integration.duration": 2.0, "output.channels": ["pose", "velocity", "acceleration", "contact", "energy"],
    "track.path": [{"tangent": 20.0}, {"transition": 40.0}, {"curve": 200.0, "radius": 600.0, "cant": 0.1}],
    "track.irregularity": {"spectrum": {"level": "low", "seed": 1, "length": 300.0}},
}  # fmt: skip


def scene_of(changes):
    return load_scene(SCENES / "suspended_wheelset.yaml", changes)


def assert_same(run, other):
    """Every channel bit for bit, and every counter that is no time."""
    assert (run.status, run.reason) == (other.status, other.reason)
    assert np.array_equal(run.t, other.t) and set(run.groups) == set(other.groups)
    for group, channels in other.groups.items():
        for name, values in channels.items():
            assert np.array_equal(run.groups[group][name], values, equal_nan=True), (group, name)
    assert np.array_equal(run.end_state, other.end_state) and run.end_t == other.end_t
    times = ("wall_s", "compile_s")
    assert {k: v for k, v in run.counters.items() if k not in times} == {
        k: v for k, v in other.counters.items() if k not in times
    }


@pytest.mark.parametrize("changes", [HUNTING, CURVE, HUNTING | {"integration.method": "ros34pw2"}, LOOKED_UP])
def test_blocks_do_not_change_a_bit(tmp_path, changes):
    scene = scene_of(changes)
    run, interrupted = simulate_to(scene, tmp_path / "run.h5", block=97)
    assert run.status == "completed" and not interrupted
    assert_same(load_run(tmp_path / "run.h5"), simulate(scene))
    assert [path.name for path in tmp_path.iterdir()] == ["run.h5"]


def test_a_checkpoint_from_a_file_goes_on_bit_by_bit(tmp_path):
    for method in ("tsit5", "ros34pw2"):
        whole = simulate(scene_of(HUNTING | {"integration.method": method}))
        half = scene_of(HUNTING | {"integration.method": method, "integration.duration": 2.0})
        simulate_to(half, tmp_path / "half.h5", block=97)
        with h5py.File(tmp_path / "half.h5", "r+") as file:
            linear = file["end/checkpoint"].get("linear", {})
            assert "system" not in linear  # what the Jacobian makes again; older files have it
            if method == "ros34pw2":
                linear.create_group("system")["blocks"] = np.zeros((1, 6, 6))
        sign(tmp_path / "half.h5")
        rest = simulate(half, start=load_run(tmp_path / "half.h5").end)
        assert np.array_equal(rest["wheelset"].y_m, whole["wheelset"].y_m[whole.t >= 2.0])


def test_a_run_that_ends_before_its_time_keeps_its_last_valid_state(tmp_path):
    changes = {"speed": 40.0, "integration.duration": 20.0, "contact.creep.model": "linear", "contact.friction": 1.0}
    scene = load_scene(SCENES / "wheelset.yaml", changes | {"wheel.profile": "cone:1/20", "rail.profile": "circle:0.3"})
    for block in (100_000, 53):
        simulate_to(scene, tmp_path / "run.h5", block=block)
        run = load_run(tmp_path / "run.h5")
        assert run.status == "derailed" and "off the track's centre" in run.reason
        assert run.t[-1] <= run.end_t <= run.t[-1] + 1.0 / 200.0 and run.end_t < 20.0
        assert np.isfinite(run.end_state).all() and abs(run.end_state[1]) == pytest.approx(0.05, abs=0.01)


KILLED = """
import sys
from tests.run.test_streaming import HUNTING, scene_of
from wrcore.run.streaming import simulate_to
simulate_to(scene_of(HUNTING | {"integration.duration": 20.0}), sys.argv[1], block=200)
"""


def test_a_killed_run_goes_on_bit_by_bit(tmp_path):
    out, parts = tmp_path / "run.h5", tmp_path / ".run.h5.parts"
    process = subprocess.Popen([sys.executable, "-c", KILLED, str(out)], cwd=SCENES.parent.parent)
    while len(list(parts.glob("0*.h5"))) < 3:
        assert process.poll() is None
        time.sleep(0.01)
    process.kill()
    process.wait()
    assert not out.exists()
    kept, said = len(list(parts.glob("0*.h5"))), []
    scene = scene_of(HUNTING | {"integration.duration": 20.0})
    simulate_to(scene, out, say=said.append, block=333)
    assert said == [f"goes on at t = {kept:g} s, where it was interrupted"] and kept < 20  # 200 outputs are 1 s
    assert_same(load_run(out), simulate(scene))
    assert [path.name for path in tmp_path.iterdir()] == ["run.h5"]


def interrupt_at(t, number):
    """A progress that sends this process a signal when the time is reached, once."""
    sent = []

    def advance(reached):
        if reached >= t and not sent:
            sent.append(os.kill(os.getpid(), number))

    return advance


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("block", [10_000, 97])
def test_a_signal_keeps_what_was_reached_and_the_run_goes_on(tmp_path, number, block):
    scene, out = scene_of(HUNTING), tmp_path / "run.h5"
    before = signal.getsignal(number)
    run, caught = simulate_to(scene, out, interrupt_at(1.5, number), block=block)
    assert caught == number and signal.getsignal(number) is before
    kept = load_run(out)
    assert kept.status == "stalled" and kept.reason.startswith("interrupted (SIG")
    assert 1.5 <= kept.t[-1] < 4.0 and kept.t[-1] <= kept.end_t
    assert [path.name for path in tmp_path.iterdir()] == ["run.h5"]
    simulate_to(scene, out, block=block)
    assert_same(load_run(out), simulate(scene))


def test_pauses_for_checkpoints_do_not_change_a_bit(tmp_path):
    scene = scene_of(HUNTING)
    simulate_to(scene, tmp_path / "run.h5", checkpoint_s=0.0)  # after every chunk of steps
    assert_same(load_run(tmp_path / "run.h5"), simulate(scene))


def test_an_interrupted_run_of_something_else_is_not_gone_on_with(tmp_path):
    out, said = tmp_path / "run.h5", []
    simulate_to(scene_of(HUNTING), out, interrupt_at(1.5, signal.SIGINT), block=97)
    for changes, resume in ((HUNTING | {"speed": 61.0}, True), (HUNTING, False)):
        (tmp_path / "copy.h5").write_bytes(out.read_bytes())
        scene = scene_of(changes)
        simulate_to(scene, tmp_path / "copy.h5", resume=resume, say=said.append)
        assert_same(load_run(tmp_path / "copy.h5"), simulate(scene))
    simulate_to(scene_of(HUNTING), out)  # goes on
    simulate_to(scene_of(HUNTING), out, say=said.append)  # is complete: it is run again
    assert not said


def test_only_one_process_writes_a_file(tmp_path):
    out = tmp_path / "run.h5"
    (tmp_path / ".run.h5.parts").mkdir()
    with Blocks(out, ""):
        with pytest.raises(InputError, match="no other process"):
            simulate_to(scene_of(HUNTING), out)
    simulate_to(scene_of(HUNTING), out)
    assert load_run(out).status == "completed"


def parts_of_a_killed_run(out):
    """Blocks of a run that was killed: 1 s each, the hidden folder is all that there is."""
    process = os.fork()
    if process == 0:
        simulate_to(scene_of(HUNTING), out, lambda t: os._exit(0) if t > 3.5 else None, block=200)
    os.waitpid(process, 0)
    parts = sorted((out.parent / ".run.h5.parts").iterdir())
    assert [path.name for path in parts] == ["000000.h5", "000001.h5", "000002.h5"] and not out.exists()
    return parts


def complete(out):
    """Go on with a run, which ends as the whole one and leaves nothing beside it; what was said."""
    said = []
    simulate_to(scene_of(HUNTING), out, say=said.append, block=200)
    assert_same(load_run(out), simulate(scene_of(HUNTING)))
    assert [path.name for path in out.parent.iterdir()] == ["run.h5"]
    return said


@pytest.mark.parametrize("number", [0, 1, 2])
@pytest.mark.parametrize("damage", ["flipped", "gone", "cut", "another"])
def test_of_damaged_blocks_those_before_are_used(tmp_path, damage, number):
    parts = parts_of_a_killed_run(tmp_path / "run.h5")
    content = bytearray(parts[number].read_bytes())
    content[len(content) // 2] ^= 1
    if damage == "another":
        parts[number - 1].replace(parts[number])
        number = min(number, (number - 1) % 3)
    else:
        parts[number].unlink() if damage == "gone" else parts[number].write_bytes(content[: -(damage == "cut") or None])
    said = complete(tmp_path / "run.h5")
    assert (f"goes on at t = {number:g} s, where it was interrupted" in said) == (number > 0)
    assert any("SHA-256" in line for line in said) == (damage in ("flipped", "cut"))


def test_a_finished_run_survives_a_kill_while_its_parts_are_removed(tmp_path):
    parts = parts_of_a_killed_run(tmp_path / "run.h5")
    complete(tmp_path / "run.h5")
    kept = (tmp_path / "run.h5").read_bytes()
    parts_of = tmp_path / ".run.h5.parts.01234567.part"  # what is being removed has another name
    parts_of.mkdir()
    (parts_of / parts[1].name).write_bytes(kept)
    assert complete(tmp_path / "run.h5") == []


def test_a_run_that_was_complete_but_for_its_parts_being_removed_is_told_as_one(tmp_path, capsys):
    out = tmp_path / "run.h5"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("wrcore.run.streaming.remove_folder", lambda _: None)
        simulate_to(scene_of(HUNTING), out, block=200)
    sets = [f"--set={key}={value}" for key, value in HUNTING.items()]
    assert main(["simulate", str(SCENES / "suspended_wheelset.yaml"), *sets, "--out", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["compile_s"] == 0.0
    assert complete(out) == []


def test_a_damaged_interrupted_run_stays_until_another_is_complete(tmp_path, monkeypatch):
    out = tmp_path / "run.h5"
    simulate_to(scene_of(HUNTING), out, interrupt_at(1.5, signal.SIGINT))
    content = bytearray(out.read_bytes())
    content[-1000] ^= 1
    out.write_bytes(content)
    monkeypatch.setattr("wrcore.run.simulation.integrate", lambda *_, **__: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        simulate_to(scene_of(HUNTING), out)
    assert out.read_bytes() == content
    monkeypatch.undo()
    (said,) = complete(out)
    assert "run.h5: expected a complete run file" in said and said.endswith("begins anew")


@pytest.mark.parametrize("plant", [lambda path, other: path.symlink_to(other), lambda path, _: path.write_text("")])
def test_a_planted_folder_of_parts_is_not_followed(tmp_path, plant):
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "000000.h5").write_text("mine")
    plant(tmp_path / ".run.h5.parts", tmp_path / "other")
    with pytest.raises(InputError, match="expected a folder or nothing as .run.h5.parts"):
        simulate_to(scene_of(HUNTING), tmp_path / "run.h5")
    assert (tmp_path / "other" / "000000.h5").read_text() == "mine"


def test_a_disk_that_fills_up_keeps_the_blocks(tmp_path):
    script = """
import resource, sys
from tests.run.test_streaming import HUNTING, scene_of
from wrcore.run.streaming import simulate_to
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), resource.RLIM_INFINITY))
try:
    simulate_to(scene_of(HUNTING), sys.argv[1], block=int(sys.argv[3]))
except OSError as error:
    print(error.filename, error.strerror)
"""
    out = tmp_path / "run.h5"
    for most, block, kept in ((100_000, 200, False), (240_000, 150, True), (100_000, 10_000, False)):
        command = [sys.executable, "-c", script, str(out), str(most), str(block)]
        done = subprocess.run(command, cwd=SCENES.parent.parent, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout.startswith(f"{out} File too large") and done.stdout.count("\n") == 1
        assert ("blocks before are kept, the same command goes on" in done.stdout) == kept, done.stdout
        complete(out)
        out.unlink()


def test_memory_does_not_grow_with_duration(tmp_path):
    peaks = []
    for duration in (5.0, 5.0, 40.0):  # the first one loads what every run needs
        scene = scene_of(HUNTING | {"integration.duration": duration})
        tracemalloc.start()
        simulate_to(scene, tmp_path / "run.h5", block=500)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    channels = 40.0 * 200 * (2 * 3 * 17 + 11) * 8  # bytes of the longer run
    assert peaks[2] < 1.3 * peaks[1] and peaks[2] - peaks[1] < 0.1 * channels


def test_the_command_tells_how_a_run_ended(tmp_path, capsys):
    sets = ["--set", "integration.most_steps=50"]
    out = tmp_path / "run.h5"
    assert main(["simulate", str(SCENES / "suspended_wheelset.yaml"), *sets, "--out", str(out), "--json"]) == 1
    summary = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert summary["status"] == "stalled" and "most_steps" in summary["reason"]
    run = load_run(out)
    assert (run.status, run.reason) == (summary["status"], summary["reason"])
    assert run.counters["steps"] + run.counters["rejected"] == 50


def test_the_command_is_interrupted_and_goes_on(tmp_path, capsys, monkeypatch):
    out = tmp_path / "run.h5"
    sets = [f"--set={key}={value}" for key, value in HUNTING.items()]
    command = ["simulate", str(SCENES / "suspended_wheelset.yaml"), *sets, "--out", str(out)]
    with monkeypatch.context() as patch:
        patch.setattr("wrcore.run.progress.simulated_time", lambda _: nullcontext(interrupt_at(1.5, signal.SIGTERM)))
        assert main(command) == 128 + signal.SIGTERM
    assert "stalled: interrupted (SIGTERM)" in capsys.readouterr().out
    kept = out.read_bytes()
    assert main(command) == 0 and "goes on at t" in capsys.readouterr().out
    out.write_bytes(kept)
    assert main([*command, "--no-resume"]) == 0 and "goes on" not in capsys.readouterr().out
    assert_same(load_run(out), simulate(scene_of(HUNTING)))


def test_last_valid_state_in_the_file_says_what_it_is(tmp_path):
    simulate_to(scene_of(HUNTING), tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5") as file:
        assert file["end/state"].shape == (13,) and file["end/t"][()] == 4.0
        assert "per body" in file["end/state"].attrs["description"] and file["end/t"].attrs["units"] == "s"


@pytest.mark.parametrize(
    ("begin", "duration", "rate"), [(0.0, 1.0, 200.0), (0.0, 1.003, 200.0), (0.7, 2.0, 3.0), (0.0, 1e-6, 1e-3)]
)
def test_output_blocks_are_the_output_times(begin, duration, rate):
    whole = output_times(begin, duration, rate)
    assert whole[0] == begin and whole[-1] == begin + duration and (np.diff(whole) > 0.0).all()
    for size in (1, 7, 1000):
        blocks = list(output_blocks(begin, duration, rate, size))
        assert np.array_equal(np.concatenate(blocks), whole) and all(map(len, blocks))


FULL = ["pose", "velocity", "acceleration", "contact", "energy", "wheel_motion", "T_gamma", "Q"]


@pytest.mark.parametrize("name", ["suspended_wheelset", "crossing", "locomotive"])
def test_pieces_without_output_times_change_nothing(tmp_path, name):
    """Checkpoints, and interruptions, more often than output times; contact as the example has it."""
    changes = {"integration.duration": 0.4, "output.rate": 4.0, "output.channels": FULL}
    scene = load_scene(wr.example(name), changes)
    run, _ = simulate_to(scene, tmp_path / "run.h5", checkpoint_s=0.0)
    assert run.status == "completed"
    assert_same(load_run(tmp_path / "run.h5"), simulate(scene, progress=False))


def test_interrupted_twice_between_output_times_goes_on(tmp_path, monkeypatch):
    scene = load_scene(wr.example("suspended_wheelset"), {"integration.duration": 0.4, "output.rate": 4.0})
    told = []
    monkeypatch.setattr(Interrupts, "caught", signal.SIGINT)
    monkeypatch.setattr("wrcore.integrate.integrator.FIRST_CHUNK", 4)  # attempts; 32 of them are the whole run
    for _ in range(2):
        run, number = simulate_to(scene, tmp_path / "run.h5", say=told.append)
        assert number == signal.SIGINT and run.reason.startswith("interrupted") and not len(run.t[1:])
        load_run(tmp_path / "run.h5")
    monkeypatch.undo()
    simulate_to(scene, tmp_path / "run.h5", say=told.append)
    assert_same(load_run(tmp_path / "run.h5"), simulate(scene, progress=False))
    assert told and all(text.startswith("goes on at t = ") for text in told)


def test_a_second_signal_at_once_loses_nothing(tmp_path, monkeypatch):
    """Who presses Ctrl-C twice has what was computed; much later the second one does as ever."""
    sent = []

    def twice(t):
        if t >= 1.0 and len(sent) < 2:
            sent.extend(os.kill(os.getpid(), signal.SIGINT) or t for _ in range(2))

    run, number = simulate_to(scene_of(HUNTING), tmp_path / "run.h5", twice)
    assert number == signal.SIGINT and load_run(tmp_path / "run.h5").t[-1] > 0.9
    sent.clear()
    monkeypatch.setattr("wrcore.run.streaming.PATIENCE", -1.0)
    with pytest.raises(KeyboardInterrupt):
        simulate_to(scene_of(HUNTING | {"speed": 59.0}), tmp_path / "other.h5", twice)
