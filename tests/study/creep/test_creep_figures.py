"""Figures of the creep laws: the numbers behind lines, panels and meshes."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_rgb

from study.creep import figures as figures_creep
from study.creep.figures import binned_errors, stick_border
from study.creep.laws import contact_points
from tests.conftest import ROOT
from wrcore.analysis.legible import save_figure
from wrcore.analysis.pictures import plot_creep
from wrcore.analysis.pictures.plot_creep import LAW_STYLES
from wrcore.contact.rolling.ellipse import RollingContact

DATA = ROOT / "tests" / "data" / "creep"
FAMILIES = ("exact", "table sdec", "fastsim", "polach", "she", "linear")


@pytest.fixture(scope="module")
def curves():
    """Made-up curves: family number i gives -(i + 1) times the creepage that varies."""
    x, parts = np.linspace(0, 0.1, 5), []
    for line, along in (("longitudinal", "xi"), ("lateral", "eta"), ("spin", "phi"), ("combined", "eta")):
        for i, family in enumerate(FAMILIES):
            part = pd.DataFrame({"line": line, "family": family, "xi": 0.0, "eta": 0.0, "phi": 0.6, along: x})
            parts.append(part.assign(fx=-(i + 1) * x, fy=-(i + 2) * x, mz=-(i + 3) * x))
    return pd.concat(parts)


@pytest.fixture(scope="module")
def fields():
    return {
        "round": RollingContact(1.0, 0.0, 0.28, 16).field(0.25, 0.15, 0.0),
        "skewed": RollingContact(0.6, 0.6, 0.28, 16).field(0.15, 0.1, 0.6),
    }


def drawn(axes, label):
    found = [line for line in axes.get_lines() if line.get_label() == label]
    assert len(found) == 1, label
    return found[0].get_xydata()


def test_laws_are_told_apart_without_colour():
    lines = [str(style["linestyle"]) for style in LAW_STYLES.values()]
    markers = [style["marker"] for style in LAW_STYLES.values()]
    colours = [to_rgb(style["color"]) for style in LAW_STYLES.values()]
    assert len(set(lines)) == len(set(markers)) == len(set(colours)) == len(LAW_STYLES)


def test_curves_are_those_of_the_table(curves):
    axes = plot_creep.fig_creep_curves(curves).axes
    for panel, line, along, force, factor in (
        (axes[0], "longitudinal", "xi", "fx", 1),
        (axes[2], "spin", "phi", "fy", 2),
        (axes[5], "spin", "phi", "mz", 3),
    ):
        for i, family in enumerate(FAMILIES):
            xy = drawn(panel, LAW_STYLES[family]["label"])
            assert xy == pytest.approx(
                np.stack([np.linspace(0, 0.1, 5), -(i + factor) * np.linspace(0, 0.1, 5)], axis=1)
            )
        assert panel.get_xlabel() == plot_creep.SYMBOLS[along] and panel.get_ylabel() == plot_creep.SYMBOLS[force]
        assert line in set(curves.line)
    assert any("0.6" in text.get_text() for text in axes[3].texts)


def test_panels_carry_the_force_that_they_show(fields):
    """Area times traction, summed over the drawn panels, is the resultant; colours are the traction's size."""
    for field in fields.values():
        outlines = figures_creep._outlines(field)
        area = np.ptp(outlines[:, :, 0], axis=1) * np.ptp(outlines[:, :, 1], axis=1)
        assert [area @ field.px, area @ field.py] == pytest.approx([field.fx, field.fy], abs=1e-5)
        assert (abs(outlines.mean(axis=1) - np.stack([field.x, field.y], axis=1)) < 0.1).all()
    axes = figures_creep.fig_creep_traction(fields).axes[0]
    size = np.hypot(fields["round"].px, fields["round"].py)
    assert np.asarray(axes.collections[0].get_array()) == pytest.approx(size)
    assert "/ 1" in axes.get_xlabel() and "/ 1" in axes.get_ylabel()


def test_border_encloses_the_sticking_panels(fields):
    """Between the border's crossings of a strip lies the length that sticks there; across, the strips' differences."""
    for field in fields.values():
        segments = stick_border(field).reshape(-1, 3, 2)[:, :2]
        upright = segments[segments[:, 0, 0] == segments[:, 1, 0]]
        stick = field.stick.reshape(len(field.x_edges), -1)
        assert field.stick.any()
        for j, low in enumerate(field.y_edges[:-1]):
            x = np.sort(upright[np.isclose(upright[:, :, 1].min(axis=1), low), 0, 0])
            assert (x[1::2] - x[::2]).sum() == pytest.approx(-np.diff(field.x_edges[j])[stick[j]].sum(), abs=1e-9)
        flat = segments[segments[:, 0, 0] != segments[:, 1, 0]]
        assert len(flat) > 0 and np.isin(flat[:, 0, 1], field.y_edges).all()
    everywhere = RollingContact(1.0, 0.0, 0.28, 8).field(5.0, 0.0, 0.0)
    assert len(stick_border(everywhere)) == 0


