"""What decides on a function of a user's own: its digest."""

import ctypes
import gc
import importlib
import os
import subprocess
import sys
import weakref

import numba
import numpy as np
import pytest

from tests.conftest import ROOT
from wrcore.errors.checked_yaml import name_of_function
from wrcore.kernels import own
from wrcore.kernels.handles import Kernel
from wrcore.kernels.named_laws import Laws

TEXT = """
import math

import numpy as np
from numba import njit

GAIN, TABLE, KINDS = 1e3, np.array([1.0, 2.0]), frozenset(("soft", "hard", "none"))

@njit
def half(speed):
    return 0.5 * GAIN * speed

@njit
def law(speed):
    return half(speed) + math.sin(TABLE[1])

def plain(speed, scale=2.0):
    return (lambda x: GAIN * scale * x)(speed) if "soft" in KINDS else 0.0
"""


def laws_of(function):
    """A function as a program gives it to a scene."""
    return Laws().find(name_of_function(function))


@pytest.fixture
def module(tmp_path, monkeypatch):
    (tmp_path / "own_digests.py").write_text(TEXT)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    yield importlib.import_module("own_digests")
    del sys.modules["own_digests"]


@pytest.mark.parametrize("name", ["law", "plain"])
def test_what_a_function_does_decides(module, name, tmp_path):
    def digest():
        return laws_of(getattr(module, name)).digest

    first = digest()
    assert digest() == first
    environment = os.environ | {"PYTHONPATH": f"{tmp_path}:{ROOT}", "PYTHONHASHSEED": "7"}
    script = (
        f"import own_digests; from tests.kernels.test_own import laws_of; print(laws_of(own_digests.{name}).digest)"
    )
    told = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True)
    assert told.stdout.strip() == str(first)  # in another process, where sets have another order
    module.GAIN = 1e6
    assert digest() != first
    (tmp_path / "own_digests.py").write_text(TEXT.replace("0.5 *", "0.25 *").replace("scale=2.0", "scale=3.0"))
    importlib.reload(module)
    assert digest() != first
    (tmp_path / "own_digests.py").write_text(TEXT)
    importlib.reload(module)
    assert digest() == first


def test_what_a_kernel_calls_lives_as_long_as_it():
    """Plain Python behind a kernel was freed with the first sweep of unused objects: a crash some time later."""

    def kernel_of(factor):
        back = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(lambda x: factor * x)
        called = own.uncached(lambda values: fill(values, back(values[0])))
        return Kernel(called, np.zeros(1)), weakref.ref(back)

    @numba.njit
    def fill(values, x):
        values[0] = x

    kernel, back = kernel_of(2.0)
    gc.collect()
    assert kernel.address and back() is not None
