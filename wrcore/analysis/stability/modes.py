"""Modes of small motions of a vehicle, named by their shapes.

Bodies form families: their names differ only by a number and a side (``bogie_1`` and ``bogie_2``, or
``axle_box_1_left`` and others). Energies are kinetic, as fractions of the mode's total. The first rule that applies
determines the name:

* *rails* or *sleeper* lateral, vertical, roll: the mass of a flexible track has more energy than all bodies together.
  Rails without mass: the mode hardly oscillates and rails move more than any body. Both rails of the wheelset with the
  largest motion move *in phase* or *in antiphase*, or only one of them moves;
* *neutral*: the eigenvalue is below `NEUTRAL`; a displacement without resistance, such as that along the track;
* *series damper*: hardly oscillates (`OVERDAMPED`), and dampers in series with springs move more than any body;
* *spin, lateral, yaw creep*: hardly oscillates, wheelsets have most energy, in that coordinate;
* *contact bounce, contact roll*: oscillates, wheelsets have most energy, in that coordinate;
* *hunting*: oscillates (damping ratio below `LIGHT`); wheelsets roll in the direction of their yaw, y' = V psi (the two
  differ by less than half of their sum). They have more energy in lateral motion than in yaw. Both together are at
  least `HUNTING`, and at least two thirds of those of any family except the heaviest;
* else *surge, lateral, bounce, roll, pitch, yaw*: the coordinate with most energy of the family with most energy. In
  the heaviest family, lateral motion and roll are coupled: *lower sway* about a pole below its centre of mass,
  *upper sway* about a pole above it.

Hunting is named after the heaviest family whose lateral motion is at least half of the largest lateral motion. The
names of the last rule use the heaviest family that moves at least half as much in this coordinate as the family with
most energy. A family's front and rear half move *in phase* or *in antiphase*, or only one of them moves.
"""

import re

import numpy as np
import pandas as pd

from wrcore.balance.linear import DIRECTIONS
from wrcore.bodies.body import STATE_SIZE
from wrcore.bodies.inertia import inertia_tensors
from wrcore.track.flexible_track import RAILS, rigid_track, track_size

NEUTRAL = 1e-3  # modulus below which an eigenvalue is neutral, 1/s: such a motion changes over a quarter of an hour
OVERDAMPED = 0.95  # damping ratio above which a mode hardly oscillates
LIGHT = 0.7  # damping ratio below which a mode can be hunting; other lateral motions of wheelsets have larger ones
HUNTING = 0.05  # smallest fraction of energy in lateral motion and yaw of the wheelsets of a hunting mode
ONE_SIDED_SHARE = 0.9  # fraction of a family's motion above which only the front or the rear half moves

WORDS = ("surge", "lateral", "bounce", "roll", "pitch", "yaw")
CREEP = {0: "spin", 1: "lateral", 4: "spin", 5: "yaw"}
Y, Z, ROLL, YAW = (DIRECTIONS.index(name) for name in ("y", "z", "roll", "yaw"))

TRACK = ("rails lateral", "rails vertical", "sleeper lateral", "sleeper vertical", "sleeper roll")
TRACK_FREEDOMS = np.array([0, 1, 0, 1, 2, 3, 4])
"""Index in `TRACK` of each degree of freedom of a :class:`wrcore.track.flexible_track.FlexibleTrack`."""


def families(vehicle):
    """Return the families of a Vehicle: numbers of the bodies whose names differ only by a number and a side, by the
    common name in words."""
    found = {}
    for number, name in enumerate(vehicle.body_names):
        found.setdefault(re.sub(r"(_\d+)?(_left|_right)?$", "", name).replace("_", " "), []).append(number)
    return found


def _phase(first, second, names):
    """Return a text for the motion of two parts: in phase, in antiphase, or the name of the only part that moves."""
    squares = [np.sum(np.abs(part) ** 2) for part in (first, second)]
    share = squares[0] / sum(squares)
    if share > ONE_SIDED_SHARE or share < 1.0 - ONE_SIDED_SHARE:
        return names[0 if share > ONE_SIDED_SHARE else 1]
    return f"in {'phase' if np.real(np.sum(first) * np.conj(np.sum(second))) > 0.0 else 'antiphase'}"


