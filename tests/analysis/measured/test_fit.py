"""Unknown keys are found from signals of another integration method with noise; what is not identified is named."""

import numpy as np
import pytest

import wrcore as wr
from tests.conftest import SCENES
from wrcore.analysis.measured.fit_result import correlation_time_of, covariance_of

STIFFNESS = "vehicle.elements.axle_box_*.stiffness.y"
CONE = "wheel.profile=cone:{}"
DAMPING = "vehicle.elements.secondary_lateral_damper_*.damping"


@pytest.fixture(scope="module")
def wheelset():
    changes = {
        "integration.duration": 1.5, "contact.patch": "moment", "initial.y": 0.004, "speed": 40.0,
        "wheel.profile": "cone:0.1", "output.rate": 400.0,
    }  # fmt: skip
    return wr.load_scene(SCENES / "suspended_wheelset.yaml", changes)


def measured(scene, noise, seed=0, changes=None):
    """Signals of a run by Kutta's method with a tight tolerance, with white noise (standard deviation by channel)."""
    run = wr.simulate(scene, {"integration.method": "rk4", "integration.rtol": 1e-7, **(changes or {})})
    random = np.random.default_rng(seed)
    values = {}
    for channel, deviation in noise.items():
        group, _, name = channel.rpartition(".")
        values[channel] = run[group][name] + random.normal(0.0, deviation, len(run.t))
    return wr.Signal("t_s", run.t, values)


def test_stiffness_and_conicity_of_a_wheelset_are_found(wheelset):
    changes = {STIFFNESS: 6e5, "wheel.profile": "cone:0.12"}
    noise = {"wheelset.y_m": 1e-4, "wheelset.yaw_rad": 5e-5}
    found = wr.fit(wheelset, {STIFFNESS: (2e5, 2e6), CONE: (0.05, 0.2)}, measured(wheelset, noise, 0, changes))
    errors = (found.table["value"] - [6e5, 0.12]) / found.table["standard_error"]
    assert np.abs(errors).max() < 4.0 and found.warnings == ()
    shares = found.table["standard_error"] / found.table["value"]
    assert shares[STIFFNESS] < 0.05 and shares[CONE] < 0.005
    assert found.scene.data["wheel"]["profile"].startswith("cone:0.1") and found.runs[0].status == "completed"
    np.testing.assert_allclose(np.diag(found.covariance), found.table["standard_error"] ** 2)
    np.testing.assert_allclose(np.diag(found.correlation), 1.0)
    assert found.comparisons[0].table["correlation"].min() > 0.99 and "residual" in repr(found)
    assert found.plot().axes[0].get_ylabel() == "y / mm"


def test_damper_and_conicity_of_a_coach_are_found_from_accelerations():
    changes = {
        "integration.duration": 2.0, "contact.patch": "moment", "contact.creep.model": "polach", "initial.y": 0.0,
        "speed": 50.0, "wheel.profile": "cone:0.1", "output.channels": ["pose", "acceleration"],
        "track.irregularity": {"spectrum": {"level": "high", "seed": 3, "length": 150, "begin": 5}},
    }  # fmt: skip
    scene = wr.load_scene(SCENES / "trailer_vehicle.yaml", changes)
    noise = {"car_body.ay_m_per_s2": 0.012, "bogie_1.ay_m_per_s2": 0.05}
    signal = measured(scene, noise, 1, {DAMPING: 20e3, "wheel.profile": "cone:0.15"})
    found = wr.fit(scene, {DAMPING: (5e3, 1e5), CONE: (0.05, 0.25)}, signal, band=(None, 20.0))
    errors = (found.table["value"] - [20e3, 0.15]) / found.table["standard_error"]
    assert np.abs(errors).max() < 4.0 and found.warnings == ()
    assert found.table["value"].to_numpy() == pytest.approx([20e3, 0.15], rel=0.05)


def test_keys_without_effect_and_coupled_keys_are_named(wheelset, capsys):
    keys = {
        "vehicle.elements.axle_box_left.stiffness.y": (2e5, 2e6),
        "vehicle.elements.axle_box_right.stiffness.y": (2e5, 2e6),
        "vehicle.bodies.wheelset.inertia.pitch": (90.0, 130.0),
    }
    signal = measured(wheelset, {"wheelset.y_m": 1e-4}, 2)
    found = wr.fit(wheelset, keys, signal)
    text = "\n".join(found.warnings)
    assert "vehicle.bodies.wheelset.inertia.pitch cannot be identified: the signals hardly depend on it" in text
    assert "axle_box_left.stiffness.y" in text and "axle_box_right.stiffness.y" in text
    assert "only a combination with vehicle.elements.axle_box" in text or "are coupled" in text
    assert "fit: vehicle.bodies.wheelset.inertia.pitch cannot be identified" in capsys.readouterr().err
    pair = list(keys)[:2]
    assert found.correlation.loc[pair[0], pair[1]] < -0.95


