"""Gazebo's own topics and services, as far as VRX's users use them."""

import contextlib
import itertools
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import mujoco
import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.errors import CommandError, VrxError
from vrx_mj.frames import Pose, angles, conjugate, quaternion_product, rotation, rotation_matrix
from vrx_mj.ros.interface import VRX3, Entry, Input, Output, Service
from vrx_mj.ros.messages import Message, fields, kind, new
from vrx_mj.ros.table.boats import UNTURNED
from vrx_mj.ros.table.host import FrameState, Host, JointAxis, header, pose_message, twist_message
from vrx_mj.runtime.applied import AppliedForce

_STATE_RATE = 100.0
"""Rate of states [Hz]; Gazebo's is that of its physics, at most 1000."""
_REVOLUTE, _CONTINUOUS, _PRISMATIC, _BALL, _UNIVERSAL = 0, 1, 2, 4, 5
"""Types of joints: constants of gazebo_msgs/GetJointProperties."""
_METRICS_RATE = 5.0
"""Rate of metrics [Hz]: Gazebo's."""


def gazebo_topics(host: Host) -> Iterator[Entry]:
    """Topics of Gazebo, and the services that the tutorials and common scripts call."""
    for what, links in (("Model", False), ("Link", True)):
        kind = f"gazebo_msgs/{what}States"
        make = partial(_states, host, kind, links)
        yield Output(f"/gazebo/{what.lower()}_states", kind, make, _STATE_RATE, recorded="rows")
    yield Output(
        "/gazebo/performance_metrics",
        "gazebo_msgs/PerformanceMetrics",
        lambda: _metrics(host),
        _METRICS_RATE,
        recorded="nowhere",
    )
    yield Input("/gazebo/set_model_state", "gazebo_msgs/ModelState", lambda state: _set_model(host, state))
    yield Input("/gazebo/set_link_state", "gazebo_msgs/LinkState", lambda state: _set_link(host, state))
    for name, type_name, do in _SERVICES:
        reports = "success" in fields(f"{type_name}Response")
        yield Service(f"/gazebo/{name}", type_name, partial(do, host), reports)


def gz_services(host: Host) -> Iterator[Service]:
    """Services of gz sim that spawn, remove and move models; the reason of a failure goes to the log alone."""
    world = re.sub(r"\W", "_", host.sim.world.name.rpartition("/")[2])
    for name, what, do in (
        ("create", "SpawnEntity", lambda asked: _create(host, asked.entity_factory)),
        ("remove", "DeleteEntity", lambda asked: host.remove(_entity(asked))),
        (
            "set_pose",  # at rest, as by set_model_state
            "SetEntityPose",
            lambda asked: _put(host, host.bodies.parts(_entity(asked)), new("gazebo_msgs/ModelState", pose=asked.pose)),
        ),
    ):
        yield Service(f"/world/{world}/{name}", f"ros_gz_interfaces/{what}", do, reports=True, dialects=VRX3)


def _create(host: Host, asked: Message) -> None:
    """Spawn what a text of SDF or URDF describes; files and clones of this machine are not for a network."""
    if not asked.name or not asked.sdf:
        raise CommandError("entity_factory: name and sdf are needed; sdf_filename and clone_name are not supported")
    numbers = (f"_{number}" for number in itertools.count(1))
    free = (asked.name + end for end in itertools.chain([""], numbers) if asked.name + end not in host.bodies.models)
    name = next(free) if asked.allow_renaming else asked.name
    pose = _pose(host, asked.pose, asked.relative_to)
    if "<robot" in asked.sdf:
        host.spawn(name, asked.sdf, pose)
    else:
        host.spawn_object(name, asked.sdf, pose)


def _entity(asked: Message) -> str:
    """The name of a model; numbers of entities are Gazebo's alone."""
    if not asked.entity.name:
        raise CommandError("entity.name is needed: entities have no id")
    return str(asked.entity.name.replace("::", "/"))


def _states(host: Host, kind: str, links: bool) -> Message:
    found = host.bodies.places(links=links)
    poses, twists = [pose_message(one) for one in found.values()], [twist_message(one) for one in found.values()]
    return new(kind, name=list(found), pose=poses, twist=twists)


