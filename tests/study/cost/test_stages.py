"""Counted operations: the numbers that count calculate what compiled kernels do, and count right."""

import math
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from study.cost import operations
from study.cost.operations import STAGES, Number, Tally, count_operations, counting, interpreted
from study.cost.recorded import record
from study.cost.stages import breakdown, limits, with_limits
from tests.conftest import ELLIPTIC
from wrcore.contact.search import strip
from wrcore.contact.search.detection import find_patches
from wrcore.equations import equations_of_motion as system
from wrcore.equations.equations_of_motion import Equations
from wrcore.equations.model import workspace
from wrcore.scene.description import load_scene


def scene(name, *overrides):
    return load_scene(ELLIPTIC / f"{name}.yaml", ["speed=60", "integration.duration=0.1", *overrides])


@pytest.fixture(scope="module")
def wheelset():
    return record(scene("suspended_wheelset"), 0.1, 4)


def test_numbers_count_operations_and_bytes():
    tally = Tally()
    values = counting(np.array([3.0, 4.0]), tally)
    hypotenuse = operations._mathematics(tally).sqrt(values[0] * values[0] + values[1] * values[1])
    values[1] = 1.0 / hypotenuse - 2.0
    assert float(values[1]) == pytest.approx(-1.8)
    expected = {"flops": 4, "roots": 1, "divisions": 1, "bytes": 8 * (4 + 1 + 1)}
    assert {name: tally.counts["bodies", name] for name in expected} == expected


def test_lanes_count_each_of_eight():
    tally = Tally()
    registers = operations._registers(tally)
    rows = counting(np.arange(32.0).reshape(2, 16), tally)
    one = registers["load8"](rows, 1, 4)
    assert tally.counts["bodies", "bytes"] == 64
    result = 2.0 * one + registers["ramp8"]()
    assert [float(x) for x in result] == [2.0 * k + k - 20.0 for k in range(20, 28)]
    assert tally.counts["bodies", "flops"] == 16
    assert float(registers["total"](result)) == pytest.approx(sum(2.0 * k + k - 20.0 for k in range(20, 28)))
    assert registers["below"](result, registers["lanes8"](44.0)) == 0b11
    assert (registers["lowest_bit"](0b100), registers["highest_bit"](0b101), registers["count_bits"](7)) == (2, 2, 3)
    assert (registers["lowest_bit"](0), registers["highest_bit"](0)) == (64, -1)


@pytest.mark.parametrize(("name", "boxes"), [("suspended_wheelset", "true"), ("trailer_vehicle", "true")])
def test_counting_equations_are_the_compiled_ones(name, boxes):
    recorded, tally = record(scene(name, f"vehicle.axle_boxes={boxes}"), 0.1, 1), Tally()
    state = recorded.states[0]
    model, work = counting(recorded.model, tally), counting(workspace(recorded.model), tally)
    rate = counting(np.empty_like(state), tally)
    with interpreted(tally):
        system.fill_derivatives(0.0, counting(state, tally), model, work, rate)
    compiled = Equations(recorded.model)(0.0, state)
    np.testing.assert_allclose([float(x) for x in rate], compiled, rtol=1e-9, atol=1e-7)


def test_kernels_are_themselves_again_after_counting(wheelset):
    before = find_patches, strip.math, system.element_forces
    count_operations(wheelset, 1)
    from wrcore.contact.search.detection import find_patches as after

    assert (after, strip.math, system.element_forces) == before
    assert strip.math is math


def test_stages_add_up_and_grow_with_the_vehicle(wheelset):
    alone = count_operations(wheelset, 2)
    train = count_operations(record(scene("suspended_wheelset", "vehicle.count=3", "vehicle.spacing=3"), 0.1, 4), 2)
    assert set(alone) == {*STAGES, "whole"}
    for name in ("flops", "bytes"):
        assert alone["whole"][name] == pytest.approx(sum(alone[stage][name] for stage in STAGES))
    assert alone["joints"]["flops"] == 0
    for stage in ("bodies", "suspension", "patch", "Hertz"):
        assert train[stage]["flops"] == pytest.approx(3 * alone[stage]["flops"], rel=1e-9)


def test_search_does_more_than_any_other_stage_of_a_wheel(wheelset):
    counted = count_operations(wheelset, 2)
    assert counted["search"]["flops"] > 2 * counted["patch"]["flops"] > 0


def test_breakdown_beside_limits():
    table = breakdown("wheelset", scene("suspended_wheelset"), 4, 2)
    assert list(table["stage"]) == [*STAGES, "whole"]
    assert table["share"].iloc[:-1].sum() == pytest.approx(1.0, abs=0.3)  # medians of stages and of the whole
    found = limits(1)
    assert found["flop_per_ns"] > 0.5
    limited = with_limits([table], found)
    whole = limited.iloc[-1]
    assert whole["least_ns"] >= whole["flops"] / found["flop_per_ns"]
    assert whole["times_least"] > 1.0


def test_limit_is_the_longest_of_the_three():
    row = {"scene": "a", "stage": "patch", "ns": 40.0, "flops": 100.0, "divisions": 4.0, "roots": 2.0, "bytes": 80.0}
    found = {"flop_per_ns": 10.0, "byte_per_ns": 20.0, "ns_per_division": 3.0, "ns_per_root": 4.0}
    limited = SimpleNamespace(**with_limits([pd.DataFrame([row])], found).iloc[0].to_dict())
    assert (limited.least_ns, limited.limit, limited.times_least) == (20.0, "divisions and roots", 2.0)
    assert (limited.flop_per_ns, limited.byte_per_ns) == (2.5, 2.0)


def test_numbers_behave_as_numbers():
    tally = Tally()
    x = Number(2.5, tally)
    assert (int(x), float(-x), abs(Number(-1.0, tally)) >= 1.0, math.floor(x)) == (2, -2.5, True, 2)
    assert float(x**2) == 6.25
    assert min(x, Number(1.0, tally)) == 1.0
    assert tally.counts["bodies", "flops"] == 0
