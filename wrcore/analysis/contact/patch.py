"""Non-elliptic contact patches of one wheel with pressure, traction, slip and adhesion: ``wr.patch``."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated

from wrcore.analysis.contact.loaded import GRIDS, LoadedWheels, Rolling
from wrcore.analysis.contact.poses import pose_flags
from wrcore.contact.patch.model import SLIPS
from wrcore.contact.patch.result import Patch
from wrcore.contact.rigid.wheel_on_rail import WheelsetOnTrack
from wrcore.errors import InputError, check_number
from wrcore.errors.checked_calls import OneOf, Within, checked
from wrcore.geometry.track import SIDES
from wrcore.scene.description import Source, as_scene

METHODS = ("exact", "grid")


@checked
def patch(
    source: Source | WheelsetOnTrack,
    y: Annotated[float, Within(-0.1, 0.1, "m")] = 0.0,
    yaw: Annotated[float, Within(-0.5, 0.5, "rad")] = 0.0,
    roll: Annotated[float | None, Within(-0.5, 0.5, "rad")] = None,
    z: Annotated[float | None, Within(-2.0, 2.0, "m")] = None,
    load: Annotated[float | None, Within(1e-9, 1e6, "N")] = None,
    side: Annotated[str, OneOf(SIDES)] = "left",
    speed: Annotated[float | None, Within(1e-6, 200.0, "m/s")] = None,
    omega: Annotated[float | None, Within(-4e3, 4e3, "rad/s")] = None,
    vy: Annotated[float, Within(-200.0, 200.0, "m/s")] = 0.0,
    yaw_rate: Annotated[float, Within(-1e3, 1e3, "rad/s")] = 0.0,
    mu: Annotated[float | None, Within(0.0, 2.0)] = None,
    method: Annotated[str, OneOf(METHODS)] = "exact",
    resolution: Annotated[str, OneOf(GRIDS)] = "middle",
    slip: Annotated[str, OneOf(SLIPS)] = "surfaces",
    load_by: Annotated[str, OneOf(("vertical", "normal"))] = "vertical",
) -> list[Patch]:
    """Solve the contact patches of one wheel on the real surfaces.

    Parameters
    ----------
    source : Scene, str, Path, dict or WheelsetOnTrack
        A scene provides wheel, rail, gauge and material, and defaults of load, speed and friction. A pair (with equal
        sides) provides only the profiles and their positions.
    y, yaw, roll, z : float
        Position and attitude of the wheelset, m and rad; roll first, then yaw about the vertical. If z is given, the
        wheelset is at that height (default roll: 0). If only roll is given, it is at the height at which this wheel
        carries the load. If neither is given, both wheels carry it.
    load : float, optional
        Load of a wheel, N; required for a pair unless z is given. Default: that of the scene's first wheelset at rest.
    side : {"left", "right"}
    speed : float, optional
        Speed, m/s; default: the scene's, for a pair 1.
    omega : float, optional
        Rate of rolling, rad/s, positive forward. Default: that of free rolling, at which the mean of this wheel's
        longitudinal rigid slip, weighted by pressure, is zero.
    vy, yaw_rate : float
        Lateral velocity (m/s) and yaw rate (rad/s) of the wheelset.
    mu : float, optional
        Coefficient of friction; default: the scene's, for a pair 0.3.
    method : {"exact", "grid"}
        Strips (0.5 ms per solution), or a uniform grid (a second), their reference. If strips find no solution, the
        grid is used.
    resolution : {"coarse", "middle", "fine"}
    slip : {"surfaces", "creepages"}
        Rigid slip of the real surfaces, or of one set of creepages per patch.
    load_by : {"vertical", "normal"}
        The load is the vertical sum of all forces, or that of the normal forces.

    Returns
    -------
    list of Patch
        Patches from the flange to the field side, mostly one; empty if the wheel has no contact. Each contains its
        forces and fields; ``patches[0].plot()`` draws it.

    Raises
    ------
    InputError
        If a choice is unknown, a number has another unit, or there is no height for the load.

    Examples
    --------
    >>> import wrcore as wr
    >>> pair = wr.WheelsetOnTrack.alike(wr.named_profile("S1002", "wheel"), wr.named_profile("60E1", "rail", 1 / 40))
    >>> (tread,) = wr.patch(pair, y=0.003, load=5e4, omega=1 / 0.46)
    >>> [round(1e-3 * force, 1) for force in (tread.normal, tread.fx, tread.fs)], tread.side
    ([49.9, 9.9, 3.3], 'left')
    """
    geometry, options, usual = _of_pair(source) if isinstance(source, WheelsetOnTrack) else _of_scene(source, side)
    load, speed, mu = (usual[k] if v is None else v for k, v in (("load", load), ("speed", speed), ("mu", mu)))
    wheels = LoadedWheels(geometry, method, resolution, slip, **options)
    rolling = Rolling(float(speed), math.nan if omega is None else float(omega), float(vy), float(yaw_rate))
    how = {"rolling": rolling, "friction": float(mu)}
    if z is None:
        check_number(load, 1e-9, 1e6, "patch", "load", "N")
    known = [math.nan if value is None else value for value in (roll, z)]
    vertical = load_by == "vertical"
    to_load = how | {"vertical": vertical}
    turned, heights = wheels.placed((side,), y, yaw, known, load, to_load, ("patch", "z"))
    if math.isnan(heights[side]):
        raise InputError("patch", "load", f"expected a load that the wheel finds at y = {y:g} m, got {load:g} N")
    found = wheels.at_height(side, y, heights[side], turned, yaw, fields=True, **how)
    asked = load if z is None else math.nan
    residual, limits = pose_flags(wheels.contact, {side: (wheels.geometry, found)}, asked, turned, yaw, vertical)
    flagged = [tuple(name for name, on in one.items() if on) for one in limits[side]]
    left = float(residual[side])
    return [replace(one.patch, load_residual=left, flags=on) for one, on in zip(found, flagged, strict=True)]


def pair_of(source, side="left"):
    """Return the `WheelOnRail` of one side of a source of `patch`; for a scene that of its first wheelset."""
    return getattr(source, side) if isinstance(source, WheelsetOnTrack) else as_scene(source).pair(side)


def _of_pair(pair):
    """Return geometry, material and default values of a pair with equal sides."""
    return pair.left.geometry, {}, {"load": math.nan, "speed": 1.0, "mu": 0.3}


def _of_scene(source, side):
    """Return geometry, material and default values of a scene, for its first wheelset."""
    scene = as_scene(source)
    vehicle, contact = scene.vehicle, scene.data["contact"]
    friction = scene.friction.largest
    if not len(vehicle.bodies.wheelsets):
        raise InputError(scene.source, "vehicle", "expected a vehicle with wheelsets")
    detection = "planar" if scene.detection == "planar" else "spatial"
    load = vehicle.nominal_wheel_load(vehicle.bodies.wheelsets[0])
    return scene.pair(side).geometry, {**contact["material"], "detection": detection}, {
        "load": load, "speed": scene.data["speed"] or 1.0, "mu": friction,
    }  # fmt: skip
