"""What every kind of force element says of itself, and laws of the user's own."""

import math
import shutil
import sys
import time
from importlib.metadata import EntryPoint
from types import SimpleNamespace

import numpy as np
import pytest
from numba import njit

import wrcore as wr
from tests.conftest import ELLIPTIC, ROOT
from tests.energy_balance import energy_balance
from tests.equations.test_equations_of_motion import body_state, contact, run  # noqa: F401 (contact is a fixture)
from tests.forces import own_laws
from tests.forces.test_suspension import at_rest, evaluate, model_with, moving
from wrcore.equations.energy import energy_channels
from wrcore.equations.model import workspace
from wrcore.errors import InputError
from wrcore.errors.checked_yaml import GIVEN, read_yaml
from wrcore.forces import kinds, law
from wrcore.forces.kinds import KINDS
from wrcore.kernels import own
from wrcore.run.checkpoints import model_fingerprint
from wrcore.scene.compile import compile_scene
from wrcore.vehicle.element_parts import try_laws

AIR, CATCH = 7.0, 3.0  # N s^2/m^2, N/m
LAWS = "tests/forces/own_laws.py:"

OWN = {"kind": "own_law", "direction": "z", "at": [0, 0, 1.5], "law": f"{LAWS}drag", "parameters": [AIR, CATCH],
       "states": 1}  # fmt: skip


def test_kinds_are_told_apart_in_pictures_and_say_what_they_need():
    assert len({tuple(sorted(kind.mark.items())) for kind in KINDS.values()}) == len(KINDS) >= 10
    for name, kind in KINDS.items():
        assert set(kind.needed) <= set(kind.keys), name


@pytest.mark.parametrize("name", ["drag", "plain_drag"])
def test_a_law_of_ones_own_acts_as_it_says(contact, name):  # noqa: F811
    model = model_with(contact, [{**OWN, "law": LAWS + name}])
    for v in (-0.4, 0.0, 1.5):
        wrench, rates = evaluate(model, moving((0.3, 0.0, v), own=[0.2]))
        np.testing.assert_allclose(wrench[0, :3], [0.0, 0.0, -AIR * v * abs(v)], rtol=1e-14)
        assert rates == pytest.approx([0.0], abs=1e-15)
    for z in (-0.2, 0.3):
        wrench, rates = evaluate(model, at_rest(upper=(0, 0, 2.0 + z), own=[0.0]))
        assert wrench[0, 2] == pytest.approx(-CATCH * min(z, 0.0)) and rates == pytest.approx([z])


def boxed(stiffness):
    box = SimpleNamespace(stiffness=stiffness)  # objects of one kind look alike
    return lambda stretch, speed, states, parameters, rates: box.stiffness * stretch


def compiled(stiffness):
    return njit(lambda stretch, speed, states, parameters, rates: stiffness * stretch)


@pytest.mark.parametrize("defined", [boxed, compiled])
def test_a_function_that_is_defined_anew_is_the_one_that_runs(contact, monkeypatch, defined):  # noqa: F811
    forces = []
    for stiffness in (3.0, 5.0):
        monkeypatch.setitem(GIVEN, "notebook:pull", defined(stiffness))
        model = model_with(contact, [{**OWN, "law": "notebook:pull", "parameters": [], "states": 0}])
        forces.append(evaluate(model, at_rest(upper=(0, 0, 2.5)))[0][0, 2])
    assert forces == pytest.approx([-1.5, -2.5])


def test_a_law_of_ones_own_seen_from_a_wheelset_is_the_same(contact):  # noqa: F811
    one = {**OWN, "at": [0.0, 0.4, 1.0]}
    first, second = (
        model_with(contact, [{**one, "bodies": bodies, "direction": "y"}], spins=(False, True))
        for bodies in (["upper", "lower"], ["lower", "upper"])
    )
    state = at_rest(upper=(0.0, -0.3, 2.0), own=[0.0])
    caught = [evaluate(model, state)[0][0, 1] for model in (first, second)]
    # the upper body is 0.3 m to the right: of the lower one, which the second element is told as its first
    assert caught == pytest.approx([CATCH * 0.3, 0.0])
    state = at_rest(upper=(0.0, 0.3, 2.0), own=[0.0])
    assert [evaluate(model, state)[0][0, 1] for model in (first, second)] == pytest.approx([0.0, -CATCH * 0.3])


