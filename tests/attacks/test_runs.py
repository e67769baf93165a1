"""Runs that were stopped, killed, damaged or started wrongly: continued to the last bit, begun anew, or refused."""

import os
import random
import resource
import shutil
import signal
import sys
import tempfile
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.attacks.generator import damaged, edited, examples
from tests.attacks.outcomes import fault_of, run_command, same_numbers
from tests.attacks.test_files import content, randoms
from tests.conftest import ELLIPTIC
from wrcore.errors import InputError
from wrcore.run.output.files import load_run
from wrcore.run.simulate import simulate
from wrcore.run.streaming import simulate_to
from wrcore.scene.description import load_scene

SCENE = ELLIPTIC / "suspended_wheelset.yaml"
SHORT = {"speed": 60.0, "integration.duration": 0.4, "contact.creep.model": "she"}
METHODS = "tsit5", "ros34pw2"
EVENTS = {"open", "os.rename", "os.remove", "os.rmdir", "os.mkdir", "shutil.rmtree"}
"""Steps on the disk, as Python's audit hook names them."""


@cache
def scene_of(method="tsit5", **changes):
    return load_scene(SCENE, SHORT | {"integration.method": method, **changes})


@cache
def whole(method):
    """The run that all others are to be, bit by bit."""
    return simulate(scene_of(method), progress=False)


def interrupted(path, method, block):
    """A run file, or (with small blocks) one joined of several, as SIGINT leaves it."""

    def stop(t):
        if t > 0.2 and not path.exists():
            os.kill(os.getpid(), signal.SIGINT)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    simulate_to(scene_of(method), path, stop, block=block, checkpoint_s=0.0)
    signal.signal(signal.SIGINT, before)


def killed_at(step, method, folder):
    """Work on a run until some step on the disk, before which the process is killed."""
    left = [step]

    def hook(event, args):
        if event in EVENTS and args and (not isinstance(args[0], str | Path) or ".h5" in str(args[0])):
            left[0] -= 1
            if left[0] < 0:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(hook)
    simulate_to(scene_of(method), folder / "run.h5", block=17)


def finished(method, folder):
    """What is wrong once a run has been continued: it is not the whole one, or leaves something behind."""
    out = folder / "run.h5"
    simulate_to(scene_of(method), out, block=17)
    if not same_numbers(content(load_run(out)), content(whole(method))):
        return "not the run that was interrupted"
    left = sorted(path.name for path in folder.iterdir() if path.name not in ("run.h5", "fifo"))
    return f"left behind: {left}" if left else ""


@pytest.fixture(scope="module")
def stopped(tmp_path_factory):
    """Folders by (kind, method): a run file that SIGINT left, and the parts that a killed run leaves."""
    base = tmp_path_factory.mktemp("stopped")
    for method in METHODS:
        whole(method)
        for kind in ("file", "parts"):
            (base / kind / method).mkdir(parents=True)
        interrupted(base / "file" / method / "run.h5", method, 10_000)
        fault_of(killed_at, 25, method, base / "parts" / method)
        assert len(list((base / "parts" / method).rglob("*.h5"))) > 1
    return base


@examples(30)
@given(rng=randoms, method=st.sampled_from(METHODS), kind=st.sampled_from(["file", "parts"]),
       fault=st.sampled_from(["bytes", "bytes", "edit", "files"]))  # fmt: skip
def test_damaged_run_is_continued_begun_anew_or_refused(stopped, rng, method, kind, fault):
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "case"
        shutil.copytree(stopped / kind / method, folder)
        files = sorted(folder.rglob("*.h5"))
        path = rng.choice(files)
        if fault == "files" and kind == "parts":
            rng.choice([path.unlink, partial(path.replace, files[0]), partial(shutil.copy, files[0], files[-1])])()
        elif fault == "edit":
            edited(path, rng)
        else:
            path.write_bytes(damaged(path.read_bytes(), rng))
        found = fault_of(lambda: finished(method, folder) if fault != "edit" else finished(method, folder) and "")
        assert found == ""


