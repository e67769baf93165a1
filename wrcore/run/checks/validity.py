"""Flags of contact patches and wheelsets outside the range of validity of the contact models.

A run counts them at its output times, not during integration.

=====================  ================================================================================================
`half_space`           patches whose semi-axis across exceeds `WIDEST` of the smaller lateral radius of curvature there
`conformal`            patches in a hollow of the wheel over which the normal turns by more than `WIDEST_TURN`
`profile_edge`         patches that reach beyond the end of a profile
`search_fallback`      wheels whose roll or yaw is so large that the search evaluated every strip
`not_parabolic`        patches whose gap along the rail is no parabola (`wrcore.run.checks.shape_along`)
`before_irregularity`  output times at which no wheelset has reached the first sample of the track's irregularity
`beyond_irregularity`  wheelsets past the last sample of the track's irregularity, on perfect rails again
`hollow_ahead`         patches of a yawed wheel (spatial detection) whose surface there is hollow along the rail
`both_flanges`         wheelsets that touch with the flanges of both wheels: too wide for the gauge
=====================  ================================================================================================

A patch at an output time is counted once. Events between outputs (creepages outside the lookup table, collapses of the
step size) are counted during integration.

*Half-space.* Hertz's theory approximates both bodies by half-spaces and their surfaces by paraboloids. The patch must
be small compared with the radii of curvature (Johnson, Contact Mechanics (1985), section 4.1). The limit is our choice:
at b = R/3 the height of the parabola has an error of (b/R)^2/4 = 2.8 % relative to a circle at the edge of the patch,
where the surface is inclined by 19 degrees. *Conformal.* The pressure acts along the local normal of the surface. If
the normal turns by 0.35 rad (20 degrees) over the patch, the pressure at its edges deviates by 10 degrees from the
patch's single normal, and 17 % of it lie in the tangent plane. Curvatures are those used in Hertz's theory, averaged
over the profile's window. *Hollow ahead.* A strip touches at the point at which its normal has no component along the
rail. This is the deepest point as long as the wheel's normal curvature along the rail,
cos^2(chi)/(R sqrt(1 + R'^2)) + kappa sin^2(chi) with sin(chi) = sin(yaw) sqrt(1 + R'^2), is positive: at the steepest
point of the flange root of S1002 up to 33 mrad of yaw. At larger yaw this point is not a contact point.
"""

import numpy as np

from wrcore.contact.search import reduction
from wrcore.contact.search.detection import PLANAR
from wrcore.contact.search.geometry import (
    CURVATURE,
    LARGEST_OFFSET,
    OFFSET_PER_ROLL,
    OFFSET_PER_YAW_SQUARE,
    SLOPE,
    VALUE,
)
from wrcore.kernels.handles import values_of

WIDEST = 1.0 / 3.0  # largest semi-axis across rolling over the smaller radius of curvature
WIDEST_TURN = 0.35  # largest turn of the normal over a patch in a hollow, rad
FLANGE = 0.5  # contact angle from which a wheel touches with its flange, rad
FLANK = 10e-3  # depth below the tape circle, m; contact points beyond it are on the tip of the flange

LIMITS = {
    "half_space": "patches too wide for a half-space",
    "conformal": "conformal patches",
    "profile_edge": "patches at a profile's end",
    "search_fallback": "wheels searched strip by strip",
    "hollow_ahead": "patches of wheels too yawed for their hollow",
    "both_flanges": "wheelsets with both flanges on the rails",
    "not_parabolic": "patches whose surfaces along the rail are no parabola",
    "table_out_of_range": "creep look-ups out of the table's range",
    "step_collapses": "collapses of the step size",
    "rails_unbalanced": "evaluations without a balance of rails without mass",
    "before_irregularity": "output times before the beginning of the irregularity",
    "beyond_irregularity": "wheelsets past the end of the irregularity",
}
"""Names of a run's counters in messages and summaries."""

