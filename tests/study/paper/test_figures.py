"""Figures: the numbers behind the lines, units on every axis, and files that are reproducible."""

import re

import matplotlib as mpl
import numpy as np
import pytest
from synthetic import hunting_run

from study.paper.figures import fig1_parametrisation, fig2_profiles, fig3_detection, fig5_contact_points
from tests.conftest import SCENES
from wrcore.analysis.pictures import style as figures
from wrcore.analysis.pictures.plot_motion import lateral_position
from wrcore.analysis.pictures.style import LINES
from wrcore.scene.description import load_scene

POSE = {"y": 6.3e-3, "yaw": 0.015, "load": 1e4, "lowered": 4e-4}


@pytest.fixture(scope="module")
def scene():
    return load_scene(SCENES / "wheelset.yaml")


def runs(flange_at=2.5):
    return {name: hunting_run(name, flange_at=flange_at) for name in ("planar", "spatial")}


def luminance(color):
    """Relative luminance (WCAG 2) of a colour."""
    rgb = np.array(mpl.colors.to_rgb(color))
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4) @ [0.2126, 0.7152, 0.0722]


def all_figures(scene):
    return {
        "fig2": fig2_profiles(scene.wheel, scene.rail),
        "fig3": fig3_detection(scene, **POSE),
        "fig4": lateral_position({"free": runs(), "suspended": runs()}, {"free": 2.0}),
        "fig5": fig5_contact_points(runs(), scene.wheel, scene.rail, 2.0),
    }


def test_every_axis_names_its_unit(scene):
    for name, figure in all_figures(scene).items():
        for axes in figure.axes:
            labels = [axes.get_xlabel(), axes.get_ylabel()]
            inner = axes.get_subplotspec() is not None and (name == "fig4" or name == "fig5")
            labels = [label for label in labels if label or not inner]
            assert all(re.search(r" / (mm|s)$", label) for label in labels if label), (name, labels)
            assert any(labels) or name == "fig4", name


def test_fig4_draws_lateral_position_in_mm(scene):
    axes = lateral_position({"free": runs()}).axes[0]
    planar, spatial = axes.get_lines()
    assert np.array_equal(planar.get_ydata(), 1e3 * runs()["planar"]["wheelset"].y_m)
    assert planar.get_ydata()[0] == pytest.approx(2.0)
    assert planar.get_linestyle() != spatial.get_linestyle()


def test_fig4_marks_the_horizon_only_where_given():
    figure = lateral_position({"free": runs(), "suspended": runs()}, {"free": 2.0})
    free, suspended = figure.axes
    assert [line.get_xdata()[0] for line in free.get_lines()[2:]] == [2.0]
    assert len(suspended.get_lines()) == 2
    assert "prediction horizon" in [text.get_text() for text in figure.legends[0].get_texts()]


def test_fig5_puts_every_patch_on_its_profile(scene):
    twin = {"spatial_tight": hunting_run()}  # a case's other runs are left out
    figure = fig5_contact_points(runs(flange_at=2.5) | twin, scene.wheel, scene.rail)
    over_time, on_profile = figure.axes[4], figure.axes[5]
    run = runs(flange_at=2.5)["planar"]
    shown = over_time.collections[0].get_offsets()
    assert len(shown) == run.t.size + int(np.sum(run.t >= 2.5))
    assert shown[:, 1].min() == pytest.approx(-39.0)
    f, u = on_profile.collections[0].get_offsets().T
    assert np.allclose(f, 1e3 * scene.wheel(u / 1e3))


def test_planar_and_spatial_differ_in_grey_too():
    planar, spatial = (luminance(LINES[name]["color"]) for name in ("planar", "spatial"))
    # contrast as defined by WCAG 2; 2 and more are told apart side by side
    assert (spatial + 0.05) / (planar + 0.05) > 2.0


def test_fig2_tangent_and_normal_are_perpendicular_and_normal_points_out_of_the_body(scene):
    figure = fig2_profiles(scene.wheel, scene.rail)
    for axes, outward in zip(figure.axes, (1.0, -1.0), strict=True):
        t, n = (np.subtract(text.xyann, text.xy) for text in axes.texts if text.get_text() in ("t", "n"))
        assert t @ n == pytest.approx(0.0, abs=1e-9)
        assert outward * n[1] > 0


def test_fig3_contact_points_lie_on_their_loci(scene):
    plan = fig3_detection(scene, **POSE).axes[1]
    generator, strips = (np.column_stack(line.get_data()) for line in plan.get_lines())
    planar, spatial = (c.get_offsets()[0] for c in plan.collections if c.get_label().startswith("contact point"))
    for locus, point in ((generator, planar), (strips, spatial)):
        away = np.hypot(*(np.asarray(locus) - point).T)
        nearest = np.nanargmin(away)
        # the locus is drawn through lattice points: it passes a point on it within one step
        assert away[nearest] < np.hypot(*(locus[nearest + 1] - locus[nearest])) < 1.0
    # CONTACT, Manchester case at y = 6.5 mm, yaw 15.6 mrad: 16.9 mm ahead of the wheel's lowest point
    assert 15.0 < spatial[0] - planar[0] < 25.0


def test_fig3_refuses_a_pose_without_contact(scene):
    with pytest.raises(ValueError, match="no contact on the left side"):
        fig3_detection(scene, **{**POSE, "lowered": -0.02})


def test_fig1_shows_points_of_the_real_surfaces(scene):
    detail = fig1_parametrisation(scene, point=(0.015, 0.22, -0.012, 0.07)).axes[1]
    q, p = (np.ravel(c._offsets3d) for c in detail.collections if type(c).__name__ == "Path3DCollection")
    radius = 460 - 1e3 * float(scene.wheel(0.015))
    assert q == pytest.approx([-radius * np.sin(0.22), 765.0, 540 - radius * np.cos(0.22)])
    rail_distance = 1e3 * scene.track.rail_distance(scene.rail)
    assert p == pytest.approx([70.0, rail_distance - 12, 1e3 * float(scene.rail(-0.012))])


def test_files_are_reproducible_and_undated(tmp_path):
    for name in ("one", "two"):
        figure = lateral_position({"free": runs()}, {"free": 2.0})
        figures.save_figure(figure, tmp_path / name / "fig.png", tmp_path / name / "fig.svg")
    for ending in ("png", "svg"):
        one, two = (tmp_path / name / f"fig.{ending}" for name in ("one", "two"))
        assert one.read_bytes() == two.read_bytes()
    assert "dc:date" not in (tmp_path / "one" / "fig.svg").read_text()


def test_caller_settings_do_not_leak_in_or_out(tmp_path):
    figures.save_figure(lateral_position({"free": runs()}), tmp_path / "one.png")
    with mpl.rc_context({"font.size": 30, "axes.facecolor": "red"}):
        figures.save_figure(lateral_position({"free": runs()}), tmp_path / "two.png")
        assert mpl.rcParams["font.size"] == 30
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "two.png").read_bytes()
