"""Train the network of the surrogate on shards of patches.

    python -m study.surrogate.training FOLDER --minutes 26 --out weights.npz

needs JAX and optax (pip install "wrcore[surrogate]"). The state is kept in weights.checkpoint.npz. To continue a
stopped run from there, start it again. With --start the training begins with the weights of a trained network; a lower
--rate is then sufficient. With --teacher the targets are the outputs of other weights, for a smaller network. The
patches then need no solution (--unsolved of study.surrogate.patches).
"""

import argparse
import hashlib
import json
import sys
import time
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np
import optax

import wrcore
from study.surrogate import shards
from study.surrogate.loss import N_REST, Batch, bent, loss, new_parameters, predict, slopes
from study.surrogate.training_data import CORRECTION_ERRORS, FORCE_ERRORS, OUTPUT_SCALE, load
from wrcore.contact.surrogate.network import N_CORRECTIONS
from wrcore.errors import InputError

CHUNK = 20
"""Number of training steps in one compiled call."""

OTHER_POINTS = 5
"""Number of creepages of a patch in a step, in addition to those near rest. They are selected at random for each call;
a step with all creepages takes 2.4 times as long."""

LEAST_RATE = 1e-5
"""Learning rate at the end of the training."""

_WARM_UP = 5
"""Number of calls over which the learning rate rises at the start."""

_ADAM = optax.scale_by_adam(b1=0.9, b2=0.99)

_KEEP_EVERY = 30.0
"""Time between checkpoints, s."""


class Settings(NamedTuple):
    """Settings that determine the weights, together with the data and the time."""

    width: int = 128
    modes: int = 48
    seed: int = 0
    batch: int = 512
    twins: int = 96
    """Number of pairs of twins in a batch."""
    rate: float = 3e-3
    minutes: float = 26.0
    steps: int = 0
    """Number of calls of `CHUNK` steps, for reproducible weights; 0: the training ends after ``minutes``."""


class State(NamedTuple):
    """Parameters and state of the optimiser, with the number of calls and the time (s) until this state."""

    parameters: dict
    optimiser: tuple
    calls: int = 0
    seconds: float = 0.0


def new_state(settings, start=None):
    """Return the `State` before the first step: random, or with ``start``, weights (arrays by name) of a network."""
    parameters = new_parameters(settings.seed, settings.width, settings.modes)
    if start is not None:
        parameters = parameters_of(start)
    return State(parameters, _ADAM.init(parameters))


def parameters_of(weights):
    """Return the parameters from the arrays of weights.npz by name. The inverse function is `weights_of`."""
    return {
        part: [[jax.numpy.asarray(weights[f"{prefix}{kind}_{k}"]) for kind in ("weights", "biases")]
               for k in range(1, count + 1)]
        for part, prefix, count in (("network", "", 4), ("modes", "mode_", 3))
    }  # fmt: skip


@jax.jit
def _call(parameters, optimiser, rate, batches):
    """Compute `CHUNK` training steps over the first axis of `Batch` arrays."""

    def one(carry, batch):
        parameters, optimiser = carry
        value, gradient = jax.value_and_grad(loss)(parameters, batch)
        change, optimiser = _ADAM.update(gradient, optimiser)
        return (jax.tree.map(lambda w, c: w - rate * c, parameters, change), optimiser), value

    (parameters, optimiser), values = jax.lax.scan(one, (parameters, optimiser), batches)
    return parameters, optimiser, values.mean()


def draw_batches(data, settings, call):
    """Return a `Batch` with `CHUNK` random batches, which depend only on the seed and on the number of the call."""
    random = np.random.default_rng([settings.seed, call])
    n = settings.twins if len(data.twins.step) else 0
    some = random.integers(len(data.training.inputs), size=(CHUNK, settings.batch - 2 * n))
    chosen = random.integers(max(len(data.twins.step), 1), size=(CHUNK, n))
    if n:
        some = np.concatenate([some, data.twins.first[chosen], data.twins.second[chosen]], 1)
    points = random.permutation(np.arange(N_REST, data.training.disk.shape[1]))[:OTHER_POINTS]
    points = np.concatenate([np.arange(N_REST), points])
    of = data.training
    step, weight = np.zeros((2, CHUNK, 0), np.float32)
    if n:
        step, weight = data.twins.step[chosen], data.twins.weight[chosen]
    return Batch(of.inputs[some], of.corrections[some], of.forces[some][:, :, points], of.disk[some][:, :, points],
                 step, weight)  # fmt: skip


