"""Vector types of four, eight or 32 float64 (lanes) for kernels, for loops that the compiler does not vectorise well.

A kernel loads lanes with ``x = load8(a, row, i)`` and computes with + - * / as with numbers; in an expression with
lanes a number is used for all lanes. Products and sums are fused (`FUSED` of `wrcore.kernels.jit`). A processor without
such wide registers uses several registers. Indices are not checked.
"""

import operator

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model

_DOUBLE, _INDEX = ir.DoubleType(), ir.IntType(32)
_FUSED, _SUM = ("contract",), ("contract", "reassoc")


class Lanes(types.Type):
    """Type of several float64 in one vector register."""

    def __init__(self, count):
        self.count = count
        super().__init__(name=f"Lanes({count})")

    @property
    def vector(self):
        """LLVM vector type of the lanes."""
        return ir.VectorType(_DOUBLE, self.count)


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager, lanes):
        super().__init__(manager, lanes, lanes.vector)


FOUR, EIGHT, THIRTY_TWO = Lanes(4), Lanes(8), Lanes(32)


def _spread(builder, number, lanes):
    """Generate lanes that all hold ``number``."""
    undefined = ir.Constant(lanes.vector, ir.Undefined)
    first = builder.insert_element(undefined, number, _INDEX(0))
    return builder.shuffle_vector(first, undefined, ir.Constant(ir.VectorType(_INDEX, lanes.count), None))


def _call(builder, name, result, arguments, **options):
    function_type = ir.FunctionType(result, [a.type for a in arguments])
    return builder.call(cgutils.get_or_insert_function(builder.module, function_type, name), arguments, **options)


def _define(function, instruction):
    """Define an operator for two lanes, and for lanes and a number."""
    pairs = [(a, b) for lanes in (FOUR, EIGHT, THIRTY_TWO)
             for a, b in ((lanes, lanes), (lanes, types.float64), (types.float64, lanes))]  # fmt: skip

    @infer_global(function)
    class Typing(ConcreteTemplate):
        cases = [signature(a if isinstance(a, Lanes) else b, a, b) for a, b in pairs]

    def generate(_, builder, call, arguments):
        both = [a if isinstance(kind, Lanes) else _spread(builder, a, call.return_type)
                for a, kind in zip(arguments, call.args, strict=True)]  # fmt: skip
        return getattr(builder, instruction)(*both, flags=_FUSED)

    for pair in pairs:
        lower_builtin(function, *pair)(generate)
    return Typing


