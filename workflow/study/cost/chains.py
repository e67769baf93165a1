"""Time of joints: chains of an increasing number of bars, without contact and force elements."""

import numpy as np
import pandas as pd

from study.cost.recorded import Recorded, evaluation
from study.cost.timing import summary, take_turns
from wrcore.bodies.body import euler_parameters
from wrcore.bodies.joint import Joint, build_joints
from wrcore.bodies.marker import FRAME
from wrcore.equations.model import Bodies
from wrcore.forces.suspension import pack_elements

STATES = 16


def chain(base, n, kind):
    """Return a chain of ``n`` bars with spherical or revolute joints, hanging from the moving frame of a base model.

    The states of the `Recorded` model are near the hanging position, with random rotations and velocities.
    """
    spins = np.zeros(n, np.int64)
    bodies = Bodies(np.ones(n), np.full((n, 3), 0.1), spins, np.zeros(0, np.int64))
    joints = [
        Joint(str(k), kind, (k, k - 1 if k else FRAME), [[0, 0, 0.5], [0, 0, -0.5 if k else 0.0]], axis=1)
        for k in range(n)
    ]
    model = base._replace(bodies=bodies, elements=pack_elements(), joints=build_joints(joints, spins))
    rng, states = np.random.default_rng(0), []
    for _ in range(STATES):
        parts = [
            [*(1e-3 * rng.normal(size=3) + [0.0, 0.0, -0.5 - k]), *euler_parameters(*0.01 * rng.normal(size=3)),
             20.0, *0.1 * rng.normal(size=5)]
            for k in range(n)
        ]  # fmt: skip
        states.append(np.concatenate(parts))
    return Recorded(model, np.array(states))


def over_chains(base, lengths, passes):
    """Time the right-hand side (ns, median and quartiles, and per bar) over the number of bars, by kind of joint."""
    kinds = [(kind, n) for kind in ("spherical", "revolute") for n in lengths]
    found = [chain(base, n, kind) for kind, n in kinds]
    seconds = take_turns([evaluation("", each) for each in found], passes)
    rows = []
    for (kind, n), timed in zip(kinds, summary("", "", kinds, seconds, "ns"), strict=True):
        row = {"joint": kind, "bars": n} | {
            f"evaluation_ns{part}": timed[f"time{part}"] for part in ("", "_low", "_high")
        }
        rows.append(row | {"evaluation_ns_per_bar": timed["time"] / n})
    return pd.DataFrame(rows)