def _rate(settings, state):
    """Return the learning rate and the completed share of the training."""
    if settings.steps:
        share = state.calls / settings.steps
    else:
        share = state.seconds / (60.0 * settings.minutes)
    rate = settings.rate * 0.5 * (1.0 + np.cos(np.pi * min(share, 1.0))) + LEAST_RATE
    return rate * min(1.0, (state.calls + 1) / _WARM_UP), share


def advance(state, data, settings):
    """Return the `State` after another call, and the mean loss."""
    begin = time.monotonic()
    rate, _ = _rate(settings, state)
    parameters, optimiser, value = _call(*state[:2], rate, draw_batches(data, settings, state.calls))
    value = float(value)
    return State(parameters, optimiser, state.calls + 1, state.seconds + time.monotonic() - begin), value


def digest_of(data, settings, others):
    """Return the SHA-256 of the data, the settings and the digest ``others`` of the weights used, as text."""
    text = json.dumps([data.digest, settings._asdict(), others, wrcore.__version__])
    return hashlib.sha256(text.encode()).hexdigest()


def keep(path, state, digest):
    """Write the `State` to a checkpoint file."""
    leaves = jax.tree.leaves((state.parameters, state.optimiser))
    arrays = {f"leaf_{k}": np.array(leaf) for k, leaf in enumerate(leaves)}
    shards.write(path, arrays | {"calls": state.calls, "seconds": state.seconds, "digest": np.array(digest)})


def resume(path, settings, digest, start=None):
    """Return the `State` of a checkpoint, or a new one if there is no file; InputError if its digest differs."""
    state = new_state(settings, start)
    if not Path(path).exists():
        return state
    arrays = shards.read(path)
    if str(arrays["digest"]) != digest:
        expected = "expected a checkpoint of the same data, settings and weights; delete it or choose another --out"
        raise InputError(str(path), "digest", expected)
    structure = jax.tree.structure((state.parameters, state.optimiser))
    leaves = [jax.numpy.asarray(arrays[f"leaf_{k}"]) for k in range(structure.num_leaves)]
    parameters, optimiser = jax.tree.unflatten(structure, leaves)
    return State(parameters, optimiser, int(arrays["calls"]), float(arrays["seconds"]))


def weights_of(parameters, scaling, digest):
    """Return the arrays of weights.npz by name, with the digest among them."""
    arrays = dict(scaling._asdict())
    arrays["corrections"] = (OUTPUT_SCALE * CORRECTION_ERRORS).astype(np.float32)
    arrays["force_scales"] = FORCE_ERRORS.astype(np.float32)
    for part, prefix in (("network", ""), ("modes", "mode_")):
        for k, (weights, biases) in enumerate(parameters[part], 1):
            arrays[f"{prefix}weights_{k}"] = np.array(weights, np.float32)
            arrays[f"{prefix}biases_{k}"] = np.array(biases, np.float32)
    return arrays | {"digest": np.array(digest)}


def errors_of(parameters, patches):
    """Return one line of text with errors relative to the targets and the loss, on given patches.

    Errors are median / 95 % / 99 %, in %: of N, a, b and p_max, of the position across the patch over l, of the creep
    force over friction times N, of the moment, and of the derivatives of the force at rest."""
    parts = [
        predict(parameters, patches.inputs[first : first + 2048], patches.disk[first : first + 2048])
        for first in range(0, len(patches.inputs), 2048)
    ]
    e, d = (np.concatenate([np.array(part[k]) for part in parts]) for k in (0, 1))
    e, d = e - patches.corrections, d - patches.forces
    sizes = 100.0 * np.abs(e) * CORRECTION_ERRORS
    rolling = 100.0 * d[:, N_REST:] * FORCE_ERRORS
    found = {"N": sizes[:, 0], "a": sizes[:, 1], "b": sizes[:, 2], "p_max": sizes[:, 3], "across": sizes[:, 5],
             "F": np.hypot(rolling[..., 0], rolling[..., 1]), "M": np.abs(rolling[..., 2]),
             "slopes": 0.5 * np.abs(np.array(slopes(d)))}  # fmt: skip
    said = (f"{name} " + "/".join(f"{v:.3g}" for v in np.percentile(x, [50, 95, 99])) for name, x in found.items())
    return f"{', '.join(said)}; loss {float(bent(e).mean()):.3f}, {float(bent(d).mean()):.3f}"


