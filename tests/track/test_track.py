"""Wheelsets on curved and irregular tracks against the tangent track in the local frame."""

import json
import math

import numpy as np
import pytest

from tests.conftest import ELLIPTIC, SCENES
from wrcore.bodies.body import euler_of
from wrcore.contact.search import reduction as columns
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.model import workspace
from wrcore.geometry.path import track_frame
from wrcore.geometry.track import rotation
from wrcore.run.simulate import simulate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

SAME = (columns.U_WHEEL, columns.U_RAIL, columns.ANGLE, columns.PENETRATION, columns.CURVATURE_Y)


def compiled(track, *overrides):
    scene = load_scene(ELLIPTIC / "suspended_wheelset.yaml", [f"track={json.dumps(track)}", *overrides])
    return (scene, *compile_scene(scene))


def placed(model, s, y, z, roll, yaw, speed=20.0, spin=43.5):
    """State of a wheelset in a pose relative to the track's frame at s, rolling along the track's tangent."""
    frame = np.empty((3, 3))
    station = track_frame(model.track.path, s, frame)
    turned = frame @ rotation(roll, yaw)
    position = np.array([station.x, station.y, station.z]) + frame[:, 1:] @ np.array([y, z])
    return np.concatenate([position, euler_of(turned), speed * frame[:, 0], spin * turned[:, 1]])


def evaluated(model, state, arc_length):
    """Right-hand side, patches per side and workspace at a state."""
    work = workspace(model)
    work.arc_lengths[:] = arc_length
    rate = Equations(model, work)(0.0, state)
    return rate, [work.patches[0, i, : work.counts[0, i]].copy() for i in range(2)], work


def test_a_path_of_tangents_changes_nothing():
    runs = [
        simulate(
            load_scene(
                ELLIPTIC / "suspended_wheelset.yaml",
                [f"track={json.dumps(t)}", "integration.duration=0.3", "integration.method=rk45"],
            )
        )
        for t in ({}, {"path": [{"tangent": 500}]})
    ]
    np.testing.assert_allclose(runs[1]["wheelset"].y_m, runs[0]["wheelset"].y_m, atol=1e-14)
    assert runs[0].counters["rhs_evaluations"] == runs[1].counters["rhs_evaluations"]
    np.testing.assert_allclose(runs[1]["wheelset"].s_m, runs[0]["wheelset"].x_m, atol=1e-12)


