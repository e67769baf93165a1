"""The three forms in which a kernel is compiled, each only when somebody asks for it.

called     from Python: machine code, and the wrapper that takes Python's arguments apart
addressed  by its address (`wrcore.kernels.handles.Kernel`): machine code
linked     from other kernels: what LLVM links into them, no machine code

Numba makes all of it for every kernel, with a wrapper for C besides. Most kernels are called by other kernels alone.
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

from wrcore.kernels import aside
from wrcore.kernels.cache import kernel_folder, sources_changed, warn
from wrcore.kernels.told import say_if_long

_FOLDER = str(kernel_folder())


class _Intermediate(JITCodeLibrary):
    """A kernel's code before any machine's, for others to link.

    Who links it optimises it with its own: a kernel that is called over ten others would else be optimised ten times,
    which was a fifth of a first run."""

    def _optimize_final_module(self):
        pass

    def _finalize_final_module(self):
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


@register_pass(mutates_CFG=False, analysis_only=True)
class _Register(AnalysisPass):
    """Let other kernels find a linked kernel, as numba does with those that have machine code."""

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
    """Numba's passes, with the helpers (powers) of kernels that have the same fast-math flags.

    Numba compiles a helper once in a process, with the flags of the kernel that needs it first: its last bits would
    depend on which kernel that was."""

    def define_pipelines(self):
        state = self.state
        flags = frozenset(state.flags.fastmath.flags), bool(state.flags.nrt)
        state.targetctx.cached_internal_func = _helpers.setdefault(flags, {})
        return [self._passes(state)]

    def _passes(self, state):
        return DefaultPassBuilder.define_nopython_pipeline(state)


class _LinkedCompiler(KernelCompiler):
    """The passes but for the last one, which makes machine code."""

    def _passes(self, state):
        state.flags.no_compile = True
        state.library = _Intermediate(state.targetctx.codegen(), state.func_id.func_qualname)
        passes = super()._passes(state)
        passes.add_pass_after(_Register, NativeLowering)
        passes.finalize()
        return passes


class _LinkedFile(CompileResultCacheImpl):
    """What of a linked kernel is kept on disk."""

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
    """What of a kernel with machine code is kept on disk. Numba would keep what others link, too, and read it at every
    start; that is another form here, and of this one the functions' names do."""

    def reduce(self, result):
        (name, kind, (code, linked)), *rest = super().reduce(result)
        names = [function.name for function in binding.parse_bitcode(linked).functions if not function.is_declaration]
        stubs = binding.parse_assembly("\n".join(f'define void @"{each}"() {{ ret void }}' for each in names))
        return (name, kind, (code, stubs.as_bitcode())), *rest


class KernelCache(FunctionCache):
    """Numba's cache of a kernel in one form; one that is damaged, or full, stops nothing."""

    def __init__(self, function, form="called"):
        self._form, self._function = form, function
        self._impl_class = _LinkedFile if form == "linked" else _MachineCode
        before, folder = numba.config.CACHE_DIR, os.path.join(_FOLDER, aside.linked) if form == "linked" else _FOLDER
        try:
            numba.config.CACHE_DIR = folder
            super().__init__(function)
        finally:
            numba.config.CACHE_DIR = before
        for made in (folder, self.cache_path):  # closed to others, whatever the process's mask
            if made.startswith(_FOLDER + os.sep):
                os.chmod(made, 0o700)

    def _index_key(self, *args):
        return (self._form, *super()._index_key(*args))

    def load_overload(self, *args):
        """The kernel for some types, or None."""
        found = self._load(*args)
        return self._load(*args) if found is None and aside.missed(self._function, self._form) else found

    def _load(self, signature, target_context):
        """As numba's `load_overload`, without what compilers need, a tenth of every start."""
        rtsys.initialize(target_context)
        try:
            with self._guard_against_spurious_io_errors():
                return self._load_overload(signature, target_context)
        except Exception as error:  # pickles fail in many ways
            warn(f"cache {self.cache_path}: damaged ({type(error).__name__}); kernels are compiled anew")
            self._tried(self.flush)
        return None

    def save_overload(self, *args):
        """Keep a kernel; not if its sources were edited since this process began, whose digest names the folder."""
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
    """Hand kernels linked into this one the globals that some error messages need, as numba does after loading."""
    for environment in result._find_referenced_environments():
        result.library.codegen.set_env(environment.env_name, environment)


_COMPILING = "compiling, once: about half a minute for a scene of a new kind, a minute or two for exact contact"


@contextmanager
def _rarely_collected():
    """Let Python look for cycles a hundredth as often: what a compiler makes of small objects is alive until it ends,
    and looking took it a tenth of its time. One thread after the other, as they compile: else one would take for usual
    what another one has set. What takes long is told."""
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
"""Kernels that are being compiled, each for the one before it."""


def _number(kind):
    """The type of an argument; of a number that the caller knows, that of all such numbers."""
    return types.unliteral(kind) if isinstance(kind, types.IntegerLiteral | types.BooleanLiteral) else kind


class _Form(CPUDispatcher):
    """A kernel in a ``form`` that Python cannot call: its table of calls gets nothing. One copy serves for all values
    of a number that callers may know; numba would compile one for each."""

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
    """A kernel as Python calls it; other kernels get it linked."""

    form = "called"

    @property
    def _cache(self):
        """Made for those that are called: a process imports hundreds of kernels and calls some."""
        if self._own_cache is None:
            self._own_cache = KernelCache(self.py_func)
        return self._own_cache

    @_cache.setter
    def _cache(self, cache):
        """Numba sets one where it makes a dispatcher from a pickle."""
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
        """Whether it is being compiled, so that a call from within is one to itself."""
        return self._compiling_counter or self.in_form("linked").is_compiling

    def in_form(self, form):
        """The kernel "linked" or "addressed": a dispatcher of its own; "called": itself."""
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
