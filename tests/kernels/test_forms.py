"""What of a kernel is compiled, and that what a process compiled and what it found in the cache are the same."""

import gc
import json
import os
import pickle
import re
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from numba.core.codegen import CPUCodeLibrary
from numba.core.errors import TypingError

from wrcore.contact.hertz import hertz_ellipse
from wrcore.kernels import forms
from wrcore.kernels.forms import KernelDispatcher
from wrcore.kernels.handles import Kernel
from wrcore.kernels.jit import FUSED, jit


@jit(allocates=False)
def half(x):
    return 0.5 * x


@jit(allocates=False)
def fill_halves(values):
    for i in range(values.shape[0]):
        values[i] = half(values[i])


def symbols(kernel):
    """Names of what a kernel's library defines."""
    (result,) = kernel.overloads.values()
    return [f.name for f in result.library._final_module.functions if not f.is_declaration], result


def fresh(function):
    """The kernel once more, compiled whatever the cache holds."""
    kernel = jit(allocates=False)(function.py_func)
    for each in (kernel, kernel.in_form("addressed")):
        each._cache.disable()
    return kernel


def test_numbers_that_a_caller_knows_share_one_copy():
    inner = jit(allocates=False)(lambda x, place, deep: x + place if deep else x)
    outer = jit(allocates=False)(lambda x: inner(x, 1, True) + inner(x, 2, True) + inner(x, place=3, deep=False))
    assert outer(1.0) == 6.0
    assert len(inner.in_form("linked").overloads) == 1


def test_a_kernel_that_only_kernels_call_has_no_machine_code_and_no_wrapper():
    inner = jit(allocates=False)(lambda x: 0.25 * x)
    outer = jit(allocates=False)(lambda x: inner(x) + 1.0)
    assert outer(4.0) == 2.0 and not inner.overloads
    names, result = symbols(inner.in_form("linked"))
    assert not any("cpython" in name or "cfunc" in name for name in names)
    with pytest.raises(RuntimeError, match="no compiled object"):
        result.library.enable_object_caching()
        result.library._get_compiled_object()
    assert inner(4.0) == 1.0 and len(inner.overloads) == 1  # compiled anew for Python


def test_what_kernels_link_is_optimised_once_with_them_and_garbage_hardly_looked_for(monkeypatch):
    seen, usual = [], gc.get_threshold()
    optimise = CPUCodeLibrary._optimize_final_module

    def watched(library):
        if "lambda" in library.name:  # not numba's own
            seen.append(gc.get_threshold()[0])
        optimise(library)

    monkeypatch.setattr(CPUCodeLibrary, "_optimize_final_module", watched)
    inner = jit(allocates=False)(lambda x: 0.25 * x)
    middle = jit(allocates=False)(lambda x: inner(x) + 1.0)
    outer = jit(allocates=False)(lambda x: middle(x) * 2.0)
    for each in (inner, middle, outer):
        each._cache.disable()
        each.in_form("linked")._cache.disable()
    assert outer(4.0) == 4.0
    assert len(seen) == 1 and seen[0] >= 100_000
    assert gc.get_threshold() == usual
    with pytest.raises(TypingError):
        outer("four")
    assert gc.get_threshold() == usual


def test_threads_that_compile_leave_the_garbage_collector_as_it_was():
    usual, met = gc.get_threshold(), []

    def other():
        with forms._rarely_collected():
            met.append(True)
            left.wait(5.0)

    left, thread = threading.Event(), threading.Thread(target=other)
    with forms._rarely_collected():
        thread.start()
        thread.join(0.2)
        assert not met  # it waits
    left.set()
    thread.join()
    assert met and gc.get_threshold() == usual


def test_a_kernel_called_by_its_address_has_no_wrapper():
    kernel = fresh(fill_halves)
    assert Kernel(kernel, np.zeros(2)).address > 0 and not kernel.overloads
    names, _ = symbols(kernel.in_form("addressed"))
    assert names and not any("cpython" in name or "cfunc" in name for name in names)


