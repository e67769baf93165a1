"""Baumgarte's feedback: its default holds joints together in curves, and explicit methods stay stable with it."""

import numpy as np
import pytest

from tests.conftest import SCENES
from tests.integrate.scenes import ARMS, compiled, curve
from wrcore.bodies.body import STATE_SIZE, rotation_matrix
from wrcore.bodies.joint import evaluate_joints, joint_state
from wrcore.integrate.integrator import integrate
from wrcore.integrate.tableaus import EXPLICIT
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.track.track import track_poses

PAPER = 5.0
"""Baumgarte's alpha and beta in the paper's scenes, 1/s."""


def lateral_positions(model, states):
    """Lateral positions of all wheelsets in track axes, shape (n, k), m."""
    at = STATE_SIZE * model.bodies.wheelsets
    return np.array([track_poses(model.track, states, k, states[0, k])[0][:, 1] for k in at]).T


def joint_gaps(model, times, states):
    """Root mean square of the violations of all constraint equations over some states, m or rad."""
    rotations, values, total = np.tile(np.eye(3), (len(model.bodies.mass) + 1, 1, 1)), joint_state(model.joints), 0.0
    for t, state in zip(times, states, strict=True):
        for body in range(len(model.bodies.mass)):
            rotation_matrix(state, STATE_SIZE * body, rotations[body])
        evaluate_joints(model.joints, t, model.speed, state, rotations, values)
        total += (values.phi**2).sum()
    return np.sqrt(total / (len(times) * model.joints.equations))


@pytest.fixture(scope="module")
def canted_curve():
    """A metro car with light axle boxes on revolute joints, R = 300 m, and a run of tight tolerance."""
    changes = ARMS | curve(300.0) | {"track.irregularity": {}}
    model, start = compiled("metro car", 16.7, changes)
    times = np.linspace(0.0, 4.0, 401)
    return model, start, times, integrate(model, start, times, "rodas5", 1e-6).states


def test_default_feedback_in_a_canted_curve_closes_joints(canted_curve):
    """Root mean square of the gaps at 5 and 20 1/s: 0.68 and 0.16 um; with a Jacobian taken in full at each step, not
    at every twentieth, 0.05 and 0.005 um. That part is the old Jacobian's. Of the error of y it is less: 0.54 and
    0.41 um become 0.26 and 0.38 um."""
    model, start, times, _ = canted_curve
    gaps = []
    for feedback in (model.alpha, PAPER):
        run = integrate(model._replace(alpha=feedback, beta=feedback), start, times, "rodas5", 1e-4)
        gaps.append(joint_gaps(model, times[::10], run.states[::10]))
    assert gaps[0] < 0.5 * gaps[1]


def test_auto_in_a_canted_curve_keeps_y_within_a_micrometre(canted_curve):
    model, start, times, exact = canted_curve
    run = integrate(model, start, times)
    error = lateral_positions(model, run.states) - lateral_positions(model, exact)
    assert run.status == "completed" and np.sqrt(np.mean(error**2)) < 1e-6


@pytest.mark.parametrize("method", EXPLICIT)
def test_default_feedback_at_twice_the_longest_step_is_stable(method):
    """Both roots of s^2 + 2 alpha s + beta^2 are -alpha where alpha equals beta."""
    scene = load_scene(SCENES / "metro_car.yaml").data["integration"]
    alpha, beta = scene["baumgarte"].values()
    tableau, z = EXPLICIT[method], -2.0 * alpha * scene["longest_step"]
    stages = np.linalg.solve(np.eye(len(tableau.nodes)) - z * tableau.stages, np.ones(len(tableau.nodes)))
    assert alpha == beta and abs(1.0 + z * tableau.stages[-1] @ stages) < 1.0


@pytest.mark.parametrize("name", ["wheelset", "suspended_wheelset", "trailer_vehicle"])
def test_feedback_of_the_papers_scenes_is_the_papers(name):
    model, _ = compile_scene(load_scene(SCENES / f"{name}.yaml", {"contact.patch": "moment"}))
    assert (model.alpha, model.beta) == (PAPER, PAPER)
