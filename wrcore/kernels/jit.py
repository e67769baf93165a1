"""The one compile decorator, and a cache folder that never serves stale kernels.

Numba notices edits of the file that holds a kernel, but not of a kernel imported from another file. The cache
folder is therefore named after the content of all sources in the rooms that hold kernels: an edit there starts a
fresh cache.
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
from numba.np import arraymath  # noqa: E402, F401  it would import scipy.linalg, a tenth of every start, to see it is there

linalg.ensure_blas = _ensured

FAST = {"contract", "nsz", "arcp", "reassoc"}
"""Fast-math flags for scan loops: sums may be reordered; NaN and infinity stay what they are."""

FUSED = {"contract"}
"""Fast-math flag for any kernel: a product and a sum may become one instruction, rounded once.

Which ones do depends on the code around. A kernel that is called, not inlined, exists once in each kernel that calls
it; the search for overlaps, where this showed, goes without the flag so that all copies give the same bits."""


def jit(function=None, *, allocates=True, **options):
    """Compile a kernel: ``numba.njit``, cached, with C division (no ZeroDivisionError branch); ``options`` are numba's,
    ``fastmath=FAST`` for scan loops only.

    What is not asked for is switched off: numba would hand fast math and inlining on from the first caller that has a
    kernel compiled, so that its code depended on who came first. With ``allocates=False``, for kernels that create no
    arrays but views, numba counts no references, which costs more than the arithmetic where a kernel is handed a tuple
    of many arrays."""
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
    """In a kernel's first line: keep it out of its callers, whose common path should not carry its registers along."""

    def generate(context, builder, __, ___):
        for attribute in ("noinline", "cold"):
            builder.function.attributes.add(attribute)
        return context.get_dummy_value()

    return types.void(), generate
