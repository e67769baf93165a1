"""A session steps along the bits of one run; what its inputs do; where it ends, returns to and stops."""

import subprocess
import sys
import time

import numpy as np
import pytest
import yaml

import wrcore as wr
from tests.conftest import ROOT, SCENES

WHEELSET = {"speed": 50.0, "output.rate": 100.0, "integration.duration": 0.3}
CURVE = [{"tangent": 15}, {"transition": 10}, {"curve": 100, "radius": 400, "cant": 0.08}]
MOTOR = {"drive": {"motors": [{"name": "motor_1", "bodies": ["wheelset", "frame"], "torque": 0.0}]}}
APART = {"contact.friction": {"left": 0.3, "right": 0.3}, "contact.patch": "moment"}
"""With ellipses: a lookup table keeps the friction at which the session began, and the motion differs a little from
that of a scene with the new friction."""


def scene_of(name="suspended_wheelset", **changes):
    return wr.load_scene(SCENES / f"{name}.yaml", {**(WHEELSET if "wheelset" in name else {}), **changes})


def active(folder, force=0.0):
    """A suspended wheelset with actuators at its axle boxes."""
    vehicle = yaml.safe_load((SCENES.parent / "vehicles/suspended_wheelset.yaml").read_text())
    for name, y in (("left", 1.0), ("right", -1.0)):
        at = {"at": [0.0, y, 0.46], "direction": "x", "force": force * y}
        vehicle["elements"].append({"name": name, "kind": "actuator", "bodies": ["wheelset", "frame"], **at})
    path = folder / f"active_{force:g}.yaml"
    path.write_text(yaml.safe_dump(vehicle))
    return {"vehicle.parameters": str(path)}


def stepped(scene, steps=30, dt=0.01, **inputs):
    session = wr.start(scene)
    for _ in range(steps):
        session.step(dt, {name.replace("__", "."): value for name, value in inputs.items()})
    return session


def same(one, other):
    assert one.keys() == other.keys()
    for group in one:
        assert one[group].keys() == other[group].keys()
        for name in one[group]:
            np.testing.assert_array_equal(one[group][name], other[group][name], f"{group}.{name}")


