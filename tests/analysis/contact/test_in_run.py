"""Patches of a run solved anew: the run's own forces, places on both profiles, refusals."""

import numpy as np
import pytest

from tests.conftest import ELLIPTIC
from wrcore.analysis.contact.in_run import WheelInRun, patch_in_run
from wrcore.contact.search.reduction import NORMAL
from wrcore.errors import InputError
from wrcore.geometry.track import SIDES
from wrcore.run.output.compute import ON_RAIL
from wrcore.run.simulate import simulate
from wrcore.scene.description import load_scene
from wrcore.wheels.motion import MOTION, WheelMotion

CHANNELS = ["pose", "velocity", "contact", "wheel_motion"]
SHORT = {"contact.patch": "exact", "contact.resolution": "coarse", "integration.duration": 0.02, "output.rate": 200.0,
         "output.channels": CHANNELS}  # fmt: skip
ROUGH = {"track.irregularity": {"spectrum": {"level": "high", "seed": 5, "length": 100.0, "begin": -20.0}},
         "speed": 60.0, "initial.y": 0.003, "initial.yaw": 0.002}  # fmt: skip
CURVE = {"track.path": [{"transition": 1.0}, {"curve": 300.0, "radius": 300.0}], "speed": 20.0,
         "initial.y": 0.003, "integration.duration": 0.08, "output.rate": 50.0}  # fmt: skip
SCENE_OF = {
    "rough track": ROUGH,
    "curve": CURVE,
    "rails that differ in friction": {"initial.y": 0.002, "contact.friction": {"left": 0.3, "right": 0.1}},
    "flange": {"initial.y": 0.0066, "initial.yaw": 0.004},
    "falling friction, planar": {"initial.y": 0.003, "initial.yaw": 0.004, "contact.detection": "planar",
                                 "contact.friction": {"mu": 0.4, "falling": {"ratio": 0.4, "decay": 0.6}}},
    "rails that give": {"track.support": {"rail": {
        "lateral": {"stiffness": 1.8e7, "damping": 5e4}, "vertical": {"stiffness": 8.1e7, "damping": 6e4}}},
        "initial.y": 0.003},
}  # fmt: skip


def run_of(changes):
    asked = SHORT | changes
    if asked["contact.patch"] != "exact":
        del asked["contact.resolution"]  # ellipses have none
    scene = load_scene(ELLIPTIC / "suspended_wheelset.yaml", asked)
    run = simulate(scene)
    assert run.status == "completed", run.reason
    return scene, run


@pytest.mark.parametrize("name", SCENE_OF)
def test_an_exact_run_is_solved_to_its_own_forces(name):
    """Its motion on its rail is all that a patch depends on: on rough track, in curves, on rails that give."""
    scene, run = run_of(SCENE_OF[name])
    for side in SIDES:
        wheel, rows = WheelInRun(run, scene, "wheelset", side, "coarse", "test"), run[f"wheelset/{side}"]
        for i in range(1, len(run.t)):
            found, there = wheel.at(i), rows.N_N[i] > 0.0
            assert len(found) == there.sum()
            bound = np.nanmax(rows.on_rail_friction[i] * np.nansum(rows.N_N[i]))
            for one, k in zip(found, np.flatnonzero(there), strict=True):
                assert one.patch.normal == pytest.approx(rows.N_N[i, k], rel=3e-3)
                assert one.patch.fx == pytest.approx(rows.Fx_N[i, k], abs=5e-3 * bound)
                assert one.patch.fs == pytest.approx(rows.Fy_N[i, k], abs=5e-3 * bound)
                shear = (one.patch.traction_x, one.patch.traction_s) @ one.patch.cell_area[:, None]
                assert shear[:, 0] == pytest.approx([one.patch.fx, one.patch.fs], abs=5e-3 * bound)
                assert one.patch.contact_angle == pytest.approx(rows.contact_angle_rad[i, k], abs=1e-3)


