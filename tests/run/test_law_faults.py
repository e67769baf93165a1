"""Runs whose laws of the user raise errors, are interrupted, or write and return what they may not."""

import os
import signal

import numpy as np
import pytest
import yaml

import wrcore as wr
from tests.conftest import ELLIPTIC
from wrcore.errors import InputError
from wrcore.errors.checked_yaml import read_yaml
from wrcore.scene.compile import compile_scene

SCENE = ELLIPTIC / "suspended_wheelset.yaml"
QUICK = {"contact.patch": "moment", "speed": 40.0, "initial.y": 0.003, "integration.duration": 0.1}
ELEMENT = "def law(stretch, speed, states, parameters, rates):\n"
CONTROL = "def law(t, inputs, states, parameters, outputs, following):\n"
COUNTED = f"N = [0]\n\n\n{ELEMENT}    N[0] += 1\n"
LATE = "    if abs(stretch) < 2e-3:\n        return 0.0\n"


def scene_of(folder, text, compiled=False, states=0, control=None, **changes):
    """A wheelset with a law of an element, or of a sampled control."""
    vehicle = read_yaml(ELLIPTIC.parent / "vehicles/suspended_wheelset.yaml")
    at = {"direction": "y", "bodies": ["wheelset", "frame"], "at": [0, 0, 0.46]}
    vehicle["elements"].append({"name": "push", "kind": "actuator", **at})
    if control is None:
        mine = {"name": "mine", "kind": "own_law", "law": "law.py:law", "parameters": [1e6, 2.0], "states": states}
        vehicle["elements"].append(mine | at)
    (folder / "v.yaml").write_text(yaml.safe_dump(vehicle))
    head = "import numpy as np\nimport os, signal\nfrom numba import njit\n\n\n"
    (folder / "law.py").write_text(head + ("@njit\n" if compiled else "") + text)
    if control is not None:
        law = {"law": str(folder / "law.py:law"), "inputs": ["wheelset.y_m"], "outputs": ["push"]}
        changes = {"control": {"c": law | {"parameters": [0.0], "rate": 50} | control}}
    return wr.load_scene(SCENE, {"vehicle.parameters": str(folder / "v.yaml"), **QUICK, **changes})


@pytest.mark.parametrize("error", ["ValueError('x')", "SystemExit(5)", "GeneratorExit", "MemoryError", "os._Exit"])
@pytest.mark.parametrize("control", [None, {}])
def test_error_in_a_plain_law_fails_the_run(tmp_path, error, control):
    late = LATE if control is None else "    if t < 0.03:\n        return\n"
    text = (ELEMENT if control is None else CONTROL) + late + f"    raise {error}\n"
    run = wr.simulate(scene_of(tmp_path, text, control=control), progress=False)
    name = error.split("(")[0] if "_" not in error else "AttributeError"
    assert run.status == "failed" and run.reason.startswith(f"law.py:law raised {name}") and "\n" not in run.reason
    assert len(run.t) < 10 and np.isfinite(run["wheelset"].y_m).all()


def test_error_in_a_trial_step_alone_fails_the_run(tmp_path):
    """A shorter step might avoid the error: the run would go on and say nothing."""
    text = (
        "N = [0]\n\n\n"
        + ELEMENT
        + "    N[0] += 1\n    if N[0] == 200:\n        raise ValueError('once')\n    return 0.0\n"
    )
    run = wr.simulate(scene_of(tmp_path, text), progress=False)
    assert run.status == "failed" and "law.py:law raised ValueError: once at t = " in run.reason


@pytest.mark.parametrize("how", ["raise KeyboardInterrupt", "os.kill(os.getpid(), signal.SIGINT)"])
def test_interrupt_in_a_plain_law_interrupts(tmp_path, how):
    text = COUNTED + f"    if N[0] == 300:\n        {how}\n    return 0.0\n"
    with pytest.raises(KeyboardInterrupt):
        wr.simulate(scene_of(tmp_path, text), progress=False)


def test_session_goes_on_after_an_interrupt_as_if_there_was_none(tmp_path):
    text = (
        ELEMENT
        + "    if LAW.pop('stop', False):\n        os.kill(os.getpid(), signal.SIGINT)\n    return 1e5 * stretch\n"
    )
    session, other = (wr.start(scene_of(tmp_path, f"LAW = {{}}\n\n\n{text}")) for _ in range(2))
    from wrcore.kernels.named_laws import function_of

    for one, stops in ((session, True), (other, False)):
        one.step(0.05)
        if stops:
            function_of(one._run.model.elements.own[0]).__globals__["LAW"]["stop"] = True
            with pytest.raises(KeyboardInterrupt):
                one.step(0.05)
            assert one.status == "running" and one.time == 0.05
        one.step(0.05)
    np.testing.assert_array_equal(session.state, other.state)


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_command_keeps_what_was_reached_before_an_interrupt(tmp_path):
    from wrcore.run.streaming import simulate_to

    text = (
        "N = [0]\n\n\n" + ELEMENT + "    N[0] += 1\n    if N[0] == 300:\n        os.kill(os.getpid(), signal.SIGINT)\n"
    )
    run, number = simulate_to(scene_of(tmp_path, text + "    return 0.0\n"), tmp_path / "r.h5")
    assert number == signal.SIGINT and run.reason.startswith("interrupted") or run.status == "completed"
    assert wr.load_run(tmp_path / "r.h5").status == run.status


