"""What `auto` sees on its way: it goes on by the cheaper method, and pauses change no bit of where it changes over."""

import pickle
from dataclasses import replace

import h5py
import numpy as np
import pytest

import wrcore as wr
from tests.conftest import SCENES
from tests.integrate.auto import cost
from tests.integrate.scenes import SCENES as MEASURED
from tests.integrate.scenes import compiled, curve, rough
from wrcore.bodies.body import STATE_SIZE
from wrcore.errors import InputError
from wrcore.integrate import choice, engine
from wrcore.integrate.integrator import Integration, integrate
from wrcore.run.checkpoints import read_checkpoint, write_checkpoint
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

ON_ITS_FLANGE = {"speed": 20, "initial.y": 6e-3}
"""The free wheelset: its equations, linearised where it begins, are damped; it bounces from flange to flange."""

TIMES = np.linspace(0.0, 0.4, 41)


@pytest.fixture(scope="module")
def bouncing():
    """The free wheelset that begins on its flange: model and initial state."""
    return compile_scene(load_scene(SCENES / "wheelset.yaml", ON_ITS_FLANGE | {"contact.patch": "moment"}))


@pytest.fixture
def often(monkeypatch):
    """Looks so close that a short run changes its method several times."""
    monkeypatch.setattr(choice, "FIRST", {"rodas5": 20, "rk4": 30})
    monkeypatch.setattr(choice, "LAST", {"rodas5": 40, "rk4": 60})
    monkeypatch.setattr(choice, "GROWING", 5)
    monkeypatch.setattr(choice, "TRIED", 6)


def test_auto_goes_on_by_what_costs_less(bouncing):
    runs = [integrate(*bouncing, np.linspace(0.0, 2.0, 21), method) for method in ("auto", "rodas5", "rk4")]
    auto, *plain = (cost(bouncing[0], run) for run in runs)
    assert runs[0].method == "rodas5, rk4"
    assert max(plain) > 2.0 * min(plain)
    assert auto < 1.3 * min(plain)


@pytest.mark.parametrize("name, speed, duration, changes", [MEASURED[k] for k in (0, 1, 5, 6, 13)])
def test_auto_costs_little_more_than_the_cheaper_method(name, speed, duration, changes):
    model, start = compiled(name, speed, changes)
    runs = [integrate(model, start, np.linspace(0.0, duration, 11), method) for method in ("auto", "rodas5", "rk4")]
    auto, *plain = (cost(model, run) for run in runs)
    assert auto < 1.35 * min(plain)


def test_auto_at_1e_5_takes_no_more_evaluations_than_rodas5():
    """The work of Rodas5 counted 1.3 times at any tolerance makes it 1.5 times as many."""
    model, start = compiled("trailer vehicle", 16.7, curve(300.0) | rough())
    runs = [integrate(model, start, np.linspace(0.0, 6.0, 11), method, 1e-5) for method in ("auto", "rodas5", "rk4")]
    auto, rodas5, rk4 = (run.rhs_evaluations for run in runs)
    assert rk4 > 1.5 * rodas5 and auto < 1.1 * rodas5


def test_factor_on_work_falls_with_the_tolerance():
    factors = [choice.counted("rodas5", rtol) for rtol in (1e-2, 1e-4, 3e-5, 1e-5, 1e-9)]
    assert (
        factors[:2] == [1.3, 1.3] and 0.65 < factors[2] < 1.3 and factors[3:] == pytest.approx([0.65, 0.65], abs=0.01)
    )
    assert choice.counted("rk4", 1e-9) == 1.0


@pytest.mark.parametrize("speed", [60.0, 62.0])
def test_auto_takes_the_method_that_errs_less_where_a_wheelset_hunts(speed):
    """Rodas5 would be a fifth cheaper, and err by 8 to 16 um."""
    model, start = compiled("suspended wheelset", speed, {})
    runs = [integrate(model, start, np.linspace(0.0, 8.0, 801), *how) for how in (("tsit5", 1e-8), ("auto",))]
    exact, y = (run.states[:, STATE_SIZE * model.bodies.wheelsets + 1] for run in runs)
    assert runs[1].method == "rodas5, rk4"
    assert np.sqrt(np.mean((y - exact) ** 2)) < 4e-6


def test_its_work_is_all_that_was_done(bouncing, often):
    run = integrate(*bouncing, TIMES)
    tried = run.steps + run.rejected
    assert run.method == "rodas5, rk4"
    done, counted = choice.work_of(bouncing[0], run.end), (run.rhs_evaluations, tried, run.jacobians)
    assert choice.work(bouncing[0], "rk4", *counted) < done < choice.work(bouncing[0], "rodas5", *counted)


