"""Modes of what exact contact adds to the creep table: ``python -m study.patch.creep_modes [POSES] [--out FILE]``.

Exact patches of random poses are solved for creepages all over the disk, the remainder beside the creep table at the
ellipse of equal moments is fitted with quadratic B-splines, pose by pose, and the principal components over the poses
are the modes. They come with the package (``wrcore/dynamics/tables/creep_modes.h5``) and serve all pairs: where one
lobe carries, foreign modes are as good as a pair's own. Prints how well a node's few solutions give the remainder at
all creepages, over mu N in %: median, 95 % and 99 %.
"""

import argparse
import math

import numpy as np

from wrcore.contact.patch.model import MODES
from wrcore.dynamics import pair_table as columns
from wrcore.dynamics.pair_store import SHIPPED, Modes, Pair, mode_weights
from wrcore.dynamics.pair_table import WIDE
from wrcore.errors.checked_hdf5 import new_hdf5
from wrcore.scene.description import compile_scene, load_scene
from wrcore.scene.examples import example

SAMPLES, CELLS, SOLUTIONS = 900, 20, 16
"""Creepages of a pose, cells of the splines across the disk, and solutions from which a node's coefficients come."""

SMOOTHING, NOISE = 1e-3, 2e-3
"""Weight of the splines' second differences, and error of a solution over mu N."""


def disk(n):
    """Places (n, 2), evenly over the stereographic disk, and the creepages over those of saturation there."""
    k = np.arange(n) + 0.5
    radius, angle = 0.99 * np.sqrt(k / n), math.pi * (1.0 + math.sqrt(5.0)) * k
    place = radius * np.stack([np.cos(angle), np.sin(angle)])
    return place.T, (2.0 * place / (1.0 - radius**2)).T


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


def collect(pair, poses, points, seed=5):
    """Numbers (poses, NUMBERS) and remainder (poses, n, 3) at ``points``, of random places of a wheel."""
    random, rows = np.random.default_rng(seed), []
    middle = pair.contact.geometry.half_distance - pair.contact.geometry.rail_distance
    while len(rows) < poses:
        yaw = 0.0 if random.random() < 0.65 else random.uniform(-0.015, 0.015)
        depth = math.exp(random.uniform(math.log(2e-5), math.log(1.2e-4)))
        t, u = middle + random.uniform(-7e-3, 7e-3), random.uniform(-0.045, 0.02)
        place = t, random.normal(0, 1e-3), depth, yaw, u, WIDE
        found = pair.solve(place, points)
        if found is not None:
            rows.append(found)
    return (np.array(part) for part in zip(*rows, strict=True))


def train(numbers, remainder, places, points):
    """`Modes` from what `collect` found, and the error (poses, n, 3) of the remainder that a node then gives."""
    square = (places**2).sum(axis=1)
    weights = square / (square + columns.ROUND**2)
    own = mode_weights(weights, numbers[:, columns.LINEAR, None])[..., None]
    free = (remainder - (1.0 - own) * numbers[:, None, columns.FORCE : columns.MODE]) * weights[:, None] / own
    values, bends = weights[:, None] * splines(places), np.diff(np.eye(CELLS + 2), 2, axis=0)
    smooth = np.vstack([np.kron(bends, np.eye(CELLS + 2)), np.kron(np.eye(CELLS + 2), bends)])
    normal = values.T @ values + SMOOTHING * smooth.T @ smooth + 1e-9 * np.eye(values.shape[1])
    fits = np.einsum("cn,pnq->pqc", np.linalg.solve(normal, values.T), free)
    seen = np.einsum("nc,pqc->pqn", values, fits).reshape(len(fits), -1)
    parts, sizes, _ = np.linalg.svd(seen, full_matrices=False)
    modes = (parts[:, :MODES].T @ fits.reshape(len(fits), -1) / sizes[:MODES, None]).reshape(MODES, 3, -1)
    prior, shapes = sizes[:MODES] / math.sqrt(len(fits)), np.einsum("nc,kqc->nqk", values, modes)
    chosen = _most_telling(shapes * prior / NOISE, np.hypot(*places.T) < 0.97)
    seen_there = shapes[chosen].reshape(-1, MODES)
    inverse = np.linalg.solve(seen_there.T @ seen_there + NOISE**2 * np.diag(prior**-2), seen_there.T)
    found = np.einsum("ke,pe->pk", inverse, free[:, chosen].reshape(len(free), -1))
    errors = (np.einsum("pk,nqk->pnq", found, shapes) - free) * own / weights[:, None]
    side = CELLS + 2
    table = modes.reshape(MODES, 3, side, side).transpose(2, 3, 1, 0).reshape(side, side, -1)
    return Modes(table.astype(np.float32), points[chosen], inverse, weights[chosen]), errors


def _most_telling(blocks, allowed):
    """Solutions after which the coefficients are known best, one after the other (D-optimal)."""
    known, chosen = np.eye(MODES), []
    for _ in range(SOLUTIONS):
        gains = np.linalg.slogdet(np.eye(3) + blocks @ np.linalg.inv(known) @ blocks.transpose(0, 2, 1))[1]
        gains[chosen] = -np.inf
        chosen.append(int(np.argmax(np.where(allowed, gains, -np.inf))))
        known = known + blocks[chosen[-1]].T @ blocks[chosen[-1]]
    return chosen


def main():
    """Train modes on the default profiles, print what they leave, write them."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("poses", nargs="?", type=int, default=500)
    parser.add_argument("--out", default=SHIPPED / "creep_modes.h5")
    chosen = parser.parse_args()
    model, _ = compile_scene(load_scene(example("suspended_wheelset"), {"contact.patch": "exact"}))
    contact = model.contact
    pair = Pair(contact._replace(strips=contact.strips._replace(looked_up=contact.friction)), "modes")
    places, points = disk(SAMPLES)
    modes, errors = train(*collect(pair, chosen.poses, points), places, points)
    for name, size in (("force", np.hypot(errors[..., 0], errors[..., 1])), ("moment", np.abs(errors[..., 2]))):
        print(name, *(f"{100 * value:.3f}" for value in np.percentile(size, [50, 95, 99])))
    with new_hdf5(chosen.out) as file:
        for name, value in modes._asdict().items():
            file[name] = value


if __name__ == "__main__":
    main()
