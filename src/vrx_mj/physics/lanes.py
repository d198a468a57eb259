"""Eight numbers that a processor takes at once, as one value of a kernel.

Compilers may turn a loop into such code, or not: sums they leave alone, since another order gives other bits. Here the
kernel says it. Every operation is that of IEEE 754 in each lane, and a sum is folded in one fixed order, so results do
not depend on how many lanes a processor has.
"""

import functools
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
_Emit = Callable[..., Any]
"""Writes an operation: a function of LLVM's builder and of its arguments."""


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


def _operation(result: Any = None) -> Callable[[_Emit], Any]:
    """Make an operation of kernels of a function that writes it; its result is of the type of its arguments or given.

    Where one argument or the result is lanes, numbers are broadcast.
    """

    def decorate(emit: _Emit) -> Any:
        @functools.wraps(emit)
        def define(_context: Any, *kinds: Any) -> Any:
            kind = _lanes if _lanes in (result, *kinds) else types.float64

            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                values = [
                    value
                    if own == _lanes
                    else _broadcast(builder, context.cast(builder, value, own, types.float64), kind)
                    for own, value in zip(signature.args, arguments, strict=True)
                ]
                return emit(builder, *values)

            return (result or kind)(*kinds), generate

        return intrinsic(define)

    return decorate


def _broadcast(builder: Any, number: Any, kind: Any) -> Any:
    """A number, in all lanes if `kind` is lanes."""
    if kind != _lanes:
        return number
    nothing = ir.Constant(_VECTOR, ir.Undefined)
    first = builder.insert_element(nothing, number, ir.Constant(_INDEX, 0))
    return builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(_INDEX, WIDTH), [0] * WIDTH))


def _words(builder: Any, value: Any) -> tuple[Any, Callable[[int], Any]]:
    """The bits of lanes or of a number as integers, and what makes a constant of their type."""
    if value.type == _VECTOR:
        kind = ir.VectorType(_WORD, WIDTH)
        return builder.bitcast(value, kind), lambda word: ir.Constant(kind, [word] * WIDTH)
    return builder.bitcast(value, _WORD), lambda word: ir.Constant(_WORD, word)


@_operation(_lanes)
def broadcast(_builder: Any, number: Any) -> Any:
    """Put a number into all lanes."""
    return number


@_operation(types.float64)
def total(builder: Any, value: Any) -> Any:
    """The sum over the lanes: of halves, then of quarters."""
    parts = [builder.extract_element(value, ir.Constant(_INDEX, k)) for k in range(WIDTH)]
    while len(parts) > 1:
        half = len(parts) // 2
        parts = [builder.fadd(a, b) for a, b in zip(parts[:half], parts[half:], strict=True)]
    return parts[0]


@_operation()
def totals(builder: Any, a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any) -> Any:
    """`total` of each of eight values, to the bit, in the lanes of one, in a fifth of the operations."""
    values, length, kind = [a, b, c, d, e, f, g, h], WIDTH, ir.VectorType(_INDEX, WIDTH)
    while length > 1:
        half = length // 2
        low = [first + lane for first in range(0, 2 * WIDTH, length) for lane in range(half)]
        ends = ir.Constant(kind, low), ir.Constant(kind, [lane + half for lane in low])
        values = [
            builder.fadd(*(builder.shuffle_vector(one, other, end) for end in ends))
            for one, other in zip(values[::2], values[1::2], strict=True)
        ]
        length = half
    return values[0]


@_operation()
def product_and(builder: Any, one: Any, other: Any, more: Any) -> Any:
    """The first two multiplied, and the third added to it, with one rounding."""
    name = f"v{WIDTH}f64" if one.type == _VECTOR else "f64"
    kind = ir.FunctionType(one.type, [one.type] * 3)
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.fma.{name}"), (one, other, more))


@_operation()
def by_quarters(builder: Any, shifted: Any, even: Any, odd: Any) -> Any:
    """`even` after an even number of quarter turns, else `odd`; with the other sign after two and three.

    The number is in the last bits of `shifted`, to which 1.5 2^52 was added.
    """
    turns, constant = _words(builder, shifted)
    whole = builder.icmp_unsigned("==", builder.and_(turns, constant(1)), constant(0))
    bits, _ = _words(builder, builder.select(whole, even, odd))
    flip = builder.shl(builder.and_(turns, constant(2)), constant(62))
    return builder.bitcast(builder.xor(bits, flip), shifted.type)


@_operation(types.boolean)
def any_positive(builder: Any, value: Any) -> Any:
    """Whether a number in any lane is above zero."""
    lanes = builder.fcmp_ordered(">", value, ir.Constant(_VECTOR, [0.0] * WIDTH))
    bits = builder.bitcast(lanes, ir.IntType(WIDTH))
    return builder.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(WIDTH), 0))


@_operation()
def larger(builder: Any, one: Any, other: Any) -> Any:
    """The larger of two numbers in each lane; the second where one is not a number."""
    return builder.select(builder.fcmp_ordered(">", one, other), one, other)


@_operation()
def smaller(builder: Any, one: Any, other: Any) -> Any:
    """The smaller of two numbers in each lane; the second where one is not a number."""
    return builder.select(builder.fcmp_ordered("<", one, other), one, other)


@_operation(_lanes)
def choose(builder: Any, sign: Any, one: Any, other: Any) -> Any:
    """The first of two numbers in each lane in which `sign` is above zero, else the second."""
    return builder.select(builder.fcmp_ordered(">", sign, ir.Constant(_VECTOR, [0.0] * WIDTH)), one, other)


@_operation()
def power_of_two(builder: Any, exponent: Any) -> Any:
    """2^n of whole numbers n between -1022 and 1023 to which 1.5 2^52 was added: they are the last bits of the sum."""
    bits, constant = _words(builder, exponent)
    return builder.bitcast(builder.add(builder.shl(bits, constant(52)), constant(1023 << 52)), exponent.type)


def _define(symbol: Callable[..., Any], name: str) -> None:
    """Give lanes an operator, with lanes or a number on either side."""

    @_operation(_lanes)
    def apply(builder: Any, one: Any, other: Any) -> Any:
        return getattr(builder, name)(one, other)

    @overload(symbol, strict=False)  # type: ignore[untyped-decorator]
    def _(one: Any, other: Any) -> Any:
        if _lanes in (one, other) and all(each == _lanes or isinstance(each, types.Float) for each in (one, other)):
            return lambda one, other: apply(one, other)  # noqa: PLW0108  (numba compiles it)
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
