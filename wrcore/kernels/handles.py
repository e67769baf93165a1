"""Models that are passed to kernels by pointer, and kernels that are called by address.

A model holds about sixty arrays. By value they are 400 words at each call, and a kernel is compiled together with all
kernels that it calls. A `Handle` keeps a model in memory instead: in kernels ``model.contact.friction`` then reads this
field, and calls pass one address. A `Kernel` called by its address (`call_at`) is compiled once for all its callers.
"""

import struct

import numpy as np
from llvmlite import ir
from numba import typeof
from numba._dispatcher import compute_fingerprint
from numba.core import cgutils, types
from numba.core.errors import TypingError
from numba.core.imputils import lower_getattr_generic
from numba.core.registry import cpu_target
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import NativeValue, intrinsic, models, register_model, typeof_impl, unbox
from numba.np.numpy_support import from_dtype, map_layout

from wrcore.kernels.aside import planned
from wrcore.kernels.jit import jit

_INDEX = ir.IntType(32)


class Reference(types.Type):
    """Type of the address of a named tuple in memory, through which kernels read its fields."""

    def __init__(self, target):
        self.target = target
        super().__init__(f"Reference({target})")


@register_model(Reference)
class _ReferenceModel(models.PrimitiveModel):
    def __init__(self, manager, reference):
        super().__init__(manager, reference, manager.lookup(reference.target).get_value_type().as_pointer())


@infer_getattr
class _Fields(AttributeTemplate):
    key = Reference

    def generic_resolve(self, reference, name):
        """Return the type of a field: a reference for a named tuple, else the type of its value."""
        if name not in reference.target.fields:
            return None
        field = reference.target.types[reference.target.fields.index(name)]
        return Reference(field) if isinstance(field, types.BaseNamedTuple) else field


def _read(builder, place):
    """Generate code that reads a value number by number, so that unused numbers are not read. No kernel changes it."""
    kind = place.type.pointee
    if not isinstance(kind, (ir.LiteralStructType, ir.ArrayType)):
        number = builder.load(place)
        number.set_metadata("invariant.load", builder.module.add_metadata([]))
        return number
    value = ir.Constant(kind, ir.Undefined)
    for k in range(len(kind.elements) if isinstance(kind, ir.LiteralStructType) else kind.count):
        value = builder.insert_value(value, _read(builder, builder.gep(place, [_INDEX(0), _INDEX(k)])), k)
    return value


@lower_getattr_generic(Reference)
def _get_field(context, builder, reference, pointer, name):
    k = reference.target.fields.index(name)
    place = builder.gep(pointer, [_INDEX(0), _INDEX(k)])
    field = reference.target.types[k]
    if isinstance(field, types.BaseNamedTuple):
        return place
    value = _read(builder, place)
    if context.enable_nrt and isinstance(field, types.Array):  # kept alive by the handle, not counted
        array = context.make_array(field)(context, builder, value=value)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)
        array.parent = cgutils.get_null_value(array.parent.type)
        return array._getvalue()
    return value


@intrinsic
def _store(_, value, memory):
    def generate(context, builder, call, arguments):
        data = context.make_array(call.args[1])(context, builder, arguments[1]).data
        builder.store(arguments[0], builder.bitcast(data, arguments[0].type.as_pointer()))
        return context.get_dummy_value()

    return types.void(value, memory), generate


@jit
def _write(value, memory):
    _store(value, memory)


def _format_of(kind, begin=0):
    """Return the format of `struct` for a type with the layout of C from byte ``begin``, its end, and its alignment."""
    if isinstance(kind, types.BaseTuple):
        parts, end, coarsest = "", begin, 1
        for one in kind.types:
            part, end, aligned = _format_of(one, end)
            parts, coarsest = parts + part, max(coarsest, aligned)
        return f"{parts}{-end % coarsest}x", end + -end % coarsest, coarsest
    number = np.dtype(np.int64 if isinstance(kind, types.Array) else str(kind))
    count = 5 + 2 * kind.ndim if isinstance(kind, types.Array) else 1
    begin, pad = begin + -begin % number.itemsize, -begin % number.itemsize
    return f"{pad}x{count}{_CODES[number.str[1:]]}", begin + count * number.itemsize, number.itemsize


