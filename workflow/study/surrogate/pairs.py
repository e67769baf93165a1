"""Random pairs of a wheel and a rail, on which the surrogate is trained.

Wheels are the named profiles, cones and cylinders with and without a flange, and worn shapes of these. Rails are all
named heads at any inclination, arcs, and worn or ground shapes of these. A pair depends only on the random generator.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from wrcore.contact.rigid.wheel_on_rail import WheelOnRail
from wrcore.errors import InputError
from wrcore.geometry.profiles.profile import ProfileCurve
from wrcore.geometry.profiles.standards import list_profiles, named_profile


class NamedPair(NamedTuple):
    """Names of the profiles of a pair."""

    wheel: str
    rail: str
    inclination: float | None
    """Inclination of the rail, such as 1/40; None if the rail's file already contains the inclined profile."""


TEST_PAIRS = (
    NamedPair("Car7216_0001r.whl", "60E1", 1 / 40),
    NamedPair("Car7358_0001r.whl", "60E1", 1 / 20),
    NamedPair("Car7422_0001r.whl", "60E2", 1 / 40),
    NamedPair("Car7813_0001r.whl", "avg_low2.ban", None),
    NamedPair("avg_wheel.whl", "avg_HR.BAN", None),
    NamedPair("Car7216_0001r.whl", "avg_low2.ban", None),
    NamedPair("S1002 hollow by 1 mm at 0 mm over 15 mm", "UIC60-MBench", 1 / 40),
    NamedPair("S1002", "54E1", 1 / 40),
    NamedPair("worn_high_mileage.prw", "UIC60-MBench", 1 / 40),
)
"""Pairs on which the network is tested. The training data must not contain them. File names are those of the test bank
of CONTACT (measured profiles), which is not part of the project."""

WHEELS, RAILS = (
    tuple(row["name"] for row in list_profiles() if row["kind"] == kind and ":" not in row["name"])
    for kind in ("wheel", "rail")
)
"""Names of the wheel and rail profiles that have no parameter."""

RADII = 0.2, 0.65
"""Range of the rolling radius, m."""

MOST_INCLINATION = 0.065
"""Maximum inclination of a random rail. The maximum in use is 1/20."""

_SPACING = 1e-4
"""Distance between the points of a worn profile, m."""

_HALF_DISTANCES = 0.4, 0.85
"""Range of the distance between tape circle and wheelset centre, m: from narrow to broad gauge."""

_CLEARANCE = 0.75 - 0.5 * 1.435
"""Distance from the tape circle to the gauge line in standard gauge, m."""


class Pair(NamedTuple):
    """A wheel on its rail, and a text that describes how both profiles were generated."""

    on_rail: WheelOnRail
    name: str


class Measured(NamedTuple):
    """Measured profiles (`ProfileCurve`) from which random pairs may be generated."""

    wheels: tuple = ()
    rails: tuple = ()


def read_measured(folder):
    """Read the `Measured` profiles of a folder: wheels *.whl and *.prw, rails *.ban, *.prr and *.mpt, in any case."""
    refused = {name.lower() for pair in TEST_PAIRS for name in (pair.wheel, pair.rail) if "." in name}
    found = {"wheel": [], "rail": []}
    kinds = {".whl": "wheel", ".prw": "wheel", ".ban": "rail", ".prr": "rail", ".mpt": "rail"}
    for path in sorted(Path(folder).iterdir()):
        kind = kinds.get(path.suffix.lower())
        if kind is None:
            continue
        if path.name.lower() in refused:
            raise InputError(path, "name", "expected no profile of the test pairs, remove the file from the folder")
        found[kind].append(named_profile({"points": str(path), "smoothing": 5e-6}, kind))
    return Measured(tuple(found["wheel"]), tuple(found["rail"]))


def smooth_step(x):
    """Return a step from 0 to 1 over x from 0 to 1, with continuous curvature."""
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x)


def waves(random, u, amplitude, length):
    """Return a Gaussian random function of ``u`` with standard deviation ``amplitude`` and correlation length
    ``length``, both m."""
    nodes = np.arange(u[0] - 4.0 * length, u[-1] + 4.0 * length, length / 3.0)
    kernel = np.exp(-0.5 * ((u[:, None] - nodes) / length) ** 2)
    values = kernel @ random.normal(size=len(nodes))
    return amplitude * values / max(np.std(values), 1e-12)


def hump(u, depth, place, width, power=2):
    """Return a bell-shaped function of ``u`` with depth, position and width in m. A larger power flattens its top."""
    return depth * np.exp(-(np.abs((u - place) / width) ** power))


def log_uniform(random, low, high):
    """Return a random number between two bounds; its logarithm is uniformly distributed."""
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def wheel_base(random, measured):
    """Return a random wheel (`ProfileCurve`) before wear, and its name."""
    kind = random.random()
    if measured.wheels and kind > 0.75:
        wheel = measured.wheels[random.integers(len(measured.wheels))]
        return wheel, wheel.name
    slope = float(random.choice([0.0, 1 / 100, 1 / 40, 1 / 20, 1 / 10]))
    if kind < 0.08:
        name = f"cone:{slope:g}"
        return named_profile(name, "wheel"), name
    wheel = named_profile(WHEELS[random.integers(len(WHEELS))], "wheel")
    if kind < 0.3:
        return _with_cone(wheel, slope), f"{wheel.name} with cone:{slope:g}"
    return wheel, wheel.name


