"""Figures of contact position, rolling radius difference, conicity, errors of planar detection, and reductions.

Data are tables of `wrcore.contact.rigid.first_touch.first_touch`, curves of
`wrcore.contact.rigid.conicity.conicity_curve`, and tables of `study.contact.tables`. These functions convert SI units:
lengths to mm, angles to mrad, forces to kN.
"""

import numpy as np
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from study.contact.tables import first_order_law, over_contact_angle
from wrcore.analysis.pictures.plot_contact import STYLES
from wrcore.analysis.pictures.style import MM, styled

BANDS = ((0.018, 0.140), (0.280, 0.560), (1.080, 1.240))
"""Ranges of contact angle on tread, flange root and flange, rad; S1002 on UIC60 has no contact at other angles."""


_CELLS = 16


@styled
def fig_planar_error(table):
    """Plot errors of planar detection (`planar_error_map`) over yaw and contact angle in `BANDS`, flange on top.

    Panels: error of normal penetration, error of longitudinal position (both with the first-order law as contours),
    error of penetration over this law, and error bound of ``detection: auto`` over error of penetration.

    Cells are empty if no contact has such an angle, or if planar detection finds no patch there.
    """
    table = table[table.yaw_rad > 0]
    table = table.assign(ratio=table.missed_m / table.law_m, excess=table.bound_m / table.missed_m)
    figure = Figure(figsize=(7.6, 6.6), layout="constrained")
    for part, column, factor, norm, title in zip(
        figure.subfigures(2, 2).ravel(),
        ("missed_m", "shift_m", "ratio", "excess"),
        (1e6, MM, 1.0, 1.0),
        (LogNorm(1e-3, 1e3), LogNorm(1e-2, 1e2), Normalize(0.8, 1.2), LogNorm(1.0, 1e3)),
        (
            "(a) missed normal penetration / \N{MICRO SIGN}m",
            "(b) missed longitudinal position / mm",
            "(c) missed penetration / first-order law",
            "(d) bound of auto / missed penetration",
        ),
        strict=True,
    ):
        panels = part.subplots(len(BANDS), 1, sharex=True)
        for axes, band in zip(panels, BANDS[::-1], strict=True):
            mesh = _error_band(axes, table, band, column, factor, norm)
            _law_contours(axes, table.yaw_rad.max(), band, column)
        part.colorbar(mesh, ax=list(panels), extend="both")
        panels[0].set_title(title, fontsize=9)
        panels[-1].set_xlabel("yaw / mrad")
        part.supylabel("contact angle / mrad", fontsize=9)
    return figure


def _error_band(axes, table, band, column, factor, norm):
    """Plot the cells of one band of contact angles."""
    limits = np.geomspace(*band, _CELLS + 1)
    grid = over_contact_angle(table, limits, column)
    yaw = MM * grid.columns.to_numpy()
    half = 0.5 * np.diff(yaw)
    edges = np.concatenate([[yaw[0] - half[0]], yaw[:-1] + half, [yaw[-1] + half[-1]]])
    values = factor * grid.to_numpy(dtype=float)
    axes.set(facecolor="0.9", xlim=(0.0, edges[-1]), ylim=(MM * band[0], MM * band[1]))
    axes.grid(visible=False)
    return axes.pcolormesh(edges, MM * limits, values, norm=norm, cmap="cividis", rasterized=True)


def _law_contours(axes, largest_yaw, band, column):
    """Plot contours of the first-order errors of penetration (µm) and longitudinal position (mm)."""
    yaw, angle = np.meshgrid(np.linspace(largest_yaw / 30, largest_yaw, 80), np.linspace(*band, 60))
    if column == "missed_m":
        values, levels = 1e6 * first_order_law(yaw, angle), [1e-3, 1e-2, 0.1, 1, 10, 100, 300]
    elif column == "shift_m":
        values, levels = MM * 0.46 * yaw * np.tan(angle), [0.1, 0.3, 1, 3, 10, 30]
    else:
        return
    lines = axes.contour(MM * yaw, MM * angle, values, levels=levels, colors="k", linewidths=0.8)
    for text in axes.clabel(lines, fmt=lambda level: f"{level:g}", fontsize=7):
        text.set_bbox({"facecolor": "w", "edgecolor": "none", "pad": 0.4, "alpha": 0.8})


REDUCTION_LINES = {
    "maximum": {"color": "#CC79A7", "linestyle": "-", "linewidth": 0.8},
    "moment": {"color": "#009E73", "linestyle": (0, (4, 2))},
}
"""Line styles of the reductions; planar and spatial detection have other colours."""


@styled
def fig_lateral_sweep(sweep):
    """Plot the vertical force of a wheelset over lateral position at constant height (`lateral_sweep`)."""
    figure = Figure(figsize=(6.6, 4.6), layout="constrained")
    force, steps = figure.subplots(2, 1, sharex=True)
    y = MM * sweep.y_m.to_numpy()
    per_micrometre = 1e-6 / np.diff(sweep.y_m)
    for name, style in REDUCTION_LINES.items():
        values = 1e-3 * sweep[f"{name}_N"].to_numpy()
        force.plot(y, values, label=name, rasterized=True, **style)
        change = np.maximum(np.abs(np.diff(values)) * per_micrometre, 1e-6)
        steps.semilogy(0.5 * (y[1:] + y[:-1]), change, label=name, rasterized=True, **style)
    force.set(ylabel="vertical force / kN", yscale="log", xmargin=0, title="both wheels at fixed height")
    force.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    steps.set(xlabel="lateral shift y, to the left / mm", ylabel="change per µm / kN", ylim=(1e-4, 1e3))
    force.legend(fontsize=8)
    return figure


@styled
def fig_patch_forces(tables):
    """Plot the normal force of each left patch over the lowering of the wheel (`force_over_height`)."""
    figure = Figure(figsize=(7.6, 3.0), layout="constrained")
    panels = figure.subplots(1, len(tables), squeeze=False)[0]
    for axes, (title, table) in zip(panels, tables.items(), strict=True):
        lowering = 1e6 * table.lowering_m
        single = table.patches == 1
        for label, values, style in (
            ("only patch", table.N_1_N.where(single), STYLES[0]),
            ("flange-side patch", table.N_1_N.where(~single), STYLES[1]),
            ("field-side patch", table.N_2_N, STYLES[2]),
        ):
            axes.plot(lowering, 1e-3 * values, label=label, **style)
        axes.plot(lowering, 1e-3 * table.vertical_N, color="0.4", linewidth=0.7, label="vertical force, sum")
        axes.set(xlabel="lowering after first touch / µm", ylabel="force / kN")
        axes.set_title(title, fontsize=9)
    panels[0].legend(fontsize=7)
    return figure
