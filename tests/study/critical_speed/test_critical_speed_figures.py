"""Figures of stability show what is in their tables, in the units of their labels."""

import numpy as np
import pandas as pd
import pytest

from study.critical_speed.figures import fig_limit_cycles, fig_root_locus
from study.critical_speed.tables import loci
from tests.conftest import ELLIPTIC
from wrcore.analysis.legible import save_figure
from wrcore.analysis.pictures.plot_response import fig_modes
from wrcore.analysis.pictures.style import ACCENT
from wrcore.analysis.stability.stability import critical_speeds, modes
from wrcore.scene.description import load_scene


@pytest.fixture(scope="module")
def over_speed():
    source = ELLIPTIC / "suspended_wheelset.yaml"
    scenes = {name: load_scene(source, [f"contact.detection={name}"]) for name in ("planar", "spatial")}
    return loci(scenes, [20.0, 50.0, 80.0]), critical_speeds(scenes, [20.0, 50.0, 80.0])


def points(axes, label):
    """Points of a scatter plot by its label, shape (n, 2)."""
    found = [part for part in axes.collections if part.get_label() == label]
    return np.asarray(found[0].get_offsets())


def vertical(axes):
    """Place of the marked speed."""
    lines = [line for line in axes.lines if line.get_color() == ACCENT]
    return lines[0].get_xdata()[0]


def test_root_locus_shows_hunting_of_both_detections(over_speed, tmp_path):
    locus, linear = over_speed
    figure = fig_root_locus({"wheelset": locus}, {"wheelset": linear})
    damping, frequency = figure.axes
    for detection in ("planar", "spatial"):
        rows = locus[(locus["name"] == "wheelset hunting") & (locus["detection"] == detection)]
        np.testing.assert_allclose(points(damping, f"hunting, {detection}"), rows[["speed_m_per_s", "damping_ratio"]])
        np.testing.assert_allclose(points(frequency, f"hunting, {detection}"), rows[["speed_m_per_s", "frequency_Hz"]])
    assert frequency.get_ylabel() == "frequency / Hz"
    assert frequency.get_xlabel() == "speed / (m/s)"
    critical = linear["critical_speed_m_per_s"][1]
    assert vertical(damping) == pytest.approx(critical)
    assert f"{critical:.1f} m/s" in frequency.get_title(loc="right")
    save_figure(figure, tmp_path / "a.png", tmp_path / "a.svg")
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_modes_are_labelled_and_their_energies_written_in_per_cent():
    table, _ = modes(load_scene(ELLIPTIC / "suspended_wheelset.yaml"), 50.0)
    figure = fig_modes(table, "suspended wheelset")
    axes = figure.axes[0]
    labels = [label.get_text() for label in axes.get_yticklabels()]
    hunting = table[table["name"] == "wheelset hunting"].iloc[0]
    row = next(k for k, label in enumerate(labels) if label.startswith("wheelset hunting"))
    assert f"{hunting['frequency_Hz']:.2f} Hz" in labels[row]
    columns = [label.get_text() for label in axes.get_xticklabels()]
    cell = (columns.index("wheelset y"), row)
    text = next(text for text in axes.texts if text.get_position() == cell)
    assert text.get_text() == f"{100 * hunting['wheelset y']:.0f}"


def test_limit_cycles_show_both_branches_in_mm(over_speed):
    rows = [
        ("planar", "falling", 60.0, 6e-3, "limit cycle"), ("planar", "falling", 50.0, 5e-3, "limit cycle"),
        ("planar", "falling", 55.0, 9e-3, "irregular"), ("planar", "rising", 50.0, 0.0, "at rest"),
        ("spatial", "falling", 60.0, 6.1e-3, "limit cycle"), ("spatial", "rising", 60.0, 2e-3, "growing"),
        ("spatial", "rising", 70.0, np.nan, "derailed"),
    ]  # fmt: skip
    table = pd.DataFrame(rows, columns=["detection", "branch", "speed_m_per_s", "amplitude_m", "status"])
    figure = fig_limit_cycles({"wheelset": table}, {"wheelset": over_speed[1]})
    (axes,) = figure.axes
    lines = {line.get_label(): line for line in axes.lines}
    np.testing.assert_allclose(lines["falling speed, planar"].get_xdata(), [50.0, 55.0, 60.0])
    np.testing.assert_allclose(lines["falling speed, planar"].get_ydata(), [5.0, np.nan, 6.0])  # a gap, no bridge
    stars = [line for line in axes.lines if line.get_marker() == "*" and len(line.get_xdata())]
    assert [(*line.get_xdata(), *line.get_ydata(), line.get_linestyle()) for line in stars] == [(55.0, 9.0, "None")]
    assert lines["rising speed, spatial"].get_markerfacecolor() == "white"
    assert [line.get_xdata()[0] for line in axes.lines if line.get_marker() == "x" and len(line.get_xdata())] == [70.0]
    assert axes.get_ylabel() == "amplitude of y / mm"
    assert vertical(axes) == pytest.approx(over_speed[1]["critical_speed_m_per_s"][1])
