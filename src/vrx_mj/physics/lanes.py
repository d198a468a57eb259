"""Eight numbers that a processor takes at once, as one value of a kernel.

Compilers may turn a loop into such code, or not: sums they leave alone, since another order gives other bits. Here the
kernel says it. Every operation is that of IEEE 754 in each lane, and a sum is folded in one fixed order, so results do
not depend on how many lanes a processor has.

On a graphics processor a value is one number in each of eight neighbouring threads of a warp. They run a kernel
together: but for the lanes they have the same numbers, so they take the same branches. They share the arrays with which
lanes are loaded and stored, and no other memory that changes: each would add once more to what the others have added.
What `store` has written any thread may read, since `store` waits for all threads before and after. Numbers written one
by one into such an array are written by all threads alike; `sync_lanes` stands where one could read them too early, or
write while another still reads.
"""

import functools
import operator
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.base import BaseContext
from numba.extending import intrinsic, models, overload, register_model

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.kernel import allocating_kernel

WIDTH: Final = 8
"""Numbers in a value. Processors that take fewer at once take several turns."""

Lanes = Any
"""In a kernel: `WIDTH` numbers. They are added, subtracted, multiplied and divided lane by lane, by numbers too."""
Real = float | Lanes
"""A number, or one in every lane."""

_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
_WORD, _INDEX = ir.IntType(64), ir.IntType(32)
_Emit = Callable[..., Any]
"""Writes an operation: a function of LLVM's builder and of its arguments."""


class LanesType(types.Type):  # type: ignore[misc]
    """The type in numba."""

    def __init__(self) -> None:
        super().__init__(name=f"Lanes{WIDTH}")


_lanes = LanesType()


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    """How a value lies in a register."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


def _address(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Address of the lanes of an array, the first argument, from an index on, the second."""
    assert signature.args[0].layout == "C", "lanes lie one after another"
    array = context.make_array(signature.args[0])(context, builder, arguments[0])
    index = context.cast(builder, arguments[1], signature.args[1], types.intp)
    kind = context.get_value_type(_lanes)
    if kind != _VECTOR:
        index = builder.add(index, builder.zext(builder.and_(_thread(builder), ir.Constant(_INDEX, WIDTH - 1)), _WORD))
    return builder.bitcast(builder.gep(array.data, [index]), kind.as_pointer())


def _card(builder: ir.IRBuilder, name: str, result: ir.Type, *arguments: ir.Value) -> ir.Value:
    """Call a function that a graphics processor's compiler knows."""
    kind = ir.FunctionType(result, [each.type for each in arguments])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.nvvm.{name}"), arguments)


def _thread(builder: ir.IRBuilder) -> ir.Value:
    """Number of the thread in its warp."""
    return _card(builder, "read.ptx.sreg.laneid", _INDEX)


def _together(builder: ir.IRBuilder) -> ir.Value:
    """The threads of a warp, as bits, that have a value's lanes."""
    first = builder.and_(_thread(builder), ir.Constant(_INDEX, 32 - WIDTH))
    return builder.shl(ir.Constant(_INDEX, (1 << WIDTH) - 1), first)


def _wait(context: BaseContext, builder: ir.IRBuilder) -> None:
    """Wait for the threads that share a value, and see what they have written."""
    if context.get_value_type(_lanes) != _VECTOR:
        _card(builder, "bar.warp.sync", ir.VoidType(), _together(builder))


def _exchange(builder: ir.IRBuilder, value: ir.Value, distance: int) -> ir.Value:
    """The numbers of the threads whose lanes differ by a bit."""
    word, half, butterfly = builder.bitcast(value, _WORD), ir.Constant(_WORD, 32), ir.Constant(_INDEX, 3)
    parts = [
        _card(
            builder, "shfl.sync.i32", ir.LiteralStructType([_INDEX, ir.IntType(1)]), _together(builder), butterfly,
            builder.trunc(part, _INDEX), ir.Constant(_INDEX, distance), ir.Constant(_INDEX, 31),
        )
        for part in (word, builder.lshr(word, half))
    ]  # fmt: skip
    low, high = (builder.zext(builder.extract_value(part, 0), _WORD) for part in parts)
    return builder.bitcast(builder.or_(low, builder.shl(high, half)), value.type)


