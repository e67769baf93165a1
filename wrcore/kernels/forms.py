"""Three compiled forms of a kernel, each compiled only when needed.

called     called from Python: machine code, and the wrapper that converts arguments of Python
addressed  called by its address (`wrcore.kernels.handles.Kernel`): machine code
linked     called from other kernels: code that LLVM links into them, no machine code

Numba compiles all forms of every kernel, and a wrapper for C. Most kernels are called only by other kernels.
"""

import gc
import os
from contextlib import contextmanager, nullcontext

import numba
from llvmlite import binding
from numba.core import types
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, CompileResult, DefaultPassBuilder
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import AnalysisPass, register_pass
from numba.core.registry import CPUDispatcher
from numba.core.runtime import rtsys
from numba.core.typed_passes import NativeLowering

from wrcore.errors.messages import say_if_long, warn
from wrcore.kernels import aside
from wrcore.kernels.cache import kernel_folder, sources_changed

_FOLDER = str(kernel_folder())


class _Intermediate(JITCodeLibrary):
    """Intermediate code of a kernel (LLVM), which other kernels link.

    It is optimised together with the code of the calling kernel only. Otherwise a kernel that is called through a chain
    of ten others would be optimised ten times, which took a fifth of a first run."""

    def _optimize_final_module(self):
        pass

    def _finalize_final_module(self):
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


@register_pass(mutates_CFG=False, analysis_only=True)
class _Register(AnalysisPass):
    """Compiler pass that registers a linked kernel for its callers, as numba does for kernels with machine code."""

    _name = "wrcore_register_linked"

    def __init__(self):
        super().__init__()

    def run_pass(self, state):
        lowered = state["cr"]._replace(cfunc=object())
        state.targetctx.insert_user_function(lowered.cfunc, lowered.fndesc, [state.library])
        state.reload_init.extend(state.library._reload_init)
        state["cr"] = lowered
        return False


_helpers = {}


class KernelCompiler(CompilerBase):
    """Compiler with numba's passes, and separate helper functions (powers) for each set of fast-math flags.

    Numba compiles a helper once in a process, with the flags of the kernel that needs it first. Its rounding would
    depend on the order of compilation."""

    def define_pipelines(self):
        state = self.state
        flags = frozenset(state.flags.fastmath.flags), bool(state.flags.nrt)
        state.targetctx.cached_internal_func = _helpers.setdefault(flags, {})
        return [self._passes(state)]

    def _passes(self, state):
        return DefaultPassBuilder.define_nopython_pipeline(state)


class _LinkedCompiler(KernelCompiler):
    """Compiler with all passes except the last one, which generates machine code."""

    def _passes(self, state):
        state.flags.no_compile = True
        state.library = _Intermediate(state.targetctx.codegen(), state.func_id.func_qualname)
        passes = super()._passes(state)
        passes.add_pass_after(_Register, NativeLowering)
        passes.finalize()
        return passes


class _LinkedFile(CompileResultCacheImpl):
    """Data of a linked kernel in the cache on disk."""

    def reduce(self, result):
        result.library._ensure_finalized()
        result.fndesc.typemap = result.fndesc.calltypes = None
        kept = result.fndesc, result.environment, result.signature, result.reload_init
        return result.library.name, result.library._final_module.as_bitcode(), kept

    def rebuild(self, target_context, payload):
        name, code, (description, environment, signature, reload_init) = payload
        for prepare in reload_init:
            prepare()
        library = _Intermediate(target_context.codegen(), name)
        library._final_module = binding.parse_bitcode(code)
        library._finalize_final_module()
        return CompileResult(
            typing_context=target_context.typing_context, target_context=target_context, entry_point=object(),
            typing_error=None, type_annotation="", signature=signature, objectmode=False, lifted=(),
            fndesc=description, library=library, call_helper=None, environment=environment, metadata=None,
            reload_init=reload_init, referenced_envs=(),
        )  # fmt: skip


class _MachineCode(CompileResultCacheImpl):
    """Data of a kernel with machine code in the cache on disk.

    Numba would also store the code for linking and read it at each start. Here this is a separate form; the names of
    the functions are sufficient."""

    def reduce(self, result):
        (name, kind, (code, linked)), *rest = super().reduce(result)
        names = [function.name for function in binding.parse_bitcode(linked).functions if not function.is_declaration]
        stubs = binding.parse_assembly("\n".join(f'define void @"{each}"() {{ ret void }}' for each in names))
        return (name, kind, (code, stubs.as_bitcode())), *rest


