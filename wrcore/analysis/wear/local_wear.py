"""Local wear of wheels and rails over a run: distribution of frictional work in the patches, and the material removed.

For each patch at each output time, FASTSIM computes the distribution of frictional work: q = tau s, the tangential
traction times the local slip, N/m^2, per metre rolled. It is scaled by one factor a patch, so that its integral is the
creep work of the run's forces and creepages (:mod:`wrcore.run.output.derived`). Alternatively q is that of the exact
patch for the position and velocity of the wheel in the run (:mod:`wrcore.analysis.contact.in_run`), strip by strip
along both curved profiles, scaled by one factor a wheel. A wear law (:mod:`wrcore.analysis.wear.wear_laws`) converts q
to the loss per metre rolled and area of contact.

A point of a wheel passes the patch once a revolution, a point of a rail once a passage. A strip of the patch with known
q thus removes

    I = integral of (volume lost) dx: depth per passage of a rail;   I/(2 pi r): depth per metre run of a wheel

evenly over the width of the strip. Means are over the distance run. Depths are changes of the profile's ordinate,
volumes are exact sums.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, NamedTuple

import numpy as np

from wrcore.analysis.assessment.wheels import output_times_after, way_shares, wheelsets_of
from wrcore.analysis.contact.in_run import WheelInRun, scene_in_run
from wrcore.analysis.contact.loaded import GRIDS
from wrcore.analysis.wear.wear_laws import DENSITY, LAWS, Sliding, check_friction, wear_law
from wrcore.creep.kalker import kalker_coefficients, kalker_data
from wrcore.errors import InputError, one_of
from wrcore.errors.checked_calls import OneOf, Within, checked
from wrcore.errors.messages import warn
from wrcore.geometry.track import SIDES
from wrcore.run.output.derived import creep_work, rolling_speed
from wrcore.run.output.run import Run
from wrcore.run.progress import counted
from wrcore.scene.description import Scene, Source
from wrcore.scene.parts.friction import read_friction
from wrcore.scene.reader import Reader
from wrcore.scene.stored import laws_of_stored

PATCHES = "ellipse", "exact"
"""Patch models for the distribution of frictional work."""

BIN = 2.5e-4  # width of the bins of depth over a profile, m
STRIPS, STEPS = 25, 20  # numbers of strips across and of steps along a patch

MISSED = 0.1
"""Largest relative error of a wheel's force carried by its exact patches; above it, ellipses are used at that time."""

_SOUGHT = 1
"""Number of steps of the search for windows of exact patches, which uses only the first guess: in worn gauge corners
fixed strips do not have larger errors than results of longer searches."""


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
    """Edges of the bins, shape (n + 1,), m."""
    wheel_depth: np.ndarray
    """Increase of the ordinate, shape (n,), m per metre run."""
    rail_edges: np.ndarray
    rail_depth: np.ndarray
    """Decrease of the ordinate, m per passage of this wheel."""
    volume: float
    """Volume that wheel and rail lose each, m^3 per metre run."""
    work: float
    """Frictional work in the patches, J/m."""


