"""Time of a wheel with contact from the table, by stage: ``python -m tests.wheels.table.look_up_stages [SCENE ...]``.

Microseconds a wheel, at states of a run of each of the scenes of `study.patch.look_up`, the least of many passes:
``search`` of overlaps; ``place`` of the lobe on the lattice; ``numbers`` looked up there; ``creep force`` from these;
and ``wheel``, all of it and what puts it together, as an evaluation of the equations does it. ``moment``: the same with
ellipses. ``seams``: share of wheels near the end of a cell. Stages leave wheels with several lobes out.
"""

import argparse
from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd

import wrcore as wr
from study.cost.timing import Contender, take_turns
from study.patch.look_up import SCENES
from wrcore.contact.search.approach import LEVEL, pressed_together
from wrcore.contact.search.strip import make_pose
from wrcore.equations.equations_of_motion import Equations
from wrcore.integrate.integrator import integrate
from wrcore.kernels.handles import Handle
from wrcore.kernels.jit import jit
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.wheels.contact_model import COUNTERS
from wrcore.wheels.exact_force import strip_wrenches
from wrcore.wheels.force import detect_patches
from wrcore.wheels.hertzian_force import wheel_wrenches
from wrcore.wheels.modes import FRESH
from wrcore.wheels.motion import as_left, motion_of
from wrcore.wheels.normal_damping import lift_of
from wrcore.wheels.table.cells import LEFT
from wrcore.wheels.table.lookup import APART, FAR, SADDLE, lobe_end
from wrcore.wheels.table_force import lifted_place, look_only_lobe_up, roll_lobe

SEARCH, PLACE, NUMBERS, FORCE, SEAMS = range(5)
STATES = 200


class Wheels(NamedTuple):
    """Equations of a scene, which keep what its kernels need, its contact and scratch arrays, and motions of wheels."""

    equations: Equations
    contact: Handle
    work: Handle
    motions: np.ndarray


def wheels_of(name, settings):
    """`Wheels` at equal intervals of a run."""
    model, start = compile_scene(load_scene(wr.example(name), settings))
    run = integrate(model, start, np.linspace(0.0, settings["integration.duration"], STATES + 1), "rodas5", 1e-4)
    equations, motions = Equations(model), []
    for t, state in zip(run.t[1:], run.states[1:], strict=True):
        equations(t, state)
        motions.append(equations.work.motions.copy())
    contact, work = (Handle(part) for part in (equations.arguments[1].value.contact, equations.work.strips))
    return Wheels(equations, contact, work, np.concatenate(motions))


@jit(allocates=False)
def place_of(model, m, count, rows, work):
    """Pose of a lifted wheel, its place on the lattice, and whether its overlaps are one lobe."""
    pose = make_pose(1.0, m.y, m.z, m.ex, m.ey, m.ez, True)
    pressed = pressed_together(model.geometry, pose, True, LEVEL, rows, 0, count, work.moments)
    pose, place = lifted_place(m, pressed, lift_of(model, m, pressed))
    return pose, place, lobe_end(model.geometry, pose, rows, 0, count, (APART, FAR, SADDLE)) == count


@jit(allocates=False)
def up_to(stage, model, motions, rows, counters, work):
    """All stages up to one, of all wheels. Returns a sum of what they find, for `SEAMS` how many wheels lie in one."""
    found, seams = 0.0, 0
    for i in range(motions.shape[0]):
        for wheel in range(2):
            m = as_left(motion_of(motions[i, wheel]))
            count, _, _ = detect_patches(model, m, rows)
            found += count
            if stage < PLACE or count == 0:
                continue
            pose, place, alone = place_of(model, m, count, rows, work)
            found += place[0]
            if stage < NUMBERS or not alone:
                continue
            if stage == SEAMS:
                work.shares[:, 0] = 0.0
            found += look_only_lobe_up(model, m, pose, 1.0, place, work)
            if stage == FORCE:
                found += roll_lobe(model, m, 1.0, 0, counters, work).f1
            if stage == SEAMS:
                seams += work.shares[LEFT, 0] > 0.0
    return seams if stage == SEAMS else found


@jit(allocates=False)
def one_by_one(wrenches_of, model, motions, patches, counts, bounds, wrenches, counters, work):
    """Wrenches of wheelsets, as a run asks for them: one after the other."""
    for i in range(motions.shape[0]):
        wrenches_of(model, motions[i : i + 1], patches, counts, bounds, wrenches, counters, work, FRESH)


def costs(name, settings, passes):
    """Row of a scene."""
    looked_up, ellipses = (wheels_of(name, {**settings, "contact.patch": p}) for p in ("tabulated", "moment"))
    work, counters, motions = looked_up.equations.work, np.zeros(COUNTERS, np.int64), looked_up.motions
    units = 2 * len(motions)

    def whole(wrenches_of, wheels):
        arrays = work.patches[:1].copy(), work.counts[:1].copy(), work.bounds[:1].copy(), np.zeros((1, 2, 6))
        call = partial(one_by_one, wrenches_of, wheels.contact, motions, *arrays, counters, wheels.work)
        return Contender("", call, units)

    arguments = looked_up.contact, motions, work.patches[0, 0].copy(), counters, looked_up.work
    stages = [Contender("", partial(up_to, stage, *arguments), units) for stage in range(FORCE + 1)]
    ends = whole(strip_wrenches, looked_up), whole(wheel_wrenches, ellipses)
    least = 1e6 * take_turns([*stages, *ends], passes).min(axis=0)
    seams = up_to(SEAMS, *arguments) / units
    parts = dict(zip(("search", "place", "numbers", "creep force"), np.diff(least[:4], prepend=0.0), strict=True))
    return {**parts, "wheel": least[4], "moment": least[5], "seams": seams}


def main():
    """Print a table of the scenes that are asked for, or all."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("scenes", nargs="*", default=list(SCENES))
    parser.add_argument("--passes", type=int, default=200)
    asked = parser.parse_args()
    rows = [{"scene": name, **costs(*SCENES[name], asked.passes)} for name in asked.scenes]
    print(pd.DataFrame(rows).to_markdown(index=False, floatfmt=".2f"))


if __name__ == "__main__":
    main()
