"""Modes of what exact contact adds to the creep table: ``python -m study.patch.creep_modes [POSES] [--out FILE]
[--friction MU ...]``.

Exact patches are solved for creepages all over the disk: at places of nodes that come with the package, where runs have
passed, as many of each range of contact angles; and at random ones, of the whole tread, of the flange and of wide
contacts between them, of four pairs of profiles. The remainder beside the creep table at the ellipse of equal moments,
or at those of a bent patch's parts, is fitted with quadratic B-splines, pose by pose. A node is solved for a few
creepages: those from which, all poses together, least squares tell most of the rest of the remainder. The principal
components of what they tell are the modes (a regression of reduced rank): of a family of contacts of little spin, and
one of contacts of much (``FLANKS`` of `wrcore.wheels.table.lookup`). Each of some coefficients of friction has its own.
They come with the package (``wrcore/wheels/table/tables/creep_modes.h5``) and serve all pairs: where one lobe carries,
foreign modes are as good as a pair's own. Prints how well a node's few solutions give the remainder of poses that were
kept back, over mu N in %, by contact angle: median, 95 % and 99 %.

Those that come with the package are made so from the nodes that came with it until then, for 0.05 and 0.3 of 1800
poses, for the others of 900.

References
----------
Izenman, J. Multivariate Anal. 5 (1975) 248 (regression of reduced rank).
"""

import argparse
import math

import h5py
import numpy as np

from study.patch.look_up_errors import PAIRS
from wrcore.analysis.contact.loaded import LoadedWheels
from wrcore.contact.patch.model import MODES
from wrcore.errors.checked_hdf5 import new_hdf5
from wrcore.wheels.table import lookup as columns
from wrcore.wheels.table.cells import node_of
from wrcore.wheels.table.creep_modes import SHIPPED, Modes, creep_modes, mode_weights
from wrcore.wheels.table.lookup import NARROW, WIDE
from wrcore.wheels.table.solver import place_of, side_by_side
from wrcore.wheels.table.store import pair_of

SAMPLES, NEAR, CELLS, SOLUTIONS = 400, 150, 24, 20
"""Creepages of a pose all over the disk, and near none; cells of the splines across the disk; and solutions from which
a node's coefficients come."""

REGIONS = {
    "tread": ((-7e-3, 7e-3), (-0.045, 0.02), (1e-5, 1.2e-4)),
    "flange": ((3.5e-3, 9e-3), (-0.05, -0.025), (6e-6, 1.2e-4)),
    "light flange": ((5e-3, 8e-3), (-0.042, -0.03), (6e-6, 4e-5)),
    "wide": ((4e-3, 6.5e-3), (-0.016, 0.008), (4e-5, 2e-4)),
}
"""Where poses lie: lateral place of the wheel, place on its profile, and depth, m."""

FRICTIONS = 0.05, 0.12, 0.3, 0.7
"""Coefficients of friction that have modes."""

ANGLES = np.append(np.arange(0.0, 1.15, 0.1), 1.3)
"""Ranges of contact angles, of each of which there are as many places of nodes."""

KEPT = 4
"""One of so many poses is kept back, and modes are tried on it."""

SMOOTHING, NOISE = 1e-3, 1e-3
"""Weight of the splines' second differences, and error of a solution over mu N."""

EVENED, FLOOR = 0.5, 5e-3
"""A pose counts for its remainder (root mean square, over mu N, and the second) to the power of 1 less the first: what
is wide and bent has ten times the remainder of the rest."""


def disk(n):
    """Creepages (n, 2) over those of saturation, evenly over the stereographic disk."""
    k = np.arange(n) + 0.5
    radius, angle = 0.99 * np.sqrt(k / n), math.pi * (1.0 + math.sqrt(5.0)) * k
    return (2.0 * radius / (1.0 - radius**2) * np.stack([np.cos(angle), np.sin(angle)])).T


def in_disk(points):
    """Places (n, 2) in the disk of creepages, see `DISK` of `wrcore.wheels.table.lookup`."""
    return points / (columns.DISK + np.sqrt(columns.DISK**2 + (points**2).sum(axis=1)))[:, None]


def splines(places, cells=CELLS):
    """Values (n, (cells + 2)^2) of all B-splines at places of the disk."""
    at = 0.5 * (places + 1.0) * cells
    first = np.minimum(at.astype(int), cells - 1)
    f = at - first
    weights = np.stack([0.5 * (1.0 - f) ** 2, 0.5 + f * (1.0 - f), 0.5 * f**2])
    values = np.zeros((len(places), cells + 2, cells + 2))
    rows = np.arange(len(places))
    for a in range(3):
        for b in range(3):
            values[rows, first[:, 0] + a, first[:, 1] + b] = weights[a, :, 0] * weights[b, :, 1]
    return values.reshape(len(places), -1)