def _metrics(host: Host) -> Message:
    sensors = [
        new(
            "gazebo_msgs/SensorPerformanceMetric",
            name=f"{sensor.boat}::{sensor.name}",
            sim_update_rate=sensor.config.rate,
            real_update_rate=sensor.config.rate * host.pace,
            fps=sensor.config.rate * host.pace if sensor.config.type == "camera" else -1.0,
        )
        for boat in host.sim.boats
        for sensor in host.sim.mounted(boat)
        if (boat, sensor.name) in host.sensor_load
    ]
    return new(
        "gazebo_msgs/PerformanceMetrics", header=header(host.sim.time), real_time_factor=host.pace, sensors=sensors
    )


def _pause(host: Host, *, paused: bool) -> None:
    host.paused = paused


# What comes and goes


def _spawn(host: Host, asked: Message) -> Mapping[str, object]:
    name = asked.model_name or asked.robot_namespace.strip("/")
    own = asked.robot_namespace.strip("/")
    if own and own != name:
        raise CommandError(
            f"model '{name}' in the namespace '{own}': a boat's name is its namespace; make both the same, or "
            "leave the namespace empty"
        )
    host.spawn(name, asked.model_xml, _pose(host, asked.initial_pose, asked.reference_frame))
    return {"status_message": f"{name} joins; its topics begin with /{name}/"}


def _spawn_sdf(host: Host, asked: Message) -> Mapping[str, object]:
    pose = _pose(host, asked.initial_pose, asked.reference_frame)
    return {"status_message": host.spawn_object(asked.model_name, asked.model_xml, pose)}


def _delete(host: Host, asked: Message) -> Mapping[str, object]:
    host.remove(asked.model_name.replace("::", "/"))
    return {"status_message": f"{asked.model_name} leaves"}


# Where things are


def _get_model(host: Host, asked: Message) -> Mapping[str, object]:
    placed = _relative(host, host.bodies.model(asked.model_name), asked.relative_entity_name)
    frame = asked.relative_entity_name or "world"
    return {"header": header(host.sim.time, frame), "pose": pose_message(placed), "twist": twist_message(placed)}


def _get_link(host: Host, asked: Message) -> Mapping[str, object]:
    placed = _relative(host, host.bodies.link(asked.link_name), asked.reference_frame)
    state = new(
        "gazebo_msgs/LinkState",
        link_name=asked.link_name,
        pose=pose_message(placed),
        twist=twist_message(placed),
        reference_frame=asked.reference_frame or "world",
    )
    return {"link_state": state}


def _relative(host: Host, placed: FrameState, frame: str) -> FrameState:
    """Seen from another model or link."""
    base = host.bodies.frame(frame)
    return placed if base is None else _seen_from(base, placed)


def _seen_from(base: FrameState, placed: FrameState) -> FrameState:
    turn = rotation_matrix(base.quaternion).T
    away = placed.position - base.position
    velocity = placed.velocity - base.velocity - np.cross(base.spin, away)
    return FrameState(
        turn @ away,
        quaternion_product(conjugate(base.quaternion), placed.quaternion),
        turn @ velocity,
        turn @ (placed.spin - base.spin),
    )


def _set_link(host: Host, state: Message) -> None:
    _put(host, [host.bodies.model_of_link(state.link_name)], state)


def _set_model(host: Host, state: Message) -> None:
    _put(host, host.bodies.parts(state.model_name), state)


def _put(host: Host, parts: Sequence[str], state: Message) -> None:
    """Set pose and twist as Gazebo does: a twist that is not given stops the body.

    The first of the parts goes to the pose, and the others keep their places beside it.
    """
    where = _pose(host, state.pose, state.reference_frame)
    linear, angular = _three("twist.linear", state.twist.linear), _three("twist.angular", state.twist.angular)
    if (base := host.bodies.frame(state.reference_frame)) is not None:
        to_world = rotation_matrix(base.quaternion)
        linear, angular = to_world @ linear, to_world @ angular
    for name, pose in zip(parts, list(_beside(host, parts, where)), strict=True):
        to_body = np.array(rotation(*pose[3:])).T
        velocity = (*(to_body @ linear).tolist(), *(to_body @ angular).tolist())
        move = host.sim.set_boat if name in host.sim.boats else host.sim.set_object
        move(name, pose=pose, velocity=velocity)
    host.note_move()