@examples(20)
@given(rng=randoms, kind=st.sampled_from(["file", "whole"]), by_bytes=st.booleans())
def test_command_over_a_damaged_run_gives_the_run_or_leaves_the_file(stopped, rng, kind, by_bytes):
    with tempfile.TemporaryDirectory() as place:
        out = Path(place) / "run.h5"
        if kind == "whole":
            whole("tsit5").save(out)
        else:
            shutil.copy(stopped / "file" / "tsit5" / "run.h5", out)
        if by_bytes:
            out.write_bytes(damaged(out.read_bytes(), rng))
        else:
            edited(out, rng)
        before = out.read_bytes()
        sets = [f"--set={key}={value}" for key, value in (SHORT | {"integration.method": "tsit5"}).items()]

        def command():
            status, _, said = run_command(["simulate", SCENE, *sets, "--out", out])
            kept = [out] if by_bytes else [out, out.with_name(".run.h5.parts") / "000000.h5"]  # with a valid digest
            if status == 2 and said.count("\n") == 1 and before in [one.read_bytes() for one in kept if one.exists()]:
                return ""
            load_run(out)
            return f"status {status}, said {said!r}" if status or said else ""

        assert fault_of(command) == ""


@pytest.mark.parametrize("case", range(4))
def test_run_killed_at_any_step_on_the_disk_loses_nothing(tmp_path, case):
    rng = random.Random(case)
    method = METHODS[case % 2]
    whole(method)
    if case > 1:
        interrupted(tmp_path / "run.h5", method, rng.choice([10_000, 17]))
    for _ in range(rng.randint(1, 3)):
        fault_of(killed_at, rng.randrange(60), method, tmp_path)
    assert fault_of(finished, method, tmp_path) == ""


@pytest.mark.parametrize("block", [None, 17])
@pytest.mark.parametrize("most", [30, 3_000, 60_000])
def test_disk_that_is_full_is_one_line_and_the_run_goes_on(tmp_path, most, block):
    out = tmp_path / "run.h5"

    def limited():
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY))
        if block is None:
            sets = [f"--set={key}={value}" for key, value in (SHORT | {"integration.method": "tsit5"}).items()]
            status, _, said = run_command(["simulate", SCENE, *sets, "--out", out])
        else:
            try:
                status, said = simulate_to(scene_of("tsit5"), out, block=block)[1], ""
            except OSError as error:
                status, said = 2, f"{error.filename} {error.strerror}\n"
        resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        if status and (said.count("\n") != 1 or str(out) not in said):
            return f"status {status}, said {said!r}"
        return finished("tsit5", tmp_path)

    whole("tsit5")
    assert fault_of(limited) == ""


def wrong_starts():
    """Ends of runs that are no start of the scene with a method: of another model or method, or with wrong arrays."""
    ends = {method: simulate(scene_of(method), progress=False).end for method in METHODS}
    for change in ({"speed": 61.0}, {"vehicle.count": 2, "vehicle.spacing": 10.0}, {"contact.friction": 0.4}):
        yield "tsit5", simulate(scene_of(**change), progress=False).end
    for method, end in ends.items():
        memory, state = end.memory, np.array(end.memory.state)
        yield from ((method, wrong) for wrong in (state[:-1], np.append(state, 0.0), state[None], state * np.nan,
                                                  state.astype(str), "x", 3.0))  # fmt: skip
        spoilt = [{name: getattr(memory, name) * np.nan} for name in ("state", "clock")]
        spoilt += [{name: wrong} for name in memory._fields for wrong in (None, np.zeros((2, 2)))]
        yield from ((method, end.__class__(**{**vars(end), "memory": memory._replace(**one)})) for one in spoilt)
    jacobian = end.linear.jacobian
    for name in (name for name in jacobian._fields if len(getattr(jacobian, name))):
        linear = end.linear._replace(jacobian=jacobian._replace(**{name: getattr(jacobian, name)[:0]}))
        yield "ros34pw2", end.__class__(**{**vars(end), "linear": linear})


def test_wrong_start_of_a_run_is_refused():
    for method, start in wrong_starts():
        with pytest.raises(InputError) as caught:
            simulate(scene_of(method), progress=False, start=start)
        assert "\n" not in str(caught.value)
