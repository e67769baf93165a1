"""Random positions of a wheel over its rail, and the selection of the patches to solve."""

import math

import numpy as np

from study.surrogate.finding import LOAD, OVERLAPS
from study.surrogate.pairs import log_uniform
from study.surrogate.solution import ExactPatches
from wrcore.contact.surrogate.network import load_surrogate

LOADS = 500.0, 2.5e5
"""Range of the normal force, N."""

FRICTIONS = 0.03, 0.8
"""Range of the coefficient of friction."""

MOST_ANGLE = 1.35
"""Maximum contact angle, rad."""

SPECIAL = 0.5
"""Maximum share of a pair's selected patches that have several overlaps or a double shape. Some pairs have no such
patches, therefore they are about a fifth of all patches."""

TWINS = 0.4
"""Share of a pair's patches that are twins. The error of linear critical speeds is 1.4 m/s without twins and 0.5 m/s
with them (mean of six pairs)."""

POSITIONS = 2000
"""Number of random positions for each pair. Few of them are selected; the large number ensures patches with several
overlaps and patches on flanks. The positions take a third of the time."""

_ANGLES = np.array([0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9, 1.1])
"""Limits of the classes of contact angle, rad. Patches are selected evenly from the classes."""

_STEEP = 6
"""Index of the first class of flanks (from 0.7 rad). Their patches get twice the weight, because no twins are selected
on flanks."""

_DOUBLE = 1.8
"""Value of <e^4> below which the shape of a patch is double. A parabolic overlap has 2.33, two equal peaks have 1."""

_KURTOSIS = 18
"""Index of <e^4> in the descriptors."""

_MOST_ATTACK = 0.016
"""Maximum angle of attack of positions in curves, rad."""

_ROOT_ANGLES = 0.1, 1.0
"""Range of the mean contact angle of positions in curves, rad."""

_TWIN_STEPS = 2.5e-5, 2.5e-4
"""Range of the lateral distance between twins, m."""

_TWIN_LOADS = 0.3, 3.0
"""Range of the ratio between the loads of twins."""


def scaled_inputs(descriptors):
    """Return descriptors (n, N_DESCRIPTORS), shifted, scaled and compressed like inputs of the package's network."""
    surrogate = load_surrogate()
    x = (np.asarray(descriptors, float) - surrogate.median) * surrogate.per_scale
    return x / (1.0 + x * x) ** 0.25


def random_friction(random):
    """Return a random coefficient of friction: 0.3 for about a third of the pairs, otherwise from the whole range."""
    return 0.3 if random.random() < 0.35 else log_uniform(random, *FRICTIONS)


def axle_of(yaw, slope):
    """Return the unit vector (x, y, z) along an axle with these x and z components."""
    return yaw, math.sqrt(1.0 - yaw * yaw - slope * slope), slope


def is_wanted(exact, found):
    """Whether a patch (`Found`) is in the range of the training. The load is estimated by that of the parabolic
    overlap."""
    low, high = LOADS
    is_in_range = low < found.numbers[LOAD] < 1.1 * high and abs(found.shape.angle) < MOST_ANGLE
    return is_in_range and exact.is_inside(found)


def is_special(found):
    """Whether a patch has several overlaps or a double shape."""
    return found.numbers[OVERLAPS] > 1 or found.descriptors[_KURTOSIS] < _DOUBLE


def draw_positions(random, exact: ExactPatches, count=POSITIONS, curving=0.0, centred=0.0):
    """Return the list of patches (`Found`) at random positions of the wheelset.

    A share ``curving`` of the positions is drawn as for a leading wheel in a narrow curve (`_in_curve`), a share
    ``centred`` as for a wheelset that runs near the centre of a straight track."""
    drawn = []
    for _ in range(count):
        kind = random.random() if curving or centred else 1.0
        if kind < curving:
            y, z, axle = _in_curve(random, exact)
        elif kind < curving + centred:
            y, axle, depth = _near_centre(random, exact)
            z = exact.touch(y, axle) - depth
        else:
            y, axle, depth = _anywhere(random, exact)
            z = exact.touch(y, axle) - depth
        drawn += [one for one in exact.find(y, z, axle) if is_wanted(exact, one)]
    return drawn


def _centre(exact):
    """Return the distance (m) to add to the lateral positions that are chosen for the usual width of the track."""
    return exact.model.geometry.rail_distance - exact.model.geometry.half_distance - 0.0105


def _anywhere(random, exact):
    """Return a random lateral position (m), unit vector of the axle, and depth below first touch (m)."""
    yaw = 0.0 if random.random() < 0.25 else float(np.clip(random.normal(0.0, 6e-3), -0.024, 0.024))
    axle = axle_of(yaw, random.normal(0.0, 2.5e-3))
    y = random.uniform(-9e-3, 14e-3) if random.random() < 0.6 else random.uniform(2e-3, 12e-3)
    return y + _centre(exact), axle, log_uniform(random, 4e-6, 2e-4) * random.choice([1.0, 1.0, 2.0])


