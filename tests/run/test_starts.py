"""A run begins at a state or a checkpoint of its own model, or not at all."""

from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import SCENES
from wrcore.errors import InputError
from wrcore.integrate.integrator import integrate
from wrcore.run.output.files import load_run
from wrcore.run.simulate import simulate
from wrcore.run.streaming import simulate_to
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

SCENE = {"integration.duration": 0.05, "contact.creep.model": "she", "contact.patch": "moment",
         "integration.method": "ros34pw2"}  # fmt: skip


def scene_of(**changes):
    return load_scene(SCENES / "suspended_wheelset.yaml", SCENE | changes)


@pytest.fixture(scope="module")
def run():
    return simulate(scene_of(), progress=False)


STATES = {
    "too short": lambda state: state[:-1], "too long": lambda state: np.append(state, 0.0), "two": lambda s: s[None],
    "not a number": lambda state: np.where(np.arange(13) == 3, np.nan, state), "infinite": lambda state: state + np.inf,
    "text": lambda state: state.astype(str), "complex": lambda state: state + 0j, "a word": lambda _: "state",
}  # fmt: skip


@pytest.mark.parametrize("method", ["tsit5", "ros34pw2", "scipy_rk45"])
@pytest.mark.parametrize("spoil", STATES.values(), ids=STATES)
def test_a_state_that_does_not_fit_is_refused(run, spoil, method):
    with pytest.raises(
        InputError,
        match="start: expected a [Cc]heckpoint, (or a state of 13 finite numbers, got a |a state or 'initial')",
    ):
        simulate(scene_of(**{"integration.method": method}), progress=False, start=spoil(run.end_state))


OTHERS = [{"speed": 21}, {"contact.friction": 0.4}, {"wheel.profile": "cone:1/20"}, {"vehicle.count": 2}]


@pytest.mark.parametrize("change", OTHERS, ids=str)
def test_a_checkpoint_of_another_model_is_refused(run, tmp_path, change):
    more = {"vehicle.spacing": 10.0} if "vehicle.count" in change else {}
    simulate_to(scene_of(), tmp_path / "run.h5")
    for end in (run.end, load_run(tmp_path / "run.h5").end):
        with pytest.raises(InputError, match="start: expected a checkpoint of this very model, got another one's"):
            simulate(scene_of(**change, **more), progress=False, start=end)
    with pytest.raises(InputError, match="of an older version"):
        simulate(scene_of(), progress=False, start=replace(run.end, model=""))


def test_what_a_checkpoint_would_override_is_refused(run):
    for method in ("tsit5", "scipy_rk45"):
        with pytest.raises(InputError, match=f"method: expected that of the start, ros34pw2, got {method}"):
            simulate(scene_of(**{"integration.method": method}), progress=False, start=run.end)
    for key, value in (("initial", {"y": 0.001}), ("initial__y", 0.001), ("initial.y", 0.001)):
        with pytest.raises(InputError, match="simulate: initial: expected either this or a start"):
            simulate(scene_of(), progress=False, start=run.end, **{key: value})
    for overrides in (["initial.y=0.001"], {"initial.y": 0.001}):
        with pytest.raises(InputError, match="simulate: initial: expected either this or a start"):
            simulate(scene_of(), overrides, progress=False, start=run.end)


def test_overrides_are_those_of_load_scene():
    plain = simulate(scene_of(speed=17), progress=False)
    for overrides in (["speed=17"], {"speed": 17}, iter(["speed=17"])):
        assert np.array_equal(simulate(scene_of(), overrides, progress=False)["wheelset"].y_m, plain["wheelset"].y_m)


def test_no_checkpoint_is_no_start(run, tmp_path):
    run.save(tmp_path / "run.h5")
    with pytest.raises(InputError, match="simulate: start: expected a checkpoint, .* got None"):
        simulate(scene_of(), progress=False, start=load_run(tmp_path / "run.h5").end)


def test_tolerances_are_those_of_the_scene_after_a_checkpoint(run):
    loose, tight = (
        simulate(scene_of(), progress=False, start=run.end, integration__rtol=rtol) for rtol in (1e-3, 1e-8)
    )
    assert tight.counters["steps"] > 1.2 * loose.counters["steps"]


def test_the_integrator_takes_no_checkpoint_of_other_sizes(run):
    model, _ = compile_scene(scene_of())
    memory, linear = run.end.memory, run.end.linear
    two = simulate(scene_of(**{"vehicle.count": 2, "vehicle.spacing": 10.0}), progress=False).end
    spoiled = [
        two, replace(run.end, linear=two.linear), replace(run.end, linear=None), replace(run.end, method="tsit5"),
        replace(run.end, method="scipy_rk45"), replace(run.end, memory=memory._replace(clock=memory.clock * np.nan)),
        replace(run.end, memory=memory._replace(stages=memory.stages[:-1])), replace(run.end, arc_lengths=np.zeros(2)),
        replace(run.end, memory=memory._replace(counters=memory.counters.astype(float))),
    ]  # fmt: skip
    for end in spoiled:
        with pytest.raises(InputError, match="start: "):
            integrate(model, end, [0.05, 0.1])
    wild = linear.sweep._replace(rows=linear.sweep.rows + 2**40)  # indices are the model's own
    again = integrate(model, replace(run.end, linear=linear._replace(sweep=wild)), [0.05, 0.1])
    np.testing.assert_array_equal(again.states, integrate(model, run.end, [0.05, 0.1]).states)
