"""Shards of random numbers, in place of solved patches, for tests of the training."""

import numpy as np
import pytest

from study.surrogate import shards
from wrcore.contact.surrogate.network import load_surrogate


@pytest.fixture(scope="session")
def random_shards(tmp_path_factory):
    """Folder with two shards of 60 patches of 4 pairs each; two thirds of them are twins."""
    folder, surrogate = tmp_path_factory.mktemp("shards"), load_surrogate()
    for number in range(2):
        random, n = np.random.default_rng(number), 60
        disk = random.uniform(-0.6, 0.6, (n, 17, 2))
        disk[:, :5] = 0.04 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1], [0, 0]])
        descriptors = surrogate.median + 0.5 * random.normal(size=(n, 38)) / surrogate.per_scale
        corrections = 0.01 * descriptors[:, :8] + 1e-3 * random.normal(size=(n, 8))
        exact = 0.02 * np.sin(disk @ random.normal(size=(2, 3))) + 1e-3 * random.normal(size=(n, 17, 3))
        arrays = {"descriptors": descriptors, "corrections": corrections, "exact": exact, "base": 0.0 * exact}
        arrays |= {
            "disk": disk,
            "pair": 1000 * number + np.arange(n) // 15,
            "overlaps": random.integers(1, 3, n).astype(float),
        }
        arrays |= {"twin": np.tile([-1, 0, 1, 0, 1, -1], n // 6), "step": np.full(n, 1e-4)}
        shards.write(shards.path_of(folder, number), arrays | {"names": np.array(["a"]), "distances": np.zeros(1)})
    return folder