@pytest.mark.parametrize("flags", [(False, FUSED), (FUSED, False)], ids=["plain first", "fused first"])
def test_helpers_have_the_flags_of_their_kernel_whoever_came_first(flags):
    number, helped = {}, lambda x, y: x**7 + y
    for fastmath in flags:
        kernel = jit(allocates=False, fastmath=fastmath)(helped)
        kernel._cache.disable()
        assert kernel(2.0, 1.0) == pytest.approx(helped(2.0, 1.0), rel=1e-15)
        (compiled,) = kernel.overloads.values()
        code = compiled.library.get_llvm_str()
        number[bool(fastmath)] = code.count("fmul contract"), len(re.findall(r"fmul double", code))
    assert number[True][0] > 0 == number[True][1] and number[False][1] > 0 == number[False][0]


def test_python_gets_no_wrapper_for_c():
    kernel, values = fresh(fill_halves), np.full(2, 3.0)
    kernel(values)
    names, _ = symbols(kernel)
    assert values.tolist() == [1.5, 1.5] and isinstance(kernel, KernelDispatcher)
    assert any("cpython" in name for name in names) and not any("cfunc" in name for name in names)


@jit
def factorial(n):
    return 1 if n < 2 else n * factorial(n - 1)


@jit
def halved(rows):
    if rows.shape[0] < 2:
        raise ValueError("two rows, please")
    return (half(1.0) * rows) @ rows


@jit
def squared(rows):
    return halved(rows) * 2.0


SCRIPT = """
import json, sys
import numpy as np
from tests.kernels import test_forms as forms
rows = np.arange(4.0).reshape(2, 2)
try:
    forms.squared(rows[:1, :1].copy())
except ValueError as error:
    said = str(error)
before = "scipy.linalg" in sys.modules
out = [forms.squared(rows).tolist(), forms.factorial(5), said, before]
kernels = (forms.squared, forms.halved, forms.half, forms.factorial)
forms_of = [form for kernel in kernels for form in (kernel, *vars(kernel).get('forms', {}).values())]
print(json.dumps([out, sum(sum(k.stats.cache_misses.values()) for k in forms_of)]))
"""


def test_the_cache_gives_what_was_compiled_for_this_processor(tmp_path):
    def run(**processor):
        environment = os.environ | {"WRCORE_CACHE": str(tmp_path)} | processor
        done = subprocess.run([sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True)
        assert done.returncode == 0 and not done.stderr, done.stderr
        return json.loads(done.stdout)

    (first, compiled), (second, again), (other, anew) = run(), run(), run(NUMBA_CPU_NAME="generic")
    assert first[:3] == second[:3] == other[:3] == [[[2.0, 3.0], [6.0, 11.0]], 120, "two rows, please"]
    assert compiled > 0 and again == 0 and anew == compiled


def test_kernels_of_edited_sources_are_not_kept(tmp_path):
    """A process whose sources are edited while it runs may compile what its digest does not name: the folder stays as
    it is, and the source state that comes back later finds no kernel of another."""
    package = tmp_path / "wrcore"
    shutil.copytree(Path(forms.__file__).parents[1], package, ignore=shutil.ignore_patterns("__pycache__"))
    script = (
        f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n"
        "from pathlib import Path\n"
        "from wrcore.contact import hertz\n"
        f"assert hertz.__file__.startswith({str(tmp_path)!r})\n"
        "source = Path(hertz.__file__).with_name('creepage.py')\n"
        "if sys.argv[1:]:\n"
        "    source.write_text(source.read_text() + '\\n')\n"
        "hertz.damping_factor(0.0, 1.0, 1.0)\n"
    )

    def kept(cache, *edited):
        environment = os.environ | {"WRCORE_CACHE": str(cache)}
        told = subprocess.run([sys.executable, "-c", script, *edited], env=environment, capture_output=True, text=True)
        assert told.returncode == 0, told.stderr
        return told.stderr, len(list(cache.rglob("*.nbc")))

    assert kept(tmp_path / "as_read")[1] > 0
    message, count = kept(tmp_path / "edited", "edited")
    assert "edited" in message and count == 0


def test_a_kernel_that_was_pickled_serves_another_process(tmp_path):
    path = tmp_path / "kernel.pkl"
    path.write_bytes(pickle.dumps(hertz_ellipse))
    code = "import pickle, sys; print(pickle.load(open(sys.argv[1], 'rb')).py_func.__name__)"
    done = subprocess.run([sys.executable, "-c", code, path], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("hertz_ellipse\n", "")
