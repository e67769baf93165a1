"""Figures of the theory pages, from plain NumPy equations (`wrcore.reference`): nothing is compiled for them."""

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from wrcore.analysis.pictures.style import ACCENT, MM, RAIL, WHEEL, save_figure, styled
from wrcore.creep.kalker import kalker_data
from wrcore.geometry.profiles.standards import named_profile
from wrcore.geometry.track import Track
from wrcore.reference.contact import Pair, cut_strips, patch_of_moments
from wrcore.reference.forces import damping_factor, linear, shen_hedrick_elkins

EXAMPLES = Path(__file__).resolve().parent.parent / "tests/data/creep/contact_examples.csv"
SIZE = (5.6, 2.6)
RADIUS, HALF_DISTANCE, STEP = 0.46, 0.75, 5e-5
LOWERED = 0.225e-3


def draw_figures(folder):
    """Write all figures as PNG into a folder."""
    for draw in (profiles, overlap, damping, traction, transitions):
        save_figure(draw(), folder / f"{draw.__name__}.png")


def _benchmark():
    wheel, rail = named_profile("S1002", "wheel"), named_profile("UIC60-MBench", "rail", 1 / 40)
    return Pair(wheel, rail, RADIUS, HALF_DISTANCE, Track(1.435).rail_distance(rail))


def _axes(x, y):
    figure = Figure(figsize=SIZE, layout="constrained")
    axes = figure.subplots()
    axes.set(xlabel=x, ylabel=y)
    return figure, axes


@styled
def profiles():
    """S1002 on UIC60 1:40, centred, as they lie in the track: left side seen from behind."""
    pair = _benchmark()
    figure, axes = _axes("y / mm", "z / mm")
    u = pair.wheel.u
    axes.plot(MM * (HALF_DISTANCE + u), MM * (pair.wheel(u) - 0.18e-3), color=WHEEL, label="wheel S1002")
    axes.plot(
        MM * (pair.rail_distance + pair.rail.u), MM * pair.rail(pair.rail.u), color=RAIL, label="rail UIC60, 1:40"
    )
    axes.axvline(MM * HALF_DISTANCE, color="0.8", linestyle=":")
    axes.annotate("tape circle", (MM * HALF_DISTANCE, -32), xytext=(4, 0), textcoords="offset points")
    axes.set(ylim=(-36, 12), aspect="equal")
    axes.legend(loc="lower right")
    return figure


@styled
def overlap():
    """Overlap of S1002 and UIC60 of a centred wheelset, and the parabola with the same moments of g squared."""
    pair = _benchmark()
    centre, axle = np.array([0.0, 0.0, RADIUS - LOWERED]), np.array([0.0, 1.0, 0.0])
    u = np.arange(-0.014, 0.018, STEP)
    strips = cut_strips(pair, 1.0, centre, axle, u, True)
    nodes = strips.gap < 0.0
    place = (pair, 1.0, centre, axle, True)
    patch = patch_of_moments(place, u[nodes], strips.gap[nodes], STEP)
    m0 = np.sum(strips.gap[nodes] ** 2)
    middle = np.sum(strips.gap[nodes] ** 2 * u[nodes]) / m0
    parabola = patch.curvature_y * (u - middle) ** 2 - patch.penetration
    figure, axes = _axes("u / mm", "gap / µm")
    axes.axhline(0.0, color="0.7")
    axes.plot(MM * u, 1e6 * strips.gap, color=WHEEL, label="gap of the profiles")
    axes.plot(MM * u, 1e6 * parabola, color=ACCENT, linestyle="--", label="parabola of the reduction moment")
    axes.set(ylim=(-60, 60))
    axes.legend(loc="upper center")
    return figure


@styled
def damping():
    """Damping factor of Eq. (7)."""
    figure, axes = _axes("rate of penetration / (m/s)", "damping factor")
    speed = np.linspace(-0.1, 0.1, 201)
    for c_e, style in ((0.8, "-"), (0.5, "--")):
        values = [damping_factor(v, c_e, 0.05) for v in speed]
        axes.plot(speed, values, color=WHEEL, linestyle=style, label=f"c_e = {c_e}, v_0 = 0.05 m/s")
    axes.legend(loc="lower right")
    return figure


@styled
def traction():
    """Traction curve of CONTACT's example tractcurv, and two of the laws."""
    rows = pd.read_csv(EXAMPLES, comment="#").query("example == 'tractcurv' and xi < 0.007")
    c_2 = rows.a_m.iloc[0] * rows.b_m.iloc[0]
    xi = np.linspace(0.0, 0.006, 121)
    scaled = xi * 8.2e10 * c_2 / (rows.mu.iloc[0] * rows.N_N.iloc[0])
    kalker, log_g = kalker_data(0.28), np.log(rows.a_m.iloc[0] / rows.b_m.iloc[0])
    figure, axes = _axes("longitudinal creepage / %", "-Fx / (μN)")
    for law, name, style in ((linear, "linear", ":"), (shen_hedrick_elkins, "she", "--")):
        force = [-law(kalker, log_g, np.array([value, 0.0, 0.0]))[0] for value in scaled]
        axes.plot(100 * xi, force, color=WHEEL, linestyle=style, label=name)
    axes.plot(100 * rows.xi, -rows.Fx_over_muN, color=ACCENT, marker="o", linestyle="", label="CONTACT")
    axes.plot(100 * rows.xi, -rows.fastsim_Fx_over_muN, color=RAIL, marker="x", linestyle="", label="CONTACT's FASTSIM")
    axes.set(ylim=(0.0, 1.25))
    axes.legend(loc="lower right")
    return figure


@styled
def transitions():
    """Shapes of transitions."""
    figure, axes = _axes("arc length over that of the transition", "share of the change")
    u = np.linspace(0.0, 1.0, 101)
    shapes = {
        "linear": (u, "-"),
        "bloss": (u**2 * (3.0 - 2.0 * u), "--"),
        "cosine": (0.5 - 0.5 * np.cos(np.pi * u), ":"),
    }
    for name, (values, style) in shapes.items():
        axes.plot(u, values, color=WHEEL, linestyle=style, label=name)
    axes.legend(loc="upper left")
    return figure
