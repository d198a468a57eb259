"""Eight numbers that a processor takes at once, as one value of a kernel.

Compilers may turn a loop into such code, or not: sums they leave alone, since another order gives other bits. Here the
kernel says it. Every operation is that of IEEE 754 in each lane, and a sum is folded in one fixed order, so results do
not depend on how many lanes a processor has.
"""

import operator
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, models, overload, register_model

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.kernel import allocating_kernel

WIDTH: Final = 8
"""Numbers in a value. Processors that take fewer at once take several turns."""

Lanes = Any
"""In a kernel: `WIDTH` numbers. They are added, subtracted, multiplied and divided lane by lane, by numbers too."""

_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
_WORD, _INDEX = ir.IntType(64), ir.IntType(32)


class _LanesType(types.Type):  # type: ignore[misc]
    """The type in numba."""

    def __init__(self) -> None:
        super().__init__(name=f"Lanes{WIDTH}")


_lanes = _LanesType()


@register_model(_LanesType)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    """How a value lies in a register."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


def _address(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Address of the lanes of an array, the first argument, from an index on, the second."""
    assert signature.args[0].layout == "C", "lanes lie one after another"
    array = context.make_array(signature.args[0])(context, builder, arguments[0])
    index = context.cast(builder, arguments[1], signature.args[1], types.intp)
    return builder.bitcast(builder.gep(array.data, [index]), _VECTOR.as_pointer())


@intrinsic  # type: ignore[untyped-decorator]
def load(_context: Any, _array: Any, _index: Any) -> Any:
    """The numbers of a contiguous array of floats from an index on; they must be there."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        value = builder.load(_address(context, builder, signature, arguments))
        value.align = 8
        return value

    return _lanes(_array, _index), generate


@intrinsic  # type: ignore[untyped-decorator]
def store(_context: Any, _array: Any, _index: Any, _value: Any) -> Any:
    """Write lanes into a contiguous array of floats from an index on; it must be long enough."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.store(arguments[2], _address(context, builder, signature, arguments)).align = 8
        return context.get_dummy_value()

    return types.void(_array, _index, _value), generate


@intrinsic  # type: ignore[untyped-decorator]
def spread(_context: Any, _number: Any) -> Any:
    """The same number in all lanes."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        number = context.cast(builder, arguments[0], signature.args[0], types.float64)
        nothing = ir.Constant(_VECTOR, ir.Undefined)
        first = builder.insert_element(nothing, number, ir.Constant(_INDEX, 0))
        return builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(_INDEX, WIDTH), [0] * WIDTH))

    return _lanes(_number), generate


@intrinsic  # type: ignore[untyped-decorator]
def total(_context: Any, _value: Any) -> Any:
    """The sum over the lanes: of halves, then of quarters."""

    def generate(_: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        parts = [builder.extract_element(arguments[0], ir.Constant(_INDEX, k)) for k in range(WIDTH)]
        while len(parts) > 1:
            half = len(parts) // 2
            parts = [builder.fadd(a, b) for a, b in zip(parts[:half], parts[half:], strict=True)]
        return parts[0]

    return types.float64(_value), generate


@intrinsic  # type: ignore[untyped-decorator]
def totals(_context: Any, _a: Any, _b: Any, _c: Any, _d: Any, _e: Any, _f: Any, _g: Any, _h: Any) -> Any:
    """`total` of each of eight values, to the bit, in the lanes of one, in a fifth of the operations."""

    def generate(_: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        values, length = list(arguments), WIDTH
        while length > 1:
            half = length // 2
            low = [first + lane for first in range(0, 2 * WIDTH, length) for lane in range(half)]
            kind = ir.VectorType(_INDEX, WIDTH)
            ends = ir.Constant(kind, low), ir.Constant(kind, [lane + half for lane in low])
            values = [
                builder.fadd(*(builder.shuffle_vector(one, other, end) for end in ends))
                for one, other in zip(values[::2], values[1::2], strict=True)
            ]
            length = half
        return values[0]

    return _lanes(_a, _b, _c, _d, _e, _f, _g, _h), generate


@intrinsic  # type: ignore[untyped-decorator]
def product_and(_context: Any, _one: Any, _other: Any, _more: Any) -> Any:
    """The first two multiplied, and the third added to it, with one rounding: of lanes, or of numbers."""
    one = _lanes if isinstance(_one, _LanesType) else types.float64

    def generate(_: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        value, name = (_VECTOR, f"v{WIDTH}f64") if one is _lanes else (ir.DoubleType(), "f64")
        kind = ir.FunctionType(value, [value] * 3)
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.fma.{name}")
        return builder.call(function, arguments)

    return one(one, one, one), generate


@intrinsic  # type: ignore[untyped-decorator]
def turned(_context: Any, _shifted: Any, _even: Any, _odd: Any) -> Any:
    """Cosine and sine, of which `_even` and `_odd` are those before a whole number of quarter turns.

    The number is in the last bits of `_shifted`, to which 1.5 2^52 was added.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        shifted, even, odd = arguments
        words = ir.VectorType(_WORD, WIDTH)
        one, two, sign = (ir.Constant(words, [value] * WIDTH) for value in (1, 2, 62))
        turns = builder.bitcast(shifted, words)
        whole = builder.icmp_unsigned("==", builder.and_(turns, one), ir.Constant(words, [0] * WIDTH))

        def signed(value: Any, quarter: Any) -> Any:
            flip = builder.shl(builder.and_(quarter, two), sign)
            return builder.bitcast(builder.xor(builder.bitcast(value, words), flip), _VECTOR)

        cosine = signed(builder.select(whole, even, odd), builder.add(turns, one))
        sine = signed(builder.select(whole, odd, even), turns)
        return context.make_tuple(builder, signature.return_type, (cosine, sine))

    return types.UniTuple(_lanes, 2)(_shifted, _even, _odd), generate