@intrinsic  # type: ignore[untyped-decorator]
def load(_context: Any, _array: Any, _index: Any) -> Any:
    """The numbers of a contiguous array of floats, of any shape, from an index on; they must be there.

    It takes the place of `reshape`, for which numba-cuda links a file; no kernel with such a file can be kept.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        value = builder.load(_address(context, builder, signature, arguments))
        value.align = 8
        return value

    return _lanes(_array, _index), generate


@intrinsic  # type: ignore[untyped-decorator]
def store(_context: Any, _array: Any, _index: Any, _value: Any) -> Any:
    """Write lanes into a contiguous array of floats from an index on; it must be long enough."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        _wait(context, builder)
        builder.store(arguments[2], _address(context, builder, signature, arguments)).align = 8
        _wait(context, builder)
        return context.get_dummy_value()

    return types.void(_array, _index, _value), generate


@intrinsic  # type: ignore[untyped-decorator]
def sync_lanes(_context: Any) -> Any:
    """Let all threads that share a row come here before one goes on; nothing where a processor has the lanes itself."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        _wait(context, builder)
        return context.get_dummy_value()

    return types.void(), generate


def _operation(result: Any = None) -> Callable[[_Emit], Any]:
    """Make an operation of kernels of a function that writes it; its result is of the type of its arguments or given.

    Where one argument or the result is lanes, numbers are broadcast.
    """

    def decorate(emit: _Emit) -> Any:
        @functools.wraps(emit)
        def define(_context: Any, *kinds: Any) -> Any:
            kind = _lanes if _lanes in (result, *kinds) else types.float64

            def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                form = context.get_value_type(kind)
                values = [
                    value
                    if own == _lanes
                    else _broadcast(builder, context.cast(builder, value, own, types.float64), form)
                    for own, value in zip(signature.args, arguments, strict=True)
                ]
                return emit(builder, *values)

            return (result or kind)(*kinds), generate

        return intrinsic(define)

    return decorate


def _broadcast(builder: ir.IRBuilder, number: ir.Value, form: ir.Type) -> ir.Value:
    """A number, in all lanes if the form of the value is a vector."""
    if form != _VECTOR:
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
    if value.type != _VECTOR:
        for distance in (4, 2, 1):
            value = builder.fadd(value, _exchange(builder, value, distance))
        return value
    parts = [builder.extract_element(value, ir.Constant(_INDEX, k)) for k in range(WIDTH)]
    while len(parts) > 1:
        half = len(parts) // 2
        parts = [builder.fadd(a, b) for a, b in zip(parts[:half], parts[half:], strict=True)]
    return parts[0]


@_operation()
def totals(builder: Any, a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any) -> Any:
    """`total` of each of eight values, to the bit, in the lanes of one, in a fifth of the operations."""
    values, length, kind = [a, b, c, d, e, f, g, h], WIDTH, ir.VectorType(_INDEX, WIDTH)
    while a.type != _VECTOR and len(values) > 1:  # each thread keeps half of the sums, and gives away the others
        half = len(values) // 2
        bit = builder.and_(_thread(builder), ir.Constant(_INDEX, half))
        low = builder.icmp_unsigned("==", bit, ir.Constant(_INDEX, 0))
        pairs = list(zip(values[:half], values[half:], strict=True))
        given = [_exchange(builder, builder.select(low, other, one), half) for one, other in pairs]
        kept = [builder.select(low, one, other) for one, other in pairs]
        values = [builder.fadd(own, more) for own, more in zip(kept, given, strict=True)]
    if len(values) == 1:
        return values[0]
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
    lanes = builder.fcmp_ordered(">", value, ir.Constant(value.type, None))
    if value.type != _VECTOR:
        result = ir.LiteralStructType([_INDEX, ir.IntType(1)])
        votes = _card(builder, "vote.sync", result, _together(builder), ir.Constant(_INDEX, 1), lanes)
        return builder.extract_value(votes, 1)
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
    return builder.select(builder.fcmp_ordered(">", sign, ir.Constant(sign.type, None)), one, other)


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
