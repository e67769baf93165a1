"""Figures of the contact geometry: the numbers behind the lines, in mm and mrad."""

import numpy as np
import pytest

from study.contact import figures as figures_contact
from study.contact import tables as analysis_contact
from wrcore.analysis.contact import rigid
from wrcore.analysis.legible import save_figure
from wrcore.analysis.pictures import plot_contact
from wrcore.analysis.pictures.plot_contact import fig_contact_location
from wrcore.analysis.pictures.style import ACCENT, LINES
from wrcore.contact.rigid.conicity import conicity_curve
from wrcore.contact.rigid.first_touch import first_touch
from wrcore.contact.rigid.wheel_on_rail import WheelsetOnTrack


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
    figure = fig_contact_location(pair, table)
    left, right = figure.axes
    for axes, side, sign in ((left, "left", 1.0), (right, "right", -1.0)):
        assert axes.get_xlabel() == "y, to the left / mm" and axes.get_ylabel() == "z / mm"
        joints = [line.get_xydata() for line in axes.get_lines() if line.get_color() == ACCENT]
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
    axes = plot_contact.fig_rolling_radius_difference({"rigid": table}).axes[0]
    drawn = lines(axes, "rigid").get_xydata()
    assert drawn[:, 0] == pytest.approx(np.arange(-6, 7), abs=1e-9)
    assert drawn[9, 1] == pytest.approx(0.995, rel=2e-3)  # 3 mm: see test_conicity.RADIUS_DIFFERENCE
    assert axes.get_xlabel().endswith("/ mm") and axes.get_ylabel().endswith("/ mm")


def test_contact_angle_in_mrad(table):
    axes = plot_contact.fig_contact_angle({"rigid": table}).axes[0]
    assert lines(axes, "rigid, left").get_ydata() == pytest.approx(1e3 * table.contact_angle_left_rad)
    right = lines(axes, "rigid, right").get_ydata()
    assert right == pytest.approx(-lines(axes, "rigid, left").get_ydata()[::-1], abs=1e-6)  # mirror image
    assert axes.get_ylabel().endswith("/ mrad")


def test_conicity_with_the_band_of_the_standard(pair):
    curve = conicity_curve(pair, 1e-3 * np.arange(1, 6))
    reference = (np.array([2e-3, 3e-3]), np.array([0.04, 0.2]))
    axes = plot_contact.fig_conicity({"ours": curve}, reference).axes[0]
    drawn = lines(axes, "ours").get_xydata()
    assert drawn[2] == pytest.approx([3.0, 0.1805], rel=1e-2)  # without roll, see test_conicity.ONE_IN_40
    band = axes.collections[0].get_paths()[0].vertices
    at_2 = band[np.isclose(band[:, 0], 2.0), 1]
    at_3 = band[np.isclose(band[:, 0], 3.0), 1]
    assert (at_2.min(), at_2.max()) == pytest.approx((0.02, 0.06))  # half of the value
    assert (at_3.min(), at_3.max()) == pytest.approx((0.15, 0.25))  # 0.05
    assert axes.get_xlabel() == "amplitude / mm" and axes.get_ylim()[0] == 0.0


def test_files_are_reproducible(pair, table, tmp_path):
    for name in ("a.svg", "b.svg"):
        save_figure(fig_contact_location(pair, table), tmp_path / name)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


# ------------------------------------------------------------------------------------------ tables of the contact study


def test_conicity_of_pairs_with_and_without_roll(pair):
    table = rigid.conicity_table({"ours": pair}, 1e-3 * np.arange(1, 6))
    axes = plot_contact.fig_conicity_of_pairs(table).axes[0]
    # 3 mm: 0.1836 and 0.1805, see test_conicity.ONE_IN_40
    assert lines(axes, "ours").get_xydata()[2] == pytest.approx([3.0, 0.1836], rel=1e-2)
    assert axes.get_lines()[1].get_xydata()[2] == pytest.approx([3.0, 0.1805], rel=1e-2)
    assert axes.get_xlabel() == "amplitude / mm"


