"""Training of the surrogate: data, a few steps, checkpoints, and weights that the product loads."""

import numpy as np
import pytest

from study.surrogate import held_back, shards
from study.surrogate.training_data import is_held_back, joined, load, run_teacher, taught
from wrcore.contact.surrogate import network
from wrcore.errors import InputError

SMALL = {"width": 32, "modes": 8, "batch": 32, "twins": 4, "steps": 2}


@pytest.fixture(scope="module")
def training():
    pytest.importorskip("jax", reason="the training needs JAX: pip install wrcore[surrogate]")
    pytest.importorskip("optax", reason="the training needs optax: pip install wrcore[surrogate]")
    from study.surrogate import training

    return training


@pytest.fixture(scope="module")
def trained(training, random_shards, tmp_path_factory):
    """Path of weights after two calls, and the data."""
    data, out = load([random_shards]), tmp_path_factory.mktemp("weights") / "weights.npz"
    training.train(data, training.Settings(**SMALL), out, report=lambda line: None)
    return out, data


def shipped():
    return shards.read(network._WEIGHTS)


def loaded(path, monkeypatch):
    monkeypatch.setattr(network, "_WEIGHTS", path)
    return network.load_surrogate.__wrapped__()


def test_held_back_pairs_do_not_change_with_the_data():
    pairs = np.repeat(np.arange(400), 3)
    held = is_held_back(pairs)
    assert 0.01 < held.mean() < 0.12
    np.testing.assert_array_equal(held[:600], is_held_back(pairs[:600]))
    assert is_held_back(np.array([0, 0, 1])).any()


def test_twins_of_the_training_are_neighbours(random_shards):
    data = load([random_shards])
    assert len(data.twins.step) > 10
    np.testing.assert_array_equal(data.twins.second, data.twins.first + 1)
    assert set(data.twins.weight.tolist()) <= {np.float32(0.1), np.float32(1.0)}


def test_shards_without_solution_ask_for_a_teacher(random_shards, tmp_path):
    arrays = shards.read(shards.path_of(random_shards, 0))
    for name in ("corrections", "exact", "base", "disk"):
        del arrays[name]
    shards.write(shards.path_of(tmp_path, 0), arrays)
    with pytest.raises(InputError, match="--teacher"):
        load([tmp_path])
    assert load([tmp_path], shipped()).training.forces.shape[1:] == (17, 3)


def test_teacher_in_numpy_is_the_network_of_the_package():
    weights, surrogate, random = shipped(), network.load_surrogate(), np.random.default_rng(4)
    descriptors = np.clip(surrogate.median + random.normal(size=(1, 38)) / surrogate.per_scale, surrogate.least,
                          surrogate.greatest)  # fmt: skip
    disk = random.uniform(-0.6, 0.6, (1, 6, 2))
    corrections, forces = taught(weights, descriptors, disk)
    work = network.surrogate_work(surrogate)
    work.descriptors[:] = descriptors[0]
    assert network.run_network(surrogate, work) == 1.0
    np.testing.assert_allclose(corrections[0], work.outputs[:8] * surrogate.corrections, rtol=1e-5, atol=1e-9)
    coefficients = run_teacher(weights, descriptors)[1][0]
    np.testing.assert_allclose(coefficients, work.outputs[8 : 8 + len(coefficients)], rtol=1e-5, atol=1e-6)
    expected = [network.force_remainder(surrogate, work.outputs, *place) for place in disk[0]]
    np.testing.assert_allclose(forces[0], expected, rtol=0.0, atol=2e-3)


def test_weights_have_the_arrays_of_the_package(trained, monkeypatch):
    out, data = trained
    weights, known = shards.read(out), shipped()
    assert set(weights) == set(known)
    for name, array in known.items():
        assert weights[name].dtype == array.dtype and weights[name].ndim == array.ndim, name
    surrogate = loaded(out, monkeypatch)
    assert surrogate.modes.shape[-1] == SMALL["modes"] and len(surrogate.layers.biases_1) == SMALL["width"]


