"""Attacks by input: spoiled parts of sweeps, YAML documents, scenes with all keys drawn at random.

Each attack takes a number of cases and a seed and returns its findings, a line each: crashes, hangs, tracebacks, wrong
results without a word. Cases run in processes of their own, one after the other, which may be killed.

    python -m tests.attack_inputs [share of all cases]
"""

import contextlib
import io
import multiprocessing
import random
import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from tests.attacking import mutated
from tests.conftest import ELLIPTIC
from wrcore.cli import main
from wrcore.errors import InputError
from wrcore.integrate.integrator import STALL_ATTEMPTS
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene
from wrcore.sweep.batch import load_table, write_table
from wrcore.sweep.measures import COUNTERS
from wrcore.sweep.plan import load_sweep

LONGEST = 20.0
"""CPU time of one case at most, s. Runs are held to a number of steps instead, as their time is the machine's."""

MOST_STEPS = 3 * STALL_ATTEMPTS
"""Tried steps of a run at most: three times as many as show that one has stalled."""


class Worker:
    """A process that works through cases and is replaced where one kills it.

    Parameters
    ----------
    function : callable
        From a case to a line of text, empty where nothing was found.
    longest : float
        CPU time of a case at most, s; twice as much kills it.
    """

    def __init__(self, function, longest=LONGEST):
        self.function, self.longest, self.process = function, longest, None

    def __call__(self, case):
        if self.process is None:
            self.pipe, inner = multiprocessing.Pipe()
            context = multiprocessing.get_context("fork")
            self.process = context.Process(target=_serve, args=(inner, self.function, self.longest), daemon=True)
            self.process.start()
            inner.close()
        self.pipe.send(case)
        try:
            if self.pipe.poll(20.0 * self.longest):
                return self.pipe.recv()
            self.process.kill()
        except EOFError:
            pass
        self.process.join()
        code, self.process = self.process.exitcode, None
        return f"no answer, exit status {code}"

    def stop(self):
        if self.process is not None:
            self.process.kill()
            self.process.join()
            self.process = None


def _serve(pipe, function, longest):
    while True:
        case = pipe.recv()
        used = resource.getrusage(resource.RUSAGE_SELF)
        soft = int(used.ru_utime + used.ru_stime + 2.0 * longest) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (soft, resource.RLIM_INFINITY))  # SIGXCPU ends what does not end
        began = time.process_time()
        try:
            found = function(case)
        except Exception as error:  # what a person would see as a traceback
            found = f"{type(error).__name__}: {error}"
        seconds = time.process_time() - began
        pipe.send(found or (f"{seconds:.0f} s" if seconds > longest else ""))


def _all(function, cases, longest=LONGEST):
    worker = Worker(function, longest)
    found = [f"{case}: {line}" for case in cases if (line := worker(case))]
    worker.stop()
    return found


# ----------------------------------------------------------------------------------------------------- parts of sweeps

SWEEP = {
    "name": "attack", "scene": str(ELLIPTIC / "suspended_wheelset.yaml"), "sampling": {"kind": "grid"},
    "keys": {"speed": {"from": 20.0, "to": 40.0, "steps": 6}, "contact.detection": {"values": ["planar", "spatial"]}},
    "measures": ["y_rms_m", "y_max_m", "frequency_Hz", "steps"], "begin": 0.0, "window": 0.5, "batch": 3,
}  # fmt: skip


def _parts(folder, sweep, ending, seed):
    """Files of all batches, with numbers that no run gave, and the table that they make together."""
    draw, paths = np.random.default_rng(seed), []
    for batch in range(sweep.batches):
        table = sweep.rows(batch).reset_index()
        table["status"], table["method"] = "completed", "tsit5"
        for name in sweep.data["measures"]:
            table[name] = draw.integers(1, 999, len(table)) if name in COUNTERS else draw.normal(size=len(table))
        table.loc[0, "frequency_Hz"] = np.nan
        paths.append(Path(folder, f"{seed}_{batch}{ending}"))
        write_table(paths[-1], table, sweep)
    return paths


