"""The paper's figures, one function each, drawn from runs and from the surfaces of wheels and rails.

Values are converted from SI units only in this module: lengths to mm, angles to mrad, forces to kN.
"""

import numpy as np
from matplotlib.colors import LightSource
from matplotlib.figure import Figure

from wrcore.analysis.pictures.plot_motion import mark_horizon
from wrcore.analysis.pictures.style import ACCENT, LINES, MARKERS, MM, RAIL, WHEEL, shared_legend, styled
from wrcore.contact.hertz import contact_modulus, hertz_table
from wrcore.contact.rigid.height_at_load import settle
from wrcore.contact.search.detection import detect
from wrcore.contact.search.reduction import MAXIMUM
from wrcore.geometry.track import SIDES
from wrcore.reference.surfaces import rail_surface, wheel_surface, wheelset_transform


def _wheel_points(scene, side, u, s, **pose):
    """Return points of a wheel in the track frame for given x, y, z, roll, yaw; shape (..., 3), m."""
    vehicle = scene.vehicle
    points = wheel_surface(scene.wheel, vehicle.rolling_radius, vehicle.half_distance, side, u, s)
    return wheelset_transform(points, **pose)


def _rail_points(scene, side, u, x):
    """Return points of a rail in the track frame, shape (..., 3), m."""
    return rail_surface(scene.rail, scene.track, side, u, x)


def _inside(curve, count, margin=1e-6):
    """Return equally spaced lateral coordinates over a whole profile, m."""
    return np.linspace(curve.u[0] + margin, curve.u[-1] - margin, count)


@styled
def fig1_parametrisation(scene, point=(0.015, 0.22, -0.012, 0.07)):
    """Draw Fig. 1: surfaces of wheels and rails with their coordinates and the points Q and P.

    ``point`` contains u_w, s_w of Q and u_r, s_r of P (m, rad, m, rad)."""
    figure = Figure(figsize=(6.8, 3.2))
    overview = figure.add_axes((-0.16, -0.45, 0.8, 1.8), projection="3d", computed_zorder=False)
    for side in ("right", "left"):
        _wheel_on_rail(overview, scene, side, reach=0.55, angle=np.pi, lift=0.0)
    _axis_arrows(overview, 300)
    _view(overview, x=(-550, 550), y=(-850, 850), z=(-20, 980), zoom=0.68)
    detail = figure.add_axes((0.43, -0.6, 0.62, 2.2), projection="3d", computed_zorder=False)
    _wheel_on_rail(detail, scene, "left", reach=0.12, angle=0.26, lift=0.08)
    _coordinate_lines(detail, scene, "left", point, lift=0.08)
    _view(detail, x=(-120, 120), y=(680, 820), z=(-15, 110), zoom=0.78)
    figure.text(0.03, 0.93, "(a) wheels of revolution, swept rails")
    figure.text(0.50, 0.93, "(b) coordinates (left side, wheel lifted by 80 mm)")
    return figure


def _view(axes, x, y, z, zoom):
    axes.set(xlim=x, ylim=y, zlim=z)
    axes.set_box_aspect((np.ptp(x), np.ptp(y), np.ptp(z)), zoom=zoom)
    axes.view_init(elev=14, azim=-142)
    axes.set_axis_off()
    axes.patch.set_visible(False)


def _wheel_on_rail(axes, scene, side, reach, angle, lift):
    """Draw the surfaces of one side: the rail over -reach..reach (m) and the wheel over -angle..angle (rad)."""
    u, x = np.meshgrid(_inside(scene.rail, 50), np.linspace(-reach, reach, 12))
    rail = _rail_points(scene, side, u, x)
    _surface(axes, rail.swapaxes(0, 1) if side == "left" else rail, "0.8", 1)  # normals point up, for the lighting
    u, s = np.meshgrid(_inside(scene.wheel, 60), np.linspace(-angle, angle, 73))
    _surface(axes, _wheel_points(scene, side, u, s, z=scene.vehicle.rolling_radius + lift), "0.9", 2)


