"""Attack on the public functions and methods: arguments of a valid call are replaced by what a person may mistype.

What a docstring says of an argument is the measure: a call that goes through although its docstring excludes the value
is wrong. `InputError` is an answer, and so is Python's own TypeError for missing and unknown arguments.
"""

import decimal
import fractions
import inspect
import math
import os
import re
import tempfile
from functools import cache
from pathlib import Path

import numba
import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

import wrcore as wr
from tests.attacks.generator import examples
from tests.attacks.outcomes import fault_of
from tests.conftest import ELLIPTIC
from wrcore.creep import table
from wrcore.errors import short

SCENE = ELLIPTIC / "suspended_wheelset.yaml"
SHORT = {"integration.duration": 0.4, "output.rate": 1000.0, "contact.creep.model": "linear"}


@cache
def things():
    """What valid calls are made of, once for all cases."""
    wheel, rail = wr.named_profile("S1002", "wheel"), wr.named_profile("60E1", "rail", 1 / 40)
    pair, scene = wr.WheelsetOnTrack.alike(wheel, rail), wr.load_scene(SCENE, SHORT)
    run = wr.simulate(scene, progress=False)
    run.save("run.h5")
    signal = wr.Signal("t_s", run.t, {"wheelset.y_m": run["wheelset"].y_m + 1e-5 * np.sin(90.0 * run.t)})
    signal.to_pandas().to_csv("signal.csv")
    return {
        "wheel": wheel, "rail": rail, "pair": pair, "scene": scene, "run": run, "table": wr.ensure_table(),
        "signal": signal,
        "session": wr.start(scene, contact__friction={"left": 0.3, "right": 0.3}),
        "rolling": wr.RollingContact(1.0, level=6), "patch": wr.patch(pair, load=5e4)[0],
        "assessed": wr.assess(run), "response": wr.frequency_response(scene, ["level"], ["wheelset.z_m"], [1.0, 2.0]),
    }  # fmt: skip


