"""From a scene to a run: compile, integrate, collect the channels."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from functools import partial
from typing import Any, Literal

import numpy as np

import wrcore
from wrcore.contact import reduction
from wrcore.creep.table import show_progress
from wrcore.dynamics.body import STATE_SIZE, angles
from wrcore.dynamics.energy import energy_channels
from wrcore.dynamics.integrate import Checkpoint, Trajectory, integrate
from wrcore.dynamics.outputs import evaluations_at
from wrcore.dynamics.system import Equations, Model, workspace
from wrcore.dynamics.track import track_poses
from wrcore.progress import counted, simulated_time
from wrcore.run import Run
from wrcore.scene import Scene, Source, compile_scene, load_scene

DERAILED_Y = 0.05
"""A wheelset further than this from the track's centre has left the rails, m (flange tip on the rail: about 0.04 m)."""

SIDES = ("left", "right")
CONTACT_CHANNELS = {
    "u_wheel_m": reduction.U_WHEEL, "s_wheel_rad": reduction.S_WHEEL, "u_rail_m": reduction.U_RAIL,
    "x_m": reduction.X, "y_m": reduction.Y, "z_m": reduction.Z, "contact_angle_rad": reduction.ANGLE,
    "penetration_m": reduction.PENETRATION, "a_m": reduction.SEMI_A, "b_m": reduction.SEMI_B,
    "N_N": reduction.NORMAL, "Fx_N": reduction.FX, "Fy_N": reduction.FY, "Mz_Nm": reduction.MZ,
    "xi": reduction.XI, "eta": reduction.ETA, "phi_per_m": reduction.PHI,
}  # fmt: skip
"""Contact channels and their columns in the patch array."""


def simulate(
    scene: Source,
    progress: Callable[[float], object] | Literal[False] | None = None,
    start: Checkpoint | np.ndarray | None = None,
    **changes: Any,
) -> Run:
    """Run a scene.

    Parameters
    ----------
    scene : Scene, path or dict
        From :func:`wrcore.scene.load_scene`, or what that function takes.
    progress : callable or False, optional
        Called now and then with the simulated time reached, s. Left out: a bar where the run takes more than a second
        and somebody watches (a terminal or a notebook, not a log); False: none.
    start : Checkpoint or ndarray, shape (size,), optional
        Where the run begins instead of at the scene's initial state: the ``end`` of an earlier run, which goes on at
        its time bit by bit as if it had not stopped, or a state at time 0.
    **changes
        Keys of the scene with other values, as :func:`wrcore.scene.load_scene` takes them.

    Returns
    -------
    Run
        Whatever happened is in ``status`` and ``reason``; what was reached is kept.

    Raises
    ------
    InputError
        One line that names the file, the field and what was expected.

    Examples
    --------
    >>> run = simulate("config/scenes/suspended_wheelset.yaml", speed=30, integration__duration=0.1)
    >>> run.status, run.keys()
    ('completed', ['wheelset', 'wheelset/left', 'wheelset/right'])
    >>> float(run["wheelset"].y_m[0])  # m
    0.002
    """
    if changes or not isinstance(scene, Scene):
        scene = load_scene(scene, **changes)
    started = time.perf_counter()
    settings = scene.data["integration"]
    begin = start.t if isinstance(start, Checkpoint) else 0.0
    times = output_times(begin, settings["duration"], scene.data["output"]["rate"])
    with simulated_time(settings["duration"], begin) if progress is None else nullcontext(progress or None) as advance:
        model, state = compile_scene(scene, show_progress if progress is None else None)
        trajectory = integrate(
            model, state if start is None else start, times, settings["method"], settings["rtol"], settings["atol"],
            settings["step"], settings["longest_step"], DERAILED_Y, advance,
        )  # fmt: skip
    compiled = time.perf_counter() - started - trajectory.wall_s
    counters = {
        "steps": trajectory.steps, "rejected": trajectory.rejected, "rhs_evaluations": trajectory.rhs_evaluations,
        "jacobians": trajectory.jacobians, "factorisations": trajectory.factorisations,
        "smallest_step_s": trajectory.smallest_step, "table_out_of_range": trajectory.out_of_range,
        "wall_s": trajectory.wall_s, "compile_s": compiled, "simulated_s": float(trajectory.t[-1]) - begin,
    }  # fmt: skip
    groups = _channels(scene, model, trajectory)
    record = {"wrcore_version": wrcore.__version__, "detection": scene.detection, **_flat(settings)}
    record["method_used"] = trajectory.method
    return Run(scene.data, trajectory.status, trajectory.reason, trajectory.t, groups, counters, record, trajectory.end)


def simulate_many(
    scenes: Sequence[Source],
    progress: Callable[[Sequence[Source]], Iterable[Source]] | Literal[False] | None = None,
    threads: int = 1,
) -> list[Run]:
    """Run several scenes in one process, which imports, loads kernels and reads tables only once.

    Parameters
    ----------
    scenes : sequence of Scene, path or dict
    progress : callable or False, optional
        Wraps the sequence of scenes, e.g. ``tqdm.tqdm``. Left out: a bar as for :func:`simulate`; False: none.
    threads : int
        Runs at the same time: the compiled part of a run lets other threads work. Results do not depend on it.

    Returns
    -------
    list of Run
        As :func:`simulate` gives for each scene alone.

    Examples
    --------
    >>> scenes = [load_scene("config/scenes/wheelset.yaml", speed=v, integration__duration=0.05) for v in (20, 30)]
    >>> [run.scene["speed"] for run in simulate_many(scenes, threads=2)]
    [20, 30]
    """
    scenes = list(scenes)
    quietly = partial(simulate, progress=False)
    bar = counted if progress is None else progress or iter
    with ThreadPoolExecutor(threads) as pool:
        runs = pool.map(quietly, scenes) if threads > 1 else map(quietly, scenes)
        return [run for _, run in zip(bar(scenes), runs, strict=True)]