def _surface(axes, points, color, zorder):
    x, y, z = np.moveaxis(MM * points, -1, 0)
    light = LightSource(azdeg=200, altdeg=60)
    look = {"color": color, "linewidth": 0, "antialiased": False, "rasterized": True, "zorder": zorder}
    axes.plot_surface(x, y, z, rcount=80, ccount=80, lightsource=light, **look)


def _line(axes, points, **kwargs):
    axes.plot(*np.moveaxis(MM * points, -1, 0), **kwargs)


def _coordinate_lines(axes, scene, side, point, lift):
    """Draw the profile and the circle through Q on the wheel, and the profile and the line through P on the rail."""
    u_w, s_w, u_r, s_r = point
    wheel = {"z": scene.vehicle.rolling_radius + lift}
    blue, red = {"color": LINES["planar"]["color"], "zorder": 5}, {"color": ACCENT, "zorder": 5}
    _line(axes, _wheel_points(scene, side, _inside(scene.wheel, 200), 0.0, **wheel), **blue)
    _line(axes, _wheel_points(scene, side, u_w, np.linspace(0.0, s_w, 50), **wheel), **blue)
    _line(axes, _rail_points(scene, side, _inside(scene.rail, 200), 0.0), **red)
    _line(axes, _rail_points(scene, side, u_r, np.linspace(0.0, s_r, 20)), **red)
    for name, at, style, aside in (
        ("Q ($u_w$, $s_w$)", _wheel_points(scene, side, u_w, s_w, **wheel), blue, "right"),
        ("P ($u_r$, $s_r$)", _rail_points(scene, side, u_r, s_r), red, "left"),
    ):
        axes.scatter(*(MM * at), color=style["color"], s=16, zorder=6, depthshade=False)
        axes.text(*(MM * at + np.array([0.0, 0.0, 6.0])), name, color=style["color"], zorder=7, ha=aside)


def _axis_arrows(axes, length):
    for name, direction in (("x forward", (1, 0, 0)), ("y left", (0, 1, 0)), ("z up", (0, 0, 1))):
        end = length * np.array(direction)
        axes.quiver(0, 0, 0, *end, color="k", linewidth=1.0, arrow_length_ratio=0.12, zorder=8)
        axes.text(*(1.1 * end + np.array([0.0, 0.0, 25.0])), name, zorder=8)


@styled
def fig2_profiles(wheel, rail, u_wheel=-0.034, u_rail=-0.030):
    """Draw Fig. 2: a point on the rail and on the wheel profile (at u, m) with tangent, normal and slope angle."""
    figure = Figure(figsize=(6.8, 2.5), layout="constrained")
    rail_axes, wheel_axes = figure.subplots(1, 2)
    _profile_with_point(rail_axes, rail, u_rail, ("P", "u_r", "f_r"), up=1.0)
    _profile_with_point(wheel_axes, wheel, u_wheel, ("Q", "u_w", "f_w + r_0"), up=-1.0)
    rail_axes.set(title=f"(a) rail, {rail.name}", ylim=(-30, 17))
    wheel_axes.set(title=f"(b) wheel, {wheel.name}", ylim=(-48, 20))
    return figure


def _profile_with_point(axes, curve, u, names, up):
    """Draw a profile with a point, its tangent and its outward normal (up for a rail, down for a wheel)."""
    name, across, height = names
    nodes = _inside(curve, 600)
    slope, f = float(curve(u, 1)), float(curve(u))
    tangent = np.array([1.0, slope]) / np.hypot(1.0, slope)
    axes.plot(MM * nodes, MM * curve(nodes), color=WHEEL, linewidth=1.8)
    axes.plot([MM * u, MM * u, 0.0], [0.0, MM * f, MM * f], color="0.4", linestyle=":")
    for label, (du, df) in (("t", tangent), ("n", up * np.array([-tangent[1], tangent[0]]))):
        tip = (MM * u + 14 * du, MM * f + 14 * df)
        arrow = {"arrowstyle": "<-", "color": ACCENT, "shrinkA": 0, "shrinkB": 0}
        axes.annotate(label, (MM * u, MM * f), tip, arrowprops=arrow, color=ACCENT)
    axes.plot(MM * u, MM * f, "o", color=ACCENT, markersize=4)
    text = f"${across}$ = {MM * u:.1f} mm\n${height}$ = {MM * f:.2f} mm\nslope angle {MM * np.arctan(slope):.0f} mrad"
    text = text.replace("-", "\N{MINUS SIGN}")
    axes.text(0.97, 0.05, text, transform=axes.transAxes, fontsize=8, ha="right")
    axes.annotate(name, (MM * u, MM * f), (-12, 3), textcoords="offset points", color=ACCENT)
    axes.set(xlabel=f"${across}$, to the field side / mm", ylabel=f"${height}$ / mm", aspect="equal")