@pytest.mark.parametrize("side", SIDES)
def test_strips_lie_where_wheel_and_rail_meet(side):
    """Both profiles' places of a strip are one place of the track, and about the run's own contact point."""
    scene, run = run_of({"initial.y": 0.003})
    wheel, rows, outwards = (
        WheelInRun(run, scene, "wheelset", side, "middle", "test"),
        run[f"wheelset/{side}"],
        SIDES[side],
    )
    pair = scene.pair(side)
    for i in range(len(run.t)):
        (found,) = wheel.at(i)
        ends, width = found.places, np.diff(found.places, axis=1)[:, 0]
        own, rail = ends.mean(axis=1)
        np.testing.assert_allclose(ends[:, 1, :-1], ends[:, 0, 1:], atol=2e-6)  # they tile both profiles
        roll = run["wheelset"].roll_rad[i]
        lateral = pair.half_distance + own + outwards * (run["wheelset"].y_m[i] + np.sin(roll) * run["wheelset"].z_m[i])
        np.testing.assert_allclose(lateral, pair.rail_distance + rail, atol=2e-5)
        assert (width > 0.0).all()
        assert own.min() < rows.u_wheel_m[i, 0] < own.max() and rail.min() < rows.u_rail_m[i, 0] < rail.max()


def test_a_wheel_that_rolls_back_has_the_mirrored_fields():
    """Turned round about the vertical a right wheel that rolls back is a left one that rolls ahead."""
    scene, run = run_of({"initial.y": 0.003})
    wheels = [WheelInRun(run, scene, "wheelset", side, "coarse", "test") for side in SIDES]
    row = wheels[0]._motions[2].copy()
    turned = row * np.array([-1, -1, 1, 1, 1, -1, -1, -1, 1, -1, -1, 1, 1, 1, 1])  # as seen from the other side
    turned[[MOTION.ex, MOTION.ey, MOTION.ez]] = row[MOTION.ex], row[MOTION.ey], -row[MOTION.ez]
    wheels[1]._motions[2], wheels[1]._loads[2] = turned, wheels[0]._loads[2]
    (ahead,), (back,) = (wheel.at(2) for wheel in wheels)
    for one in (ahead.patch, back.patch):
        shear = [one.traction_x @ one.cell_area, one.traction_s @ one.cell_area]
        assert shear == pytest.approx([one.fx, one.fs], abs=5.0)
    for one, sign in ((ahead.patch, 1.0), (back.patch, -1.0)):
        assert sign * (one.friction_work * one.cell_area @ one.x) < 0.0  # behind the middle, where it slides
        assert (one.dx > 0.0).all()
    assert [back.patch.fx, back.patch.fs] == pytest.approx([-ahead.patch.fx, -ahead.patch.fs], abs=50.0)


def test_friction_counts_where_a_height_is_sought(tmp_path):
    """On hollow wheels it makes up to 1 % of the normal force of a patch that is bent, at one and the same height."""
    u = np.linspace(-0.06, 0.04, 501)
    hollow = load_scene(ELLIPTIC / "suspended_wheelset.yaml").wheel(u) + 2e-3 * np.exp(-((u / 0.012) ** 2))
    np.savetxt(tmp_path / "hollow.csv", np.column_stack([u, hollow]), delimiter=",", header="u_m,f_m", comments="")
    stiff = {"contact.normal": {"damping": {"c_e": 1.0}}, "wheel.profile": str(tmp_path / "hollow.csv")}
    scene, run = run_of(stiff | {"initial.y": 0.003, "initial.yaw": 0.006, "contact.friction": 0.4})
    wheel, rows, without = WheelInRun(run, scene, "wheelset", "left", "coarse", "test"), run["wheelset/left"], 0.0
    for i in range(1, len(run.t)):
        found, load = wheel.at(i), np.nansum(rows.N_N[i])
        assert sum(one.patch.normal for one in found) == pytest.approx(load, rel=1.5e-3)
        own = WheelMotion(*wheel._motions[i].tolist())._replace(friction=0.0)
        without = max(without, abs(sum(one.row[NORMAL] for one in wheel._wheels.in_motion(own)) / load - 1.0))
    assert without > 2.5e-3


