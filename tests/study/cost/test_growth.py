"""Growth: bytes, findings, and runs that do not depend on what runs beside them."""

import numpy as np
import pandas as pd
import pytest

from study.cost.growth import array_bytes, cache_sizes, findings, identical, over_scenes
from study.cost.recorded import evaluation, record
from tests.conftest import ELLIPTIC
from wrcore.equations.equations_of_motion import Equations
from wrcore.errors import InputError
from wrcore.run.simulate import simulate, simulate_many
from wrcore.scene.compile import compile_scene
from wrcore.scene.description import load_scene

SHORT = ["integration.duration=0.2"]


def test_bytes_of_nested_tuples_count_once():
    a = np.zeros(10)
    assert array_bytes((a, (a, 1.0, np.zeros(3, np.float32)), "text")) == 80 + 12


@pytest.mark.parametrize("threads", [1, 2])
def test_runs_do_not_depend_on_those_beside_them(threads):
    speeds = (15.0, 40.0, 60.0)
    scenes = [load_scene(ELLIPTIC / "suspended_wheelset.yaml", [*SHORT, f"speed={v}"]) for v in speeds]
    together = simulate_many(scenes, progress=False, threads=threads)
    for run, scene in zip(together, scenes, strict=True):
        assert identical(run, simulate(scene, progress=False))
    assert not identical(together[0], together[1])


def test_one_number_makes_a_difference():
    scene = load_scene(ELLIPTIC / "suspended_wheelset.yaml", SHORT)
    run, other = simulate(scene, progress=False), simulate(scene, progress=False)
    assert identical(run, other)
    other.groups["wheelset"]["y_m"] = np.nextafter(run.groups["wheelset"]["y_m"], 1.0)
    assert not identical(run, other)


def test_table_of_simultaneous_scenes_says_that_they_are_identical():
    source = ELLIPTIC / "suspended_wheelset.yaml"
    table = over_scenes("wheelset", source, SHORT, counts=[1, 2], threads=[1, 2], passes=1)
    assert list(table["threads"]) == [1, 2, 1, 2]
    assert table["identical"].all()
    assert table["processors"].between(0.0, 3.0).all()
    assert (table["faster"][table["threads"] == 1] == 1.0).all()


def test_recorded_states_accelerate_as_they_did():
    scene = load_scene(ELLIPTIC / "suspended_wheelset.yaml", ["speed=60"])
    recorded = record(scene, 0.1, 4)
    model = compile_scene(scene)[0]
    run = simulate(load_scene(ELLIPTIC / "suspended_wheelset.yaml", ["speed=60", "output.rate=40"]), progress=False)
    later = recorded.states[3].copy()
    equations = Equations(model)
    rate = equations(0.0, later)
    later[0] += 6.0
    np.testing.assert_allclose(equations(0.1, later), rate, rtol=1e-6, atol=1e-6)
    assert recorded.states[3, 1] == pytest.approx(run["wheelset"].y_m[4], abs=1e-8)
    contender = evaluation("", recorded)
    assert contender.units % 4 == 0


def test_irregular_track_is_refused_where_states_are_moved_along_it():
    track = "track.irregularity={spectrum: {level: low, seed: 1, length: 100, begin: 10}}"
    with pytest.raises(InputError, match="expected a tangent, perfect track"):
        record(load_scene(ELLIPTIC / "suspended_wheelset.yaml", [track]), 0.1, 2)


def trains(times):
    table = pd.DataFrame({"wheelsets": [1, 4, 16], "evaluation_us_per_wheelset": times})
    return table.assign(scene="train", own_bytes=[10, 40, 160], shared_bytes=1000)


def test_findings_name_the_train_that_leaves_arithmetic():
    caches = {"L1": 500, "L2": 2000, "L3": 10_000}
    assert findings(trains([1.1, 1.0, 1.2]), caches).iloc[0]["wheelsets_beyond_arithmetic"] == "none"
    row = findings(trains([1.0, 1.1, 1.6]), caches).iloc[0]
    assert row["wheelsets_beyond_arithmetic"] == 16
    assert (row["longest_train_bytes"], row["held_by"]) == (1160, "L2")
    assert findings(trains([1.0, 1.1, 1.6]), {}).iloc[0]["held_by"] == "memory"


def test_caches_of_this_machine_grow():
    sizes = list(cache_sizes().values())
    assert sizes == sorted(sizes)