def laws():
    rows = [("ellipse", "CONTACT", "exact, level 8", "exact", 0.0137, 33.0, 580.0)]
    rows += [("ellipse", "CONTACT", "ellipse_fine", "table ellipse", 0.003, 0.2, np.nan)]
    rows += [("ellipse", "CONTACT", "Polach", "polach", 0.21, 0.08, np.nan)]
    rows += [
        ("ellipse", "exact", "Polach", "polach", 0.3, 0.08, np.nan),
        ("sdec", "CONTACT", "Polach", "polach", 0.4, 0.08, 1),
    ]
    names = ["cases", "against", "model", "family", "force_q95", "us_per_case", "us_from_nothing"]
    return pd.DataFrame(rows, columns=names)


def test_cost_chart_has_our_points_and_contacts():
    axes = figures_creep.fig_creep_cost(laws(), contact_points(DATA)).axes[0]
    assert drawn(axes, "Polach") == pytest.approx(np.array([[21.0, 0.08]]))  # per cent, against CONTACT on ellipses
    assert drawn(axes, "exact, operator ready") == pytest.approx(np.array([[1.37, 33.0]]))
    assert drawn(axes, "exact, one case with its operator") == pytest.approx(np.array([[1.37, 580.0]]))
    contact = drawn(axes, "CONTACT, measured elsewhere on another machine")
    assert contact[2] == pytest.approx([1.363, 22307.9])  # contact_timing.csv, 30 x 30 elements
    assert axes.get_xscale() == axes.get_yscale() == "log"
    assert axes.get_xlabel().endswith("/ %") and axes.get_ylabel().endswith("/ µs")


@pytest.fixture(scope="module")
def errors():
    """Errors that are known functions of the cell: force a/b, moment psi."""
    rng = np.random.default_rng(1)
    g, psi = np.repeat(np.geomspace(0.05, 20, 40), 50), np.tile(np.linspace(0, 0.9, 50), 40)
    size, beta = np.exp(rng.uniform(-4, 4, 2000)), rng.uniform(0, 1.5, 2000)
    return pd.DataFrame(
        {"a_over_b": g, "psi": psi, "size": size, "beta": beta, "force_error": g / 1e3, "moment_error": psi / 1e3}
    )


def test_cells_hold_the_quantile_of_their_cases(errors):
    edges, size_edges, quantile = binned_errors(errors, "size", "force_error")
    assert quantile.shape == (14, 10) and np.isfinite(quantile).all()
    inside = errors.a_over_b.between(edges[3], edges[4]) & errors["size"].between(size_edges[5], size_edges[6])
    assert quantile[3, 5] == pytest.approx(errors[inside].force_error.quantile(0.95))
    assert edges[[0, -1]] == pytest.approx([0.05, 20])


def test_map_shows_per_cent_over_all_inputs(errors):
    panels = figures_creep.fig_creep_error_map(errors, "made").axes[:6]
    shown = panels[1].collections[0].get_array()
    assert np.asarray(shown).ravel() == pytest.approx(100 * binned_errors(errors, "beta", "force_error")[2].ravel())
    assert [axes.get_xlabel().split()[0] for axes in panels[:3]] == ["size", "spin", "shape"]
    flat = figures_creep.fig_creep_error_map(errors.assign(psi=0.0), "made")
    assert len(flat.axes) == 4 + 1  # no shape in a table of ellipses; colour bar


def test_smoothness_draws_table_and_exact_and_says_how_much_the_pole_shows():
    x = np.linspace(-1, 1, 21)
    parts = [
        pd.DataFrame(
            {"x": x, "fx": i + x, "fy": x, "mz": x, "dfx": i, "dfy": x, "dmz": x, "line": line, "source": source}
        )
        for i, line in enumerate(figures_creep.SMOOTH_PANELS)
        for source in ("table", "exact")
    ]
    table = pd.DataFrame({"line": "axis", "source": ["table", "exact"], "output": "fx", "variation": [0.047, 0.009]})
    axes = figures_creep.fig_creep_smoothness(pd.concat(parts), table).axes
    assert "4.7 %" in axes[6].get_title() and "0.9 %" in axes[6].get_title()
    dots, line = axes[3].get_lines()[:2]
    assert dots.get_ydata() == pytest.approx(3 + x) and line.get_ydata() == pytest.approx(3 + x)
    assert axes[1].get_lines()[1].get_ydata() == pytest.approx(x)  # less its mean
    assert axes[4].get_ylabel().startswith("slope")


def test_files_are_reproducible(curves, fields, tmp_path):
    for draw, data in ((plot_creep.fig_creep_curves, curves), (figures_creep.fig_creep_traction, fields)):
        for name in ("a.svg", "b.svg"):
            save_figure(draw(data), tmp_path / name)
        assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
