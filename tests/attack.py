"""Attacks with fixed seeds: no crash, no hang, no traceback, nothing wrong without a word, nothing lost.

    python tests/attack.py                          # all of them in full
    python tests/attack.py tables kills --share 0.1 --seed 7

An attack is a function ``(count, seed) -> findings``, listed by `attack`. Each of its cases runs in a process of its
own (`tried`), which may crash or hang; it returns what it found wrong, and an `InputError` is an answer, too.
"""

import argparse
import contextlib
import io
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

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests import attack_calls as attack_calls
from tests.attacking import ATTACKS, attack, edited, isolated, mutated, same_numbers, tally, tried
from tests.conftest import ELLIPTIC
from wrcore.cli import main as command
from wrcore.creep.axes import CreepTableData, TableAxes
from wrcore.creep.build import Resolution
from wrcore.creep.cases import creep_force
from wrcore.creep.kalker import kalker_data
from wrcore.creep.table import CreepTable, load_table, write_table
from wrcore.errors import InputError
from wrcore.run.output.files import load_run
from wrcore.run.simulate import simulate
from wrcore.run.streaming import simulate_to
from wrcore.scene.description import load_scene


def file_attack(name, count, seed, originals, read, same):
    """Three in four cases damage a file byte by byte, the others edit it; ``read`` gives what ``same`` compares."""
    findings, rng = [], random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        for case in range(count):
            original, path = rng.choice(originals), Path(folder) / "file.h5"
            content = mutated(original.read_bytes(), rng)
            path.write_bytes(original.read_bytes())
            if by_bytes := case % 4 > 0:
                path.write_bytes(content)
            else:
                edited(path, rng)

            def wrong(path=path, original=original, by_bytes=by_bytes):
                found = read(path)
                return "read as something else" if by_bytes and not same(found, read(original)) else ""

            findings += tried(f"{name} {case}", wrong)
    return findings


@attack(1000)
def tables(count, seed):
    """Creep tables: refused, or what was written."""
    with tempfile.TemporaryDirectory() as folder:
        rng, originals = np.random.default_rng(seed), []
        for planes, psi, nodes in (("ellipse", 0.0, (3, 1, 3, 4, 3)), ("sdec", 0.9, (3, 3, 3, 4, 3))):
            data = CreepTableData(TableAxes(-3.0, 3.0, psi, *nodes), kalker_data(0.28), np.empty(0))
            shape = (5, 1, 5, 5, 5, 4) if planes == "ellipse" else (5, 5, 5, 7, 5, 4)
            data = data._replace(coefficients=rng.uniform(-1.0, 1.0, shape).astype(np.float32).ravel())
            table = CreepTable(data, planes, 0.01, Resolution(3, nodes[1], 3, 4, 3, 2), 1, (0.0,) * 4, (0.0,) * 4)
            originals.append(Path(folder) / f"{planes}.h5")
            write_table(originals[-1], table)

        def read(path):
            table = load_table(path)
            a, xi = np.geomspace(1e-3, 5e-3, 20), np.linspace(-0.01, 0.01, 20)
            forces = creep_force("table", a, 3e-3, 5e4, xi, 2e-3, 0.5, nu=table.nu, table=table)
            return forces, tuple(table.data), table.planes, table.tolerance, table.resolution, table.force_error

        read(originals[0])  # loads the kernels once for all cases
        return file_attack("tables", count, seed, originals, read, same_numbers)


SHORT = {"speed": 60.0, "integration.duration": 0.4, "contact.creep.model": "she"}


@cache
def scene_of(method="tsit5", **changes):
    return load_scene(ELLIPTIC / "suspended_wheelset.yaml", SHORT | {"integration.method": method, **changes})


@cache
def whole(method):
    """The run that all others are to be, bit by bit."""
    return simulate(scene_of(method), progress=False)


def content(run):
    """What must be the same in two runs of a scene."""
    counters = {name: value for name, value in run.counters.items() if name not in ("wall_s", "compile_s")}
    return run.status, run.reason, run.t, run.groups, run.end_t, run.end_state, counters


def interrupted(path, method, block):
    """A run file, or (with small blocks) one joined of several, as SIGINT leaves it."""

    def stop(t):
        if t > 0.2 and not path.exists():
            os.kill(os.getpid(), signal.SIGINT)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    simulate_to(scene_of(method), path, stop, block=block, checkpoint_s=0.0)
    signal.signal(signal.SIGINT, before)