def _points(curve, low, high):
    """Return equally spaced points (u, f) of a curve between two bounds, m."""
    u = np.arange(max(low, curve.u[0]), min(high, curve.u[-1]), _SPACING)
    return u, curve(u)


def _with_cone(wheel, slope):
    """Return a wheel whose tread outside the flange root is replaced by a cone or cylinder."""
    u, f = _points(wheel, -0.060, 0.055)
    share = smooth_step((u + 0.026) / 0.016)
    cone = np.interp(-0.012, u, f) + slope * (u + 0.012)
    f = (1.0 - share) * f + share * cone
    return ProfileCurve.from_points(u, f - np.interp(0.0, u, f), "wheel", wheel.name, trim=True)


NEW_WHEELS, NEW_RAILS = 0.15, 0.25
"""Shares of the wheels and rails that have no wear."""


def worn_wheel(random, wheel, name, new_share=NEW_WHEELS):
    """Return a wheel after random wear, and its name; 15 % of the wheels are unchanged."""
    if random.random() < new_share:
        return wheel, name
    u, f = _points(wheel, -0.060, 0.055)
    has_flange = wheel(np.array([-0.035]))[0] < -2e-3
    if random.random() < 0.5:  # power 2: rounded hollow; power 4: hollow with a flat bottom
        depth = 3e-3 * random.random() ** 2
        width = random.uniform(6e-3, 22e-3)
        f = f + hump(u, depth, random.normal(0.0, 6e-3), width, random.choice([2, 2, 4]))
        name += f", hollow {1e3 * depth:.2f} mm"
    if has_flange and random.random() < 0.5:
        depth = random.normal(0.0, 0.35e-3)
        f = f + hump(u, depth, random.uniform(-0.034, -0.016), random.uniform(4e-3, 9e-3))
        name += f", root {1e3 * depth:+.2f} mm"
    if has_flange and random.random() < 0.4:
        thinner = random.uniform(0.0, 4e-3)
        f = np.interp(u + thinner * (1.0 - smooth_step((u + 0.042) / 0.018)), u, f)
        name += f", flange -{1e3 * thinner:.1f} mm"
    if random.random() < 0.4:
        f = f + waves(random, u, log_uniform(random, 3e-6, 4.8e-5), random.uniform(2e-3, 4e-3))
        name += ", short waves"
    if random.random() < 0.5:
        f = f + waves(random, u, log_uniform(random, 1e-5, 1.2e-4), random.uniform(5e-3, 16e-3))
        name += ", long waves"
    if has_flange and random.random() < 0.4:
        flank = 1.0 - smooth_step((u + 0.034) / 0.012)
        f = f + flank * waves(random, u, log_uniform(random, 1e-5, 1.2e-4), random.uniform(0.8e-3, 2.5e-3))
        name += ", waves of the flank"
    return ProfileCurve.from_points(u, f - np.interp(0.0, u, f), "wheel", "worn", trim=True), name


def rail_base(random, measured):
    """Return a random rail (`ProfileCurve`) before wear, its name, and its inclination or None."""
    kind = random.random()
    if measured.rails and kind > 0.85:
        rail = measured.rails[random.integers(len(measured.rails))]
        return rail, rail.name, None
    if kind < 0.05:
        name = f"circle:{random.uniform(0.1, 0.5):.3f}"
        return named_profile(name, "rail"), name, None
    name = RAILS[random.integers(len(RAILS))]
    inclination = float(random.choice([0.0, 1 / 40, 1 / 30, 1 / 20]))
    if random.random() < 0.5:
        inclination = random.uniform(0.0, MOST_INCLINATION)
    return named_profile(name, "rail", inclination), f"{name} at {inclination:.4f}", inclination


def worn_rail(random, rail, name, wheel, shift, new_share=NEW_RAILS):
    """Return a rail after random wear or grinding, and its name; a quarter of the rails are unchanged.

    ``shift`` is the lateral position of the wheel's tape circle relative to the rail, m. Wear is on the gauge side
    (u < 0) or, for a rail that was turned round in the track, on the field side."""
    if random.random() < new_share:
        return rail, name
    u, new = _points(rail, -0.1, 0.1)
    f, side = new.copy(), (1.0 if random.random() < 0.85 else -1.0)
    worn = smooth_step((u - u[0] - 1e-3) / 6e-3) * (1.0 - smooth_step((u - u[-1] + 7e-3) / 6e-3))
    if random.random() < 0.4:
        f = f - hump(u, random.uniform(-0.2e-3, 1.5e-3), random.normal(0.0, 6e-3), random.uniform(10e-3, 25e-3))
        name += ", crown worn"
    if random.random() < 0.4:
        place = side * random.uniform(-0.034, -0.016)
        f = f - hump(u, random.uniform(-0.2e-3, 1.2e-3), place, random.uniform(4e-3, 9e-3))
        name += f", {'gauge' if side > 0 else 'field'} corner worn"
    if random.random() < 0.2:
        f = _ground(random, u, f)
        name += ", ground"
    if random.random() < 0.25:
        f = f + worn * _towards_wheel(random, u, f, wheel, shift)
        name += ", worn to its wheel"
    if random.random() < 0.3:
        f = f + worn * waves(random, u, log_uniform(random, 3e-6, 3e-5), random.uniform(2e-3, 5e-3))
        name += ", short waves"
    if random.random() < 0.4:
        f = f + worn * waves(random, u, log_uniform(random, 1e-5, 1e-4), random.uniform(5e-3, 14e-3))
        name += ", long waves"
    return ProfileCurve.from_points(u, f, "rail", "worn", trim=True), name


