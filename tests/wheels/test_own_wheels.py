"""Wheels and rails that differ from each other, and wheels that turn independently."""

import json

import numpy as np
import pytest

from tests.conftest import ELLIPTIC
from tests.energy_balance import energy_balance
from wrcore.balance.linear import steady_running
from wrcore.errors import InputError
from wrcore.run.simulate import simulate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

SCENE = ELLIPTIC / "suspended_wheelset.yaml"
CONES = {"wheel.profile": "cone:1/20", "rail.profile": "circle:0.3", "rail.inclination": 0}
SHORT = {"integration.duration": 0.4, "integration.method": "tsit5", "integration.rtol": 1e-7}


def test_wheels_that_are_said_to_differ_but_do_not_change_nothing():
    same = {"wheel.right": {"profile": "S1002"}, "rail.left": {"profile": "UIC60-MBench"}}
    ours, plain = (simulate(load_scene(SCENE, SHORT | more)) for more in (same, {}))
    np.testing.assert_allclose(ours["wheelset"].y_m, plain["wheelset"].y_m, rtol=0.0, atol=1e-9)
    assert ours.counters["steps"] == plain.counters["steps"]
    assert load_scene(SCENE).pairs == () and len(load_scene(SCENE, same).pairs) == 2


def test_exchanged_sides_give_the_mirrored_run():
    # a worn (smaller, conical) wheel and another rail on the left or on the right; released on either side
    wheel, rail = {"profile": "cone:1/20", "rolling_radius": 0.4585}, {"profile": "60E1", "inclination": "1/20"}
    runs = [
        simulate(load_scene(SCENE, SHORT | {f"wheel.{side}": wheel, f"rail.{side}": rail, "initial.y": y}))
        for side, y in (("left", 0.002), ("right", -0.002))
    ]
    for name, sign in (("y_m", -1), ("yaw_rad", -1), ("roll_rad", -1), ("z_m", 1), ("vx_m_per_s", 1)):
        one, other = (run["wheelset"][name] for run in runs)
        np.testing.assert_allclose(one, sign * other, rtol=0.0, atol=1e-8, err_msg=name)
    assert np.ptp(runs[0]["wheelset"].y_m + runs[1]["wheelset"].y_m) < 1e-8 < np.ptp(runs[0]["wheelset"].y_m)
    assert np.nanmax(np.abs(runs[0]["wheelset/left"].N_N - runs[1]["wheelset/right"].N_N)) < 10.0


def test_a_wheelset_runs_where_its_rolling_radii_are_equal():
    # cones: r_left + y/20 and r_right - y/20 are equal at y = 10 (r_right - r_left); springs as good as none
    scene = load_scene(SCENE, CONES | {"wheel.right": {"rolling_radius": 0.4601}, "initial.y": 0.0})
    model, state = compile_scene(scene)
    springs = model.elements.springs.copy()
    springs[:, 6:8] = 1.5e3, 1.5
    found = steady_running(model._replace(elements=model.elements._replace(springs=springs)), state)
    assert np.abs(found.residual).max() < 1e-6
    # the wheelset rolls by 7e-5 rad: on the circular rail head of 0.3 m contacts move by 2 % of the way
    assert found.state[1] == pytest.approx(1e-3, rel=0.03)


def test_each_wheelset_has_its_own_wheels():
    wheels = {"wheelset_2": {"left": {"rolling_radius": 0.4597}, "right": {"rolling_radius": 0.4597}}}
    scene = load_scene(ELLIPTIC / "trailer_vehicle.yaml", {"wheel.wheelsets": wheels, "initial.y": 0.0})
    assert [pair.rolling_radius for pair in scene.pairs] == [0.46] * 2 + [0.4597] * 2 + [0.46] * 4
    model, state = compile_scene(scene)
    axles = [state[13 * body : 13 * (body + 1)] for body in model.bodies.wheelsets]
    rates = np.array([axle[11] for axle in axles])
    assert rates[1] / rates[0] == pytest.approx(0.46 / 0.4597, rel=2e-5)
    assert axles[0][2] - axles[1][2] == pytest.approx(3e-4, abs=2e-5)  # it stands lower; its springs give 7 um
    assert rates[2] == pytest.approx(rates[3], rel=1e-6)


BAD = [
    ({"wheel.wheelsets": {"axle_3": {"left": {}}}}, "wheel.wheelsets.axle_3", "expected one of wheelset, got 'axle_3'"),
    ({"wheel.left": {"rolling_radius": 460}}, "wheel.left.rolling_radius", "in m"),
    ({"wheel.left": {"rolling_radius": 0.35}}, "wheel.left.rolling_radius", "within 0.05 m of 0.46 m"),
    ({"wheel.left": {"profile": "S1003"}}, "wheel.left.profile", "expected"),
    ({"wheel.left": {"inclination": "1/40"}}, "wheel.left.inclination", "unknown key"),
    ({"wheel.wheelsets": {"wheelset": {"right": {"profile": "no.csv"}}}}, "wheel.wheelsets.wheelset.right.profile",
     "existing file"),
    ({"rail.right": {"profile": "no.csv"}}, "rail.right.profile", "existing file"),
    ({"rail.right": {"inclination": "steep"}}, "rail.right.inclination", "a ratio"),
    ({"rail.both": {}}, "rail.both", "unknown key"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "field", "expected"), BAD)
