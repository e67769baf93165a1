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
from tests.integrate.scenes import compiled
from wrcore.errors import InputError
from wrcore.integrate import choice
from wrcore.integrate.integrator import integrate
from wrcore.run.checkpoints import read_checkpoint, write_checkpoint
from wrcore.scene.description import compile_scene, load_scene

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
    monkeypatch.setattr(choice, "FIRST", {"rodas4p2": 20, "rk4": 30})
    monkeypatch.setattr(choice, "LAST", {"rodas4p2": 40, "rk4": 60})
    monkeypatch.setattr(choice, "GROWING", 5)
    monkeypatch.setattr(choice, "TRIED", 6)


def test_auto_goes_on_by_what_costs_less(bouncing):
    runs = [integrate(*bouncing, np.linspace(0.0, 2.0, 21), method) for method in ("auto", "rodas4p2", "rk4")]
    auto, *plain = map(cost, runs)
    assert runs[0].method == "rodas4p2, rk4"
    assert max(plain) > 2.0 * min(plain)
    assert auto < 1.3 * min(plain)


@pytest.mark.parametrize("name, speed, duration, changes", [MEASURED[k] for k in (0, 1, 5, 6, 10)])
def test_auto_costs_little_more_than_the_cheaper_method(name, speed, duration, changes):
    model, start = compiled(name, speed, changes)
    runs = [integrate(model, start, np.linspace(0.0, duration, 11), method) for method in ("auto", "rodas4p2", "rk4")]
    auto, *plain = map(cost, runs)
    assert auto < 1.35 * min(plain)


def test_its_work_is_all_that_was_done(bouncing, often):
    run = integrate(*bouncing, TIMES)
    tried = run.steps + run.rejected
    assert run.method == "rodas4p2, rk4"
    assert choice.work("rk4", run.rhs_evaluations, tried, run.jacobians) < choice.work_of(run.end)
    assert choice.work_of(run.end) < choice.work("rodas4p2", run.rhs_evaluations, tried, run.jacobians)


def test_pauses_and_resumed_runs_change_no_bit(bouncing, often, tmp_path):
    model, start = bouncing
    whole = integrate(model, start, TIMES)
    assert whole.method == "rodas4p2, rk4"
    np.testing.assert_array_equal(integrate(model, start, TIMES, chunk=7).states, whole.states)
    for k in (3, 11, 26):
        first = integrate(model, start, TIMES[: k + 1])
        with h5py.File(tmp_path / f"{k}.h5", "w") as file:
            write_checkpoint(file.create_group("end"), first.end)
            kept = read_checkpoint(file["end"])
        for end in (first.end, kept, pickle.loads(pickle.dumps(first.end))):
            rest = integrate(model, end, TIMES[k:])
            np.testing.assert_array_equal(rest.states, whole.states[k:])
            assert rest.method == whole.method
            break


def test_a_session_changes_over_where_a_run_does(often):
    scene = load_scene(SCENES / "wheelset.yaml", ON_ITS_FLANGE | {"contact.patch": "moment", "output.rate": 100.0})
    run = wr.simulate(scene, integration__duration=0.4, integration__method="auto")
    session, y, kept = wr.start(scene, integration__method="auto"), [], None
    for k in range(40):
        kept = session.save() if k == 13 else kept
        session.step(0.01)
        y.append(session.channels("wheelset.y_m")["wheelset.y_m"])
    np.testing.assert_array_equal(y, run["wheelset"].y_m[1:])
    assert session.run().settings["method_used"] == run.settings["method_used"] == "rodas4p2, rk4"
    session.restore(kept)
    session.run_until(0.4)
    assert session.channels("wheelset.y_m")["wheelset.y_m"] == y[-1]


def test_methods_that_were_asked_for_stay(bouncing, often):
    model, start = bouncing
    for method, how in (("rk4", {}), ("rodas4p2", {}), ("auto", {"step": 1e-4})):
        run = integrate(model, start, TIMES, method, **how)
        assert "," not in run.method and not len(run.end.notes)
    half = integrate(model, start, TIMES[:21])
    again = integrate(model, replace(half.end, notes=choice.no_notes()), TIMES[20:])
    assert again.method == half.end.method


def test_damaged_notes_are_refused(bouncing):
    model, start = bouncing
    end = integrate(model, start, TIMES[:3]).end
    for notes in (np.zeros(3), np.full(choice.NOTES, np.nan)):
        with pytest.raises(InputError, match="notes that are numbers"):
            integrate(model, replace(end, notes=notes), TIMES[2:])
