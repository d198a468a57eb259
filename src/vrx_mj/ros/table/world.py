"""What belongs to the world: its clock, frames, wind, placards, formation, and its chart."""

import json
import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from functools import cache, lru_cache, partial
from typing import Any

import numpy as np

from vrx_mj.draw.course import ground_of, map_of, object_color
from vrx_mj.draw.style import hex_color
from vrx_mj.drive.pilot import engines_of
from vrx_mj.ros import messages
from vrx_mj.ros.cdr import kind
from vrx_mj.ros.interface import BOTH, VRX, VRX3, Input, Output, Service, with_vrx3
from vrx_mj.ros.messages import Message, new, stamp
from vrx_mj.ros.table.boats import WORLD_FRAME, BoatFrames, transform
from vrx_mj.ros.table.host import Host, collision_name, header
from vrx_mj.ros.table.viewers import START

_WORLD = "/vrx_mj/world"
_Row = dict[str, Any]
_Place = tuple[float, float, float]


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
    """What boats that come and go do not change; drawn up once for a simulation, which takes a tenth of a second."""
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


CLOCK = "/clock"
_TF_RATE = 50.0
"""[Hz], as robot_state_publisher's."""
_WIND_RATE = 10.0
_CONTACT_RATE = 10.0
_COLLISION = 5
"""A kind of ros_gz_interfaces/Entity."""


def world_outputs(host: Host, boat_frames: Sequence[BoatFrames], clock_rate: float, *, waits: bool) -> Iterator[Output]:
    """`/clock`, `/tf`, `/tf_static`, `/vrx_mj/world`, and VRX's wind.

    VRX_DEBUG=false in the environment silences the wind and VRX 3's contacts.
    """

    def clock() -> Message:
        return new("rosgraph_msgs/Clock", clock=stamp(host.sim.time))

    def moving() -> Message:
        return new("tf2_msgs/TFMessage", transforms=[frame for one in boat_frames for frame in one.moving()])

    @cache
    def still() -> Message:
        near = transform(0.0, WORLD_FRAME, START, host.scenery.start, (1.0, 0.0, 0.0, 0.0))
        return new("tf2_msgs/TFMessage", transforms=[near, *(frame for one in boat_frames for frame in one.still())])

    @cache
    def vrx3_still() -> Message:
        more = [frame for one in boat_frames for frame in one.prefixed_frames()]
        return new("tf2_msgs/TFMessage", transforms=[*still().transforms, *more])

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


def _wind(host: Host) -> Iterator[Output]:
    """Speed [m/s], and where the wind blows to [degrees], counter-clockwise from true east, from -180 to 180."""

    def speed() -> Message:
        return new("std_msgs/Float64", data=host.sim.wind.speed)

    def direction() -> Message:
        toward = host.sim.wind.direction + host.sim.world.parameters.x_from_east
        return new("std_msgs/Float64", data=math.degrees(math.remainder(toward, math.tau)))

    for name, make in (("/vrx/debug/wind/speed", speed), ("/vrx/debug/wind/direction", direction)):
        yield from with_vrx3(Output(name, "std_msgs/Float64", make, _WIND_RATE, recorded="rows"), name)


def _contacts(host: Host) -> Message:
    """All contacts of boats: who, where, along which normal, and how deep [m]."""
    boats, found = host.sim.boats, []
    for contact in host.sim.data.contact:
        pair = [(int(geom), collision_name(host.sim.model, int(geom), boats)) for geom in contact.geom]
        if contact.dist < 0.0 and any(name.partition("::")[0] in boats for _, name in pair):
            sides = [kind("ros_gz_interfaces/Entity")(geom, name, _COLLISION) for geom, name in pair]
            where, normal = (
                messages.kind("geometry_msgs/Vector3")(*xyz.tolist()) for xyz in (contact.pos, contact.frame[:3])
            )
            found.append(kind("ros_gz_interfaces/Contact")(*sides, [where], [normal], np.array([-contact.dist]), []))
    return kind("ros_gz_interfaces/Contacts")(header(host.sim.time), found)


def world_inputs(host: Host) -> Iterator[Input]:
    """What shuffles placards and lights, and the formation of the fleet."""
    for name in (*host.sim.placards, *host.sim.lights):

        def shuffle(_message: Message, name: str = name) -> None:
            host.sim.shuffle(name)

        yield Input(f"/vrx/{name.rpartition('/')[2]}/shuffle", "std_msgs/Empty", shuffle)
    if len(host.sim.boats) > 1:
        yield Input("/swarm/formation", "std_msgs/String", lambda message: host.form(message.data), None, BOTH)


def world_services(host: Host) -> Iterator[Service]:
    """`/vrx_mj/step`: advance, whether paused or not."""

    def step(request: Message) -> dict[str, object]:
        host.step(request.duration)
        return {"sim_time": host.sim.time, "success": True}

    yield Service("/vrx_mj/step", "vrx_mj_msgs/Step", step)
