"""The table of looked-up contact as it is drawn: on cells whose places are known, and against runs' own look-ups."""

import math
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_hex

from study.patch import cells
from wrcore.analysis.legible import save_figure
from wrcore.run.simulation import Simulation
from wrcore.scene.description import load_scene
from wrcore.wheels.table.cells import FINER, HARD, YAW, key_of
from wrcore.wheels.table.solver import place_of
from wrcore.wheels.table.store import pair_of

COARSE, FINE, WORST = key_of(0, 25, 1, 100, 100, 12), key_of(1, 25, 4, 200, 200, 12), key_of(3, 25, 40, 800, 800, 12)
STATES, MISSES = (
    {COARSE: FINER, FINE: 7, WORST: HARD},
    {COARSE: (0.1, 0.2, 0.3, 0.0), FINE: (1e-3, 2e-3, 1e-3, 1e-3), WORST: (math.nan,) * 4},
)


@pytest.fixture
def table():
    return cells.cells_of(SimpleNamespace(cells=STATES, misses=MISSES))


def test_what_becomes_of_a_cell(table):
    assert table["state"].tolist() == [cells.REFINED, cells.LOOKED_UP, cells.SOLVED]
    assert table["level"].tolist() == [0, 1, 3]
    assert table["normal_error"][:2].tolist() == [0.1, 1e-3] and math.isnan(table["force_error"][2])


@pytest.mark.parametrize(("row", "node"), [(0, (0, 25, 3, 100, 100, 12)), (1, (1, 25, 9, 200, 200, 12))])
def test_ends_of_a_cell_are_its_nodes(table, row, node):
    """Yaw's nodes are the ends and the middle of a cell, so that there are two for each place."""
    found, (level, part, turn, *first) = table.iloc[row], node
    low, high = place_of(level, part, turn, *first), place_of(level, part, turn, *np.add(first, 1))
    for n, (one, other) in enumerate((*(pair.ends for pair in (cells.ALONG, cells.SLOPE, cells.DEPTH)),)):
        assert (found[one], found[other]) == pytest.approx((low[n], high[n]), rel=1e-12)
    assert 0.5 * (found["yaw_low_rad"] + found["yaw_high_rad"]) == pytest.approx(low[3], abs=1e-15)
    assert found["yaw_high_rad"] - found["yaw_low_rad"] == pytest.approx(2.0 * YAW / 3.0**level)


def test_finer_cells_lie_in_coarser_ones(table):
    for axis in (cells.ALONG, cells.SLOPE):
        low, high = (table[end] for end in axis.ends)
        assert (low == low[0]).all() and high.is_monotonic_decreasing
    assert table["D_low_m"].nunique() == table["D_high_m"].nunique() == 1


def test_a_run_looks_up_where_its_lobes_lie():
    """Every lobe at an output time is in a cell; what others know, and keep, has no part in it."""
    source = "config/scenes/suspended_wheelset.yaml"
    overrides = ["contact.patch=tabulated", "initial.y=-0.0021", "integration.duration=0.01"]
    contact = Simulation(load_scene(source, overrides)).model.contact
    shared = pair_of(contact)
    before = dict(shared.cells)
    table, lobes = cells.filled_by_run(source, overrides)
    assert pair_of(contact) is shared and shared.cells == before
    assert 2 <= len(table) < 40 and len(lobes) == 2 * 3
    found = table[table["state"] == cells.LOOKED_UP]
    for _, lobe in lobes.iterrows():
        inside = found["yaw_low_rad"].le(lobe["yaw_rad"]) & found["yaw_high_rad"].ge(lobe["yaw_rad"])
        for axis in (cells.ALONG, cells.SLOPE, cells.DEPTH):
            low, high = axis.ends
            inside &= found[low].le(lobe[axis.lobe]) & found[high].ge(lobe[axis.lobe])
        assert inside.any()


def test_damping_at_rest_lifts_a_lobe():
    """By 1 - 0.9^(2/3) of its depth, for at rest a damped contact has 0.9 of Hertz's force."""
    contact = Simulation(load_scene("config/scenes/suspended_wheelset.yaml")).model.contact
    assert contact.damping == 0.8
    poses = np.array([[4e-3, 0.45972, 0.0, 1e-3]])
    damped, free = (cells.lobes_of(one, poses) for one in (contact, contact._replace(damping=1.0)))
    assert len(damped) == 2 and damped["slope"].tolist() == [0.0, 0.0]
    assert damped["yaw_rad"].tolist() == pytest.approx([-1e-3, 1e-3])
    assert (damped["D_m"] / free["D_m"]).to_numpy() == pytest.approx(0.9 ** (2.0 / 3.0), rel=0.02)


def test_the_figure_has_cells_lobes_and_shares(table, tmp_path):
    lobes = pd.DataFrame({"offset_m": [-0.0099], "slope": [2e-4], "yaw_rad": [0.0], "D_m": [8.5e-5]})
    figure = cells.fig_cells(table, lobes)
    places, errors = np.reshape(figure.axes, (2, 2))
    assert [len(axes.collections) for axes in places] == [2, 2]  # what is refined is not drawn
    for level, shown in ((1, places[1].collections[0]), (3, places[1].collections[1])):
        assert np.ptp(shown.get_paths()[0].vertices, axis=0) == pytest.approx([0.8 * 0.5**level, 1.0 * 0.5**level])
    assert [to_hex(axes.collections[1].get_facecolor()[0], False).upper() for axes in places] == [
        cells.SOLVED_COLOR
    ] * 2
    (x, y), *_ = places[1].collections[0].get_paths()[0].vertices
    assert (x, y) == pytest.approx((-20.0, 0.0), abs=1e-9)
    shares = [
        line.get_ydata().max()
        for line in errors[0].lines
        if line.get_drawstyle() == "steps-post" and len(line.get_ydata())
    ]
    assert shares == [100.0, 100.0]  # and none of the finest, whose middle has no solution
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "left to the solver" in texts
    save_figure(figure, tmp_path / "cells.png")


def test_lattices_are_told_with_their_largest_errors(table):
    told = cells.told(table)
    assert told.loc[1, [cells.LOOKED_UP, "normal_error"]].tolist() == [1, 1e-3]
    assert told.loc[3, cells.SOLVED] == 1 and math.isnan(told.loc[0, "normal_error"])
