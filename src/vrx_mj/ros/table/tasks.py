"""Topics and services of tasks, by VRX's names."""

import math
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import mujoco
import numpy as np

from vrx_mj.ros.interface import Input, Output, Service
from vrx_mj.ros.messages import Message, duration, new, stamp
from vrx_mj.ros.table.host import Host, header, link_name, turned

__all__ = ["TASK_TOPICS", "TaskTopics", "collision_name", "task_inputs", "task_outputs", "task_services"]

RATE = 1.0
"""Of a task's info and errors [Hz]."""
CONTACT_RATE = 10.0
ERRORS = ("pose_error", "mean_pose_error")


def task_outputs(host: Host) -> Iterator[Output]:
    """Topics that the world's task publishes; nothing without a task."""
    task = host.sim.task
    if task is None:
        return
    yield Output("/vrx/task/info", "vrx_gazebo/Task", lambda: _info(_task(host)), RATE)
    yield from _contacts(host, "/vrx")
    yield from TASK_TOPICS[task["type"]].outputs(host)


def task_inputs(host: Host) -> Iterator[Input]:
    """Topics that the world's task subscribes to."""
    task = host.sim.task
    return iter(()) if task is None else TASK_TOPICS[task["type"]].inputs(host)


def task_services(host: Host) -> Iterator[Service]:
    """Services of the world's task."""
    task = host.sim.task
    return iter(()) if task is None else TASK_TOPICS[task["type"]].services(host)


def _errors(host: Host, stem: str) -> Iterator[Output]:
    for key in ERRORS:
        yield Output(f"{stem}/{key}", "std_msgs/Float64", partial(_number, host, key), RATE)


def _goal_and_errors(host: Host, stem: str) -> Iterator[Output]:
    yield Output(f"{stem}/goal", "geographic_msgs/GeoPoseStamped", lambda: _goal(host), latched=True)
    yield from _errors(host, stem)


def _animal_poses(host: Host) -> Iterator[Output]:
    yield Output("/vrx/wildlife/animals/poses", "geographic_msgs/GeoPath", lambda: _animals(host), 10.0)


def _placard_symbol(host: Host) -> Iterator[Output]:
    yield Output("/vrx/scan_dock/placard_symbol", "std_msgs/String", lambda: _symbol(host), latched=True)


def _landmark(host: Host) -> Iterator[Input]:
    def landmark(message: Message) -> None:
        place = message.pose.position
        content = {"type": message.header.frame_id, "latitude": place.latitude, "longitude": place.longitude}
        host.sim.send("landmark", content)

    yield Input("/vrx/perception/landmark", "geographic_msgs/GeoPoseStamped", landmark)


def _color_sequence(host: Host) -> Iterator[Service]:
    """The colours of the light buoy, by the names of 2019 and of 2022."""

    def colors(request: Message) -> Message:
        if not _task(host).get("color_sequence_open"):
            return new("vrx_gazebo/ColorSequenceResponse", success=False)
        host.sim.send("color_sequence", [request.color1, request.color2, request.color3])
        return new("vrx_gazebo/ColorSequenceResponse", success=True)  # as VRX's: even for wrong ones

    for name in ("scan_dock", "scan_dock_deliver"):
        yield Service(f"/vrx/{name}/color_sequence", "vrx_gazebo/ColorSequence", colors)


def _contacts(host: Host, stem: str) -> Iterator[Output]:
    """What the boat touches, unless VRX_DEBUG=false silences it."""
    if os.environ.get("VRX_DEBUG") != "false":
        yield Output(f"{stem}/debug/contact", "vrx_gazebo/Contact", lambda: _contact(host), CONTACT_RATE)


def _gymkhana(host: Host) -> Iterator[Output]:
    """Its two parts, each with a task of its own as in VRX; the black box's score is its mean error."""

    def blackbox() -> Message:
        task = _task(host)
        return _info({**task, "name": "gymkhana_blackbox", "score": float(task.get("mean_pose_error", 0.0))})

    channel, box = "/vrx/gymkhana_channel", "/vrx/gymkhana_blackbox"
    yield Output(f"{channel}/task/info", "vrx_gazebo/Task", lambda: _info(_task(host)["channel"]), RATE)
    yield Output(f"{box}/task/info", "vrx_gazebo/Task", blackbox, RATE)
    yield from _contacts(host, channel)
    yield from _contacts(host, box)
    yield from _goal_and_errors(host, box)


def _task(host: Host) -> Mapping[str, Any]:
    return host.sim.task or {}


def _info(task: Mapping[str, Any]) -> Message:
    return new(
        "vrx_gazebo/Task",
        name=task["name"],
        state=task["state"],
        ready_time=stamp(task["ready_time"]),
        running_time=stamp(task["running_time"]),
        elapsed_time=duration(task["elapsed_time"]),
        remaining_time=duration(task["remaining_time"]),
        timed_out=task["timed_out"],
        num_collisions=task["num_collisions"],
        score=task["score"],
    )


