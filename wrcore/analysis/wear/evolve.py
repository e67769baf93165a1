"""Evolution of wheel profiles by wear over a distance: simulate, add wear, repeat with the worn profile.

A plan names a scene and variants of it with their shares of the distance. Each step simulates them with the present
wheel profile, averages the wear depths of all wheels (`local_wear`) and smooths them. The length of the step is the
distance after which the largest depth is ``largest_wear``. All wheels, left and right, have the same wear, because
lines have curves to both sides. At ``limits`` the evolution ends, or the wheel is turned to its new profile. Rails do
not wear, because a wheel runs on the whole line and a rail carries all vehicles, unless the plan defines the traffic
that wears them (:mod:`wrcore.analysis.wear.worn_rails`).

A folder contains the state: the profile at the start of each step, the wear of the rails, and a table with a row per
step. ``plan.json`` contains their digests. A step is complete when the digest of its row is stored. After an
interruption the evolution continues after the last complete step. Edited or damaged files are refused.
"""

from __future__ import annotations

import time
from collections.abc import Callable, MutableMapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from wrcore.analysis.contact.in_run import check_same_everywhere
from wrcore.analysis.wear import worn_profiles, worn_rails
from wrcore.analysis.wear.local_wear import BIN, check_motion, law_on_cells, local_wear
from wrcore.analysis.wear.wear_folder import claim, rows_of, write_rows
from wrcore.analysis.wear.wear_laws import check_friction, wear_law
from wrcore.analysis.wear.worn_profiles import file_of, points_of, read_points, write_points
from wrcore.contact.rigid.conicity import conicity_curve
from wrcore.contact.rigid.wheel_on_rail import WheelsetOnTrack
from wrcore.errors import InputError
from wrcore.errors.checked_calls import Threads, checked
from wrcore.errors.checked_yaml import read_source, validate
from wrcore.errors.input_files import check_unchanged
from wrcore.errors.messages import warnings_suppressed
from wrcore.errors.new_files import appearing, held
from wrcore.geometry.profiles.profile import ProfileCurve
from wrcore.geometry.track import SIDES
from wrcore.run.simulate import simulate
from wrcore.scene.changes import changes_of
from wrcore.scene.description import Scene, changed_by_file, load_scene
from wrcore.sweep.plan import digest_of_plan
from wrcore.vehicle.description import GRAVITY

AMPLITUDE = 3e-3  # amplitude of the equivalent conicity in the table, m
MT = 1e9  # mass of a million gross tonnes, kg

MOST_STEPS = 10_000


def load_wear_plan(
    source: str | PathLike[str] | dict[str, Any], changes: dict[str, Any] | None = None
) -> tuple[dict[str, Any], list[Scene]]:
    """Read and check a plan; return its data with defaults, and its scenes in order.

    The source is a file (schema ``wear.yaml``), or its content with paths relative to the working directory.
    ``changes`` replace keys of the plan; of ``set`` they replace only the keys that they name.
    """
    name, folder, data = read_source(source, "plan")
    changes = changes or {}
    if isinstance(data.get("set"), dict) and isinstance(changes.get("set"), dict):
        changes = changes | {"set": data["set"] | changes["set"]}
    stated = data.get("set") if isinstance(data.get("set"), dict) else {}
    data = validate({**data, **changes}, "wear", name)
    _check_sets(stated, data, name)
    path = next((base / data["scene"] for base in (folder, Path()) if (base / data["scene"]).is_file()), None)
    if path is None:
        raise InputError(name, "scene", f"expected an existing file, got {data['scene']!r}")
    wear_law(data["law"], name)
    renewal = data.get("rails", {}).get("renewal", 0.0)
    if renewal >= data["distance"]:
        expected = f"expected less than the plan's distance of {data['distance']:g} m, or no such key: rails are never"
        raise InputError(name, "rails.renewal", f"{expected} renewed, got {renewal:g} m")
    scenes: list[Scene] = []
    output: dict[str, Any] = {"output.rate": data["rate"]}
    if data["patches"] == "exact":
        law_on_cells(data["law"], name)
        output["output.channels"] = ["pose", "velocity", "contact", "wheel_motion"]
    for i, part in enumerate(data["scenes"]):
        try:
            scene = changed_by_file(path, {**part.get("set", {}), **data["set"], **output}, folder)
            if data["patches"] == "exact":
                check_motion(scene, scene.source)
                check_same_everywhere(scene, scene.source, "")
        except InputError as error:
            raise InputError(name, f"scenes.{i}.set", str(error)) from None
        if data["begin"] >= scene.data["integration"]["duration"]:
            raise InputError(name, "begin", f"expected less than the duration of each run, got {data['begin']:g} s")
        check_friction(data["law"], scene.data["contact"]["friction"], name, f"scenes.{i}.set")
        scenes.append(scene)
    _check_wheels(scenes, name)
    _check_limits(data, scenes[0].wheel, name)
    return data, scenes


