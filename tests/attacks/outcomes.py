"""What must hold for every attack: one line of refusal and nothing left behind, or a whole result; no crash."""

import contextlib
import io
import os
import pickle
import resource
import select
import signal
import traceback
import warnings
from functools import cache
from pathlib import Path

import numpy as np

from tests.conftest import ELLIPTIC
from wrcore.cli import main
from wrcore.errors import InputError
from wrcore.errors.checked_yaml import read_yaml
from wrcore.run.output.files import load_run

LONGEST = 60.0
"""Seconds that an isolated case may take."""

MEMORY = 3 * 2**30
"""Bytes that an isolated case may ask for on top of the memory of this process."""


def fault_of(case, *args):
    """Return what is wrong with a case that runs in a process of its own, an empty string if nothing is.

    The case is a function that returns its fault or an empty string. A refusal (`InputError` of one line) is no fault;
    a traceback, a crash and a hang are.
    """
    reading, writing = os.pipe()
    process = os.fork()
    if process == 0:
        try:
            os.close(reading)
            os.write(writing, pickle.dumps(_answer(case, args)))
        finally:
            os._exit(0)
    os.close(writing)
    answer = b""
    while select.select([reading], [], [], LONGEST)[0] and (piece := os.read(reading, 65536)):
        answer += piece
    os.close(reading)
    if not answer:
        os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)
    return pickle.loads(answer) if answer else "crash or hang"


def _answer(case, args):
    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, resource.RLIM_INFINITY))
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    os.dup2(nothing, 2)
    try:
        return case(*args)
    except InputError as error:
        return "refused in several lines" if "\n" in str(error) else ""
    except BaseException:
        return traceback.format_exc()[-600:]


def run_command(arguments):
    """Exit status, standard output and standard error of a command; a warning counts as a traceback would."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            status = main([str(argument) for argument in arguments])
        except SystemExit as end:  # --help
            status = end.code
    return status, out.getvalue(), err.getvalue()


def check_command(arguments, folder, out):
    """Run a command, return its exit status: refused with one line and nothing left behind, or with a whole result."""
    out = Path(out)
    before = set(Path(folder).iterdir())
    status, _, err = run_command(arguments)
    after = set(Path(folder).iterdir()) - before
    if status == 2:
        assert err.count("\n") == 1 and err.startswith("wrcore: ") and err.endswith("\n") and len(err) < 2000, err
        assert not after, after
        return status
    assert status in (0, 1), (status, err)
    assert all(line.startswith("wrcore: ") for line in err.splitlines()) and after <= {out}, (err, after)
    if after and out.suffix == ".h5":
        check_run(load_run(out))
    out.unlink(missing_ok=True)
    return status


def check_run(run):
    """A run that was kept says how it ended and holds no silent NaN."""
    assert run.status in ("completed", "derailed", "stalled", "failed"), run.status
    assert bool(run.reason) == (run.status != "completed"), (run.status, run.reason)
    assert np.isfinite(run.t).all() and (np.diff(run.t) > 0.0).all()
    for name, channels in run.groups.items():
        for channel, values in channels.items():
            assert len(values) == len(run.t)
            if "/" not in name:
                assert np.isfinite(values).all(), (name, channel)


def same_numbers(one, other):
    """Whether nested tuples, dicts and arrays hold the same bits."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same_numbers(one[key], other[key]) for key in one)
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(same_numbers, one, other))
    if type(one) is not type(other):
        return False
    one, other = np.asarray(one), np.asarray(other)
    return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=one.dtype.kind == "f")


# --------------------------------------------------------------------------------------------------- scenes that spoil

SHORT = 0.004
"""Duration of the runs, s."""

FRICTION = {"left": 0.3, "right": {"arc_length": [0.0, 1.0], "mu": [0.3, 0.2]}, "falling": {"ratio": 0.4, "decay": 0.6}}
DRIVE = {
    "motors": [{"name": "motor", "bodies": ["wheelset", "frame"]}],
    "brakes": [{"name": "brake", "bodies": ["wheelset", "frame"], "torque": {"time": [0, 1], "torque": [1.0, 2.0]}}],
    "controller": {
        "body": "wheelset", "speed": {"arc_length": [0.0, 1.0], "speed": [20.0, 21.0]}, "proportional": 1e3,
        "integral": 10.0, "limit": 1e3, "brake_limit": 0.0,
    },
}  # fmt: skip
TRACK = {
    "gauge": 1.435, "rounding": 4.0,
    "path": [{"tangent": 5.0}, {"transition": 30.0, "shape": "bloss"},
             {"curve": 100.0, "radius": 400.0, "cant": 0.1, "widening": 0.0}],
    "cant_about": "lower_rail", "gauge_depth": 0.014,
    "gradients": [{"gradient": 0.0, "length": 60.0}, {"gradient": 0.01, "radius": 2000.0}],
    "irregularity": {"spectrum": {"level": "low", "seed": 3, "length": 200.0, "begin": -20.0}, "fade_in": 5.0},
}  # fmt: skip
ONE_SIDED = {
    "wheel": {"profile": "S1002", "left": {"profile": "cone:1/20", "rolling_radius": 0.4595},
              "wheelsets": {"wheelset": {"right": {"rolling_radius": 0.46}}}},
    "rail": {"profile": "UIC60-MBench", "inclination": "1/40", "right": {"profile": "60E1", "inclination": "1/20"}},
}  # fmt: skip


@cache
def base_scene():
    """A scene that is over in no time, with every key that a scene can have."""
    data = read_yaml(ELLIPTIC / "suspended_wheelset.yaml")
    data["contact"] |= {"creep": {"model": "she", "least_speed": 1e-3}, "detection_tolerance": 1e-7}
    data["contact"] |= {"friction": FRICTION}
    data["contact"] |= {"material": {"shear_modulus": 8.2e10, "poisson_ratio": 0.28}}
    data["integration"] |= {"duration": SHORT, "rtol": 1e-3, "longest_step": 0.01, "step": 0.0, "method": "tsit5"}
    data["integration"] |= {"baumgarte": {"alpha": 5.0, "beta": 5.0}, "most_steps": 1000}
    data["output"] = {"rate": 500, "channels": ["pose", "velocity", "contact"]}
    data["initial"] = {"y": 0.001, "yaw": 0.0, "bodies": {"wheelset": {"vy": 0.01, "x": 0.0, "roll": 1e-4}}}
    return data | {"drive": DRIVE}


def bounded(data):
    """Make runs short that would be allowed to last: this is about their input."""
    integration = data.get("integration") if isinstance(data, dict) else None
    if isinstance(integration, dict):
        duration, step = integration.get("duration", 1.0), integration.get("step")
        if isinstance(duration, int | float) and SHORT < duration <= 1e5:
            integration["duration"] = SHORT
        if isinstance(step, float) and 0.0 < step < 1e-6:
            integration["step"] = 1e-6
    elif isinstance(data, dict) and integration is None:
        data["integration"] = {"duration": SHORT}
    return data


def simulate_text(folder, text):
    """Exit status of ``wrcore simulate`` for the text of a scene file; see `check_command`."""
    path = folder / "scene.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass"))
    out = folder / "out" / "run.h5"
    return check_command(["simulate", path, "--out", out], folder / "out", out)