for _function, _instruction in (
    (operator.add, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul"), (operator.truediv, "fdiv")
):  # fmt: skip
    _define(_function, _instruction)


def _load(builder, array, kind, offset, lanes):
    """Generate code that loads lanes from an ``array`` of the numba type ``kind``."""
    single = kind.dtype == types.float32
    vector = ir.VectorType(ir.FloatType() if single else _DOUBLE, lanes.count)
    found = builder.load(
        builder.bitcast(builder.gep(array.data, [offset]), vector.as_pointer()), align=4 + 4 * (not single)
    )
    return builder.fpext(found, lanes.vector) if single else found


def _of_row(lanes):
    """Return a code generator that loads lanes from a row of a matrix."""

    def generate(context, builder, call, arguments):
        array = context.make_array(call.args[0])(context, builder, arguments[0])
        length = cgutils.unpack_tuple(builder, array.shape, 2)[1]
        offset = builder.add(builder.mul(arguments[1], length), arguments[2])
        return _load(builder, array, call.args[0], offset, lanes)

    return generate


def _of_array(lanes):
    """Return a code generator that loads lanes from an array."""

    def generate(context, builder, call, arguments):
        array = context.make_array(call.args[0])(context, builder, arguments[0])
        return _load(builder, array, call.args[0], arguments[1], lanes)

    return generate


def _into_array(lanes):
    """Return a code generator that writes lanes into an array."""

    def generate(context, builder, call, arguments):
        array = context.make_array(call.args[0])(context, builder, arguments[0])
        place = builder.bitcast(builder.gep(array.data, [arguments[1]]), lanes.vector.as_pointer())
        builder.store(arguments[2], place, align=8)
        return context.get_dummy_value()

    return generate


@intrinsic
def load8(_, rows, row, start):
    """Load ``rows[row, start : start + 8]`` of a contiguous (m, n) array of float64 or float32; ``start`` unsigned."""
    return EIGHT(rows, row, start), _of_row(EIGHT)


@intrinsic
def load32(_, rows, row, start):
    """Load ``rows[row, start : start + 32]`` of a contiguous (m, n) array of float64 or float32; ``start`` unsigned."""
    return THIRTY_TWO(rows, row, start), _of_row(THIRTY_TWO)


@intrinsic
def every8(_, rows, row, start, stride):
    """Load ``rows[row, start : start + 8 * stride : stride]`` of a contiguous (m, n) array of float64; all unsigned."""

    def generate(context, builder, call, arguments):
        array = context.make_array(call.args[0])(context, builder, arguments[0])
        length = cgutils.unpack_tuple(builder, array.shape, 2)[1]
        offset = builder.add(builder.mul(arguments[1], length), arguments[2])
        lanes = ir.Constant(EIGHT.vector, ir.Undefined)
        for k in range(8):
            number = builder.load(builder.gep(array.data, [offset]))
            lanes = builder.insert_element(lanes, number, _INDEX(k))
            offset = builder.add(offset, arguments[3])
        return lanes

    return EIGHT(rows, types.uint64, types.uint64, types.uint64), generate


@intrinsic
def load4(_, values, start):
    """Load ``values[start : start + 4]`` of a contiguous array of float64 or float32; ``start`` unsigned."""
    return FOUR(values, start), _of_array(FOUR)


@intrinsic
def take8(_, values, start):
    """Load ``values[start : start + 8]`` of a contiguous array of float64 or float32; ``start`` unsigned."""
    return EIGHT(values, start), _of_array(EIGHT)


@intrinsic
def take32(_, values, start):
    """Load ``values[start : start + 32]`` of a contiguous array of float64 or float32; ``start`` unsigned."""
    return THIRTY_TWO(values, start), _of_array(THIRTY_TWO)


@intrinsic
def put8(_, values, start, lanes):
    """Write lanes to ``values[start : start + 8]`` of a contiguous array of float64; ``start`` unsigned."""
    return types.void(values, start, EIGHT), _into_array(EIGHT)


@intrinsic
def put32(_, values, start, lanes):
    """Write lanes to ``values[start : start + 32]`` of a contiguous array of float64; ``start`` unsigned."""
    return types.void(values, start, THIRTY_TWO), _into_array(THIRTY_TWO)


@intrinsic
def lanes8(_, number):
    """Return eight lanes that all hold a number."""

    def generate(__, builder, ___, arguments):
        return _spread(builder, arguments[0], EIGHT)

    return EIGHT(types.float64), generate


@intrinsic
def ramp8(_):
    """Return eight lanes with the numbers 0, 1, ... 7."""

    def generate(*__):
        return ir.Constant(EIGHT.vector, [float(k) for k in range(8)])

    return EIGHT(), generate


@intrinsic
def lane(_, lanes, k):
    """Return the number in lane ``k``."""

    def generate(__, builder, ___, arguments):
        return builder.extract_element(*arguments)

    return types.float64(lanes, k), generate


@intrinsic
def total(_, lanes):
    """Return the sum of all lanes."""

    def generate(__, builder, call, arguments):
        name = f"llvm.vector.reduce.fadd.v{call.args[0].count}f64"
        return _call(builder, name, _DOUBLE, [_DOUBLE(0.0), arguments[0]], fastmath=_SUM)

    return types.float64(lanes), generate


@intrinsic
def root(_, lanes):
    """Return the square root of each lane."""

    def generate(_, builder, __, arguments):
        return _call(builder, f"llvm.sqrt.v{lanes.count}f64", lanes.vector, arguments)

    return lanes(lanes), generate


@intrinsic
def maximum(_, lanes):
    """Return the maximum of all lanes."""

    def generate(__, builder, call, arguments):
        name = f"llvm.vector.reduce.fmax.v{call.args[0].count}f64"
        return _call(builder, name, _DOUBLE, arguments, fastmath=("nnan",))

    return types.float64(lanes), generate


@intrinsic
def below(_, lanes, limit):
    """Return an unsigned integer whose bit k is set if lane k is less than lane k of ``limit``."""

    def generate(__, builder, call, arguments):
        less = builder.fcmp_ordered("<", *arguments)
        return builder.zext(builder.bitcast(less, ir.IntType(call.args[0].count)), ir.IntType(64))

    return types.uint64(lanes, limit), generate


@intrinsic
def where_below(_, lanes, limit, value, other):
    """Return, for each lane, ``value`` if ``lanes`` is less than ``limit``, else ``other``; all arguments are lanes."""

    def generate(__, builder, ___, arguments):
        return builder.select(builder.fcmp_ordered("<", arguments[0], arguments[1]), arguments[2], arguments[3])

    return lanes(lanes, limit, value, other), generate


@intrinsic
def count_bits(_, bits):
    """Return the number of bits that are set in an unsigned integer."""

    def generate(__, builder, ___, arguments):
        return _call(builder, "llvm.ctpop.i64", ir.IntType(64), arguments)

    return types.int64(types.uint64), generate


@intrinsic
def lowest_bit(_, bits):
    """Return the index of the lowest bit that is set; 64 for zero."""

    def generate(__, builder, ___, arguments):
        return _call(builder, "llvm.cttz.i64", ir.IntType(64), [arguments[0], ir.IntType(1)(0)])

    return types.int64(types.uint64), generate


@intrinsic
def highest_bit(_, bits):
    """Return the index of the highest bit that is set; -1 for zero."""

    def generate(__, builder, ___, arguments):
        zeros = _call(builder, "llvm.ctlz.i64", ir.IntType(64), [arguments[0], ir.IntType(1)(0)])
        return builder.sub(ir.IntType(64)(63), zeros)

    return types.int64(types.uint64), generate
