"""Frequency response of a vehicle in steady running to small harmonic forces and irregularity.

The system, linearised about steady running, is x' = A x + B u, y = C x + D u. Forces act on the accelerations that the
joints leave free. Irregularity acts by a rail's deviation under each wheelset and its first two derivatives along the
track. At the frequency omega these are d, (i omega / v) d and (i omega / v)^2 d. A wheelset at the distance L behind
the moving frame's origin reaches them later by L/v, so that d has the factor exp(-i omega L / v).
"""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Sequence
from typing import Annotated

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from wrcore.analysis.stability.stability import growth, rising, steady_motion
from wrcore.balance.linear import Linearisation, accelerations, moved_states
from wrcore.bodies.body import STATE_SIZE
from wrcore.bodies.inertia import inertia_tensors
from wrcore.equations.model import Model, internal_states
from wrcore.errors import InputError, one_of
from wrcore.errors.checked_calls import Within, checked
from wrcore.forces.drive import undriven
from wrcore.geometry.irregularity import CHANNELS, MEANS, IrregularityData, combine
from wrcore.geometry.path import tangent_path
from wrcore.integrate.trajectory import Trajectory
from wrcore.run.output.compute import evaluated
from wrcore.run.simulation import Simulation
from wrcore.scene.description import Scene, Source, as_scene, static_equilibrium
from wrcore.track.track import TrackModel

FORCES = ("Fx_N", "Fy_N", "Fz_N", "Mx_Nm", "My_Nm", "Mz_Nm")
"""Forces at a body's centre of mass and moments about it, in the order of its coordinates."""

DEVIATIONS = dict(zip((*MEANS, *CHANNELS), [*combine(*np.eye(4)), *np.eye(4)], strict=True))
"""Contribution of each kind of irregularity to the four deviations of the rails."""

DEVIATION_STEPS = (1e-7, 1e-6, 1e-6)
"""Steps of the difference quotients in a rail's deviation (m), its slope, and its curvature (1/m)."""

CELL = 0.2
"""Length of track with a deviation under a wheelset, m."""


@checked
def frequency_response(
    scene: Source,
    inputs: Annotated[Sequence[str], Within()],
    outputs: Annotated[Sequence[str], Within()],
    frequencies: Annotated[ArrayLike, Within(1e-6, 1e5, "Hz", 1)],
    speed: float | None = None,
) -> pd.DataFrame:
    """Compute the frequency response of a scene's vehicle, linearised about steady running on a tangent, perfect track.

    Parameters
    ----------
    scene : Scene, path or dict
        Its path, irregularity, drive and control are ignored; flexible track is included.
    inputs : sequence of str
        Irregularity: ``alignment`` or ``level`` (lateral or vertical, equal on both rails), ``cross_level`` (left minus
        right height), ``gauge`` (its change), or one rail's ``left_lateral``, ``left_vertical``, ``right_lateral``,
        ``right_vertical``. Forces on a body: ``car_body.Fz_N`` and so on (x, y, z), moments ``car_body.Mx_Nm``.
    outputs : sequence of str
        Channels of a run with one number at each time: ``car_body.az_m_per_s2``, ``wheelset_1/left.Q_N``.
    frequencies : array_like
        Frequencies, Hz, 1e-6 to 1e5.
    speed : float, optional
        Speed, m/s; default: the scene's.

    Returns
    -------
    pandas.DataFrame
        Complex amplitudes of the outputs per unit of the input (m, N or N m), positive phases leading; index
        ``frequency_Hz``, columns ``(input, output)``. The phase of irregularity is that at the moving frame's origin,
        which is the origin of x in the vehicle file.

    Raises
    ------
    InputError
        If an input or output is unknown, or if the steady running is unstable.

    Notes
    -----
    Linear systems with several inputs that are delayed copies of one: Popp and Schiehlen, Ground Vehicle Dynamics
    (2010), chapter 9.

    Examples
    --------
    >>> import wrcore as wr
    >>> scene = wr.example("suspended_wheelset")
    >>> table = wr.frequency_response(scene, ["alignment"], ["wheelset.y_m"], [0.05, 30.0])
    >>> table["alignment", "wheelset.y_m"].abs().round(2).tolist()
    [0.97, 0.02]
    """
    scene = observable(as_scene(scene))
    (speed,) = rising([scene.data["speed"] if speed is None else speed])
    simulation = Simulation(scene)
    model = undriven(simulation.model)
    model = model._replace(track=TrackModel(True, tangent_path(), model.track.irregularity))
    motion = steady_motion(model, static_equilibrium(scene, model).state, speed)
    model = model._replace(speed=speed)
    if growth(motion) > 0.0:
        expected = f"expected a speed at which small motions die away, but at {speed:g} m/s they grow"
        raise InputError("frequency_response", "speed", f"{expected} by {growth(motion):.2g} 1/s")
    asked = np.atleast_1d(np.asarray(frequencies, float))
    omega = 2.0 * np.pi * asked
    systems = _Systems(simulation, model, motion, list(outputs))
    columns: dict[tuple[str, str], np.ndarray] = {}
    for name in inputs:
        forced, direct = systems.of_input(name, omega)
        answers = systems.answers(omega, forced, direct)
        columns |= {(name, output): values for output, values in zip(outputs, answers.T, strict=True)}
    table = pd.DataFrame(columns, index=pd.Index(asked, name="frequency_Hz"))
    table.columns = pd.MultiIndex.from_tuples(columns, names=["input", "output"])
    return table