MEANINGS = {
    "patches": "patches that were looked at",
    "half_space": "a patch wider than a third of the smaller lateral radius of curvature (semi-axis over radius)",
    "conformal": "a patch in a hollow of the wheel over which the contact normal turns by more than 0.35 rad",
    "profile_edge": "a patch that reaches beyond the end of the wheel's or the rail's profile",
    "search_fallback": "a wheel with so large a roll or yaw that the search evaluated every strip (exact, but slower)",
    "hollow_ahead": "a patch of a wheel so yawed that its surface there is hollow along the rail: spatial detection "
    "finds no deepest point",
    "both_flanges": "a wheelset that touches with both flanges: it does not fit between the rails",
    "not_parabolic": "a patch on a wheel out of round, a crossing or a corrugated rail whose gap along the rail leaves "
    "the parabola of a run by more than 5 % of the penetration: p_max may be too low there. "
    "`not_parabolic_WHEELSET_SIDE` counts the output times of each wheel that has any",
    "before_irregularity": "an output time at which no wheelset has reached the first sample of the irregularity",
    "beyond_irregularity": "a wheelset past the last sample of the track's irregularity, on perfect rails again",
    "look_up_normal_error": "largest interpolation error of the normal force in the cells used, relative to it",
    "look_up_force_error": "largest interpolation error of the creep force in the cells used, relative to μN",
    "look_up_pressure_error": "largest interpolation error of the maximum pressure in the cells used, relative to it",
    "steps": "accepted steps",
    "rejected": "steps that the error estimate refused",
    "rhs_evaluations": "evaluations of the equations of motion",
    "jacobians": "Jacobians that were computed",
    "factorisations": "factorisations of the linear system of a step",
    "smallest_step_s": "shortest accepted step, s",
    "step_collapses": "a step that was rejected three times in a row or more",
    "table_out_of_range": "a creep look-up outside the table; the nearest patch inside is taken. With `tabulated` the "
    "parts of a patch that is bent are looked up, too: some hundred counts in a tight curve",
    "patches_on_grid": "a patch of `exact` for which no strips converged: solved on a uniform grid",
    "patches_on_fixed_strips": "a patch of `exact` for which no strips end at its tips: solved on fixed strips",
    "patches_not_tabulated": "a patch of `tabulated` outside its table: solved directly, at the price of `exact`",
    "patches_outside_training": "a patch of `surrogate` whose form is far outside the range of its training: what the "
    "network adds to an ellipse is reduced there",
    "rails_unbalanced": "an evaluation in which [rails without mass](tracks.md) found no balance of spring, damper and "
    "wheel; the last try is taken",
    "wall_s": "time of the integration on the clock, s",
}
"""Meaning of each counter of a run; ``python -m docs.counters`` writes this table into how_runs_end.md."""

FLAGS = {
    "half_space": "1 where the patch is too wide for a half-space, else 0",
    "conformal": "1 where the patch lies in a hollow over which the normal turns too far, else 0",
    "profile_edge": "1 where the patch reaches beyond the end of a profile, else 0",
    "search_fallback": "1 where roll or yaw is so large that every strip was searched, else 0",
    "hollow_ahead": "1 where the wheel is yawed too far for its hollow, else 0",
    "both_flanges": "1 where both flanges of the wheelset touch: too wide for the gauge, else 0",
}
"""Meaning of each flag of patches in static results, by the name of the run's counter."""

LOOK_UP_ERRORS = "look_up_normal_error", "look_up_force_error", "look_up_pressure_error"
"""Counters of a run with a lookup table of exact contact: interpolation errors of its cells relative to the exact
solver, see :func:`look_up_errors`."""

_OF_PROFILES = ("half_space", "conformal", "profile_edge", "hollow_ahead")  # flags that depend on the profiles


def exceeded(contact, patches, roll, yaw):
    """Count patches and wheelsets that exceed each limit, by the names of `FLAGS`, and all ``patches``.

    ``patches`` (n, k, 2, MAX_PATCHES, PATCH_COLUMNS), NaN where absent, are results of
    :func:`wrcore.equations.outputs.evaluations_at`. ``roll`` and ``yaw`` (n, k), rad, are those of the wheelsets
    relative to the track.
    """
    counts = {name: int(np.sum(found)) for name, found in flags(contact, patches, roll, yaw).items()}
    counts["search_fallback"] *= 2  # both wheels of a wheelset
    return {"patches": int(np.sum(np.isfinite(patches[..., reduction.NORMAL]))), **counts}


def flags(contact, patches, roll, yaw):
    """Return which limits are exceeded, bool, by the names of `FLAGS`; arguments as for `exceeded`.

    Flags of patches have shape (n, k, 2, MAX_PATCHES); search_fallback and both_flanges of wheelsets have (n, k).
    """
    flanges = np.any(patches[..., reduction.ANGLE] * np.array([[1.0], [-1.0]]) > FLANGE, axis=-1)  # (n, k, 2)
    offset = OFFSET_PER_ROLL * np.abs(np.sin(roll)) + OFFSET_PER_YAW_SQUARE * _tilt(contact, yaw) ** 2  # as in search
    found = {name: np.zeros(patches.shape[:-1], bool) for name in _OF_PROFILES}
    for k in range(patches.shape[1]) if contact.geometries else (slice(None),):
        for wheel in range(2) if contact.geometries else (slice(None),):
            geometry = contact.geometries[2 * k + wheel] if contact.geometries else contact.geometry
            shape = patches.shape[:-1]
            tilt = np.broadcast_to(_tilt(contact, yaw)[..., None, None], shape)[:, k, wheel]
            raised = np.broadcast_to((np.tan(roll)[..., None] * [1.0, -1.0])[..., None], shape)[:, k, wheel]
            inside = patches[:, k, wheel, :, reduction.U_WHEEL] < _flank(geometry)  # on the tip of the flange
            flanges[:, k, wheel] |= np.any(inside, axis=-1)
            for name, values in _of_profiles(geometry, patches[:, k, wheel], tilt, raised).items():
                found[name][:, k, wheel] = values
    return found | {"search_fallback": offset > LARGEST_OFFSET, "both_flanges": np.all(flanges, axis=-1)}


