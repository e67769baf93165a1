"""Where the bodies of a vehicle stand in its nominal position, and which springs carry them there."""

from dataclasses import dataclass

import numpy as np

from wrcore.dynamics.marker import FRAME
from wrcore.errors import InputError

FRAME_NAME = "frame"


@dataclass(frozen=True)
class Layout:
    """Bodies of a vehicle in nominal position, all with their axes along the track's.

    Attributes
    ----------
    source : str
        Named in errors.
    names : tuple of str
    positions : numpy.ndarray, shape (n, 3)
        Centres of mass, m.
    mass : numpy.ndarray, shape (n,)
        kg.
    spins : numpy.ndarray, shape (n,)
        True for wheelsets, whose frame does not spin with them.
    carried : numpy.ndarray, shape (n,)
        True for bodies that springs must hold up: neither wheelsets nor joined to one.
    aliases : dict of str to str
        Names of bodies that are part of another one.
    """

    source: str
    names: tuple
    positions: np.ndarray
    mass: np.ndarray
    spins: np.ndarray
    carried: np.ndarray
    aliases: dict

    def ends(self, item, field):
        """Body numbers of the two ends of an element or joint; the moving frame can only be the second one."""
        numbers = []
        known = (*self.names, *self.aliases)
        for name in item["bodies"]:
            if name != FRAME_NAME and name not in known:
                raise InputError(
                    self.source, f"{field}.bodies", f"expected {FRAME_NAME} or one of {', '.join(known)}, got {name!r}"
                )
            numbers.append(FRAME if name == FRAME_NAME else self.names.index(self.aliases.get(name, name)))
        if numbers[0] == numbers[1]:
            raise InputError(
                self.source, f"{field}.bodies", f"expected two different bodies, got {item['bodies'][0]!r} twice"
            )
        if numbers[0] == FRAME:
            raise InputError(self.source, f"{field}.bodies", f"expected {FRAME_NAME} as the second of the two")
        return numbers

    def marker(self, point, body, field):
        """A point in the axes of a body. Wheelset frames do not spin: their markers must lie on the axle."""
        if body == FRAME:
            return np.array(point, float)
        marker = np.array(point, float) - self.positions[body]
        if self.spins[body] and (abs(marker[0]) > 1e-9 or abs(marker[2]) > 1e-9):
            raise InputError(self.source, f"{field}.at", f"expected a point on the axle's axis, got {list(point)}")
        return marker

    def rest(self, marker, first, second, ahead):
        """Nominal position of a marker of the first body relative to the second one, m."""
        point = self.positions[first] + marker
        return point - (np.array([ahead, 0.0, 0.0]) if second == FRAME else self.positions[second])

    def preloads(self, items, gravity):
        """Vertical preloads (N, on the first body) that hold the carried bodies in nominal position.

        Elements that state no preload share what those that do leave over, as linear springs would: all carried bodies
        sink and tilt by the displacements q with K q = weight, and each preload is its element's share of it.

        Parameters
        ----------
        items : list of dict
            Checked elements of a vehicle file.
        gravity : float
            m/s^2.

        Returns
        -------
        dict of str to float
            By name of the element.
        """
        numbers = {body: k for k, body in enumerate(np.flatnonzero(self.carried))}
        stiffness, load = np.zeros((3 * len(numbers),) * 2), np.zeros(3 * len(numbers))
        for body, k in numbers.items():
            load[3 * k] = -self.mass[body] * gravity
        rows = {}
        for item in items:
            vertical = item["stiffness"][2] if isinstance(item.get("stiffness"), list) else 0.0
            given = item["preload"][2] if isinstance(item.get("preload"), list) else None
            if vertical == 0.0 and given is None:
                continue
            at = np.array(item["at"], float).reshape(-1, 3)
            point = at.mean(axis=0) if item["kind"] == "shear_spring" else at[0]
            row = np.zeros(len(load))
            for body, sign in zip(self.ends(item, f"elements.{item['name']}"), (1.0, -1.0), strict=True):
                if body in numbers:
                    arm = point - self.positions[body]  # moments about x and y: arm y times F, -arm x times F
                    row[3 * numbers[body] : 3 * numbers[body] + 3] = sign * np.array([1.0, arm[1], -arm[0]])
            if given is not None:
                load += given * row
            else:
                rows[item["name"]] = (vertical, row)
                stiffness += vertical * np.outer(row, row)
        sunk = np.linalg.lstsq(stiffness, load, rcond=1e-12)[0] if load.size else load
        return {name: -vertical * float(row @ sunk) for name, (vertical, row) in rows.items()}
