"""Cells of looked-up contact: which one a lobe lies in, and that lattices go over into each other."""

from itertools import permutations

import numpy as np
import pytest

import wrcore as wr
from wrcore.contact.patch.model import NO_TABLE, NODES, NUMBERS, SHARES
from wrcore.jacobian.table import look_share_slopes_up
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.wheels.table import cells as pair_cells
from wrcore.wheels.table import solver as pair_solver
from wrcore.wheels.table import store as pair_store
from wrcore.wheels.table.cells import AXES, FINER, LEVELS, YAW, corner_of, key_of, locate
from wrcore.wheels.table.lookup import look_shares_up, look_up, weigh

U, FINEST = 0.011, 2
"""Place on the wheel's profile, and the finest lattice that these tables have."""

OWN = pair_store.Pair._own


def test_finer_steps_where_a_cell_is_too_coarse():
    """A lobe in a cell that is left to the next lattice is looked up there, at twice the steps of offset and slope from
    the first place and in a third of the yaw; ln D is never cut finer."""
    coarse = np.array([150.3, 100.6, 9.8, 1.84])
    offset, slope, log_depth = np.array(pair_cells.FIRST) + coarse[:3] * pair_cells.STEPS
    part = round((U - pair_cells.FIELD) / pair_cells.PART)
    keys, states = np.zeros(1009, np.int64), np.zeros(1009, np.int32)
    for level, parts in enumerate(((1, 1, 1, 1), (2, 2, 1, 3), (4, 4, 1, 9), (8, 8, 1, 27))):
        i, j, k, turn = map(int, coarse * parts)
        key = key_of(level, part, turn, i, j, k)
        keys[key % 1009], states[key % 1009] = key, 5 if level == 3 else FINER
    table = NO_TABLE._replace(keys=keys, states=states)
    yaw = (2.0 * coarse[3] - pair_cells.YAWS) * YAW
    at = locate(table, U, False, offset + U, slope, log_depth, yaw, np.zeros(SHARES))
    assert (at.cell, at.scale, at.half, at.own) == (5, 8.0, YAW / 27.0, 1.0)
    expected = coarse * (8, 8, 1, 27) - (i, j, k, turn)
    np.testing.assert_allclose((at.fx, at.fy, at.fz, 0.5 * (at.turn + 1.0)), expected, atol=1e-9)
    np.testing.assert_allclose((at.gx, at.gy, at.gz), 0.5 * (expected[:3] + np.array([i, j, k]) % 2), atol=1e-9)


def test_a_node_of_several_lattices_is_solved_once():
    nodes = np.array([(4, 25, 243, 2400, 1600, 10), (4, 25, 242, 2400, 1600, 10), (1, 25, 3, 300, 201, 9)])
    found = [pair_cells.node_of(code) for code in pair_cells.node_codes(nodes).tolist()]
    assert found == [(0, 25, 3, 150, 100, 10), (4, 25, 242, 2400, 1600, 10), (1, 25, 3, 300, 201, 9)]
    for one, other in zip(nodes, found, strict=True):
        assert pair_solver.place_of(*one) == pair_solver.place_of(*other)


@pytest.fixture(params=(1, 2))
def patchwork(request, tmp_path, monkeypatch):
    """A table of which half of the cells are left to the next lattice, and whose numbers are 1, 2 and 3 on its
    lattices, and .3 more in every second cell of yaw."""

    def solved(pair, key):
        level, _, *cell = corner_of(key)
        rows = np.zeros((NODES, NUMBERS), np.float32)
        rows[:32] = 1.0 + level % LEVELS + 0.3 * (cell[0] % 2)
        finer = np.random.default_rng([request.param, level, *cell]).random() < 0.5
        pair.misses[key] = 0.0, 0.0, 0.0, 0.0
        return (FINER, None) if level < FINEST and finer else (1, rows)

    monkeypatch.setattr(pair_store, "table_folder", lambda: tmp_path)
    monkeypatch.setattr(pair_store, "_PAIRS", {})
    monkeypatch.setattr(pair_store.Pair, "_take_shipped", lambda _: None)
    monkeypatch.setattr(pair_store.Pair, "_solved", solved)
    monkeypatch.setattr(pair_store.Pair, "_own", lambda _, key: key)
    model, _ = compile_scene(load_scene(wr.example("suspended_wheelset"), **{"contact.patch": "tabulated"}))
    return pair_store.Pair(model.contact, "patchwork")