def _smoothed(values, width):
    """Return values at the points of a profile, averaged with a Gaussian kernel of this standard deviation (m)."""
    n = int(4.0 * width / _SPACING)
    kernel = np.exp(-0.5 * (np.arange(-n, n + 1) * _SPACING / width) ** 2)
    return np.convolve(np.pad(values, n, mode="edge"), kernel / kernel.sum(), "valid")


def _ground(random, u, f):
    """Return the heights of a ground rail: facets 3 to 8 mm wide, with edges rounded over about 1 mm."""
    edges = np.cumsum(random.uniform(3e-3, 8e-3, 30)) - 0.03
    edges = edges[edges < 0.03]
    inside = (u > edges[0]) & (u < edges[-1])
    facets = np.where(inside, np.interp(u, edges, np.interp(edges, u, f)) - f, 0.0)
    return f + _smoothed(facets, random.uniform(0.6e-3, 1.5e-3))


def _towards_wheel(random, u, f, wheel, shift):
    """Return the height to add to a rail so that it is partly worn to the shape of its wheel, at most 3 mm."""
    there = u - shift - random.normal(0.0, 3e-3)
    inside = (there > wheel.u[0]) & (there < wheel.u[-1])
    fit = inside & (u > -0.028) & (u < 0.014)
    if fit.sum() < 10:
        return np.zeros_like(u)
    difference = np.where(inside, np.nan_to_num(wheel(there)) - f, 0.0)
    line = np.polyfit(u[fit], difference[fit], 1)
    difference = np.clip(difference - np.polyval(line, u) * random.uniform(0.6, 1.0), -3e-3, 3e-3)
    return _smoothed(inside * random.uniform(0.15, 0.95) * difference, 7e-4)


def _one_pair(random, measured, new_share):
    """Return a random `Pair`, or None if it is a test pair."""
    wheel, wheel_name = worn_wheel(random, *wheel_base(random, measured), new_share or NEW_WHEELS)
    rail, rail_name, inclination = rail_base(random, measured)
    half = 0.75 if random.random() < 0.6 else random.uniform(*_HALF_DISTANCES)
    gauge = rail.gauge_offset()
    if not gauge < 0.05:  # an arc has no gauge corner; its crown is placed near the tape circle
        gauge = _CLEARANCE
    distance = half - _CLEARANCE + gauge + (random.normal(0.0, 2e-3) if random.random() < 0.6 else 0.0)
    new = rail_name
    rail, rail_name = worn_rail(random, rail, rail_name, wheel, half - distance, new_share or NEW_RAILS)
    radius = 0.46 if random.random() < 0.25 else random.uniform(*RADII)
    if rail_name == new and is_test_pair(wheel_name, rail_name.partition(" ")[0], inclination):
        return None
    on_rail = WheelOnRail(
        wheel, rail, rolling_radius=float(radius), half_distance=float(half), rail_distance=float(distance)
    )
    return Pair(on_rail, f"{wheel_name} | {rail_name} | {radius:.3f} m")


def is_test_pair(wheel, rail, inclination):
    """Whether new profiles with these names form one of the `TEST_PAIRS`."""
    return any(
        (wheel, rail) == (pair.wheel, pair.rail) and abs((inclination or 0.0) - (pair.inclination or 0.0)) < 1e-4
        for pair in TEST_PAIRS
    )


def random_pair(random, measured=None, new_share=0.0):
    """Return a random `Pair` that is no test pair. A pair with invalid profiles is replaced by a new random pair.

    Parameters
    ----------
    random : numpy.random.Generator
    measured : Measured, optional
        Profiles from which some of the wheels and rails are generated.
    new_share : float, optional
        Share of wheels, and of rails, without wear; 0: `NEW_WHEELS` and `NEW_RAILS`.

    Raises
    ------
    InputError
        If 50 successive pairs are test pairs or have invalid profiles.
    """
    reason = None
    for _ in range(50):
        try:
            pair = _one_pair(random, measured or Measured(), new_share)
            if pair is not None:
                _ = pair.on_rail.geometry
                return pair
        except (InputError, ValueError) as error:
            reason = error
    raise InputError("pairs", "profiles", f"expected one usable pair of 50, the last was refused: {reason}")