def test_energy_with_laws_of_ones_own_adds_up(contact):  # noqa: F811
    items = [{**OWN, "direction": axis} for axis in "xyz"]
    items.append({**OWN, "law": f"{LAWS}dashpot", "parameters": [2.0], "states": 0})
    items.append({**OWN, "law": f"{LAWS}two_in_series", "parameters": [30.0, 5.0, 4.0], "states": 2})
    model = model_with(contact, items)
    state = np.concatenate([
        body_state((0, 0, 2.0), velocity=(0.3, -1.2, 0.4), omega=(0.5, -0.3, 0.2)),
        body_state((0, 0, 1.0), velocity=(0.0, 0.5, -0.2), omega=(-0.1, 0.5, 0.2)), np.zeros(5),
    ])  # fmt: skip
    result = run(model, state, 2.0, points=4001)
    channels = energy_channels(model, workspace(model), result.t, result.states)
    balance = energy_balance(channels, result.t)
    assert np.abs(balance.imbalance).max() < 1e-6 * balance.turned_over[-1]
    assert channels["dissipated_by_dampers_W"].max() > 1.0


def test_an_actuator_pushes_its_first_body_along_and_its_ends_apart(contact):  # noqa: F811
    along = {"kind": "actuator", "direction": "y", "at": [0.1, 0.2, 1.5], "force": 30.0}
    wrench = evaluate(model_with(contact, [along]), moving((0.3, 0.7, 0.0), own=[0.0]))[0]
    np.testing.assert_allclose(wrench[:, :3], [[0.0, 30.0, 0.0], [0.0, -30.0, 0.0]], atol=1e-12)
    line = {"kind": "actuator", "direction": "line", "at": [[0.0, 0.3, 1.6], [0.0, 0.0, 1.2]], "force": 50.0}
    wrench = evaluate(model_with(contact, [line]), at_rest(own=[0.0]))[0]
    np.testing.assert_allclose(wrench[:, :3], [[0.0, 30.0, 40.0], [0.0, -30.0, -40.0]], atol=1e-12)
    for bodies, force in (("upper", "lower"), 30.0), (("lower", "upper"), -30.0):  # the lower one is a wheelset
        model = model_with(contact, [{**along, "at": [0.0, 0.4, 1.0], "bodies": list(bodies)}], spins=(False, True))
        assert evaluate(model, at_rest(own=[0.0]))[0][0, 1] == pytest.approx(force)


def test_a_stop_on_a_line_presses_friction_with_its_force(contact):  # noqa: F811
    stop = {"name": "stop", "kind": "bump_stop", "direction": "line", "at": [[0, 0.6, 2.0], [0, 0.2, 1.0]], "gap": 0.0,
            "stiffness": 500.0}  # fmt: skip
    slips = {"kind": "friction", "direction": "x", "at": [0, 0, 1.5], "mu": 0.2, "normal": "stop", "approach": 1e-3}
    wrench = evaluate(model_with(contact, [stop, slips]), at_rest(upper=(0, 0.3, 2.2), own=[1e-3]))[0]
    assert wrench[0, 0] == pytest.approx(-0.2 * 500.0 * (math.hypot(0.7, 1.2) - math.hypot(0.4, 1.0)), rel=1e-12)


def scene_with(folder, name, items):
    """The suspended wheelset with further elements, of a file where its laws lie in a folder."""
    vehicle, scene = (read_yaml(ELLIPTIC.parent / f"{kind}/suspended_wheelset.yaml") for kind in ("vehicles", "scenes"))
    vehicle["elements"] = [*vehicle["elements"], *items]
    (folder / f"{name}.yaml").write_text(repr(vehicle))  # braces and quotes of Python are YAML, too
    shutil.copy(own_laws.__file__, folder)
    scene["vehicle"] = {"parameters": str(folder / f"{name}.yaml")}
    return wr.load_scene(scene, {"integration.duration": 1.0, "speed": 30.0, "integration.method": "rodas4"})


