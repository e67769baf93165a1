"""Plot of worn profiles over a distance, in mm and km."""

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from wrcore.analysis.pictures.style import MM, styled

KM = 1e-3
SHOWN = 6  # number of profiles drawn, evenly over the distance

FLANGE = (
    ("Sh_m", "k-", "flange height Sh"),
    ("Sd_m", "C0--", "flange thickness Sd"),
    ("qR_m", "C1-.", "flange slope qR"),
)


@styled
def plot_evolution(profiles, table):
    """Draw worn profiles, and flange, conicity and wear rate over the distance.

    ``profiles`` are results of `profiles_over_distance` (distance, u and f of each step, m), ``table`` that of
    `evolve`.
    """
    new = profiles[0][1:]
    figure = Figure(figsize=(7.2, 7.6), layout="constrained")
    (shape, depth), (flange, conicity), (rate, worn) = figure.subplots(3, 2)
    chosen = sorted({int(i) for i in np.linspace(0, len(profiles) - 1, SHOWN)})
    colours = mpl.colormaps["viridis"](np.linspace(0.0, 0.85, len(chosen)))
    for i, colour in zip(chosen, colours, strict=True):
        distance, u, f = profiles[i]
        label = f"{KM * distance:,.0f} km".replace(",", " ")
        shape.plot(MM * u, MM * f, color=colour, linewidth=0.9, label=label)
        depth.plot(MM * u, MM * (f - new[1]), color=colour)
    shape.set(xlabel="u / mm, to the field side", ylabel="ordinate / mm", title="(a) wheel profile")
    shape.set_aspect("equal", adjustable="datalim")
    shape.legend(fontsize=7, ncols=2, loc="upper center")
    depth.set(xlabel="u / mm, to the field side", ylabel="worn off / mm", title="(b) loss since new")
    worn_at = profiles[-1][1][profiles[-1][2] - new[1] > 0.0]
    if worn_at.size:
        depth.set_xlim(MM * worn_at.min() - 5.0, MM * worn_at.max() + 5.0)
    way = KM * table["distance_m"]
    for name, style, label in FLANGE:
        flange.plot(way, MM * (table[name] - table[name].iloc[0]), style, label=label)
    flange.set(ylabel="change / mm", title="(c) flange, EN 15313")
    flange.legend(fontsize=7)
    conicity.plot(way, table["equivalent_conicity"], "k-")
    conicity.set(ylabel="equivalent conicity / 1", title="(d) conicity at 3 mm", ylim=(0.0, None))
    steps = table[table["step_m"] > 0.0]
    rate.step(KM * steps["distance_m"], 1e12 * steps["volume_m3_per_m"], "k-", where="post")
    rate.set(ylabel="volume of a wheel / (mm³/km)", title="(e) wear rate", ylim=(0.0, None))
    worn.plot(way, MM * table["worn_m"], "k-")
    worn.set(ylabel="deepest loss / mm", title="(f) deepest place of (b)")
    for axes in (flange, conicity, rate, worn):
        axes.set_xlabel("distance / km")
    return figure
