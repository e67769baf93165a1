"""Local wear of wheels and rails over a run: where in the patches friction works, and what that takes off.

Over each patch of each output time FASTSIM says where friction works: q = tau s, the tangential traction times the
local slip, N/m^2, per metre rolled. Scaled by one factor a patch, its integral is the creep work of the run's own
forces and creepages (:mod:`wrcore.run.derived`). A wear law (:mod:`wrcore.analysis.wear.wear_laws`) turns q into what
is lost per metre rolled and area of contact.

A wheel meets a patch once a revolution, a rail once a passage. A strip of the patch across which q is known thus takes

    I = integral of (volume lost) dx: depth per passage of a rail;   I/(2 pi r): depth per metre run of a wheel

and leaves it spread over the width of the strip. Means are over the way that is run. Depths are those of the profile's
ordinate, volumes exact sums.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from wrcore.analysis.assessment.wheels import late_in, way_shares, wheelsets_of
from wrcore.analysis.wear.wear_laws import Sliding, check_friction, wear_law
from wrcore.creep.kalker import kalker_coefficients, kalker_data
from wrcore.errors import InputError
from wrcore.errors.checked_calls import Within, checked
from wrcore.geometry.track import SIDES
from wrcore.run.derived import rolling_speed
from wrcore.run.run import Run
from wrcore.scene.friction import read_friction

BIN = 2.5e-4  # width of the bins of depth over a profile, m
STRIPS, STEPS = 25, 20  # strips across and steps along a patch


@dataclass(frozen=True, eq=False)
class WheelWear:
    """Wear of one wheel and of the rail under it.

    Depths over the bins between ``edges`` of the lateral coordinate u of their profile, positive to the field side.

    Examples
    --------
    >>> import wrcore as wr
    >>> run = wr.simulate(wr.example("suspended_wheelset"), integration__duration=0.1)
    >>> wear = wr.local_wear(run)["wheelset", "left"]
    >>> wear.wheel_depth.shape[0] == wear.wheel_edges.shape[0] - 1, wear.volume > 0.0
    (True, True)
    """

    wheel_edges: np.ndarray
    """(n + 1,): m."""
    wheel_depth: np.ndarray
    """(n,): by which the ordinate rises, m per metre run."""
    rail_edges: np.ndarray
    rail_depth: np.ndarray
    """By which the ordinate falls, m per passage of this wheel."""
    volume: float
    """What wheel and rail lose each, m^3 per metre run."""
    work: float
    """Friction's work in the patches, J/m."""


@checked
def local_wear(
    run: Run,
    begin: float = 0.0,
    law: str | dict[str, Any] = "sheffield",
    width: Annotated[float, Within(1e-6, 0.1, "m")] = BIN,
) -> dict[tuple[str, str], WheelWear]:
    """Local wear of all wheels and their rails over a run.

    Parameters
    ----------
    run : Run
        With the contact channels.
    begin : float
        Start of the evaluation, s.
    law : {"sheffield", "energy"} or mapping
        See :func:`wrcore.analysis.wear.wear_laws.wear_law`.
    width : float
        Of the bins, 1e-6 to 0.1 m.

    Returns
    -------
    dict of (str, str) to WheelWear
        By wheelset and side.

    Raises
    ------
    InputError
        For an unknown law, a run without wheels or their contacts, nothing after ``begin``, or Archard's law with
        friction that is not one number.

    Examples
    --------
    >>> import wrcore as wr
    >>> run = wr.simulate(wr.example("suspended_wheelset"), integration__duration=0.1)
    >>> sorted(wr.local_wear(run))
    [('wheelset', 'left'), ('wheelset', 'right')]
    """
    loss = wear_law(law)
    if not wheelsets_of(run):
        raise InputError("local_wear", "run", "expected the channels of wheels, such as wheelset/left")
    if any("z_m" not in run[name] for name in wheelsets_of(run)):
        raise InputError("local_wear", "output.channels", "expected the channels of poses, for the rolling radius")
    late = late_in(run, begin, "local_wear")
    wheels = [(name, side) for name in wheelsets_of(run) for side in SIDES]
    if any(not _NEEDED <= run[f"{name}/{side}"].keys() for name, side in wheels):
        raise InputError("local_wear", "output.channels", "expected contact among them")
    check_friction(law, run.scene["contact"]["friction"], "local_wear", "run")
    return {(name, side): _wheel_wear(run, name, side, late, loss, width) for name, side in wheels}