def _check_sets(stated, data, name):
    """Raise InputError for a key in both the plan file's ``set`` and a scene's, or a key that the plan sets."""
    fixed = {"output.rate": "the plan's key rate is the output rate of its runs"}
    if data["patches"] == "exact":
        fixed["output.channels"] = "exact patches need channels of their own"
    everywhere = _keys_of_changes(data["set"])
    for i, part in enumerate(data["scenes"]):
        here = _keys_of_changes(part["set"])
        if both := sorted(_keys_of_changes(stated) & here):
            expected = "expected this key here, or in the plan's set, which holds in all scenes: not in both"
            raise InputError(name, f"scenes.{i}.set.{both[0]}", expected)
        for where, keys in (("set", everywhere), (f"scenes.{i}.set", here)):
            for key in sorted(keys & fixed.keys()):
                raise InputError(name, f"{where}.{key}", f"expected no such key: {fixed[key]}")


def _keys_of_changes(values):
    return {key for _, key, _ in changes_of(values, {})}


def _check_wheels(scenes, name):
    """Raise InputError if wheels have different profiles: all start from that of the first scene and wear equally."""
    first = scenes[0].data["wheel"]["profile"]
    for i, scene in enumerate(scenes):
        wheel = scene.data["wheel"]
        single = {f"wheel.wheelsets.{one}": sides for one, sides in wheel.get("wheelsets", {}).items()}
        for place, sides in {"wheel": wheel, **single}.items():
            if found := [side for side in SIDES if "profile" in sides.get(side, {})]:
                expected = f"expected no {place}.{found[0]}.profile: all wheels wear alike, from wheel.profile on"
                raise InputError(name, f"scenes.{i}.set", expected)
        if wheel["profile"] != first:
            expected = "expected the wheel of the first scene, whose profile wears over all scenes: use the plan's set"
            raise InputError(name, f"scenes.{i}.set.wheel.profile", expected)


def _check_limits(data, wheel, name):
    """Raise InputError for turning without a limit, and for limits that a new wheel has reached or cannot reach."""
    limits = data["limits"]
    if data["turning"] and not limits:
        raise InputError(name, "turning", "expected limits beside turning, as a wheel is turned at a limit")
    if not limits:
        return
    new = worn_profiles.flange(wheel) | {"hollow_m": worn_profiles.hollow(points_of(wheel)[1])}
    for key, limit in limits.items():
        value = new[f"{key}_m"]
        if np.isnan(value):
            expected = f"expected no such limit: the wheel {wheel.name} has no flange where it is measured"
            raise InputError(name, f"limits.{key}", expected)
        if worn_profiles.limits_reached({key: limit}, new):
            expected = f"expected a limit that the new wheel, {value:.6g} m, has not reached, got {limit:g} m"
            raise InputError(name, f"limits.{key}", expected)