@styled
def fig3_detection(scene, y, yaw, load, lowered, side="left", window=0.006):
    """Draw Fig. 3: planar detection in the cross-section and spatial detection over the wheel's strips.

    The wheelset has the lateral position y (m) and yaw (rad). Its height and roll are those of rest under a vertical
    ``load`` per wheel (N). It is drawn ``lowered`` (m) further to make the overlap visible. ``window`` is the half
    width of the view about the deepest contact points (m). ValueError if there is no contact on this side.
    """
    geometry = scene.alike.geometry
    pose = _resting_pose(scene, geometry, y, yaw, load, lowered)
    found = {}
    for detection in LINES:
        found[detection] = [patch for patch in detect(geometry, **pose, detection=detection) if patch.side == side]
        if not found[detection]:
            raise ValueError(f"no contact on the {side} side at this pose")
    figure = Figure(figsize=(6.8, 3.7), layout="constrained")
    section, plan = figure.subplots(1, 2)
    _cross_section(section, scene, pose, side, found["planar"], window)
    _plan_view(plan, scene, pose, side, found, window)
    section.set_title("(a) planar: profiles in one plane", fontsize=9)
    plan.set_title("(b) spatial: overlap from above", fontsize=9)
    shared_legend(figure, (section, plan), loc="outside lower center", ncols=3, fontsize=8)
    return figure


def _resting_pose(scene, geometry, y, yaw, load, lowered):
    material = scene.data["contact"]["material"]
    modulus = contact_modulus(material["shear_modulus"], material["poisson_ratio"])
    roll, z = settle(
        geometry, geometry, hertz_table(), modulus, y, yaw, True, MAXIMUM, load, scene.vehicle.rolling_radius
    )
    return {"y": y, "z": z - lowered, "roll": roll, "yaw": yaw}


def _wheel_span(scene, patches, window, count):
    """Return lateral wheel coordinates from ``window`` before the first to ``window`` after the last patch, m."""
    u = [patch.u_wheel_m for patch in patches]
    return np.linspace(max(min(u) - window, scene.wheel.u[0]), min(max(u) + window, scene.wheel.u[-1]), count)


def _cross_section(axes, scene, pose, side, patches, window):
    u = _wheel_span(scene, patches, window, 800)
    _, y_wheel, z_wheel = np.moveaxis(_wheel_points(scene, side, u, 0.0, **pose), -1, 0)
    z_rail = _rail_below(scene, side, y_wheel)
    axes.plot(MM * y_wheel, MM * z_rail, color=RAIL, linewidth=1.6, label="rail profile")
    axes.plot(MM * y_wheel, MM * z_wheel, color=WHEEL, linewidth=1.6, label="wheel profile")
    axes.fill_between(MM * y_wheel, MM * z_wheel, MM * z_rail, where=z_wheel < z_rail, color=ACCENT, alpha=0.5, lw=0)
    _mark(axes, [(patch.y_m, patch.z_m) for patch in patches], "planar")
    axes.set(xlabel="y / mm", ylabel="z / mm")
    axes.set_aspect("equal", adjustable="datalim")  # a tread is nearly flat; limits change, not the panel's size


def _rail_below(scene, side, y):
    """Return the height of the rail's surface (m) at lateral positions y (m); NaN outside the rail."""
    return scene.rail(SIDES[side] * y - scene.track.rail_distance(scene.rail))