def observable(scene: Scene) -> Scene:
    """Return the scene without its drive and control, with all channels from which outputs are derived."""
    data = copy.deepcopy(scene.data)
    data.pop("drive", None)
    data.pop("control", None)
    data["output"]["channels"] = ["pose", "velocity", "contact"]
    return dataclasses.replace(scene, data=data)


class _Systems:
    """Linear system of a vehicle with chosen outputs: matrix C, and B and D of the inputs."""

    def __init__(self, simulation: Simulation, model: Model, motion: Linearisation, outputs: list[str]) -> None:
        self.simulation, self.model, self.motion = simulation, model, motion
        self.outputs = [_integrated(name) for name in outputs]
        at, end = motion.places, len(motion.matrix) - internal_states(model)
        n = len(model.bodies.mass)
        self.free = motion.basis[6 * n : 12 * n, at:end]  # velocities (6 n, b) that the joints leave free
        moves = motion.steps[:, None] * motion.basis.T
        states = moved_states(model, motion.state, np.vstack([moves, -moves]))
        values = self._observed(model, np.zeros(len(states)), states)
        self.observation = (values[: len(moves)] - values[len(moves) :]).T / (2.0 * motion.steps)

    def _observed(self, model, times, states):
        """Return the outputs (n, p) of states (n, size) at times (n,), s; for accelerations the velocities."""
        run = self.simulation.outputs.observe(model, times, states)
        columns = []
        for name, _ in self.outputs:
            group, _, channel = name.rpartition(".")
            if not group:
                expected = f"expected BODY.CHANNEL, such as wheelset.y_m, got {name!r}"
                raise InputError("frequency_response", "outputs", expected)
            column = run[group][channel]
            if np.ndim(column) != 1 or np.isnan(column).any():
                expected = f"expected a channel that has one number at each time, got {name}"
                raise InputError("frequency_response", "outputs", expected)
            columns.append(column)
        return np.array(columns).T

    def answers(self, omega, forced, direct):
        """Return complex outputs (n, p) at frequencies (n,), rad/s, from B u (n, m) and D u (n, p)."""
        size, rows = len(self.motion.matrix), []
        for w, force, through in zip(omega, forced, direct, strict=True):
            state = np.linalg.solve(1j * w * np.eye(size) - self.motion.matrix, force)
            rows.append((self.observation @ state + through) * [1j * w if rate else 1.0 for _, rate in self.outputs])
        return np.array(rows)

    def of_input(self, name, omega):
        """Return B u (n, m) and D u (n, p) of a unit input at frequencies (n,), rad/s."""
        if name in DEVIATIONS:
            return self._of_irregularity(DEVIATIONS[name], omega)
        body, _, force = name.rpartition(".")
        names = self.simulation.scene.vehicle.body_names
        if force not in FORCES or body not in names:
            known = [*DEVIATIONS, *(f"{body}.{force}" for body in names for force in FORCES)]
            raise InputError("frequency_response", "inputs", one_of(known, name))
        forced = self._of_force(6 * names.index(body) + FORCES.index(force))
        return np.tile(forced, (len(omega), 1)), np.zeros((len(omega), len(self.outputs)))

    def _of_force(self, place):
        """Return B (m,) of a unit force on a coordinate, projected on the free velocities N: (N^T M N)^-1 N^T."""
        bodies, free, at = self.model.bodies, self.free, self.motion.places
        mass = np.diag(np.repeat(bodies.mass, 6))
        for b, tensor in enumerate(inertia_tensors(bodies)):
            mass[6 * b + 3 : 6 * b + 6, 6 * b + 3 : 6 * b + 6] = tensor
        out = np.zeros(len(self.motion.matrix))
        out[at : at + free.shape[1]] = np.linalg.solve(free.T @ mass @ free, free[place])
        return out

    def _of_irregularity(self, weights, omega):
        """Return B u (n, m) and D u (n, p) of a unit irregularity by central differences.

        Each difference uses another position behind the beginning of the track.
        """
        model, motion = self.model, self.motion
        x = motion.state[STATE_SIZE * model.bodies.wheelsets]
        cases = [(k, order, sign) for k in range(len(x)) for order in range(3) for sign in (1.0, -1.0)]
        spacing = np.ptp(x) + 1.0
        times = -spacing / motion.speed * (1.0 + np.arange(len(cases))) - np.max(x) / motion.speed
        states = np.tile(motion.state, (len(cases), 1))
        states[:, 0 : STATE_SIZE * len(model.bodies.mass) : STATE_SIZE] += (motion.speed * times)[:, None]
        cells = [
            _cell(order, sign * DEVIATION_STEPS[order] * weights, x[k] + motion.speed * t)
            for (k, order, sign), t in zip(cases, times, strict=True)
        ]
        track = TrackModel(False, tangent_path(), _joined(cells))
        outputs, rates = self._evaluated(model._replace(track=track), times, states)
        forced = np.zeros((len(omega), rates.shape[1]), complex)
        direct = np.zeros((len(omega), outputs.shape[1]), complex)
        for i in range(0, len(cases), 2):
            k, order, _ = cases[i]
            factor = np.exp(1j * omega * x[k] / motion.speed) * (1j * omega / motion.speed) ** order
            factor /= 2.0 * DEVIATION_STEPS[order]
            forced += factor[:, None] * (rates[i] - rates[i + 1])
            direct += factor[:, None] * (outputs[i] - outputs[i + 1])
        return forced, direct

    def _evaluated(self, model, times, states):
        """Return outputs (n, p) and rates x' (n, m), those of displacements zero, of states at times (n,), s."""
        _, _, rates = evaluated(model, Trajectory("", times, states, "completed", ""))
        changes, bodies = accelerations(model, states, rates), 6 * len(model.bodies.mass)
        still = np.zeros((len(times), self.motion.places))
        rows = np.hstack([still, changes[:, :bodies] @ self.free, changes[:, bodies:]])
        return self._observed(model, times, states), rows


def _integrated(name):
    """Return the name of an output, or of the velocity if it is an acceleration, and whether to differentiate it."""
    group, _, channel = name.rpartition(".")
    if channel.startswith("a") and channel.endswith("_m_per_s2"):
        return f"{group}.v{channel[1]}_m_per_s", True
    return name, False


def _cell(order, values, s):
    """Return the polynomial coefficients (1, 4, 4) of a cell of track about s (m), and the arc length of its beginning.

    At s the derivative of the given order of the four deviations has the ``values`` (4,). The coefficients are those of
    powers of the distance from the beginning.
    """
    half, powers = 0.5 * CELL, np.zeros((1, 4, 4))
    shape = ([1.0], [-half, 1.0], [0.5 * half**2, -half, 0.5])[order]
    powers[0, : len(shape)] = np.outer(shape, values)
    return powers, s - half


def _joined(cells):
    """Return the `IrregularityData` of several cells."""
    powers, starts = zip(*cells, strict=True)
    count = len(cells)
    return IrregularityData(np.concatenate(powers), np.array(starts), np.full(count, CELL), np.arange(count + 1))
