"""Depths of both ways over one profile, and their picture."""

import numpy as np

from tests.analysis.wear.patches import WAYS, WIDTH, U, depths, figure_of
from wrcore.analysis.wear.local_wear import WheelWear


def test_depths_are_put_onto_one_profile():
    edges = WIDTH * np.arange(-10, 11)
    depth = np.sin(np.pi * np.arange(20) / 19.0)
    found = depths(WheelWear(edges, depth, edges, depth, 1.0, 1.0))
    assert abs(np.sum(found) - np.sum(depth)) < 0.01 * np.sum(depth)
    assert found[U < edges[0]].max() == 0.0 and found[U > edges[-1]].max() == 0.0


def test_the_picture_has_a_row_per_scene_and_all_ways():
    ways = {patches: [(1e-11 * np.exp(-((U / 0.01) ** 2)), 1e-12, 0.1)] * 2 for patches in WAYS}
    figure = figure_of({"straight": ways, "R 800 m": ways})
    assert len(figure.axes) == 4 and figure.get_supylabel() == "depth / µm per 1000 km"
    assert [line.get_label() for line in figure.axes[0].lines] == list(WAYS)
    assert figure.axes[0].lines[0].get_ydata().max() == 1e12 * ways["ellipse"][0][0].max()
