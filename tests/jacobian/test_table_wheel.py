"""Slopes of looked-up contact by hand, against differences."""

import numpy as np
import pytest

import wrcore as wr
from tests.wheels.table.test_lookup import known_numbers, pair_of_known_numbers
from wrcore.contact.patch.model import MODES, NODES, NUMBERS
from wrcore.equations.equations_of_motion import Equations
from wrcore.integrate.integrator import integrate
from wrcore.jacobian.jacobian import new_jacobian
from wrcore.jacobian.table import look_slopes_up, remainder_slopes, weigh_slopes
from wrcore.jacobian.wheels import UNCOUNTED, _difference_wrenches, add_slopes, contact_blocks
from wrcore.kernels.jit import jit
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene
from wrcore.wheels.modes import ELLIPSES
from wrcore.wheels.table import cells as pair_cells
from wrcore.wheels.table import lookup as pair_table
from wrcore.wheels.table.cells import AXES, Place
from wrcore.wheels.table.creep_modes import creep_modes
from wrcore.wheels.table.store import Pair

CURVE = {"track.path": [{"tangent": 5}, {"transition": 30}, {"curve": 60, "radius": 300, "cant": 0.1}]}
CASES = {
    "hunting": ("suspended_wheelset", {"speed": 60.0, "initial.y": 3e-3}, 1.0, 1.0, 1.0),
    "backwards": ("suspended_wheelset", {"speed": 20.0, "initial.y": 3e-3}, 1.0, -1.0, 1.0),
    "sliding": ("suspended_wheelset", {"speed": 20.0, "initial.y": 3e-3}, 1.0, 1.0, 0.8),
    "falling friction": (
        "suspended_wheelset",
        {"speed": 20.0, "initial.y": 3e-3, "contact.friction": {"mu": 0.3, "falling": {"ratio": 0.4, "decay": 0.6}}},
        1.0, 1.0, 1.0,
    ),
    "in a curve, on flange roots": ("trailer_vehicle", {"speed": 16.7, **CURVE}, 4.0, 1.0, 1.0),
}  # fmt: skip


@jit(allocates=False)
def blocks_of(jacobian, states, model, work, found, expected, uncounted):
    """Derivatives by hand and by differences, and the number of wheels that are left to differences."""
    for i in range(states.shape[0]):
        contact_blocks(jacobian, 0.0, states[i], states[i], model, work, 1.0, found[i])
        for k in range(jacobian.counts.shape[0]):
            for wheel in range(2):
                uncounted[i] += jacobian.counts[k, wheel] == UNCOUNTED
        expected[i], jacobian.counts[:] = 0.0, UNCOUNTED
        _difference_wrenches(jacobian, model, work, 1.0)
        add_slopes(jacobian, states[i], model, expected[i])


@pytest.mark.parametrize("case", CASES)
def test_slopes_of_lobes_are_those_of_differences(case):
    name, changes, duration, direction, rolling = CASES[case]
    model, start = compile_scene(load_scene(wr.example(name), **{"contact.patch": "tabulated", **changes}))
    states = np.ascontiguousarray(integrate(model, start, np.linspace(0.0, duration, 60), "rodas5", 1e-4, 1e-7).states)
    for body in model.bodies.wheelsets:
        states[:, 13 * body + 7] *= direction
        states[:, 13 * body + 11] *= direction * rolling
    equations, wheelsets = Equations(model), len(model.bodies.wheelsets)
    equations(0.0, states[0], ELLIPSES)
    jacobian = new_jacobian(equations)
    found, expected = np.zeros((2, len(states), wheelsets, 12, 6))
    uncounted = np.zeros(len(states), np.int64)
    blocks_of(jacobian, states, *equations.arguments[1:], found, expected, uncounted)
    assert uncounted.sum() == 0
    # over the largest entry of a column, or 1 % of that of its kind, as what saturates hardly changes
    scale = np.abs(expected).max(axis=-1).reshape(-1, wheelsets, 2, 6)
    scale = np.maximum(scale, 0.01 * scale.max(axis=-1, keepdims=True)).reshape(-1, wheelsets, 12, 1)
    errors = (np.abs(found - expected) / np.maximum(scale, 1e-9)).max(axis=(2, 3))
    print(case, *(f"{e:.2e}" for e in np.percentile(errors, [50, 95, 98, 100])))
    # differences are one-sided: a contact 50 um deep stiffens by 1e-4 over 10 nm; a few cross a corner of the search
    assert np.percentile(errors, 95) < 1e-3 and np.percentile(errors, 98) < 3e-3


