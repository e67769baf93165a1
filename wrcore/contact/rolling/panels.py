"""Panels of a strip of contact in the rolling direction, for both half-space solvers (ellipses, patches on strips)."""

from typing import NamedTuple

import numpy as np

UPWIND = 0.6


class Panels(NamedTuple):
    """Panels of a strip, from the leading edge backwards, over its half length and load; a kernel argument.

    They depend only on the number of panels."""

    n: int
    edges: np.ndarray
    points: np.ndarray
    """(n + 1,): edges of the panels; points whose difference of displacement is the slip (first one ahead of the
    strip)."""
    share: np.ndarray
    load: np.ndarray
    slip: np.ndarray
    """(n,): fraction of the strip's normal load on the panel, centroid of this load, and slip point of the panel."""
    scale: np.ndarray
    """(n (n + 1) - 1,) float32: 1 / (distance of two points times width of a panel), by rows of points, with one unused
    number after each row."""
    ahead: np.ndarray
    behind: np.ndarray
    """(n,): weights of differences that extrapolate elastic slip from ``slip`` to ``load``."""


def make_panels(n, lead=1.0):
    """Return ``n`` >= 3 panels with cosine spacing on a strip with semi-elliptic pressure.

    The first point is ahead of the leading edge, by ``lead`` times the distance of the second one behind it."""
    theta = np.pi * np.arange(n + 1) / n
    share = np.diff(theta / 2 - np.sin(2 * theta) / 4) / (np.pi / 2)
    load = np.diff(np.sin(theta) ** 3 / 3) / (np.pi / 2) / share
    first = 1 + lead - lead * np.cos(np.pi / (2 * n))
    points = np.concatenate([[first], np.cos((np.arange(n) + 0.5) * np.pi / n)])
    slip = (points[1:] + points[:-1]) / 2
    shift = load - slip
    ahead, behind = np.zeros(n), np.zeros(n)
    ahead[1:] = shift[1:] / np.diff(slip) * np.where(np.arange(1, n) < n - 1, UPWIND, 1.0)
    behind[:-1] = shift[:-1] / np.diff(slip) * np.where(np.arange(n - 1) > 0, 1 - UPWIND, 1.0)
    edges, scale = np.cos(theta), np.zeros((n, n + 1))
    scale[:, :n] = 1 / np.outer(np.diff(points), np.diff(edges))
    return Panels(n, edges, points, share, load, slip, scale.ravel()[:-1].astype(np.float32), ahead, behind)
