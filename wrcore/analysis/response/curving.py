"""Quasi-static curving: wheel forces and positions in equilibrium on constant curves, and roll on canted track."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from wrcore.analysis.response.frequency_response import observable
from wrcore.analysis.stability.stability import rising, straight_ahead
from wrcore.balance.curve import Curve, CurveBalance, Turning, solve_curve, straight_balance
from wrcore.balance.initial import LARGEST_RESIDUAL_ON_STRIPS
from wrcore.bodies.body import EULER, STATE_SIZE, VELOCITY, angles
from wrcore.bodies.marker import FRAME
from wrcore.contact.search.reduction import CHANNELS
from wrcore.errors import InputError
from wrcore.errors.checked_calls import Within, checked
from wrcore.geometry.path_pieces import CANT_BASE
from wrcore.geometry.track import LEAST_RADIUS, SIDES, WIDENED
from wrcore.run.output.run import Run
from wrcore.scene.description import Scene, Source, as_scene
from wrcore.vehicle.description import GRAVITY

LARGEST_RESIDUAL = 1e-4
"""Largest residual acceleration of an equilibrium in a curve, m/s^2 or rad/s^2 (chosen: 1e-5 of gravity)."""

CANT = Annotated[float, Within(0.0, 0.5, "m")]


@checked
def quasi_static_curving(
    scene: Source,
    radii: Annotated[ArrayLike, Within(-1e9, 1e9, "m", 1)],
    cant: CANT = 0.0,
    speed: float | None = None,
    cant_deficiency: Annotated[float | None, Within(-0.5, 0.5, "m")] = None,
    widening: Annotated[float, Within(-0.05, 0.05, "m")] = 0.0,
) -> pd.DataFrame:
    """Compute the equilibrium of a scene's vehicle in constant curves, without integration over time.

    Parameters
    ----------
    scene : Scene, path or dict
        Its path, gradients, irregularity, drive and control are ignored. Friction is the scene's.
    radii : array_like, shape (n,)
        Radii of the curves, m, positive to the left, 20 m or more.
    cant : float
        Height of the outer rail above the inner rail, over 1.5 m, m.
    speed : float, optional
        Speed, m/s; default: the scene's, or that of the cant deficiency.
    cant_deficiency : float, optional
        I = 1.5 m v^2/(g R) - cant, m, which determines the speed in each curve.
    widening : float
        Widening of the gauge, m.

    Returns
    -------
    pandas.DataFrame
        A row per curve and wheel: radius_m, speed_m_per_s, cant_m, cant_deficiency_m; wheelset, side; y_m and yaw_rad
        of the wheelset in the axes of the track (yaw is its angle of attack); Q_N, Y_N, Y_over_Q, T_gamma_N of the
        wheel, sum_Y_N of the wheelset; acceleration_m_per_s2, at which creep changes the speed of the vehicle without
        traction; residual_m_per_s2, the residual acceleration. Without an equilibrium, all results except the residual
        are NaN.

    Raises
    ------
    InputError
        If a radius or a speed is out of bounds, if speed and cant deficiency are both given, or if the friction of the
        vehicle depends on its history (elements with ``approach``).

    Notes
    -----
    Curves to the left and to the right are each solved by continuation from straight track, in the order of increasing
    curvature. Accelerations are zero in axes that rotate with the vehicle. The stability of the equilibrium is not
    examined.

    Examples
    --------
    >>> import wrcore as wr
    >>> table = wr.quasi_static_curving(wr.example("suspended_wheelset"), [1000.0, 500.0], speed=15.0)
    >>> table.loc[table["side"] == "right", ["radius_m", "y_m"]].round(3).to_numpy().tolist()
    [[1000.0, -0.002], [500.0, -0.004]]
    """
    scene = as_scene(scene)
    radii = np.atleast_1d(np.asarray(radii, float))
    if np.any(np.abs(radii) < LEAST_RADIUS):
        raise InputError("quasi_static_curving", "radii", f"expected {LEAST_RADIUS:g} m or more")
    if speed is not None and cant_deficiency is not None:
        raise InputError("quasi_static_curving", "speed", "expected either a speed or a cant deficiency")
    if cant_deficiency is not None and cant + cant_deficiency <= 0.0:
        raise InputError("quasi_static_curving", "cant_deficiency", f"expected more than {-cant:g} m: a speed above 0")
    speeds = [scene.data["speed"] if speed is None else speed] * len(radii)
    if cant_deficiency is not None:
        speeds = [math.sqrt(GRAVITY * abs(radius) * (cant + cant_deficiency) / CANT_BASE) for radius in radii]
    for one in speeds:
        rising([one])
    curves = [
        Curve(1.0 / radius, math.copysign(cant, radius), widening, one)
        for radius, one in zip(radii, speeds, strict=True)
    ]
    curving = Curving(scene)
    found = dict(curving.follow(curves))
    return curving.table(radii, curves, [found[k] for k in range(len(curves))])


class Curving:
    """A scene's vehicle on constant curves of infinite length."""

    def __init__(self, scene: Scene) -> None:
        for item in scene.vehicle.data.get("elements", ()):
            if "approach" in item:
                expected = "expected friction with series_stiffness: where approach leads depends on how it came there"
                raise InputError(scene.source, f"elements.{item['name']}", expected)
        if np.any(scene.vehicle.joints.bodies == FRAME):
            raise InputError(scene.source, "vehicle", "expected one without joints to the moving frame")
        self.scene = observable(scene)
        model, state = straight_ahead(self.scene)
        if np.any(np.diff(model.friction.starts) > 1):
            expected = "expected a coefficient that is the same all along each rail: a circle has no arc length"
            raise InputError(scene.source, "contact.friction", expected)
        self.turning = Turning(model, WIDENED[scene.data["track"]["widened"]])
        self.limit = LARGEST_RESIDUAL_ON_STRIPS if model.contact.strips.strips else LARGEST_RESIDUAL
        self.straight = straight_balance(model, state)

    def follow(self, curves):
        """Yield the index of each curve and its `CurveBalance`, to the left and then to the right, from the largest
        radius on."""
        for side in (1.0, -1.0):
            known = self.straight
            numbers = [k for k, curve in enumerate(curves) if math.copysign(1.0, curve.curvature) == side]
            for k in sorted(numbers, key=lambda k: abs(curves[k].curvature)):
                found = solve_curve(self.turning, known, curves[k], self.limit)
                known = found if found.residual < self.limit else known
                yield k, found

    def observe(self, found: list[CurveBalance]) -> Run:
        """Return a run with the channels of equilibria, whose output times are their indices."""
        vehicle, groups = self.scene.vehicle, {}
        states, patches = (np.array([getattr(one, name) for one in found]) for name in ("state", "patches"))
        for body, name in enumerate(vehicle.body_names):
            part = states[:, STATE_SIZE * body : STATE_SIZE * (body + 1)]
            roll, _, yaw = angles(part[:, EULER:VELOCITY])
            groups[name] = {"y_m": part[:, 1], "roll_rad": roll, "yaw_rad": yaw}
        for k, name in enumerate(vehicle.wheelset_names):
            for side, rows in zip(SIDES, np.moveaxis(patches[:, k], 1, 0), strict=True):
                groups[f"{name}/{side}"] = {key: rows[..., column] for key, column in CHANNELS.items()}
        return Run(self.scene.data, "completed", "", np.arange(len(found)), groups)

    def table(self, radii: np.ndarray, curves: list[Curve], found: list[CurveBalance]) -> pd.DataFrame:
        """Return the table of :func:`quasi_static_curving`."""
        run, parts = self.observe(found), []
        residuals, slowing = (np.array([getattr(one, name) for one in found]) for name in ("residual", "acceleration"))
        good = np.where(residuals < self.limit, 1.0, np.nan)
        bends, cants, _, speeds = np.abs(curves).T
        cants *= np.copysign(1.0, [curve.curvature * curve.cant for curve in curves])
        for name in self.scene.vehicle.wheelset_names:
            for wheel in SIDES:
                values = {key: run[name][key] for key in ("y_m", "yaw_rad")}
                values |= {key: run[f"{name}/{wheel}"][key] for key in ("Q_N", "Y_N", "Y_over_Q", "T_gamma_N")}
                values |= {"sum_Y_N": run[name].sum_Y_N, "acceleration_m_per_s2": slowing}
                parts.append(pd.DataFrame({
                    "radius_m": radii, "speed_m_per_s": speeds, "cant_m": cants,
                    "cant_deficiency_m": CANT_BASE * speeds**2 * bends / GRAVITY - cants,
                    "wheelset": name, "side": wheel, **{key: good * value for key, value in values.items()},
                    "residual_m_per_s2": residuals,
                }))  # fmt: skip
        return pd.concat(parts).sort_index(kind="stable").reset_index(drop=True)