def _number(host: Host, key: str) -> Message | None:
    value = _task(host).get(key)
    return None if value is None else new("std_msgs/Float64", data=float(value))


def _place(time: float, frame: str, place: Mapping[str, Any]) -> Message:
    """geographic_msgs/GeoPoseStamped; in a world without georeference, x and y [m] stand for latitude and longitude."""
    on_earth = place.get("latitude") is not None
    half = 0.5 * float(place.get("yaw", 0.0))
    return new(
        "geographic_msgs/GeoPoseStamped",
        header=header(time, frame),
        pose={
            "position": {
                "latitude": float(place["latitude"] if on_earth else place["x"]),
                "longitude": float(place["longitude"] if on_earth else place["y"]),
                "altitude": float(place.get("altitude", place.get("z", 0.0)) or 0.0),
            },
            "orientation": turned((math.cos(half), 0.0, 0.0, math.sin(half))),
        },
    )


def _goal(host: Host) -> Message | None:
    """Sent once, when the task becomes ready."""
    task = _task(host)
    return _place(task["ready_time"], "", task["goal"]) if task.get("goal") else None


def _path(host: Host, time: float, places: list[Message]) -> Message:
    return new("geographic_msgs/GeoPath", header=header(time), poses=places)


def _waypoints(host: Host, stem: str) -> Iterator[Output]:
    def route() -> Message | None:
        task = _task(host)
        ready = task["ready_time"]
        places = task.get("waypoints")
        return None if places is None else _path(host, ready, [_place(ready, "", place) for place in places])

    def least() -> Message | None:
        errors = _task(host).get("min_errors")
        if errors is None:
            return None
        size = len(errors)
        side = new("std_msgs/MultiArrayDimension", label="minimum errors", size=size, stride=size)
        layout = new("std_msgs/MultiArrayLayout", dim=[side])
        return new("std_msgs/Float64MultiArray", layout=layout, data=np.array(errors, np.float64))

    yield Output(f"{stem}/waypoints", "geographic_msgs/GeoPath", route, latched=True)
    yield Output(f"{stem}/min_errors", "std_msgs/Float64MultiArray", least, RATE)
    yield Output(f"{stem}/mean_error", "std_msgs/Float64", partial(_number, host, "mean_error"), RATE)


def _animals(host: Host) -> Message | None:
    animals, time = _task(host).get("animals"), host.sim.time
    if animals is None:
        return None
    return _path(host, time, [_place(time, animal["name"], animal) for animal in animals])


def _symbol(host: Host) -> Message | None:
    symbol = _task(host).get("symbol")
    return None if symbol is None else new("std_msgs/String", data=symbol)


def _contact(host: Host) -> Message | None:
    """The first contact of the boat that has the task, by Gazebo's names of collisions; None where there is none."""
    boat, model = str(_task(host)["boat"]), host.sim.model
    for contact in host.sim.data.contact:
        names = [collision_name(model, int(geom), host.sim.boats) for geom in contact.geom]
        if contact.dist < 0.0 and any(name.startswith(f"{boat}::") for name in names):
            return new("vrx_gazebo/Contact", header=header(host.sim.time), collision1=names[0], collision2=names[1])
    return None


def collision_name(model: mujoco.MjModel, geom: int, boats: tuple[str, ...]) -> str:
    """Gazebo's name of a shape, as `wamv::wamv/base_link::collision`."""
    link = link_name(model.body(int(model.geom_bodyid[geom])).name, boats)
    return f"{link}::{model.geom(geom).name.rpartition('/')[2] or 'collision'}"


def _no_outputs(_host: Host) -> Iterator[Output]:
    return iter(())


def _no_inputs(_host: Host) -> Iterator[Input]:
    return iter(())


def _no_services(_host: Host) -> Iterator[Service]:
    return iter(())


@dataclass(frozen=True)
class TaskTopics:
    """The topics and services of a type of task, besides the info and the contacts that all have."""

    outputs: Callable[[Host], Iterator[Output]] = _no_outputs
    inputs: Callable[[Host], Iterator[Input]] = _no_inputs
    services: Callable[[Host], Iterator[Service]] = _no_services


_DOCKING = TaskTopics(_placard_symbol, services=_color_sequence)
TASK_TOPICS: Mapping[str, TaskTopics] = {
    "stationkeeping": TaskTopics(partial(_goal_and_errors, stem="/vrx/station_keeping")),
    "wayfinding": TaskTopics(partial(_waypoints, stem="/vrx/wayfinding")),
    "perception": TaskTopics(inputs=_landmark),
    "navigation_course": TaskTopics(),
    "follow_path": TaskTopics(),
    "dock": _DOCKING,
    "scan_and_dock": _DOCKING,
    "scan_dock_deliver": _DOCKING,
    "wildlife": TaskTopics(_animal_poses),
    "gymkhana": TaskTopics(_gymkhana),
    "acoustic_perception": TaskTopics(),
    "acoustic_tracking": TaskTopics(partial(_errors, stem="/vrx/acoustic_tracking")),
}
"""By type of task."""
