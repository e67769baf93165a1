"""Figures of the influence of settings and models on worn wheel profiles. Lengths are converted to mm and km here."""

from matplotlib.figure import Figure

from wrcore.analysis.pictures.style import MM, styled

KM = 1e-3
LOOKS = ("k-", "C0--", "C1-.", "C2:", "C3--", "C4-.", "C5:", "C6-", "C7--")


@styled
def fig_influences(found, distance):
    """Draw the wear depth over the profile (u and depth, m, by name) for each setting and model at a distance (m)."""
    figure = Figure(figsize=(6.8, 4.6), layout="constrained")
    axes, worn = figure.subplots(), []
    for (name, (u, depth)), look in zip(found.items(), LOOKS * (1 + len(found) // len(LOOKS)), strict=False):
        axes.plot(MM * u, MM * depth, look, label=name, linewidth=1.0)
        worn.extend(MM * u[depth > 0.005 * depth.max()])
    axes.set(xlabel="u / mm, to the field side", ylabel="worn off / mm", title=f"after {KM * distance:.0f} km")
    axes.set_xlim(min(worn) - 3.0, max(worn) + 3.0)
    figure.legend(fontsize=7, ncols=2, loc="outside lower center")
    return figure
