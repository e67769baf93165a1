"""Patches on strips in the equations of motion: forces as alone, their moments, damping, fallback, restarts."""

import math

import numpy as np
import pytest

from tests.conftest import ELLIPTIC, pair_with_waves
from tests.contact.patch.strip_contact import NormalContact
from wrcore.analysis.assessment.wheels import creep_power
from wrcore.analysis.contact.loaded import LoadedWheels
from wrcore.analysis.contact.rolling_field import solve_patch
from wrcore.bodies.body import STATE_SIZE
from wrcore.contact.normal.gap import Frame
from wrcore.contact.patch.model import strip_model, strip_work
from wrcore.contact.patch.solution import solve_on_grid
from wrcore.contact.search import reduction as columns
from wrcore.contact.search.strip import make_pose
from wrcore.equations.equations_of_motion import Equations
from wrcore.kernels.handles import Handle
from wrcore.run.simulate import simulate
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.wheels.motion import WheelMotion

Y = 0.003


@pytest.fixture(scope="module")
def exact():
    """Equations of a suspended wheelset with exact contact, undamped, and its start."""
    changes = ["contact.patch=exact", "contact.resolution=coarse", f"initial.y={Y}"]
    scene = load_scene(ELLIPTIC / "suspended_wheelset.yaml", [*changes, "contact.normal.damping.c_e=1.0"])
    model, state = compile_scene(scene)
    return Equations(model), model, state


def resultant(patch, force):
    """Angle of the pressure's resultant; what pressure and friction on the strips (3, strips), each in its own plane,
    are together along it, across it, and about it at the pressure's centroid."""
    load = 0.5 * math.pi * patch.peak * patch.half_length * patch.width
    turn, cosine = math.atan2(load @ patch.tilt, load.sum()), 1.0 / np.sqrt(1.0 + patch.tilt**2)
    fx, fs, fn = force[0], cosine * force[1], cosine * patch.tilt * force[1]
    x, s = patch.middle - patch.mean_x, patch.centre - patch.mean_s
    about_s = patch.height @ fx - x @ fn - (cosine * patch.tilt) @ force[2]
    about_n = x @ fs - s @ fx + cosine @ force[2]
    c, q = math.cos(turn), math.sin(turn)
    normal = load.sum() / c + fn.sum() * c - fs.sum() * q
    return patch.contact_angle + turn, normal, fx.sum(), fs.sum() * c + fn.sum() * q, about_n * c - about_s * q


def left_row(equations, state):
    equations(0.0, state)
    work = equations.work
    assert work.counts.tolist() == [[1, 1]]
    return work.patches[0, 0, 0].copy(), work.rail_wrenches[0, 0].copy()


def test_a_wheel_feels_what_the_patch_alone_gives(exact):
    equations, model, state = exact
    row, wrench = left_row(equations, state)
    y, z, velocity = state[1], state[2], tuple(state[7:13])
    axle = equations.work.rotations[0][:, 1]
    roll, yaw = math.asin(axle[2]), -math.asin(axle[0] / math.sqrt(1.0 - axle[2] ** 2))
    contact = NormalContact(model.contact.geometry, 8.2e10 / 0.72, "coarse")
    (patch,) = contact.at_height("left", y, z, roll, yaw, (*velocity, velocity[0]))
    assert row[columns.P_MAX] == pytest.approx(patch.p_max, rel=1e-9)
    strips = (patch.place, patch.own_width, patch.half_length, patch.middle, patch.peak)
    slip = (patch.slip_x, patch.slip_x_dx, patch.slip_s, patch.slip_s_dx)
    rolling = solve_patch(strips, slip, 8.2e10, model.contact.friction, "coarse")
    limit = model.contact.friction * patch.normal_force
    angle, normal, fx, fy, mz = resultant(patch, rolling.force)
    np.testing.assert_allclose(row[[columns.ANGLE, columns.NORMAL]], [angle, normal], rtol=1e-7)
    np.testing.assert_allclose(row[[columns.FX, columns.FY]], [fx, fy], atol=1e-6 * limit)
    assert row[columns.MZ] == pytest.approx(mz, abs=1e-6 * limit)
    # the wrench is that of pressure and friction on the strips, each where it acts and in its own plane
    loads, total = math.pi / 2 * patch.peak * patch.half_length * patch.width, np.zeros(6)
    cosine, sine = math.cos(patch.contact_angle), math.sin(patch.contact_angle)
    for i, load in enumerate(loads):
        own = patch.contact_angle + math.atan(patch.tilt[i])
        across, out = np.array([0.0, math.cos(own), math.sin(own)]), np.array([0.0, -math.sin(own), math.cos(own)])
        s, n = patch.centre[i], patch.height[i]
        point = np.array(patch.origin) - [0.0, y, z]
        point += [patch.middle[i], s * cosine - n * sine, s * sine + n * cosine]
        along, aside, turn = rolling.force[:, i]
        force = np.array([along, 0.0, 0.0]) + aside * across + load / math.cos(math.atan(patch.tilt[i])) * out
        total += np.concatenate([force, np.cross(point, force) + turn * out])
    np.testing.assert_allclose(wrench, total, rtol=1e-6, atol=1e-2)