class _Namer:
    """Function object that returns names of modes of one vehicle about one steady motion."""

    def __init__(self, vehicle, linearisation):
        bodies = vehicle.bodies
        n = len(bodies.mass)
        self.speed, self.along = linearisation.speed, linearisation.state[: STATE_SIZE * n : STATE_SIZE]
        moments = np.diagonal(inertia_tensors(bodies), axis1=1, axis2=2)
        self.mass = np.hstack([np.repeat(bodies.mass[:, None], 3, axis=1), moments])
        self.wheelsets = bodies.wheelsets
        groups = families(vehicle)
        weight = {name: np.max(bodies.mass[members]) for name, members in groups.items()}
        self.groups = {name: groups[name] for name in sorted(groups, key=weight.get, reverse=True)}
        self.heaviest = next(iter(self.groups))
        self.rolling = next((name for name, members in groups.items() if {*members} & {*self.wheelsets}), None)

    def energies(self, speed):
        """Return kinetic energies (n, 6) of the bodies' coordinates as fractions of their total."""
        energy = self.mass * np.abs(speed) ** 2
        return energy / np.sum(energy)

    def __call__(self, eigenvalue, place, speed, internal):
        """Return the name of a mode from displacements and velocities (n, 6) of the bodies, and displacements of
        dampers (``internal``)."""
        if abs(eigenvalue) < NEUTRAL:
            return "neutral"
        energies = self.energies(speed)
        energy = {name: np.sum(energies[members], axis=0) for name, members in self.groups.items()}
        family = max(energy, key=lambda name: np.sum(energy[name]))
        direction = int(np.argmax(energy[family]))
        if -eigenvalue.real / abs(eigenvalue) > OVERDAMPED:
            if np.max(np.abs(internal), initial=0.0) > np.max(np.abs(place)):
                return "series damper"
            if family == self.rolling and direction in CREEP:
                return self._with_phase(f"{family} {CREEP[direction]} creep", family, direction, speed)
        elif family == self.rolling and direction in (Z, ROLL):
            return self._with_phase(f"{family} contact {WORDS[direction]}", family, direction, speed)
        elif self._hunts(eigenvalue, energy, place):
            family = self._carrier(Y, speed, self.groups)
            return self._with_phase(f"{family} hunting", family, Y, speed)
        family = self._carrier(direction, speed, [family])
        word = WORDS[direction]
        if family == self.heaviest != self.rolling and direction in (Y, ROLL):
            first = self.groups[family][0]
            below = np.real(speed[first, Y] * np.conj(speed[first, ROLL])) < 0.0
            word = "lower sway" if below else "upper sway"
        return self._with_phase(f"{family} {word}", family, direction, speed)

    def _hunts(self, eigenvalue, energy, place):
        if self.rolling is None or -eigenvalue.real > LIGHT * abs(eigenvalue):
            return False
        sideways = {name: part[Y] + part[YAW] for name, part in energy.items()}
        rolling = energy[self.rolling]
        others = [part for name, part in sideways.items() if name not in (self.heaviest, self.rolling)]
        drift, heading = eigenvalue * place[self.wheelsets, Y], self.speed * place[self.wheelsets, YAW]
        rolls = np.linalg.norm(drift - heading) < 0.5 * (np.linalg.norm(drift) + np.linalg.norm(heading))
        leads = sideways[self.rolling] >= max(others, default=0.0) / 1.5
        return bool(rolls and rolling[Y] > rolling[YAW] and leads and sideways[self.rolling] >= HUNTING)

    def _carrier(self, direction, speed, leaders):
        """Return the heaviest family that moves at least half as much in a direction as the leader with the largest
        motion."""
        moves = {name: np.max(np.abs(speed[members, direction])) for name, members in self.groups.items()}
        return next(name for name in moves if moves[name] >= 0.5 * max(moves[leader] for leader in leaders))

    def _with_phase(self, name, family, direction, speed):
        """Return the name with the phase of the family's front and rear half."""
        members = np.array(self.groups[family])
        leading = self.along[members] > np.mean(self.along[members])
        if np.ptp(self.along[members]) < 1e-6:
            return name
        front, rear = (speed[members[half], direction] for half in (leading, ~leading))
        return f"{name}, {_phase(front, rear, ('front', 'rear'))}"


