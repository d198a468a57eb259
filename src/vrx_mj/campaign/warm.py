"""Loaded once by the process from which trials are forked: all that they need, with the kernels compiled."""

import contextlib
import warnings

import shapely  # noqa: F401 - of tracks

import vrx_mj.control  # noqa: F401 - of many controllers
from vrx_mj.foreign.asking import READER
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.runtime.simulation import Simulation

with contextlib.suppress(Exception), warnings.catch_warnings():  # the first trial reports what is wrong
    warnings.simplefilter("ignore")
    compile_world("sand_island")
    Simulation(compile_world("sydney_regatta"))
READER.end()  # when it ends by itself, the process here warns of a child that it does not know
