"""Runs that end in a function of the user's own say in which, and when."""

import re

import numpy as np
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC, ROOT
from tests.forces.test_control import LAWS, STEERING, car
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.own_law_failures import blame
from wrcore.errors.checked_yaml import read_yaml
from wrcore.kernels import own
from wrcore.scene.compile import compile_scene

LOST = {"law": f"{LAWS}lost_later", "outputs": ["left_2", "right_2"], "inputs": ["wheelset_2.y_m"], "parameters": [0.3]}


def time_of(run):
    return float(re.search(r"at t = ([0-9.e-]+) s|after t = ([0-9.e-]+) s", run.reason).group().split("=")[1][:-1])


@pytest.mark.parametrize("rate", [None, 100.0])
@pytest.mark.parametrize("method", ["tsit5", "rodas4", "rk4"])
def test_a_control_law_that_is_lost(rate, method):
    # another law, of finite numbers as long as those that it is given are, is not named
    lost = LOST if rate is None else LOST | {"rate": rate}
    changes = {"integration.method": method} | ({"integration.step": 1e-3} if method == "rk4" else {})
    run = wr.simulate(car({"front": STEERING, "rear": lost}, changes), progress=False)
    assert run.status == "failed"
    assert run.reason.endswith(", where own_control.py:lost_later gave a number that is not finite")
    assert time_of(run) == pytest.approx(0.3, abs=2e-3)
    assert np.isfinite(run.end_state).all() or rate


def with_element(law, states=0):
    vehicle = read_yaml(ROOT / "config/vehicles/suspended_wheelset.yaml")
    element = {"name": "own", "kind": "own_law", "direction": "y", "bodies": ["wheelset", "frame"], "at": [0, 0, 0.46],
               "law": law, "states": states}  # fmt: skip
    vehicle["elements"].append(element)
    own_vehicle = {"model": "own", "parameters": vehicle}
    return {"vehicle": own_vehicle, "initial": {"y": 1e-4}, "integration": {"duration": 2.0}}


def test_an_element_and_a_creep_law_that_are_lost():
    irregular = {"track": {"irregularity": {"own": {"law": "tests/forces/own_laws.py:aside", "length": 40.0}}}}
    scene = wr.load_scene(ELLIPTIC / "suspended_wheelset.yaml", with_element("tests/forces/own_laws.py:lost_far"))
    run = wr.simulate({**scene.data, **irregular}, progress=False)
    assert run.status == "failed" and run.t[-1] > 0.05
    assert run.reason.endswith(", where own_laws.py:lost_far gave a number that is not finite")
    law = {"contact": {"creep": {"model": "tests/forces/own_laws.py:lost_in_slip"}, "patch": "moment"}}
    run = wr.simulate(ELLIPTIC / "suspended_wheelset.yaml", **law, initial={"y": 0.0}, **irregular, progress=False)
    assert run.status == "failed" and run.t[-1] > 0.05
    assert run.reason.endswith(", where own_laws.py:lost_in_slip gave a number that is not finite")


def test_laws_that_are_given_what_is_not_finite_are_not_to_blame():
    model, state = compile_scene(car({"front": STEERING}))
    nothing = np.full(len(state), np.nan)
    assert own.not_finite_in(lambda: Equations(model)(0.0, nothing)) == []
    assert blame(model, 0.0, state, nothing) == ""
    model, state = compile_scene(car({"front": STEERING, "rear": LOST}))
    assert "lost_later" in blame(model, 0.3, state, nothing)
    assert blame(model, 0.2, state, 0.0 * state) == ""
