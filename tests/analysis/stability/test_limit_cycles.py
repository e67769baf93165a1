"""Branches of limit cycles: of an oscillator whose branches are known, and of a wheelset."""

import math

import numpy as np
import pandas as pd
import pytest

from study.critical_speed.tables import critical_table
from tests.conftest import ELLIPTIC
from wrcore.analysis.stability import limit_cycles as analysis_limit_cycles
from wrcore.analysis.stability.limit_cycles import (
    Settling,
    falling_branch,
    limit_cycles,
    nonlinear_critical_speed,
    rising_branch,
    settle_motion,
    shifted,
    speed_ramp,
)
from wrcore.analysis.stability.stability import at_speed
from wrcore.errors import InputError
from wrcore.run.motion import amplitude
from wrcore.run.simulate import simulate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

HOPF = 50.0
"""Speed at which the oscillator below loses its stability, m/s."""


@pytest.fixture(scope="module")
def suspended():
    scene = load_scene(ELLIPTIC / "suspended_wheelset.yaml", ["initial.y=0.0", "contact.detection=planar"])
    return compile_scene(scene)


@pytest.fixture
def oscillator(monkeypatch):
    """In place of the vehicle's run: r' = r (m + r^2 - r^4), phase at 6 Hz, y = r cos(phase) cm, m = (V - HOPF)/40.

    Its limit cycles (normal form of a subcritical Hopf bifurcation with a fold): r^2 = (1 + sqrt(1 + 4 m))/2 stable,
    r^2 = (1 - sqrt(1 + 4 m))/2 unstable, from m = -1/4, that is 10 m/s below HOPF, where r = sqrt(1/2).
    """

    def run(model, state, settling):
        m = (model.speed - HOPF) / 40.0
        steps = round(settling.window * settling.rate)
        t = np.linspace(0.0, settling.window, steps + 1)
        radius, phase = math.hypot(state[1], state[8]) / 0.01, math.atan2(-state[8], state[1])
        radii = [radius]
        for _ in range(steps):
            rate = 1.0 / settling.rate
            middle = radius + 0.5 * rate * radius * (m + radius**2 - radius**4)
            radius += rate * middle * (m + middle**2 - middle**4)
            radii.append(radius)
        y = 0.01 * np.array(radii) * np.cos(phase + 12.0 * np.pi * t)
        end = state.copy()
        end[0] += model.speed * settling.window
        end[1], end[8] = y[-1], -0.01 * radius * math.sin(phase + 12.0 * np.pi * t[-1])
        return t, y[:, None], end, True

    monkeypatch.setattr(analysis_limit_cycles, "_run", run)


def test_falling_branch_follows_the_cycle_to_its_fold(oscillator, suspended):
    settling = Settling(longest=200.0, change=1e-4)
    table = falling_branch(*suspended, [36.0, 42.0, 48.0, 54.0], settling, [0.005], 0.1)
    cycles = table[table["status"] == "limit cycle"]
    m = (cycles["speed_m_per_s"] - HOPF) / 40.0
    exact = 0.01 * np.sqrt(0.5 * (1.0 + np.sqrt(1.0 + 4.0 * m)))
    np.testing.assert_allclose(cycles["amplitude_m"], exact, rtol=0.02)  # slow beside the fold
    np.testing.assert_allclose(cycles["frequency_Hz"], 6.0, rtol=1e-3)
    table["branch"] = "falling"
    found = nonlinear_critical_speed(table)
    assert found["uncertainty_m_per_s"] <= 0.1
    assert found["nonlinear_critical_speed_m_per_s"] == pytest.approx(HOPF - 10.0, abs=0.2)
    assert found["amplitude_m"] == pytest.approx(0.01 * math.sqrt(0.5), rel=0.1)


def test_a_lost_cycle_is_found_again_from_a_fresh_disturbance(oscillator, suspended):
    """At 45 m/s (m = -1/8) motions below r = 0.383 come to rest: a disturbance of 2 mm does, one of 5 mm does not."""
    settling = Settling(longest=200.0)
    rest, cycle = (falling_branch(*suspended, [45.0], settling, [y], 0.1)["status"].item() for y in (0.002, 0.005))
    assert (rest, cycle) == ("at rest", "limit cycle")
    assert falling_branch(*suspended, [45.0], settling, [0.002, 0.005], 0.1)["status"].item() == "limit cycle"


def test_rising_branch_leaves_rest_where_it_is_unstable(oscillator, suspended):
    table = rising_branch(*suspended, [46.0, 49.0, 51.0, 54.0], Settling(longest=400.0))
    assert list(table["status"]) == ["at rest", "at rest", "limit cycle", "limit cycle"]
    assert table["amplitude_m"].iloc[2] == pytest.approx(0.01 * math.sqrt(0.5 * (1.0 + math.sqrt(1.1))), rel=0.01)


