"""Compile kernels of `vrx_mj.cuda` to PTX, where no driver is; prints operations on floats or bytes of each."""

import re
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from numba import cuda
from numba.cuda import dispatcher, types
from numba.cuda.np.numpy_support import from_dtype

from vrx_mj.cuda import kernels
from vrx_mj.physics.kernel import cache_folder
from vrx_mj.runtime.views import RUN

HOPPER = (9, 0)


def array(dtype, ndim=1):
    return types.Array(from_dtype(np.dtype(dtype)), ndim, "C")


REAL, WHOLE = types.float64, types.int64
RUNS, TIME, DONE, FEATURES = array(RUN), array("f8"), array("i8"), array("f8", 3)
DAMPING, GOING = array("f8", 3), array("?")
TABLES = types.UniTuple(array("u4", 2), 20)
WORK = array("f8", 2), array("u1", 2), array("u4", 2), array("f8", 3), array("f8", 4), array("f8", 3)
SIGNATURES = {
    "advance_vrx": (RUNS, TIME, GOING, DONE, FEATURES, REAL, WHOLE, DAMPING),
    "advance_marine": (RUNS, TIME, GOING, DONE, FEATURES, REAL, WHOLE, DAMPING, *WORK),
    "command": (RUNS, TIME, array("f4", 2), array("i8"), array("i8"), REAL),
    "observe": (RUNS, TIME, array("f8", 2), array("f8", 2)),
    "copy_rows": (GOING, array("i8"), TABLES, TABLES),
}
dispatcher.get_current_device = lambda: SimpleNamespace(compute_capability=HOPPER)  # callees ask the driver
for name in sys.argv[1:]:
    text, _ = cuda.compile_ptx(getattr(kernels, name), SIGNATURES[name], device=False, cc=HOPPER)
    called = set(re.findall(r"\.extern \.func [^;]*?(\w+)\n", text))
    assert called <= {"numba_attempt_nocopy_reshape"}, (name, called)  # numba-cuda links that at the launch
    assert ("bar.warp.sync" in text) == (name == "advance_marine"), name  # elsewhere a thread has a row by itself
    kept = Path(kernels._compile(getattr(kernels, name), 64)._cache.cache_path)
    assert cache_folder() in kept.parents, kept
    print(len(re.findall(r"\b(?:fma|add|mul|sub|ld\.global|st\.global|ld|st)\S*\.(?:f64|[bu]8)\b", text)))
