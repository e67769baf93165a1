"""Worn profiles as points and files: stored points, smoothing, flange dimensions and limits of a wheel."""

import math
from pathlib import Path

import numpy as np

from wrcore.errors import InputError
from wrcore.errors.new_files import appearing

POINTS = 2.5e-4  # distance between the points of a stored wheel, m


def flange(curve):
    """Return flange dimensions Sh_m, Sd_m and qR_m of a wheel profile whose inner face is 70 mm from the tape circle
    (EN 15313, recalled); NaN if the profile does not contain the points.

    Height Sh: tip below the tape circle. Thickness Sd: from the inner face to the flank 10 mm below the tape circle.
    Slope qR: along u from there to where the flange is 2 mm short of its tip.
    """
    below = curve.u < 0.0
    u, f = curve.u[below], curve.f[below] - curve(0.0)
    tip = int(np.argmin(f))

    def flank(depth):  # between tip and tape circle the ordinate rises with u
        inside = f[tip:]
        return float(np.interp(-depth, inside, u[tip:])) if inside[0] <= -depth else float("nan")

    height = -float(f[tip])
    return {"Sh_m": height, "Sd_m": 0.070 + flank(0.010), "qR_m": flank(0.010) - flank(height - 0.002)}


def hollow(f):
    """Return the depth of a tread's hollow, m: the largest increase of the wheel's radius towards the field side (false
    flange); ``f`` are ordinates, field side last.
    """
    outwards = f[int(np.argmin(f)) :]
    return float(np.max(np.maximum.accumulate(outwards) - outwards))


def limits_reached(limits, row):
    """Return the names of a wear plan's limits that a row has reached: maxima ``Sh``, ``hollow``, minima ``Sd``,
    ``qR``, m."""
    signs = {"Sh": 1.0, "hollow": 1.0, "Sd": -1.0, "qR": -1.0}
    return [name for name, limit in limits.items() if signs[name] * (row[f"{name}_m"] - limit) >= 0.0]


def smooth(values, width):
    """Smooth depths over a width (m): the mean over width/sqrt(2) around each point, twice; the sum is kept.

    A single mean over the whole width inverts waves of half to once its length. Wear on ridges would then be subtracted
    in the valleys, and ridges 2 mm apart would grow from step to step.
    """
    return _mean(_mean(values, width / math.sqrt(2.0)), width / math.sqrt(2.0))


def smooth_along(u, f, values, width):
    """Smooth depths over a width (m) along the arc length of the profile u, f (n,), m: a gauge face of a rail is much
    higher than wide."""
    edges = edges_of(u)
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(edges), np.diff(np.interp(edges, u, f))))])
    even = np.linspace(0.0, arc[-1], round(arc[-1] / POINTS) + 1)
    area = np.concatenate([[0.0], np.cumsum(values)])
    spread = smooth(np.diff(np.interp(even, arc, area)), width)
    return np.diff(np.interp(arc, even, np.concatenate([[0.0], np.cumsum(spread)])))


def _mean(values, width):
    """Return the mean over a width (m) around each point; amounts beyond the ends are added to the end points."""
    half = int(round(0.5 * width / POINTS))
    if half == 0:
        return values
    padded = np.convolve(values, np.full(2 * half + 1, 1.0 / (2 * half + 1)))
    inner = padded[half:-half].copy()
    inner[0] += padded[:half].sum()
    inner[-1] += padded[-half:].sum()
    return inner


def across(u, f, loss):
    """Return the largest depth, normal to a profile, of a loss of its ordinate, both in the unit of ``loss``."""
    return float(np.max(loss / np.sqrt(1.0 + np.gradient(f, u) ** 2)))


def points_of(curve, spacing=POINTS):
    """Return u and f, m, of a curve at the points that are stored."""
    u = spacing * np.arange(np.ceil(curve.u[0] / spacing - 1e-9), np.floor(curve.u[-1] / spacing + 1e-9) + 1)
    return u, curve(np.clip(u, curve.u[0], curve.u[-1]))


def spacing_of(u):
    """Return the distance between stored points, m."""
    return (u[-1] - u[0]) / (len(u) - 1)


def edges_of(u):
    """Return the edges of the bins around stored points, m."""
    half = 0.5 * spacing_of(u)
    return np.append(u - half, u[-1] + half)


def onto_points(u, edges, depth):
    """Return depths over the bins around stored points u (n,) from ``depth`` (m,) over bins between ``edges`` (m + 1,),
    all m.

    The area is kept; the area beyond the ends is added to the end points.
    """
    area = np.concatenate([[0.0], np.cumsum(depth * np.diff(edges))])
    inner = np.interp(edges_of(u)[1:-1], edges, area)
    return np.diff(np.concatenate([[0.0], inner, area[-1:]])) / spacing_of(u)


def file_of(folder, kind, step):
    """Return the path of a step's file in a folder of `wrcore.analysis.wear.evolve.evolve`."""
    return Path(folder) / f"{kind}_{step:03d}.csv"


def write_points(path, u, f):
    """Write a profile, u and f in m, as a CSV file."""
    with appearing(path) as file:
        np.savetxt(file, np.column_stack([u, f]), ("%.9f", "%.12f"), ",", header="u_m,f_m", comments="")


def read_points(path):
    """Read a stored profile; InputError if the file is not a stored profile."""
    try:
        points = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    except (OSError, ValueError) as error:
        raise InputError(path, "", f"expected a profile that an earlier step has written: {error}") from None
    if points.shape[1] != 2 or not np.isfinite(points).all() or np.ptp(np.diff(points[:, 0])) > 1e-6 * POINTS:
        raise InputError(path, "", "expected a profile that an earlier step has written, points equally far apart")
    return points[:, 0], points[:, 1]