def _flank(geometry):
    """Return the lateral coordinate (m) of the wheel's flank `FLANK` below its tape circle; -inf without a flange."""
    places = geometry.wheel_start + geometry.wheel_step * np.arange(len(geometry.wheel))
    radii = geometry.wheel[:, VALUE]
    return places[(places < 0.0) & (radii > np.interp(0.0, places, radii) + FLANK)].max(initial=-np.inf)


def _tilt(contact, yaw):
    return np.tan(yaw) if contact.detection != PLANAR else np.zeros_like(yaw)


def _of_profiles(geometry, patches, tilt, raised):
    """Return flags, bool (...), by the names of `_OF_PROFILES`, of patches (..., PATCH_COLUMNS) of wheels with one
    geometry; ``tilt`` (...) is the tangent of the yaw, ``raised`` (...) the slope by which roll lifts the field side of
    the wheel."""
    present = np.isfinite(patches[..., reduction.NORMAL])
    rows, out = patches[present], {}
    width = rows[:, reduction.SEMI_B]
    wheel, wheel_ends, larger, slope = _profile(
        geometry.wheel, geometry.wheel_start, geometry.wheel_step, rows[:, reduction.U_WHEEL]
    )
    rail, rail_ends, *_ = _profile(geometry.rail, geometry.rail_start, geometry.rail_step, rows[:, reduction.U_RAIL])
    reach = width * np.cos(rows[:, reduction.ANGLE])
    sine_square = tilt[present] ** 2 * (1.0 + slope**2)  # of chi
    hollow = (geometry.rolling_radius + larger) * wheel * np.sqrt(1.0 + slope**2)
    exceeds = (
        width * np.maximum(abs(wheel), abs(rail)) > WIDEST,
        (wheel < 0.0) & (2.0 * width * rail > WIDEST_TURN),
        (wheel_ends < reach) | (rail_ends < reach) | _overlaps_at_end(geometry, rows, raised[present]),
        1.0 - sine_square + hollow * sine_square < 0.0,
    )
    for name, values in zip(_OF_PROFILES, exceeds, strict=True):
        out[name] = np.zeros(present.shape, bool)
        out[name][present] = values
    return out


def _overlaps_at_end(geometry, rows, raised):
    """Whether profiles still overlap at the end of the shorter one, bool (m,), for patches ``rows`` (m, PATCH_COLUMNS).

    Ellipses stand for the whole overlap of the undeformed profiles. Beyond the end of a profile a part of it is
    missing, even where the ellipse is narrower than the distance to the end.
    """
    u_wheel, u_rail = rows[:, reduction.U_WHEEL], rows[:, reduction.U_RAIL]
    sides = []
    for nodes, start, step, u in (
        (geometry.wheel, geometry.wheel_start, geometry.wheel_step, u_wheel),
        (geometry.rail, geometry.rail_start, geometry.rail_step, u_rail),
    ):
        places = start + step * np.arange(len(nodes))
        sides.append((places, nodes[:, VALUE], u, np.interp(u, places, nodes[:, VALUE])))
    found = np.zeros(len(rows), bool)
    for end, nearer in ((0, np.maximum), (-1, np.minimum)):
        way = nearer(*(places[end] - u for places, _, u, _ in sides))  # from the contact point to the nearer end
        gap = raised * way + sum(at - np.interp(u + way, places, values) for places, values, u, at in sides)
        found |= gap * np.cos(rows[:, reduction.ANGLE]) < rows[:, reduction.PENETRATION]
    return found


def look_up_errors(contact, patches):
    """Return the `LOOK_UP_ERRORS` of ``patches`` (n, k, 2, MAX_PATCHES, PATCH_COLUMNS) from the tables of a contact
    model; empty without tables.

    They are the largest errors at the centres of the table cells that were used. The error of a wheel's normal force is
    relative to this force, that of its creep force (with the error of its modes) relative to friction times normal
    force, that of the maximum pressure relative to this pressure.
    """
    if not contact.strips.looked_up:
        return {}
    if not len(patches):
        return dict.fromkeys(LOOK_UP_ERRORS, 0.0)
    wheels = values_of(contact.wheels) or (contact,) * (2 * patches.shape[1])
    cells = np.nan_to_num(patches[..., reduction.CELL]).astype(int).reshape(len(patches), -1, reduction.MAX_PATCHES)
    misses = [one.strips.table.misses[np.unique(cells[:, i])] for i, one in enumerate(wheels)]
    normal, force, pressure, left = np.vstack([np.zeros((1, 4)), *misses]).T
    return {
        name: float(error.max()) for name, error in zip(LOOK_UP_ERRORS, (normal, force + left, pressure), strict=True)
    }


def _profile(nodes, start, step, u):
    """Return curvature (1/m, positive where convex), distance to the nearer end (m), value and slope of a profile at u.

    The wheel's radius and the rail's height are both positive outwards from the body.
    """
    places = start + step * np.arange(len(nodes))
    value, slope, second = (np.interp(u, places, nodes[:, column]) for column in (VALUE, SLOPE, CURVATURE))
    return -second / (1.0 + slope**2) ** 1.5, np.minimum(u - places[0], places[-1] - u), value, slope
