"""Topics and services of the world and its task: clock, frames, wind, placards, formation, chart, VRX's task topics."""

import json
import math
import os
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache, lru_cache, partial
from typing import Any

import mujoco
import numpy as np

from vrx_mj.draw.course import ground_of, map_of, object_color
from vrx_mj.draw.style import hex_color
from vrx_mj.drive.pilot import engines_of
from vrx_mj.errors import CommandError
from vrx_mj.model.tasks import Wildlife
from vrx_mj.ros import messages
from vrx_mj.ros.cdr import kind
from vrx_mj.ros.interface import BOTH, VRX, VRX3, Entry, Input, Output, Service, in_vrx3, parameters, with_vrx3
from vrx_mj.ros.messages import Message, duration, fields, new, stamp
from vrx_mj.ros.table.boats import UNTURNED, WORLD_FRAME, BoatFrames, transform
from vrx_mj.ros.table.host import Host, collision_name, header
from vrx_mj.ros.table.viewers import START
from vrx_mj.tasks import TASK_KINDS, Form
from vrx_mj.tasks.referee import has_started

_WORLD = "/vrx_mj/world"
"""Topic of the world's description."""
_Row = dict[str, Any]
_Place = tuple[float, float, float]
CLOCK = "/clock"
"""Topic of the clock."""
_TF_RATE = 50.0
"""Rate of frames [Hz]: robot_state_publisher's."""
_WIND_RATE = 10.0
"""Rate of the wind [Hz]."""
_CONTACT_RATE = 10.0
"""Rate of contacts [Hz]."""
_COLLISION = 5
"""Type COLLISION of ros_gz_interfaces/Entity."""
_TASK_RATE = 1.0
"""Rate of a task's info and numbers [Hz]."""
_ANIMAL_RATE = 1.0
"""Rate of animals' poses [Hz]: VRX 3's default."""
_COLOR_COUNT = 3
"""Number of colours of a sequence."""
TASK_INFO = "/vrx/task/info"
"""Topic of the task's info."""
_COLOR_SEQUENCE = "/vrx/scan_dock_deliver/color_sequence"
"""Topic of the reported colours."""
_INFO_TYPE = "vrx_gazebo/Task"
"""Type of the task's info."""


def chart_output(host: Host) -> Output:
    """The topic: std_msgs/String with a JSON object; published again when boats come or go or the task shows its goal.

    Lengths in m, angles in rad, world frame: `name`, `cmd_vel` (what it commands: thrust or velocity), `x_from_east`
    (direction of the x axis), `shore` (rings, the land on their left), `docks`, `objects`, `course` (places that the
    task names, x, y and yaw) and `boats`, each with its colour and its engines as `drive.pilot` has them. Nothing in it
    is hidden from a team by its task.
    """

    @lru_cache(maxsize=1)
    def chart(course: tuple[_Place, ...]) -> Message:
        world = host.sim.world
        colors = host.scenery.colors(world.parameters)
        boats = {
            boat: {"color": hex_color(colors[boat]), "engines": [asdict(engine) for engine in engines_of(world, boat)]}
            for boat in host.sim.boats
        }
        text = json.dumps({**_ground(host), "course": course, "boats": boats}, separators=(",", ":"))
        return new("std_msgs/String", data=text)

    return Output(_WORLD, "std_msgs/String", lambda: chart(_course(host)), latched=True)


def _course(host: Host) -> tuple[_Place, ...]:
    """Where the task now asks a team to go."""
    task = host.sim.task or {}
    if task.get("type") == "acoustic_tracking":
        return ()  # its goal is the beacon, which is to be found
    places = task.get("waypoints") or ([task["goal"]] if task.get("goal") else [])
    return tuple((float(place["x"]), float(place["y"]), float(place.get("yaw", 0.0))) for place in places)