CASES = {
    "explicit": scene_of(**{"integration.method": "tsit5"}),
    "stiff": scene_of(**{"integration.method": "rodas4"}),
    "several steps a Jacobian": scene_of(**{"integration.method": "ros34pw2", "output.rate": 1000.0}),
    "steps of a stated length": scene_of(**{"integration.method": "rk4", "integration.step": 1e-4}),
    "a coach in a curve": scene_of("trailer_vehicle", **{"speed": 25.0, "track.path": CURVE, "output.rate": 40.0,
                                                         "integration.duration": 0.5, "contact.patch": "moment"}),
    "a locomotive": scene_of("locomotive", **{"output.rate": 100.0, "integration.duration": 0.3}),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_a_session_is_bit_by_bit_one_run(case):
    scene = CASES[case]
    rate, once = scene.data["output"]["rate"], wr.simulate(scene, progress=False)
    session = stepped(scene, len(once.t) - 1, 1.0 / rate)
    run = session.run()
    np.testing.assert_array_equal(run.t, once.t)
    same(run, once)
    np.testing.assert_array_equal(session.state, once.end_state)
    assert (session.time, session.status, run.status) == (once.end_t, "running", "completed")
    for name in ("steps", "rejected", "rhs_evaluations", "jacobians", "patches"):
        assert run.counters[name] == once.counters[name], name
    # the run's end is that of one run, too, and stays what it is when the session goes on
    session.step(1.0 / rate)
    same(wr.simulate(scene, start=run.end, progress=False), wr.simulate(scene, start=once.end, progress=False))


def test_present_values_are_those_of_a_run():
    for case in ("stiff", "a coach in a curve", "a locomotive"):
        session = stepped(CASES[case], 5, 0.01)
        run = session.run()
        last, values = run.to_pandas().iloc[-1], session.channels()
        assert {name for name, value in last.items() if not np.isnan(value)} <= values.keys()
        for name, value in values.items():  # on a curved track arc lengths are sought from elsewhere
            assert value == pytest.approx(last.get(name, np.nan), rel=1e-6, abs=1e-7, nan_ok=True), name
        wheel = next(group for group in run if group.endswith("/left"))
        force, load = session.channels(f"{wheel}.Q_N", f"{wheel}.N_N.0").values()
        assert force == pytest.approx(run[wheel].Q_N[-1], rel=1e-6) and load == pytest.approx(run[wheel].N_N[-1, 0])


INPUTS = {
    "torque of a motor": (MOTOR | {"speed": 5.0}, "motor_1.torque", 800.0,
                          {"drive": {"motors": [{**MOTOR["drive"]["motors"][0], "torque": 800.0}]}}),
    "friction of a rail": (APART, "friction.left", 0.1, {"contact.friction": {"left": 0.1, "right": 0.3}}),
    "force of an actuator": ("actuators", "left.force", 3000.0, 3000.0),
}  # fmt: skip


@pytest.mark.parametrize("case", INPUTS)
def test_an_input_does_what_the_same_value_in_the_scene_does(case, tmp_path):
    changes, name, value, same_in_the_scene = INPUTS[case]
    if changes == "actuators":
        changes, other = active(tmp_path), active(tmp_path, same_in_the_scene)
    else:
        other = changes | same_in_the_scene
    method = {"integration.method": "rodas4"}  # auto asks whether anything drives
    session = wr.start(scene_of(**changes, **method))
    begin = session.state  # the scene's own differs in the last bits
    session.set(name, value)
    if case == "force of an actuator":
        session.set("right.force", -value)
    assert session.inputs[name] == value
    for _ in range(30):
        session.step(0.01)
    once = wr.simulate(scene_of(**other, **method), start=begin, progress=False)
    same(session.run(), once)
    assert session.run().end.model == once.end.model
    apart = wr.simulate(scene_of(**changes, **method), progress=False)
    assert np.abs(apart["wheelset"].yaw_rad - once["wheelset"].yaw_rad).max() > 1e-6  # it does something


def test_what_the_controller_is_told_and_shares_act():
    session = stepped(scene_of("locomotive"), 20)
    session.step(0.1, {"controller.limit": 4.0e4, "motor_1.share": 0.1, "motor_2.share": 0.4})
    values = session.channels("drive/controller.force_N", *(f"drive/motor_{k}.torque_Nm" for k in (1, 2, 3)))
    force, *torques = values.values()
    assert force == pytest.approx(4.0e4)
    np.testing.assert_allclose(torques, 0.55 * force * np.array([0.1, 0.4, 0.25]))
    session.step(0.1, {"controller.speed": 0.0})
    assert session.channels("drive/controller.wanted_m_per_s")["drive/controller.wanted_m_per_s"] == 0.0
    assert np.isnan(stepped(scene_of("locomotive"), 1).inputs["controller.speed"])  # its table still rules


def test_a_change_at_a_time_is_a_step_of_the_scenes_own_table():
    tight = {"integration.rtol": 1e-9, "integration.method": "tsit5", "speed": 5.0}
    session = wr.start(scene_of(**MOTOR, **tight))
    for k in range(20):
        session.step(0.01, {"motor_1.torque": 0.0 if k < 5 else 800.0})
    table = {"time": [0.05, 0.05 + 1e-9], "torque": [0.0, 800.0]}
    motor = {"drive": {"motors": [{**MOTOR["drive"]["motors"][0], "torque": table}]}}
    once = wr.simulate(scene_of(**motor, **tight), progress=False)
    run = session.run()
    assert run["drive/motor_1"].torque_Nm.tolist() == [0.0] * 6 + [800.0] * 15  # each with what held up to it
    turning, other = (one["wheelset"].wy_rad_per_s[:21] for one in (run, once))
    assert np.ptp(turning[6:]) > 1e-4 and np.abs(turning - other).max() < 1e-5 * np.ptp(turning[6:])


def test_the_value_that_an_input_has_changes_not_a_bit():
    scene = scene_of(**APART)
    session = wr.start(scene)
    for k in range(30):
        if k == 7:  # there and back before a step is no change either
            session.set("friction.left", 0.2)
        session.step(0.01, {"friction.left": 0.3, "friction.right": 0.3})
    same(session.run(), wr.simulate(scene, progress=False))


def test_what_is_set_stays_in_the_session(tmp_path):
    scene = scene_of(**active(tmp_path), **APART)
    session = stepped(scene, 3)
    session.step(0.01, {"left.force": 1e3, "friction.right": 0.1})
    session.set("left.force", 2e3)
    session.run()  # puts what held at each time in place for a while
    assert session.inputs["left.force"] == 2e3 and session.inputs["friction.right"] == 0.1
    again = wr.start(scene)
    assert again.inputs == {"left.force": 0.0, "right.force": 0.0, "friction.left": 0.3, "friction.right": 0.3}
    same(wr.simulate(scene, progress=False), stepped(scene).run())


@pytest.mark.parametrize("method", ["tsit5", "rodas4", "ros34pw2"])
def test_from_where_it_was_saved_it_goes_the_same_way(method, tmp_path):
    session = wr.start(scene_of(**active(tmp_path), **{"integration.method": method}))

    def go_on():
        for k in range(10):
            session.step(0.01, {"left.force": 1e3 * (k // 3)})
        return session.state.copy()

    go_on()
    saved = session.save()
    first, run = go_on(), session.run()
    session.step(0.3, {"right.force": 500.0})
    for _ in range(2):
        session.restore(saved)
        assert session.time == 0.1 and session.inputs == {"left.force": 3e3, "right.force": 0.0}
        np.testing.assert_array_equal(go_on(), first)
    same(session.run(), run)


def test_a_run_is_of_the_branch_that_was_restored():
    """Also forwards, beyond what the session has done since."""
    session = wr.start(scene_of(**APART))
    session.run_until(0.05)
    root, found = session.save(), {}
    for friction in (0.05, 0.5):
        session.restore(root)
        session.step(0.05, {"friction.left": friction})
        found[friction] = session.save(), session.run()
    assert found[0.05][1]["wheelset"].y_m[-1] != found[0.5][1]["wheelset"].y_m[-1]
    session.restore(found[0.05][0])
    same(session.run(), found[0.05][1])
    session.restore(root)
    session.restore(found[0.5][0])
    assert session.run().t[-1] == session.time == 0.1
    same(session.run(), found[0.5][1])


def test_a_crossing_is_located_and_leaves_the_trajectory_as_it_was():
    scene = scene_of()
    once = wr.simulate(scene, progress=False)
    below = float(once["wheelset"].y_m.min()) / 2
    assert below < 0.0
    session = wr.start(scene)
    assert session.run_until(f"wheelset.y_m < {below}")
    y, v = session.channels("wheelset.y_m", "wheelset.vy_m_per_s").values()
    assert below - 2e-9 * abs(v) < y < below and abs(v) > 0.01
    found = session.time
    np.testing.assert_array_equal(session.run().t, [*(np.arange(int(found * 100) + 1) / 100), found])
    assert session.run_until(f"wheelset.y_m < {below}") and session.time == found  # it holds already
    assert session.run_until(0.3)
    np.testing.assert_array_equal(session.state, once.end_state)
    other = wr.start(scene)
    assert other.run_until(lambda values: values["wheelset.y_m"] < below < values["wheelset/left.Q_N"], dt=0.003)
    assert other.time == pytest.approx(found, abs=2e-9)
    assert not other.run_until("wheelset.y_m > 1", latest=0.2) and other.time == 0.2


def test_a_session_without_a_record_goes_the_same_way():
    once, session = wr.simulate(scene_of(), progress=False), wr.start(scene_of(), record=False)
    below = float(once["wheelset"].y_m.min()) / 2
    assert session.run_until(f"wheelset.y_m < {below}") and session.run_until(0.3)
    np.testing.assert_array_equal(session.state, once.end_state)
    with pytest.raises(wr.InputError, match="session: run: expected a session that keeps a record"):
        session.run()


def test_a_session_ends_where_a_run_ends_and_says_so():
    changes = {"initial.y": 0.02, "speed": 30.0, "initial.yaw": 0.05, "integration.duration": 3.0}
    scene = scene_of("wheelset", **changes)
    once, session = wr.simulate(scene, progress=False), wr.start(scene)
    while session.status == "running":
        session.step(0.01)
    assert (session.status, session.reason, session.time) == (once.status, once.reason, once.end_t)
    assert once.status == "derailed"
    run = session.run()
    assert (run.status, run.reason, run.end_t) == (once.status, once.reason, once.end_t)
    same(run, once)
    with pytest.raises(wr.InputError, match="session: expected no further step: derailed at"):
        session.step(0.01)


@pytest.mark.parametrize("rate, steps", [(200.0, (0.003, 0.07, 0.0005, 0.1, 0.0265)), (7.0, (0.01,) * 20)])
def test_session_run_has_the_output_times_of_a_run(rate, steps):
    scene = scene_of(**{"output.rate": rate, "integration.method": "rodas4"}, **APART)
    session = wr.start(scene)
    for dt in steps:
        session.step(dt)
    once = wr.simulate(scene, {"integration.duration": session.time}, progress=False)
    run = session.run()
    np.testing.assert_allclose(run.t, once.t, rtol=0.0, atol=1e-15)
    if np.array_equal(run.t, once.t):
        same(run, once)
    saved = session.save()  # a step's end that is no output time is the last one alone
    session.step(0.0301, {"friction.left": 0.1})
    session.restore(saved)
    same(session.run(), run)


def test_session_step_refused_sets_no_input(tmp_path):
    session = wr.start(scene_of(**active(tmp_path), **APART))
    before = session.inputs
    for dt, inputs in (
        (0.01, {"left.force": 1e4, "nope": 1.0}), (-1.0, {"left.force": 1e4}), (np.nan, {"left.force": 1e4}),
        (0.01, {"left.force": 1e4, "friction.left": -1.0}), (0.01, {"left.force": 1e4, "right.force": np.ma.masked}),
        (0.01, [("left.force", 1e4)]),
    ):  # fmt: skip
        with pytest.raises(wr.InputError):
            session.step(dt, inputs)
        assert session.inputs == before and session.time == 0.0
    session.set("left.force", 1e3)
    with pytest.raises(wr.InputError):
        session.step(0.01, {"left.force": 0.0, "nope": 1.0})
    assert session.inputs["left.force"] == 1e3


def test_run_until_takes_numbers_of_numpy():
    sessions = [wr.start(scene_of()) for _ in range(2)]
    assert sessions[0].run_until(np.float32(0.25), dt=np.float32(0.0625)) and sessions[1].run_until(0.25, dt=0.0625)
    assert sessions[0].time == sessions[1].time == 0.25 and type(sessions[0].time) is float
    np.testing.assert_array_equal(sessions[0].state, sessions[1].state)
    assert not sessions[0].run_until("wheelset.y_m > 1", np.float32(0.0625), np.float64(0.5))


@pytest.mark.parametrize("end", ["wheelset.y_m > nan", "wheelset.y_m < inf", float("nan"), None, [0.1]])
def test_run_until_no_condition_is_one_line(end):
    session = wr.start(scene_of())
    with pytest.raises(wr.InputError, match="end: expected a"):
        session.run_until(end)
    assert session.time == 0.0


@pytest.mark.parametrize("answer", [None, 3, float("nan"), np.array([True, False]), "no"])
def test_run_until_function_without_yes_or_no_is_one_line(answer):
    with pytest.raises(wr.InputError, match="end: expected a function that returns True or False"):
        wr.start(scene_of()).run_until(lambda channels: answer)


def test_session_interrupted_in_a_step_goes_on_from_before_it(monkeypatch):
    session = stepped(scene_of(), 3)
    state, advance = session.state, session._run.advance

    def stopped(record, attempts):
        advance(record, 3)
        raise KeyboardInterrupt

    monkeypatch.setattr(session._run, "advance", stopped)
    with pytest.raises(KeyboardInterrupt):
        session.step(1.0)
    monkeypatch.undo()
    assert session.time == 0.03 and np.array_equal(session.state, state)
    session.step(0.001)
    once = stepped(scene_of(), 31, 0.001)
    np.testing.assert_allclose(session.state[:7], once.state[:7], atol=1e-6)


def test_states_and_checkpoints_are_starts():
    scene = scene_of(**{"integration.method": "tsit5"})
    whole = stepped(scene, 20)
    half = stepped(scene, 10)
    rest = wr.start(scene, start=half.run().end)
    assert rest.time == 0.1
    for _ in range(10):
        rest.step(0.01)
    np.testing.assert_array_equal(rest.state, whole.state)
    anew = wr.start(scene, start=half.state, speed=50)
    assert anew.time == 0.1 and np.array_equal(anew.state, half.state)


def test_what_cannot_be_is_one_line(tmp_path):
    session = wr.start(scene_of(**active(tmp_path), **APART))
    for name, value, expected in (
        ("left.forse", 1.0, "did you mean 'left.force'"), ("left.force", 1e20, "expected -1e\\+15 to 1e\\+15 N, got"),
        ("left.force", np.nan, "expected a number"), ("left.force", "much", "expected a number, finite, got 'much'"),
        ("friction.left", -0.1, "expected 1e-09 to 1"),
    ):  # fmt: skip
        with pytest.raises(wr.InputError, match=expected):
            session.set(name, value)
    with pytest.raises(wr.InputError, match="session: motor: this scene has no inputs"):
        wr.start(scene_of()).set("motor", 1.0)
    for dt in (0.0, -1.0, float("nan"), "x", None):
        with pytest.raises(wr.InputError, match="session: dt: expected 1e-12 to 100000 s, got"):
            session.step(dt)
    for name in ("wheelset.y", "wheel.y_m", "wheelset/left.N_N", "wheelset/left.N_N.9", "wheelset.y_m.0"):
        with pytest.raises(wr.InputError, match="no channel|no group|expected the name of one number"):
            session.channels(name)
    for end in ("wheelset.y_m", "wheelset.y_m > high", "wheelset.y_m = 1"):
        with pytest.raises(wr.InputError, match="end: expected a time, a function, or a channel"):
            session.run_until(end)
    with pytest.raises(KeyError, match="no channel 'ym' in 'wheelset'"):
        session.run_until(lambda channels: channels["wheelset.ym"] > 0.0)
    with pytest.raises(wr.InputError, match="integration.method: expected a compiled method"):
        wr.start(scene_of(**{"integration.method": "scipy_rk45"}))
    with pytest.raises(wr.InputError, match="expected what this session's save returned"):
        session.restore(wr.start(scene_of()).save())
    assert session.time == 0.0


def test_a_step_costs_next_to_nothing_beside_a_run_of_its_own():
    """A step within one of the integrator's, against the piece that a run from a checkpoint makes of it."""
    session = stepped(CASES["stiff"], 5)
    scene, end = CASES["stiff"], session.run().end
    began = time.process_time()
    for _ in range(3):
        wr.simulate(scene, start=end, integration__duration=1e-6, progress=False)
    piece = (time.process_time() - began) / 3
    began = time.process_time()
    for _ in range(3000):
        session.step(1e-9)
    assert 300 * (time.process_time() - began) / 3000 < piece  # found: 56 to 195 ms against 3 to 8 us


def test_who_does_not_step_loads_nothing_of_it():
    code = "import sys; from wrcore.run.simulate import simulate; assert 'wrcore.run.session' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)