def _wheel_wear(run, name, side, late, loss, width):
    contact, body, outwards, scene = run[f"{name}/{side}"], run[name], SIDES[side], run.scene
    there = ~np.isnan(contact["N_N"][late]) & (contact["N_N"][late] > 0.0)
    rows = {name: contact[name][late][there] for name in _NEEDED}
    times = np.nonzero(there)[0]
    radius = body["z_m"][late][times]
    speed = np.broadcast_to(rolling_speed(body, scene["speed"]), late.shape)[late][times]
    # where rails differ or friction changes along them, the bound of the largest one: the amount is the run's own
    friction = read_friction(scene["contact"]["friction"], "scene").largest
    places, dy, dx, work = friction_work(rows, friction, **scene["contact"]["material"])
    share = way_shares(run, name, late)[times][:, None]
    taken = loss(Sliding(rows, places, dy, dx, work, friction, speed))
    across = np.sum(taken * dx[..., None], axis=-1) * share  # m per passage, mean over the way
    volume = float(np.sum(across * dy))
    slope = np.cos(rows["contact_angle_rad"])[:, None]
    low, high = (outwards * (places + side * 0.5 * dy) * slope for side in (-1.0, 1.0))
    low, high = np.minimum(low, high), np.maximum(low, high)

    def depth(u, factor):  # a strip's volume spread evenly over its width on the profile; the ordinate changes over du
        edges, area = _gathered(u[:, None] + low, u[:, None] + high, across * dy * factor[:, None], width)
        return edges, area / width

    wheel, rail = depth(rows["u_wheel_m"], 1.0 / (2.0 * np.pi * radius)), depth(rows["u_rail_m"], np.ones_like(radius))
    spent = float(np.sum(work * (dx * dy * share)[..., None]))
    return WheelWear(wheel[0], wheel[1], rail[0], rail[1], volume, spent)


_NEEDED = {"a_m", "b_m", "N_N", "Fx_N", "Fy_N", "Mz_Nm", "xi", "eta", "phi_per_m", "u_wheel_m", "u_rail_m",
           "contact_angle_rad"}  # fmt: skip


def friction_work(rows, friction, shear_modulus, poisson_ratio, strips=STRIPS, steps=STEPS):
    """Friction's work over m patches (``rows``: channels a_m to phi_per_m, shapes (m,); modulus in Pa) by FASTSIM:
    middles of the strips y (m, strips), their width dy (m, 1), length of the steps dx (m, strips), all m, and work
    (m, strips, steps) per metre rolled and area, N/m^2, from the leading edge on.
    """
    a, b, load, xi, eta, phi = (rows[name][:, None] for name in ("a_m", "b_m", "N_N", "xi", "eta", "phi_per_m"))
    data = kalker_data(poisson_ratio)
    c11, c22, c23 = np.array([kalker_coefficients(g, data)[:3] for g in (a / b)[:, 0]]).reshape(-1, 3).T[:, :, None]
    softness = 8.0 * a / (3.0 * shear_modulus * c11), 8.0 * a / (3.0 * shear_modulus * c22)
    spin_softness = np.pi * a * np.sqrt(a / b) / (4.0 * shear_modulus * c23)
    y = b * ((np.arange(strips) + 0.5) * 2.0 / strips - 1.0)
    length = a * np.sqrt(1.0 - (y / b) ** 2)
    dx, bound = 2.0 * length / steps, 2.0 * friction * load / (np.pi * a * b)
    px, py, work = np.zeros(y.shape), np.zeros(y.shape), np.zeros((*y.shape, steps))
    for k in range(steps):
        x = length - (k + 0.5) * dx
        px = px - (xi / softness[0] - phi * y / spin_softness) * dx
        py = py - (eta / softness[1] + phi * x / spin_softness) * dx
        size = np.hypot(px, py)
        most = bound * (length * length - x * x) / (a * a)
        cut = np.divide(most, size, out=np.ones(size.shape), where=size > most)
        # what is cut back is what slides: traction times slip, with the softness along the direction of the traction
        lost = (1.0 - cut) * (softness[0] * px * px + softness[1] * py * py)
        px, py = px * cut, py * cut
        work[..., k] = cut * lost / dx
    dy = 2.0 * b / strips
    total = np.sum(np.sum(work, axis=-1) * dx * dy, axis=1)
    known = -(rows["Fx_N"] * rows["xi"] + rows["Fy_N"] * rows["eta"] + rows["Mz_Nm"] * rows["phi_per_m"])
    scale = np.divide(np.maximum(known, 0.0), total, out=np.zeros(total.shape), where=total > 0.0)
    return y, dy, dx, work * scale[:, None, None]


def _gathered(low, high, amount, width):
    """Bins of a width that hold amounts spread evenly from ``low`` to ``high``: edges, and what is in each."""
    low, high, amount = (np.ravel(np.broadcast_to(part, amount.shape)) for part in (low, high, amount))
    if amount.size == 0:
        return np.array([0.0, width]), np.zeros(1)
    first = np.floor(low.min() / width)
    edges = width * np.arange(first, np.ceil(high.max() / width) + 1.5)
    density = amount / np.maximum(high - low, 1e-12)

    def up_to(places, weights):  # sum of weights times what each edge is beyond its place
        order = np.argsort(places)
        at, sums = places[order], np.concatenate([[0.0], np.cumsum(weights[order])])
        moments = np.concatenate([[0.0], np.cumsum((weights * places)[order])])
        count = np.searchsorted(at, edges)
        return edges * sums[count] - moments[count]

    middle = edges[len(edges) // 2]  # near which sums of moments are small
    edges -= middle
    total = up_to(low - middle, density) - up_to(high - middle, density)
    return edges + middle, np.diff(total)