@checked
def evolve(
    plan: str | PathLike[str] | dict[str, Any],
    folder: str | PathLike[str],
    say: Callable[[str], object] | None = None,
    changes: dict[str, Any] | None = None,
    threads: Threads = 1,
    spent: MutableMapping[str, float] | None = None,
) -> pd.DataFrame:
    """Compute the wear of a wheel profile over the distance of a plan, or resume an interrupted computation.

    Parameters
    ----------
    plan : path-like or dict
    changes : dict, optional
        See `load_wear_plan`.
    folder : path-like
        Folder for ``profile_000.csv`` and so on (columns u_m, f_m; ``wheel.profile: {points: FILE}`` reads them),
        ``rails_000.csv`` and so on (see `rail_wear`) and ``steps.csv``; created if needed.
    say : callable, optional
        Called with a line after each step.
    threads : int
        Number of scenes of a step that run at the same time; the result does not depend on it.
    spent : mutable mapping, optional
        Filled with the processor time of all runs (``simulate``) and of their local wear (``wear``), s.

    Returns
    -------
    pandas.DataFrame
        ``steps.csv``: a row per step. The profile at its start: see `profile_row`. The step: step_m, rate_max (largest
        depth, normal to the profile, m per m), volume_m3_per_m (a wheel), worn_volume_m3 (a wheel, over the step),
        at_limit (number of limits reached; then no step follows, and the next wheel is turned). The last row has the
        profile at the end.

    Raises
    ------
    InputError
        If the plan is invalid, the folder belongs to another plan or other input files, its files were changed, another
        process writes to it, or a run derailed or failed.

    Examples
    --------
    >>> import wrcore as wr
    >>> from tempfile import TemporaryDirectory
    >>> scene = wr.example("suspended_wheelset")
    >>> hunting = {"share": 1.0, "set": {"speed": 30, "integration.duration": 0.4}}
    >>> plan = {"name": "short", "scene": scene, "distance": 1e4, "begin": 0.2, "scenes": [hunting]}
    >>> with TemporaryDirectory() as folder:
    ...     print(wr.evolve(plan, folder)[["step", "distance_m"]].values.tolist())
    [[0.0, 0.0], [1.0, 10000.0]]
    """
    data, scenes = load_wear_plan(plan, changes)
    folder = Path(folder).resolve()
    with held(folder, folder):
        return _evolve(data, scenes, folder, say, threads, {} if spent is None else spent)


def _evolve(data, scenes, folder, say, threads, spent):
    claim(folder, plan_mark(data, scenes), data)
    shares = np.array([part["share"] for part in data["scenes"]])
    shares /= shares.sum()
    rows = rows_of(folder)
    if not rows:
        write_points(file_of(folder, "profile", 0), *points_of(scenes[0].wheel))
        if data["rails"]:
            worn_rails.lay_rails(folder, scenes)
    while not rows or _goes_on(data, rows[-1]):
        step = len(rows)
        if step >= MOST_STEPS:
            raise InputError(folder, "steps", f"expected at most {MOST_STEPS} steps: largest_wear is too small")
        gone = rows[-1]["distance_m"] + rows[-1]["step_m"] if rows else 0.0
        u, f = read_points(file_of(folder, "profile", step))
        left, worn, length = data["distance"] - gone, STILL, 0.0
        row = profile_row(scenes[0], folder, step, gone)
        reached = worn_profiles.limits_reached(data["limits"], row)
        if left > 1e-9 * data["distance"] and not reached:
            worn = _wear_rate(data, scenes, shares, folder, step, (u, f), threads, spent)
            length = _step_length(data, gone, worn)
            write_points(file_of(folder, "profile", step + 1), u, f + worn.rise * length)
        elif reached and data["turning"]:
            write_points(file_of(folder, "profile", step + 1), *read_points(file_of(folder, "profile", 0)))
        if data["rails"]:
            renewed = length == worn_rails.to_renewal(gone, data["rails"].get("renewal"))
            worn_rails.next_rails(folder, step, worn.falls or UNWORN * len(scenes), length, renewed)
        row |= {"step_m": length, "rate_max": worn.deepest, "volume_m3_per_m": worn.volume}
        rows.append(row | {"worn_volume_m3": worn.volume * length, "at_limit": len(reached)})
        for scene in scenes:
            check_unchanged(scene.files)
        write_rows(folder, rows)
        if say:
            turned = f", {' and '.join(reached)} at the limit" if reached else ""
            say(f"step {step}: {1e-3 * (gone + length):.0f} of {1e-3 * data['distance']:.0f} km{turned}")
    return pd.DataFrame(rows)