@cache
def calls():
    """Public functions and methods, by name, each with the arguments of a call that is fast."""
    the = things()
    run, pair, scene = the["run"], the["pair"], the["scene"]
    wheel = {"run": run, "wheelset": "wheelset", "side": "left"}
    creep = {"a": 6e-3, "b": 4e-3, "normal_force": 5e4, "xi": [0.0, 1e-3], "eta": 0.0, "phi": 0.0, "mu": 0.3,
             "shear_modulus": 8.2e10, "psi": 0.0}  # fmt: skip
    sweep = {"name": "s", "scene": str(SCENE), "set": SHORT, "sampling": {"kind": "grid"},
             "keys": {"speed": {"values": [20]}}, "measures": ["y_max_m"], "begin": 0.0}  # fmt: skip
    shorter = {key: value for key, value in SHORT.items() if key != "output.rate"}
    plan = {"name": "p", "scene": str(SCENE), "distance": 1e4, "begin": 0.0, "rate": 1000.0, "set": shorter}
    plan["scenes"] = [{"share": 1.0}]
    since = {"run": run, "begin": 0.0}
    found = {
        "assess": {**since, "standard": "EN 14363", "freight": False},
        "compare": {"a": run, "b": run},
        "fit": {"scene": scene, "keys": {"initial.y": (0.001, 0.004)}, "signals": the["signal"], "band": (None, 50.0),
                "noise": {"wheelset.y_m": 1e-5}, "start": {"initial.y": 0.002}, "threads": 1, "most_steps": 1,
                "progress": False},
        "fit_path": {"signal": wr.Signal("s_m", np.arange(100.0), {"k_per_m": np.zeros(100)}), "curvature": "k_per_m",
                     "superelevation": None, "tolerance": 1e-4, "shortest": 20.0},
        "read_signal": {"path": "signal.csv", "channels": {"wheelset.y": "wheelset.y_m"}, "axis": "t_s", "rate": 100.0,
                        "units": {"wheelset.y": "m"}},
        "Signal": {"axis": "t_s", "x": np.array([0.0, 0.1]), "values": {"a": np.zeros(2)}, "units": {"a": "m"},
                   "source": "a"},
        "conicity_curve": {"pair": pair, "amplitudes": [0.003], "roll": False, "step": 1e-4},
        "contact_table": {"pair": pair, "shifts": [0.0], "yaws": [0.0], "wheel_load": 5e4, "detection": "spatial",
                          "patch": "moment"},
        "contacts": {"pair": pair, "y": [0.0], "z": None, "roll": None, "yaw": 0.0, "load": 5e4, "speed": 20.0,
                     "omega": None, "vy": 0.0, "yaw_rate": 0.0, "mu": 0.3, "detection": "spatial", "patch": "moment"},
        "creep_force": {"model": "polach", **creep, "nu": 0.28, "table": None},
        "creep_power": wheel, "wear_number": {**wheel, "spin": True}, "wheel_forces": wheel, "wheel_table": since,
        "wheelset_channels": {"run": run, "wheelset": "wheelset"},
        "critical_speeds": {"scenes": scene, "speeds": [40.0, 70.0]}, "modes": {"scene": scene, "speed": 40.0},
        "damage_table": {**since, "shear_yield": 3e8}, "plot_shakedown": {**since, "shear_yield": 3e8},
        "draw": {"source": run, "scene": scene, "factor": 10.0, "begin": 0.0, "end": 1.0},
        "ensure_table": {"nu": 0.28, "planes": "ellipse", "tolerance": 0.005, "progress": None},
        "evolve": {"plan": plan, "folder": "worn", "say": None, "changes": {}, "threads": 1, "spent": {}},
        "example": {"name": "wheelset"}, "list_profiles": {},
        "first_touch": {"pair": pair, "shifts": [0.0], "roll": True},
        "frequency_response": {"scene": scene, "inputs": ["level"], "outputs": ["wheelset.z_m"], "frequencies": [1.0],
                               "speed": 20.0},
        "hunting_frequency": {"t": [0.0, 1.0, 2.0, 3.0], "y": [1.0, -1.0, 1.0, -1.0]},
        "limit_cycles": {"scene": scene, "speeds": [40.0], "settling": wr.Settling(window=0.05, longest=0.1),
                         "disturbances": [0.001], "resolution": 1.0},
        "load_run": {"path": "run.h5"}, "load_runs": {"paths": ["run.h5"]}, "write_run": {"path": "b.h5", "run": run},
        "load_scene": {"scene": SCENE, "overrides": SHORT, "speed": 30.0}, "load_sweep": {"source": sweep},
        "local_wear": {**since, "law": "sheffield", "width": 2.5e-4},
        "named_profile": {"spec": "60E1", "kind": "rail", "inclination": 0.025, "window": 1e-3, "spacing": 5e-5},
        "patch": {"source": pair, "y": 0.0, "yaw": 0.0, "roll": None, "z": 0.4597, "load": 5e4, "side": "left",
                  "speed": 20.0, "omega": None, "vy": 0.0, "yaw_rate": 0.0, "mu": 0.3, "method": "exact",
                  "resolution": "coarse", "slip": "surfaces", "load_by": "vertical"},
        "plot_creep_force": {"models": ["linear"], "a": 5e-3, "b": 5e-3, "normal_force": 5e4, "mu": 0.3, "spin": 0.5,
                             "largest": 8e-3},
        "plot_frequency_response": {"table": the["response"]},
        "plot_pair": {"pair": pair, "shifts": [0.0]}, "plot_run": {"run": run, "channels": ["wheelset.y_m"]},
        "plot_wheel_on_rail": {"source": pair, "side": "left", "load": 5e4, "y": 0.0},
        "quasi_static_curving": {"scene": scene, "radii": [2000.0], "cant": 0.05, "speed": 20.0, "widening": 0.0,
                                 "cant_deficiency": None}, "roll_coefficient": {"scene": scene, "cant": 0.05},
        "run_sweep": {"source": sweep, "threads": 1, "progress": None},
        "section_statistics": {"assessments": [the["assessed"]], "k": 1.0},
        "speed_ramp": {"scene": scene, "start": 60.0, "end": 59.9, "rate": 1.0, "disturbances": [0.001],
                       "settling": wr.Settling(window=0.05, longest=0.1)},
        "simulate": {"scene": scene, "overrides": {}, "progress": None, "start": "initial", "speed": 20.0},
        "start": {"scene": scene, "overrides": {}, "start": "initial", "record": True, "speed": 20.0},
        "simulate_many": {"scenes": [scene], "progress": None, "threads": 1},
        "simulate_to_accuracy": {"scene": scene, "accuracy": 1e-3, "of": "y", "progress": None},
        "Settling": {"window": 2.0, "longest": 30.0, "rate": 500.0, "method": "auto", "rtol": 1e-5},
        "RollingContact": {"g": 1.0, "psi": 0.0, "nu": 0.28, "level": 6},
        "WheelsetOnTrack": {"left": pair.left, "right": pair.right, "half_distance": 0.75, "gauge": 1.435},
    }  # fmt: skip
    found = {name: (getattr(wr, name), arguments) for name, arguments in found.items()}
    solved = {"xi": 0.1, "eta": [0.0], "phi": 0.0, "tolerance": 1e-3}
    alike = {"wheel": the["wheel"], "rail": the["rail"], "gauge": 1.435, "rolling_radius": 0.46, "half_distance": 0.75}
    return found | {
        "WheelsetOnTrack.alike": (wr.WheelsetOnTrack.alike, alike), "CreepTable()": (the["table"], creep),
        "RollingContact.solve": (the["rolling"].solve, solved), "Patch.plot": (the["patch"].plot, {"axes": None}),
        "RollingContact.field": (the["rolling"].field, solved | {"eta": 0.0}),
        "RollingContact.solve_many": (the["rolling"].solve_many, {"creepages": [[0.1, 0.0, 0.0]], "tolerance": 1e-3}),
        "Run[]": (run.__getitem__, {"group": "wheelset"}), "Run.save": (run.save, {"path": "b.h5"}),
        "Run.to_pandas": (run.to_pandas, {"tidy": True}), "Run.plot": (run.plot, {"*": "wheelset.y_m"}),
        "Session.step": (the["session"].step, {"dt": 0.001, "inputs": {"friction.left": 0.3}}),
        "Session.set": (the["session"].set, {"name": "friction.left", "value": 0.2}),
        "Session.channels": (the["session"].channels, {"*": "wheelset.y_m"}),
        "compare()": (wr.compare, {"a": run, "b": the["signal"], "band": (1.0, 50.0), "sections": 0.1,
                                   "limits": {"y_m": {"rms": (1.0, 1.0)}}}),
        "Signal.filtered": (the["signal"].filtered, {"band": (None, 50.0)}),
        "Signal.resampled": (the["signal"].resampled, {"step": 0.01}),
        "Signal.shifted": (the["signal"].shifted, {"offset": 1.0}),
        "Signal.cut": (the["signal"].cut, {"begin": 0.1, "end": 0.3}),
        "Signal.over_distance": (the["signal"].over_distance, {"distance": 20.0}),
        "Signal.aligned": (the["signal"].aligned, {"run": run, "channel": "wheelset.y_m", "band": (None, 50.0)}),
        "Run.wheel_forces": (run.wheel_forces, {"wheelset": "wheelset"}),
    }  # fmt: skip