@checked
def local_wear(
    run: Run,
    begin: float = 0.0,
    law: str | dict[str, Any] = "sheffield",
    width: Annotated[float, Within(1e-6, 0.1, "m")] = BIN,
    patches: Annotated[str, OneOf(PATCHES)] = "ellipse",
    resolution: Annotated[str, OneOf(GRIDS)] = "coarse",
    scene: Source | None = None,
    trust: bool = False,
) -> dict[tuple[str, str], WheelWear]:
    """Compute the local wear of all wheels and their rails over a run.

    Parameters
    ----------
    run : Run
        Run with the contact channels.
    begin : float
        Start of the evaluation, s.
    law : {"sheffield", "energy"} or mapping
        See :func:`wrcore.analysis.wear.wear_laws.wear_law`.
    width : float
        Width of the bins, 1e-6 to 0.1 m.
    patches : {"ellipse", "exact"}
        Distribution of frictional work: over the ellipses of equal moments, or over exact patches, which are solved
        again in some milliseconds each. Exact patches need the channels ``wheel_motion``. ``contact.patch`` of the run
        must be exact, surrogate, tabulated or moment, whose motion is similar (see `reports/wear.md`). Laws are then
        "sheffield" and "energy".
    resolution : {"coarse", "middle", "fine"}
        Resolution of exact patches.
    scene : Scene, str, Path or dict, optional
        Scene of the run, for exact patches; by default it is read again from the description in the run.
    trust : bool
        Whether laws of the user that a run file names may be executed: exact patches need slip-dependent friction.

    Returns
    -------
    dict of (str, str) to WheelWear
        By wheelset and side.

    Raises
    ------
    InputError
        If the law is unknown, the run has no wheels or contacts, ``begin`` is outside the run, friction is not one
        number with Archard's law, or exact patches do not support the law or the scene.

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
    late = output_times_after(run, begin, "local_wear")
    wheels = [(name, side) for name in wheelsets_of(run) for side in SIDES]
    if any(not _NEEDED <= run[f"{name}/{side}"].keys() for name, side in wheels):
        raise InputError("local_wear", "output.channels", "expected contact among them")
    check_friction(law, run.scene["contact"]["friction"], "local_wear", "run")
    over = partial(_on_ellipses, run, late, loss, trust)
    if patches == "exact":
        own = scene_in_run(run, scene, "local_wear", trust)
        check_motion(own, "local_wear")
        exact = law_on_cells(law, "local_wear")
        over = partial(_on_exact_patches, run, late, exact, own, resolution, otherwise=over)
        wheels = counted(wheels, unit="wheel")
    return {(name, side): _wheel_wear(run, name, late, over(name, side), width) for name, side in wheels}


def check_motion(scene: Scene, asker: str) -> None:
    """Raise InputError, named by ``asker``, for a patch model whose motion is not similar to that of exact contact."""
    own = scene.data["contact"]["patch"]
    if own == "maximum":
        expected = "expected exact, surrogate, tabulated or moment where patches are exact"
        raise InputError(asker, "contact.patch", f"{expected}: others move a wheelset in another way; got {own}")


def law_on_cells(law: str | dict[str, Any], asker: str) -> Callable[[np.ndarray], np.ndarray]:
    """Return the function from frictional work per area to loss (kg per metre rolled and m^2) on exact patches.

    InputError, named by ``asker``, for laws that exact patches do not support."""
    if not isinstance(law, str) or law not in LAWS:
        raise InputError(asker, "law", f"{one_of(LAWS, law)}, where patches are exact")
    return LAWS[law]


class Strips(NamedTuple):
    """Material loss and work of strips of patches, over all evaluated output times; arrays of shape (k,)."""

    time: np.ndarray
    """Index of the output time among the evaluated ones."""
    wheel: np.ndarray
    rail: np.ndarray
    """Ends of the strips on the profiles of wheel and rail, shape (2, k), m."""
    lost: np.ndarray
    """Volume lost per metre rolled, m^2."""
    work: np.ndarray
    """Frictional work per metre rolled, N."""


NOTHING = Strips(np.zeros(0, int), np.zeros((2, 0)), np.zeros((2, 0)), np.zeros(0), np.zeros(0))
"""`Strips` of a wheel without contact."""

_WORKING = "Fx_N", "Fy_N", "Mz_Nm", "xi", "eta", "phi_per_m"


def _wheel_wear(run, name, late, strips, width):
    """Return the `WheelWear` of a wheel from its `Strips`, with bins of a ``width`` (m)."""
    share, radius = way_shares(run, name, late)[strips.time], run[name]["z_m"][late][strips.time]
    lost = strips.lost * share

    def depth(ends, volume):  # spread evenly over a strip's width on the profile; the ordinate changes over du
        edges, area = _gathered(ends[0], ends[1], volume, width)
        return edges, area / width

    wheel, rail = depth(strips.wheel, lost / (2.0 * np.pi * radius)), depth(strips.rail, lost)
    return WheelWear(wheel[0], wheel[1], rail[0], rail[1], float(np.sum(lost)), float(np.sum(strips.work * share)))


def _friction_of(scene, trust):
    """Return the largest coefficient of friction of a scene, for runs that do not store it."""
    return read_friction(scene["contact"]["friction"], Reader("scene", laws_of_stored(scene, trust), {}))().largest


def _on_ellipses(run, late, loss, trust, name, side):
    """Return the `Strips` of the ellipses of a wheel."""
    contact, body, outwards, scene = run[f"{name}/{side}"], run[name], SIDES[side], run.scene
    there = ~np.isnan(contact["N_N"][late]) & (contact["N_N"][late] > 0.0)
    rows = {name: contact[name][late][there] for name in _NEEDED}
    times = np.nonzero(there)[0]
    speed = np.broadcast_to(rolling_speed(body, scene["speed"]), late.shape)[late][times]
    # where rails differ or friction changes along them, the bound of the largest one: the amount is the run's own
    friction = run.settings.get("friction_largest") or _friction_of(scene, trust)
    places, dy, dx, work = friction_work(rows, friction, **scene["contact"]["material"])
    taken = loss(Sliding(rows, places, dy, dx, work, friction, speed))
    slope = np.cos(rows["contact_angle_rad"])[:, None]
    ends = np.sort([outwards * (places + side * 0.5 * dy) * slope for side in (-1.0, 1.0)], axis=0)
    across = np.repeat(times, places.shape[1])
    wheel, rail = (rows[f"u_{own}_m"][:, None] + ends for own in ("wheel", "rail"))
    amounts = (np.ravel(np.sum(each, axis=-1) * dx * dy) for each in (taken, work))
    return Strips(across, wheel.reshape(2, -1), rail.reshape(2, -1), *amounts)


def _on_exact_patches(run, late, law, scene, resolution, name, side, otherwise):
    """Return the `Strips` of the exact patches of a wheel, with a law over frictional work.

    At times at which exact patches do not carry the wheel's force, `Strips` of ``otherwise`` are used."""
    solved, parts, missed = WheelInRun(run, scene, name, side, resolution, "local_wear", _SOUGHT), [], []
    known = creep_work(*(run[f"{name}/{side}"][part] for part in _WORKING))[2]
    for time, i in enumerate(np.flatnonzero(late).tolist()):
        found = solved.at(i)
        if not solved.missed <= MISSED:
            missed.append(time)
            continue
        total = sum(float(one.patch.friction_work @ one.patch.cell_area) for one in found)
        for patch, places in ((one.patch, one.places) for one in found if total > 0.0):
            if places is None:  # on a grid, which is plane
                places = _on_plane(patch, run[f"{name}/{side}"], i)
            area, work = patch.cell_area, patch.friction_work * max(known[i], 0.0) / total
            count = places.shape[-1]
            amounts = (np.sum((q * area).reshape(count, -1), axis=1) for q in (law(work) / DENSITY, work))
            parts.append(Strips(np.full(count, time), *places, *amounts))
    if missed:
        warn(f"local_wear: {name}/{side}: ellipses stand in at {len(missed)} of {late.sum()} output times, at which no"
             f" exact patches carry the wheel within {MISSED:.0%}")  # fmt: skip
        ellipses = otherwise(name, side)
        parts.append(Strips(*(part[..., np.isin(ellipses.time, missed)] for part in ellipses)))
    return Strips(*(np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))) if parts else NOTHING


