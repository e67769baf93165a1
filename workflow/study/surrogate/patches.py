"""Draw random contact patches and solve them exactly: training data of the surrogate.

    python -m study.surrogate.patches FOLDER --count 100000 --seed 1

writes the shards FOLDER/patches-00000.npz and so on. A shard depends only on the settings and on its number. To
continue a stopped run, start it again. Several runs with --part 1/2 and --part 2/2 share the work. A larger --count
adds shards.
"""

import argparse
import sys
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

import wrcore
from study.surrogate import shards
from study.surrogate.finding import OVERLAPS
from study.surrogate.pairs import NEW_RAILS, NEW_WHEELS, random_pair, read_measured
from study.surrogate.positions import (
    LOADS,
    MOST_ANGLE,
    POSITIONS,
    TWINS,
    choose,
    choose_twins,
    draw_positions,
    random_friction,
    scaled_inputs,
)
from study.surrogate.solution import POINTS, ExactPatches, random_points
from wrcore.contact.surrogate.network import N_CORRECTIONS
from wrcore.errors import InputError

PAIR_PATCHES = 60
"""Number of patches solved for each pair of profiles."""

UNSOLVED_PATCHES = 600
"""Number of patches per pair if they are not solved. The random positions then take most of the time."""

SHARD_PATCHES = 400
"""Minimum number of patches in a shard. A shard takes about 10 s on one processor core."""

LEAST_DRAWN = 12
"""Minimum number of patches at the random positions of a pair; pairs with fewer patches are rejected."""


SCORED_POSITIONS, SCORED_PATCHES = 300, 100
"""Number of random positions, and maximum number of patches, from which the distance of a candidate is computed."""


class Sampling(NamedTuple):
    """Settings that determine the content of a shard."""

    seed: int
    shard_patches: int = SHARD_PATCHES
    candidates: int = 1
    """Number of random pairs of which one is kept: the pair with the largest distance from the existing data."""
    is_solved: bool = True
    """Whether patches are solved exactly. If False, a shard has only descriptors, for training with a teacher."""
    measured: object = None
    """Measured profiles (`study.surrogate.pairs.Measured`), or None."""
    reference: np.ndarray = np.zeros((0, 38))
    """(n, N_DESCRIPTORS): descriptors to which distances are computed, in addition to those of the same shard."""
    new_share: float = 0.0
    """Share of wheels, and of rails, without wear; 0: the default shares."""
    pair_patches: int = 0
    """Number of patches of each pair of profiles; 0: `PAIR_PATCHES` or `UNSOLVED_PATCHES`."""
    curving: float = 0.0
    """Share of the random positions that are drawn as in narrow curves."""
    far: float = 0.0
    """Share of the single patches of a pair that are selected such that they are far from each other."""
    centred: float = 0.0
    """Share of the random positions that are drawn near the centre of a straight track."""
    twins: float = TWINS
    """Share of a pair's patches that are twins."""


def distances(descriptors, others):
    """Return the distance (n,) from each row of scaled inputs to the nearest row of ``others``; infinite if that is
    empty.

    All distances are computed, because a search tree saves no time in 38 dimensions."""
    if not len(others):
        return np.full(len(descriptors), np.inf)
    squares = (descriptors**2).sum(1)[:, None] + (others**2).sum(1) - 2.0 * descriptors @ others.T
    return np.sqrt(np.maximum(squares.min(1), 0.0))


class _Candidate(NamedTuple):
    """A pair, its coefficient of friction, and the patches at its random positions."""

    pair: object
    exact: ExactPatches
    drawn: list


def _draw_candidate(random, sampling, positions=POSITIONS):
    """Return a random `_Candidate` that has enough patches at the given number of random positions."""
    while True:
        pair = random_pair(random, sampling.measured, sampling.new_share)
        exact = ExactPatches(pair.on_rail, random_friction(random))
        drawn = draw_positions(random, exact, positions, sampling.curving, sampling.centred)
        if len(drawn) * POSITIONS >= LEAST_DRAWN * positions:
            return _Candidate(pair, exact, drawn)