def mistakes():
    """Values that are mistakes for most arguments; new ones each time, as some can be read only once."""
    inside = []
    inside.append(inside)
    the = things()
    texts = ["", "x", "1.0", "ä€𝄞", "a\0b", "\ud800", "a" * 5000, "none/none.yaml", "run.h5", "left", ".", "/"]
    numbers = [0, -1, 1, 7, 2**70, 10**400, -(10**5000), 1e300, -1e300, 5e-324, 0.5, -0.5, math.nan, math.inf, True,
               -math.inf, False, 1j, decimal.Decimal(1), fractions.Fraction(1, 3), np.float32(math.nan), np.int64(3),
               np.float64(0.01), np.array(3.0), np.datetime64("2020-01-01")]  # fmt: skip
    lists = [[], (), {}, set(), [None], [1, "a"], [[1, 2], [3]], {"a": 1}, {1: 2}, {"a": {}}, [math.nan], inside,
             [math.inf], range(0), range(3), iter([1.0]), (x for x in "ab"), [1e300], [-1.0, 2.0], ["x"],
             ["a\0b"]]  # fmt: skip
    arrays = [np.zeros(0), np.zeros((2, 3)), np.zeros((2, 2, 2)), np.array(["a"]), np.array([1j]), np.ones(5, np.int8),
              np.array([math.nan, 1.0]), np.array([True]), np.array([object()]), np.zeros(3, "S4"), np.full(7, 1e300),
              pd.Series([1.0, 2.0]), pd.Series(["a"]), pd.DataFrame({"a": [1.0]})]  # fmt: skip
    others = [None, object(), ..., print, int, b"bytes", bytearray(3), Path("none.h5"), Path("/"), Path(), numba, wr,
              wr.InputError, wr.simulate, wr.Run, the["run"], the["pair"], the["scene"], the["table"], the["wheel"],
              slice(3), memoryview(b"a"), Exception("a")]  # fmt: skip
    return [texts, numbers, lists, arrays, others]