_CODES = {"f8": "d", "f4": "f", "i8": "q", "i4": "i", "u8": "Q", "u4": "I", "b1": "?"}


def _add_numbers(kind, value, numbers):
    """Append the numbers that represent a value in memory to the list ``numbers``.

    A kernel that writes values would have to be compiled for each type, which takes a second."""
    if isinstance(kind, types.BaseTuple):
        for one, part in zip(kind.types, value, strict=True):
            _add_numbers(one, part, numbers)
    elif isinstance(kind, types.Array):
        place = value.__array_interface__["data"][0]
        numbers += 0, 0, value.size, value.itemsize, place, *value.shape, *value.strides
    else:
        numbers.append(value)


@intrinsic
def other_at(_, reference, address):
    """Return a reference to the value at an address, of the type of ``reference``; for address 0 ``reference`` itself.

    An argument that is not a reference is returned unchanged."""

    def generate(context, builder, call, arguments):
        if not isinstance(reference, Reference):
            return arguments[0]
        itself = builder.icmp_signed("==", arguments[1], ir.IntType(64)(0))
        return builder.select(itself, arguments[0], builder.inttoptr(arguments[1], arguments[0].type))

    return reference(reference, types.int64), generate


def _no_type_of_numba(kind, other):
    """Answer ``issubclass`` of numba's types for a class of another metaclass at once. Without it each class of named
    tuples, when ``typeof`` meets it for the first time, is compared with some 200 types, which takes 1 ms."""
    return NotImplemented if isinstance(other, type(types.Type)) else False


types.Type.__subclasshook__ = classmethod(_no_type_of_numba)

_TYPE_OF_ARRAY = typeof_impl.dispatch(np.ndarray)


@typeof_impl.register(np.ndarray)
def _type_of_array(value, context):
    """Return the numba type of an array without importing numpy.ma, for which numba's function takes 40 ms."""
    if type(value) is not np.ndarray or value.dtype.kind not in "biuf":
        return _TYPE_OF_ARRAY(value, context)
    return types.Array(from_dtype(value.dtype), value.ndim, map_layout(value), readonly=not value.flags.writeable)


class Handle:
    """A named tuple of arrays and numbers in memory, to be passed to kernels by its address while this object lives."""

    def __init__(self, value):
        self.value = value
        self._numba_type_, self._format, size = _layout(value)
        self._memory = np.zeros(size, np.uint8)
        self.lay(value)
        self.address = self._memory.ctypes.data

    def lay(self, value):
        """Write another value of the same type into the memory of the handle."""
        self.value, numbers = value, []
        _add_numbers(self._numba_type_.target, value, numbers)
        self._format.pack_into(self._memory, 0, *numbers)

    def renew(self, value):
        """Write another value of the same type by a kernel: ten times as fast as `lay`, but 2 s for its compilation."""
        self.value = value
        _write(value, self._memory)


class Handles:
    """`Handle` objects of several ``values`` of one type.

    ``np.asarray`` of this object is the array of the addresses, which keeps the object alive; see `values_of`."""

    def __init__(self, values):
        self.values = tuple(values)
        self._handles = [Handle(value) for value in self.values]
        self._addresses = np.array([handle.address for handle in self._handles], np.int64)

    @property
    def __array_interface__(self):
        return self._addresses.__array_interface__


def values_of(addresses):
    """Return the values of `Handles` from the array of their addresses."""
    return addresses.base.values if len(addresses) else ()


class Kind:
    """Type of a `Handle` without a value, as an example argument for the compilation of kernels."""

    def __init__(self, value):
        self._numba_type_, _, _ = _layout(value)


_LAYOUTS = {}


def _layout(value):
    """Return the type of a handle, the `struct.Struct` of its value, and its size in bytes; computed once per type."""
    key = compute_fingerprint(value)
    if key not in _LAYOUTS:
        kind, context = typeof(value), cpu_target.target_context
        size = context.get_abi_sizeof(context.get_value_type(kind))
        _LAYOUTS[key] = Reference(kind), struct.Struct("=" + _format_of(kind)[0]), size
    return _LAYOUTS[key]


