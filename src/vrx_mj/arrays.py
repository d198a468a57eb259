"""Types of arrays, for annotations in every layer, and arrays into which nothing can be written."""

import numpy as np
import numpy.typing as npt

ComplexArray = npt.NDArray[np.complex128]
FloatArray = npt.NDArray[np.float64]
Float32Array = npt.NDArray[np.float32]
IntArray = npt.NDArray[np.integer]
"""Integers of any width: the width is the table's."""
Uint32Array = npt.NDArray[np.uint32]
"""Corners of triangles, and colours 0xRRGGBBAA."""
BoolArray = npt.NDArray[np.bool_]
ByteArray = npt.NDArray[np.uint8]
"""Pixels, or bytes of a file."""


def read_only(array: FloatArray) -> FloatArray:
    """A view of an array, into which nothing can be written: what it shows is kept elsewhere."""
    view = array.view()
    view.flags.writeable = False
    return view