@pytest.mark.parametrize("order", list(permutations(range(20, 24))))
@pytest.mark.parametrize("patchwork", [1], indirect=True)
def test_cells_that_stand_for_each_other_are_one_whichever_is_asked_first(order, patchwork, monkeypatch):
    """Lobes of part 20 are found in 21, of 21 in 22, of 22 in 23 and of 23 in 22: all are cells of part 22, and so is
    what they leave to the next lattice."""
    found, solved = {20: 21, 21: 22, 22: 23, 23: 22}, []

    def nearer(_, key):
        level, part, *cell = corner_of(key)
        return key_of(level, found[part], *cell)

    def solve(pair, key):
        level, part, *cell = corner_of(key)
        solved.append((level, part))
        pair.misses[key] = pair.misses[key_of(level - LEVELS, part, *cell)] if level else 4 * (0.0,)
        return FINER if level == 0 else pair_cells.HARD, None

    monkeypatch.setattr(pair_store.Pair, "_own", OWN)
    monkeypatch.setattr(pair_store.Pair, "_nearer", nearer)
    monkeypatch.setattr(pair_store.Pair, "_solved", solve)
    table = patchwork.table()
    for part in order:
        for level, state in ((0, FINER), (LEVELS, pair_cells.HARD)):
            assert pair_cells._filled(table, key_of(level, part, 4, 150, 100, 9)) == state
    assert solved == [(0, 22), (LEVELS, 22)]


def number_at(table, place):
    """A number at a place (steps of the coarsest lattice, its cells in yaw), and its cell's own share."""
    offset, slope, log_depth = np.array(pair_cells.FIRST) + place[:3] * pair_cells.STEPS
    shares, weights, numbers = np.zeros(SHARES), np.zeros(NODES), np.zeros(NUMBERS)
    at = locate(table, U, False, offset + U, slope, log_depth, (2.0 * place[3] - pair_cells.YAWS) * YAW, shares)
    if at.own < 1.0:
        look_shares_up(table, at, shares, weights, numbers)
    else:
        weigh(at, weights)
        look_up(table.cells[at.cell], weights, numbers)
    return numbers[0], at, shares


def test_lattices_go_over_into_each_other_without_a_step_or_a_kink(patchwork):
    """Along lines in all directions, through three lattices."""
    table, random, step = patchwork.table(), np.random.default_rng(2), 2.5e-4
    plain, seen = {1.0, 1.3, 2.0, 2.3, 3.0, 3.3}, set()
    for _ in range(8):
        way = random.normal(size=AXES) * (1.0, 1.0, 1.0, 0.5)
        way *= step / abs(way).max()
        begin = random.uniform((150.0, 100.0, 8.0, 1.0), (151.0, 101.0, 9.0, 2.0)) - 750 * way
        numbers = np.array([number_at(table, begin + n * way)[0] for n in range(1500)])
        seen |= set(np.round(numbers, 6)) & plain
        assert 1.0 - 1e-6 < numbers.min() <= numbers.max() < 3.3 + 1e-6
        assert abs(np.diff(numbers)).max() < 0.02  # a step has .3 or more
        assert abs(np.diff(numbers, 2)).max() < 6e-4  # a kink where a straight line begins has 2.5e-3
    assert len(seen) >= 3


def test_what_shares_change_by(patchwork):
    """Along each axis, against differences."""
    table, random, step, count = patchwork.table(), np.random.default_rng(3), 1e-6, 0
    units = np.array([*pair_cells.STEPS, 2.0 * YAW])
    weights, numbers, along = np.zeros((1 + AXES, NODES)), np.zeros(NUMBERS), np.zeros((AXES, NUMBERS))
    for place in random.uniform((150.0, 100.0, 8.0, 1.0), (152.0, 102.0, 10.0, 2.0), size=(1500, AXES)):
        number, at, shares = number_at(table, place)
        if at.own == 1.0:
            continue
        look_share_slopes_up(table, at, shares, weights, numbers, along)
        assert numbers[0] == pytest.approx(number, rel=1e-12)
        sides = [[number_at(table, place + h * axis)[0] for h in (step, -step)] for axis in np.eye(AXES)]
        slopes = np.subtract(*np.transpose(sides)) / (2.0 * step)
        if abs(slopes).max() > 1e-3:
            np.testing.assert_allclose(along[:, 0] * units, slopes, rtol=1e-4, atol=1e-3 * abs(slopes).max())
            count += 1
    assert count > 100