def _ground(host: Host) -> _Row:
    """Map without the boats, which come and go; drawn up once for a simulation, which takes a tenth of a second."""
    if host.scenery.ground is None:
        scene = map_of(host.sim.world)
        host.scenery.ground = {
            "name": host.sim.world.name,
            "x_from_east": host.sim.world.parameters.x_from_east,
            **ground_of(scene),
            "objects": [
                {"name": item.name, "x": item.x, "y": item.y, "color": object_color(item), "size": item.size}
                for item in scene.objects
            ],
        }
    return {"cmd_vel": host.cmd_vel, **host.scenery.ground}


def world_topics(host: Host, boat_frames: Sequence[BoatFrames], clock_rate: float, *, waits: bool) -> Iterator[Entry]:
    """`/clock`, `/tf`, `/tf_static`, `/vrx_mj/world`, VRX's wind, what shuffles, the formation, and `/vrx_mj/step`.

    VRX_DEBUG=false in the environment silences the wind and VRX 3's contacts. `/vrx_mj/step` advances, also where
    time is paused.
    """

    def clock() -> Message:
        return new("rosgraph_msgs/Clock", clock=stamp(host.sim.time))

    def moving() -> Message:
        return new("tf2_msgs/TFMessage", transforms=[frame for one in boat_frames for frame in one.moving()])

    @cache
    def still() -> Message:
        near = transform(0.0, WORLD_FRAME, START, host.scenery.start, UNTURNED)
        return new("tf2_msgs/TFMessage", transforms=[near, *(frame for one in boat_frames for frame in one.still())])

    @cache
    def vrx3_still() -> Message:
        more = [frame for one in boat_frames for frame in one.prefixed_frames()]
        return new("tf2_msgs/TFMessage", transforms=[*still().transforms, *more])

    def step(request: Message) -> dict[str, object]:
        host.step(request.duration)
        return {"sim_time": host.sim.time, "success": True}

    rows = partial(Output, dialects=BOTH, recorded="rows")
    yield rows(CLOCK, "rosgraph_msgs/Clock", clock, clock_rate, latched=waits)
    yield rows("/tf", "tf2_msgs/TFMessage", moving, _TF_RATE)
    for dialects, frames in ((VRX, still), (VRX3, vrx3_still)):
        yield rows("/tf_static", "tf2_msgs/TFMessage", frames, latched=True, dialects=dialects)
    yield chart_output(host)
    if os.environ.get("VRX_DEBUG") != "false":
        yield from _wind(host)
        make = partial(_contacts, host)
        yield Output("/vrx/contacts", "ros_gz_interfaces/Contacts", make, _CONTACT_RATE, dialects=VRX3)
    yield from world_inputs(host)
    yield Service("/vrx_mj/step", "vrx_mj_msgs/Step", step)


def _wind(host: Host) -> Iterator[Output]:
    """Speed [m/s], and where the wind blows to [degrees], counter-clockwise from true east.

    VRX gives a direction from -180 to 180, VRX 3 one as in its worlds' files, from 0 to 360.
    """

    def speed() -> Message:
        return new("std_msgs/Float64", data=host.sim.wind.speed)

    def direction(wrap: Callable[[float], float]) -> Message:
        toward = host.sim.wind.direction + host.sim.world.parameters.x_from_east
        return new("std_msgs/Float64", data=math.degrees(wrap(toward)))

    stem, topic = "/vrx/debug/wind", partial(Output, type="std_msgs/Float64", rate=_WIND_RATE, recorded="rows")
    yield from with_vrx3(topic(f"{stem}/speed", make=speed), f"{stem}/speed")
    yield topic(f"{stem}/direction", make=partial(direction, lambda angle: math.remainder(angle, math.tau)))
    yield in_vrx3(topic("", make=partial(direction, lambda angle: angle % math.tau)), f"{stem}/direction")


def _contacts(host: Host) -> Message:
    """All contacts of boats: who, where, along which normal, and how deep [m]."""
    entity, vector, found = kind("ros_gz_interfaces/Entity"), messages.kind("geometry_msgs/Vector3"), []
    for contact, names in _touches(host, host.sim.boats):
        sides = [entity(int(geom), name, _COLLISION) for geom, name in zip(contact.geom, names, strict=True)]
        where, normal = (vector(*xyz.tolist()) for xyz in (contact.pos, contact.frame[:3]))
        found.append(kind("ros_gz_interfaces/Contact")(*sides, [where], [normal], np.array([-contact.dist]), []))
    return kind("ros_gz_interfaces/Contacts")(header(host.sim.time), found)


