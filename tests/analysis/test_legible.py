"""Texts of figures: what cannot be read is found, and every picture that a user can ask for is free of it."""

import copy
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.cbook import is_math_text
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from tests.synthetic import hunting_run
from wrcore.analysis.compare import compare
from wrcore.analysis.legible import findings, save_figure
from wrcore.analysis.pictures.plot_contact import plot_pair
from wrcore.analysis.pictures.plot_creep import plot_creep_force
from wrcore.analysis.pictures.plot_patch import plot_wheel_on_rail
from wrcore.analysis.pictures.plot_run import plot_run
from wrcore.analysis.wear.damage import plot_shakedown
from wrcore.contact.patch.result import Patch
from wrcore.contact.rigid.wheel_on_rail import WheelsetOnTrack
from wrcore.errors import InputError


def panel():
    figure = Figure(figsize=(4.0, 3.0), layout="constrained")
    axes = figure.subplots()
    axes.plot([0.0, 1.0], [0.0, 1.0], label="line")
    axes.set(xlabel="time / s", ylabel="force / kN", title="title")
    return figure, axes


def test_a_plain_figure_has_no_findings():
    figure, axes = panel()
    axes.legend(loc="upper left")
    axes.text(5.0, 0.5, "beyond the panel", clip_on=True)
    axes.annotate("beyond, too", (5.0, 0.5))
    axes.set_xlim(0.0, 1.0)
    assert findings(figure) == []


def cut(axes):
    axes.set_title("a title that is much too long for the width of this figure")


def overlapping(axes):
    axes.text(0.1, 0.8, "one text")
    axes.text(0.15, 0.8, "another")


def rotated(axes):
    axes.annotate("aside", (-0.12, 0.5), xycoords="axes fraction", rotation=90, annotation_clip=False)


def legend_on_line(axes):
    axes.plot([0.0, 1.0], [1.0, 0.0], label="falling")
    axes.legend(loc="center")


def legend_on_marks(axes):
    axes.scatter([0.8, 0.9], [0.1, 0.1], label="marks")
    axes.legend(loc="lower right")


def legend_on_bars(axes):
    axes.bar([0.9], [0.5], label="bars")
    axes.legend(loc="lower right")


def fixed_text_on_line(axes):
    axes.text(0.45, 0.45, "on the line", transform=axes.transAxes)


def without_numbers(axes):
    axes.set(yscale="log", ylim=(2.0, 8.0))
    axes.yaxis.set_minor_formatter(NullFormatter())


def twice(axes):
    axes.plot([0.9, 1.0], [0.0, 0.0], label="line")
    axes.legend(loc="upper left")


@pytest.mark.parametrize(
    ("fault", "found"),
    [
        (cut, "leaves the page"), (overlapping, "'one text' and 'another' overlap"),
        (rotated, "'aside' and 'force / kN' overlap"),
        (legend_on_line, "the legend covers the line 'falling'"), (legend_on_marks, "covers the marks 'marks'"),
        (legend_on_bars, "the legend covers the bar"), (fixed_text_on_line, "'on the line' covers the line 'line'"),
        (twice, "the legend says 'line' twice"), (without_numbers, "y axis of 'force / kN' has no numbers"),
    ],
)  # fmt: skip
def test_each_fault_is_found_and_said_when_saved(fault, found, tmp_path):
    figure, axes = panel()
    fault(axes)
    assert any(found in finding for finding in findings(figure)), findings(figure)
    with pytest.warns(UserWarning, match="^figure faulty.png: "):
        save_figure(figure, tmp_path / "faulty.png")


def test_gaps_of_a_line_cover_nothing():
    figure, axes = panel()
    axes.plot([0.0, 0.1, 0.5, 0.9, 1.0], [0.5, 0.5, np.nan, 0.5, 0.5], label="gap")
    axes.lines[0].remove()
    axes.legend(loc="center")
    assert findings(figure) == []


