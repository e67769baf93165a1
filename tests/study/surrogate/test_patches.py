"""Shards of solved patches: the same again from a seed, continued after a kill; targets that mean exact contact."""

import math

import numpy as np
import pytest

from study.surrogate import patches, positions, shards
from study.surrogate.finding import LOAD
from study.surrogate.pairs import Pair
from study.surrogate.patches import Sampling, distances, make_shard, write_shards
from study.surrogate.solution import POINTS, ExactPatches, random_points, unbounded
from wrcore.analysis.contact.loaded import LoadedWheels
from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.contact.search import reduction
from wrcore.contact.search.reduction import MAX_PATCHES, PATCH_COLUMNS
from wrcore.contact.surrogate.network import FORCE_CELLS, N_CORRECTIONS, WIDTH, Layers, Surrogate
from wrcore.errors import InputError
from wrcore.geometry.profiles.standards import named_profile
from wrcore.kernels.handles import Handle
from wrcore.wheels.motion import WheelMotion
from wrcore.wheels.surrogate_force import surrogate_wrenches
from wrcore.wheels.surrogate_patch import bounded

SMALL = Sampling(seed=3, shard_patches=5)


@pytest.fixture(scope="module", autouse=True)
def few_patches():
    """Six patches of a pair at some forty positions, so that the tests are quick."""
    with pytest.MonkeyPatch.context() as context:
        context.setattr(patches, "PAIR_PATCHES", 6)
        context.setattr(patches, "UNSOLVED_PATCHES", 6)
        context.setattr(patches, "LEAST_DRAWN", 6)
        draw = patches.draw_positions
        context.setattr(patches, "draw_positions", lambda random, exact, count, *more: draw(random, exact, 40, *more))
        yield


@pytest.fixture(scope="module")
def shard(few_patches):
    return make_shard(0, SMALL)


def test_shard_follows_from_seed_and_number(shard):
    again, other = make_shard(0, SMALL), make_shard(1, SMALL)
    assert set(again) == set(shard)
    for name in shard:
        np.testing.assert_array_equal(again[name], shard[name], err_msg=name)
    assert not np.array_equal(other["descriptors"][:2], shard["descriptors"][:2])


def test_shard_holds_what_the_training_reads(shard):
    n = len(shard["descriptors"])
    assert n >= SMALL.shard_patches
    assert shard["corrections"].shape == (n, N_CORRECTIONS)
    assert shard["exact"].shape == shard["base"].shape == (n, POINTS, 3)
    assert (np.hypot(*shard["disk"].transpose(2, 0, 1)) < 1.0).all()
    assert (np.hypot(shard["exact"][..., 0], shard["exact"][..., 1]) < 1.0 + 1e-4).all()
    assert np.abs(shard["exact"] - shard["base"]).max() < 0.5


def test_twins_follow_each_other_and_are_near(shard):
    first = np.flatnonzero(shard["twin"] == 0)
    assert len(first) > 0
    np.testing.assert_array_equal(shard["twin"][first + 1], 1)
    aside = np.abs(shard["position"][first + 1, 0] - shard["position"][first, 0])
    np.testing.assert_allclose(aside, shard["step"][first], rtol=1e-9)
    assert ((aside > 2e-5) & (aside < 3e-4)).all()


def test_unsolved_shard_has_descriptors_alone(few_patches):
    found = make_shard(0, SMALL._replace(is_solved=False))
    assert "exact" not in found and len(found["descriptors"]) >= SMALL.shard_patches


def fake_shards(monkeypatch, stop_at=None):
    made = []

    def fake(number, sampling):
        if number == stop_at:
            raise KeyboardInterrupt
        made.append(number)
        return {"descriptors": np.full((5, 38), float(number)), "failed": np.array(0)}

    monkeypatch.setattr(patches, "make_shard", fake)
    return made