def test_motions_that_do_not_settle_say_so(oscillator, suspended):
    """At 50.4 m/s a small motion grows by 1 % a second, at 49.6 m/s it decays as slowly."""
    for speed, status in ((50.4, "growing"), (49.6, "decaying")):
        model, state = at_speed(*suspended, speed)
        row, _ = settle_motion(model, shifted(model, state, 2e-4), Settling(longest=60.0))
        assert row["status"] == status
        assert row["simulated_s"] == pytest.approx(60.0)


@pytest.mark.parametrize(
    ("amplitudes", "found"),
    [
        ([1.0, 1.001, 1.3, 1.301, 0.8], ("irregular", 0.8)),  # two by two they agree by chance
        ([1.0, 1.0015, 1.003, 1.3, 1.2], ("irregular", 1.2)),  # two by two, but the three do not
        ([1.5, 1.0, 1.001, 1.0005, 1.0], ("limit cycle", 1.0005)),
    ],
)
def test_three_windows_agree_on_a_limit_cycle(suspended, monkeypatch, amplitudes, found):
    sizes, t = iter(amplitudes), np.linspace(0.0, 1.0, 401)

    def run(model, state, settling):
        return t, 1e-3 * next(sizes) * np.cos(8.0 * np.pi * t)[:, None], state, True

    monkeypatch.setattr(analysis_limit_cycles, "_run", run)
    row, _ = settle_motion(*suspended, Settling(window=1.0, longest=5.0))
    assert (row["status"], row["amplitude_m"]) == (found[0], pytest.approx(1e-3 * found[1]))


def test_limit_cycle_of_a_wheelset_equals_that_of_a_plain_run():
    """From another start and in one go, `simulate` ends on the same limit cycle, within a per cent.

    Both start near it: on the flanges the wheelset hunts irregularly first, for as long as it happens to.
    """
    source = ELLIPTIC / "suspended_wheelset.yaml"
    changes = ["contact.detection=planar", "speed=60.0"]
    table = limit_cycles(load_scene(source, changes), [60.0], Settling(longest=10.0, change=0.01), [0.003], 1.0)
    cycle = table[table["branch"] == "falling"].iloc[0]
    assert cycle["status"] == "limit cycle"
    further = ["output.channels=[pose]", "initial.y=0.0025", "integration.duration=6.0", "output.rate=500"]
    run = simulate(load_scene(source, changes + further))
    assert cycle["amplitude_m"] == pytest.approx(amplitude(run["wheelset"].y_m[run.t >= 4.0]), rel=0.01)


def test_a_derailed_vehicle_is_not_on_a_limit_cycle(oscillator, suspended, monkeypatch):
    """Runs from 11 mm on derail here; those from 5 mm are on the cycle, however far the others got."""
    run = analysis_limit_cycles._run

    def derailing(model, state, settling):
        t, y, end, _ = run(model, state, settling)
        return (t, y, end, True) if abs(state[1]) < 0.011 else (t, y + np.linspace(0, 1, len(y))[:, None], end, False)

    monkeypatch.setattr(analysis_limit_cycles, "_run", derailing)
    assert falling_branch(*suspended, [46.0], Settling(), [0.012, 0.005], 0.1)["status"].item() == "limit cycle"
    assert falling_branch(*suspended, [46.0], Settling(), [0.012], 0.1)["status"].item() == "derailed"


def test_the_falling_branch_goes_on_below_speeds_at_which_everything_derails(oscillator, suspended, monkeypatch):
    run = analysis_limit_cycles._run
    monkeypatch.setattr(
        analysis_limit_cycles, "_run",
        lambda model, state, settling: (*run(model, state, settling)[:3], model.speed < 50.0),
    )  # fmt: skip
    table = falling_branch(*suspended, [46.0, 48.0, 52.0], Settling(longest=200.0), [0.005], 5.0)
    assert list(table["status"]) == ["derailed", "limit cycle", "limit cycle"]
    assert list(table["speed_m_per_s"]) == [52.0, 48.0, 46.0]


def test_critical_table():
    """Linear and nonlinear critical speeds of both detections side by side; nothing found stays empty."""
    linear = pd.DataFrame({"variant": ["planar", "spatial"], "critical_speed_m_per_s": [58.1, 58.0], "mode": "hunting"})
    cycles = pd.DataFrame({
        "detection": "planar", "branch": "falling", "speed_m_per_s": [60.0, 52.0, 50.0, 48.0],
        "amplitude_m": [7e-3, 6e-3, 5e-3, 1e-5], "frequency_Hz": [9.0, 8.0, 7.0, np.nan],
        "status": ["irregular", "limit cycle", "limit cycle", "at rest"],
    })  # fmt: skip
    planar, spatial = critical_table({"wheelset": linear}, {"wheelset": cycles}).to_dict("records")
    assert planar["linear_critical_speed_m_per_s"] == 58.1
    assert (planar["nonlinear_critical_speed_m_per_s"], planar["uncertainty_m_per_s"]) == (49.0, 2.0)
    assert (planar["amplitude_m"], planar["cycle_frequency_Hz"]) == (5e-3, 7.0)
    assert math.isnan(spatial["nonlinear_critical_speed_m_per_s"])