@attack(1000)
def runs(count, seed):
    """Run files: refused, or what was written."""
    with tempfile.TemporaryDirectory() as folder:
        originals = [Path(folder) / f"{method}.h5" for method in ("tsit5", "ros34pw2")]
        for path in originals:
            simulate_to(scene_of(path.stem), path)

        def read(path):
            run = load_run(path)
            repr(run)
            return content(run), run.scene, run.settings

        return file_attack("runs", count, seed, originals, read, same_numbers)


@attack(700)
def run_over(count, seed):
    """``wrcore simulate --out`` over a damaged run: the run, or one line and the file as it was."""
    with tempfile.TemporaryDirectory() as folder:
        originals = [Path(folder) / name for name in ("whole.h5", "interrupted.h5")]
        simulate_to(scene_of("tsit5"), originals[0])
        interrupted(originals[1], "tsit5", 10_000)
        whole("tsit5")
        written(originals[0])  # loads what the command needs once for all cases
        return file_attack("run_over", count, seed, originals, written, lambda *_: True)


def written(path):
    """Run a scene by its command over a file; RuntimeError where that neither gives the run nor is refused."""
    out, before, said = path.with_name("run.h5"), path.read_bytes(), io.StringIO()
    out.write_bytes(before)
    sets = [f"--set={key}={value}" for key, value in (SHORT | {"integration.method": "tsit5"}).items()]
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        status = command(["simulate", str(ELLIPTIC / "suspended_wheelset.yaml"), *sets, "--out", str(out)])
    if status == 2 and said.getvalue().count("\n") == 1 and out.read_bytes() == before:
        raise InputError("run_over", "", said.getvalue())
    if status or said.getvalue():
        raise RuntimeError(f"status {status}, said {said.getvalue()!r}")
    load_run(out)


def finished(method, folder):
    """What is wrong once a run has been gone on with: it is not the whole one, or leaves something behind."""
    out = folder / "run.h5"
    simulate_to(scene_of(method), out, block=17)
    if not same_numbers(content(load_run(out)), content(whole(method))):
        return "not the run that was interrupted"
    left = sorted(path.name for path in folder.iterdir() if path.name not in ("run.h5", "fifo"))
    return f"left behind: {left}" if left else ""


def killed_parts(folder, method):
    """The folder of parts that a killed run leaves."""
    out = folder / "run.h5"

    def kill(t):
        if t > 0.2:
            os.kill(os.getpid(), signal.SIGKILL)

    isolated(lambda: simulate_to(scene_of(method), out, kill, block=17))


@attack(500)
def resumed(count, seed):
    """Interrupted runs, damaged: gone on with bit by bit, begun anew, or refused."""
    findings, rng = [], random.Random(seed)
    methods = ("tsit5", "ros34pw2")
    with tempfile.TemporaryDirectory() as base:
        for method in methods:
            whole(method)
            for kind in ("file", "parts"):
                (Path(base) / kind / method).mkdir(parents=True)
            interrupted(Path(base) / "file" / method / "run.h5", method, 10_000)
            killed_parts(Path(base) / "parts" / method, method)
        for case in range(count):
            method, kind, folder = rng.choice(methods), rng.choice(["file", "parts"]), Path(base) / "case"
            shutil.copytree(Path(base) / kind / method, folder)
            files = sorted(folder.rglob("*.h5"))
            path, by_bytes = rng.choice(files), case % 4 > 0
            if kind == "parts" and case % 8 == 1:
                rng.choice([path.unlink, partial(path.replace, files[0]), partial(shutil.copy, files[0], files[-1])])()
            elif by_bytes:
                path.write_bytes(mutated(path.read_bytes(), rng))
            else:
                edited(path, rng)

            def wrong(method=method, folder=folder, by_bytes=by_bytes):
                found = finished(method, folder)
                return found if by_bytes else ""

            findings += tried(f"resumed {case}", wrong)
            shutil.rmtree(folder)
    return findings


@attack(25)
def kills(count, seed):
    """Runs that are killed before some step on the disk, up to three times in a row: nothing is lost."""
    findings, rng = [], random.Random(seed)
    for method in ("tsit5", "ros34pw2"):
        whole(method)
    with tempfile.TemporaryDirectory() as base:
        for case in range(count):
            method, folder = rng.choice(("tsit5", "ros34pw2")), Path(base) / str(case)
            folder.mkdir()
            if rng.random() < 0.5:
                interrupted(folder / "run.h5", method, rng.choice([10_000, 17]))
            for _ in range(rng.randint(1, 3)):
                isolated(_killed_at, rng.randrange(60), method, folder)
            findings += tried(f"kills {case}", finished, method, folder)
    return findings


