"""Air springs against bag, reservoir and orifice as their equations have them."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.energy_balance import energy_balance
from tests.vehicle.conftest import element
from wrcore.errors import InputError
from wrcore.forces.law import FIRST, LAST, NUMBERS
from wrcore.run.simulate import simulate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene, static_equilibrium
from wrcore.vehicle.description import build_vehicle

AREA, BAG, RESERVOIR = 0.25, 0.05, 0.08
AIR = {"name": "air", "kind": "air_spring", "bodies": ["body", "frame"], "at": [0.0, 0.0, 0.5], "effective_area": AREA,
       "volume": BAG, "reservoir": RESERVOIR, "orifice_damping": 4e4, "area_change": 0.2}  # fmt: skip
HELD = {"name": "held", "kind": "spring_damper", "bodies": ["body", "frame"], "at": [0.0, 0.0, 0.5],
        "stiffness": [1e5, 1e5, 0.0], "rotation_stiffness": [1e5, 1e5, 1e5]}  # fmt: skip
BODY = {"kind": "body", "mass": 9000.0, "inertia": {"roll": 1e3, "pitch": 1e3, "yaw": 1e3}, "position": [0.0, 0.0, 1.0]}


def elements_of(**changes):
    air = {key: value for key, value in {**AIR, **changes}.items() if value is not None}
    return build_vehicle({"name": "air", "bodies": {"body": BODY}, "elements": [air, HELD]}, "air.yaml").elements


def physical(exponent=1.4):
    """Stiffnesses of bag, reservoir and changing area at the pressure that carries 9 t."""
    over = 9000.0 * 9.81 / AREA
    stiffness = exponent * (over + 101325.0) * AREA**2
    return stiffness / BAG, stiffness / RESERVOIR, over * 0.2


def test_dynamic_stiffness_is_that_of_bag_reservoir_and_orifice():
    bag, behind, changing = physical()
    elements = elements_of()
    below = elements.springs[elements.springs[:, 8] > 0.0, 8].sum()
    series, damping = elements.directed[0, NUMBERS : NUMBERS + 2]
    for omega in (0.0, 1.0, 2.0 * np.pi, 40.0, 1e4):
        drag = 4e4j * omega
        expected = changing + bag * (behind + drag) / (bag + behind + drag)
        maxwell = 1j * omega * damping
        assert below + series * maxwell / (series + maxwell) == pytest.approx(expected, rel=1e-9), omega
    assert below == pytest.approx(changing + bag * BAG / (BAG + RESERVOIR), rel=1e-9)  # one volume in the long run
    assert below + series == pytest.approx(changing + bag, rel=1e-9)  # the bag alone at once


def test_without_a_reservoir_it_is_the_bag():
    elements = elements_of(reservoir=None, orifice_damping=None, polytropic_exponent=1.0, shear_stiffness=2e5)
    bag, _, changing = physical(1.0)
    row = elements.springs[elements.springs[:, 8] > 0.0][0]
    assert row[6:9] == pytest.approx([2e5, 2e5, changing + bag], rel=1e-9)
    assert row[14] == pytest.approx(9000.0 * 9.81, rel=1e-12) and elements.states == 0


def test_a_turbulent_orifice_presses_as_its_power_law():
    # 15 mm at 1.2 Hz: the physical equation, w' = (D / C)^(1 / beta), against the compiled one
    bag, behind, changing = physical()
    exponent, drag, omega = 1.8, 6e5, 2.0 * np.pi * 1.2
    elements = elements_of(orifice_damping=drag, orifice_exponent=exponent)
    below = elements.springs[elements.springs[:, 8] > 0.0, 8].sum()
    series, first, last = elements.directed[0, NUMBERS], *elements.law[0, [FIRST, LAST]]
    points, z = elements.table[first:last, :2], lambda t: 0.015 * np.sin(omega * t)

    def through(t, w):
        push = bag * (z(t) - w) - behind * w
        return np.sign(push) * (np.abs(push) / drag) ** (1.0 / exponent)

    times = np.linspace(0.0, 3.0, 3001)
    kept = {"t_eval": times, "rtol": 1e-9, "atol": 1e-12, "method": "LSODA"}
    w = solve_ivp(through, (0.0, 3.0), [0.0], **kept).y[0]
    y = solve_ivp(lambda t, y: np.interp(series * (z(t) - y), *points.T), (0.0, 3.0), [0.0], **kept).y[0]
    force = changing * z(times) + bag * (z(times) - w)
    ours = below * z(times) + series * (z(times) - y)
    hysteresis = np.max(np.abs(force - below * z(times)))
    assert hysteresis > 1000.0
    assert np.max(np.abs(ours - force)) < 0.01 * hysteresis
    turn = times >= 3.0 - 2.0 * np.pi / omega
    loss, our_loss = (np.trapezoid(f[turn], z(times)[turn]) for f in (force, ours))
    assert our_loss == pytest.approx(loss, rel=0.01) and loss > 10.0


@pytest.fixture
def on_air(trailer, scene_of):
    """Scene file of the trailer vehicle on air springs."""
    for bogie in "12":
        for side in ("left", "right"):
            old = element(trailer, f"secondary_spring_{bogie}_{side}")
            kept = {key: old[key] for key in ("name", "bodies", "at", "bending_stiffness") if key in old}
            air = {key: AIR[key] for key in AIR if key not in ("name", "bodies", "at")}
            trailer["elements"][trailer["elements"].index(old)] = {**kept, **air, "shear_stiffness": 1.6e5,
                                                                  "orifice_exponent": 1.8}  # fmt: skip
    return scene_of(trailer)


def test_a_vehicle_rests_and_runs_on_air(on_air):
    scene = load_scene(on_air, {"initial.y": 0.0})
    model, _ = compile_scene(scene)
    rest = static_equilibrium(scene, model)
    z = rest.state[2 : 13 * len(model.bodies.mass) : 13]
    assert np.ptp(z - scene.vehicle.positions[:, 2]) < 1e-9  # all sink with the wheels, by 0.2 mm
    rough = {"spectrum": {"level": "high", "seed": 3, "length": 60.0, "begin": -10.0}}
    changes = {"track.irregularity": rough, "speed": 30.0, "integration.duration": 1.5, "integration.rtol": 1e-7,
               "integration.method": "rk45", "output.rate": 5000.0, "output.channels": ["pose", "energy"]}  # fmt: skip
    run = simulate(load_scene(on_air, changes))
    balance = energy_balance(run.groups["energy"], run.t)
    assert run.status == "completed" and np.ptp(run["car_body"].z_m) > 1e-4
    assert np.abs(balance.imbalance).max() < 2e-6 * balance.turned_over[-1]


BAD = [
    ({"reservoir": None}, "elements.air", "both a reservoir"),
    ({"orifice_damping": None}, "elements.air", "both a reservoir"),
    ({"reservoir": None, "orifice_damping": None, "orifice_exponent": 2.0}, "elements.air.orifice_exponent", "a res"),
    ({"effective_area": 2400.0}, "elements.air.effective_area", "in m^2"),
    ({"volume": None}, "elements.air.volume", "needs one"),
    ({"stiffness": 1e5}, "elements.air.stiffness", "unknown for kind air_spring"),
    ({"preload": 9e4}, "elements.air.preload", "three numbers"),
    ({"preload": [0.0, 0.0, 0.0]}, "elements.air", "part of the weight"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "field", "expected"), BAD)
def test_bad_air_springs_are_named(changes, field, expected):
    with pytest.raises(InputError) as caught:
        elements_of(**changes)
    assert caught.value.field == field and expected in caught.value.expected
