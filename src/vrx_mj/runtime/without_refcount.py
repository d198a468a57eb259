"""Arrays that are lent to a kernel, not counted.

Kernels that make arrays count who holds one, with an atomic addition whenever it is passed on, and threads that share a
table contend for its counter. The loop makes one, and would count all that it is given.
"""

from typing import Any

from numba.core import cgutils
from numba.extending import intrinsic

__all__ = ["without_refcount"]


@intrinsic  # type: ignore[untyped-decorator]
def without_refcount(_context: Any, arrays: Any) -> Any:
    """The arrays of a tuple, uncounted: whoever called keeps them alive as long as they are used."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        lent = []
        for index, kind in enumerate(signature.return_type):
            array = context.make_array(kind)(context, builder, builder.extract_value(arguments[0], index))
            array.meminfo = cgutils.get_null_value(array.meminfo.type)
            array.parent = cgutils.get_null_value(array.parent.type)
            lent.append(array._getvalue())
        return context.make_tuple(builder, signature.return_type, lent)

    return arrays(arrays), generate
