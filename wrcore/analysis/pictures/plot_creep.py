"""Plot of creep laws: force over creepage."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from matplotlib.figure import Figure

from wrcore.analysis.pictures.style import styled
from wrcore.creep.cases import MODELS, creep_force
from wrcore.errors.checked_calls import ABOVE_ZERO, OneOf, checked

LOOKS = ("-", (0, (4, 2)), (0, (1, 1)), "-.", (0, (6, 1, 1, 1)), (0, (2, 2)))
"""Line styles of the laws, which differ in greyscale, too."""


@checked
@styled
def plot_creep_force(
    models: Annotated[str | Sequence[str], OneOf(MODELS)] = ("linear", "polach", "fastsim", "table"),
    a: Annotated[float, ABOVE_ZERO] = 5e-3,
    b: Annotated[float, ABOVE_ZERO] = 5e-3,
    normal_force: Annotated[float, ABOVE_ZERO] = 5e4,
    mu: Annotated[float, ABOVE_ZERO] = 0.3,
    spin: float = 0.5,
    largest: Annotated[float, ABOVE_ZERO] = 8e-3,
) -> Figure:
    """Draw creep laws for one elliptic patch: longitudinal force over xi without spin, lateral force over eta with it.

    Parameters
    ----------
    models : str or sequence of str
        Creep laws of :func:`wrcore.creep_force`.
    a, b : float
        Semi-axes along and across rolling, m.
    normal_force : float
        Normal force, N.
    mu : float
        Friction coefficient.
    spin : float
        Spin creepage in the right panel, 1/m.
    largest : float
        Largest creepage drawn.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import wrcore as wr
    >>> figure = wr.plot_creep_force(["linear", "polach"])
    >>> [line.get_label() for line in figure.axes[0].lines][:2]
    ['linear', 'polach']
    """
    models = [models] if isinstance(models, str) else list(models)
    figure = Figure(figsize=(7.2, 3.0), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    creepage = np.linspace(0.0, largest, 81)
    for model, look in zip(models, LOOKS * len(models), strict=False):
        fx, _, _ = creep_force(model, a, b, normal_force, creepage, 0.0, 0.0, mu)
        _, fy, _ = creep_force(model, a, b, normal_force, 0.0, creepage, spin, mu)
        left.plot(1e3 * creepage, -1e-3 * fx, linestyle=look, label=model)
        right.plot(1e3 * creepage, -1e-3 * fy, linestyle=look)
    left.set(xlabel="longitudinal creepage xi / 0.1 %", ylabel="force against the creepage / kN")
    right.set(xlabel=f"lateral creepage eta / 0.1 %, spin {spin:g} 1/m")
    limit = 1e-3 * mu * normal_force
    for axes in (left, right):
        axes.axhline(limit, color="0.6", linewidth=0.8)
        axes.set_ylim(-0.15 * limit, 1.15 * limit)
    left.legend()
    return figure
