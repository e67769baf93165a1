"""How kernels are compiled; nothing about rails.

``jit``      the compile decorator and a cache that never serves stale kernels
``aside``    a second process that compiles what a first run needs last
``forms``    what of a kernel is compiled: for Python, for its address, or for other kernels
``lanes``    four or eight float64 side by side in kernels
``handles``  models behind a pointer, kernels behind an address

What this room relies on beyond numba's documented interface. ``tests/kernels/test_internals.py`` says at once when a
release of numba has moved some of it, and ``pyproject.toml`` admits no release that was not tested.

jit       ``njit(_nrt=False)``: no reference counts in kernels that create no arrays; ``forceinline``;
          ``numba.np.linalg.ensure_blas``, which imports scipy.linalg for ``numba.np.arraymath``
forms     ``JITCodeLibrary`` makes machine code in ``_finalize_final_module`` alone; ``flags.no_compile``,
          ``NativeLowering``, ``insert_user_function``; dispatchers ask for other kernels by ``get_call_template`` and
          ``get_overload``; ``CompileResultCacheImpl`` and what it makes of a library, ``FunctionCache._index_key`` and
          ``_load_overload``, ``rtsys``; ``numba.config.CACHE_DIR`` read when a cache is made; ``cached_internal_func``
          of a compiler's ``targetctx`` holds numba's helpers
lanes     ``intrinsic`` and ``register_model`` for a type of one's own, its operators by ``infer_global`` and
          ``lower_builtin``; ``cgutils.get_or_insert_function``, ``unpack_tuple``; ``context.make_array``
handles   ``compute_fingerprint`` of a named tuple as the key of its layout; ``AttributeTemplate``, ``infer_getattr``,
          ``lower_getattr_generic`` for fields behind a pointer; ``NativeValue``; ``cpu_target``'s sizes of types;
          ``types.Type`` as an abstract base class with a ``__subclasshook__``;
          ``typeof_impl.dispatch`` of arrays, which ``from_dtype`` and ``map_layout`` of ``numba.np.numpy_support`` do;
          ``overloads[...].library.get_pointer_to_function`` and the calling convention (``context.call_conv``)
"""