def profiles_over_distance(folder: str | PathLike[str]) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Return the distance (m) and the profile's u and f (m) at the start of each step in a folder of `evolve`."""
    folder = Path(folder)
    return [(row["distance_m"], *read_points(file_of(folder, "profile", row["step"]))) for row in rows_of(folder)]


def rail_wear(folder: str | PathLike[str]) -> pd.DataFrame:
    """Return the wear of the rails by the vehicle of a plan, from a folder of `evolve`, with a row per step and scene.

    Columns: step, distance_m, scene (its index in the plan), share, left_m2_per_Mt and right_m2_per_Mt, the area that
    the rail's section loses per million gross tonnes of such vehicles.
    """
    folder = Path(folder)
    parts = [
        pd.read_csv(file_of(folder, "rails", row["step"])).assign(step=row["step"], distance_m=row["distance_m"])
        for row in rows_of(folder)
        if row["step_m"] > 0.0
    ]
    columns = ["step", "distance_m", "scene", "share", *(f"{side}_m2_per_Mt" for side in SIDES)]
    return pd.concat(parts, ignore_index=True)[columns] if parts else pd.DataFrame(columns=columns)


def profile_row(scene, folder, step, gone):
    """Return the columns of the table that describe the profile at the start of a step.

    They are worn_m (largest loss of the ordinate relative to the new or turned profile), flange dimensions Sh_m, Sd_m,
    qR_m (EN 15313, recalled), hollow_m and equivalent_conicity (3 mm).
    """
    u, now = read_points(file_of(folder, "profile", step))
    with warnings_suppressed():
        curve = ProfileCurve.from_points(u, now, "wheel", f"profile {step}", mends=False)
    new = read_points(file_of(folder, "profile", 0))[1]
    vehicle = scene.vehicle
    pair = WheelsetOnTrack.alike(curve, scene.rail, scene.track.gauge, vehicle.rolling_radius, vehicle.half_distance)
    conicity = float(conicity_curve(pair, [AMPLITUDE])["equivalent_conicity"].iloc[0])
    return {
        "step": step, "distance_m": gone, "step_m": 0.0, "worn_m": float(np.max(now - new)),
        **worn_profiles.flange(curve), "hollow_m": worn_profiles.hollow(now), "equivalent_conicity": conicity,
    }  # fmt: skip


def _goes_on(data, row):
    """Whether another row follows: the last row had a step, or its wheel is turned before the end of the distance."""
    if row["at_limit"]:
        return data["turning"] and data["distance"] - row["distance_m"] > 1e-9 * data["distance"]
    return row["step_m"] > 0.0


def _step_length(data, gone, worn):
    """Return the length of a step, m, over which its wear rates are used."""
    length = min(data["distance"] - gone, worn_rails.to_renewal(gone, data["rails"].get("renewal")))
    return min(length, data["largest_step"], data["largest_wear"] / worn.fastest) if worn.volume else length


class StepWear(NamedTuple):
    """Wear rates of a step, over all its scenes."""

    rise: np.ndarray
    """Increase of a wheel's ordinate at the stored points, smoothed, m per m."""
    volume: float
    """Volume lost by a wheel, m^3 per m."""
    falls: list[dict[str, np.ndarray]]
    """Decrease of the ordinates of each scene's rails, smoothed, m per m that the vehicle runs; empty without wear."""
    deepest: float
    """Largest loss normal to the wheel's profile, m per m."""
    fastest: float
    """Largest loss normal to the profiles of wheels and rails, m per m."""


STILL, UNWORN = StepWear(np.zeros(1), 0.0, [], 0.0, 0.0), [dict.fromkeys(SIDES, 0.0)]
"""Wear rates of a step of zero length, and those of the rails of a scene."""


class SceneWear(NamedTuple):
    """Wear rates in a run of one scene."""

    rise: np.ndarray
    """Increase of a wheel's ordinate at the stored points, m per m, mean of all wheels."""
    volume: float
    """Volume lost by a wheel, m^3 per m."""
    rails: dict[str, float]
    """Area lost by each rail's section, m^2 per million gross tonnes."""
    falls: dict[str, np.ndarray]
    """Decrease of the rails' ordinates at their stored points, m per m that the vehicle runs; empty without wear."""
    laid: worn_rails.RailsOfStep | None
    """The rails, if they wear."""
    seconds: tuple[float, float]
    """Processor time of the simulation and of local wear, s."""


