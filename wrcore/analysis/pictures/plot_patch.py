"""Plot of a loaded wheel on its rail: both profiles, the contact pressure, and the patch in plan view."""

from typing import Annotated, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from wrcore.analysis.contact.patch import pair_of, patch
from wrcore.analysis.pictures.style import ACCENT, MM, RAIL, WHEEL, styled
from wrcore.contact.rigid.wheel_on_rail import WheelsetOnTrack
from wrcore.errors import InputError
from wrcore.errors.checked_calls import OneOf, checked
from wrcore.geometry.track import SIDES
from wrcore.scene.description import Source

TALLEST = 12.0  # height with which the maximum pressure is drawn, mm
ARROW = 22.0  # length of the arrow of the most loaded patch's force, mm
SHOWN_HEIGHTS = (-34.0, 30.0)  # heights between which wheel and rail are shown, mm


@checked
@styled
def plot_wheel_on_rail(
    source: Source | WheelsetOnTrack, side: Annotated[str, OneOf(SIDES)] = "left", **pose: Any
) -> Figure:
    """Draw a wheel on its rail under load, from behind, and its contact patch from above.

    Parameters
    ----------
    source : Scene, str, Path, dict or WheelsetOnTrack
    side : {"left", "right"}
    **pose
        Arguments of :func:`wrcore.patch`: y, yaw, load, speed, omega and so on.

    Returns
    -------
    matplotlib.figure.Figure
        Red in the first panel: the maximum pressure over the length of the patch, at its lateral position. The second
        panel is ``Patch.plot`` of the most loaded patch.

    Raises
    ------
    InputError
        In the cases of :func:`wrcore.patch`, and if the wheel has no contact.

    Examples
    --------
    >>> import wrcore as wr
    >>> figure = wr.plot_wheel_on_rail("config/scenes/trailer_vehicle.yaml", y=0.003)
    >>> [axes.get_xlabel() for axes in figure.axes[:2]]
    ['y, to the left / mm', 'x, rolling direction / mm']
    """
    patches = patch(source, side=side, **pose)
    if not patches:
        raise InputError("patch", "z", "expected a pose in which the wheel touches")
    figure = Figure(figsize=(6.0, 6.6), layout="constrained")
    section, plan = figure.subplots(2, 1)
    _section(section, pair_of(source, side), side, patches)
    most = max(patches, key=lambda one: one.normal)
    most.plot(plan)
    y = f"{MM * most.pose[0]:.3g}".replace("-", "\N{MINUS SIGN}")
    figure.legend(*section.get_legend_handles_labels(), loc="outside lower left", ncols=3, fontsize=8)
    section.set_title(f"{side} wheel from behind, wheelset at y = {y} mm", fontsize=9)
    plan.set_title(f"patch from above\n{plan.get_title()}", fontsize=9)
    return figure


def _section(axes, pair, side, patches):
    """Draw filled profiles in the cross-section, and the pressure along them."""
    sign, (y, z, roll, _) = SIDES[side], patches[0].pose
    u = np.linspace(pair.wheel.u[0], pair.wheel.u[-1], 600)
    across, height = sign * (pair.half_distance + u), pair.wheel(u) - pair.rolling_radius
    wheel = y + across * np.cos(roll) - height * np.sin(roll), z + across * np.sin(roll) + height * np.cos(roll)
    u = np.linspace(pair.rail.u[0], pair.rail.u[-1], 600)
    rail = sign * (pair.rail_distance + u), pair.rail(u)
    for (across, height), ends, color, name in (
        (wheel, SHOWN_HEIGHTS[1], WHEEL, "wheel"),
        (rail, SHOWN_HEIGHTS[0], RAIL, "rail"),
    ):
        edge = np.column_stack([MM * across, MM * height])
        body = np.vstack([[edge[0, 0], ends], edge, [edge[-1, 0], ends]])
        axes.add_patch(Polygon(body, facecolor="0.88" if ends < 0.0 else "0.95", edgecolor="none", zorder=0))
        axes.plot(*edge.T, color=color, linewidth=1.6, label=name)
    _pressure(axes, patches)
    _forces(axes, patches)
    axes.set(xlabel="y, to the left / mm", ylabel="z / mm", aspect="equal", xmargin=0, ylim=SHOWN_HEIGHTS)
    axes.invert_xaxis()  # from behind, left is on the left
    axes.grid(False)


def _pressure(axes, patches):
    """Draw the maximum pressure over the length of each patch as a filled curve on its contact line."""
    top = max(one.p_max for one in patches)
    for number, one in enumerate(patches):
        strips = np.unique(one.s[one.touching])
        largest = np.array([one.pressure[one.s == s].max() for s in strips])
        ends = np.array(one.extent[2:])
        s = np.concatenate([ends[:1], strips, ends[1:]])
        hill = TALLEST / MM * np.concatenate([[0.0], largest, [0.0]]) / top
        cosine, sine = np.cos(one.contact_angle), np.sin(one.contact_angle)
        foot = np.column_stack([one.origin[1] + s * cosine, one.origin[2] + s * sine])
        crest = foot + hill[:, None] * np.array([-sine, cosine])
        label = f"pressure, up to {1e-6 * top:.0f} MPa" if number == 0 else None
        outline = MM * np.vstack([foot, crest[::-1]])
        axes.add_patch(Polygon(outline, facecolor=ACCENT, edgecolor=ACCENT, alpha=0.7, linewidth=0.8, label=label))


def _forces(axes, patches):
    """Draw the force on the wheel at each patch, in the cross-section."""
    forces = [one.track_force[1:] for one in patches]
    longest = max(np.hypot(*force) for force in forces)
    for one, force in zip(patches, forces, strict=True):
        foot, tip = MM * np.array(one.origin[1:]), MM * np.array(one.origin[1:]) + ARROW * force / longest
        arrow = {"arrowstyle": "-|>", "color": "k", "linewidth": 1.4, "shrinkA": 0.0, "shrinkB": 0.0}
        axes.annotate("", tip, foot, arrowprops=arrow)
        text = {"textcoords": "offset points", "fontsize": 8, "va": "center"}
        axes.annotate(f"{1e-3 * np.hypot(*force):.0f} kN", tip, (6, 0), **text)