def _touches(host: Host, boats: Collection[str]) -> Iterator[tuple[mujoco.MjContact, list[str]]]:
    """Contacts of some boats, each with Gazebo's names of the two collisions."""
    for contact in host.sim.data.contact:
        names = [collision_name(host.sim.model, int(geom), host.sim.boats) for geom in contact.geom]
        if contact.dist < 0.0 and any(name.partition("::")[0] in boats for name in names):
            yield contact, names


def world_inputs(host: Host) -> Iterator[Input]:
    """Inputs that shuffle placards and lights, and that for the formation of the fleet."""
    for name in (*host.sim.placards, *host.sim.lights):

        def shuffle(_message: Message, name: str = name) -> None:
            host.sim.shuffle(name)

        yield Input(f"/vrx/{name.rpartition('/')[2]}/shuffle", "std_msgs/Empty", shuffle)
    if len(host.sim.boats) > 1:
        yield Input("/swarm/formation", "std_msgs/String", lambda message: host.steering.form(message.data), None, BOTH)


def task_topics(host: Host) -> Iterator[Entry]:
    """Topics and services of the world's task; nothing without a task."""
    task = host.sim.task
    if task is None:
        return
    yield Output(TASK_INFO, _INFO_TYPE, lambda: _info(_task(host)), _TASK_RATE)
    yield Output(TASK_INFO, "ros_gz_interfaces/ParamVec", lambda: _info_parameters(host), _TASK_RATE, dialects=VRX3)
    yield from _task_contacts(host, "/vrx")
    yield from topics_of(host, task["type"])


def topics_of(host: Host, kind: str) -> Iterator[Entry]:
    """All topics and services of a type of task, besides the info and the contacts that all have."""
    topics = MORE_TOPICS.get(kind, MoreTopics())
    stem, vrx3_stem = topics.stem or f"/vrx/{kind}", topics.vrx3_stem or topics.stem or f"/vrx/{kind}"
    for key, form in TASK_KINDS[kind].outputs.items():
        if form is not None:
            form_type, convert = _FORMS[form]
            make = partial(_output, host, key, convert)
            rate = _TASK_RATE if form in {"number", "numbers"} else 0.0
            output = Output(f"{stem}/{key}", form_type, make, rate, latched=not rate)
            yield output
            yield replace(in_vrx3(output, f"{vrx3_stem}/{key}"), rate=_TASK_RATE)  # subscriptions there are volatile
    yield from topics.more(host)


def _output(host: Host, key: str, convert: Callable[[Any, float], Message]) -> Message | None:
    task = _task(host)
    return None if task.get(key) is None else convert(task[key], task["ready_time"])


def _rms_error(host: Host) -> Iterator[Output]:
    """The mean error by 2019's name."""
    make = partial(_output, host, "mean_pose_error", _FORMS["number"][1])
    yield Output("/vrx/station_keeping/rms_error", "std_msgs/Float64", make, _TASK_RATE)


def _animal_poses(host: Host) -> Iterator[Output]:
    """All animals in one topic; VRX 3 has a topic for each."""
    yield Output("/vrx/wildlife/animals/poses", "geographic_msgs/GeoPath", lambda: _animals(host), 10.0)
    task = host.sim.world.parameters.task
    for index in range(len(task.animals) if isinstance(task, Wildlife) else 0):

        def animal(index: int = index) -> Message | None:
            path = _animals(host)
            return None if path is None else path.poses[index]

        pose = Output("", "geographic_msgs/GeoPoseStamped", animal, _ANIMAL_RATE)
        yield in_vrx3(pose, f"/vrx/wildlife/animal{index}/pose")