def _spoiled_parts(draw, parts, others):
    """A list of files with one fault, and whether the whole table may still come of it."""
    parts, k = list(parts), draw.randrange(len(parts))
    fault = draw.choice(("missing", "doubled", "foreign", "nothing", "emptied", *5 * ("damaged",)))
    content = bytearray(parts[k].read_bytes())
    if fault == "missing":
        del parts[k]
    elif fault == "doubled":
        parts.insert(draw.randrange(len(parts)), parts[k])
    elif fault == "foreign":
        parts[k] = others[k]
    elif fault == "damaged" and draw.random() < 0.7:
        content = bytearray(mutated(content, draw))
    elif fault == "damaged":
        at = draw.randrange(len(content))
        content[at : at + draw.randrange(4)] = draw.choice((b"1", b"", b"\n", b",", b"nan", b"\xff", b"\r\n"))
    elif fault == "emptied":
        content.clear()
    if fault in ("damaged", "emptied"):
        parts[k] = parts[k].with_name(f"spoiled{parts[k].suffix}")
        parts[k].write_bytes(content)
    return fault, parts


def _gather(folder, seed):
    draw, folder = random.Random(seed), Path(folder)
    ending = draw.choice((".csv", ".h5"))
    parts, others = (sorted(folder.glob(f"{n}_*{ending}")) for n in (1, 2))
    fault, parts = _spoiled_parts(draw, parts, others)
    out, said = folder / "out.csv", io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        status = main(["sweep", str(folder / "1.yaml"), "--out", str(out), "--gather", *map(str, parts)])
    try:
        if status == 2 and not out.exists() and said.getvalue().count("\n") == 1:
            return "nothing wrong, but refused" if fault == "nothing" else ""
        if status == 0 and load_table(out).equals(load_table(folder / "whole.csv")):
            return "" if fault not in ("missing", "doubled", "foreign", "emptied") else f"{fault}, and done"
        return f"{fault}: exit status {status}, {said.getvalue()[:300]!r}"
    finally:
        out.unlink(missing_ok=True)


def sweep_parts(count, seed):
    """``wrcore sweep --gather`` with parts missing, doubled, of another sweep, flipped, cut: refused, or the same."""
    import yaml

    with tempfile.TemporaryDirectory() as folder:
        for number, speed in ((1, 40.0), (2, 41.0)):
            data = SWEEP | {"keys": SWEEP["keys"] | {"speed": {"from": 20.0, "to": speed, "steps": 6}}}
            Path(folder, f"{number}.yaml").write_text(yaml.safe_dump(data))
            sweep = load_sweep(Path(folder, f"{number}.yaml"))
            for ending in (".csv", ".h5"):
                _parts(folder, sweep, ending, number)
        whole = [load_table(part) for part in sorted(Path(folder).glob("1_*.csv"))]
        import pandas as pd

        write_table(Path(folder, "whole.csv"), pd.concat(whole).sort_values("run", ignore_index=True))
        return _all(lambda case: _gather(folder, case), range(seed, seed + count))


# ------------------------------------------------------------------------------------------------------ YAML documents


def _before(k):
    return f"b{k - 1}" if k else "a"