def _wear_rate(data, scenes, shares, folder, step, profile, threads, spent):
    """Return the `StepWear` of the profile (u and f, m) at the start of a step."""
    one = partial(_scene_wear, data, folder, step, profile[0], threads > 1)
    total, volume, fastest = np.zeros(len(profile[0])), 0.0, 0.0
    rails: list[dict[str, float]] = []
    falls: list[dict[str, np.ndarray]] = []
    longest_first = sorted(range(len(scenes)), key=lambda i: -scenes[i].data["integration"]["duration"])
    with ThreadPoolExecutor(threads) as pool:
        done = (pool.map if threads > 1 else map)(one, longest_first, [scenes[i] for i in longest_first])
        found = dict(zip(longest_first, done, strict=True))
        for share, (_, worn) in zip(shares, sorted(found.items()), strict=True):
            total += share * worn.rise
            volume += share * worn.volume
            rails.append({"scene": len(rails), "share": share} | worn.rails)
            if worn.laid:
                rails_of, width = worn.laid.points, data["smoothing"]
                fall = {
                    side: worn_profiles.smooth_along(u, f, worn.falls[side], width) for side, (u, f) in rails_of.items()
                }
                depths = [worn_profiles.across(u, f, fall[side]) for side, (u, f) in rails_of.items()]
                fastest = max(fastest, *depths)
                falls.append(fall)
            for name, seconds in zip(("simulate", "wear"), worn.seconds, strict=True):
                spent[name] = spent.get(name, 0.0) + seconds
    with appearing(file_of(folder, "rails", step)) as file:
        pd.DataFrame(rails).to_csv(file, index=False, lineterminator="\n")
    total = worn_profiles.smooth(total, data["smoothing"])
    deepest = worn_profiles.across(profile[0], profile[1], total)
    return StepWear(total, volume, falls, deepest, max(deepest, fastest))


def _scene_wear(data, folder, step, u, quiet, place, scene):
    began = time.thread_time()
    path = file_of(folder, "profile", step).resolve()
    with warnings_suppressed():
        laid = worn_rails.rails_of_step(folder, step, place, scene) if data["rails"] else None
    changes = {"wheel.profile": {"points": str(path), "unit": "m"}} | (laid.changes if laid else {})
    try:
        with warnings_suppressed():
            present = load_scene(scene, changes)
        run = simulate(present, progress=False if quiet else None)
    except InputError as error:
        raise InputError(path, f"scenes.{place}", str(error)) from None
    if run.status != "completed":
        expected = f"expected a run to its end on this wheel, got {run.status}: {run.reason}"
        raise InputError(path, f"scenes.{place}", expected)
    simulated = time.thread_time()
    wheels = local_wear(run, data["begin"], data["law"], patches=data["patches"], scene=present)
    rise = sum(worn_profiles.onto_points(u, w.wheel_edges, w.wheel_depth) for w in wheels.values()) / len(wheels)
    volume = sum(wheel.volume for wheel in wheels.values()) / len(wheels)
    mass = sum(2.0 * scene.vehicle.nominal_wheel_load(body) for body in scene.vehicle.bodies.wheelsets) / GRAVITY
    areas = {side: sum(np.sum(w.rail_depth) * BIN for (_, of), w in wheels.items() if of == side) for side in SIDES}
    rails = {f"{side}_m2_per_Mt": float(area * MT / mass) for side, area in areas.items()}
    falls = worn_rails.falls_of(laid, wheels, data["rails"]["tonnage"] / mass) if laid else {}
    return SceneWear(rise, volume, rails, falls, laid, (simulated - began, time.thread_time() - simulated))


def plan_mark(data, scenes):
    """Return the digest that identifies a folder: plan, scenes, all files read, version, and constants of rails."""
    files = {path: digest for scene in scenes for path, digest in scene.files.items()}
    form = [getattr(worn_rails, name) for name in ("POINTS", "FACE", "FACE_SLOPE", "EDGE", "PASSES")]
    return digest_of_plan([data, [scene.data for scene in scenes], *(form if data["rails"] else [])], files)