def test_a_best_value_beyond_the_bounds_is_named(wheelset):
    signal = measured(wheelset, {"wheelset.y_m": 1e-5}, 3, {STIFFNESS: 3e6})
    found = wr.fit(wheelset, {STIFFNESS: (2e5, 1e6)}, signal)
    assert found.table["value"].item() == pytest.approx(1e6, rel=1e-2)
    assert "lies at its upper bound" in found.warnings[0]


def test_signals_at_two_speeds_are_fitted_together_and_in_parallel(wheelset):
    signals = [
        ({"speed": speed}, measured(wheelset, {"wheelset.y_m": 1e-4}, k, {"speed": speed, STIFFNESS: 6e5}))
        for k, speed in enumerate((30.0, 45.0))
    ]
    one = wr.fit(wheelset, {STIFFNESS: (2e5, 2e6)}, signals[:1], start={STIFFNESS: 5e5}, noise={"wheelset.y_m": 1e-4})
    both = wr.fit(wheelset, {STIFFNESS: (2e5, 2e6)}, signals, threads=2)
    assert len(both.runs) == 2 and [run.scene["speed"] for run in both.runs] == [30.0, 45.0]
    assert both.table["standard_error"].item() < one.table["standard_error"].item()
    assert one.residual == pytest.approx(1.0, rel=0.15)  # differences are the noise
    assert abs(both.table["value"].item() - 6e5) < 4.0 * both.table["standard_error"].item()


def test_covariance_is_that_of_a_straight_line():
    """Line through noise of known size: the textbook covariance, and its spread over many samples."""
    random, x = np.random.default_rng(0), np.linspace(-1.0, 1.0, 400)
    jacobian = np.column_stack([np.ones_like(x), x])
    found = [np.linalg.lstsq(jacobian, random.normal(0.0, 0.3, 400), rcond=None)[0] for _ in range(300)]
    covariance = covariance_of(jacobian, random.normal(0.0, 0.3, 400), 1.0)
    np.testing.assert_allclose(np.diag(covariance), np.var(found, axis=0), rtol=0.3)
    assert covariance[0, 0] == pytest.approx(0.09 / 400, rel=0.2)


@pytest.mark.parametrize("share", [0.0, 0.5, 0.9])
def test_correlation_time_is_that_of_an_autoregressive_process(share):
    """Integrated autocorrelation time (1 + a)/(1 - a) of x_k = a x_k-1 + noise."""
    noise = np.random.default_rng(0).normal(size=200_000)
    values = np.zeros_like(noise)
    for k in range(1, len(noise)):
        values[k] = share * values[k - 1] + noise[k]
    assert correlation_time_of(values) == pytest.approx((1.0 + share) / (1.0 - share), rel=0.15)


@pytest.mark.parametrize(
    ("keys", "options", "expected"),
    [
        ({}, {}, "fit: keys: expected a key with its bounds"),
        ({"speed": (30.0, 20.0)}, {}, "keys speed: expected a lower and a greater upper bound"),
        ({"speed": (30.0,)}, {}, "keys speed: expected a lower"),
        ({"sped": (20.0, 30.0)}, {}, "sped: unknown key"),
        ({"wheel.profile=cone": (0.0, 0.1)}, {}, "expected {} for the number"),
        ({"speed": (20.0, 30.0)}, {"start": {"speed": 40.0}}, "start speed: expected 20 to 30, got 40"),
        ({"speed": (20.0, 30.0)}, {"start": {"speeds": 4.0}}, "start speeds: expected one of speed"),
        ({"speed": (20.0, 30.0)}, {"noise": {"wheelset.y_m": 0.0}}, "expected a signal that varies and a noise"),
    ],
)
def test_a_wrong_argument_is_one_line(keys, options, expected, wheelset):
    t = np.arange(0.0, 1.0, 0.01)
    signal = wr.Signal("t_s", t, {"wheelset.y_m": np.sin(t)})
    with pytest.raises(wr.InputError, match=expected) as caught:
        wr.fit(wheelset, keys, signal, **options)
    assert "\n" not in str(caught.value)
    for signals in ([], [signal, 3], [(signal, {})]):
        with pytest.raises(wr.InputError, match="fit: signals: expected"):
            wr.fit(wheelset, {"speed": (20.0, 30.0)}, signals)