def visited_places(count, random):
    """Some ``count`` places of nodes that come with the package."""
    with h5py.File(SHIPPED / "nodes.h5") as file:
        nodes, angles = file["0/nodes"][...], np.abs(file["0/numbers"][:, columns.ANGLE])
    places = []
    for low, high in zip(ANGLES, ANGLES[1:], strict=False):
        inside = random.permutation(nodes[(angles >= low) & (angles < high)])
        places += [place_of(*node_of(int(node))) for node in inside[: count // (len(ANGLES) - 1)]]
    return places


def random_places(geometry, count, random):
    """``count`` places of a wheel all over its `REGIONS`; few have a lobe."""
    middle, places, regions = geometry.half_distance - geometry.rail_distance, [], [*REGIONS.values()]
    for n in range(count):
        across, profile, depths = regions[n % len(regions)]
        yaw = 0.0 if random.random() < 0.4 else random.uniform(-0.02, 0.02)
        depth, t = math.exp(random.uniform(*np.log(depths))), middle + random.uniform(*across)
        limits, slope, u = NARROW if random.random() < 0.3 else WIDE, random.normal(0, 2e-3), random.uniform(*profile)
        places.append((t - u, slope, depth, yaw, u, limits))
    return places


def collect(poses, friction, points, seed=5):
    """Numbers (n, NUMBERS) and remainder (n, points, 3) at ``points`` of places of all pairs: ``poses`` of nodes, and
    twice as many at random, of which about a third has a lobe."""
    random, found = np.random.default_rng(seed), []
    for k, geometry_of in enumerate(PAIRS.values()):
        pair = pair_of(LoadedWheels(geometry_of().geometry, "tabulated")._at_work(friction).value)
        places = random_places(pair.contact.geometry, 2 * poses // len(PAIRS), random)
        places += visited_places(poses, random) if k == 0 else []
        found += [one for one in side_by_side(lambda place, pair=pair: pair.solve(place, points), places) if one]
    return (np.array(part) for part in zip(*found, strict=True))


def train(numbers, remainder, points):
    """`Modes` from what `collect` found at ``points``."""
    places = in_disk(points)
    square = (places**2).sum(axis=1)
    weights = square / (square + columns.ROUND**2)
    own = mode_weights(weights, numbers[:, columns.LINEAR, None])[..., None]
    free = (remainder - (1.0 - own) * numbers[:, None, columns.FORCE : columns.FORCE + 3]) * weights[:, None] / own
    values, angles = weights[:, None] * splines(places), np.abs(numbers[:, columns.ANGLE])
    weighed = _fitted(values, free)
    sizes = np.sqrt(np.mean(np.einsum("nc,pqc->pnq", values, weighed) ** 2, axis=(1, 2)))
    evened = (sizes + FLOOR) ** -EVENED
    weighed *= (evened / np.sqrt(np.mean(evened**2)))[:, None, None]
    fits = [weighed[some] for some in (angles < columns.FLANKS[1], angles > columns.FLANKS[0])]
    seen = [np.einsum("nc,pqc->pnq", values, one) for one in fits]
    chosen = _most_telling(seen, np.hypot(*places.T) < 0.97)
    tables, shapes, gains = zip(*map(_family, fits, seen, [chosen, chosen]), strict=True)
    tables = np.stack(tables).astype(np.float32)
    return Modes(tables, points[chosen], np.hstack(shapes), np.vstack(gains), weights[chosen])


def _fitted(values, free):
    """Coefficients (poses, 3, splines) of remainders, where splines have ``values``."""
    bends = np.diff(np.eye(CELLS + 2), 2, axis=0)
    smooth = np.vstack([np.kron(bends, np.eye(CELLS + 2)), np.kron(np.eye(CELLS + 2), bends)])
    normal = values.T @ values + SMOOTHING * smooth.T @ smooth + 1e-9 * np.eye(values.shape[1])
    return np.einsum("cn,pnq->pqc", np.linalg.solve(normal, values.T), free)


def _most_telling(families, allowed):
    """Solutions from which the rest of remainders (poses, n, 3) of all families is known best, one after the other."""
    left = [seen.reshape(len(seen), -1).T @ seen.reshape(len(seen), -1) / len(seen) for seen in families]
    shares, chosen = [1.0 / np.trace(one) for one in left], []
    for _ in range(SOLUTIONS):
        told = np.zeros(len(allowed))
        for one, share in zip(left, shares, strict=True):
            at = one.reshape(len(one), -1, 3)
            own = np.einsum("nanb->nab", one.reshape(-1, 3, len(allowed), 3)) + NOISE**2 * np.eye(3)
            told += share * np.einsum("nab,nba->n", np.linalg.inv(own), np.einsum("kna,knb->nab", at, at))
        told[chosen] = -np.inf
        chosen.append(int(np.argmax(np.where(allowed, told, -np.inf))))
        one = slice(3 * chosen[-1], 3 * chosen[-1] + 3)
        left = [a - a[:, one] @ np.linalg.solve(a[one, one] + NOISE**2 * np.eye(3), a[one]) for a in left]
    return chosen


def _family(fits, seen, chosen):
    """Table of modes; their values (3 n, MODES) at the chosen solutions; and what these give their coefficients,
    (MODES, 3 n): of what the solutions tell of the remainders, the principal components."""
    at = seen[:, chosen].reshape(len(seen), -1)
    known = at.T @ at + len(at) * NOISE**2 * np.eye(at.shape[1])
    told = np.linalg.solve(known, at.T @ fits.reshape(len(fits), -1)).reshape(-1, *fits.shape[1:])
    everywhere = np.linalg.solve(known, at.T @ seen.reshape(len(seen), -1))
    parts, sizes, shapes = np.linalg.svd(at @ everywhere, full_matrices=False)
    modes = np.einsum("pk,pn,nqc->kqc", parts[:, :MODES] / sizes[:MODES], at, told, optimize=True)
    table = modes.reshape(MODES, 3, CELLS + 2, CELLS + 2).transpose(2, 3, 1, 0).reshape(CELLS + 2, CELLS + 2, -1)
    own = shapes[:MODES].reshape(MODES, -1, 3)[:, chosen].reshape(MODES, -1)
    return table, own.T, shapes[:MODES] @ everywhere.T


def errors(modes, numbers, remainder, points):
    """Error (n, 3) of a node's remainder at ``points``, of which the first are those where it is solved."""
    row = numbers.copy()
    row[columns.MODE :] = modes.fit(numbers, remainder[: len(modes.points)])[0]
    return np.array([columns.remainder(modes.values, row, *point) for point in points]) - remainder


def make(poses, friction):
    """Modes trained for a coefficient of friction; prints what they leave."""
    points = np.vstack([disk(SAMPLES), 0.2 * disk(NEAR)])
    numbers, remainder = collect(poses, friction, points)
    kept = np.random.default_rng(1).permutation(len(numbers)) < len(numbers) // KEPT
    modes = train(numbers[~kept], remainder[~kept], points)
    own = [int(np.argmin(np.hypot(*(points - point).T))) for point in modes.points]
    order, angles = [*own, *range(0, len(points), 3)], np.abs(numbers[kept, columns.ANGLE])
    every = zip(numbers[kept], remainder[kept], strict=True)
    left = np.array([errors(modes, row, rest[order], points[order]) for row, rest in every])
    for low, high in ((0.0, 0.1), (0.1, 0.4), (0.4, 0.7), (0.7, 1.3)):
        some = left[(angles >= low) & (angles < high)]
        for part, size in (("force", np.hypot(some[..., 0], some[..., 1])), ("moment", np.abs(some[..., 2]))):
            told = " ".join(f"{100 * value:.2f}" for value in np.percentile(size, [50, 95, 99]))
            print(f"{friction:g}: contact angle {low:g} to {high:g}, {len(some)} poses, {part}: {told}", flush=True)
    return modes


def main():
    """Train modes, print what they leave, write them."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("poses", nargs="?", type=int, default=1800)
    parser.add_argument("--out", default=SHIPPED / "creep_modes.h5")
    parser.add_argument("--friction", nargs="+", type=float, default=FRICTIONS, choices=FRICTIONS, help="others stay")
    chosen = parser.parse_args()
    made = {mu: make(chosen.poses, mu) if mu in chosen.friction else creep_modes(mu) for mu in FRICTIONS}
    with new_hdf5(chosen.out) as file:
        for friction, modes in made.items():
            for name, value in modes._asdict().items():
                file[f"{friction:g}/{name}"] = value


if __name__ == "__main__":
    main()
