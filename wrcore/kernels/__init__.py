"""How kernels are compiled; nothing about rails.

``jit``      the compile decorator and a cache that never serves stale kernels
``lanes``    four or eight float64 side by side in kernels
``handles``  models behind a pointer, kernels behind an address

What this room relies on beyond numba's documented interface; ``tests/kernels/test_internals.py`` says at once when a
release of numba moves it, and ``pyproject.toml`` admits no release that was not tested:

====================================================  ===============================================================
``njit(_nrt=False)``                                  `jit`: no reference counts in kernels that create no arrays
``forceinline``, ``fastmath`` as a set                `jit`: LLVM's ``alwaysinline``; the flags one by one
``numba.config.CACHE_DIR`` while decorating           `jit`: a cache folder of one's own
``numba.core.cgutils``, ``context.make_array``        `lanes`, `handles`: lowering of an intrinsic, layout of an array
``infer_global``, ``lower_builtin``                   `lanes`: operators of a type of one's own
``numba._dispatcher.compute_fingerprint``             `handles`: types of a model's fields without unpacking it
====================================================  ===============================================================
"""
