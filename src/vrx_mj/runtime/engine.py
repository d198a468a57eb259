"""MuJoCo's C functions, callable by name from compiled kernels.

The functions are those of the library that the `mujoco` package loaded. They take the addresses of a
model and its data (`model._address`, `data._address`), release the GIL inside a kernel, and cache.
"""

import sys
from pathlib import Path

import llvmlite.binding
import mujoco
from numba import types

_LIBRARY = {"win32": "mujoco.dll", "darwin": "libmujoco*.dylib"}.get(sys.platform, "libmujoco.so*")


def library() -> Path:
    """Path of the MuJoCo library that the installed `mujoco` package carries."""
    folder = Path(mujoco.__file__).parent
    found = sorted(folder.glob(_LIBRARY))
    assert found, f"no {_LIBRARY} in {folder}"
    return found[0]


llvmlite.binding.load_library_permanently(str(library()))


def _stage(name: str) -> types.ExternalFunction:
    return types.ExternalFunction(name, types.void(types.uintp, types.uintp))


mj_kinematics = _stage("mj_kinematics")
mj_fwd_kinematics = _stage("mj_fwdKinematics")
mj_make_m = _stage("mj_makeM")
mj_collision = _stage("mj_collision")
mj_make_constraint = _stage("mj_makeConstraint")
mj_island = _stage("mj_island")
mj_project_constraint = _stage("mj_projectConstraint")
mj_transmission = _stage("mj_transmission")
mj_factor_m = _stage("mj_factorM")
mj_sensor_pos = _stage("mj_sensorPos")
mj_sensor_vel = _stage("mj_sensorVel")
mj_sensor_acc = _stage("mj_sensorAcc")
mj_fwd_velocity = _stage("mj_fwdVelocity")
mj_fwd_actuation = _stage("mj_fwdActuation")
mj_fwd_acceleration = _stage("mj_fwdAcceleration")
mj_fwd_constraint = _stage("mj_fwdConstraint")
mj_euler = _stage("mj_Euler")
