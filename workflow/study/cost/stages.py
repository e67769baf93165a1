"""Time of one evaluation of the right-hand side by stage, each measured separately over the states of a run.

Times of bodies, force elements and joints are differences between models with and without them. Stages of the wheels
are timed in loops over the wheels' motions. In such a loop consecutive calls overlap in the processor; in the full
evaluation a stage waits for results of the previous stage. The stage ``rest`` contains this waiting and the remaining
code between stages.
"""

import math
from functools import partial

import numpy as np
import pandas as pd

from study.cost.operations import STAGES, count_operations
from study.cost.recorded import evaluation, lasting, record
from study.cost.timing import Contender, summary, take_turns
from wrcore.bodies.joint import build_joints
from wrcore.contact.creepage import creepages
from wrcore.contact.hertz import damping_factor, hertz_shape_at, inverse_cube_root
from wrcore.contact.search import reduction as columns
from wrcore.contact.search.detection import SPATIAL, find_patches
from wrcore.contact.search.geometry import LANES
from wrcore.contact.search.scan import first_zone, make_window, near_blocks, scan
from wrcore.contact.search.strip import make_pose
from wrcore.creep.laws import creep_force_at
from wrcore.equations.equations_of_motion import Equations
from wrcore.forces.suspension import pack_elements
from wrcore.kernels.handles import Handle
from wrcore.kernels.jit import FUSED, jit
from wrcore.kernels.lanes import lanes8, load8, ramp8, total

CHAIN = 10**6
"""Fused multiply-add operations in each of the chains that measure their rate."""

BLOCK = 2048
"""Numbers that the measurement of the first-level cache's bandwidth reads repeatedly (16 kB)."""


@jit(allocates=False)
def _scan(model, motions):
    """Prepare the search window of each wheel and scan its zones near contact; return a checksum."""
    found = 0.0
    for m in motions:
        window = make_window(model.geometry, make_pose(m[0], m[1], m[2], m[3], m[4], m[5], model.detection == SPATIAL))
        near = near_blocks(model.geometry, window)
        while near > 0:
            begin, end, near = first_zone(near, model.geometry.block)
            m0, m1, m2, overlap, close = scan(window, model.geometry.scan_wheel, model.geometry.scan_rail, begin, end)
            found += m0 + m1 + m2 + (overlap.count + overlap.first + overlap.last)  # unused results are not compiled
            found += close.count + close.first + close.last
    return found


@jit(allocates=False)
def search_all(model, motions, patches):
    """Find the contact patches of all wheels; return their number."""
    found = 0
    for i in range(motions.shape[0]):
        m, spatial = motions[i], model.detection == SPATIAL
        found += find_patches(model.geometry, m[0], m[1], m[2], m[3], m[4], m[5], spatial, model.reduction, patches[i])
    return found


@jit(allocates=False, fastmath=FUSED)
def _hertz(model, motions, patches, counts):
    """Compute creepages, Hertz ellipse and damping of all patches; return a checksum."""
    found = 0.0
    for i in range(motions.shape[0]):
        m = motions[i]
        for k in range(counts[i]):
            row = patches[i, k]
            arm = row[columns.X], row[columns.Y] - m[1], row[columns.Z] - m[2]
            cosine, sine = row[columns.COSINE], row[columns.SINE]
            xi, eta, phi, approach = creepages(m[6], m[7], m[8], m[9], m[10], m[11], *arm, cosine, sine, m[6])
            stiffness, a, b, log_ratio = hertz_shape_at(model.hertz, row[columns.CURVATURE_X], row[columns.CURVATURE_Y])
            inverse = inverse_cube_root(damping_factor(approach, model.damping, model.damping_speed))
            found += xi + eta + phi + stiffness + a + b + log_ratio + inverse
    return found


@jit(allocates=False)
def _creep(model, arguments):
    """Compute creep forces for rows of ln(a/b), a/b and the three nondimensional creepages; return a checksum."""
    found = 0.0
    for row in arguments:
        f1, f2, m3, _ = creep_force_at(model.law, model.creep, row[0], row[1], 0.0, row[2], row[3], row[4])
        found += f1 + f2 + m3
    return found


@jit(fastmath=FUSED)
def _multiply_and_add(count):
    """Return the sum of twelve independent chains of ``count`` fused multiply-adds of eight numbers."""
    a = b = c = d = e = f = g = h = i = j = k = m = ramp8()
    x, y = lanes8(0.999999), lanes8(1e-6)
    for _ in range(count):
        a, b, c, d, e, f = a * x + y, b * x + y, c * x + y, d * x + y, e * x + y, f * x + y
        g, h, i, j, k, m = g * x + y, h * x + y, i * x + y, j * x + y, k * x + y, m * x + y
    return total(a + b + c + d + e + f + g + h + i + j + k + m)


@jit(fastmath=FUSED)
def _read(numbers, turns):
    """Return the sum of all numbers of one row, added ``turns`` times."""
    a = b = c = d = lanes8(0.0)
    for _ in range(turns):
        for k in range(0, numbers.shape[1], 4 * LANES):
            a, b = a + load8(numbers, 0, np.uint64(k)), b + load8(numbers, 0, np.uint64(k + LANES))
            c = c + load8(numbers, 0, np.uint64(k + 2 * LANES))
            d = d + load8(numbers, 0, np.uint64(k + 3 * LANES))
    return total(a + b + c + d)


@jit
def _divide(numbers, turns):
    """Return the sum of reciprocals, computed one by one."""
    found = 0.0
    for _ in range(turns):
        for x in numbers[0]:
            found += 1.0 / x
    return found


@jit
def _root(numbers, turns):
    """Return the sum of square roots, computed one by one."""
    found = 0.0
    for _ in range(turns):
        for x in numbers[0]:
            found += math.sqrt(x)
    return found