def test_numbers_along_the_lattice():
    """A cell's numbers and what they change by, along each axis, in a finer lattice and from odd corners, too."""
    key = pair_cells.key_of(1, 71, 1, 301, 199, 10)
    rows = Pair._rows_of(pair_of_known_numbers(), key)
    assert Pair._add_yaw(pair_of_known_numbers(), key, rows)
    numbers, along, weights = np.zeros(NUMBERS), np.zeros((AXES, NUMBERS)), np.zeros((1 + AXES, NODES))
    parts, steps = np.array([0.3, 0.6, 0.9]), np.array([*pair_cells.STEPS, 1.0])
    steps[:2], steps[3] = steps[:2] / 2.0, pair_cells.YAW / 3.0

    def at(parts, turn):
        double = 0.5 * (parts + np.array([301, 199, 10]) % 2)
        return Place(1, *parts, *double, turn, 2.0, pair_cells.YAW / 3.0, 1.0)

    weigh_slopes(at(parts, 0.4), weights)
    look_slopes_up(rows, weights, numbers, along)
    assert numbers[0] == pytest.approx(known_numbers(301.3, 199.6, 10.9)[0], rel=1e-6)
    for axis in range(AXES):
        values = []
        for h in (1e-4, -1e-4):
            moved, turn, found = parts.copy(), 0.4, np.zeros(NUMBERS)
            if axis < 3:
                moved[axis] += h
            else:
                turn += h
            alone = np.zeros(NODES)
            pair_table.weigh(at(moved, turn), alone)
            pair_table.look_up(rows, alone, found)
            values.append(found[:2])
        slope = (values[0] - values[1]) / 2e-4 / steps[axis]
        assert abs(slope).max() > 0.0
        np.testing.assert_allclose(along[axis, :2], slope, rtol=1e-5, atol=1e-6 * abs(slope).max())


@pytest.mark.parametrize(("angle", "linear"), [(0.05, 1.0), (0.3, 0.4), (0.5, 0.0)])
def test_what_modes_change_by(angle, linear):
    """Over both creepages and along the lattice; of either family of modes and where both count."""
    random, modes = np.random.default_rng(5), creep_modes(0.3).values
    numbers, along = random.normal(size=NUMBERS), random.normal(size=(AXES, NUMBERS))
    numbers[pair_table.ANGLE], numbers[pair_table.LINEAR] = angle, linear
    along[:, pair_table.LINEAR] *= linear > 0.0
    place, out, step = np.array([0.4, -0.7]), np.zeros((3 + AXES, 3)), 1e-6
    remainder_slopes(modes, numbers, along, *place, out)
    np.testing.assert_allclose(out[0], pair_table.remainder(modes, numbers, *place), rtol=1e-9, atol=1e-12)
    for k in range(2 + AXES):
        values = []
        for h in (step, -step):
            moved = numbers + h * along[k - 2] if k >= 2 else numbers
            there = place + (h * np.eye(2)[k] if k < 2 else 0.0)
            values.append(np.array(pair_table.remainder(modes, moved, *there)))
        slope = (values[0] - values[1]) / (2.0 * step)
        np.testing.assert_allclose(out[1 + k], slope, rtol=1e-5, atol=1e-6)
    assert 2 * MODES < NUMBERS