@pytest.mark.parametrize(("wrong", "said"), [
    ({"resolution": math.nan}, "resolution"), ({"resolution": 0.0}, "resolution"),
    ({"disturbances": []}, r"a list.*got \[\]"), ({"disturbances": [0.006, math.nan]}, "disturbances"),
    ({"disturbances": [0.06]}, "disturbances"),
])  # fmt: skip
def test_wrong_numbers_are_refused_before_anything_runs(wrong, said):
    with pytest.raises(InputError, match=said):
        limit_cycles(ELLIPTIC / "suspended_wheelset.yaml", [40.0], **wrong)


@pytest.mark.parametrize("name", ["window", "longest", "change", "rest", "disturbance", "rate", "rtol"])
def test_a_settling_is_made_of_positive_numbers(name):
    for value in (math.nan, 0.0, -1.0):
        with pytest.raises(InputError, match=f"Settling: {name}"):
            Settling(**{name: value})


def test_a_ramp_dies_below_the_fold_and_comes_nearer_when_it_is_slower(oscillator, suspended, monkeypatch):
    """The oscillator's fold is at 40 m/s; its cycle at 54 m/s is reached from 5 mm."""
    monkeypatch.setattr(analysis_limit_cycles, "straight_ahead", lambda scene: suspended)
    ends = []
    for rate in (0.5, 0.1):
        table = speed_ramp(ELLIPTIC / "suspended_wheelset.yaml", 54.0, 20.0, rate, Settling(1.0, 100.0), [0.002, 0.005])
        m = (table["speed_m_per_s"] - HOPF) / 40.0
        cycle = 0.01 * np.sqrt(0.5 * (1.0 + np.sqrt(1.0 + 4.0 * m[m > -0.2])))
        np.testing.assert_allclose(table["amplitude_m"][m > -0.2], cycle, rtol=0.03)
        np.testing.assert_allclose(np.diff(table["speed_m_per_s"]), -rate)
        np.testing.assert_allclose(table["t_s"], np.arange(1, len(table) + 1))
        assert table["amplitude_m"].iloc[-1] < Settling().rest <= table["amplitude_m"].iloc[-2]
        ends.append(table.loc[table["amplitude_m"] > 1e-3, "speed_m_per_s"].min())
    assert HOPF - 20.0 < ends[0] < ends[1] < HOPF - 10.0


def test_a_ramp_falls():
    with pytest.raises(InputError, match="speed_ramp: end: expected less than the start of 40 m/s"):
        speed_ramp(ELLIPTIC / "suspended_wheelset.yaml", 40.0, 50.0)


@pytest.mark.parametrize("after, branches", [(2, {"falling"}), (6, {"falling", "rising"})])
def test_limit_cycles_stopped_returns_the_rows_so_far(oscillator, suspended, monkeypatch, capsys, after, branches):
    monkeypatch.setattr(analysis_limit_cycles, "straight_ahead", lambda scene: suspended)
    speeds, settling, said, left = [42.0, 48.0, 52.0, 54.0], Settling(longest=400.0), [], [after]
    scene = ELLIPTIC / "suspended_wheelset.yaml"
    whole = limit_cycles(scene, speeds, settling, [0.005], 5.0, said.append)
    assert "stopped" not in whole.attrs and len(said) == len(whole) and said[0].endswith("at most 3 speeds remain")
    settle = settle_motion

    def stopped(*given):
        left[0] -= 1
        if left[0] < 0:
            raise KeyboardInterrupt
        return settle(*given)

    monkeypatch.setattr(analysis_limit_cycles, "settle_motion", stopped)
    table = limit_cycles(scene, speeds, settling, [0.005], 5.0)
    assert table.attrs["stopped"] and set(table["branch"]) == branches and list(table.columns) == list(whole.columns)
    known = whole.merge(table, on=["branch", "speed_m_per_s", "amplitude_m", "status"])
    assert len(known) == len(table) < len(whole)
    assert "limit_cycles: stopped; the table holds what was found" in capsys.readouterr().err
    left[0] = 0
    with pytest.raises(KeyboardInterrupt):  # there is nothing to return
        limit_cycles(scene, speeds, settling, [0.005], 5.0)