def _beside(host: Host, parts: Sequence[str], where: Pose) -> Iterator[Pose]:
    """Poses of the parts of a model whose first part goes to a pose: they stay beside it as they are now."""
    yield where
    first = host.bodies.model(parts[0])
    turn = np.array(rotation(*where[3:]))
    for name in parts[1:]:
        now = _seen_from(first, host.bodies.model(name))
        x, y, z = np.array(where[:3]) + turn @ now.position
        yield x, y, z, *angles((turn @ rotation_matrix(now.quaternion)).tolist())


def _pose(host: Host, pose: Message, frame: str) -> Pose:
    """x, y, z [m], roll, pitch, yaw [rad] in the world; a quaternion of zeros means no rotation, as in Gazebo."""
    position = _three("pose.position", pose.position)
    given = pose.orientation
    quaternion = np.array([given.w, given.x, given.y, given.z], np.float64)
    size = float(np.linalg.norm(quaternion))
    if not math.isfinite(size):
        raise CommandError(f"invalid pose.orientation {quaternion.tolist()} (w, x, y, z): finite numbers are needed")
    quaternion = quaternion / size if size > 0.0 else UNTURNED
    base = host.bodies.frame(frame)
    if base is not None:
        position = base.position + rotation_matrix(base.quaternion) @ position
        quaternion = quaternion_product(base.quaternion, quaternion)
    x, y, z = position.tolist()
    return x, y, z, *angles(rotation_matrix(quaternion).tolist())


def _three(what: str, given: Message) -> FloatArray:
    values: FloatArray = np.array([given.x, given.y, given.z], np.float64)
    if not np.isfinite(values).all():
        raise CommandError(f"invalid {what} {values.tolist()}: finite numbers are needed")
    return values


# What pushes


def _apply_wrench(host: Host, asked: Message) -> None:
    """Apply a wrench as Gazebo does: given in a frame, moved from its origin to the centre of mass."""
    link, base = host.bodies.link(asked.body_name), host.bodies.frame(asked.reference_frame)
    force, torque = _three("wrench.force", asked.wrench.force), _three("wrench.torque", asked.wrench.torque)
    torque = torque + np.cross(_three("reference_point", asked.reference_point), force)
    if base is not None:
        to_world = rotation_matrix(base.quaternion)
        force, torque = to_world @ force, to_world @ torque
        torque = torque + np.cross(base.position - link.position, force)
    values = np.concatenate((force, torque))
    host.applied.add(AppliedForce(asked.body_name, host.bodies.body(asked.body_name), "", values, *_span(asked)))


def _apply_effort(host: Host, asked: Message) -> None:
    values = np.array([asked.effort])
    host.applied.add(AppliedForce(asked.joint_name, "", _axis(host, asked.joint_name), values, *_span(asked)))


def _axis(host: Host, name: str) -> str:
    """The first axis of a joint, by its name in the MJCF."""
    joint = str(host.sim.model.joint(host.bodies.joint_numbers(name)[0]).name)
    if any(one.joint == joint for one in host.sim.world.parameters.thrusters):
        raise CommandError(f"the joint '{name}' steers an engine: its topic thrust_angle turns it")
    return joint


def _span(asked: Message) -> tuple[float, float]:
    """Times at which a force begins and ends [s]; one of a negative duration does not end."""
    begins, duration = (one.sec + 1e-9 * one.nanosec for one in (asked.start_time, asked.duration))
    return begins, begins + duration if duration >= 0.0 else math.inf


# What there is


def _physics(host: Host) -> dict[str, object]:
    """Fields that GetPhysicsProperties and SetPhysicsProperties have both; ODE is not there."""
    gravity = kind("geometry_msgs/Vector3")(*host.sim.model.opt.gravity.tolist())
    ode = new("gazebo_msgs/ODEPhysics")
    return {
        "time_step": host.sim.timestep, "max_update_rate": host.update_rate, "gravity": gravity, "ode_config": ode,
    }  # fmt: skip


def _set_physics(host: Host, asked: Message) -> None:
    for name, own in _physics(host).items():
        if (given := getattr(asked, name)) != own:
            values = f": {own:g}, got {given:g}" if isinstance(own, float) else ""
            raise CommandError(f"{name} cannot be changed{values}")