@checked
def roll_coefficient(scene: Source, cant: Annotated[float, Within(1e-4, 0.5, "m")] = 0.1) -> pd.DataFrame:
    """Compute the roll coefficient (flexibility coefficient) s of a scene's vehicle: roll of bodies on canted track,
    relative to its plane, per cant angle.

    Parameters
    ----------
    scene : Scene, path or dict
        Its path, irregularity, drive and control are ignored.
    cant : float
        Cant over 1.5 m, m; it affects the result if suspensions are nonlinear (bump stops).

    Returns
    -------
    pandas.DataFrame
        A row per body: body, cant_m, roll_rad (relative to the track's plane, towards the lower rail positive), and
        roll_coefficient, roll_rad over the cant angle asin(cant/1.5 m).

    Raises
    ------
    InputError
        In the cases of :func:`quasi_static_curving`, and if there is no equilibrium on this cant.

    Notes
    -----
    EN 15686 and EN 14363 (recalled) measure it on a vehicle at rest. Here the wheels roll along straight canted track,
    so that creep forces hold the wheelsets; forces on bodies are those at rest. The row of a wheelset is its roll due
    to its shift to the lower rail. It contributes to the roll of the bodies above it.

    Examples
    --------
    >>> import wrcore as wr
    >>> table = wr.roll_coefficient(wr.example("trailer_vehicle")).set_index("body")
    >>> table.loc["car_body", "roll_coefficient"].round(2).item()
    0.16
    """
    curving = Curving(as_scene(scene))
    curve = Curve(0.0, cant, 0.0, curving.straight.curve.speed)
    ((_, found),) = curving.follow([curve])
    if not found.residual < curving.limit:
        expected = f"expected one on which the vehicle has a balance, got {cant:g}"
        raise InputError("roll_coefficient", "cant", f"{expected}: {found.residual:.2g} m/s^2 are left")
    run = curving.observe([found])
    names = curving.scene.vehicle.body_names
    roll = -np.array([run[name].roll_rad[0] for name in names])
    return pd.DataFrame({
        "body": names, "cant_m": cant, "roll_rad": roll, "roll_coefficient": roll / math.asin(cant / CANT_BASE)
    })  # fmt: skip
