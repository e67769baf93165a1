"""Balance in curves against ends of runs, statics and Redtenbacher's rolling line; roll on canted track."""

import math

import numpy as np
import pandas as pd
import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC, ROOT, SCENES
from wrcore.cli import main
from wrcore.equations.equations_of_motion import Equations
from wrcore.errors import InputError

TRAILER = ELLIPTIC / "trailer_vehicle.yaml"
CURVES = {  # radius and cant, m; speed, m/s; friction
    "flange": (300.0, 0.1, 20.0, 0.3), "tread and flange": (600.0, 0.1, 20.0, 0.3),
    "right, little friction": (-600.0, 0.05, 25.0, 0.1),
    "wide": (1500.0, 0.0, 30.0, 0.4),
}  # fmt: skip


def scene_of(case):
    """The trailer vehicle; on rails that its wheels touch in several patches at once if the case is of these."""
    rail = {"rail": {"profile": "60E1", "inclination": "1/20"}} if case == "tread and flange" else {}
    return wr.load_scene(TRAILER, contact__friction=CURVES[case][3], **rail)


def run_to_rest(scene, radius, cant, speed):
    """A run into the curve, 30 s long."""
    path = [{"tangent": 20}, {"transition": 100}, {"curve": 1000, "radius": radius, "cant": cant}]
    return wr.simulate(
        scene, speed=speed, initial={"y": 0.0}, track={"path": path},
        integration={"duration": 30.0, "rtol": 1e-6},
        output={"rate": 10.0, "channels": ["pose", "velocity", "contact"]},
    )  # fmt: skip


@pytest.mark.parametrize("case", CURVES)
def test_it_is_where_a_run_ends(case):
    """Wheel forces within 10 N of some 60 kN; places within a micrometre."""
    (radius, cant, speed, _), scene = CURVES[case], scene_of(case)
    run = run_to_rest(scene, radius, cant, speed)
    patches = max(np.count_nonzero(np.isfinite(run[name].N_N[-1])) for name in run if "/" in name)
    assert (patches > 1) == (case == "tread and flange")
    radii = [math.copysign(r, radius) for r in (1e6, 5000.0, 2000.0, 1000.0, 500.0) if r > abs(radius)]
    table = wr.quasi_static_curving(scene, [*radii, radius], cant, speed)
    here = table[table["radius_m"] == radius].set_index(["wheelset", "side"])
    for (wheelset, side), row in here.iterrows():
        wheel = run[f"{wheelset}/{side}"]
        assert row["Q_N"] == pytest.approx(wheel.Q_N[-1], abs=10.0)
        assert row["Y_N"] == pytest.approx(wheel.Y_N[-1], abs=10.0)
        assert row["y_m"] == pytest.approx(run[wheelset].y_m[-1], abs=1e-6)
        assert row["yaw_rad"] == pytest.approx(run[wheelset].yaw_rad[-1], abs=2e-6)
    assert np.all(here["residual_m_per_s2"] < 1e-6)


def test_one_of_many_curves_takes_a_thousandth_of_the_evaluations_of_its_run(monkeypatch):
    """Each is found from the one before: slopes stay, and where two curves lead is where the third one begins."""
    (radius, cant, speed, _), scene, evaluate, taken = CURVES["flange"], scene_of("flange"), Equations.at, []

    def counted(self, t, states, *mode):
        taken.append(len(states))
        return evaluate(self, t, states, *mode)

    monkeypatch.setattr(Equations, "at", counted)
    counts = []
    for curves in ([1e-4], np.linspace(1e-4, 1.0 / radius, 101)):
        taken.clear()
        table = wr.quasi_static_curving(scene, 1.0 / np.asarray(curves), cant, speed)
        assert np.all(table["residual_m_per_s2"] < 1e-6)
        counts.append(sum(taken))
    each = (counts[1] - counts[0]) / 100
    assert each < 25.0
    assert each < 1e-3 * run_to_rest(scene, radius, cant, speed).counters["rhs_evaluations"]


def test_a_curve_asked_for_twice_has_the_same_balance():
    table = wr.quasi_static_curving(TRAILER, [500.0, 800.0, 500.0], 0.1, 20.0).groupby("radius_m")["Y_N"]
    first, second = table.get_group(500.0).to_numpy().reshape(2, -1)
    np.testing.assert_allclose(first, second, atol=0.01)