def test_location_with_yaw_draws_one_line_per_yaw(benchmark_pair):
    table = rigid.location_with_yaw(benchmark_pair, [0.001, 0.003], [0.0, 0.01])
    across, along = plot_contact.fig_location_with_yaw(table).axes
    left = table[(table.side == "left") & (table.yaw_rad == 0.01)]
    drawn = lines(across, "yaw 10 mrad").get_xydata()
    assert drawn == pytest.approx(1e3 * left[["y_m", "u_wheel_m"]].to_numpy())
    assert lines(along, "yaw 10 mrad").get_ydata() == pytest.approx(1e3 * left.x_m.to_numpy())
    assert across.get_ylabel().endswith("/ mm") and along.get_ylabel().endswith("/ mm")


def test_planar_error_map_shows_the_table_in_bands(benchmark_pair):
    yaws = np.linspace(0.0, 0.03, 4)
    table = analysis_contact.planar_error_map(benchmark_pair, np.linspace(0.0, 0.009, 46), yaws, 2e4)
    figure = figures_contact.fig_planar_error(table)
    panels = [axes for axes in figure.axes if axes.get_label() != "<colorbar>"]
    assert len(panels) == 4 * len(figures_contact.BANDS)
    flange, _, tread = panels[:3]
    for axes, (low, high) in ((tread, figures_contact.BANDS[0]), (flange, figures_contact.BANDS[-1])):
        mesh = next(c for c in axes.collections if c.get_array() is not None and c.get_array().ndim == 2)
        cells = mesh.get_array()
        part = table[table.contact_angle_rad.between(low, high) & (table.yaw_rad == yaws[3])]
        assert axes.get_ylim() == pytest.approx((1e3 * low, 1e3 * high))
        assert np.nanmin(cells[:, 2]) >= 1e6 * part.missed_m.min() * (1 - 1e-12)
        assert np.nanmax(cells[:, 2]) <= 1e6 * part.missed_m.max() * (1 + 1e-12)
    titles = [axes.get_title() for axes in panels if axes.get_title()]
    assert [title[:3] for title in titles] == ["(a)", "(b)", "(c)", "(d)"]
    assert titles[0].endswith("/ \N{MICRO SIGN}m") and titles[1].endswith("/ mm")


def test_law_contours_lie_on_the_law(benchmark_pair):
    table = analysis_contact.planar_error_map(benchmark_pair, np.linspace(0.001, 0.004, 7), [0.0, 0.015, 0.03], 2e4)
    tread = [axes for axes in figures_contact.fig_planar_error(table).axes if axes.get_label() != "<colorbar>"][2]
    contours = next(c for c in tread.collections if hasattr(c, "levels"))
    paths = dict(zip(contours.levels, contours.get_paths(), strict=True))
    yaw, angle = 1e-3 * paths[1.0].vertices.T
    # r psi^2 tan^2(delta) cos(delta)/2 = 1 um; the contour is linear between nodes 0.4 mrad apart
    assert 0.5 * 0.46 * yaw**2 * np.tan(angle) ** 2 * np.cos(angle) == pytest.approx(1e-6, rel=5e-3)


def test_lateral_sweep_in_kn_and_per_micrometre(benchmark_pair):
    sweep = analysis_contact.lateral_sweep(benchmark_pair, 1e-3, 1e-5, 54546.0)
    force, steps = figures_contact.fig_lateral_sweep(sweep).axes
    drawn = lines(force, "moment").get_xydata()
    assert drawn[100] == pytest.approx([0.0, 2 * 54.546], abs=1e-6)
    jump = np.abs(np.diff(sweep.maximum_N)).max()
    assert lines(steps, "maximum").get_ydata().max() == pytest.approx(1e-3 * jump / 10)  # 10 um per step
    assert force.get_ylabel().endswith("/ kN") and steps.get_ylabel() == "change per \N{MICRO SIGN}m / kN"
    assert {line["color"] for line in figures_contact.REDUCTION_LINES.values()}.isdisjoint(
        line["color"] for line in LINES.values()
    )


def test_patch_forces_by_panel(benchmark_pair):
    table = analysis_contact.force_over_height(benchmark_pair, 5.1e-3, 0.0, np.linspace(0.0, 8e-5, 41))
    axes = figures_contact.fig_patch_forces({"two": table}).axes[0]
    both = (table.patches == 2).to_numpy()
    assert axes.get_title() == "two"
    assert lines(axes, "field-side patch").get_ydata()[both] == pytest.approx(1e-3 * table.N_2_N[both])
    assert lines(axes, "flange-side patch").get_xdata()[both] == pytest.approx(1e6 * table.lowering_m[both])
    assert np.isnan(lines(axes, "only patch").get_ydata()[both]).all()
