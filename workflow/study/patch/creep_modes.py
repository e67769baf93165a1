"""Modes of what exact contact adds to the creep table: ``python -m study.patch.creep_modes [POSES] [--out FILE]
[--friction MU ...]``.

Exact patches of random poses, of the whole tread and of the flange, are solved for creepages all over the disk. The
remainder beside the creep table at the ellipse of equal moments is fitted with quadratic B-splines, pose by pose, and
the principal components over the poses are the modes: a family of contacts of little spin, and one of contacts of much
(``FLANKS`` of `wrcore.dynamics.pair_table`). Each of some coefficients of friction has its own. They come with the
package (``wrcore/dynamics/tables/creep_modes.h5``) and serve all pairs: where one lobe carries, foreign modes are as
good as a pair's own. Prints how well a node's few solutions give the remainder of poses that were kept back, over mu N
in %: median, 95 % and 99 %.

Those for 0.3 that come with the package are of 900 poses of an earlier version of this file, which stood beside the
table at one ellipse. Trained by this version they have better tails (flange, 99 %: 2.0 for 2.6 % of mu N), but err by
1.0 in place of 0.5 % where a slender contact slips about its spin pole: name the other coefficients, or train on such
contacts, too.
"""

import argparse
import math

import numpy as np

from wrcore.contact.patch.model import MODES
from wrcore.dynamics import pair_table as columns
from wrcore.dynamics.creep_modes import SHIPPED, Modes, mode_weights
from wrcore.dynamics.pair_store import Pair
from wrcore.dynamics.pair_table import WIDE
from wrcore.errors.checked_hdf5 import new_hdf5
from wrcore.scene.description import compile_scene, load_scene
from wrcore.scene.examples import example

SAMPLES, NEAR, CELLS, SOLUTIONS = 700, 500, 20, 20
"""Creepages of a pose all over the disk, and near none; cells of the splines across the disk; and solutions from which
a node's coefficients come."""

REGIONS = {
    "tread": ((-7e-3, 7e-3), (-0.045, 0.02), (1e-5, 1.2e-4)),
    "flange": ((3.5e-3, 9e-3), (-0.05, -0.025), (6e-6, 1.2e-4)),
}
"""Where poses lie: lateral place of the wheel, place on its profile, and depth, m."""

FRICTIONS = 0.05, 0.12, 0.3, 0.7
"""Coefficients of friction that have modes."""

KEPT = 60
"""Poses of each region on which modes are tried."""

SMOOTHING, NOISE = 1e-3, 2e-3
"""Weight of the splines' second differences, and error of a solution over mu N."""


def disk(n):
    """Creepages (n, 2) over those of saturation, evenly over the stereographic disk."""
    k = np.arange(n) + 0.5
    radius, angle = 0.99 * np.sqrt(k / n), math.pi * (1.0 + math.sqrt(5.0)) * k
    return (2.0 * radius / (1.0 - radius**2) * np.stack([np.cos(angle), np.sin(angle)])).T


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


def collect(pair, region, poses, points, seed=5):
    """Numbers (poses, NUMBERS) and remainder (poses, n, 3) at ``points``, of random places of a wheel."""
    random, rows = np.random.default_rng(seed), []
    middle, (across, profile, depths) = (
        pair.contact.geometry.half_distance - pair.contact.geometry.rail_distance,
        region,
    )
    while len(rows) < poses:
        yaw = 0.0 if random.random() < 0.65 else random.uniform(-0.015, 0.015)
        depth = math.exp(random.uniform(*np.log(depths)))
        place = middle + random.uniform(*across), random.normal(0, 2e-3), depth, yaw, random.uniform(*profile), WIDE
        found = pair.solve(place, points)
        if found is not None:
            rows.append(found)
    return (np.array(part) for part in zip(*rows, strict=True))


def train(numbers, remainder, points):
    """`Modes` from what `collect` found at ``points``."""
    places = points / (1.0 + np.sqrt(1.0 + (points**2).sum(axis=1)))[:, None]
    square = (places**2).sum(axis=1)
    weights = square / (square + columns.ROUND**2)
    own = mode_weights(weights, numbers[:, columns.LINEAR, None])[..., None]
    free = (remainder - (1.0 - own) * numbers[:, None, columns.FORCE : columns.FORCE + 3]) * weights[:, None] / own
    values, angles = weights[:, None] * splines(places), np.abs(numbers[:, columns.ANGLE])
    families = [_family(values, free[some]) for some in (angles < columns.FLANKS[1], angles > columns.FLANKS[0])]
    tables, shapes, priors = zip(*families, strict=True)
    blocks = [one * prior / NOISE for one, prior in zip(shapes, priors, strict=True)]
    chosen = _most_telling(blocks, np.hypot(*places.T) < 0.97)
    seen = np.concatenate([one[chosen].reshape(-1, MODES) for one in shapes], axis=1)
    return Modes(np.stack(tables), points[chosen], seen, np.concatenate(priors) / NOISE, weights[chosen])