@pytest.mark.parametrize("cant", [0.0, 0.1])
@pytest.mark.parametrize("radius", [300.0, -300.0])
def test_radial_wheelset_in_a_curve_has_the_contact_of_the_tangent_track(radius, cant):
    pose = (-0.004, 0.45987, -2e-4, 0.0)
    path = [{"tangent": 10}, {"transition": 60}, {"curve": 200, "radius": radius, "cant": cant}]
    _, model, _ = compiled({"path": path})
    _, flat, _ = compiled({})
    _, patches, work = evaluated(model, placed(model, 150.0, *pose), 149.0)
    _, expected, _ = evaluated(flat, placed(flat, 0.0, *pose), 0.0)
    assert work.arc_lengths[0] == pytest.approx(150.0, abs=1e-9)
    for side, (ours, theirs) in enumerate(zip(patches, expected, strict=True)):
        assert len(ours) == len(theirs) > 0
        np.testing.assert_allclose(ours[:, SAME], theirs[:, SAME], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(ours[:, columns.X : columns.Z + 1], theirs[:, columns.X : columns.Z + 1], atol=1e-10)
        # known effect: the rail's own curvature 1/(R -+ Y) in the track's plane, seen along the contact normal
        rail = 1.0 / (radius - (1 - 2 * side) * 0.7605)
        tilt = math.asin(-math.copysign(cant, radius) / 1.5)  # frame's roll: curvature splits into lateral and vertical
        lateral, vertical = math.cos(tilt) / radius, -math.sin(tilt) / radius
        bend = 0.5 * (lateral * np.sin(ours[:, columns.ANGLE]) - vertical * np.cos(ours[:, columns.ANGLE]))
        change = ours[:, columns.CURVATURE_X] - theirs[:, columns.CURVATURE_X]
        np.testing.assert_allclose(change, bend, rtol=3e-3, atol=1e-9)  # 1/R for 1/(R -+ Y): 0.25 %
        assert abs(rail - 1 / radius) < 3e-3 * abs(1 / radius)


def irregular(tmp_path, **shapes):
    """A track with irregularity given as functions of s for the four channels."""
    s = np.arange(0.0, 200.01, 0.25)
    names = ("left_lateral", "left_vertical", "right_lateral", "right_vertical")
    values = [shapes.get(name, np.zeros_like)(s) for name in names]
    text = ",".join(["s_m", *(f"{name}_m" for name in names)]) + "\n"
    text += "\n".join(",".join(f"{v:.12g}" for v in row) for row in zip(s, *values, strict=True))
    path = tmp_path / "irregularity.csv"
    path.write_text(text)
    return {"irregularity": {"points": str(path), "fade_in": 20.0, "fade_out": 20.0}}


def test_a_widening_of_one_rail_leaves_the_other_where_it_is():
    def patches(widening, widened):
        path = [{"transition": 40}, {"curve": 200, "radius": 300, "widening": widening}]
        _, model, _ = compiled({"path": path, "widened": widened})
        return evaluated(model, placed(model, 100.0, 0.001, 0.4594, 0.0, 1e-3), 100.0)[1]

    none, both = patches(0.0, "both"), patches(0.004, "both")
    for widened, side in (("left", 0), ("right", 1)):
        found = patches(0.002, widened)
        for wheel, expected in enumerate((both, none) if side == 0 else (none, both)):
            np.testing.assert_allclose(found[wheel][:, SAME], expected[wheel][:, SAME], rtol=1e-9)
        assert np.abs(found[side][:, columns.U_RAIL] - none[side][:, columns.U_RAIL]).max() > 1e-4


def test_rails_moved_together_move_the_contact_with_them(tmp_path):
    # lateral 2 mm and vertical 3 mm over a plateau: the same patches in a pose moved by as much
    shift, lift = (lambda s: 0.002 + 0 * s), (lambda s: 0.003 + 0 * s)
    track = irregular(tmp_path, left_lateral=shift, right_lateral=shift, left_vertical=lift, right_vertical=lift)
    _, model, _ = compiled(track)
    _, flat, _ = compiled({})
    rate, patches, _ = evaluated(model, placed(model, 100.0, 0.005, 0.46287, -2e-4, 1e-3), 100.0)
    expected_rate, expected, _ = evaluated(flat, placed(flat, 0.0, 0.003, 0.45987, -2e-4, 1e-3), 0.0)
    for ours, theirs in zip(patches, expected, strict=True):
        np.testing.assert_allclose(ours[:, SAME], theirs[:, SAME], rtol=1e-6, atol=1e-10)
        np.testing.assert_allclose(ours[:, columns.Y] - theirs[:, columns.Y], 0.002, atol=1e-9)
        np.testing.assert_allclose(ours[:, columns.Z] - theirs[:, columns.Z], 0.003, atol=1e-9)


def test_rails_that_run_askew_are_yaw(tmp_path):
    # both rails drift to the left by 0.2 mm per metre: a wheelset with that yaw, moving along them, sees no curve
    slope = 2e-4
    drift = {f"{side}_lateral": lambda s: slope * (s - 100.0) for side in ("left", "right")}
    _, model, _ = compiled(irregular(tmp_path, **drift))
    _, flat, _ = compiled({})
    state = placed(model, 100.0, 0.0, 0.45981, 0.0, slope)
    state[7:10] = 20.0 * np.array([math.cos(slope), math.sin(slope), 0.0])
    _, patches, _ = evaluated(model, state, 100.0)
    _, expected, _ = evaluated(flat, placed(flat, 0.0, 0.0, 0.45981, 0.0, 0.0), 0.0)
    creepages = slice(columns.XI, columns.ETA + 1)
    for ours, theirs in zip(patches, expected, strict=True):
        np.testing.assert_allclose(ours[:, creepages], theirs[:, creepages], atol=1e-8)
        # measured across the rails the gauge is narrower by 0.76 m slope^2 = 3e-8 m, on a nearly conformal pair
        np.testing.assert_allclose(ours[:, columns.PHI], theirs[:, columns.PHI], rtol=1e-4)
        np.testing.assert_allclose(ours[:, columns.PENETRATION], theirs[:, columns.PENETRATION], rtol=1e-3)
    # A wheel that rolls without slip does so on any surface: without that yaw there is no lateral creepage either. The
    # rails do not move sideways, only the wheelset will, over them.
    _, patches, _ = evaluated(model, placed(model, 100.0, 0.0, 0.45981, 0.0, 0.0), 100.0)
    assert abs(patches[0][0, columns.ETA]) < 0.01 * slope


def test_a_curve_is_run_through_and_reported_in_the_tracks_frame():
    # 600 m left curve at 20 m/s: arc length V t, and a shift to the outside (to the right, y < 0): it gives the
    # outer wheel the larger radius
    path = [{"tangent": 20}, {"transition": 40}, {"curve": 400, "radius": 600, "cant": 0.06}]
    overrides = [f"track={json.dumps({'path': path})}", "initial.y=0", "integration.duration=8"]
    run = simulate(load_scene(ELLIPTIC / "suspended_wheelset.yaml", overrides))
    w = run["wheelset"]
    assert run.status == "completed"
    assert w.s_m[-1] == pytest.approx(160.0, abs=0.01)
    assert -0.006 < w.y_m[-1] < -0.001 and np.ptp(w.y_m[-100:]) < 1e-4
    u = [np.nanmean(run[f"wheelset/{side}"].u_wheel_m[-1]) for side in ("left", "right")]
    assert u[1] < u[0]  # the outer (right) wheel touches nearer to its flange, where its radius is larger


def freely_rolling(gradients, duration):
    """A centred free wheelset on straight track with gradients."""
    track = json.dumps({"gradients": gradients})
    overrides = [f"track={track}", "initial.y=0", f"integration.duration={duration}", "integration.rtol=1e-8"]
    return simulate(load_scene(SCENES / "wheelset.yaml", overrides))


def test_a_free_wheelset_rolls_down_a_gradient_with_g_sin_i():
    # rolling couples speed and spin: m v' = m g sin(i) - F, I w' = F r, so v' = g sin(i) m / (m + I / r^2)
    def acceleration(gradients):
        run = freely_rolling(gradients, 4.0)
        w, on = run["wheelset"], run.t > 2.0
        assert run.status == "completed" and np.abs(w.y_m).max() < 1e-6
        speed = np.hypot(w.vx_m_per_s, w.vz_m_per_s)[on]
        return np.polyfit(run.t[on], speed, 1)[0], np.mean(speed / np.abs(w.wy_rad_per_s[on]))

    slope = 0.03 / math.hypot(1.0, 0.03)
    found, radius = acceleration([{"gradient": 0.0, "length": 20.0}, {"gradient": -0.03, "radius": 500.0}])
    expected = 9.81 * slope * 1813.0 / (1813.0 + 112.0 / radius**2)
    resistance, _ = acceleration([{"gradient": 0.0}])  # of the contacts' spin, on level track
    assert -1e-4 < resistance < 0.0
    assert found - resistance == pytest.approx(expected, rel=2e-5)


@pytest.mark.parametrize("gradient", [0.05, -0.05])
def test_vertical_curves_add_v_squared_over_r_to_the_load(gradient):
    # in the curve: N = m (g cos i + v^2 / rho), rho the radius of the wheelset's centre, 0.46 m above the rails
    run = freely_rolling([{"gradient": 0.0, "length": 60.0}, {"gradient": gradient, "radius": 1500.0}], 4.0)
    load = sum(
        np.nansum(run[f"wheelset/{side}"].N_N * np.cos(run[f"wheelset/{side}"].contact_angle_rad), axis=1)
        + np.nansum(run[f"wheelset/{side}"].Fy_N * np.sin(run[f"wheelset/{side}"].contact_angle_rad), axis=1)
        for side in ("left", "right")
    )
    w = run["wheelset"]
    inside = (w.s_m > 45.0) & (w.s_m < 75.0)
    incline = (
        math.copysign(1.0, gradient) * (w.s_m[inside] - (60.0 - 0.5 * 1500.0 * 0.05 / math.hypot(1.0, 0.05))) / 1500.0
    )
    speed = np.hypot(w.vx_m_per_s, w.vz_m_per_s)[inside]
    level = np.sqrt(1.0 - incline**2)
    bend = math.copysign(1.0, gradient) / (1500.0 * level)
    expected = 1813.0 * (9.81 * level + speed**2 * bend / (1.0 - 0.46 * bend))
    extra = np.mean(load[inside] - 1813.0 * 9.81 * level)
    assert extra == pytest.approx(np.mean(expected - 1813.0 * 9.81 * level), rel=2e-3)
    assert np.max(np.abs(load[inside] - expected)) < 0.02 * abs(extra)


@pytest.mark.parametrize("gradient", [0.05, -0.05])
def test_circular_sags_and_crests_change_the_wheel_load_by_m_v_squared_over_r(gradient):
    radius = 1200.0
    curve = {"gradient": gradient, "radius": radius, "vertical_curve": "circle"}
    run = freely_rolling([{"gradient": 0.0, "length": 60.0}, curve], 4.0)
    w, half = run["wheelset"], 0.5 * radius * math.atan(0.05)
    inside = (w.s_m > 60.0 - half + 8.0) & (w.s_m < 60.0 + half - 4.0)
    wheels = [run[f"wheelset/{side}"] for side in ("left", "right")]
    load = 0.5 * sum(np.nansum(wheel.N_N * np.cos(wheel.contact_angle_rad), axis=1) for wheel in wheels)
    load += 0.5 * sum(np.nansum(wheel.Fy_N * np.sin(wheel.contact_angle_rad), axis=1) for wheel in wheels)
    bend = math.copysign(1.0, gradient) / radius
    incline = bend * (w.s_m[inside] - 60.0 + half)
    speed = np.hypot(w.vx_m_per_s, w.vz_m_per_s)[inside]
    change = 0.5 * 1813.0 * speed**2 * bend / (1.0 - 0.46 * bend)  # the radius is that of the wheelset's centre
    found = load[inside] - 0.5 * 1813.0 * 9.81 * np.cos(incline)
    assert np.mean(found) == pytest.approx(np.mean(change), rel=1e-3)
    assert np.max(np.abs(found - change)) < 0.02 * np.abs(change).max()
