"""Weighted sums of neighbours in a table of four outputs, all four in one vector register.

Left to itself the compiler converts and multiplies number by number. A kernel sees the four lanes as a tuple.
"""

from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

_INDEX = ir.IntType(32)
_LANES = ir.VectorType(ir.DoubleType(), 4)
_SINGLE_LANES = ir.VectorType(ir.FloatType(), 4)
_ARRAY = ir.ArrayType(ir.DoubleType(), 4)
_FOUR = types.UniTuple(types.float64, 4)
_FUSED = ("contract",)


def _from_tuple(builder, values):
    lanes = ir.Constant(_LANES, ir.Undefined)
    for k in range(4):
        lanes = builder.insert_element(lanes, builder.extract_value(values, k), _INDEX(k))
    return lanes


def _to_tuple(builder, lanes):
    values = ir.Constant(_ARRAY, ir.Undefined)
    for k in range(4):
        values = builder.insert_value(values, builder.extract_element(lanes, _INDEX(k)), k)
    return values


def _scaled(builder, factor, lanes):
    undefined = ir.Constant(_LANES, ir.Undefined)
    one = builder.insert_element(undefined, factor, _INDEX(0))
    every = builder.shuffle_vector(one, undefined, ir.Constant(ir.VectorType(_INDEX, 4), [0] * 4))
    return builder.fmul(every, lanes, flags=_FUSED)


@intrinsic
def three_rows(_, coefficients, start, w0, w1, w2):
    """Sum of three rows of four, w0 c[start : start + 4] + w1 c[start + 4 : start + 8] + ...; no bounds are checked.

    Parameters
    ----------
    coefficients : numpy.ndarray of float32, contiguous
    start : uint64
    w0, w1, w2 : float64

    Returns
    -------
    tuple of four float64
    """

    def generate(context, builder, signature, arguments):
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        total = None
        for k in range(3):
            offset = builder.add(arguments[1], ir.Constant(arguments[1].type, 4 * k))
            place = builder.bitcast(builder.gep(array.data, [offset]), _SINGLE_LANES.as_pointer())
            row = builder.fpext(builder.load(place, align=4), _LANES)
            term = _scaled(builder, arguments[2 + k], row)
            total = term if total is None else builder.fadd(term, total, flags=_FUSED)
        return _to_tuple(builder, total)

    return _FOUR(coefficients, start, w0, w1, w2), generate


@intrinsic
def scaled_sum(_, a, x, b, y, c, z):
    """The tuple of four a x + b y + c z from numbers a, b, c and tuples x, y, z."""

    def generate(__, builder, ___, arguments):
        total = None
        for factor, values in zip(arguments[::2], arguments[1::2], strict=True):
            term = _scaled(builder, factor, _from_tuple(builder, values))
            total = term if total is None else builder.fadd(term, total, flags=_FUSED)
        return _to_tuple(builder, total)

    return _FOUR(a, x, b, y, c, z), generate