def _near_centre(random, exact):
    """Return a random lateral position (m) within 4 mm of the track's centre, unit vector of the axle, and depth below
    first touch (m)."""
    axle = axle_of(random.normal(0.0, 3e-3), random.normal(0.0, 5e-4))
    return random.uniform(-4e-3, 4e-3) + _centre(exact), axle, log_uniform(random, 2e-5, 1.2e-4)


def _in_curve(random, exact):
    """Return a random position (y, z, unit vector of the axle) of the outer wheel of a leading wheelset in a curve.

    The wheel has an angle of attack, and a mean contact angle between those of tread and flank. In a tenth of the
    positions the wheelset rolls backward, so that the sign of the angle of attack is opposite."""
    yaw = -random.uniform(0.0, _MOST_ATTACK) * random.choice([-1.0] + 9 * [1.0])
    axle, depth = axle_of(yaw, random.normal(4e-4, 9e-4)), log_uniform(random, 4e-5, 1.7e-4)
    angle, low, high = random.uniform(*_ROOT_ANGLES), _centre(exact) - 2e-3, _centre(exact) + 14e-3
    while high - low > 5e-6:
        y = 0.5 * (low + high)
        low, high = (low, y) if _mean_angle(exact, y, axle, depth) > angle else (y, high)
    y = random.uniform(low - 1e-5, high + 1e-5)
    return y, exact.touch(y, axle) - depth, axle


def _mean_angle(exact, y, axle, depth):
    """Return the contact angle of all patches at a position, rad, weighted by their loads; infinite without patches."""
    found = exact.find(y, exact.touch(y, axle) - depth, axle)
    load = sum(one.numbers[LOAD] for one in found)
    return sum(one.numbers[LOAD] * one.shape.angle for one in found) / load if load > 0.0 else math.inf


def choose(random, drawn, count, far=0.0):
    """Select ``count`` patches evenly over contact angle; a share `SPECIAL` has several overlaps or a double shape.

    A share ``far`` of the patches is selected before, such that their descriptors are far from each other."""
    if far:
        apart = _far_apart(random, np.array([scaled_inputs(one.descriptors) for one in drawn]), int(round(far * count)))
        rest = [one for k, one in enumerate(drawn) if k not in set(apart)]
        return [drawn[k] for k in apart] + choose(random, rest, count - len(apart))
    special = np.array([is_special(one) for one in drawn])
    n = min(int(round(SPECIAL * count)), int(special.sum()))
    chosen = _evenly(random, drawn, np.flatnonzero(special), n)
    chosen += _evenly(random, drawn, np.flatnonzero(~special), count - n)
    return [drawn[k] for k in chosen]


def _far_apart(random, inputs, count):
    """Return indices of at most ``count`` rows of ``inputs``; each is the one farthest from those selected before."""
    count = min(count, len(inputs))
    chosen, least = [], np.full(len(inputs), np.inf)
    for _ in range(count):
        chosen.append(int(least.argmax()) if chosen else int(random.integers(len(inputs))))
        least = np.minimum(least, ((inputs - inputs[chosen[-1]]) ** 2).sum(1))
    return chosen


def _evenly(random, drawn, among, count):
    """Return indices of at most ``count`` patches out of ``among``, evenly over classes of contact angle."""
    count = min(count, len(among))
    if count == 0:
        return []
    classes = np.digitize([abs(drawn[k].shape.angle) for k in among], _ANGLES)
    weights = 1.0 / np.maximum(np.bincount(classes, minlength=len(_ANGLES) + 1)[classes], 5.0)
    weights *= np.where(classes >= _STEEP, 2.0, 1.0)
    return list(random.choice(among, count, replace=False, p=weights / weights.sum()))


def twin_of(random, exact, found):
    """Return a twin of a patch and their lateral distance (m), or None if there is no such patch.

    A twin is at most 250 µm away laterally, and its load is 0.3 to 3 times that of the first patch."""
    y, z, ex, _, ez = found.position
    step = log_uniform(random, *_TWIN_STEPS) * random.choice([-1.0, 1.0])
    turn = 5e-5 * random.normal() if random.random() < 0.3 else 0.0
    z += math.tan(found.shape.angle) * step - exact.model.geometry.half_distance * turn
    z += 2e-6 * random.normal() if random.random() < 0.3 else 0.0
    near = exact.find(y + step, z, axle_of(ex, ez + turn))
    if not near:
        return None
    twin = min(near, key=lambda one: abs(one.shape.lateral - found.shape.lateral))
    ratio = twin.numbers[LOAD] / found.numbers[LOAD]
    return (twin, abs(step)) if is_wanted(exact, twin) and _TWIN_LOADS[0] < ratio < _TWIN_LOADS[1] else None


def choose_twins(random, exact, drawn, count):
    """Return up to ``count`` triples (patch, twin, distance in m) on treads and flange roots.

    In a quarter of the trials the first patch has several overlaps, if there are such patches."""
    low = [one for one in drawn if abs(one.shape.angle) < 0.7]
    births = [one for one in low if one.numbers[OVERLAPS] > 1]
    found = []
    for _ in range(4 * count):
        among = births if births and random.random() < 0.25 else low
        if len(found) >= count or not among:
            break
        one = among[random.integers(len(among))]
        twin = twin_of(random, exact, one)
        if twin is not None:
            found.append((one, *twin))
    return found
