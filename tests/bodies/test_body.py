"""Euler parameters against rotation matrices and finite differences."""

import numpy as np
import pytest

from wrcore.bodies.body import angles, euler_parameters, euler_rates, rotation_matrix
from wrcore.geometry.track import rotation


def matrix_of(p):
    state, matrix = np.zeros(13), np.empty((3, 3))
    state[3:7] = p
    rotation_matrix(state, 0, matrix)
    return matrix


def about_y(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


@pytest.mark.parametrize(
    ("roll", "pitch", "yaw"), [(0.1, 0.3, 0.2), (-0.4, 2.5, 1.0), (0.0, 0.0, 0.0), (0.01, -3.0, -0.02)]
)
def test_angles_and_parameters_agree(roll, pitch, yaw):
    p = euler_parameters(roll, pitch, yaw)
    assert p @ p == pytest.approx(1.0, abs=1e-15)
    np.testing.assert_allclose(matrix_of(p), rotation(roll, yaw) @ about_y(pitch), atol=1e-15)
    np.testing.assert_allclose(angles(p), (roll, pitch, yaw), atol=1e-14)


def test_rates_turn_the_matrix_by_the_angular_velocity():
    p, w = euler_parameters(0.3, -0.5, 0.8), np.array([0.3, -0.2, 0.5])
    state, rate = np.zeros(13), np.zeros(13)
    state[3:7] = p
    euler_rates(state, 0, *w, 0.0, rate)
    assert rate[3:7] @ p == pytest.approx(0.0, abs=1e-16)  # the norm is an invariant
    h = 1e-5
    difference = (matrix_of(p + h * rate[3:7]) - matrix_of(p - h * rate[3:7])) / (2 * h)
    skew = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    np.testing.assert_allclose(difference, skew @ matrix_of(p), atol=1e-9)  # A' = w~ A; error of order h^2


def test_norm_feedback_pulls_back_to_one():
    state, rate = np.zeros(13), np.zeros(13)
    state[3:7] = 1.001 * euler_parameters(0.3, -0.5, 0.8)
    euler_rates(state, 0, 0.0, 0.0, 0.0, 5.0, rate)
    # d(p.p)/dt = 2 alpha (1 - p.p) p.p
    square = 1.001**2
    assert 2 * rate[3:7] @ state[3:7] == pytest.approx(2 * 5.0 * (1 - square) * square, rel=1e-12)