def test_forces_hold_the_weight_in_the_turn():
    """Sum of Q: m (g cos + v^2/R sin); of Y: m (v^2/R cos - g sin), outwards."""
    scene, radius, cant, deficiency = wr.load_scene(TRAILER), 800.0, 0.12, 0.1
    mass, roll = scene.vehicle.bodies.mass.sum(), math.asin(cant / 1.5)
    table = wr.quasi_static_curving(scene, [radius, -radius], cant, cant_deficiency=deficiency)
    for side in (1.0, -1.0):
        rows = table[table["radius_m"] == side * radius]
        turn = rows["speed_m_per_s"].iloc[0] ** 2 / radius
        assert turn == pytest.approx(9.81 * (cant + deficiency) / 1.5, rel=1e-3)
        assert rows["Q_N"].sum() == pytest.approx(mass * (9.81 * math.cos(roll) + turn * math.sin(roll)), rel=2e-3)
        outwards = mass * (turn * math.cos(roll) - 9.81 * math.sin(roll))
        wheelsets = rows.drop_duplicates("wheelset")
        assert -side * wheelsets["sum_Y_N"].sum() == pytest.approx(outwards, rel=2e-3)
    left, right = (table[table["radius_m"] == side * radius].reset_index() for side in (1.0, -1.0))
    mirrored = right["Q_N"].to_numpy().reshape(-1, 2)[:, ::-1].ravel()
    np.testing.assert_allclose(left["Q_N"], mirrored, rtol=1e-6)


def cone(**changes):
    """A free wheelset with cones on round rails."""
    return {
        "name": "cone", "speed": 0.5, "contact": {"creep": {"model": "linear"}},
        "vehicle": {"parameters": str(ROOT / "config/vehicles/wheelset.yaml")},
        "wheel": {"profile": "cone:1/20"}, "rail": {"profile": "circle:0.3"}, **changes,
    }  # fmt: skip


def test_a_free_wheelset_rolls_on_redtenbacher_s_line():
    """y = -e r/(g R): both wheels roll without slip (Redtenbacher 1855); a cone on round rails has the conicity
    g (e + R g)/(e - r g), see tests of its hunting."""
    scene, radius = wr.load_scene(cone()), 2000.0
    table = wr.quasi_static_curving(scene, [radius], cant=1.5 * 0.5**2 / radius / 9.81)
    slope, rolling, rail = 0.05, 0.46, 0.3
    e = scene.track.rail_distance(scene.rail) - rail * math.sin(math.atan(slope))
    conicity = slope * (e + rail * slope) / (e - rolling * slope)
    assert table["y_m"].iloc[0] == pytest.approx(-e * rolling / (conicity * radius), rel=0.01)
    assert abs(table["yaw_rad"].iloc[0]) < 1e-4
    assert -1e-3 < table["acceleration_m_per_s2"].iloc[0] < 0.0  # nothing pulls it


H, D, A, B, KY, KZ, BODY = 1.5, 1.04, 3.0, 1.0, 4e5, 1e6, 20e3
"""A body: height and that above its four springs, places of these, m; their stiffnesses, N/m; its mass, kg."""


def wagon():
    """A scene of a body on four springs on two wheelsets."""
    bodies = {"box": {"kind": "body", "mass": BODY, "inertia": {"roll": 2e4, "pitch": 2e5, "yaw": 2e5},
                      "position": [0.0, 0.0, H]}}  # fmt: skip
    elements = [{"name": "tow", "kind": "spring_damper", "bodies": ["box", "frame"], "at": [0.0, 0.0, H],
                 "stiffness": [1e6, 0.0, 0.0]}]  # fmt: skip
    for k, x in ((1, A), (2, -A)):
        bodies[f"axle_{k}"] = {
            "kind": "wheelset", "mass": 1200.0, "inertia": {"roll": 700.0, "pitch": 100.0, "yaw": 700.0},
            "position": [x, 0.0, 0.46], "rolling_radius": 0.46, "tape_circle_half_distance": 0.75,
        }  # fmt: skip
        elements += [
            {"name": f"spring_{k}_{side}", "kind": "spring_damper", "bodies": ["box", f"axle_{k}"],
             "at": [x, sign * B, H - D], "stiffness": [1e7, KY, KZ], "damping": [1e4, 1e4, 1e4]}
            for side, sign in (("left", 1.0), ("right", -1.0))
        ]  # fmt: skip
    return {"name": "box on springs", "source": "chosen", "bodies": bodies, "elements": elements}