BOMBS = (
    lambda n: "a: " + "[" * n, lambda n: "a: " + "{a: " * n, lambda n: "- " * n, lambda n: "? " * n,
    lambda n: "".join(" " * min(k, 900) + "a:\n" for k in range(min(n, 2000))), lambda n: "a: " + '"' * n,
    lambda n: "".join(f"k{k}: 1\n" for k in range(n)), lambda n: "a: [" + "1," * n, lambda n: "!" * n,
    lambda n: "a: &a [x]\n" + "".join(f"b{k}: &b{k} [*{_before(k)}, *{_before(k)}, *a]\n" for k in range(min(n, 5000))),
    lambda n: "a: &a {x: 1}\n" + "".join(
        f"b{k}: &b{k} {{<<: [{', '.join(9 * ['*' + _before(k)])}]}}\n" for k in range(min(n, 40))),
    lambda n: "a: " + "9" * n, lambda n: "a: 1" + ":30" * n, lambda n: "a: 0." + "0" * n, lambda n: "%TAG ! x\n" * n,
    lambda n: "--- {}\n" * n, lambda n: "a: |\n" + " x\n" * n, lambda n: "a: '" + "\n" * n, lambda n: "\t" * n,
    lambda n: "# " * n, lambda n: "&a " * n,
)  # fmt: skip
"""Documents that grow with a number."""

SPELLINGS = (
    "020",
    "1:30",
    "1_000",
    "0x10",
    "0b1",
    "1e5x",
    "2001-02-03",
    "yes",
    "'20'",
    "20 m/s",
    "20,5",
    "1/40",
    "nan",
    "-",
)


TEARS = (
    b"",
    b"\t",
    b"\r",
    b"&a",
    b"*a",
    b"<<: ",
    b"[",
    b"{",
    b"\x00",
    b"\xff",
    b": ",
    b"- ",
    b"1e999",
    b"\xef\xbb",
    b"!!",
)


def _document(draw):
    """Text of a file that may be a scene, and whether it still says the same as the scene did."""
    text = (ELLIPTIC / f"{draw.choice(('wheelset', 'suspended_wheelset', 'trailer_vehicle'))}.yaml").read_text()
    kind = draw.choice(("bomb", "bomb", "spelling", "editor", "torn", "torn", "added"))
    if kind == "bomb":
        return kind, draw.choice(BOMBS)(draw.choice((30, 3000, 60_000, 300_000))).encode()
    if kind == "spelling":
        return kind, text.replace("speed: 20.0", f"speed: {draw.choice(SPELLINGS)}").encode()
    if kind == "added":
        return kind, (text + draw.choice(BOMBS)(draw.choice((5, 60))) + "\n").encode()
    if kind == "editor":
        changed = draw.choice((text, "\ufeff" + text, text.replace("\n", "\r\n"), text.replace("\n", "\r")))
        return kind, changed.encode()
    content = bytearray(text.encode())
    for _ in range(draw.randrange(1, 6)):
        at = draw.randrange(len(content))
        content[at : at + draw.randrange(6)] = draw.choice(TEARS)
    return kind, bytes(content)


def _read(folder, seed):
    kind, content = _document(random.Random(seed))
    path = Path(folder, "scenes", "scene.yaml")
    path.write_bytes(content)
    try:
        speed = load_scene(path).data["speed"]
    except InputError as error:
        line = str(error)
        return repr(line[:300]) if "\n" in line or len(line) > 1000 or kind == "editor" else ""
    return f"{kind}: speed {speed}" if kind == "spelling" else ""