def test_forces_do_not_step_where_the_number_of_strips_changes(exact):
    equations, model, state = exact
    contact = NormalContact(model.contact.geometry, 8.2e10 / 0.72, "coarse")
    left, counts = [], []
    for y in np.arange(0.8e-3, 1.0e-3, 1e-6):
        moved = state.copy()
        moved[[1, 2, 4, 5, 6]] = y, state[2] - 2e-5, 0.0, 0.0, 0.0
        moved[3] = 1.0
        equations(0.0, moved)
        row = equations.work.patches[0, 0, 0].copy()
        (patch,) = contact.at_height("left", y, moved[2])
        left.append(row[columns.NORMAL])
        counts.append(patch.centre.size)
    increments = np.diff(left)
    assert len(set(counts)) > 1
    assert np.abs(np.diff(increments)).max() < 0.05 * np.median(np.abs(increments))


def test_left_and_right_are_mirror_images(exact):
    """To the last bit, at the tread, in two lobes and on the flange, ahead and back."""
    equations, _, state = exact
    sign = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    for y, yaw, ahead in ((0.003, 1e-3, 1.0), (0.0007, -2e-3, 1.0), (0.0051, 3e-3, 1.0), (0.006, 0.0, -1.0)):
        moved = state.copy()
        moved[1], moved[2], moved[3:7] = y, state[2] - 2e-5, (math.cos(yaw / 2), 2e-6, 0.0, math.sin(yaw / 2))
        moved[7:13] *= ahead
        moved[8], moved[10], moved[12] = 0.02, 0.01, 0.05
        mirrored = moved.copy()
        mirrored[[1, 3 + 1, 3 + 3, 8, 10, 12]] *= -1.0  # y, roll and yaw in the Euler parameters, vy, wx, wz
        found = []
        for one in (moved, mirrored):
            equations(0.0, one)
            found.append((equations.work.rail_wrenches[0].copy(), equations.work.counts.sum()))
        (wrenches, count), (others, other) = found
        assert count == other >= 1
        np.testing.assert_array_equal(others[::-1], sign * wrenches)


@pytest.mark.parametrize("slip", ["surfaces", "creepages"])
def test_creep_power_is_what_friction_takes_from_the_wheelset(slip):
    """Integral of traction times slip, power of the wrench, and forces times creepages are one number."""
    run = simulate(
        ELLIPTIC / "suspended_wheelset.yaml", progress=False, contact__patch="exact", contact__resolution="coarse",
        contact__slip=slip, initial__y=0.0051, integration__duration=0.02,
        output__channels=["pose", "velocity", "contact", "energy"],
    )  # fmt: skip
    power = creep_power(run, "wheelset", "left") + creep_power(run, "wheelset", "right")
    assert power.max() > 100.0
    np.testing.assert_allclose(power, run["energy"].dissipated_by_creep_W, rtol=1e-4, atol=1e-4 * power.max())