def _landmark(host: Host) -> Iterator[Input]:
    """Topics for what a team recognized, and where: latitude and longitude [degrees] are x and y in VRX 3."""
    for type_name, axes, dialects in (
        ("geographic_msgs/GeoPoseStamped", ("latitude", "longitude"), VRX),
        ("geometry_msgs/PoseStamped", ("x", "y"), VRX3),
    ):

        def take(message: Message, axes: tuple[str, str] = axes) -> None:
            latitude, longitude = (getattr(message.pose.position, axis) for axis in axes)
            found = {"type": message.header.frame_id, "latitude": latitude, "longitude": longitude}
            host.sim.send("landmark", found)

        yield Input("/vrx/perception/landmark", type_name, take, dialects=dialects)


def _docking(host: Host) -> Iterator[Entry]:
    """The symbol of the placard, and the colours of the light buoy: a service of 2019 and of 2022, a topic of VRX 3."""

    def serve(request: Message) -> dict[str, object]:
        return {"success": _sent_colors(host, [request.color1, request.color2, request.color3])}

    def take(message: Message) -> None:
        names = list(message.data)
        if len(names) != _COLOR_COUNT:
            raise CommandError(f"{len(names)} colours: {_COLOR_COUNT} are needed, as in ['red', 'green', 'blue']")
        if not _sent_colors(host, names):
            raise CommandError("a sequence of colours is accepted only once, while the task runs")

    make = partial(_output, host, "symbol", _FORMS["text"][1])
    yield Output("/vrx/scan_dock/placard_symbol", "std_msgs/String", make, latched=True)
    yield Input(_COLOR_SEQUENCE, "ros_gz_interfaces/StringVec", take, dialects=VRX3)
    for name in ("/vrx/scan_dock/color_sequence", _COLOR_SEQUENCE):
        yield Service(name, "vrx_gazebo/ColorSequence", serve)


def _sent_colors(host: Host, colors: list[str]) -> bool:
    """Whether the task takes colours now; as in VRX even wrong ones."""
    is_open = bool(_task(host).get("color_sequence_open"))
    if is_open:
        host.sim.send("color_sequence", colors)
    return is_open


def _task_contacts(host: Host, stem: str) -> Iterator[Output]:
    """Contacts of the boat, unless VRX_DEBUG=false silences them."""
    if os.environ.get("VRX_DEBUG") != "false":
        make = partial(_contact, host)
        yield Output(f"{stem}/debug/contact", "vrx_gazebo/Contact", make, _CONTACT_RATE, recorded="nowhere")


def _gymkhana(host: Host) -> Iterator[Output]:
    """Topics of a gymkhana's two parts, each with a task as in VRX; the black box's score is its mean error."""

    def blackbox() -> Message:
        task = _task(host)
        return _info({**task, "name": "gymkhana_blackbox", "score": float(task.get("mean_pose_error", 0.0))})

    channel, box = "/vrx/gymkhana_channel", "/vrx/gymkhana_blackbox"
    yield Output(f"{channel}/task/info", _INFO_TYPE, lambda: _info(_task(host)["channel"]), _TASK_RATE)
    yield Output(f"{box}/task/info", _INFO_TYPE, blackbox, _TASK_RATE)
    yield from _task_contacts(host, channel)
    yield from _task_contacts(host, box)


def _task(host: Host) -> Mapping[str, Any]:
    return host.sim.task or {}


def _info(task: Mapping[str, Any]) -> Message:
    times = {"ready_time": stamp, "running_time": stamp, "elapsed_time": duration, "remaining_time": duration}
    values = {name: task[name] for name in fields(_INFO_TYPE)}
    if not has_started(task["state"]):
        values["remaining_time"] = 0.0  # VRX counts it from the start of running
    return new(_INFO_TYPE, **values | {name: make(values[name]) for name, make in times.items()})


def _info_parameters(host: Host) -> Message:
    info = _info(_task(host))
    values = {name: getattr(info, name) for name in fields(_INFO_TYPE)}
    times = {name: value.sec + 1e-9 * value.nanosec for name, value in values.items() if name.endswith("_time")}
    return parameters(header(host.sim.time), values | times)