def yaml_documents(count, seed):
    """Scene files that are bombs, torn, misspelt, or come from another editor: read as meant, or one line."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "scenes").mkdir()
        Path(folder, "vehicles").symlink_to(ELLIPTIC.parent / "vehicles")
        return _all(lambda case: _read(folder, case), range(seed, seed + count))


# ------------------------------------------------------------------------------------------------------- random scenes

PAIRS = (("tsit5", "rodas4"), ("rk45", "ros34pw2"), ("tsit5", "ros34pw2"), ("rk4", "rodas4"))
"""Integration methods that are compared."""

SAME_FOR, SAME_Y = 0.02, 5e-5
"""Both of a pair are this close (m) for this long (s)."""


def random_scene(draw):
    """A scene file and changes to all its keys, within what the schema allows."""

    def log(low, high):
        return float(np.exp(draw.uniform(np.log(low), np.log(high))))

    source = (
        ELLIPTIC / f"{draw.choice(('wheelset', 'suspended_wheelset', 'suspended_wheelset', 'trailer_vehicle'))}.yaml"
    )
    law = draw.choice((*3 * ("table",), *2 * ("she", "polach", "linear"), "fastsim"))
    changes = {
        "speed": log(3.0, 120.0), "initial.y": draw.uniform(-0.012, 0.012), "initial.yaw": draw.uniform(-0.02, 0.02),
        "wheel.profile": draw.choice(("S1002", "S1002", "cone:1/20")),
        "rail.profile": draw.choice(("60E1", "54E1", "49E1")),
        "rail.inclination": draw.choice((0, "1/40", "1/20")), "track.gauge": draw.uniform(1.425, 1.46),
        "contact.detection": draw.choice(("planar", "spatial", "auto")), "contact.friction": log(0.01, 0.9),
        "contact.patch": draw.choice(("moment", "maximum")), "contact.creep.model": law,
        "contact.normal.damping.c_e": draw.uniform(0.3, 1.0), "contact.normal.damping.v0": log(1e-3, 1.0),
        "contact.material.shear_modulus": log(2e10, 2e11), "contact.creep.least_speed": log(1e-3, 0.1),
        "contact.material.poisson_ratio": 0.28 if law == "table" else draw.uniform(0.0, 0.5),
        "integration.baumgarte.alpha": log(1.0, 100.0), "integration.baumgarte.beta": log(1.0, 100.0),
        "integration.rtol": log(1e-6, 1e-4), "integration.atol": log(1e-9, 1e-7), "integration.duration": 0.5,
        "output.rate": draw.choice((50.0, 200.0, 1000.0)), "output.channels": ["pose"],
    }  # fmt: skip
    if draw.random() < 0.3:
        spectrum = {"level": draw.choice(("low", "high")), "seed": draw.randrange(99), "length": 100.0, "begin": 2.0}
        changes["track.irregularity"] = {"spectrum": spectrum}
    return source, changes


def _run_pair(seed):
    draw = random.Random(seed)
    source, changes = random_scene(draw)
    methods, runs = draw.choice(PAIRS), []
    for method in methods:
        try:
            runs.append(simulate(load_scene(source, {**changes, "integration.method": method}), progress=False))
        except InputError as error:
            return repr(str(error)) if "\n" in str(error) or runs else ""  # both are refused, or none is
        run = runs[-1]
        tried = run.counters["steps"] + run.counters["rejected"]
        if tried > MOST_STEPS:
            return f"{method}: {run.status} after {tried} tried steps"
        if bool(run.reason) != (run.status != "completed") or not np.isfinite(run.t).all():
            return f"{method}: {run.status} because {run.reason!r}"
        if not all(np.isfinite(values).all() for name, group in run.groups.items() for values in group.values()):
            return f"{method}: {run.status}, and numbers that are not finite"
    count = min(len(run.t[run.t <= SAME_FOR]) for run in runs)
    for name in runs[0].groups:
        one, two = (run[name].y_m[:count] for run in runs)
        if count and np.max(np.abs(one - two)) > SAME_Y:
            return f"{methods}: {name} differs by {np.max(np.abs(one - two)):.2g} m within {SAME_FOR} s"
    return ""


def random_scenes(count, seed):
    """Scenes with all keys at random, 0.5 s by two methods: none takes long, all say how they end and begin alike."""
    return _all(_run_pair, range(seed, seed + count), longest=10.0 * LONGEST)


ATTACKS = {"sweep parts": (1400, sweep_parts), "YAML documents": (200, yaml_documents), "scenes": (1000, random_scenes)}
"""Number of cases and function of each attack."""


if __name__ == "__main__":
    for name, (number, attack) in ATTACKS.items():
        number, began = round(number * float((sys.argv[1:] or ["1"])[0])), time.perf_counter()
        findings = attack(number, 0)
        print(f"{name}: {len(findings)} findings in {number} cases, {time.perf_counter() - began:.0f} s")
        print("".join(f"    {line}\n" for line in findings), end="", flush=True)