def _family(values, free):
    """Table of modes, their values (n, 3, MODES) where splines have ``values``, and the size of their coefficients."""
    bends = np.diff(np.eye(CELLS + 2), 2, axis=0)
    smooth = np.vstack([np.kron(bends, np.eye(CELLS + 2)), np.kron(np.eye(CELLS + 2), bends)])
    normal = values.T @ values + SMOOTHING * smooth.T @ smooth + 1e-9 * np.eye(values.shape[1])
    fits = np.einsum("cn,pnq->pqc", np.linalg.solve(normal, values.T), free)
    seen = np.einsum("nc,pqc->pqn", values, fits).reshape(len(fits), -1)
    parts, sizes, _ = np.linalg.svd(seen, full_matrices=False)
    modes = (parts[:, :MODES].T @ fits.reshape(len(fits), -1) / sizes[:MODES, None]).reshape(MODES, 3, -1)
    table = modes.reshape(MODES, 3, CELLS + 2, CELLS + 2).transpose(2, 3, 1, 0).reshape(CELLS + 2, CELLS + 2, -1)
    return table.astype(np.float32), np.einsum("nc,kqc->nqk", values, modes), sizes[:MODES] / math.sqrt(len(fits))


def _most_telling(families, allowed):
    """Solutions after which the coefficients of all families are known best, one after the other (D-optimal)."""
    known, chosen = [np.eye(MODES) for _ in families], []
    for _ in range(SOLUTIONS):
        gains = np.zeros(len(allowed))
        for blocks, one in zip(families, known, strict=True):
            gains += np.linalg.slogdet(np.eye(3) + blocks @ np.linalg.inv(one) @ blocks.transpose(0, 2, 1))[1]
        gains[chosen] = -np.inf
        chosen.append(int(np.argmax(np.where(allowed, gains, -np.inf))))
        known = [one + blocks[chosen[-1]].T @ blocks[chosen[-1]] for blocks, one in zip(families, known, strict=True)]
    return chosen


def errors(modes, numbers, remainder, points):
    """Error (n, 3) of a node's remainder at ``points``, of which the first are those where it is solved."""
    row = numbers.copy()
    row[columns.MODE :] = modes.coefficients(numbers, remainder[: len(modes.points)])
    return np.array([columns.remainder(modes.values, row, *point) for point in points]) - remainder


def make(poses, friction):
    """Modes trained on the default profiles; prints what they leave."""
    settings = {"contact.patch": "exact", "contact.friction": friction}
    model, _ = compile_scene(load_scene(example("suspended_wheelset"), settings))
    contact = model.contact
    pair = Pair(contact._replace(strips=contact.strips._replace(looked_up=contact.friction)), "modes")
    points, counts = np.vstack([disk(SAMPLES), 0.2 * disk(NEAR)]), {"tread": poses, "flange": 2 * poses // 3}
    found = [collect(pair, REGIONS[name], count, points) for name, count in counts.items()]
    modes = train(*(np.concatenate(part) for part in zip(*found, strict=True)), points)
    for name in REGIONS:
        every = np.vstack([modes.points, points])
        left = [errors(modes, *pose, every) for pose in zip(*collect(pair, REGIONS[name], KEPT, every, 6), strict=True)]
        for part, size in (("force", np.hypot(*np.array(left).T[:2])), ("moment", np.abs(np.array(left).T[2]))):
            print(friction, name, part, *(f"{100 * value:.2f}" for value in np.percentile(size, [50, 95, 99])))
    return modes


def main():
    """Train modes, print what they leave, write them."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("poses", nargs="?", type=int, default=600)
    parser.add_argument("--out", default=SHIPPED / "creep_modes.h5")
    parser.add_argument("--friction", nargs="+", type=float, default=FRICTIONS)
    chosen = parser.parse_args()
    made = {friction: make(chosen.poses, friction) for friction in chosen.friction}
    with new_hdf5(chosen.out) as file:
        for friction, modes in made.items():
            for name, value in modes._asdict().items():
                file[f"{friction:g}/{name}"] = value


if __name__ == "__main__":
    main()
