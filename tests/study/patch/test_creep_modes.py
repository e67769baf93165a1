"""Training of the creep force's modes, on remainders of known rank."""

import numpy as np
import pytest

from study.patch import creep_modes
from wrcore.contact.patch.model import MODES, NUMBERS
from wrcore.dynamics import pair_table as columns


def remainders(points, poses, parts, seed):
    """Numbers (poses, NUMBERS), of both families' angles, and remainder (poses, n, 3): random sums of ``parts`` smooth
    functions of the creepages."""
    shapes, random = np.random.default_rng(1), np.random.default_rng(seed)
    at = points / (1.0 + np.sqrt(1.0 + (points**2).sum(axis=1)))[:, None]
    square = (at**2).sum(axis=1)
    waves, phases = shapes.normal(0.0, 2.0, (parts, 3, 2)), shapes.uniform(0.0, 6.0, (parts, 3))
    functions = np.sin(np.einsum("nd,pcd->pnc", at, waves) + phases[:, None]) * (square / (square + 0.01))[:, None]
    numbers = np.zeros((poses, NUMBERS))
    numbers[:, columns.ANGLE], numbers[:, columns.LINEAR] = random.uniform(0.0, 0.6, poses), 1.0
    return numbers, np.einsum("kp,pnc->knc", random.normal(0.0, 0.02, (poses, parts)), functions)


@pytest.mark.parametrize(("parts", "share"), [(8, 1e-3), (MODES, 3e-3)])
def test_a_nodes_few_solutions_tell_remainders_of_the_modes_rank(parts, share):
    """At creepages where it is not solved, of poses that were not trained on, within that share of their size."""
    points = creep_modes.disk(120)
    modes = creep_modes.train(*remainders(points, 200, parts, 2), points)
    own = [int(np.argmin(np.hypot(*(points - point).T))) for point in modes.points]
    assert len(set(own)) == creep_modes.SOLUTIONS
    order = [*own, *range(len(points))]
    numbers, rest = remainders(points, 30, parts, 3)
    left = [creep_modes.errors(modes, row, one[order], points[order]) for row, one in zip(numbers, rest, strict=True)]
    assert np.sqrt(np.mean(np.square(left))) < share * np.sqrt(np.mean(rest**2))


def test_more_ranks_than_modes_leave_what_no_mode_has():
    """As little as principal components would, but for what few solutions do not tell."""
    points = creep_modes.disk(120)
    numbers, rest = remainders(points, 200, 2 * MODES, 2)
    modes = creep_modes.train(numbers, rest, points)
    own = [int(np.argmin(np.hypot(*(points - point).T))) for point in modes.points]
    order = [*own, *range(len(points))]
    some = numbers[:, columns.ANGLE] < columns.FLANKS[0]
    every = zip(numbers[some], rest[some], strict=True)
    left = [creep_modes.errors(modes, row, one[order], points[order])[len(own) :] for row, one in every]
    sizes = np.linalg.svd(rest.reshape(len(rest), -1), compute_uv=False)
    least = np.sqrt(np.sum(sizes[MODES:] ** 2) / rest.size)
    assert 0.5 * least < np.sqrt(np.mean(np.square(left))) < 2.5 * least