class KernelType(types.Type):
    """Type of the address of a compiled kernel that returns nothing."""

    def __init__(self, arguments):
        self.arguments = arguments
        super().__init__(f"Kernel({', '.join(map(str, arguments))})")


@register_model(KernelType)
class _KernelModel(models.PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, ir.IntType(8).as_pointer())


FOUR = types.UniTuple(types.float64, 4)
"""Type of a tuple of four numbers."""


class Kernel:
    """A kernel compiled or loaded for the types of example arguments, to be called by its address.

    It returns nothing, or a value of the type ``returns``. The address is valid as long as this object lives. If
    compilation is only `planned`, the kernel cannot be called."""

    def __init__(self, function, *examples, returns=types.none):
        signature = tuple(typeof(example) for example in examples)
        function = function.in_form("addressed") if hasattr(function, "in_form") else function
        self._numba_type_, self.address, plan = KernelType(signature), 0, planned()
        if plan is not None:
            plan.append((function, signature))
            return
        if signature not in function.overloads:
            function.compile(signature)
        compiled = function.overloads[signature]
        if compiled.signature.return_type != returns:
            raise TypeError(f"{function.__name__}: expected a kernel that returns {returns}, not {compiled.signature}")
        self._function = function  # keeps alive plain Python of a user that its code may call
        self.address = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)


@unbox(Reference)
@unbox(KernelType)
def _unbox_address(kind, holder, c):
    number = c.pyapi.object_getattr_string(holder, "address")
    address = c.pyapi.number_as_ssize_t(number)
    c.pyapi.decref(number)
    pointer = c.builder.inttoptr(address, c.context.get_value_type(kind))
    return NativeValue(pointer, is_error=c.pyapi.c_api_error())


def _call(context, builder, call, values):
    """Generate a call of the function at the address ``values[0]`` with the arguments in ``values[1]``."""
    kinds = tuple(call.args[1])
    handed = [builder.extract_value(values[1], k) for k in range(len(kinds))]
    function = context.call_conv.get_function_type(call.return_type, kinds).as_pointer()
    from_number = isinstance(values[0].type, ir.IntType)
    pointer = (builder.inttoptr if from_number else builder.bitcast)(values[0], function)
    status, found = context.call_conv.call_function(builder, pointer, call.return_type, kinds, handed)
    with cgutils.if_unlikely(builder, status.is_error):
        context.call_conv.return_status_propagate(builder, status)
    return found


@intrinsic
def call_at(_, kernel, *arguments):
    """Call a `Kernel` with arguments of exactly the types for which it was compiled."""
    if tuple(arguments) != kernel.arguments:
        raise TypingError(f"a kernel compiled for {kernel.arguments} is called with {tuple(arguments)}")
    return types.void(kernel, types.StarArgTuple(arguments)), _call


@intrinsic
def call_address(_, address, *arguments):
    """Call the `Kernel` with this ``address``, for example a field of a model; argument types are not checked."""
    return types.void(types.int64, types.StarArgTuple(arguments)), _call


@intrinsic
def four_at(_, address, *arguments):
    """Call the `Kernel` with this ``address`` and return its four numbers; argument types are not checked."""
    return FOUR(types.int64, types.StarArgTuple(arguments)), _call


@intrinsic
def call_c(_, address, *numbers):
    """Call the C function with this address, ``void f(int64_t, ...)``, with integers."""

    def generate(context, builder, call, values):
        count = len(call.args[1])
        kind = ir.FunctionType(ir.VoidType(), [ir.IntType(64)] * count)
        pointer = builder.inttoptr(values[0], kind.as_pointer())
        handed = [
            context.cast(builder, builder.extract_value(values[1], k), call.args[1][k], types.int64)
            for k in range(count)
        ]
        builder.call(pointer, handed)
        return context.get_dummy_value()

    return types.void(types.int64, types.StarArgTuple(numbers)), generate
