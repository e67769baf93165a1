"""Stability of small motions as a function of speed: root locus and linear critical speed."""

from __future__ import annotations

from collections.abc import Iterable
from os import PathLike

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from wrcore.analysis.stability.modes import NEUTRAL, energy_table, linear_modes, shape_table
from wrcore.balance.linear import steady_running
from wrcore.bodies.body import STATE_SIZE, matrix_of
from wrcore.errors import InputError, check_number
from wrcore.errors.checked_calls import checked
from wrcore.forces.drive import undriven
from wrcore.geometry.irregularity import no_irregularity
from wrcore.geometry.path import tangent_path
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import Scene, Source, as_scene, static_equilibrium
from wrcore.track.track import TrackModel

LARGEST_RESIDUAL = 1e-3
"""Largest residual acceleration of a steady motion, m/s^2 or rad/s^2. The unbalanced drag of a free wheelset's spin
creepage is a quarter of it."""


def rising(speeds):
    """Return speeds, m/s, as a list; InputError if it is empty, speeds do not increase, or one is out of range."""
    speeds = [check_number(speed, 1e-6, 150.0, "speeds", "", "m/s") for speed in speeds]
    if not speeds or np.any(np.diff(speeds) <= 0.0):
        raise InputError("speeds", "", f"expected one or more that rise, got {len(speeds)}")
    return speeds


def straight_ahead(scene):
    """Return the model of a scene on a tangent, perfect track, and the state of static equilibrium at the track's
    centre.

    Motors, brakes and controller are omitted, because they have no steady state. The scene's initial state is ignored.
    """
    parts: dict = {}
    model, _ = compile_scene(scene, shared=parts)
    (at_rest,) = (part for (name, *_), part in parts.items() if name == "equilibrium_positions")
    model = undriven(model)._replace(track=TrackModel(True, tangent_path(), no_irregularity()))
    return model, static_equilibrium(scene, model, at_rest).state


def at_speed(model, state, speed, elapsed=0.0):
    """Return model and state of a motion on a tangent track, converted to another speed (m/s) of the moving frame.

    Velocities of bodies relative to the frame are kept; the spin of wheelsets is scaled with the speed. ``elapsed`` (s)
    is the time of the given state; that of the new state is 0.
    """
    state = state.copy()
    for body, part in enumerate(state[: STATE_SIZE * len(model.bodies.mass)].reshape(-1, STATE_SIZE)):
        part[0] -= model.speed * elapsed
        part[7] += speed - model.speed
        if model.bodies.spins[body]:
            axle = matrix_of(part[3:7])[:, 1]
            part[10:13] += axle * (axle @ part[10:13]) * (speed / model.speed - 1.0)
    return model._replace(speed=float(speed)), state


def steady_motion(model, state, speed):
    """Return the `Linearisation` about steady running on a tangent track at a speed (m/s).

    The steady motion is found from a state near the track's centre at the model's speed; InputError if there is none.
    """
    motion = steady_running(*at_speed(model, state, speed))
    left = np.abs(motion.residual)
    if not np.max(left) < LARGEST_RESIDUAL:
        bodies = len(model.bodies.mass)
        whole, inner = np.split(np.abs(motion.basis @ motion.residual)[6 * bodies :], [6 * bodies])
        whole = whole.reshape(bodies, 6)
        whole[:, 0], whole[model.bodies.spins == 1, 4] = 0.0, 0.0  # along the track, and the corresponding spin
        held = "" if max(np.max(whole), np.max(inner, initial=0.0)) >= LARGEST_RESIDUAL else (
            ", along the track, where nothing holds the vehicle against its rolling resistance: an element or joint"
            " between a body and the frame would"
        )  # fmt: skip
        raise InputError(
            "steady motion", f"speed {speed:g} m/s", "expected a vehicle that can run straight ahead near the given"
            f" state, but accelerations of {np.max(left):.2g} m/s^2 are left{held}",
        )  # fmt: skip
    return motion


