"""Compile decorator for all kernels, with a cache that never returns kernels of edited sources.

Numba detects edits of the file that holds a kernel, but not edits of kernels imported from other files. The name of the
cache folder is therefore a digest of all sources in packages with kernels: after an edit a new folder is used.
"""

import numba
from numba.core import types
from numba.extending import intrinsic
from numba.np import linalg

from wrcore.errors import InputError
from wrcore.kernels.forms import KernelCompiler, KernelDispatcher

if numba.config.DISABLE_JIT:
    raise InputError("NUMBA_DISABLE_JIT", "", "expected it unset: kernels hand each other addresses of compiled code")

_ensured, linalg.ensure_blas = linalg.ensure_blas, lambda: None
from numba.np import arraymath  # noqa: E402, F401  would import scipy.linalg, a tenth of every start, as a test

linalg.ensure_blas = _ensured

FAST = {"contract", "nsz", "arcp", "reassoc"}
"""Fast-math flags for scan loops: sums may be reordered; NaN and infinity are still handled correctly."""

FUSED = {"contract"}
"""Fast-math flag for any kernel: a product and a sum may become one instruction, rounded once.

The compiler selects them depending on the surrounding code. A kernel that is called and not inlined has a copy in each
calling kernel. The search for overlaps does not use this flag, so that all copies are bitwise identical."""


def jit(function=None, *, allocates=True, **options):
    """Compile a kernel with ``numba.njit``, cached, with C division (no ZeroDivisionError branch).

    ``options`` are those of numba; ``fastmath=FAST`` is for scan loops only. Fast math and inlining are off by default:
    numba would otherwise take them from the first caller, and the code would depend on the order of compilation.
    ``allocates=False`` is for kernels that create no arrays except views: numba then counts no references. Counting
    costs more than the arithmetic if the argument of a kernel is a tuple of many arrays."""
    if function is None:
        return lambda f: jit(f, allocates=allocates, **options)
    settings = {"error_model": "numpy", "fastmath": False, "forceinline": False, "no_cfunc_wrapper": True, **options}
    if not allocates:
        settings["_nrt"] = False
    dispatcher = numba.njit(function, pipeline_class=KernelCompiler, **settings)
    dispatcher.__class__ = KernelDispatcher
    return dispatcher


@intrinsic
def rarely_called(_):
    """Prevent inlining of a kernel, as its first line, so that the usual path of its callers needs fewer registers."""

    def generate(context, builder, __, ___):
        for attribute in ("noinline", "cold"):
            builder.function.attributes.add(attribute)
        return context.get_dummy_value()

    return types.void(), generate