_NEEDED = {"a_m", "b_m", "N_N", "Fx_N", "Fy_N", "Mz_Nm", "xi", "eta", "phi_per_m", "u_wheel_m", "u_rail_m",
           "contact_angle_rad"}  # fmt: skip


def friction_work(rows, friction, shear_modulus, poisson_ratio, strips=STRIPS, steps=STEPS):
    """Compute the frictional work over m patches by FASTSIM.

    ``rows`` are channels a_m to phi_per_m, shapes (m,); the modulus is in Pa. Return middles of the strips y (m,
    strips), their width dy (m, 1), length of the steps dx (m, strips), all m, and work (m, strips, steps) per metre
    rolled and area, N/m^2, from the leading edge on.
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
        # work of slip: the excess traction times softness is the slip, both along the direction of the traction
        lost = (1.0 - cut) * (softness[0] * px * px + softness[1] * py * py)
        px, py = px * cut, py * cut
        work[..., k] = cut * lost / dx
    dy = 2.0 * b / strips
    total = np.sum(np.sum(work, axis=-1) * dx * dy, axis=1)
    known = -(rows["Fx_N"] * rows["xi"] + rows["Fy_N"] * rows["eta"] + rows["Mz_Nm"] * rows["phi_per_m"])
    scale = np.divide(np.maximum(known, 0.0), total, out=np.zeros(total.shape), where=total > 0.0)
    return y, dy, dx, work * scale[:, None, None]


def _on_plane(patch, contact, i):
    """Return `Found.places` of the cells of a grid, relative to the run's patch at the i-th output time with the
    nearest contact angle."""
    k, outwards = int(np.nanargmin(np.abs(contact["contact_angle_rad"][i] - patch.contact_angle))), SIDES[patch.side]
    aside = outwards * (patch.s - patch.centroid[1]) * np.cos(patch.contact_angle)
    ends = aside + 0.5 * np.cos(patch.contact_angle) * np.array([-patch.ds, patch.ds])
    return np.array([contact[f"u_{own}_m"][i, k] + ends for own in ("wheel", "rail")])


def _gathered(low, high, amount, width):
    """Distribute amounts evenly from ``low`` to ``high`` over bins of a ``width``; return edges and amounts of bins."""
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
