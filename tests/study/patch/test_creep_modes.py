"""Training of the creep force's modes, on remainders of known rank."""

import numpy as np
import pytest

from study.patch import creep_modes
from wrcore.contact.patch.model import MODES, NUMBERS
from wrcore.wheels.table import lookup as columns


def remainders(points, poses, parts, seed):
    """Numbers (poses, NUMBERS) and remainder (poses, n, 3): random sums of ``parts`` smooth functions of the creepages,
    others for each family, beside a force at rest that counts where slopes are exact."""
    shapes, random = np.random.default_rng(1), np.random.default_rng(seed)
    at = creep_modes.in_disk(points)
    square = (at**2).sum(axis=1)
    waves, phases = shapes.normal(0.0, 2.0, (2, parts, 3, 2)), shapes.uniform(0.0, 6.0, (2, 1, parts, 3))
    functions = np.sin(np.einsum("nd,fpcd->fnpc", at, waves) + phases)
    numbers, family = np.zeros((poses, NUMBERS)), random.integers(2, size=poses)
    numbers[:, columns.ANGLE] = np.where(family, 1.1, 0.1) + random.uniform(-0.1, 0.1, poses)
    numbers[:, columns.LINEAR] = random.uniform(0.0, 1.0, poses)
    numbers[:, columns.FORCE : columns.FORCE + 3] = random.normal(0.0, 0.02, (poses, 3))
    own = (square / (square + columns.ROUND**2 * numbers[:, columns.LINEAR, None]))[..., None]
    free = np.einsum("kp,knpc->knc", random.normal(0.0, 0.02, (poses, parts)), functions[family])
    return numbers, own * free + (1.0 - own) * numbers[:, None, columns.FORCE : columns.FORCE + 3]


@pytest.mark.parametrize(("parts", "least", "most"), [(8, 0.0, 8e-4), (MODES, 0.0, 1.5e-3), (2 * MODES, 0.05, 0.2)])
def test_a_nodes_few_solutions_tell_remainders_of_the_modes_rank(parts, least, most):
    """At creepages where it is not solved, of poses that were not trained on, over their size; of twice the rank, a
    part is left that no mode has."""
    points = creep_modes.disk(120)
    modes = creep_modes.train(*remainders(points, 300, parts, 2), points)
    own = [int(np.argmin(np.hypot(*(points - point).T))) for point in modes.points]
    assert len(set(own)) == creep_modes.SOLUTIONS
    order = [*own, *sorted(set(range(len(points))) - set(own))]
    numbers, rest = remainders(points, 30, parts, 3)
    left = [creep_modes.errors(modes, row, one[order], points[order]) for row, one in zip(numbers, rest, strict=True)]
    share = np.sqrt(np.mean(np.square(np.array(left)[:, len(own) :])) / np.mean(rest**2))
    assert least <= share < most


def test_a_node_is_solved_where_most_is_told():
    """Where a remainder of one shape is largest, among the creepages that are allowed; then that of another family."""
    random, one, two = np.random.default_rng(4), np.zeros((1, 30, 3)), np.zeros((1, 30, 3))
    one[0, 4:16], two[0, 18:29] = 1e-3, 1e-3
    one[0, 7], one[0, 11], two[0, 25] = 0.05, 0.04, 0.03
    families = [random.normal(0.0, 1.0, (200, 1, 1)) * shape for shape in (one, two)]
    allowed = np.arange(30) != 7
    assert set(creep_modes._most_telling(families, allowed)[:2]) == {11, 25}