def train(data, settings, out, others="", start=None, report=print):
    """Train for the time or the steps of the settings, write the weights to ``out``, and return the last `State`.

    Parameters
    ----------
    data : TrainingData
    settings : Settings
    out : pathlib.Path
        File of the weights; the checkpoint is written to the same folder.
    others : str, optional
        Digest of the weights of the teacher or of the start.
    start : dict, optional
        Weights (arrays by name) with which the training begins; ``settings`` must have their sizes.
    report : callable, optional
        Function that is called with one line of text at a time.
    """
    digest = digest_of(data, settings, others)
    checkpoint = Path(out).with_suffix(".checkpoint.npz")
    state, kept = resume(checkpoint, settings, digest, start), time.monotonic()
    if state.calls:
        report(f"continues after {state.calls * CHUNK} steps, {state.seconds / 60.0:.1f} min")
    told = share = _rate(settings, state)[1]
    while share < 1.0:
        state, value = advance(state, data, settings)
        share = _rate(settings, state)[1]
        if time.monotonic() - kept > _KEEP_EVERY:
            keep(checkpoint, state, digest)
            kept = time.monotonic()
        if share >= told:
            told += 0.1
            remains = state.seconds * (1.0 / share - 1.0) / 60.0
            said = f"{100.0 * min(share, 1.0):.0f} %, {max(remains, 0.0):.1f} min remain, loss {value:.3f}"
            report(f"{said}; held back: {errors_of(state.parameters, data.held_back)}")
    keep(checkpoint, state, digest)
    shards.write(out, weights_of(state.parameters, data.scaling, digest))
    return state


def _say(line):
    print(line, file=sys.stderr, flush=True)


def _options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER")
    parser.add_argument("--out", type=Path, required=True, help="file of the weights, *.npz")
    parser.add_argument("--minutes", type=float, default=Settings().minutes, help="time, over all runs (%(default)s)")
    parser.add_argument("--steps", type=int, default=0, help=f"calls of {CHUNK} steps in place of the minutes")
    parser.add_argument("--width", type=int, default=Settings().width, help="of the three layers (%(default)s)")
    parser.add_argument("--modes", type=int, default=Settings().modes, help="of the creep force (%(default)s)")
    parser.add_argument("--batch", type=int, default=Settings().batch, help="patches of a step (%(default)s)")
    parser.add_argument("--twins", type=int, default=Settings().twins, help="pairs of them (%(default)s)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rate", type=float, default=Settings().rate, help="of the first steps (%(default)s)")
    parser.add_argument("--start", type=Path, help="weights to begin with; their sizes count")
    parser.add_argument("--teacher", type=Path, help="weights whose outputs are the targets")
    asked = parser.parse_args()
    if asked.out.suffix != ".npz":
        parser.error(f"--out: expected a name that ends in .npz, got {asked.out}")
    if 2 * asked.twins >= asked.batch:
        parser.error(f"--twins: expected less than half of a batch of {asked.batch}, got {asked.twins}")
    if asked.start and asked.teacher:
        parser.error("--start: expected no such option beside --teacher")
    for name in ("minutes", "width", "modes", "batch", "rate"):
        if not getattr(asked, name) > 0:
            parser.error(f"--{name}: expected more than 0, got {getattr(asked, name)}")
    return parser, asked


def main():
    """Run the command that trains the network."""
    parser, asked = _options()
    settings = Settings(**{name: getattr(asked, name) for name in Settings._fields if hasattr(asked, name)})
    try:
        teacher, start = (shards.read(path) if path else None for path in (asked.teacher, asked.start))
        if start is not None:
            settings = settings._replace(width=len(start["biases_1"]), modes=len(start["biases_4"]) - N_CORRECTIONS)
        data = load(asked.folders, teacher, start)
        others = shards.digest_of(path for path in (asked.teacher, asked.start) if path)
        n, held, twins = len(data.training.inputs), len(data.held_back.inputs), len(data.twins.step)
        _say(f"{n} patches, among them {twins} pairs of twins; {held} held back")
        train(data, settings, asked.out, others, start, _say)
    except InputError as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