EVENTS = {"open", "os.rename", "os.remove", "os.rmdir", "os.mkdir", "shutil.rmtree"}


def _killed_at(step, method, folder):
    left = [step]

    def hook(event, args):
        if event in EVENTS and args and (not isinstance(args[0], str | Path) or ".h5" in str(args[0])):
            left[0] -= 1
            if left[0] < 0:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(hook)
    simulate_to(scene_of(method), folder / "run.h5", block=17)


@attack(50)
def full_disk(count, seed):
    """Files that may not grow: one line that names the run file, and the same command goes on."""
    findings, rng = [], random.Random(seed)
    whole("tsit5")
    with tempfile.TemporaryDirectory() as base:
        for case in range(count):
            folder = Path(base) / str(case)
            folder.mkdir()
            most, block = int(10 ** rng.uniform(1.0, 5.3)), rng.choice([None, 17])
            findings += tried(f"full_disk {case}", _limited, folder, most, block)
    return findings


def _limited(folder, most, block):
    errors, out = io.StringIO(), folder / "run.h5"
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY))
    with contextlib.redirect_stderr(errors), contextlib.redirect_stdout(io.StringIO()):
        if block is None:
            sets = [f"--set={key}={value}" for key, value in (SHORT | {"integration.method": "tsit5"}).items()]
            status = command(["simulate", str(ELLIPTIC / "suspended_wheelset.yaml"), *sets, "--out", str(out)])
        else:
            try:
                status = simulate_to(scene_of("tsit5"), out, block=block)[1]
            except OSError as error:
                status = 2
                print(error.filename, error.strerror, file=errors)
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    said = errors.getvalue()
    if status and (said.count("\n") != 1 or str(out) not in said):
        return f"status {status}, said {said!r}"
    return finished("tsit5", folder)


@attack(200)
def starts(count, seed):
    """A start that is another model's, of another method, or damaged: refused in one line."""
    rng, findings = random.Random(seed), []
    ends = [simulate(scene_of(method), progress=False).end for method in ("tsit5", "ros34pw2")]
    others = [{"speed": 61.0}, {"vehicle.count": 2, "vehicle.spacing": 10.0}, {"contact.friction": 0.4}]
    ends += [simulate(scene_of(**other), progress=False).end for other in others]
    for case in range(count):
        number = rng.randrange(len(ends))
        end, method = ends[number], "ros34pw2" if number == 1 else "tsit5"
        kind = rng.choice(["shape", "shape", "none", "nan", "state"] + ["as it is"] * (number > 1))
        start = end if kind == "as it is" else _spoiled(end, kind, rng)
        findings += tried(f"starts {case} ({number}, {kind})", _begun, method, start)
    return findings


def _spoiled(end, kind, rng):
    if kind == "state":
        state = np.array(end.memory.state)
        return rng.choice([state[:-1], np.append(state, 0.0), state[None], state * np.nan, state.astype(str), "x", 3.0])
    memory = end.memory
    if kind == "nan":
        name = rng.choice(["state", "clock"])
        return end.__class__(**{**vars(end), "memory": memory._replace(**{name: getattr(memory, name) * np.nan})})
    if kind == "none" or end.linear is None:
        name = rng.choice(memory._fields)
        value = None if kind == "none" else rng.choice([getattr(memory, name)[:-1], np.zeros((2, 2))])
        return end.__class__(**{**vars(end), "memory": memory._replace(**{name: value})})
    jacobian = end.linear.jacobian
    name = rng.choice([name for name in jacobian._fields if len(getattr(jacobian, name))])
    linear = end.linear._replace(jacobian=jacobian._replace(**{name: getattr(jacobian, name)[:0]}))
    return end.__class__(**{**vars(end), "linear": linear})


def _begun(method, start):
    simulate(scene_of(method), progress=False, start=start)
    return "begun"


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(ATTACKS))
    parser.add_argument("--share", type=float, default=1.0, help="of each attack's cases")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    wrong = 0
    for name in options.names or ATTACKS:
        function, count = ATTACKS[name]
        tally.clear()
        findings = function(max(1, round(options.share * count)), options.seed)
        print(f"{name}: {', '.join(f'{number} {kind}' for kind, number in sorted(tally.items()))}", flush=True)
        print(*(f"  {finding}" for finding in findings), sep="\n", end="\n" if findings else "")
        wrong += len(findings)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
