"""Figures of the contact geometry: the numbers behind the lines, in mm and mrad."""

import numpy as np
import pytest

from wrcore import figures_contact
from wrcore.contact.conicity import conicity_curve
from wrcore.contact.first_touch import WheelsetOnTrack, first_touch
from wrcore.figures import save_figure


@pytest.fixture(scope="module")
def pair(s1002, uic60):
    return WheelsetOnTrack.alike(s1002, uic60)


@pytest.fixture(scope="module")
def table(pair):
    return first_touch(pair, 1e-3 * np.arange(-6, 7))


def lines(axes, label):
    found = [line for line in axes.get_lines() if line.get_label() == label]
    assert len(found) == 1, label
    return found[0]


def test_contact_location_joins_the_touching_points(pair, table, s1002, uic60):
    figure = figures_contact.fig_contact_location(pair, table)
    left, right = figure.axes
    for axes, side, sign in ((left, "left", 1.0), (right, "right", -1.0)):
        assert axes.get_xlabel() == "y, to the left / mm" and axes.get_ylabel() == "z / mm"
        joints = [line.get_xydata() for line in axes.get_lines() if line.get_color() == figures_contact.ACCENT]
        assert len(joints) == len(table)
        for (wheel, rail), row in zip(joints, table.itertuples(), strict=True):
            u_wheel, u_rail = getattr(row, f"u_wheel_{side}_m"), getattr(row, f"u_rail_{side}_m")
            assert wheel == pytest.approx([sign * (750.0 + 1e3 * u_wheel), 20.0 + 1e3 * s1002(u_wheel)], abs=1e-9)
            distance = 1e3 * pair.rail_distance(pair.left)
            assert rail == pytest.approx([sign * (distance + 1e3 * u_rail), 1e3 * uic60(u_rail)], abs=1e-9)
        drawn = lines(axes, "wheel").get_xydata()
        assert np.ptp(drawn[:, 0]) == pytest.approx(1e3 * np.ptp(s1002.u))
    assert left.get_xlim()[0] > left.get_xlim()[1] > 0.0 > right.get_xlim()[0]  # left stands left
    labels = [text.get_text() for text in left.texts]
    assert "0" in labels and "5" in labels and len(set(labels)) == len(labels)
    spots = sorted(text.xy[0] for text in left.texts)
    assert min(np.diff(spots)) > 3.5


def test_rolling_radius_difference_in_mm(table):
    axes = figures_contact.fig_rolling_radius_difference({"rigid": table}).axes[0]
    drawn = lines(axes, "rigid").get_xydata()
    assert drawn[:, 0] == pytest.approx(np.arange(-6, 7), abs=1e-9)
    assert drawn[9, 1] == pytest.approx(0.995, rel=2e-3)  # 3 mm: see test_conicity.RADIUS_DIFFERENCE
    assert axes.get_xlabel().endswith("/ mm") and axes.get_ylabel().endswith("/ mm")


def test_contact_angle_in_mrad(table):
    axes = figures_contact.fig_contact_angle({"rigid": table}).axes[0]
    assert lines(axes, "rigid, left").get_ydata() == pytest.approx(1e3 * table.contact_angle_left_rad)
    right = lines(axes, "rigid, right").get_ydata()
    assert right == pytest.approx(-lines(axes, "rigid, left").get_ydata()[::-1], abs=1e-6)  # mirror image
    assert axes.get_ylabel().endswith("/ mrad")


def test_conicity_with_the_band_of_the_standard(pair):
    curve = conicity_curve(pair, 1e-3 * np.arange(1, 6))
    reference = (np.array([2e-3, 3e-3]), np.array([0.04, 0.2]))
    axes = figures_contact.fig_conicity({"ours": curve}, reference).axes[0]
    drawn = lines(axes, "ours").get_xydata()
    assert drawn[2] == pytest.approx([3.0, 0.1836], rel=1e-2)  # rigid-geometry code, see test_conicity.ONE_IN_40
    band = axes.collections[0].get_paths()[0].vertices
    at_2 = band[np.isclose(band[:, 0], 2.0), 1]
    at_3 = band[np.isclose(band[:, 0], 3.0), 1]
    assert (at_2.min(), at_2.max()) == pytest.approx((0.02, 0.06))  # half of the value
    assert (at_3.min(), at_3.max()) == pytest.approx((0.15, 0.25))  # 0.05
    assert axes.get_xlabel() == "amplitude / mm" and axes.get_ylim()[0] == 0.0


def test_files_are_reproducible(pair, table, tmp_path):
    for name in ("a.svg", "b.svg"):
        save_figure(figures_contact.fig_contact_location(pair, table), tmp_path / name)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