def _keep_farthest(random, sampling, known):
    """Return the candidate with the largest median distance from ``known`` scaled inputs, and this distance.

    With only one candidate the distance is not computed (NaN)."""
    if sampling.candidates == 1:
        return _draw_candidate(random, sampling), np.nan
    best, farthest = None, -1.0
    for _ in range(sampling.candidates):
        one = _draw_candidate(random, sampling, SCORED_POSITIONS)
        some = [found.descriptors for found in one.drawn[:SCORED_PATCHES]]
        distance = float(np.median(distances(scaled_inputs(some), known)))
        if distance > farthest:
            best, farthest = one, distance
    rest = draw_positions(random, best.exact, POSITIONS - SCORED_POSITIONS, sampling.curving, sampling.centred)
    return best._replace(drawn=best.drawn + rest), farthest


def _solved(random, exact, found, is_solved):
    """Return the arrays of one patch by name, or None if it has no solution in the range of the training."""
    geometry, points = exact.model.geometry, random_points(random)
    row = {
        "descriptors": found.descriptors,
        "position": found.position,
        "radius": geometry.rolling_radius,
        "half_distance": geometry.half_distance,
        "rail_distance": geometry.rail_distance,
        "friction": exact.model.friction,
        "overlaps": found.numbers[OVERLAPS],
    }
    if not is_solved:
        return row
    solved = exact.solve(found, points)
    if solved is None or not LOADS[0] < solved.load < LOADS[1] or abs(solved.angle) > MOST_ANGLE:
        return None
    names = "load", "angle", "corrections", "exact", "base", "disk"
    return row | {name: getattr(solved, name) for name in names}


def pair_patches(random, candidate, sampling, number):
    """Return rows (dict) of the patches of a pair, and the number of patches or twins without a solution.

    The two patches of a pair of twins are successive rows."""
    exact, rows, failed = candidate.exact, [], 0
    count = sampling.pair_patches or (PAIR_PATCHES if sampling.is_solved else UNSOLVED_PATCHES)
    n = int(round(0.5 * sampling.twins * count))
    singles = choose(random, candidate.drawn, count - 2 * n, sampling.far)
    groups = [((one,), 0.0) for one in singles]
    groups += [((one, twin), step) for one, twin, step in choose_twins(random, exact, candidate.drawn, n)]
    for patches, step in groups:
        solved = [_solved(random, exact, found, sampling.is_solved) for found in patches]
        if any(one is None for one in solved):
            failed += 1
            continue
        for k, row in enumerate(solved):
            rows.append(row | {"pair": number, "step": step, "twin": k if len(solved) == 2 else -1})
    return rows, failed


def make_shard(number, sampling):
    """Return the arrays of a shard by name. A pair's number is 1000 times the shard's number plus the pair's index."""
    random, rows, names, far, failed = np.random.default_rng([sampling.seed, number]), [], [], [], 0
    known = scaled_inputs(sampling.reference)
    while len(rows) < sampling.shard_patches:
        candidate, distance = _keep_farthest(random, sampling, known)
        some, missed = pair_patches(random, candidate, sampling, 1000 * number + len(names))
        names, far, failed = [*names, candidate.pair.name], [*far, distance], failed + missed
        rows += some
        if sampling.candidates > 1 and some:
            known = np.concatenate([known, scaled_inputs([row["descriptors"] for row in some])])
    arrays = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    small = "descriptors", "corrections", "exact", "base", "disk"
    arrays |= {name: arrays[name].astype(np.float32) for name in small if name in arrays}
    return arrays | {"names": np.array(names), "distances": np.array(far), "failed": np.array(failed)}