@checked
def modes(scene: Source, speed: float) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Compute the modes of a scene's vehicle at one speed, with their energies and shapes.

    Parameters
    ----------
    scene : Scene, path or dict
        Its path, gradients, irregularity, drive and control are ignored.
    speed : float
        Speed, m/s.

    Returns
    -------
    table : pandas.DataFrame
        Table of `wrcore.analysis.stability.modes.linear_modes`, followed by the columns of `energy_table`.
    shapes : pandas.DataFrame
        Table of `shape_table`.

    Examples
    --------
    >>> import wrcore as wr
    >>> table, shapes = wr.modes(wr.example("suspended_wheelset"), 40.0)
    >>> table.set_index("name").loc["wheelset hunting", "frequency_Hz"].round(1).item()
    4.8
    """
    scene, (speed,) = as_scene(scene), rising([speed])
    model, state = straight_ahead(scene)
    table, shapes, energies = linear_modes(scene.vehicle, steady_motion(model, state, speed), model.flexible_track)
    full = pd.concat([table, energy_table(scene.vehicle, energies)], axis=1)
    return full, shape_table(scene.vehicle, table, shapes)


def root_locus(vehicle, model, state, speeds):
    """Return one table with the modes of `linear_modes` at all ``speeds`` (m/s), after a column speed_m_per_s.

    The other arguments are those of `steady_motion`.
    """
    tables = []
    for speed in speeds:
        motion = steady_motion(model, state, speed)
        model, state = model._replace(speed=float(speed)), motion.state  # initial guess for the next speed
        table, _, _ = linear_modes(vehicle, motion, model.flexible_track)
        table.insert(0, "speed_m_per_s", float(speed))
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def growth(motion):
    """Return the largest real part of all eigenvalues of a `Linearisation` that are not neutral, 1/s."""
    values = np.linalg.eigvals(motion.matrix)
    return float(np.max(values.real[np.abs(values) >= NEUTRAL]))


def critical_speed(vehicle, model, state, speeds, tolerance=1e-3):
    """Return the linear critical speed: the lowest speed at which a small motion neither grows nor decays.

    It is bracketed at increasing ``speeds`` (m/s) and then located to ``tolerance`` (m/s). The other arguments are
    those of `steady_motion`. The result is a dict of critical_speed_m_per_s, and mode (name), frequency_Hz and
    wavelength_m of the mode that becomes unstable. The speed is minus infinity if the lowest speed is unstable,
    infinity if none is unstable; then there is no mode.
    """
    nothing = {"mode": "", "frequency_Hz": np.nan, "wavelength_m": np.nan}
    before, motions = None, {}

    def growth_at(speed):
        """Return the growth at a speed, 1/s; each steady motion is computed once and is the initial guess of the
        next."""
        nonlocal model, state
        if speed not in motions:
            motions[speed] = steady_motion(model, state, speed)
            model, state = model._replace(speed=float(speed)), motions[speed].state
        return growth(motions[speed])

    for speed in speeds:
        if growth_at(speed) > 0.0:
            break
        before = speed
    else:
        return {"critical_speed_m_per_s": np.inf, **nothing}
    if before is None:
        return {"critical_speed_m_per_s": -np.inf, **nothing}
    found = brentq(growth_at, before, speed, xtol=tolerance)
    motion = motions[found] if found in motions else steady_motion(model, state, found)
    table, _, _ = linear_modes(vehicle, motion, model.flexible_track)
    lost = table.loc[table["real_per_s"].where(table["damping_ratio"].notna()).idxmax()]
    with np.errstate(divide="ignore"):
        wavelength = np.float64(found) / lost["frequency_Hz"]
    return {
        "critical_speed_m_per_s": found, "mode": lost["name"], "frequency_Hz": lost["frequency_Hz"],
        "wavelength_m": wavelength,
    }  # fmt: skip


@checked
def critical_speeds(scenes: Scene | str | PathLike[str] | dict[str, Scene], speeds: Iterable[float]) -> pd.DataFrame:
    """Compute the linear critical speed of a scene's vehicle, or of the vehicles of several scenes.

    Parameters
    ----------
    scenes : Scene or path, or dict of str to Scene
        A scene, or several by the name of the variant. Path, gradients, irregularity, drive and control are ignored.
    speeds : sequence of float
        Increasing speeds, m/s; the critical speed is searched between them.

    Returns
    -------
    pandas.DataFrame
        Rows of :func:`critical_speed` after a column variant.

    Examples
    --------
    >>> import wrcore as wr
    >>> wr.critical_speeds(wr.example("suspended_wheelset"), range(40, 71, 10)).round(1).T
                                             0
    variant                 suspended_wheelset
    critical_speed_m_per_s                58.5
    mode                      wheelset hunting
    frequency_Hz                           6.9
    wavelength_m                           8.5
    """
    rows, speeds = [], rising(speeds)
    if not isinstance(scenes, dict):
        scene = as_scene(scenes)
        scenes = {scene.data["name"]: scene}
    for variant, scene in scenes.items():
        model, state = straight_ahead(scene)
        rows.append({"variant": variant, **critical_speed(scene.vehicle, model, state, speeds)})
    return pd.DataFrame(rows)