def test_loaded_weights_give_what_was_trained(training, trained, random_shards, monkeypatch):
    out, data = trained
    state = training.resume(out.with_suffix(".checkpoint.npz"), training.Settings(**SMALL),
                            training.digest_of(data, training.Settings(**SMALL), ""))  # fmt: skip
    assert state.calls == 2
    surrogate = loaded(out, monkeypatch)
    work = network.surrogate_work(surrogate)
    descriptors = data.scaling.median + 0.2 * data.scaling.scale
    work.descriptors[:] = descriptors
    network.run_network(surrogate, work)
    disk = data.training.disk[:1].copy()
    corrections, forces = training.predict(state.parameters, data.scaling.compressed(descriptors[None]), disk)
    found = work.outputs[:8] * surrogate.corrections
    np.testing.assert_allclose(found, np.array(corrections[0]) * training.CORRECTION_ERRORS, rtol=1e-3, atol=1e-6)
    expected = np.array(forces[0]) * training.FORCE_ERRORS
    found = [network.force_remainder(surrogate, work.outputs, *place) for place in disk[0].astype(float)]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=0.02 * np.abs(expected).max())


def test_training_begins_with_given_weights(training, trained, random_shards, tmp_path):
    start = shards.read(trained[0])
    data, settings = load([random_shards], start=start), training.Settings(**SMALL)
    training.train(
        data, settings._replace(rate=1e-9), tmp_path / "weights.npz", "of the start", start, lambda line: None
    )
    weights = shards.read(tmp_path / "weights.npz")
    for name in set(start) - {"digest", "least", "greatest"}:
        np.testing.assert_allclose(weights[name], start[name], rtol=0.0, atol=1e-3, err_msg=name)
    assert (weights["least"] <= start["least"]).all() and (weights["greatest"] >= start["greatest"]).all()
    assert weights["digest"] != start["digest"]


def test_training_resumed_is_the_one_in_one_go(training, trained, tmp_path):
    out, data = trained
    settings = training.Settings(**SMALL)
    digest = training.digest_of(data, settings, "")
    state, _ = training.advance(training.new_state(settings), data, settings)
    training.keep(tmp_path / "weights.checkpoint.npz", state, digest)
    lines = []
    training.train(data, settings, tmp_path / "weights.npz", report=lines.append)
    assert "continues after" in lines[0]
    weights, expected = shards.read(tmp_path / "weights.npz"), shards.read(out)
    for name, array in expected.items():
        np.testing.assert_array_equal(weights[name], array, err_msg=name)


def test_checkpoint_of_other_settings_is_refused(training, trained):
    out, data = trained
    with pytest.raises(InputError, match="delete it or choose"):
        training.train(data, training.Settings(**SMALL | {"seed": 1}), out, report=lambda line: None)


def test_loss_falls_in_some_calls(training, random_shards):
    data = load([random_shards], shipped())
    settings = training.Settings(**SMALL | {"steps": 20})
    state, losses = training.new_state(settings), []
    for _ in range(12):
        state, value = training.advance(state, data, settings)
        losses.append(value)
    assert losses[-1] < 0.8 * losses[0]


def test_errors_of_held_back_patches_are_those_of_the_weights(random_shards):
    rows, _ = joined([random_shards])
    rows |= {"angle": np.linspace(0.0, 1.2, len(rows["pair"]))}
    corrections, remainders = taught(shipped(), rows["descriptors"].astype(float), rows["disk"])
    rows |= {"corrections": corrections + [0.02, *[0.0] * 7], "exact": rows["base"] + remainders + [0.03, 0.04, 0.0]}
    of_load, of_force = held_back.errors(shipped(), rows)
    np.testing.assert_allclose(of_load, 2.0, rtol=1e-4)
    np.testing.assert_allclose(of_force, 5.0, rtol=1e-3)
    found = held_back.table(shipped(), rows)
    assert found["number"][0] == is_held_back(rows["pair"]).sum() and found["N, %"][0] == "2/2/2"
    trained = held_back.table(shipped(), rows, trained=True)
    assert trained["number"][0] == (~is_held_back(rows["pair"])).sum() > 0