def coach(wheelsets):
    """A made-up run of a vehicle."""
    run = hunting_run(flange_at=2.0)
    for k in range(wheelsets):
        for part in ("", "/left", "/right"):
            run.groups[f"wheelset_{k + 1}{part}"] = copy.deepcopy(run.groups[f"wheelset{part}"])
    for part in ("", "/left", "/right"):
        del run.groups[f"wheelset{part}"]
    return run


@pytest.mark.parametrize("wheelsets", [1, 2, 4, 6])
def test_every_wheel_of_a_run_has_a_look_of_its_own(wheelsets):
    figure = plot_run(coach(wheelsets))
    for axes in figure.axes:
        named = [line for line in axes.lines if not line.get_label().startswith("_")]
        looks = {(line.get_color(), str(line._unscaled_dash_pattern)) for line in named}
        assert len(looks) == len(named) in (wheelsets, 2 * wheelsets)
    assert findings(figure) == []


def patch():
    x, s = (1e-3 * part.ravel() for part in np.meshgrid(np.linspace(-5, 5, 21), np.linspace(-4, 4, 17)))
    pressure = 1e9 * np.sqrt(np.maximum(1.0 - (x / 5e-3) ** 2 - (s / 4e-3) ** 2, 0.0))
    cell = np.full(x.shape, 5e-4)
    return Patch(x, s, cell, cell, pressure, -0.2 * pressure, 0.1 * pressure, x, s, x > 0.0, 5e4, -1e4, 5e3, 1.0,
                 1e-3, 0.0, 0.5, 0.03, (0.0, 0.0, 0.0), 0.3)  # fmt: skip


@pytest.mark.parametrize(
    "draw",
    [
        lambda: plot_run(hunting_run()), lambda: plot_run(coach(4), ["wheelset_1.yaw_rad", "wheelset_2/left.N_N"]),
        lambda: patch().plot(), lambda: plot_creep_force(("linear", "polach", "she", "fastsim")),
        lambda: plot_shakedown(hunting_run()),
    ],
)  # fmt: skip
def test_pictures_for_users_have_no_findings(draw):
    figure = draw()
    assert findings(figure) == []
    plt.close("all")


def test_pressure_of_a_wheel_on_its_rail_stands_on_the_contact_line(s1002, uic60):
    pair = WheelsetOnTrack.alike(s1002, uic60)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        figure = plot_wheel_on_rail(pair, side, y=sign * 0.003, load=5e4)
        assert findings(figure) == []
        section = figure.axes[0]
        wheel, rail = (line.get_xydata() for line in section.lines)
        (hill,) = [part.get_xy() for part in section.patches if (part.get_label() or "").startswith("pressure")]
        half = len(hill) // 2
        foot, crest = hill[:half], hill[half : 2 * half][::-1]
        for body in (wheel, rail):  # within the penetration of both profiles, along the whole patch
            order = np.argsort(body[:, 0])
            assert np.abs(np.interp(foot[:, 0], *body[order].T) - foot[:, 1]).max() < 0.15
        height = np.linalg.norm(crest - foot, axis=1)
        assert height.max() == pytest.approx(12.0, rel=0.2) and height[0] == height[-1] == 0.0
    with pytest.raises(InputError, match="a pose in which the wheel touches"):
        plot_wheel_on_rail(pair, z=0.48, load=5e4)


@pytest.mark.parametrize("name", ["$\\nothing$", "5 $ and 6 $", "$x"])
def test_dollar_signs_in_names_are_printed_as_they_are(name, s1002, uic60, tmp_path):
    run = hunting_run()
    run.scene["name"] = name
    pair = WheelsetOnTrack.alike(replace(s1002, name=name), uic60)
    for k, figure in enumerate((plot_run(run), compare(run, run).plot(), plot_pair(pair))):
        figure.savefig(tmp_path / f"{k}.png")
        title = figure.get_suptitle() or figure.axes[0].get_title()
        assert not is_math_text(title) and name in title.replace("\\$", "$")