def rods(extra, count=1):
    """Pairs of elements on a line between the wheelset and the frame."""
    ends = [(side, along) for side in (1.0, -1.0) for along in (2.0, -2.0)] * count
    return [
        {"name": f"rod_{k}", "bodies": ["wheelset", "frame"], "at": [[0, y, 0.46], [x, y, 0.46]], **extra}
        for k, (y, x) in enumerate(ends)
    ]


BUILT_IN = {"kind": "traction_rod", "stiffness": 1e5, "damping": 2e4}
SAME = {"kind": "own_law", "direction": "line", "law": "own_laws.py:rod", "parameters": [1e5, 2e4]}


def test_a_law_of_ones_own_is_the_built_in_one(tmp_path):
    """The same trajectory, compiled and in Python; its energy is where that of others is."""
    variants = {"built_in": BUILT_IN, "compiled": SAME, "python": {**SAME, "law": "own_laws.py:plain_rod"}}
    runs = {}
    for name, item in variants.items():
        scene = scene_with(tmp_path, name, rods(item))
        runs[name] = wr.simulate(scene, {"output.channels": ["pose", "energy"]}, progress=False)
    first, *others = runs.values()
    assert np.ptp(first["wheelset"].y_m) > 1e-3
    for other in others:
        np.testing.assert_allclose(other["wheelset"].y_m, first["wheelset"].y_m, rtol=0, atol=1e-8)
        for channel in ("springs_J", "dissipated_by_dampers_W"):
            values, expected = other["energy"][channel], first["energy"][channel]
            np.testing.assert_allclose(values, expected, rtol=0, atol=1e-4 * np.abs(expected).max())


def test_two_states_that_act_on_each_other_are_one_where_they_are_alike(tmp_path):
    series = {"kind": "damper", "direction": "line", "damping": 2e4, "series_stiffness": 5e6}
    two = {**SAME, "law": "own_laws.py:two_in_series", "parameters": [5e6, 2e4, 1e5], "states": 2}
    one, both = (
        wr.simulate(scene_with(tmp_path, name, rods(item)), progress=False)
        for name, item in (("one", series), ("two", two))
    )
    np.testing.assert_allclose(both["wheelset"].y_m, one["wheelset"].y_m, rtol=0, atol=1e-8)


def test_a_compiled_law_is_as_fast_as_a_built_in_one(tmp_path):
    """Processor time of evaluations in one process, in turns: 1.3 times that of a built-in law at most."""
    from wrcore.equations.equations_of_motion import Equations

    both = [compile_scene(scene_with(tmp_path, n, rods(i, 10))) for n, i in (("built_in", BUILT_IN), ("own", SAME))]
    functions = [(Equations(model), np.repeat(state[None, :], 300, axis=0)) for model, state in both]
    ratios = []
    for _ in range(101):
        spent = []
        for equations, states in functions:
            began = time.process_time()
            equations.at(0.0, states)
            spent.append(time.process_time() - began)
        ratios.append(spent[1] / spent[0])
    assert np.median(ratios) < 1.3


