"""Rows of free boats on a graphics processor: the functions of the CPU's loop, compiled for it by numba-cuda.

numba-cuda comes with `pip install '.[cuda]'` in a clone; `python -m vrx_mj.cuda.check` measures and compares.
"""

import numpy as np

from vrx_mj.packages import importing

if not hasattr(np, "row_stack"):
    setattr(np, "row_stack", np.vstack)  # noqa: B010  (numba-cuda 0.30 asks for it when it compiles; numpy 2.5 has none)

with importing("vrx_mj.cuda", "numba_cuda", "cuda"):
    import numba_cuda  # noqa: F401

from vrx_mj.cuda.batch import Batch, check_driver
from vrx_mj.cuda.rows import arrays

__all__ = ["Batch", "arrays", "check_driver"]