def spoiled(draw):
    """A function, the arguments of a call of it with a mistake or two, and what these are."""
    name = draw.choice(sorted(calls()))
    function, arguments = calls()[name]
    arguments, said = dict(arguments), []
    for _ in range(draw.choice((1, 1, 1, 2))):
        kind = draw.choice(("value",) * 12 + ("missing", "unknown"))
        if kind == "unknown" or not arguments:
            arguments["no_such"] = 1
        elif kind == "missing":
            del arguments[draw.choice(sorted(arguments))]
        else:
            argument, value = draw.choice(sorted(arguments)), draw.choice(draw.choice(mistakes()))
            if not (callable(value) and argument in ("progress", "say", "also")):  # what it does is the caller's
                arguments[argument] = value
                said.append((argument, value))
    return name, function, arguments, said


def documented(function):
    """What the docstring says that each argument is."""
    found = {}
    for names, kind in re.findall(
        r"^ *([\w, *]+) : (.+)$", (inspect.getdoc(function) or "").partition("Returns")[0], re.M
    ):
        found |= dict.fromkeys(names.replace("*", "").split(", "), kind)
    return found


def excluded(kind, value):
    """Whether a docstring's word for an argument leaves no room for a value."""
    if value is None:
        return "optional" not in kind and "None" not in kind
    number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    if kind.startswith("{") and "mapping" not in kind:
        return not (isinstance(value, str) and f'"{value}"' in kind)
    if re.match(r"(float|int)(,|$)", kind):
        return not number or isinstance(value, complex | np.complexfloating) or math.isnan(value)
    if re.match(r"(array_like|float or array_like)", kind):
        return isinstance(value, str | bytes | dict | complex) or number and math.isnan(value) or value is numba
    for word, one in (("Run", wr.Run), ("WheelsetOnTrack", wr.WheelsetOnTrack), ("Settling", wr.Settling)):
        if re.match(rf"{word}(,|$)", kind):
            return not isinstance(value, one)
    if re.match(r"(str|path-like)(,|$)", kind):
        return not isinstance(value, str | Path) and type(value).__name__ not in kind
    return bool(re.match(r"bool(,|$)", kind)) and not isinstance(value, bool | np.bool_)


def wrong(draw):
    """What is wrong with how a call went; empty where it was refused, or nothing speaks against it."""
    os.chdir(tempfile.mkdtemp(dir="."))
    os.symlink("../run.h5", "run.h5")
    name, function, arguments, said = spoiled(draw)
    more = (arguments.pop("*"),) if "*" in arguments else ()
    try:
        function(*more, **arguments)
    except TypeError as error:
        last = error.__traceback__
        while last.tb_next:
            last = last.tb_next
        own = last.tb_frame.f_code.co_name in ("front", "wrong", "inner") or "no_such" in str(error)
        if not own:
            raise
        return ""
    except BaseException as error:
        error.add_note(f"{name} {short(said)}")
        raise
    kinds = documented(function)
    silent = [argument for argument, value in said
              if arguments.get(argument) is value and excluded(kinds.get(argument, "optional"), value)]  # fmt: skip
    return f"{name}: nothing was said of {silent} in {short(said)}" if silent else ""


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """Working directory of valid calls, each of which ran once; no creep table of another material is built here."""

    def no_table(*_):
        raise wr.InputError("misuse", "", "expected the table at hand")

    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("calls"))
        for function, arguments in calls().values():  # loads kernels once for all cases
            arguments = dict(arguments)
            function(*((arguments.pop("*"),) if "*" in arguments else ()), **arguments)
        patch.setattr(table, "build_table", no_table)
        yield
    things.cache_clear()
    calls.cache_clear()


@examples(100)
@given(draw=st.randoms(use_true_random=False))
def test_call_with_a_mistake_is_refused(home, draw):
    assert fault_of(wrong, draw) == ""
