"""Patches on strips in the equations of motion: forces as alone, their moments, damping, fallback, restarts."""

import math

import numpy as np
import pytest

from tests.conftest import SCENES
from wrcore.contact import reduction as columns
from wrcore.contact.patch.library import solve_patch
from wrcore.contact.patch.normal import NormalContact
from wrcore.dynamics.body import STATE_SIZE
from wrcore.dynamics.strip_wheel import solve_on_grid
from wrcore.dynamics.system import Equations
from wrcore.kernels.handles import Handle
from wrcore.run.simulate import simulate
from wrcore.scene.description import compile_scene, load_scene

Y = 0.003


@pytest.fixture(scope="module")
def exact():
    """Equations of a suspended wheelset with exact contact, undamped, and its start."""
    changes = ["contact.patch=exact", "contact.resolution=coarse", f"initial.y={Y}"]
    scene = load_scene(SCENES / "suspended_wheelset.yaml", [*changes, "contact.normal.damping.c_e=1.0"])
    model, state = compile_scene(scene)
    return Equations(model), model, state


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
    assert row[columns.NORMAL] == pytest.approx(patch.normal_force, rel=1e-9)
    assert row[columns.P_MAX] == pytest.approx(patch.p_max, rel=1e-9)
    strips = (patch.centre, patch.width, patch.half_length, patch.middle, patch.peak)
    slip = (patch.slip_x, patch.slip_x_dx, patch.slip_s, patch.slip_s_dx)
    rolling = solve_patch(strips, slip, 8.2e10, model.contact.friction, "coarse")
    limit = model.contact.friction * patch.normal_force
    np.testing.assert_allclose(row[[columns.FX, columns.FY]], [rolling.Fx, rolling.Fs], atol=1e-6 * limit)
    # the wrench is that of the panels' own forces, each where it acts
    area = 0.0
    cosine, sine = math.cos(patch.contact_angle), math.sin(patch.contact_angle)
    load = math.pi / 2 * patch.peak * patch.half_length * patch.width
    force = np.array([rolling.Fx, rolling.Fs * cosine - patch.normal_force * sine,
                      rolling.Fs * sine + patch.normal_force * cosine])  # fmt: skip
    np.testing.assert_allclose(wrench[:3], force, rtol=1e-6, atol=1e-2)
    origin = np.array(patch.origin) - [0.0, y, z]
    normal, lateral = np.array([0.0, -sine, cosine]), np.array([0.0, cosine, sine])
    moment = np.cross(origin, np.array([rolling.Fx, *(rolling.Fs * lateral)[1:]])) + rolling.Mn * normal
    for s, x, one in zip(patch.centre, patch.middle, load, strict=True):
        moment += np.cross(origin + x * np.array([1.0, 0.0, 0.0]) + s * lateral, one * normal)
        area += one
    assert area == pytest.approx(patch.normal_force)
    np.testing.assert_allclose(wrench[3:], moment, rtol=1e-6, atol=1e-2)


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
        assert row[columns.NORMAL] == pytest.approx(patch.normal_force, rel=1e-9)
        left.append(row[columns.NORMAL])
        counts.append(patch.centre.size)
    increments = np.diff(left)
    assert len(set(counts)) > 1
    assert np.abs(np.diff(increments)).max() < 0.05 * np.median(np.abs(increments))


def test_left_and_right_are_mirror_images(exact):
    equations, _, state = exact
    rates = equations(0.0, state)
    mirrored = state.copy()
    mirrored[[1, 3 + 1, 3 + 3, 8, 10, 12]] *= -1.0  # y, roll and yaw in the Euler parameters, vy, wx, wz
    other = equations(0.0, mirrored)
    sign = np.ones(6)
    sign[[1, 3, 5]] = -1.0
    # panel forces are float32: 1e-7 of the friction force, over the wheelset's inertia
    np.testing.assert_allclose(other[7:13], sign * rates[7:13], rtol=1e-6, atol=1e-5)


def test_the_grid_gives_the_same_forces(exact):
    equations, model, state = exact
    row, _ = left_row(equations, state)
    work = equations.work
    place = np.zeros(16)
    place[:3] = state[1], state[2], 1.0
    place[3], place[4] = row[columns.COSINE], row[columns.SINE]
    place[5] = row[columns.X]
    place[11] = model.contact.friction
    place[6], place[7] = row[columns.Y] - model.contact.geometry.rail_distance, row[columns.Z]
    solve_on_grid(Handle(model.contact), work.motions[0, 0], place)
    limit = model.contact.friction * row[columns.NORMAL]
    assert place[3] == pytest.approx(row[columns.NORMAL], rel=3e-3)
    np.testing.assert_allclose(place[:2], row[[columns.FX, columns.FY]], atol=0.015 * limit)
    np.testing.assert_allclose(place[6:8], row[[columns.SEMI_A, columns.SEMI_B]], rtol=0.03)


def test_damping_presses_an_ellipse_and_strips_alike():
    """Released at rest: N of strips over that of an ellipse does not depend on the damping factor."""
    ratios = []
    for c_e in (1.0, 0.8):
        loads = []
        for patch in ("moment", "exact"):
            changes = [f"contact.patch={patch}", "contact.resolution=coarse", f"contact.normal.damping.c_e={c_e}"]
            model, state = compile_scene(load_scene(SCENES / "suspended_wheelset.yaml", [*changes, f"initial.y={Y}"]))
            equations = Equations(model)
            if not loads:
                start = state
            equations(0.0, start)
            loads.append(equations.work.patches[0, 0, 0, columns.NORMAL])
        ratios.append(loads[1] / loads[0])
    assert ratios[0] == pytest.approx(1.0, abs=0.01)
    assert ratios[1] == pytest.approx(ratios[0], abs=1e-3)


def test_runs_with_strips_go_on_as_if_they_had_not_stopped():
    changes = {"contact__patch": "exact", "contact__resolution": "coarse", "initial__y": Y}
    scene = SCENES / "suspended_wheelset.yaml"
    whole = simulate(scene, progress=False, integration__duration=0.04, **changes)
    half = simulate(scene, progress=False, integration__duration=0.02, **changes)
    del changes["initial__y"]
    rest = simulate(scene, progress=False, start=half.end, integration__duration=0.02, **changes)
    assert whole.status == rest.status == "completed"
    assert rest["wheelset"].y_m[-1] == whole["wheelset"].y_m[-1]
    assert whole.counters["patches_on_grid"] == 0
    assert np.nanmax(whole["wheelset/left"].p_max_Pa) > 5e8


def test_steady_running_needs_no_step_at_the_start():
    run = simulate(SCENES / "suspended_wheelset.yaml", progress=False, contact__patch="exact", initial__y=0.0,
                   contact__resolution="coarse", integration__duration=0.02)  # fmt: skip
    load = run["wheelset/left"].N_N[:, 0]
    assert np.ptp(load) < 2e-5 * load[0]
    assert len(run.end_state) == STATE_SIZE