FAULTS = {
    "two_numbers": "expected a force in N, or a tuple of force, stored energy and dissipated power",
    "no_number": "expected finite numbers",
    "words": "expected a force in N, or a tuple of force, stored energy and dissipated power",
    "beyond": "expected a function that works on a test call: IndexError",
    "stumbles": "expected a function that works on a test call: RuntimeError: no such luck",
    "number": "expected a function 'number'",
    "nothing": "expected a function 'nothing'",
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_law_that_does_not_work_is_refused_in_one_line(name):
    with pytest.raises(InputError) as caught:
        try_laws([{**OWN, "name": "mine", "law": LAWS + name}], "test")
    assert caught.value.field == "elements.mine.law" and FAULTS[name] in caught.value.expected
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("law_, expected", [
    ("drag", "an installed entry point of wrcore.laws"), ("no.such.module:drag", "file.py:function"),
    ("lost.py:drag", "an existing file"), ("/usr/lib/lost.py:drag", "an existing file"),
])  # fmt: skip
def test_a_law_that_is_nowhere_is_refused_in_one_line(contact, law_, expected):  # noqa: F811
    with pytest.raises(InputError) as caught:
        model_with(contact, [{**OWN, "law": law_}])
    assert expected in caught.value.expected


def test_a_fault_of_python_under_way_is_said_and_ends_the_run(tmp_path):
    scene = scene_with(tmp_path, "late", rods({**SAME, "law": "own_laws.py:late_fault", "parameters": []}))
    ended = wr.simulate(wr.load_scene(scene, {"initial.y": 0.004}), progress=False)
    assert ended.status == "failed" and ended.t[-1] < 0.5
    assert ended.reason.startswith("own_laws.py:late_fault raised ValueError: too far at t = ")


FILE = """
import numba

@numba.njit
def spring(stretch, speed, states, parameters, rates):
    return {force}
"""


def test_the_text_of_a_file_decides_on_the_model(tmp_path):
    """A file beside the vehicle; its content is in the fingerprint of the model and among the files of the scene."""
    marks, values = [], []
    item = {**SAME, "law": "mine.py:spring", "parameters": [2e5]}
    for force in ("parameters[0] * stretch", "parameters[0] * stretch", "0.5 * parameters[0] * stretch"):
        (tmp_path / "mine.py").write_text(FILE.format(force=force))
        scene = scene_with(tmp_path, "of_file", rods(item))
        assert str((tmp_path / "mine.py").resolve()) in scene.files
        marks.append(model_fingerprint(compile_scene(scene)[0]))
        ended = wr.simulate(scene, {"integration.duration": 0.3}, progress=False)
        values.append(ended["wheelset"].y_m)
    assert marks[0] == marks[1] != marks[2]
    assert np.array_equal(values[0], values[1]) and np.abs(values[0] - values[2]).max() > 1e-6


def test_scenes_without_one_compile_none():
    before = own._addressed.cache_info().misses
    wr.simulate(wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml", {"integration.duration": 0.1}), progress=False)
    assert own._addressed.cache_info().misses == before


def test_a_kind_of_another_package_is_as_a_file_beside_the_others(tmp_path, monkeypatch):
    """A module that an entry point names, here without a package."""
    text = (ROOT / "wrcore" / "forces" / "kinds" / "traction_rod.py").read_text("utf-8")
    (tmp_path / "other_package.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    entry = EntryPoint("other_rod", "other_package", kinds.GROUP)
    monkeypatch.setattr("importlib.metadata.entry_points", lambda **_: [entry])
    before = list(law.LAWS)
    one, other = (
        wr.simulate(scene_with(tmp_path, name, rods({**BUILT_IN, "kind": name})), progress=False)
        for name in ("traction_rod", "other_rod")
    )
    np.testing.assert_array_equal(one["wheelset"].y_m, other["wheelset"].y_m)
    vehicles = [
        scene_with(tmp_path, name, rods({**BUILT_IN, "kind": name})).vehicle for name in ("traction_rod", "other_rod")
    ]
    assert [len(vehicle.elements.own) for vehicle in vehicles] == [0, 1]  # its text is in the model's fingerprint
    del KINDS["other_rod"]
    law.LAWS[:] = before


@pytest.mark.parametrize("text", ["", "KIND = 3", "import not_there", "raise SystemExit(3)", "1 +"])
def test_a_kind_of_a_broken_package_is_one_line(tmp_path, monkeypatch, text):
    (tmp_path / "broken_package.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "broken_package", raising=False)
    entry = EntryPoint("rubber", "broken_package", kinds.GROUP)
    monkeypatch.setattr("importlib.metadata.entry_points", lambda **_: [entry])
    for kind, expected in (("rubber", "entry point broken_package: "), ("traction_rot", "did you mean 'traction_rod'")):
        with pytest.raises(wr.InputError, match=rf"elements\.rod_0\.kind: .*{expected}"):
            scene_with(tmp_path, "broken", rods({**BUILT_IN, "kind": kind}))
    assert "rubber" not in KINDS