def test_roll_coefficient_of_a_body_on_springs(tmp_path):
    """s = m g c/(4 k_z b^2 - m g c), c = d + m g/(4 k_y), for springs d below the centre of mass and b beside it, in
    the body's axes, that carry at the axle. It is that relative to the axle, which rolls a little, too."""
    import yaml

    (tmp_path / "wagon.yaml").write_text(yaml.safe_dump(wagon()))
    scene = {"name": "wagon", "vehicle": {"parameters": str(tmp_path / "wagon.yaml")}, "speed": 10.0,
             "wheel": {"profile": "S1002"}, "rail": {"profile": "UIC60-MBench", "inclination": "1/40"}}  # fmt: skip
    table = wr.roll_coefficient(scene, 0.02).set_index("body")["roll_coefficient"]
    weight = BODY * 9.81
    overturning = weight * (D + weight / (4.0 * KY))
    expected = overturning / (4.0 * KZ * B**2 - overturning)
    assert (table["box"] - table["axle_1"]) / (1.0 + table["axle_1"]) == pytest.approx(expected, rel=2e-3)
    assert abs(table["axle_1"]) < 0.1 * expected


def test_roll_does_not_depend_on_the_speed_of_rolling():
    slow, fast = (wr.roll_coefficient(wr.load_scene(TRAILER, speed=v))["roll_coefficient"] for v in (5.0, 40.0))
    np.testing.assert_allclose(slow, fast, rtol=1e-3)


def test_where_there_is_no_balance_is_said():
    """9 m/s^2 turn over what stands 1.5 m wide."""
    table = wr.quasi_static_curving(TRAILER, [1000.0, 100.0], 0.1, 30.0)
    none = table["radius_m"] == 100.0
    assert table.loc[none, "Q_N"].isna().all() and (table.loc[none, "residual_m_per_s2"] > 1e-4).all()
    assert table.loc[~none, "Q_N"].notna().all()


@pytest.mark.parametrize("scene, arguments, says", [
    (TRAILER, {"radii": [10.0]}, "radii: expected 20 m or more"),
    (TRAILER, {"radii": []}, "radii: expected"),
    (TRAILER, {"radii": [500.0], "speed": 20.0, "cant_deficiency": 0.1}, "expected either a speed or"),
    (TRAILER, {"radii": [500.0], "cant": 0.1, "cant_deficiency": -0.1}, "cant_deficiency: expected more than -0.1 m"),
    (TRAILER, {"radii": [500.0], "speed": 1e4}, "speeds: expected"),
    (ELLIPTIC / "freight_wagon_laden.yaml", {"radii": [500.0]}, "expected friction with series_stiffness"),
    (SCENES / "locomotive.yaml", {"radii": [500.0]}, "expected one without joints to the moving frame"),
])  # fmt: skip
def test_bad_input_is_named(scene, arguments, says):
    with pytest.raises(InputError, match=says):
        wr.quasi_static_curving(scene, **arguments)


def test_friction_along_the_track_is_refused():
    along = {"arc_length": [0.0, 5.0, 5.1], "mu": [0.1, 0.1, 0.5]}
    with pytest.raises(InputError, match="contact.friction: expected a coefficient that is the same all along"):
        wr.quasi_static_curving(wr.load_scene(TRAILER, {"contact.friction": along}), [700.0])


def test_the_command_writes_the_table(tmp_path):
    out = tmp_path / "curves.csv"
    words = ["--radius", "1000", "-500", "--cant", "0.1", "--set", "contact.friction=0.4", "--out", str(out)]
    assert main(["curving", str(TRAILER), *words]) == 0
    rows = pd.read_csv(out)
    again = wr.quasi_static_curving(wr.load_scene(TRAILER, contact__friction=0.4), [1000.0, -500.0], 0.1)
    np.testing.assert_allclose(rows["Y_N"], again["Y_N"], rtol=1e-9)