def _place(time: float, frame: str, place: Mapping[str, Any]) -> Message:
    """geographic_msgs/GeoPoseStamped; without a georeference x and y [m] instead of latitude and longitude."""
    on_earth = place.get("latitude") is not None
    half = 0.5 * float(place.get("yaw_from_east", place.get("yaw", 0.0)))
    return new(
        "geographic_msgs/GeoPoseStamped",
        header=header(time, frame),
        pose={
            "position": {
                "latitude": float(place["latitude"] if on_earth else place["x"]),
                "longitude": float(place["longitude"] if on_earth else place["y"]),
                "altitude": float(place.get("altitude", place.get("z", 0.0)) or 0.0),
            },
            "orientation": (math.cos(half), 0.0, 0.0, math.sin(half)),
        },
    )


def _path(time: float, places: list[Message]) -> Message:
    return new("geographic_msgs/GeoPath", header=header(time), poses=places)


def _numbers(values: Sequence[float]) -> Message:
    side = new("std_msgs/MultiArrayDimension", label="minimum errors", size=len(values), stride=len(values))
    layout = new("std_msgs/MultiArrayLayout", dim=[side])
    return new("std_msgs/Float64MultiArray", layout=layout, data=values)


_FORMS: Mapping[Form, tuple[str, Callable[[Any, float], Message]]] = {
    "number": ("std_msgs/Float64", lambda value, _: new("std_msgs/Float64", data=float(value))),
    "numbers": ("std_msgs/Float64MultiArray", lambda values, _: _numbers(values)),
    "text": ("std_msgs/String", lambda text, _: new("std_msgs/String", data=text)),
    "place": ("geographic_msgs/GeoPoseStamped", lambda place, ready: _place(ready, "", place)),
    "places": (
        "geographic_msgs/GeoPath",
        lambda places, ready: _path(ready, [_place(ready, "", place) for place in places]),
    ),
}
"""Type of message of each form of outputs, and its conversion from a value and the time."""


def _animals(host: Host) -> Message | None:
    animals, time = _task(host).get("animals"), host.sim.time
    if animals is None:
        return None
    return _path(time, [_place(time, animal["name"], animal) for animal in animals])


def _contact(host: Host) -> list[Message]:
    """All contacts of the boat that has the task, by Gazebo's names of collisions."""
    touches, now = _touches(host, [_task(host)["boat"]]), header(host.sim.time)
    return [new("vrx_gazebo/Contact", header=now, collision1=one, collision2=two) for _, (one, two) in touches]


@dataclass(frozen=True)
class MoreTopics:
    """Topics of a type of task in VRX besides those of its outputs under `/vrx/TYPE`."""

    stem: str = ""
    """Where its topics are in VRX classic, if not there."""
    vrx3_stem: str = ""
    """Where they are in VRX 3, if elsewhere."""
    more: Callable[[Host], Iterator[Entry]] = lambda _host: iter(())


def elsewhere(host: Host) -> dict[str, str]:
    """Topics and services of the tasks that this world has not, with whose they are."""
    owners: dict[str, dict[str, None]] = {}
    for task in TASK_KINDS:
        for entry in topics_of(host, task):
            owners.setdefault(entry.name, {})[task] = None
    own = _task(host).get("type")
    return {
        name: f"it belongs to {', '.join(kinds)} tasks; this world has none"
        for name, kinds in owners.items()
        if own not in kinds
    }


_DOCKING = MoreTopics(more=_docking)
MORE_TOPICS: Mapping[str, MoreTopics] = {
    "stationkeeping": MoreTopics("/vrx/station_keeping", "/vrx/stationkeeping", _rms_error),
    "perception": MoreTopics(more=_landmark),
    "dock": _DOCKING,
    "scan_and_dock": _DOCKING,
    "scan_dock_deliver": _DOCKING,
    "wildlife": MoreTopics(more=_animal_poses),
    "gymkhana": MoreTopics("/vrx/gymkhana_blackbox", more=_gymkhana),
}
"""Topics and services by type of task."""