def limits(passes):
    """Return the maximum rates of one core, each measured in the fastest pass.

    They are flop_per_ns (fused multiply-adds of eight numbers, counted as two operations each), byte_per_ns (reads from
    the first-level cache), ns_per_division and ns_per_root (one by one, independent of each other).
    """
    numbers, turns = np.ones(BLOCK + LANES), CHAIN // BLOCK * LANES
    first = -(numbers.ctypes.data // 8) % LANES  # index of the first number on a cache line
    numbers = numbers[None, first : first + BLOCK]
    contenders = [
        Contender("fused products", partial(_multiply_and_add, CHAIN), 2.0 * 12 * LANES * CHAIN),
        Contender("reads", partial(_read, numbers, turns), 8.0 * BLOCK * turns),
        Contender("divisions", partial(_divide, numbers, turns // 8), BLOCK * (turns // 8)),
        Contender("roots", partial(_root, numbers, turns // 8), BLOCK * (turns // 8)),
    ]
    flop, byte, division, root = (1e9 * take_turns(contenders, passes).min(axis=0)).tolist()
    return {"flop_per_ns": 1.0 / flop, "byte_per_ns": 1.0 / byte, "ns_per_division": division, "ns_per_root": root}


def _wheels(recorded):
    """Return motions, patches and numbers of patches of all wheels at all states, and arguments of the creep law."""
    equations = Equations(recorded.model)
    motions, patches, counts = [], [], []
    for state in recorded.states:
        equations(0.0, state)
        work = equations.work
        motions += list(work.motions.reshape(-1, work.motions.shape[-1]).copy())
        patches += list(work.patches.reshape(-1, *work.patches.shape[2:]).copy())
        counts += list(work.counts.ravel())
    motions, patches, counts = np.array(motions), np.array(patches), np.array(counts)
    rows = patches[np.arange(patches.shape[1]) < counts[:, None]]
    contact, (a, b) = recorded.model.contact, rows[:, [columns.SEMI_A, columns.SEMI_B]].T
    scale = contact.shear_modulus * a * b / (contact.friction * rows[:, columns.NORMAL])
    creepage = rows[:, [columns.XI, columns.ETA, columns.PHI]] * scale[:, None]
    creepage[:, 2] *= np.sqrt(a * b)
    return motions, patches, counts, np.column_stack([np.log(a / b), a / b, creepage])


def breakdown(title, scene, states, passes):
    """Return time, operations and bytes of one evaluation by stage, on tangent track without irregularity.

    A row per stage and a row for the whole evaluation, averaged over states of a run, contain nanoseconds per
    evaluation (median and quartiles over the passes), share of the whole, and the counts of
    :func:`study.cost.operations.count_operations`.
    """
    recorded = record(scene, scene.data["integration"]["duration"], states)
    model, (motions, patches, counts, creep) = recorded.model, _wheels(recorded)
    no_wheels = model._replace(bodies=model.bodies._replace(wheelsets=np.zeros(0, np.int64)))
    no_joints = no_wheels._replace(joints=build_joints([], model.bodies.spins))
    variants = [no_joints._replace(elements=pack_elements()), no_joints, no_wheels, model]
    contact = Handle(model.contact)
    calls = [
        (partial(_scan, contact), (motions,)),
        (partial(search_all, contact), (motions, patches)),
        (partial(_hertz, contact), (motions, patches, counts)),
        (partial(_creep, contact), (creep,)),
    ]
    contenders = [evaluation("", recorded._replace(model=variant)) for variant in variants]
    contenders += [lasting("", call, arrays, len(recorded.states)) for call, arrays in calls]
    bodies, elements, joints, whole, scanned, patches, hertz, creeping = take_turns(contenders, passes).T
    stages = [bodies, elements - bodies, joints - elements, scanned, patches - scanned, hertz, creeping]
    seconds = np.column_stack([*stages, whole - np.sum(stages, axis=0), whole])
    counted, rows = count_operations(recorded), []
    for row in summary("", "", [*STAGES, "whole"], seconds, "ns"):
        facts = {"scene": title, "stage": row["contender"]}
        facts |= {name: row[name] for name in ("time", "time_low", "time_high")}
        facts |= {"share": np.nan} | counted[row["contender"]]
        rows.append(facts)
    table = pd.DataFrame(rows).rename(columns={f"time{part}": f"ns{part}" for part in ("", "_low", "_high")})
    table["share"] = table["ns"] / table["ns"].iloc[-1]
    return table


def with_limits(tables, found):
    """Concatenate tables of :func:`breakdown` and compare them with the limits of the machine (:func:`limits`).

    New columns are operations and bytes per nanosecond, the minimum time ``least_ns``, the ``limit`` that determines
    this time, and ``times_least``, the measured time over the minimum time.

    ``least_ns`` is the maximum of three times: all sums and products at the rate of fused multiply-adds, all bytes at
    the bandwidth of the first-level cache, all divisions and roots one by one. Additional time of a stage is due to
    operations that wait for each other, branches, mathematical functions and integer arithmetic.
    """
    table = pd.concat(tables, ignore_index=True)
    table["flop_per_ns"], table["byte_per_ns"] = table["flops"] / table["ns"], table["bytes"] / table["ns"]
    least = {
        "sums and products": table["flops"] / found["flop_per_ns"],
        "bytes": table["bytes"] / found["byte_per_ns"],
        "divisions and roots": table["divisions"] * found["ns_per_division"] + table["roots"] * found["ns_per_root"],
    }
    least = pd.DataFrame(least)
    table["least_ns"], table["limit"] = least.max(axis=1), least.idxmax(axis=1)
    table["times_least"] = table["ns"] / table["least_ns"].where(table["least_ns"] > 0.0)
    return table