def test_pauses_and_resumed_runs_change_no_bit(bouncing, often, tmp_path):
    model, start = bouncing
    whole = integrate(model, start, TIMES)
    assert whole.method == "rodas5, rk4"
    np.testing.assert_array_equal(integrate(model, start, TIMES, chunk=7).states, whole.states)
    for k in (0, 3, 11, 26):
        first = integrate(model, start, TIMES[: k + 1])
        with h5py.File(tmp_path / f"{k}.h5", "w") as file:
            write_checkpoint(file.create_group("end"), first.end)
            kept = read_checkpoint(file["end"])
        for end in (first.end, kept, pickle.loads(pickle.dumps(first.end))):
            rest = integrate(model, end, TIMES[k:])
            np.testing.assert_array_equal(rest.states, whole.states[k:])
            assert rest.method == whole.method


def test_a_session_changes_over_where_a_run_does(often):
    scene = load_scene(SCENES / "wheelset.yaml", ON_ITS_FLANGE | {"contact.patch": "moment", "output.rate": 100.0})
    run = wr.simulate(scene, integration__duration=0.4, integration__method="auto")
    session, y, kept = wr.start(scene, integration__method="auto"), [], None
    for k in range(40):
        kept = session.save() if k == 13 else kept
        session.step(0.01)
        y.append(session.channels("wheelset.y_m")["wheelset.y_m"])
    np.testing.assert_array_equal(y, run["wheelset"].y_m[1:])
    assert session.run().settings["method_used"] == run.settings["method_used"] == "rodas5, rk4"
    session.restore(kept)
    session.run_until(0.4)
    assert session.channels("wheelset.y_m")["wheelset.y_m"] == y[-1]


def test_methods_that_were_asked_for_stay(bouncing, often):
    model, start = bouncing
    for method, how in (("rk4", {}), ("rodas5", {}), ("auto", {"step": 1e-4})):
        run = integrate(model, start, TIMES, method, **how)
        assert "," not in run.method and not len(run.end.notes)


def test_outputs_of_the_last_step_do_not_know_of_a_change(bouncing, often):
    """Where a run was stopped as a look was due, times within its last step are interpolated as ever."""
    model, start = bouncing
    changes = 0
    for most in range(150, 190):
        end = integrate(model, start, TIMES, most_steps=most).end
        clock = end.memory.clock
        rest = integrate(model, end, np.array([*np.linspace(clock[engine.T_OLD], clock[engine.T], 5)[1:], 0.5]))
        speed = np.diff(rest.states[:4, 0]) / np.diff(rest.t[:4])
        np.testing.assert_allclose(speed, 20.0, rtol=1e-2)
        changes += rest.method != end.method
    assert changes


def test_a_change_knows_nothing_of_the_step_before(bouncing, monkeypatch):
    """Its first Jacobian is found in full."""
    model, start = bouncing
    run = Integration(model, start, 0.0, "rodas5", (1e-4, 0.0), 0.0, 0.05, 0.05, looks=True)
    record = run.record(TIMES)
    run.advance(record, 5)
    for method, age in (("rk4", -1), ("rodas5", -1)):
        monkeypatch.setattr(choice, "method_after", lambda *_, method=method: method)
        assert run.memory.counters[engine.HAS_RATE]
        run._look(record)
        counters = run.memory.counters
        assert (run.method, counters[engine.AGE], counters[engine.HAS_RATE]) == (method, age, 0)
        assert run.memory.clock[engine.MATRIX_STEP] == 0.0
        run._advance(record, 3)


BAD = {
    "size": np.zeros(3), "text": np.full(choice.NOTES, "a"), "nan": np.full(choice.NOTES, np.nan),
    "phase": {choice.Note.PHASE: 7.0}, "used": {choice.Note.USED: 1e300}, "due": {choice.Note.DUE: np.inf},
    "interval": {choice.Note.INTERVAL: 0.0}, "since": {choice.Note.SINCE: -np.inf},
}  # fmt: skip


@pytest.mark.parametrize("bad", BAD.values(), ids=BAD)
def test_damaged_notes_are_refused(bouncing, bad):
    model, start = bouncing
    end = integrate(model, start, TIMES[:3]).end
    notes = end.notes.copy() if isinstance(bad, dict) else bad
    for place, value in bad.items() if isinstance(bad, dict) else ():
        notes[place] = value
    with pytest.raises(InputError, match="expected 10 notes of a run by auto"):
        integrate(model, replace(end, notes=notes), TIMES[2:])
    with pytest.raises(InputError, match="by tsit5"):
        integrate(model, replace(integrate(model, start, TIMES[:3], "tsit5").end, notes=end.notes), TIMES[2:])


def test_checkpoints_of_before_go_on_by_their_method(bouncing):
    model, start = bouncing
    end = integrate(model, start, TIMES[:21]).end
    for notes in (None, choice.no_notes()):
        assert integrate(model, replace(end, notes=notes), TIMES[20:]).method == end.method
