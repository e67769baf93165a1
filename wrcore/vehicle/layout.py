"""Nominal positions, masses and names of the bodies of a vehicle."""

from dataclasses import dataclass

import numpy as np

from wrcore.bodies.marker import FRAME
from wrcore.errors import InputError, one_of

FRAME_NAME = "frame"


@dataclass(frozen=True)
class Layout:
    """Bodies of a vehicle in nominal position; all body axes are parallel to the track's."""

    source: str  # file name for errors
    names: tuple
    positions: np.ndarray  # (n, 3): centres of mass, m
    mass: np.ndarray  # (n,), kg
    spins: np.ndarray  # (n,): True for wheelsets, whose frame does not spin with them
    aliases: dict  # names of axle boxes that are lumped into a wheelset, with the wheelset's name

    def ends(self, item, field):
        """Return the body numbers of the two ends of an element or joint; only the second may be the moving frame."""
        numbers = []
        known = (*self.names, *self.aliases)
        for name in item["bodies"]:
            if name != FRAME_NAME and name not in known:
                raise InputError(self.source, f"{field}.bodies", one_of((FRAME_NAME, *known), name))
            numbers.append(FRAME if name == FRAME_NAME else self.names.index(self.aliases.get(name, name)))
        if numbers[0] == numbers[1]:
            raise InputError(
                self.source, f"{field}.bodies", f"expected two different bodies, got {' and '.join(item['bodies'])}"
            )
        if numbers[0] == FRAME:
            raise InputError(self.source, f"{field}.bodies", f"expected {FRAME_NAME} as the second of the two")
        return numbers

    def marker(self, point, body, field):
        """Return a point relative to a body's centre of mass, m.

        Wheelset frames do not spin: points on a wheelset must lie on the axle.
        """
        if body == FRAME:
            return np.array(point, float)
        marker = np.array(point, float) - self.positions[body]
        if self.spins[body] and (abs(marker[0]) > 1e-9 or abs(marker[2]) > 1e-9):
            x, _, z = self.positions[body]
            expected = f"expected a point on the axle of {self.names[body]}, x = {x:g} and z = {z:g} m"
            raise InputError(self.source, f"{field}.at", f"{expected}, got {[float(value) for value in point]}")
        return marker

    def rest(self, marker, first, second, offset):
        """Return the nominal position of a marker of the first body relative to the second body's centre of mass, m.

        For the moving frame it is relative to the frame's origin, shifted by ``offset`` along the track.
        """
        point = self.positions[first] + marker
        return point - (np.array([offset, 0.0, 0.0]) if second == FRAME else self.positions[second])
