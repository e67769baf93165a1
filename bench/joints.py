"""Cost of joints: chains of growing length, and wheelsets with axle boxes as a trailer vehicle has them.

Nanoseconds of the whole right-hand side (bodies, gravity, joints; no contact, no force elements), median over rounds.
"""

import argparse
import time

import numpy as np

from wrcore._jit import jit
from wrcore.dynamics.body import euler_parameters
from wrcore.dynamics.joint import Joint, build_joints
from wrcore.dynamics.marker import FRAME
from wrcore.dynamics.system import Bodies, Equations, derivatives_at
from wrcore.scene import compile_scene, load_scene

ROUNDS = 41


@jit(allocates=False)
def repeat(states, equations, model, work, rate, count):
    """Right-hand sides of several states in turn."""
    for k in range(count):
        derivatives_at(equations, 0.0, states[k % states.shape[0]], model, work, rate)


def nanoseconds(model, states):
    """Median time of one right-hand side."""
    arguments, rate = Equations(model).arguments, np.empty(states.shape[1])
    repeat(states, *arguments, rate, 1)
    count = max(50, 20_000 // len(model.bodies.mass))
    seconds = []
    for _ in range(ROUNDS):
        start = time.process_time()
        repeat(states, *arguments, rate, count)
        seconds.append((time.process_time() - start) / count)
    return 1e9 * np.median(seconds)


def without_contact(base, mass, inertia, spins, joints):
    """A model of bodies and joints alone."""
    spins = np.array(spins, np.int64)
    bodies = Bodies(np.array(mass, float), np.array(inertia, float), spins, np.zeros(0, np.int64))
    return base._replace(bodies=bodies, joints=build_joints(joints, spins))


def some_states(positions, spins, count=16):
    """States near a nominal position with random rotations and velocities, shape (count, 13 n)."""
    rng = np.random.default_rng(0)
    rows = []
    for _ in range(count):
        parts = [
            [*(position + 1e-3 * rng.normal(size=3)), *euler_parameters(*0.01 * rng.normal(size=3)),
             20.0, *0.1 * rng.normal(size=2), *0.1 * rng.normal(size=3) + [0.0, 40.0 * spin, 0.0]]
            for position, spin in zip(positions, spins, strict=True)
        ]  # fmt: skip
        rows.append(np.concatenate(parts))
    return np.array(rows)


def chain(base, n, kind):
    """n bars that hang one below the other from the frame."""
    joints = [
        Joint(str(k), kind, (k, k - 1 if k else FRAME), [[0, 0, 0.5], [0, 0, -0.5 if k else 0.0]], axis=1)
        for k in range(n)
    ]
    model = without_contact(base, np.ones(n), np.full((n, 3), 0.1), np.zeros(n), joints)
    return model, some_states([np.array([0.0, 0.0, -0.5 - k]) for k in range(n)], np.zeros(n))


def trailer(base, boxes):
    """Four wheelsets, with two axle boxes each or without."""
    places = np.array([[x, 0.0, 0.46] for x in (10.78, 8.22, -8.22, -10.78)])
    mass, inertia, spins, joints = [1613.0] * 4, [[910.0, 112.0, 910.0]] * 4, [1] * 4, []
    if boxes:
        for axle in range(4):
            for y in (1.0, -1.0):
                joints.append(
                    Joint(f"box_{axle}_{y}", "revolute", (axle, len(mass)), [[0, y, 0], [0.02, 0, 0.01]], axis=1)
                )
                mass, inertia, spins = [*mass, 100.0], [*inertia, [5.0] * 3], [*spins, 0]
                places = np.vstack([places, places[axle] + [-0.02, y, -0.01]])
    return without_contact(base, mass, inertia, spins, joints), some_states(places, spins)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--longest", type=int, default=64, help="longest chain")
    longest = parser.parse_args().longest
    base = compile_scene(load_scene("config/scenes/wheelset.yaml", ["contact.creep.model=linear"]))[0]
    print(f"{'chain':>6s}{'spherical ns':>14s}{'per body':>10s}{'revolute ns':>14s}{'per body':>10s}")
    n = 2
    while n <= longest:
        costs = [nanoseconds(*chain(base, n, kind)) for kind in ("spherical", "revolute")]
        print(f"{n:6d}{costs[0]:14.0f}{costs[0] / n:10.1f}{costs[1]:14.0f}{costs[1] / n:10.1f}", flush=True)
        n *= 2
    with_boxes, alone = nanoseconds(*trailer(base, True)), nanoseconds(*trailer(base, False))
    print(f"four wheelsets, eight axle boxes: {with_boxes:.0f} ns; wheelsets alone {alone:.0f} ns; "
          f"boxes and joints {with_boxes - alone:.0f} ns")  # fmt: skip


if __name__ == "__main__":
    main()