def output_times(begin, duration, rate):
    """Multiples of 1/rate (1/s) from a time on, and both ends of the duration (s)."""
    end = begin + duration
    grid = np.arange(math.ceil(begin * rate - 1e-9), math.floor(end * rate + 1e-9) + 1) / rate
    inner = grid[(grid > begin + 1e-9 / rate) & (grid < end - 1e-9 / rate)]
    ends = [grid[at] if len(grid) and abs(grid[at] - t) <= 1e-9 / rate else t for at, t in ((0, begin), (-1, end))]
    return np.concatenate([ends[:1], inner, ends[1:]])


def _flat(settings, prefix=""):
    """Nested settings as one level, keys joined by dots."""
    flat: dict[str, Any] = {}
    for key, value in settings.items():
        flat |= _flat(value, f"{prefix}{key}.") if isinstance(value, dict) else {prefix + key: value}
    return flat


def _channels(scene, model, trajectory):
    """Output channels by group; contact forces are evaluated again at the output times."""
    wanted = scene.data["output"]["channels"]
    wheelsets = model.bodies.wheelsets
    if "contact" in wanted or "acceleration" in wanted:
        patches, bounds, rates = evaluated(model, trajectory)
    else:
        rates = np.full(trajectory.states.shape, np.nan)
    groups = {}
    for body, name in enumerate(scene.vehicle.body_names):
        own = slice(STATE_SIZE * body, STATE_SIZE * (body + 1))
        groups[name] = _body_channels(trajectory.states[:, own], rates[:, own], wanted)
        if "pose" in wanted and not model.track.tangent:
            groups[name] |= _pose_on_track(model.track, trajectory.states, body, scene.vehicle.positions[body, 0])
        if "contact" in wanted and body in wheelsets:
            k = int(np.flatnonzero(wheelsets == body)[0])
            for side, rows in zip(SIDES, np.moveaxis(patches[:, k], 1, 0), strict=True):
                groups[f"{name}/{side}"] = {key: rows[..., column] for key, column in CONTACT_CHANNELS.items()}
            if scene.detection == "auto":
                groups[name] |= {f"planar_error_{side}_m": bounds[:, k, i] for i, side in enumerate(SIDES)}
                spatial = bounds[:, k] > scene.data["contact"]["detection_tolerance"]
                groups[name] |= {f"spatial_{side}": spatial[:, i].astype(float) for i, side in enumerate(SIDES)}
    if "energy" in wanted:
        groups["energy"] = energy_channels(model, workspace(model), trajectory.t, trajectory.states)
    return groups


def evaluated(model: Model, trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Evaluate the equations of motion again at a run's output times.

    Parameters
    ----------
    model : Model
    trajectory : Trajectory

    Returns
    -------
    patches : ndarray, shape (n, wheelsets, 2, MAX_PATCHES, PATCH_COLUMNS)
        NaN where a patch is absent; left and right.
    bounds : ndarray, shape (n, wheelsets, 2)
        Bound of planar detection's error (detection ``auto`` only), m.
    rates : ndarray, shape (n, size)
        Derivatives of the states.
    """
    shape = (len(trajectory.t), len(model.bodies.wheelsets), 2, reduction.MAX_PATCHES, reduction.PATCH_COLUMNS)
    patches, bounds = np.full(shape, np.nan), np.full(shape[:3], np.nan)
    rates = np.full(trajectory.states.shape, np.nan)
    evaluations_at(trajectory.t, trajectory.states, *Equations(model).arguments, rates, patches, bounds)
    return patches, bounds, rates


def _pose_on_track(track, states, body, start):
    """Pose channels relative to the track's frame, and the arc length; x stays absolute."""
    poses = np.empty((len(states), 5))
    track_poses(track, states, STATE_SIZE * body, start, poses)
    return dict(zip(("s_m", "y_m", "z_m", "roll_rad", "yaw_rad"), poses.T, strict=True))


def _body_channels(state, rate, wanted):
    channels: dict[str, np.ndarray] = {}
    if "pose" in wanted:
        roll, _, yaw = angles(state[:, 3:7])
        channels |= {"x_m": state[:, 0], "y_m": state[:, 1], "z_m": state[:, 2], "roll_rad": roll, "yaw_rad": yaw}
    if "velocity" in wanted:
        names = ("vx_m_per_s", "vy_m_per_s", "vz_m_per_s", "wx_rad_per_s", "wy_rad_per_s", "wz_rad_per_s")
        channels |= {name: state[:, 7 + i] for i, name in enumerate(names)}
    if "acceleration" in wanted:
        channels |= {f"a{axis}_m_per_s2": rate[:, 7 + i] for i, axis in enumerate("xyz")}
    return channels