def _model_properties(host: Host, asked: Message) -> Mapping[str, object]:
    parts = host.bodies.parts(asked.model_name)
    scope = f"{asked.model_name.replace('/', '::')}::"
    links = [link.removeprefix(scope) for link in host.bodies.links if link.startswith(scope)]
    joints = [joint.removeprefix(scope) for joint in host.bodies.joints if joint.startswith(scope)]
    return {
        "canonical_body_name": links[0] if links else "",
        "body_names": links,
        "joint_names": joints,
        "is_static": not any(one in host.sim.boats or _floats(host, one) for one in parts),
    }


def _joint_properties(host: Host, asked: Message) -> Mapping[str, object]:
    axes = host.bodies.joint(asked.joint_name)
    return {
        "type": _joint_type(axes),
        "damping": [axis.damping for axis in axes],
        "position": [axis.position for axis in axes],
        "rate": [axis.rate for axis in axes],
    }


def _joint_type(axes: Sequence[JointAxis]) -> int:
    """GetJointProperties' number of a type of joint."""
    if axes[0].kind == mujoco.mjtJoint.mjJNT_BALL:
        return _BALL
    if axes[0].kind == mujoco.mjtJoint.mjJNT_SLIDE:
        return _PRISMATIC
    if len(axes) > 1:
        return _UNIVERSAL
    return _REVOLUTE if axes[0].limited else _CONTINUOUS


def _floats(host: Host, name: str) -> bool:
    with contextlib.suppress(VrxError):
        host.sim.observe_object(name)
        return True
    return False


_Do = Callable[[Host, Message], Mapping[str, object] | None]
_SERVICES: Sequence[tuple[str, str, _Do]] = (
    ("reset_world", "std_srvs/Empty", lambda host, _: host.reset_world()),
    ("reset_simulation", "std_srvs/Empty", lambda host, _: host.reset_simulation()),
    ("pause_physics", "std_srvs/Empty", lambda host, _: _pause(host, paused=True)),
    ("unpause_physics", "std_srvs/Empty", lambda host, _: _pause(host, paused=False)),
    ("spawn_urdf_model", "gazebo_msgs/SpawnModel", _spawn),
    ("spawn_sdf_model", "gazebo_msgs/SpawnModel", _spawn_sdf),
    ("delete_model", "gazebo_msgs/DeleteModel", _delete),
    ("get_model_state", "gazebo_msgs/GetModelState", _get_model),
    ("set_model_state", "gazebo_msgs/SetModelState", lambda host, asked: _set_model(host, asked.model_state)),
    ("get_link_state", "gazebo_msgs/GetLinkState", _get_link),
    ("set_link_state", "gazebo_msgs/SetLinkState", lambda host, asked: _set_link(host, asked.link_state)),
    (
        "get_world_properties",
        "gazebo_msgs/GetWorldProperties",
        lambda host, _: {
            "sim_time": host.sim.time,
            "model_names": list(host.bodies.models),
            "rendering_enabled": True,
        },
    ),
    ("get_model_properties", "gazebo_msgs/GetModelProperties", _model_properties),
    ("get_joint_properties", "gazebo_msgs/GetJointProperties", _joint_properties),
    (
        "get_physics_properties",
        "gazebo_msgs/GetPhysicsProperties",
        lambda host, _: {"pause": host.paused, **_physics(host)},
    ),
    ("set_physics_properties", "gazebo_msgs/SetPhysicsProperties", _set_physics),
    ("apply_body_wrench", "gazebo_msgs/ApplyBodyWrench", _apply_wrench),
    ("apply_joint_effort", "gazebo_msgs/ApplyJointEffort", _apply_effort),
    (
        "clear_body_wrenches",
        "gazebo_msgs/BodyRequest",
        lambda host, asked: host.applied.clear(body=host.bodies.body(asked.body_name)),
    ),
    (
        "clear_joint_forces",
        "gazebo_msgs/JointRequest",
        lambda host, asked: host.applied.clear(joint=_axis(host, asked.joint_name)),
    ),
)
"""Names after `/gazebo/`, types, and what each does: it gives fields of the response."""