@intrinsic  # type: ignore[untyped-decorator]
def any_positive(_context: Any, _value: Any) -> Any:
    """Whether a number in any lane is above zero."""

    def generate(_: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        lanes = builder.fcmp_ordered(">", arguments[0], ir.Constant(_VECTOR, [0.0] * WIDTH))
        bits = builder.bitcast(lanes, ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(WIDTH), 0))

    return types.boolean(_value), generate


def _comparison(sign: str) -> Any:
    """The first or the second of two numbers in each lane: the first where the comparison with the second holds."""

    @intrinsic  # type: ignore[untyped-decorator]
    def chosen(_context: Any, _one: Any, _other: Any) -> Any:
        def generate(_: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            one, other = arguments
            return builder.select(builder.fcmp_ordered(sign, one, other), one, other)

        return _lanes(_one, _other), generate

    return chosen


larger = _comparison(">")
"""The larger of two numbers in each lane; the second where one is not a number."""
smaller = _comparison("<")
"""The smaller."""


@intrinsic  # type: ignore[untyped-decorator]
def chosen(_context: Any, _sign: Any, _one: Any, _other: Any) -> Any:
    """The first of two numbers in each lane in which `sign` is above zero, else the second."""

    def generate(_: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        sign, one, other = arguments
        return builder.select(builder.fcmp_ordered(">", sign, ir.Constant(_VECTOR, [0.0] * WIDTH)), one, other)

    return _lanes(_sign, _one, _other), generate


@intrinsic  # type: ignore[untyped-decorator]
def power_of_two(_context: Any, _exponent: Any) -> Any:
    """2^n of whole numbers n between -1022 and 1023 to which 1.5 2^52 was added: they are the last bits of the sum."""

    def generate(_: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        bits = ir.VectorType(_WORD, WIDTH)
        exponent = builder.shl(builder.bitcast(arguments[0], bits), ir.Constant(bits, [52] * WIDTH))
        return builder.bitcast(builder.add(exponent, ir.Constant(bits, [1023 << 52] * WIDTH)), _VECTOR)

    return _lanes(_exponent), generate


def _operation(name: str) -> Any:
    """An operation of LLVM, lane by lane."""

    @intrinsic  # type: ignore[untyped-decorator]
    def apply(_context: Any, _one: Any, _other: Any) -> Any:
        def generate(_: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            return getattr(builder, name)(*arguments)

        return _lanes(_one, _other), generate

    return apply


def _define(symbol: Callable[..., Any], name: str) -> None:
    """Give lanes an operator, with lanes or a number on either side."""
    apply = _operation(name)

    @overload(symbol, strict=False)  # type: ignore[untyped-decorator]
    def _(one: Any, other: Any) -> Any:
        left, right = isinstance(one, _LanesType), isinstance(other, _LanesType)
        if left and right:
            return lambda one, other: apply(one, other)  # noqa: PLW0108  (numba compiles it)
        if left and isinstance(other, types.Float):
            return lambda one, other: apply(one, spread(other))
        if right and isinstance(one, types.Float):
            return lambda one, other: apply(spread(one), other)
        return None


for _symbol, _name in (
    (operator.add, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul"), (operator.truediv, "fdiv"),
    (operator.iadd, "fadd"), (operator.isub, "fsub"), (operator.imul, "fmul"),
):  # fmt: skip
    _define(_symbol, _name)


@allocating_kernel
def zeros_in_lines(rows: int, width: int) -> FloatArray:
    """Return zeros, (rows, width), from where a line of the processor's cache begins: a value fills one.

    Of whole lanes, each row begins a line, too. A value that lies across two lines takes a processor twice as long.
    """
    size = rows * width
    room = np.zeros(size + WIDTH)
    start = -(room.ctypes.data // room.itemsize) % WIDTH
    return room[start : start + size].reshape((rows, width))
