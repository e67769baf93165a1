"""Modes of the creep force: what exact contact adds to the creep table, told by few numbers a node.

What a surface's curvature adds to the slip counts for more of the creepages of saturation the less friction there is:
each of a few coefficients of friction has modes of its own.
"""

import math
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wrcore.contact.patch.model import MODES
from wrcore.errors.checked_hdf5 import checked_hdf5
from wrcore.wheels.table import lookup as columns

SHIPPED = Path(__file__).parent / "tables"
"""Folder of what comes with the package: the modes, made by ``python -m study.patch.creep_modes``, and nodes, by
``python -m study.patch.shipped_nodes``."""


class Modes(NamedTuple):
    """Modes of the creep force's remainder, and how their coefficients are found."""

    values: np.ndarray
    """As in `PairTable`."""
    points: np.ndarray
    """(n, 2): creepages over those of saturation at which a node is solved."""
    shapes: np.ndarray
    """(3 n, 2 MODES): both families there."""
    gains: np.ndarray
    """(2 MODES, 3 n): their coefficients from the remainder there."""
    weights: np.ndarray
    """(n,): of the modes there, where slopes at rest are exact."""

    def fit(self, numbers, remainder):
        """Coefficients of all modes (2 MODES,), from a node's other numbers and its remainder (n, 3) at the points; and
        the largest creep force that they leave there, over mu N."""
        own = mode_weights(self.weights, numbers[columns.LINEAR])[:, None]
        seen = (remainder - (1.0 - own) * numbers[columns.FORCE : columns.FORCE + 3]) * self.weights[:, None] / own
        found = (self.gains @ seen.ravel()).astype(np.float16)  # which tells a remainder of 5 % to 0.003 % of mu N
        part = columns.flank_part(numbers[columns.ANGLE])
        told = self.shapes @ (found * np.repeat([1.0 - part, part], MODES))
        left = (seen - told.reshape(-1, 3)) * own / self.weights[:, None]
        return found, np.hypot(left[:, 0], left[:, 1]).max()


def mode_weights(weights, linear):
    """Weights of the modes for other values of `LINEAR`, from those for 1."""
    square = weights / (1.0 - weights)
    return square / (square + linear)


@cache
def _all_modes():
    with checked_hdf5(SHIPPED / "creep_modes.h5", "modes of the creep force") as file:
        return {
            float(friction): Modes(*(np.ascontiguousarray(group[name][...]) for name in Modes._fields))
            for friction, group in file.items()
        }


def creep_modes(friction):
    """The package's `Modes` of the nearest coefficient of friction."""
    every = _all_modes()
    return every[min(every, key=lambda one: abs(math.log(one / friction)))]
