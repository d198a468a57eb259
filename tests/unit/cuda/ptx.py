"""Compile and link kernels of `vrx_mj.cuda` as a launch does, and keep them, where no driver is.

Prints operations on floats or bytes of each.
"""

import pickle
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from numba.cuda import dispatcher, serialize, types
from numba.cuda.codegen import CUDACodeLibrary
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
dispatcher.get_current_device = lambda: SimpleNamespace(compute_capability=HOPPER)
CUDACodeLibrary._ensure_cc = lambda library, cc: HOPPER  # a launch asks the driver
for name in sys.argv[1:]:
    own = kernels._compile(getattr(kernels, name), 96)
    kernel = dispatcher._Kernel(own.py_func, SIGNATURES[name], **own.targetoptions)
    text = kernel.inspect_asm(HOPPER)
    called = re.findall(r"\.extern \.func [^;]*?(\w+)\n", text)
    assert not called, (name, called)
    assert ("bar.warp.sync" in text) == (name == "advance_marine"), name  # elsewhere a thread has a row by itself
    linked = kernel._codelibrary.get_cubin().code
    assert cache_folder() in Path(own._cache.cache_path).parents, own._cache.cache_path
    kept = pickle.loads(serialize.dumps(own._cache._impl.reduce(kernel)))
    assert own._cache._impl.rebuild(None, kept)._codelibrary.get_cubin().code == linked, name
    print(len(re.findall(r"\b(?:fma|add|mul|sub|ld\.global|st\.global|ld|st)\S*\.(?:f64|[bu]8)\b", text)))