def test_the_grid_gives_the_same_forces(exact):
    equations, model, state = exact
    row, _ = left_row(equations, state)
    contact, m, found = model.contact, WheelMotion(*equations.work.motions[0, 0]), np.zeros(columns.PATCH_COLUMNS)
    pose = make_pose(1.0, *m[1:6], True)
    across = row[columns.Y] - contact.geometry.rail_distance
    frame = Frame(*row[[columns.COSINE, columns.SINE, columns.X]], across, row[columns.Z], 0.0)
    solve_on_grid(Handle(contact), m, pose, frame, (0.0, 0.0, 0.0), contact.friction, found)
    limit = contact.friction * row[columns.NORMAL]
    assert found[columns.NORMAL] == pytest.approx(row[columns.NORMAL], rel=3e-3)
    forces, axes = [columns.FX, columns.FY], [columns.SEMI_A, columns.SEMI_B]
    np.testing.assert_allclose(found[forces], row[forces], atol=0.015 * limit)
    np.testing.assert_allclose(found[axes], row[axes], rtol=0.03)


def test_fixed_strips_are_told(benchmark_pair):
    wheels = LoadedWheels(benchmark_pair, "exact", "coarse")
    pressed_in = wheels.at_height("left", 7.3e-3, 0.4618094)  # until no strips end at the tips
    usual = wheels.at_height("left", 3e-3, wheels.height("left", 3e-3, 6e4))
    assert [(bool(one.on_fixed), one.on_grid) for one in (*pressed_in, *usual)] == [(True, False), (False, False)]


@pytest.mark.parametrize(
    ("height", "length", "y", "load", "fixed", "off", "peak"),
    [(20, 4.0, 0.0, 8e4, True, 6e-3, 0.1), (20, 3.0, 0.0, 8e4, True, 0.015, 0.25),
     (10, 3.5, 0.0, 6e4, True, 6e-3, 0.12), (10, 3.0, 0.0, 3e4, True, 0.01, 0.1),
     (40, 4.0, -0.25e-3, 3e4, True, 6e-3, 0.1), (40, 3.5, 0.0, 6e4, True, 0.012, 0.14),
     (20, 4.5, 0.0, 3e4, False, 3e-3, 0.03), (20, 3.5, 0.91e-3, 9e4, True, 8e-3, 0.12),
     (10, 2.5, 0.91e-3, 3e4, True, 0.01, 0.14)],
)  # fmt: skip
def test_a_wheel_with_waves_carries_on_all_of_them(height, length, y, load, fixed, off, peak):
    """On more lobes than there are windows, or than rows for overlaps, and between strips wider than the waves: normal
    force, width and greatest pressure are those of the grid; without what would be lost it is 12 to 26 %."""
    pair = pair_with_waves(height, length)
    wheels, grid = LoadedWheels(pair, "exact", "coarse"), LoadedWheels(pair, "grid", "middle")
    z = wheels.height("left", y, load)
    ((found,), (expected,)) = (one.at_height("left", y, z, fields=True) for one in (wheels, grid))
    assert found.on_fixed == fixed
    assert found.row[columns.NORMAL] == pytest.approx(expected.row[columns.NORMAL], rel=off)
    assert found.row[columns.SEMI_B] == pytest.approx(expected.row[columns.SEMI_B], rel=6e-3)
    assert found.row[columns.P_MAX] == pytest.approx(expected.row[columns.P_MAX], rel=peak)


@pytest.mark.parametrize(("height", "length", "load"), [(40, 4.0, 3e4), (20, 3.5, 3e4)])
def test_nothing_steps_where_a_wheel_with_waves_moves_across(height, length, load):
    """More overlaps than rows come and go, and waves shorter than strips: N stepped by a quarter."""
    wheels = LoadedWheels(pair_with_waves(height, length), "exact", "coarse")
    z, at = wheels.height("left", 0.0, load), np.arange(-1e-3, 1e-3, 2e-5)
    normal = np.array([sum(one.row[columns.NORMAL] for one in wheels.at_height("left", y, z)) for y in at])
    assert normal.max() > 3.0 * normal.min()
    assert np.all(np.abs(np.diff(normal, n=2)) < 0.1 * normal[1:-1])  # beside its slope