class _Track:
    """Motion of the track under all wheelsets in one mode: its energy and the fractions of its kinds of motion."""

    def __init__(self, support, internal):
        d, size = len(support.mass), track_size(support)
        rows = internal[support.first :] if d else internal[:0]
        rows = rows[: size * (len(rows) // size)].reshape(-1, size) if d else rows
        self.massless = size == d
        self.place = rows[:, :d] if d else np.zeros((0, 0))
        weight = np.abs(self.place) ** 2 if self.massless else support.mass * np.abs(rows[:, d:]) ** 2
        self.shares = np.array([weight[:, TRACK_FREEDOMS[:d] == kind].sum() for kind in range(len(TRACK))])
        self.energy = 0.0 if self.massless else self.shares.sum()  # twice the kinetic energy, like in `_Namer`

    def leads(self, eigenvalue, bodies, place):
        """Whether the track dominates the mode; ``bodies`` is twice the kinetic energy of the bodies, ``place`` their
        displacements."""
        if not self.place.size or abs(eigenvalue) < NEUTRAL:
            return False
        if not self.massless:
            return bool(self.energy > bodies)
        slow = -eigenvalue.real > OVERDAMPED * abs(eigenvalue)
        return bool(slow and np.max(np.abs(self.place)) > np.max(np.abs(place)))

    def name(self):
        """Return the kind of motion, for rails with their phase, and its fraction of the track's energy (without mass:
        of the squared displacements)."""
        kind = int(np.argmax(self.shares))
        name, part = TRACK[kind], self.shares[kind] / self.shares.sum()
        if kind < 2:
            sides = self.place[:, kind:RAILS:2]
            name += f", {_phase(*sides[np.argmax(np.sum(np.abs(sides) ** 2, axis=1))], ('left', 'right'))}"
        return name, part


def linear_modes(vehicle, linearisation, support=None):
    """Return a table of the modes of a Vehicle from its `Linearisation`, their shapes and their energies.

    ``support`` is the model's track, if it is flexible. The table has a row per real eigenvalue or conjugate pair,
    slowest oscillation first. Columns: name, real_per_s, imag_rad_per_s (not negative), frequency_Hz, damping_ratio
    (negative: growing, NaN: neutral), the coordinate with most energy, and its fraction. For modes of the track the
    latter are the kind of motion and its fraction of the track's energy. Shapes (rows, n, 6), complex: displacements
    (m) and rotations (rad) of the bodies, see `wrcore.balance.linear.DIRECTIONS`; the largest is 1, all are 0 if only
    velocities change. Energies (rows, n, 6): kinetic, as fractions of the total, which includes the track; for
    wheelsets the energy of spin stands in the column of pitch.
    """
    values, vectors = np.linalg.eig(linearisation.matrix)
    kept = np.flatnonzero(values.imag >= 0.0)
    kept = kept[np.lexsort((values.real[kept], values.imag[kept]))]
    vectors = (linearisation.basis @ vectors[:, kept]).T
    n = len(vehicle.bodies.mass)
    namer = _Namer(vehicle, linearisation)
    rows, shapes, energies = [], np.zeros((len(kept), n, 6), complex), np.zeros((len(kept), n, 6))
    for k, (value, vector) in enumerate(zip(values[kept], vectors, strict=True)):
        place, speed = vector[: 12 * n].reshape(2, n, 6)
        whole, track = np.sum(namer.mass * np.abs(speed) ** 2), _Track(support or rigid_track(), vector[12 * n :])
        if np.any(speed):
            energies[k] = namer.energies(speed) * (whole / (whole + track.energy))
        body, direction = np.unravel_index(np.argmax(energies[k]), (n, 6))
        largest = place.flat[np.argmax(np.abs(place))]
        shapes[k] = place / largest if largest != 0.0 else 0.0
        name = namer(value, place, speed, vector[12 * n :][: vehicle.elements.states])
        most, part = f"{vehicle.body_names[body]} {DIRECTIONS[direction]}", energies[k, body, direction]
        if track.leads(value, whole, place):
            name, part = track.name()
            most = name.split(",")[0]
        rows.append({
            "name": name,
            "real_per_s": value.real, "imag_rad_per_s": value.imag, "frequency_Hz": value.imag / (2.0 * np.pi),
            "damping_ratio": -value.real / abs(value) if abs(value) >= NEUTRAL else np.nan,
            "most_energy": most, "part": part,
        })  # fmt: skip
    return pd.DataFrame(rows), shapes, energies


def shape_table(vehicle, table, shapes):
    """Return shapes of modes as a long table with a row per mode, body and coordinate.

    Columns: mode (row of ``table``), name, body, coordinate, amplitude (m or rad, the largest in a mode is 1) and
    phase_rad.
    """
    bodies = len(vehicle.body_names)
    return pd.DataFrame({
        "mode": np.repeat(np.arange(len(table)), 6 * bodies), "name": np.repeat(table["name"].to_numpy(), 6 * bodies),
        "body": np.tile(np.repeat(vehicle.body_names, 6), len(table)),
        "coordinate": np.tile(DIRECTIONS, bodies * len(table)),
        "amplitude": np.abs(shapes).ravel(), "phase_rad": np.angle(shapes).ravel(),
    })  # fmt: skip


def energy_table(vehicle, energies):
    """Return energies of modes as a wide table with a row per mode and a column per family and coordinate.

    A column, such as ``bogie yaw`` or ``wheelset spin``, is the sum over the family's bodies.
    """
    columns = {}
    for family, members in families(vehicle).items():
        for k, direction in enumerate(DIRECTIONS):
            word = "spin" if direction == "pitch" and vehicle.bodies.spins[members[0]] else direction
            columns[f"{family} {word}"] = energies[:, members, k].sum(axis=1)
    return pd.DataFrame(columns)
