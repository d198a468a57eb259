"""vrx_mj: a simulator of unmanned surface vessels, on MuJoCo.

Names are loaded when they are first used, so that `import vrx_mj` costs nothing.
"""

import os
import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vrx_mj.errors import VrxError, VrxWarning
    from vrx_mj.mjcf.compile import compile_world
    from vrx_mj.mjcf.parameters import parameters
    from vrx_mj.mjcf.world import World
    from vrx_mj.model.numbers import Number
    from vrx_mj.recording import compare, read, read_record, record, resume
    from vrx_mj.recording.notebook import progress, show
    from vrx_mj.runtime.batch import Batch
    from vrx_mj.runtime.observation import BoatObservation
    from vrx_mj.runtime.run import Summary, run
    from vrx_mj.runtime.simulation import Simulation
    from vrx_mj.runtime.state import State
    from vrx_mj.sensors.readings import Fix, Image, Inertia, PointCloud, Reading, Scan

__version__ = "0.1.0"

if "osmesa" in os.environ.get("MUJOCO_GL", "").lower():  # `import mujoco` loads it
    import_module("vrx_mj.packages").load_triton()

_HOMES = {
    "Batch": "runtime.batch",
    "BoatObservation": "runtime.observation",
    "Fix": "sensors.readings",
    "Image": "sensors.readings",
    "Inertia": "sensors.readings",
    "Number": "model.numbers",
    "PointCloud": "sensors.readings",
    "Reading": "sensors.readings",
    "Scan": "sensors.readings",
    "Simulation": "runtime.simulation",
    "State": "runtime.state",
    "Summary": "runtime.run",
    "VrxError": "errors",
    "VrxWarning": "errors",
    "World": "mjcf.world",
    "compare": "recording",
    "compile_world": "mjcf.compile",
    "parameters": "mjcf.parameters",
    "progress": "recording.notebook",
    "read": "recording",
    "read_record": "recording",
    "record": "recording",
    "resume": "recording",
    "run": "runtime.run",
    "show": "recording.notebook",
}

__all__ = [
    "Batch",
    "BoatObservation",
    "Fix",
    "Image",
    "Inertia",
    "Number",
    "PointCloud",
    "Reading",
    "Scan",
    "Simulation",
    "State",
    "Summary",
    "VrxError",
    "VrxWarning",
    "World",
    "compare",
    "compile_world",
    "parameters",
    "progress",
    "read",
    "read_record",
    "record",
    "resume",
    "run",
    "show",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'vrx_mj' has no attribute '{name}'")
    return getattr(import_module(f"vrx_mj.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]


if "IPython" in sys.modules:
    import_module("vrx_mj.recording.notebook").register()
