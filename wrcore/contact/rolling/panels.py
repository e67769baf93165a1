"""Panels along a strip of contact, as both half-space solvers lay them out: ellipses and strips of any patch."""

from typing import NamedTuple

import numpy as np

UPWIND = 0.6


class Panels(NamedTuple):
    """Panels along a strip, from the leading edge backwards, over its half length and load: what depends on their
    number alone; a kernel argument."""

    n: int
    edges: np.ndarray
    points: np.ndarray
    """(n + 1,): edges of the panels; points between which slip is a difference (the first lies ahead of the strip)."""
    share: np.ndarray
    load: np.ndarray
    slip: np.ndarray
    """(n,): share of the panel in the strip's normal load, centroid of that load, and where the slip row holds."""
    scale: np.ndarray
    """(n (n + 1) - 1,) float32: reciprocals of distances between points times widths of panels, in rows of points with
    one void between."""
    ahead: np.ndarray
    behind: np.ndarray
    """(n,): weights that carry elastic slip from ``slip`` to ``load``."""


def make_panels(n, lead=1.0):
    """Lay out ``n`` >= 3 panels with cosine spacing on a strip with semi-elliptic pressure; the first point lies
    ``lead`` times as far ahead of the edge as the second lies behind it."""
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
