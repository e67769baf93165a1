"""What the kernels' room relies on beyond numba's documented interface (its page: ``wrcore/kernels/__init__.py``)."""

import importlib
import re
import subprocess
import sys
from typing import NamedTuple

import numba
import numpy as np
import pytest
from packaging.specifiers import SpecifierSet

import wrcore.kernels
from tests.conftest import ROOT
from wrcore.kernels.handles import Handle, Kernel
from wrcore.kernels.jit import jit

INTERNALS = (
    "numba._dispatcher.compute_fingerprint", "numba.core.cgutils.get_or_insert_function",
    "numba.core.cgutils.unpack_tuple", "numba.core.imputils.lower_builtin",
    "numba.core.imputils.lower_getattr_generic", "numba.core.registry.cpu_target",
    "numba.core.typing.templates.infer_global", "numba.core.typing.templates.infer_getattr",
    "numba.core.typing.templates.AttributeTemplate", "numba.np.numpy_support.from_dtype",
    "numba.np.numpy_support.map_layout", "numba.extending.intrinsic", "numba.extending.NativeValue",
)  # fmt: skip


@pytest.mark.parametrize("name", INTERNALS)
def test_an_internal_is_where_it_was(name):
    module, _, attribute = name.rpartition(".")
    assert hasattr(importlib.import_module(module), attribute), f"numba {numba.__version__} has moved {name}"
    assert attribute in wrcore.kernels.__doc__


def test_kernels_without_references_allocate_no_counter():
    @jit(allocates=False, cache=False)
    def first(values):
        return values[0]

    assert first(np.array([2.0])) == 2.0
    (compiled,) = first.overloads.values()
    assert "NRT_incref" not in compiled.library.get_llvm_str()


def test_a_kernel_has_an_address_and_a_handle_a_type():
    @jit(allocates=False, cache=False)
    def fill(values):
        values[0] = 1.0

    assert Kernel(fill, np.zeros(1)).address > 0
    assert "Reference" in str(Handle((np.zeros(1), 1.0))._numba_type_)


def test_the_type_of_an_array_needs_no_masked_ones():
    code = "import numpy as np, sys; from wrcore.kernels.handles import Handle; handle = Handle((np.zeros(2)[::-1], 1))"
    code += "; print(handle._numba_type_.target, 'numpy.ma' in sys.modules)"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert found.split("\n")[0] == "Tuple(array(float64, 1d, A), int64) False"


def test_named_tuples_are_compared_with_no_type_of_numba():
    class Pair(NamedTuple):
        one: int

    assert numba.types.Type.__subclasshook__(Pair) is False  # so that its subclasses are not asked one by one
    assert issubclass(numba.types.Float, numba.types.Type) and isinstance(numba.float64, numba.types.Type)
    assert str(numba.typeof(Pair(1))) == "Pair(int64 x 1)"


def test_a_handle_holds_what_a_kernel_would_write():
    class Inner(NamedTuple):
        flag: bool
        number: float

    class Outer(NamedTuple):
        yes: bool
        whole: int
        rows: np.ndarray
        inner: Inner
        single: np.ndarray
        no: bool

    value = Outer(True, -7, np.arange(6.0).reshape(2, 3), Inner(True, 2.5), np.ones(2, np.float32), False)
    handle = Handle(value)

    @jit(allocates=False, cache=False)
    def read(outer, out):
        out[0], out[1], out[2] = outer.yes, outer.whole, outer.rows[1, 2]
        out[3], out[4], out[5], out[6] = outer.inner.flag, outer.inner.number, outer.single[1], outer.no

    out = np.full(7, np.nan)
    read(handle, out)
    assert out.tolist() == [1.0, -7.0, 5.0, 1.0, 2.5, 1.0, 0.0]


def test_the_release_of_numba_is_one_that_was_tested():
    bounds = re.search(r'"numba(.*?)"', (ROOT / "pyproject.toml").read_text())[1]
    assert "<" in bounds and SpecifierSet(bounds).contains(numba.__version__)


def test_numba_does_not_import_scipy_at_every_start():
    code = "import sys; from wrcore.creep.axes import _stretch; _stretch(0.5); assert 'scipy.linalg' not in sys.modules"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