def test_bad_descriptions_name_their_field(changes, field, expected):
    with pytest.raises(InputError) as caught:
        load_scene(SCENE, [f"{key}={json.dumps(value)}" for key, value in changes.items()])
    assert caught.value.field == field and expected in caught.value.expected


@pytest.fixture(scope="module")
def independent(tmp_path_factory):
    """Scene file of the suspended wheelset with independent wheels."""
    folder = tmp_path_factory.mktemp("independent")
    text = (ELLIPTIC.parent / "vehicles" / "suspended_wheelset.yaml").read_text()
    text = text.replace("    kind: wheelset\n", "    kind: wheelset\n    independent_wheels: true\n")
    (folder / "independent.yaml").write_text(text)
    scene = SCENE.read_text().replace("vehicles/suspended_wheelset.yaml", "independent.yaml")
    (folder / "scene.yaml").write_text(scene)
    return folder / "scene.yaml"


def test_independent_wheels_roll_through_a_curve_as_their_rails_are_long(independent):
    # nothing couples the wheels: in a curve of radius R each one rolls at V (1 -+ b/R) over its rolling radius
    path = [{"transition": 30}, {"curve": 300, "radius": 200, "cant": 0.1}]
    changes = {"track.path": path, "initial.y": 0.0, "integration.duration": 8.0, "speed": 12.0}
    run = simulate(load_scene(independent, changes))
    w, end = run["wheelset"], slice(-50, None)
    assert run.status == "completed"
    lengths, turned = [], []
    for side, sign in (("left", 1.0), ("right", -1.0)):
        contact = run[f"wheelset/{side}"]
        loaded = contact.N_N[end] > 0.5 * np.nanmax(contact.N_N[end])
        assert (loaded.sum(axis=1) == 1).all()
        y, z = contact.y_m[end][loaded], contact.z_m[end][loaded]
        turned.append(w[f"rolling_rate_{side}_rad_per_s"][end] * (w.z_m[end] - z))
        lengths.append(12.0 * (1.0 - y / 200.0))
        assert np.abs(contact.xi[end][loaded]).max() < 2e-4, sign  # a solid wheelset has some 1e-3 here
    assert np.mean(turned[1] / turned[0]) == pytest.approx(np.mean(lengths[1] / lengths[0]), rel=1e-4)
    assert np.mean(turned[1]) > np.mean(turned[0]) * 1.006


def test_independent_wheels_do_not_steer(independent):
    # without the couple of longitudinal creep forces a wheelset does not hunt: a solid one swings at 20 m/s
    solid, free = (
        simulate(load_scene(file, {"initial.y": 0.002, "integration.duration": 1.5})) for file in (SCENE, independent)
    )
    later = solid.t > 0.05  # until then the wheels find the rates that both patches of each of them agree on
    creep = [np.nansum(run["wheelset/left"].Fx_N - run["wheelset/right"].Fx_N, axis=1)[later] for run in (solid, free)]
    assert np.abs(creep[1]).max() < 0.03 * np.abs(creep[0]).max()


@pytest.mark.parametrize("method", ["tsit5", "rodas4", "ros34pw2"])
def test_the_energy_of_independent_wheels_balances(independent, method):
    # with friction 0.3 the wheels turn apart by the spin of their patches alone; a run starts 3 mm off
    changes = {"initial.y": 0.003, "integration.duration": 0.5, "integration.method": method, "integration.rtol": 1e-7,
               "output.rate": 5000.0, "output.channels": ["velocity", "energy"]}  # fmt: skip
    run = simulate(load_scene(independent, changes))
    apart = run["wheelset"].rolling_rate_left_rad_per_s - run["wheelset"].rolling_rate_right_rad_per_s
    assert np.ptp(apart) > 1e-2
    balance = energy_balance(run.groups["energy"], run.t)
    assert np.abs(balance.imbalance).max() < 2e-6 * balance.turned_over[-1]


def test_own_wheels_beside_a_drive_and_friction_along_the_track():
    """All kernels that are reached by address, for a model of wheels of their own that are all alike."""
    changes = {
        "initial.y": 0.002, "integration.duration": 0.2,
        "contact.friction": {"arc_length": [0.0, 3.0], "mu": [0.3, 0.2]},
        "drive.brakes": [{"name": "brake", "bodies": ["wheelset", "frame"], "torque": 500.0}],
    }  # fmt: skip
    one, own = (simulate(load_scene(SCENE, changes | more)) for more in ({}, {"wheel.left": {"rolling_radius": 0.46}}))
    assert one.status == own.status == "completed"
    np.testing.assert_allclose(own["wheelset"].y_m, one["wheelset"].y_m, rtol=0, atol=1e-9)
    np.testing.assert_allclose(own["wheelset"].wy_rad_per_s, one["wheelset"].wy_rad_per_s, rtol=0, atol=1e-7)
