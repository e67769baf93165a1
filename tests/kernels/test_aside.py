"""What a second process compiles is found in the cache; what it does not is compiled here."""

import json
import os
import subprocess
import sys

import pytest

from wrcore.integrate.integrator import needed_last
from wrcore.run.simulate import output_times
from wrcore.run.simulation import Simulation
from wrcore.scene.description import load_scene
from wrcore.scene.examples import example

PROGRAM = """
import json, os, sys
import numba
from wrcore.contact.hertz import contact_modulus
from wrcore.kernels import aside
from wrcore.kernels.jit import jit

if MODE == "one processor":
    os.sched_getaffinity = lambda _: {0}
if MODE == "no python":
    sys.executable = os.path.join(os.path.dirname(sys.executable), "python-of-nobody")
if MODE == "it dies":
    aside._BEGIN = "raise SystemExit(1)"

first = jit(allocates=False)(lambda x: x + 1.0)
planned = 0

def needed_last():
    global planned
    planned += 1
    return [(contact_modulus, (numba.float64, numba.float64))]

with aside.compiled_aside(needed_last):
    first(1.0)
begun = aside._running is not None
modulus = contact_modulus(8e10, 0.25)
hits, misses = contact_modulus.stats.cache_hits, contact_modulus.stats.cache_misses
again = jit(allocates=False)(lambda x: x + 2.0)(1.0)
print(json.dumps([planned, begun, sum(hits.values()), sum(misses.values()), modulus, aside._running is None]))
"""


@pytest.mark.parametrize("mode", ["as it is", "one processor", "no python", "it dies"])
def test_a_kernel_that_is_needed_last_is_compiled_by_another_process_or_here(tmp_path, mode):
    program = tmp_path / "program.py"
    program.write_text(f"MODE = {mode!r}\n{PROGRAM}")
    own = os.environ | {"WRCORE_CACHE": str(tmp_path / "cache")}
    done = subprocess.run([sys.executable, program], env=own, capture_output=True, text=True)
    assert not done.stderr
    planned, begun, hits, misses, modulus, over = json.loads(done.stdout)
    assert planned == (mode != "one processor") and over
    assert modulus == 2.0 * 8e10 / (2.0 * (1.0 - 0.25))
    assert begun == (mode in ("as it is", "it dies"))
    assert (hits, misses) == ((1, 0) if mode == "as it is" else (0, 1))


@pytest.mark.parametrize(
    ("scene", "settings"),
    [
        ("suspended_wheelset", {"contact.patch": "moment", "speed": 80.0, "integration.duration": 0.3}),
        ("suspended_wheelset", {"contact.patch": "tabulated", "integration.method": "rodas5"}),
        ("trailer_vehicle", {"integration.method": "tsit5"}),
    ],
)
def test_what_is_planned_is_what_a_run_compiles(scene, settings):
    scene = load_scene(example(scene), {"integration.duration": 1e-3, **settings})
    simulation, integration = Simulation(scene), scene.data["integration"]
    planned = needed_last(simulation.model, integration["method"])
    simulation.advance(output_times(0.0, integration["duration"], 1e3))
    forms = {"tsit5": ["called"], "rodas5": ["addressed", "called"], "auto": ["addressed", *["called"] * 3]}
    assert [kernel.form for kernel, _ in planned] == forms[integration["method"]]  # auto: two methods, and its look
    for kernel, types in planned:
        assert types in kernel.overloads


def test_methods_of_other_libraries_need_no_kernels_of_ours():
    assert needed_last(None, "scipy_radau") == []
