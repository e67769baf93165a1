"""Figures of the patch models: their errors over the lateral position, and the patch itself.

Units change here and nowhere before: m to mm, Pa to MPa.
"""

import math

import numpy as np
from matplotlib.figure import Figure

from study.patch.tables import REFERENCE, radius_differences
from wrcore.analysis.contact.loaded import LoadedWheels, Rolling
from wrcore.analysis.contact.rolling_field import solve_patch
from wrcore.analysis.pictures.style import MM, shared_legend, styled
from wrcore.contact.patch.result import Patch
from wrcore.contact.rolling.library import ellipse_strips, make_library
from wrcore.contact.search import reduction as columns

LINES = (
    {"color": "#CC79A7", "linestyle": "-", "linewidth": 0.8},
    {"color": "#009E73", "linestyle": (0, (4, 2))},
    {"color": "#56B4E9", "linestyle": (0, (1, 1)), "linewidth": 1.8},
    {"color": "#0072B2", "linestyle": (0, (6, 1, 1, 1)), "linewidth": 1.0},
    {"color": "0.55", "linestyle": (0, (3, 3)), "linewidth": 0.8},
)
"""Okabe-Ito colours, each with its own line: told apart in grey too. Exact contact at its finest is black and full."""

SURE = {"color": "k", "linewidth": 1.6, "zorder": 1}

PANELS = 16
"""Strips on the ellipse that is drawn."""


@styled
def fig_patch_errors(places, load):
    """Errors of normal force and greatest pressure, slope of the radius difference over y (`pose_errors`; load in
    N).
    """
    places = places[np.isclose(places["load_N"], load)]
    slopes = radius_differences(places)
    figure = Figure(figsize=(6.6, 7.2), layout="constrained")
    force, pressure, slope = figure.subplots(3, 1)
    styles = dict(zip([name for name in places["model"].unique() if name != REFERENCE], LINES, strict=False))
    for name, style in {REFERENCE: SURE, **styles}.items():
        part, over = places[places["model"] == name], slopes[slopes["model"] == name]
        force.plot(MM * part["y_m"], 100.0 * part["normal_relative"], label=name, **style)
        pressure.plot(MM * part["y_m"], 100.0 * part["p_max_relative"], **style)
        slope.plot(MM * over["y_m"], over["slope"], **style)
    force.set(ylabel="normal force at equal\nheight, error / %", title="(a) left wheel")
    pressure.set(ylabel="greatest pressure under\nequal load, error / %", title="(b) left wheel")
    slope.set(ylabel="rolling radius difference\nover 2y", yscale="log", title="(c) wheelset", xlim=(0.0, None))
    ticks = (0.15, 0.2, 0.3, 0.5, 1.0)
    slope.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    slope.minorticks_off()
    for axes in (pressure, slope):
        axes.set_xlabel("lateral position y, to the left / mm")
    shared_legend(figure, [force], fontsize=7, ncols=4)
    return figure


@styled
def fig_patches(geometry, models, load, shifts, rolling):
    """Pressure, traction and slip of exact contact beside the ellipse of another model (title and arguments of
    `LoadedWheels` of both), for the left wheel under a load (N), a row per lateral shift (m);
    ``rolling`` is speed (m/s), friction, and creepage (longitudinal, lateral) of a wheel that otherwise rolls freely.
    """
    figure = Figure(figsize=(9.0, 4.6 * len(shifts)), layout="constrained")
    panels = figure.subplots(len(shifts), 2, squeeze=False)
    for row, y in zip(panels, shifts, strict=True):
        drawn = patches_of_models(geometry, list(models.values()), load, y, rolling)
        top = max(patch.p_max for patches in drawn for patch in patches)
        ends = np.array([patch.extent for patches in drawn for patch in patches])
        for axes, title, (patch, *_) in zip(row, models, drawn, strict=True):
            patch.plot(axes)
            for shades in axes.collections[:1]:
                shades.set_clim(0.0, 1e-6 * top)
            axes.set(xlim=(MM * ends[:, 0].min() - 1, MM * ends[:, 1].max() + 1))
            axes.set(ylim=(MM * ends[:, 2].min() - 1, MM * ends[:, 3].max() + 1))
            axes.set_title(f"y = {MM * y:g} mm, {title}\n{axes.get_title()}", fontsize=8)
    return figure


def patches_of_models(geometry, models, load, y, rolling):
    """Patches, the most loaded in front, of exact contact and of an ellipse under the same load and in the same motion,
    about the same origin; arguments as for `fig_patches`.
    """
    exact, ellipse = (LoadedWheels(geometry, **settings) for settings in models)
    speed, (xi, eta) = rolling["speed"], rolling["creepage"]
    roll, z = exact.settled(y, load)
    free = Rolling(speed, speed / geometry.rolling_radius)
    rows = [one.row for one in exact.at_height("left", y, z, roll, 0.0, free)]
    slip = sum(r[columns.NORMAL] * r[columns.XI] for r in rows) / sum(r[columns.NORMAL] for r in rows)
    motion = Rolling(speed, (1.0 - xi) / (1.0 - slip) * free.rate, eta * speed)
    how = (roll, 0.0, motion, rolling["friction"])
    sure = [one.patch for one in exact.at_height("left", y, z, *how, fields=True)]
    sure.sort(key=lambda patch: -patch.normal)
    rough = ellipse.at_height("left", y, ellipse.height("left", y, load, roll), *how)
    drawn = [ellipse_patch(one.row, sure[0].origin, rolling["friction"]) for one in rough]
    return [sure, sorted(drawn, key=lambda patch: -patch.normal)]


def ellipse_patch(row, origin, friction, shear_modulus=8.2e10, poisson_ratio=0.28):
    """A Hertz ellipse (``row`` of a patch, with creepages at its centre) with the tractions of exact rolling contact on
    it, as a `Patch`; coordinates refer to ``origin`` (m), the ellipse is drawn where it lies beside it.
    """
    a, b, normal = row[columns.SEMI_A], row[columns.SEMI_B], row[columns.NORMAL]
    xi, eta, phi = map(float, row[columns.XI : columns.PHI + 1])
    strips = [np.asarray(part) for part in ellipse_strips(a, b, PANELS)]
    strips[4] = strips[4] * normal / np.sum(0.5 * math.pi * strips[4] * strips[2] * strips[1])
    centre, width, half, middle, _ = strips
    slip = xi - phi * centre, 0.0 * centre, eta + phi * middle, 0.0 * centre + phi
    field = solve_patch(strips, slip, shear_modulus, friction, "fine", poisson_ratio)
    edges = middle[:, None] + half[:, None] * make_library("fine", poisson_ratio).panels.edges
    like, angle = np.ones(edges[:, 1:].shape), row[columns.ANGLE]
    x = row[columns.X] - origin[0]
    s = (row[columns.Y] - origin[1]) * math.cos(angle) + (row[columns.Z] - origin[2]) * math.sin(angle)
    cells = (
        0.5 * (edges[:, 1:] + edges[:, :-1]) + x, like * centre[:, None] + s, edges[:, :-1] - edges[:, 1:],
        like * width[:, None], field.pressure, field.traction_x, field.traction_s,
        np.where(field.slides, field.slip_x, 0.0), np.where(field.slides, field.slip_s, 0.0), ~field.slides,
    )  # fmt: skip
    p_max = 1.5 * normal / (math.pi * a * b)
    return Patch(
        *(cell.ravel() for cell in cells), float(normal), field.Fx, field.Fs, field.Mn, xi, eta, phi, float(angle),
        tuple(origin), friction, "left", p_max, (x - a, x + a, s - b, s + b),
    )  # fmt: skip
