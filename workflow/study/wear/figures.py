"""Figures of worn wheel profiles. Units change here: m to mm and km."""

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from wrcore.analysis.style import MM, styled

KM = 1e-3
SHOWN = 6
"""Profiles drawn, evenly over the distance."""

LOOKS = ("k-", "C0--", "C1-.", "C2:", "C3--", "C4-.", "C5:", "C6-", "C7--")


@styled
def fig_evolution(new, profiles, table):
    """Worn profiles, and flange, conicity and wear rate over the distance.

    Parameters
    ----------
    new : tuple of numpy.ndarray
        u and f of the new profile, m.
    profiles : sequence of tuple
        Distance (m), u and f (m) at the start of each step.
    table : pandas.DataFrame
        From `wrcore.analysis.evolve.evolve`.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = Figure(figsize=(6.8, 7.6), layout="constrained")
    (shape, depth), (flange, conicity), (rate, worn) = figure.subplots(3, 2)
    chosen = sorted({int(i) for i in np.linspace(0, len(profiles) - 1, SHOWN)})
    colours = mpl.colormaps["viridis"](np.linspace(0.0, 0.85, len(chosen)))
    for i, colour in zip(chosen, colours, strict=True):
        distance, u, f = profiles[i]
        label = f"{KM * distance:,.0f} km".replace(",", " ")
        shape.plot(MM * u, MM * f, color=colour, linewidth=0.9)
        depth.plot(MM * u, MM * (f - new[1]), color=colour, label=label)
    shape.set(xlabel="u / mm, to the field side", ylabel="ordinate / mm", title="(a) wheel profile", aspect="equal")
    depth.set(xlabel="u / mm, to the field side", ylabel="worn off / mm", title="(b) loss of the ordinate")
    worn_at = profiles[-1][1][profiles[-1][2] - new[1] > 0.0]
    if worn_at.size:
        depth.set_xlim(MM * worn_at.min() - 5.0, MM * worn_at.max() + 5.0)
    depth.legend(fontsize=6, loc="upper center")
    way = KM * table["distance_m"]
    for name, style in (("Sh_m", "k-"), ("Sd_m", "C0--"), ("qR_m", "C1-.")):
        flange.plot(way, MM * (table[name] - table[name].iloc[0]), style, label=name.removesuffix("_m"))
    flange.set(ylabel="change / mm", title="(c) flange height, thickness, slope")
    flange.legend()
    conicity.plot(way, table["equivalent_conicity"], "k-")
    conicity.set(ylabel="equivalent conicity (3 mm)", title="(d) conicity", ylim=(0.0, None))
    steps = table[table["step_m"] > 0.0]
    rate.step(KM * steps["distance_m"], 1e12 * steps["volume_m3_per_m"], "k-", where="post")
    rate.set(ylabel="volume / (mm³/km) a wheel", title="(e) wear rate", ylim=(0.0, None))
    worn.plot(way, MM * table["worn_m"], "k-")
    worn.set(ylabel="deepest loss / mm", title="(f) deepest place")
    for axes in (flange, conicity, rate, worn):
        axes.set_xlabel("distance / km")
    return figure


@styled
def fig_influences(found, distance):
    """Depth over the profile for each setting and model.

    Parameters
    ----------
    found : dict of str to tuple
        u and depth (m) by name.
    distance : float
        m.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = Figure(figsize=(6.8, 4.6), layout="constrained")
    axes = figure.subplots()
    for (name, (u, depth)), look in zip(found.items(), LOOKS * (1 + len(found) // len(LOOKS)), strict=False):
        axes.plot(MM * u, MM * depth, look, label=name, linewidth=1.0)
    axes.set(xlabel="u / mm, to the field side", ylabel="worn off / mm", title=f"after {KM * distance:.0f} km")
    axes.legend(fontsize=7, ncols=2, loc="upper center", bbox_to_anchor=(0.5, -0.14))
    return figure
