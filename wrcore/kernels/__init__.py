"""Compilation of kernels with numba; this package does not depend on the contact or vehicle models.

``jit``      the compile decorator, and a cache that never returns kernels of edited sources
``aside``    a second process that compiles the kernels that a first run needs last
``forms``    three compiled forms of a kernel: called by Python, called by address, linked into other kernels
``lanes``    vector registers of four, eight or 32 float64 in kernels
``handles``  models that are passed by pointer, kernels that are called by address

The list below names the internals of numba that this package uses beyond the documented interface.
``tests/kernels/test_internals.py`` fails if a release of numba has moved one of them. ``pyproject.toml`` admits only
releases that were tested.

jit       ``njit(_nrt=False)``: no reference counts in kernels that create no arrays; ``forceinline``;
          ``numba.np.linalg.ensure_blas``, which imports scipy.linalg for ``numba.np.arraymath``
forms     ``JITCodeLibrary`` makes machine code in ``_finalize_final_module`` only; ``flags.no_compile``,
          ``NativeLowering``, ``insert_user_function``; dispatchers request other kernels by ``get_call_template`` and
          ``get_overload``; ``CompileResultCacheImpl`` and its form of a library, ``FunctionCache._index_key`` and
          ``_load_overload``, ``rtsys``; ``numba.config.CACHE_DIR`` read when a cache is made; ``cached_internal_func``
          of a compiler's ``targetctx`` holds numba's helpers
lanes     ``intrinsic`` and ``register_model`` for a new type, its operators by ``infer_global`` and
          ``lower_builtin``; ``cgutils.get_or_insert_function``, ``unpack_tuple``; ``context.make_array``
handles   ``compute_fingerprint`` of a named tuple as the key of its layout; ``AttributeTemplate``, ``infer_getattr``,
          ``lower_getattr_generic`` for fields behind a pointer; ``NativeValue``; ``cpu_target``'s sizes of types;
          ``types.Type`` as an abstract base class with a ``__subclasshook__``;
          ``typeof_impl.dispatch`` of arrays, by ``from_dtype`` and ``map_layout`` of ``numba.np.numpy_support``;
          ``overloads[...].library.get_pointer_to_function`` and the calling convention (``context.call_conv``)
"""
