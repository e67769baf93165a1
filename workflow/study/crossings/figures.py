"""Figure of a wheel on the nose of a crossing. It converts SI units: m to mm, Pa to GPa."""

from matplotlib.figure import Figure

from wrcore.analysis.pictures.style import MM, shared_legend, styled

LOOKS = ("k-", "C0--", "C1-.", "C2:", "C3--")
GPA = 1e-9


@styled
def fig_nose(table):
    """Plot height of the wheelset, load on the nose and maximum pressure over position, from `nose.over_the_nose`."""
    figure = Figure(figsize=(6.8, 6.4), layout="constrained")
    panels = figure.subplots(3, sharex=True)
    for (name, part), look in zip(table.groupby("model", sort=False), LOOKS, strict=False):
        rows = MM * (part.z_m - table.z_m.iloc[0]), part.share_of_nose, GPA * part.p_max_Pa
        for axes, values in zip(panels, rows, strict=True):
            axes.plot(MM * part.place_m, values, look, label=name, linewidth=1.0)
    for axes, label in zip(panels, ("wheel centre / mm", "share of the nose", "greatest pressure / GPa"), strict=True):
        axes.set_ylabel(label)
        axes.axvline(0.0, color="0.6", linestyle="--", linewidth=0.8)
    panels[-1].set_xlabel("place behind the beginning of the nose / mm")
    shared_legend(figure, panels)
    return figure