RETURNS = {"an array": "np.zeros(3)", "a truth value": "True", "complex": "1j", "two": "(1.0, 2.0)", "none": "None",
           "a list": "[1.0, 0.0, 0.0]", "text": "'much'", "nan": "float('nan')"}  # fmt: skip


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("what", RETURNS)
def test_wrong_answer_is_refused_before_the_run(tmp_path, what, compiled):
    if compiled and what == "nan":
        RETURNS[what] = "np.nan"
    scene = scene_of(tmp_path, f"{ELEMENT}    return {RETURNS[what]}\n", compiled)
    with pytest.raises(InputError) as caught:
        compile_scene(scene)
    assert caught.value.field == "elements.mine.law" and "\n" not in str(caught.value)


@pytest.mark.parametrize("what", [name for name in RETURNS if name != "nan"])
def test_wrong_answer_under_way_fails_the_run(tmp_path, what):
    run = wr.simulate(scene_of(tmp_path, f"{ELEMENT}{LATE}    return {RETURNS[what]}\n"), progress=False)
    assert run.status == "failed" and "law.py:law raised TypeError: expected a force" in run.reason


@pytest.mark.parametrize("kind", ["complex", "bool", "object"])
def test_friction_of_another_kind_of_numbers_is_refused(tmp_path, kind):
    (tmp_path / "f.py").write_text(f"def law(s):\n    return (0.3 + 0 * s).astype({kind})\n")
    law = {"law": f"{tmp_path}/f.py:law", "length": 20.0, "spacing": 1.0}
    with pytest.raises(InputError, match=r"contact\.friction\.law: expected real numbers"):
        compile_scene(wr.load_scene(SCENE, {**QUICK, "contact.friction": law}))


def test_friction_with_masked_values_is_refused(tmp_path):
    (tmp_path / "f.py").write_text("import numpy\ndef law(s):\n    return numpy.ma.masked_greater(0.3 + 0 * s, 0.2)\n")
    law = {"law": f"{tmp_path}/f.py:law", "length": 20.0, "spacing": 1.0}
    with pytest.raises(InputError, match=r"contact\.friction\.law: expected numbers without masked ones"):
        compile_scene(wr.load_scene(SCENE, {**QUICK, "contact.friction": law}))


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("array", ["parameters", "inputs", "states"])
def test_law_that_writes_what_it_reads_is_refused(tmp_path, array, compiled):
    text = f"{CONTROL}    {array}[0] += 100.0\n    outputs[0] = parameters[0]\n    following[0] = 0.0\n"
    scene = scene_of(tmp_path, text, compiled, control={"states": [0.5]})
    with pytest.raises(InputError, match=r"control\.c\.law: expected a function that leaves its inputs"):
        compile_scene(scene)


@pytest.mark.parametrize("compiled", [False, True])
def test_law_that_writes_to_its_parameters_later_fails_the_run(tmp_path, compiled):
    text = f"{ELEMENT}    if abs(stretch) > 2e-3:\n        parameters[0] += 100.0\n    return 0.0\n"
    scene = scene_of(tmp_path, text, compiled)
    for _ in range(2):  # the second run finds the parameters of the first one
        run = wr.simulate(scene, progress=False)
        assert run.status == "failed" and run.reason.startswith("law.py:law ")
        assert "wrote to its parameters" in run.reason or "read-only" in run.reason


def test_law_that_writes_to_its_states_later_fails_the_run(tmp_path):
    text = f"{ELEMENT}    rates[0] = 0.0\n    if abs(stretch) > 2e-3:\n        states[0] += 1e-3\n    return 0.0\n"
    run = wr.simulate(scene_of(tmp_path, text, True, states=1), progress=False)
    assert run.status == "failed" and "law.py:law" in run.reason


def test_error_in_a_compiled_law_fails_the_run(tmp_path):
    text = f"{ELEMENT}    if abs(stretch) > 2.5e-3:\n        raise ValueError('too far')\n    return 0.0\n"
    run = wr.simulate(scene_of(tmp_path, text, True, **{"integration.duration": 0.5}), progress=False)
    assert run.status == "failed" and "law.py:law raised ValueError: too far" in run.reason
    run.save(tmp_path / "r.h5")
    assert wr.load_run(tmp_path / "r.h5").status == "failed"


def test_session_ends_with_the_error_of_a_law(tmp_path):
    session = wr.start(scene_of(tmp_path, f"{ELEMENT}{LATE}    raise SystemExit(5)\n"))
    session.step(0.1)
    assert session.status == "failed" and "law.py:law raised SystemExit: 5" in session.reason
