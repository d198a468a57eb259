"""Eight numbers that a processor takes at once, as one value of a kernel.

Compilers may turn a loop into such code, or not: sums they leave alone, since another order gives other bits. Here the
kernel says it. Every operation is that of IEEE 754 in each lane, and a sum is folded in one fixed order, so results do
not depend on how many lanes a processor has.
"""

import operator
from collections.abc import Callable
from typing import Any, Final

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, models, overload, register_model

__all__ = ["WIDTH", "Lanes", "chosen", "floor", "larger", "load", "power_of_two", "smaller", "spread", "store", "total"]

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
def floor(_context: Any, _value: Any) -> Any:
    """The largest whole number that is not above, in each lane."""

    def generate(_: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        kind = ir.FunctionType(_VECTOR, [_VECTOR])
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.floor.v{WIDTH}f64")
        return builder.call(function, [arguments[0]])

    return _lanes(_value), generate


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
