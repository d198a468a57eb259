"""The stages of MuJoCo's step, callable from compiled kernels with the addresses of a model and its data."""

from numba import types

from vrx_mj.libmujoco import c_function


def _stage(name: str) -> types.ExternalFunction:
    return c_function(name, types.void, types.uintp, types.uintp)


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