@pytest.mark.parametrize(
    ("y", "most"), [*((y, 5e-3) for y in (-5e-3, -2e-3, 0.0, 2e-3, 3e-3, 4.5e-3)), (5.5e-3, 0.025)]
)
def test_at_rest_damping_leaves_strips_what_it_leaves_an_ellipse(benchmark_pair, y, most):
    """(1 + c_e)/2 of the force without damping: of an ellipse just this, of strips about, least in a root."""
    wheels, normal = LoadedWheels(benchmark_pair, "exact", "coarse"), []
    z = wheels.height("left", y, 5e4)
    for damping in (1.0, 0.8):
        contact = wheels._still._replace(damping=damping, damping_speed=0.05)
        wheels._still, wheels._still_handle = contact, Handle(contact)
        normal.append(sum(one.row[columns.NORMAL] for one in wheels.at_height("left", y, z)))
    assert normal[1] / normal[0] == pytest.approx(0.9, rel=most)


def test_runs_with_strips_go_on_as_if_they_had_not_stopped():
    changes = {"contact__patch": "exact", "contact__resolution": "coarse", "initial__y": Y}
    scene = ELLIPTIC / "suspended_wheelset.yaml"
    whole = simulate(scene, progress=False, integration__duration=0.04, **changes)
    half = simulate(scene, progress=False, integration__duration=0.02, **changes)
    del changes["initial__y"]
    rest = simulate(scene, progress=False, start=half.end, integration__duration=0.02, **changes)
    assert whole.status == rest.status == "completed"
    assert rest["wheelset"].y_m[-1] == whole["wheelset"].y_m[-1]
    assert whole.counters["patches_on_grid"] == 0
    assert np.nanmax(whole["wheelset/left"].p_max_Pa) > 5e8


def test_steady_running_needs_no_step_at_the_start():
    run = simulate(ELLIPTIC / "suspended_wheelset.yaml", progress=False, contact__patch="exact", initial__y=0.0,
                   contact__resolution="coarse", integration__duration=0.02)  # fmt: skip
    load = run["wheelset/left"].N_N[:, 0]
    assert np.ptp(load) < 2e-5 * load[0]
    assert len(run.end_state) == STATE_SIZE


def test_a_scene_of_ellipses_carries_no_strips():
    """Its scratch arrays for patches take next to nothing, those of strips some 700 kB."""

    def size(part):
        return sum(map(size, part)) if isinstance(part, tuple) else part.nbytes

    assert size(strip_work(strip_model("moment"), 4)) < 10_000 < size(strip_work(strip_model("exact"), 1))


@pytest.mark.parametrize("patch", ["exact", "moment"])
def test_a_wheel_that_slides_in_its_flange_root_comes_no_nearer(patch):
    # through the mean plane of its bent patch it did: by 16 mm/s in a curve of 300 m, of 50 that undo all damping
    changes = [f"contact.patch={patch}", "initial.y=0.0062", "initial.yaw=0.0084", "speed=20.0"]
    model, state = compile_scene(load_scene(ELLIPTIC / "suspended_wheelset.yaml", changes))
    equations, rolling, normal = Equations(model), slice(7, 13), []
    for slower in (1.0, 0.05):
        now = state.copy()
        now[2] -= 2e-5
        now[rolling] *= slower
        equations(0.0, now)
        normal.append(equations.work.patches[0, 0, : equations.work.counts[0, 0], columns.NORMAL].max())
        angle = equations.work.patches[0, 0, 0, columns.ANGLE]
    assert abs(angle) > 0.4 and normal[0] > 3e4
    assert normal[0] == pytest.approx(normal[1], rel=4e-3)