class KernelCache(FunctionCache):
    """Numba's cache of a kernel in one form; a damaged file or a full disk only causes a warning."""

    def __init__(self, function, form="called"):
        self._form, self._function = form, function
        self._impl_class = _LinkedFile if form == "linked" else _MachineCode
        before, folder = numba.config.CACHE_DIR, os.path.join(_FOLDER, aside.linked) if form == "linked" else _FOLDER
        try:
            numba.config.CACHE_DIR = folder
            super().__init__(function)
        finally:
            numba.config.CACHE_DIR = before
        for made in (folder, self.cache_path):  # no access for other users, independent of umask
            if made.startswith(_FOLDER + os.sep):
                os.chmod(made, 0o700)

    def _index_key(self, *args):
        return (self._form, *super()._index_key(*args))

    def load_overload(self, *args):
        """Return the cached kernel for a signature, or None."""
        found = self._load(*args)
        return self._load(*args) if found is None and aside.missed(self._function, self._form) else found

    def _load(self, signature, target_context):
        """Load a kernel from the cache without initialising the compiler, which would take a tenth of every start."""
        rtsys.initialize(target_context)
        try:
            with self._guard_against_spurious_io_errors():
                return self._load_overload(signature, target_context)
        except Exception as error:  # pickles fail in many ways
            warn(f"cache {self.cache_path}: damaged ({type(error).__name__}); kernels are compiled anew")
            self._tried(self.flush)
        return None

    def save_overload(self, *args):
        """Store a kernel in the cache, unless its sources were edited after the start of this process.

        The folder is named by the digest of the sources at the start."""
        if sources_changed():
            warn("sources of kernels were edited while this process ran: its kernels are not kept")
        else:
            self._tried(super().save_overload, *args)

    def _tried(self, act, *args):
        try:
            act(*args)
        except Exception as error:
            warn(f"cache {self.cache_path}: {getattr(error, 'strerror', None) or error}; kernels are not kept")


def _set_environments(result):
    """Set the globals that error messages of linked kernels need, as numba does after loading."""
    for environment in result._find_referenced_environments():
        result.library.codegen.set_env(environment.env_name, environment)


_COMPILING = "compiling, once: about half a minute for a scene of a new kind, a minute or two for exact contact"


@contextmanager
def _rarely_collected():
    """Run Python's garbage collection a hundredth as often during compilation, and print a message if it takes long.

    The small objects of the compiler live until it ends, and collection took a tenth of its time. Only one thread at a
    time may compile, because the settings of the collection belong to the process."""
    global _compiling
    with global_compiler_lock:
        before = gc.get_threshold()
        within = _compiling > 0
        _compiling += 1
        gc.set_threshold(before[0] and max(before[0], 100_000), *before[1:])
        try:
            with nullcontext() if within else say_if_long(_COMPILING):
                yield
        finally:
            gc.set_threshold(*before)
            _compiling -= 1


_compiling = 0
"""Number of kernels in compilation; each one after the first is compiled for the kernel before."""


def _number(kind):
    """Return the type of an argument; for a literal number the general type of the number."""
    return types.unliteral(kind) if isinstance(kind, types.IntegerLiteral | types.BooleanLiteral) else kind


class _Form(CPUDispatcher):
    """A kernel in a ``form`` that Python cannot call; it is not entered in the dispatcher's table of calls.

    One compiled copy is used for all values of a literal number; numba would compile one copy for each value."""

    def get_call_template(self, args, kws):
        return super().get_call_template(tuple(map(_number, args)), {name: _number(kws[name]) for name in kws})

    def compile(self, sig):
        with _rarely_collected():
            return super().compile(sig)

    def add_overload(self, result):
        self.overloads[tuple(result.signature.args)] = result
        if not isinstance(result.library, _Intermediate):
            _set_environments(result)


class KernelDispatcher(CPUDispatcher):
    """A kernel in the form that Python calls; other kernels use its linked form."""

    form = "called"

    @property
    def _cache(self):
        """Cache of the kernel, created at the first call: a process imports hundreds of kernels and calls few."""
        if self._own_cache is None:
            self._own_cache = KernelCache(self.py_func)
        return self._own_cache

    @_cache.setter
    def _cache(self, cache):
        """Set the cache, as numba does when it creates a dispatcher from a pickle."""
        self._own_cache = cache

    _own_cache = None

    def compile(self, sig):
        with _rarely_collected():
            return super().compile(sig)

    def get_call_template(self, args, kws):
        return self.in_form("linked").get_call_template(args, kws)

    def get_overload(self, sig):
        return self.in_form("linked").get_overload(sig)

    @property
    def is_compiling(self):
        """Whether the kernel is in compilation, so that a call in its code is a recursion."""
        return self._compiling_counter or self.in_form("linked").is_compiling

    def in_form(self, form):
        """Return the dispatcher of a form of this kernel: "linked", "addressed", or "called" (the kernel itself)."""
        forms = self.__dict__.setdefault("forms", {"called": self})
        if form not in forms:
            options = self.targetoptions | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
            compiler = _LinkedCompiler if form == "linked" else KernelCompiler
            forms[form] = _Form(self.py_func, dict(self.locals), options, pipeline_class=compiler)
            forms[form]._cache, forms[form].form = KernelCache(self.py_func, form), form
        return forms[form]

    def add_overload(self, result):
        super().add_overload(result)
        _set_environments(result)
