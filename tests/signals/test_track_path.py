"""A path with noise is found again, and a scene runs over it."""

import numpy as np
import pytest

import wrcore as wr
from tests.conftest import SCENES

KNOTS = [0.0, 200.0, 260.0, 520.0, 600.0, 650.0, 710.0, 900.0, 980.0, 1200.0]
CURVATURE = [0.0, 0.0, 1 / 800, 1 / 800, 0.0, 0.0, -1 / 500, -1 / 500, 0.0, 0.0]
HEIGHT = [0.0, 0.0, -0.06, -0.06, 0.0, 0.0, 0.1, 0.1, 0.0, 0.0]


def recorded(step=0.25, noise=2e-4, seed=0):
    """Curvature and superelevation of a recording car, with waves of 10 m and white noise."""
    s, random = np.arange(0.0, 1200.0 + step, step), np.random.default_rng(seed)
    curvature = np.interp(s, KNOTS, CURVATURE) + random.normal(0.0, noise, len(s)) + 1e-4 * np.sin(2 * np.pi * s / 10.0)
    height = np.interp(s, KNOTS, HEIGHT) + random.normal(0.0, 1e-3, len(s))
    return wr.Signal("s_m", s + 12_000.0, {"curvature_per_m": curvature, "height_m": height})


@pytest.mark.parametrize("seed", range(4))
def test_lengths_radii_and_cants_are_found(seed):
    found = wr.fit_path(recorded(seed=seed), superelevation="height_m", tolerance=2.5e-4)
    kinds = [next(iter(segment)) for segment in found.path]
    assert kinds == ["tangent", *["transition", "curve", "transition", "tangent"] * 2]
    lengths = [segment[kind] for kind, segment in zip(kinds, found.path, strict=True)]
    np.testing.assert_allclose(np.cumsum(lengths), KNOTS[1:], atol=3.0)
    assert found.begin == 12_000.0
    for segment, radius, cant in ((found.path[2], 800.0, 0.06), (found.path[6], -500.0, 0.1)):
        assert segment["radius"] == pytest.approx(radius, rel=0.01) and segment["cant"] == pytest.approx(cant, abs=5e-4)
    assert found.curvature_error < 3e-4 and found.cant_error < 2e-3


def test_a_scene_runs_over_the_path():
    path = wr.fit_path(recorded(), superelevation="height_m", tolerance=2.5e-4).path
    changes = {"track.path": path, "speed": 40.0, "integration.duration": 0.2, "contact.patch": "moment"}
    run = wr.simulate(SCENES / "suspended_wheelset.yaml", changes)
    assert run.status == "completed" and run.scene["track"]["path"][2]["curve"] == pytest.approx(260.0, abs=5.0)


def test_a_compound_curve_has_a_transition_between_two_radii():
    s = np.arange(0.0, 700.0)
    curvature = np.interp(s, [0, 100, 150, 300, 340, 500, 560, 700], [0, 0, 1e-3, 1e-3, 2e-3, 2e-3, 0, 0])
    path = wr.fit_path(wr.Signal("s_m", s, {"curvature_per_m": curvature})).path
    assert [next(iter(segment)) for segment in path] == [
        "tangent", "transition", "curve", "transition", "curve", "transition", "tangent"
    ]  # fmt: skip
    assert path[2]["radius"] == pytest.approx(1000.0, rel=1e-3) and path[4]["radius"] == pytest.approx(500.0, rel=1e-3)


def test_straight_track_is_one_tangent_and_a_reverse_curve_has_an_inflection():
    s = np.arange(0.0, 400.0)
    straight = wr.fit_path(wr.Signal("s_m", s, {"curvature_per_m": np.zeros(400)}))
    assert straight.path == [{"tangent": 399.0}] and straight.curvature_error == 0.0
    curvature = np.interp(s, [0, 100, 150, 250, 300, 400], [1e-3, 1e-3, 0.0, 0.0, -2e-3, -2e-3])
    path = wr.fit_path(wr.Signal("s_m", s, {"curvature_per_m": curvature})).path
    assert path[0]["radius"] == pytest.approx(1000.0, rel=1e-3) and path[-1]["radius"] == pytest.approx(
        -500.0, rel=1e-3
    )


def test_a_wrong_argument_is_one_line():
    with pytest.raises(wr.InputError, match="fit_path: signal: expected a signal over a distance of 60 m"):
        wr.fit_path(wr.Signal("t_s", np.arange(400.0), {"curvature_per_m": np.zeros(400)}))
    with pytest.raises(wr.InputError, match="no channel 'curvature_per_m'"):
        wr.fit_path(wr.Signal("s_m", np.arange(400.0), {"a": np.zeros(400)}))