def test_a_patch_of_a_run_by_ellipses_carries_its_load():
    scene, run = run_of({"contact.patch": "moment", "initial.y": 0.003})
    t, rows = float(run.t[2]), run["wheelset/right"]
    (patch,) = patch_in_run(run, t, "wheelset", "right")  # its scene reads files of the examples
    vertical = rows.N_N[2] * np.cos(rows.contact_angle_rad[2]) + rows.Fy_N[2] * np.sin(rows.contact_angle_rad[2])
    carried = patch.normal * np.cos(patch.contact_angle) + patch.fs * np.sin(patch.contact_angle)
    assert patch.side == "right" and carried == pytest.approx(np.nansum(vertical), rel=2e-3)
    assert patch.friction_work.min() > -1e-6 * patch.friction_work.max()
    power = -(patch.fx * patch.xi + patch.fs * patch.eta + patch.mn * patch.phi)
    assert patch.friction_work @ patch.cell_area == pytest.approx(power, rel=1e-12) and power > 0.0


def test_a_patch_without_a_load_is_none():
    """As of an overlap so small that no element of a grid touches: its centroid and its extent are no numbers."""
    scene, run = run_of({"initial.y": 0.003})
    wheel = WheelInRun(run, scene, "wheelset", "left", "coarse", "test")
    in_motion = wheel._wheels.in_motion

    def with_another(m, **how):
        (one,) = in_motion(m, **how)
        return [one._replace(row=np.zeros_like(one.row), load=0.0), one]

    wheel._wheels.in_motion = with_another
    (found,) = wheel.at(2)
    assert found.load > 0.0 and wheel.missed < 2e-3


def test_scenes_that_do_not_ask_have_none_of_its_channels():
    _, run = run_of({"contact.patch": "moment", "output.channels": ["contact"]})
    assert not set(ON_RAIL) & run["wheelset/left"].keys()


def test_a_profile_that_was_edited_since_is_refused(tmp_path):
    profile, u = tmp_path / "wheel.csv", np.linspace(-0.06, 0.04, 201)
    points = np.column_stack([u, load_scene(ELLIPTIC / "suspended_wheelset.yaml").wheel(u)])
    np.savetxt(profile, points, fmt="%.12g", delimiter=",", header="u_m,f_m", comments="")
    scene, run = run_of({"contact.patch": "moment", "wheel.profile": str(profile)})
    assert patch_in_run(run, 0.0, "wheelset", scene=load_scene(scene))
    profile.write_text(profile.read_text() + "\n")
    with pytest.raises(InputError, match="patch_in_run: scene: expected the files of the run, but of .*wheel.csv"):
        patch_in_run(run, 0.0, "wheelset", scene=load_scene(scene))


def test_refusals():
    scene, run = run_of({"contact.patch": "moment", "output.channels": ["pose", "contact"]})
    other = load_scene(scene, {"rail.inclination": "1/20"})
    asking, elsewhere, namesake = (run_of({"contact.patch": "moment"})[1] for _ in range(3))
    elsewhere.scene["vehicle"]["parameters"] = "vehicles/of_mine.yaml"
    namesake.settings["files_sha256"] = "of files with the names of the examples'"
    cases = [
        ({"run": asking, "scene": other}, "patch_in_run: scene: expected that of the run, but rail of it differ"),
        ({"t": 0.02 + 1e-12}, "patch_in_run: output.channels: expected contact and wheel_motion among them"),
        ({"t": 1.0}, "patch_in_run: t: expected a time of the run, got 1 s"),
        ({"wheelset": "bogie"}, "patch_in_run: wheelset: expected a wheelset of the run with contacts, got 'bogie'"),
        ({}, "patch_in_run: output.channels: expected contact and wheel_motion among them"),
        *(
            ({"scene": None, "run": one}, "patch_in_run: scene: expected that of the run, as its files are not here")
            for one in (elsewhere, namesake)
        ),
    ]
    for changes, message in cases:
        with pytest.raises(InputError, match=message):
            patch_in_run(**{"run": run, "t": 0.0, "wheelset": "wheelset", "scene": scene} | changes)
    with pytest.raises(InputError, match="output.channels: expected contact beside wheel_motion"):
        load_scene(scene, {"output.channels": ["pose", "wheel_motion"]})
    polygons = {side: {"out_of_round": {"polygon": [{"order": 10, "amplitude": 2e-5}]}} for side in SIDES}
    shaped, run = run_of({"contact.patch": "moment"} | {f"wheel.{side}": shape for side, shape in polygons.items()})
    with pytest.raises(InputError, match="expected rails and wheels that are the same everywhere"):
        patch_in_run(run, 0.0, "wheelset", scene=shaped)