def test_killed_run_continues_where_it_stopped(tmp_path, monkeypatch):
    fake_shards(monkeypatch, stop_at=2)
    with pytest.raises(KeyboardInterrupt):
        write_shards(tmp_path, 20, SMALL, report=lambda line: None)
    before = {path.name: path.stat().st_mtime_ns for path in shards.found_in(tmp_path)}
    assert len(before) == 2
    made, lines = fake_shards(monkeypatch), []
    write_shards(tmp_path, 20, SMALL, report=lines.append)
    assert made == [2, 3] and "2 of 4 shards are there" in lines[0] and "0 shards remain" in lines[-1]
    assert all((tmp_path / name).stat().st_mtime_ns == time for name, time in before.items())


def test_parts_share_the_shards(tmp_path, monkeypatch):
    made = fake_shards(monkeypatch)
    for part in ((2, 2), (1, 2)):
        write_shards(tmp_path, 25, SMALL, part, report=lambda line: None)
    assert made == [1, 3, 0, 2, 4]


def test_interrupted_write_leaves_no_file(tmp_path, monkeypatch):
    def fail(*given, **named):
        raise OSError("no space")

    monkeypatch.setattr(shards.os, "replace", fail)
    with pytest.raises(OSError, match="no space"):
        shards.write(shards.path_of(tmp_path, 0), {"x": np.zeros(3)})
    assert list(tmp_path.iterdir()) == []


def test_shards_of_other_settings_are_refused(tmp_path, monkeypatch):
    fake_shards(monkeypatch)
    write_shards(tmp_path, 5, SMALL, report=lambda line: None)
    with pytest.raises(InputError, match="seed.*expected 3"):
        write_shards(tmp_path, 10, SMALL._replace(seed=4), report=lambda line: None)


def test_farthest_candidate_is_kept(monkeypatch):
    class One:
        def __init__(self, value):
            self.descriptors = np.full(38, value)

    drawn = iter([[One(0.1)] * 3, [One(3.0)] * 3, [One(0.2)] * 3])
    monkeypatch.setattr(
        patches, "_draw_candidate", lambda *given: patches._Candidate(Pair(None, ""), None, next(drawn))
    )
    monkeypatch.setattr(patches, "draw_positions", lambda random, exact, count, *shares: [One(5.0)])
    monkeypatch.setattr(patches, "scaled_inputs", lambda rows: np.asarray(rows, float))
    best, distance = patches._keep_farthest(None, SMALL._replace(candidates=3), np.zeros((4, 38)))
    assert [one.descriptors[0] for one in best.drawn] == [3.0, 3.0, 3.0, 5.0]  # and those at its other positions
    assert distance == pytest.approx(3.0 * math.sqrt(38))


def test_positions_in_curves_have_evenly_spread_contact_angles():
    pair = WheelOnRail(named_profile("S1002", "wheel"), named_profile("60E1", "rail", 1 / 40))
    exact, random = ExactPatches(pair, 0.3), np.random.default_rng(4)
    angles = []
    for _ in range(60):
        y, z, axle = positions._in_curve(random, exact)
        found = exact.find(y, z, axle)
        load = [one.numbers[LOAD] for one in found]
        angles.append(np.average([one.shape.angle for one in found], weights=load))
    counts, _ = np.histogram(angles, [0.0, 0.4, 0.7, 1.1])
    assert counts.sum() > 55 and counts.min() >= 12


def test_positions_near_the_centre_are_within_four_millimetres():
    pair = WheelOnRail(named_profile("S1002", "wheel"), named_profile("60E1", "rail", 1 / 40))
    exact, random = ExactPatches(pair, 0.3), np.random.default_rng(4)
    drawn = positions.draw_positions(random, exact, 60, centred=1.0)
    y = np.array([one.position[0] for one in drawn]) - positions._centre(exact)
    assert len(drawn) > 40
    assert -4e-3 <= y.min() < -2e-3 and 2e-3 < y.max() <= 4e-3


def test_selected_patches_are_far_from_each_other():
    inputs = np.concatenate([0.01 * np.random.default_rng(2).normal(size=(50, 3)), [[1.0, 0, 0], [0, 1, 0], [0, 0, 1]]])
    chosen = positions._far_apart(np.random.default_rng(1), inputs, 4)
    assert {50, 51, 52} < set(chosen) and len(set(chosen)) == 4