def _plan_view(axes, scene, pose, side, found, window):
    """Draw the overlap over the wheel's surface, the deepest point of each strip and the contact points."""
    u = _wheel_span(scene, found["spatial"] + found["planar"], window, 300)
    s = np.linspace(-0.1, 0.1, 1001)
    points = _wheel_points(scene, side, *np.meshgrid(u, s), **pose)
    x, y = MM * points[..., 0], MM * points[..., 1]
    overlap = np.nan_to_num(MM * (_rail_below(scene, side, points[..., 1]) - points[..., 2]), nan=-1.0)
    positive = np.ma.masked_less(overlap, 0.0)
    mesh = axes.pcolormesh(x, y, positive, cmap="Greys", vmin=0, shading="gouraud", rasterized=True)
    axes.figure.colorbar(mesh, ax=axes, label="vertical overlap / mm")
    strip = np.arange(u.size)
    deepest = np.argmax(overlap, axis=0)
    kept = np.where(overlap[deepest, strip] > 0.0, 1.0, np.nan)
    axes.plot(kept * x[s.size // 2], y[s.size // 2], color=ACCENT, linestyle=":", label="lowest generator (planar)")
    axes.plot(kept * x[deepest, strip], y[deepest, strip], color=ACCENT, label="deepest point of each strip")
    for detection, patches in found.items():
        _mark(axes, [(patch.x_m, patch.y_m) for patch in patches], detection)
    seen = overlap > 0.0
    axes.set(xlabel="x / mm", ylabel="y / mm", xlim=(x[seen].min() - 10.0, x[seen].max() + 10.0),
             ylim=(y[seen].min() - 2.0, y[seen].max() + 2.0))  # fmt: skip


def _mark(axes, points, detection):
    style = {**MARKERS[detection], "s": 30 if detection == "planar" else 12, "edgecolors": "k", "linewidths": 0.6}
    axes.scatter(*(MM * np.array(points).T), zorder=4, label=f"contact point, {detection}", **style)


@styled
def fig5_contact_points(runs, wheel, rail, horizon=None, body="wheelset"):
    """Draw Fig. 5: lateral positions of the contact points on rail and wheel, over time and on the profiles.

    ``runs`` are by detection; each side has its own panels. The prediction ``horizon`` (s) is marked if given.
    """
    figure = Figure(figsize=(7.4, 5.4), layout="constrained")
    panels = figure.subplots(2, 4, width_ratios=(3, 1, 3, 1), sharey="row")
    rows = (("(a) rail", "u_rail_m", rail, RAIL), ("(b) wheel", "u_wheel_m", wheel, WHEEL))
    for row, (name, channel, curve, color) in enumerate(rows):
        for column, side in enumerate(("left", "right")):
            over_time, on_profile = panels[row, 2 * column : 2 * column + 2]
            for detection in MARKERS:
                _contact_history(over_time, on_profile, runs[detection], f"{body}/{side}", channel, curve, detection)
            nodes = _inside(curve, 600)
            on_profile.plot(MM * curve(nodes), MM * nodes, color=color, linewidth=1.0, zorder=1)
            mark_horizon(over_time, horizon, max(run.t[-1] for run in runs.values()))
            over_time.set_title(f"{name}, {side}", loc="left")
            over_time.set(xlabel="time / s", xmargin=0)
            on_profile.set_xlabel("f / mm")
        panels[row, 0].set_ylabel("u, to the field side / mm")
    shared_legend(figure, panels[0], markerscale=2)
    return figure


def _contact_history(over_time, on_profile, run, group, channel, curve, detection):
    u = run.groups[group][channel]
    t = np.broadcast_to(run.t[:, None], u.shape)
    here = ~np.isnan(u)
    over_time.scatter(t[here], MM * u[here], label=detection, rasterized=True, **MARKERS[detection])
    on_profile.scatter(MM * curve(u[here]), MM * u[here], rasterized=True, zorder=2, **MARKERS[detection])
