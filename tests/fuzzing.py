"""What the fuzz tests share: values that do not belong, ways to spoil a document, and what must hold afterwards."""

import contextlib
import copy
import datetime
import io
import math
import os
import warnings
from functools import cache
from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from tests.conftest import ELLIPTIC
from wrcore.cli import main
from wrcore.errors.checked_yaml import read_yaml
from wrcore.run.output.files import load_run

STATUSES = {"completed", "derailed", "stalled", "failed"}


SHARES = 1300
"""Sum of the shares of all tests."""


def examples(share):
    """Hypothesis settings of a test that takes its share (of `SHARES`) of all inputs; see ``tests/test_fuzz.py``."""
    total = int(os.environ.get("WRCORE_FUZZ", "600"))
    return settings(
        max_examples=max(1, round(total * share / SHARES)), derandomize=True, deadline=None, database=None,
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip


numbers = st.one_of(
    st.sampled_from(
        [math.nan, math.inf, -math.inf, 0, -0.0, -1, 1e-320, 1e-12, -1e-3, 1e6, 1e300, -1e300, 10**400, 0.5]
    ),
    st.floats(),
    st.integers(),
    st.floats(-2.0, 2.0),
)
"""Numbers of every size and sign, and those that are none."""

texts = st.one_of(
    st.text(max_size=12),
    st.sampled_from(["", " ", "nan", "1e999", "1/0", "0x10", "../..", "/", "\x00", "1_0", "~", "é"]),
)
leaves = st.one_of(
    st.none(), st.booleans(), numbers, texts, st.just(datetime.date(2001, 2, 3)), st.just(b"\xff\x00"), st.just({1, 2})
)
junk = st.recursive(
    leaves,
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(texts, inner, max_size=3)),
    max_leaves=5,
)
"""Whatever YAML can hold."""


def places(document, path=()):
    """Paths of all values in a nested document."""
    yield path
    items = (
        document.items() if isinstance(document, dict) else enumerate(document) if isinstance(document, list) else ()
    )
    for key, value in items:
        yield from places(value, (*path, key))


@st.composite
def spoiled(draw, document, most=3):
    """The document with one to ``most`` faults: a value replaced or scaled, a key or item left out or added."""
    document = copy.deepcopy(document)
    for _ in range(draw(st.integers(1, most))):
        *path, last = draw(st.sampled_from([place for place in places(document) if place] or [("x",)]))
        parent = document
        for key in path:
            parent = parent[key]
        fault = draw(st.sampled_from(["replace", "scale", "drop", "add", "number"]))
        if fault == "drop":
            parent.pop(last, None) if isinstance(parent, dict) else parent.pop(last)
        elif fault == "add" and isinstance(parent, dict):
            parent[draw(texts)] = draw(junk)
        elif fault == "add":
            parent.append(draw(junk))
        elif fault == "scale" and type(parent[last]) in (int, float) and abs(parent[last]) < 1e300:
            parent[last] *= draw(st.sampled_from([-1, 0, 1e-3, 0.5, 1.1, 2, 10, 1e3, 1e6, 1e150]))
        elif fault == "number":
            parent[last] = draw(numbers)
        else:
            parent[last] = draw(junk)
    return document


ANY = st.characters()


@st.composite
def spoiled_text(draw, text, alphabet=ANY):
    """The text cut, with parts doubled, replaced or removed."""
    for _ in range(draw(st.integers(1, 4))):
        first = draw(st.integers(0, len(text)))
        last = min(len(text), first + draw(st.integers(0, 12)))
        insert = draw(
            st.one_of(st.text(alphabet, max_size=4), texts, st.sampled_from(["nan", "inf", "\t", "1e999", ",,"]))
        )
        text = draw(
            st.sampled_from(
                [text[:first], text[:first] + insert + text[last:], text[:last] + text[first:], text[first:]]
            )
        )
    return text


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
    """Run a command: it is refused with one line and leaves nothing behind, or it leaves a whole result.

    Returns
    -------
    int
        The exit status.
    """
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
    assert run.status in STATUSES and bool(run.reason) == (run.status != "completed"), (run.status, run.reason)
    assert np.isfinite(run.t).all() and (np.diff(run.t) > 0.0).all()
    for name, channels in run.groups.items():
        for channel, values in channels.items():
            assert len(values) == len(run.t)
            if "/" not in name:
                assert np.isfinite(values).all(), (name, channel)


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


@cache
def base_scene():
    """A scene that is over in no time, with every key that a scene can have."""
    data = read_yaml(ELLIPTIC / "suspended_wheelset.yaml")
    data["contact"] |= {"creep": {"model": "she", "least_speed": 1e-3}, "detection_tolerance": 1e-7}
    data["contact"] |= {"friction": FRICTION}
    data["contact"] |= {"material": {"shear_modulus": 8.2e10, "poisson_ratio": 0.28}}
    data["integration"] |= {"duration": SHORT, "rtol": 1e-3, "longest_step": 0.01, "step": 0.0, "method": "tsit5"}
    data["integration"] |= {"baumgarte": {"alpha": 5.0, "beta": 5.0}}
    data["output"] = {"rate": 500, "channels": ["pose", "velocity", "contact"]}
    data["initial"] = {"y": 0.001, "yaw": 0.0, "bodies": {"wheelset": {"vy": 0.01, "x": 0.0, "roll": 1e-4}}}
    return data | {"drive": DRIVE}


def bounded(data):
    """Runs that would be allowed to last are made short: this is about their input."""
    integration = data.get("integration") if isinstance(data, dict) else None
    if isinstance(integration, dict):
        duration = integration.get("duration", 1.0)
        if isinstance(duration, int | float) and SHORT < duration <= 1e5:
            integration["duration"] = SHORT
        step = integration.get("step")
        if isinstance(step, float) and 0.0 < step < 1e-6:
            integration["step"] = 1e-6
    elif isinstance(data, dict) and integration is None:
        data["integration"] = {"duration": SHORT}
    return data


def simulate_text(folder, text):
    path = folder / "scene.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass"))
    out = folder / "out" / "run.h5"
    return check_command(["simulate", path, "--out", out], folder / "out", out)