def test_distance_is_to_the_nearest():
    np.testing.assert_allclose(distances(np.array([[1.0, 0.0]]), np.array([[0.0, 0.0], [1.0, 0.5]])), [0.5])
    assert np.isinf(distances(np.array([[1.0, 0.0]]), np.zeros((0, 2)))).all()


def test_unbounded_is_the_inverse_of_bounded():
    for x in np.linspace(-0.57, 0.57, 41):
        assert bounded(unbounded(x, 0.6), 0.6) == pytest.approx(x, abs=1e-12)
    assert bounded(unbounded(5.0, 0.6), 0.6) == pytest.approx(0.57)


def constant_surrogate(corrections, remainder):
    """`Surrogate` whose outputs are the same for every overlap, with one force mode for each of Fx, Fy and Mz."""
    biases = np.zeros(WIDTH)
    biases[: N_CORRECTIONS + 3] = *corrections, *remainder
    sizes = 38, *[WIDTH] * 4
    layers = []
    for inputs, outputs in zip(sizes[:-1], sizes[1:], strict=True):
        layers += [np.zeros((inputs, outputs), np.float32), np.zeros(outputs)]
    layers = Layers(*layers)
    modes = np.zeros((FORCE_CELLS + 2, FORCE_CELLS + 2, 3, 8))
    modes[:, :, range(3), range(3)] = 1.0
    ones = np.ones(38)
    return Surrogate(0 * ones, ones, -ones, ones, 0 * ones, layers._replace(biases_4=biases), np.ones(N_CORRECTIONS),
                     modes)  # fmt: skip


def row_of(geometry, position, velocity, friction, surrogate, monkeypatch):
    """Row of the one patch of a left wheel by `surrogate_wrenches` with this `Surrogate`, and the number of patches."""
    monkeypatch.setattr("wrcore.analysis.contact.loaded.load_surrogate", lambda: surrogate)
    wheels = LoadedWheels(geometry, "surrogate", "middle")
    m = WheelMotion(1.0, *position, *velocity, 0.0, 0.0, friction)
    motions, counts = np.array([[m, m]]), np.zeros((1, 2), np.int64)
    motions[0, 1, WheelMotion._fields.index("z")] += 1.0
    rows = np.zeros((1, 2, MAX_PATCHES, PATCH_COLUMNS))
    surrogate_wrenches(Handle(wheels.contact), motions, rows, counts, np.zeros((1, 2)), np.zeros((1, 2, 6)),
                       wheels._counters, wheels._work_handle)  # fmt: skip
    return rows[0, 0, 0], counts[0, 0]


@pytest.mark.parametrize("y", [-4e-3, 2e-3, 5.5e-3])
def test_exact_targets_as_outputs_give_exact_contact(y, monkeypatch):
    pair = WheelOnRail(named_profile("S1002", "wheel"), named_profile("60E1", "rail", 1 / 40), rolling_radius=0.4)
    mu, axle = 0.25, (2e-3, math.sqrt(1.0 - 5e-6), 1e-3)
    exact = ExactPatches(pair, mu)
    (found, *others) = exact.find(y, exact.touch(y, axle) - 7e-5, axle)
    assert others == []
    solved = exact.solve(found, random_points(np.random.default_rng(1)))
    for k in (0, 4, 5, 6):
        surrogate = constant_surrogate(solved.corrections, solved.exact[k] - solved.base[k])
        row, count = row_of(pair.geometry, found.position, solved.velocities[k], mu, surrogate, monkeypatch)
        assert count == 1
        limit, c = mu * solved.load, math.sqrt(row[reduction.SEMI_A] * row[reduction.SEMI_B])
        assert row[reduction.NORMAL] == pytest.approx(solved.load, rel=1e-9)
        assert row[reduction.ANGLE] == pytest.approx(solved.angle, abs=1e-9)
        part = (solved.velocities[k, 4] * 0.4 - 1.0) / 0.3
        share = max(0.0, 1.0 - part * part) ** 2  # the remainder fades out where a wheel slides
        expected = solved.base[k] + share * (solved.exact[k] - solved.base[k])
        force = np.array([row[reduction.FX] / limit, row[reduction.FY] / limit, row[reduction.MZ] / (limit * c)])
        np.testing.assert_allclose(force, expected, rtol=0.0, atol=2e-6)