def write_shards(folder, count, sampling, part=(1, 1), settings=None, report=print):
    """Write the missing shards of ``count`` patches. A ``part`` (k, n) selects every n-th shard from the k-th on."""
    shards.keep_settings(folder, settings or {"seed": sampling.seed, "shard_patches": sampling.shard_patches})
    total = -(-count // sampling.shard_patches)
    mine = [k for k in range(total) if k % part[1] == part[0] - 1]
    missing = [k for k in mine if not shards.path_of(folder, k).exists()]
    if len(missing) < len(mine):
        report(f"{len(mine) - len(missing)} of {len(mine)} shards are there")
    begin, spent = time.monotonic(), time.process_time()
    for done, number in enumerate(missing, 1):
        arrays = make_shard(number, sampling)
        shards.write(shards.path_of(folder, number), arrays)
        n, each = len(arrays["descriptors"]), (time.monotonic() - begin) / done
        processor = 1e3 * (time.process_time() - spent) / done / n
        report(
            f"shard {number}: {n} patches, {int(arrays['failed'])} without a solution; {processor:.1f} ms of processor"
            f" time a patch; {len(missing) - done} shards remain, about {each * (len(missing) - done) / 60:.0f} min"
        )


def _part(text):
    """Return the two numbers (k, n) of a text like 1/2."""
    k, _, n = text.partition("/")
    if not (k.isdigit() and n.isdigit() and 1 <= int(k) <= int(n)):
        raise argparse.ArgumentTypeError(f"expected two numbers such as 1/2, got {text}")
    return int(k), int(n)


def _options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, required=True, help="patches, rounded up to whole shards")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--shard", type=int, default=SHARD_PATCHES, help="patches of a shard (%(default)s)")
    parser.add_argument("--candidates", type=int, default=1, help="pairs that are drawn for each pair that is kept, the"
                        " one farthest from the data (%(default)s: all are kept)")  # fmt: skip
    parser.add_argument("--reference", type=Path, help="folder of finished shards from which distances count, too")
    parser.add_argument("--pair-patches", type=int, default=0, help="patches of each pair of profiles (default:"
                        f" {PAIR_PATCHES}, unsolved {UNSOLVED_PATCHES})")  # fmt: skip
    parser.add_argument("--new", type=float, default=0.0, help="share of wheels, and of rails, without wear (default:"
                        f" {NEW_WHEELS} and {NEW_RAILS})")  # fmt: skip
    parser.add_argument("--curving", type=float, default=0.0, help="share of the positions that are drawn as in narrow"
                        " curves (default: 0)")  # fmt: skip
    parser.add_argument("--centred", type=float, default=0.0, help="share of the positions that are drawn near the"
                        " centre of a straight track (default: 0)")  # fmt: skip
    parser.add_argument("--twins", type=float, default=TWINS, help="share of the patches that are twins, neighbours of"
                        " each other (%(default)s)")  # fmt: skip
    parser.add_argument("--far", type=float, default=0.0, help="share of the single patches of a pair that are selected"
                        " to be far from each other (default: 0)")  # fmt: skip
    parser.add_argument("--profiles", type=Path, help="folder of measured profiles to start from")
    parser.add_argument("--unsolved", action="store_true", help="descriptors alone, for training with a teacher")
    parser.add_argument("--part", type=_part, default=(1, 1), help="k/n: every n-th shard from the k-th on")
    asked = parser.parse_args()
    for name, least in (("count", 1), ("seed", 0), ("shard", 1), ("candidates", 1)):
        if getattr(asked, name) < least:
            parser.error(f"--{name}: expected at least {least}, got {getattr(asked, name)}")
    if asked.pair_patches < 0:
        parser.error(f"--pair-patches: expected at least 1, got {asked.pair_patches}")
    for name in ("new", "curving", "centred", "twins", "far"):
        if not 0.0 <= getattr(asked, name) <= 1.0:
            parser.error(f"--{name}: expected a share from 0 to 1, got {getattr(asked, name)}")
    if asked.curving + asked.centred > 1.0:
        parser.error(f"--centred: expected at most 1 with --curving, got {asked.curving + asked.centred}")
    return parser, asked


def main():
    """Run the command that writes shards of training data."""
    parser, asked = _options()
    settings = {"wrcore": wrcore.__version__, "seed": asked.seed, "shard_patches": asked.shard,
                "candidates": asked.candidates, "is_solved": not asked.unsolved, "points": POINTS,
                "corrections": N_CORRECTIONS}  # fmt: skip
    try:
        measured, reference = None, np.zeros((0, 38))
        if asked.profiles:
            measured = read_measured(asked.profiles)
            settings["profiles"] = shards.digest_of(p for p in sorted(asked.profiles.iterdir()) if p.is_file())
        if asked.reference:
            paths = shards.found_in(asked.reference)
            reference = np.concatenate([shards.read(path)["descriptors"] for path in paths])
            settings["reference"] = shards.digest_of(paths)
        settings |= {
            name: getattr(asked, name)
            for name in ("new", "pair_patches", "curving", "centred", "far", "twins")
            if getattr(asked, name) != parser.get_default(name)
        }
        sampling = Sampling(
            asked.seed, asked.shard, asked.candidates, not asked.unsolved, measured, reference, asked.new,
            asked.pair_patches, asked.curving, asked.far, asked.centred, asked.twins,
        )  # fmt: skip
        write_shards(asked.folder, asked.count, sampling, asked.part, settings,
                     lambda line: print(line, file=sys.stderr, flush=True))  # fmt: skip
    except InputError as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
