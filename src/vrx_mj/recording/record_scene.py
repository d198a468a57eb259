"""What a recording holds besides its rows: run, bodies, thrusters, sea, wind, shore. Plain data, no rerun.

The runtime fills a `RecordScene` once, when recording starts; everything later is rows of float64, whose
columns `RowLayout` names.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import numpy.typing as npt
from pydantic import FailFast, Field, FiniteFloat

from vrx_mj.arrays import Float32Array, FloatArray, IntArray
from vrx_mj.config.sensors import LidarConfig, SensorConfig
from vrx_mj.draw.style import Rgb, boat_colors
from vrx_mj.model.world import Parameters
from vrx_mj.sensors.displays import Display

FORMAT = 7
"""Version of what is written into a recording; others are refused."""

_Vec3 = tuple[float, float, float]
SeaHeight = Callable[[FloatArray, FloatArray, float | FloatArray], npt.ArrayLike]
"""Height of the sea [m] at x, y [m, ENU, equal shapes] and time [s]."""

PARKED_HEIGHT = -100.0
"""A ball below this height [m] waits for its shot, and is not shown."""

_Name = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]{1,300}$")]
"""One line of text."""
_Count = Annotated[int, Field(ge=0, le=1_000_000)]
_FiniteVec3 = tuple[FiniteFloat, FiniteFloat, FiniteFloat]

POSITION = ("x", "y", "z", "qw", "qx", "qy", "qz")
VELOCITY = ("vx", "vy", "vz", "wx", "wy", "wz")


@dataclass(frozen=True, eq=False)
class Surface:
    """A triangle mesh of one colour."""

    vertices: Float32Array
    """Vertices (n, 3) [m], in the frame of the body that carries it."""
    faces: IntArray
    """Faces (m, 3) as indices of vertices, counter-clockwise seen from outside."""
    normals: Float32Array
    """Normals (n, 3) of the vertices, unit vectors."""
    rgba: tuple[float, ...]
    """Colour: red, green, blue, alpha, 0 to 1."""


@dataclass(frozen=True, eq=False)
class RecordedBody:
    """A boat, a floating object or dock, a shooter's ball, or what does not move: a fixed dock, a post, the terrain."""

    name: str
    path: str
    """Entity path in the recording, for example `/world/boats/wamv1` or `/world/objects/red_0`."""
    kind: str
    """`boat`, `object`, `ball`, `dock` if it floats, or `fixed`."""
    pose: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    """Position [m] and quaternion (w, x, y, z) when recording starts; for a fixed body, always."""
    free: MovingBody | None = None
    """Places of its free joint's numbers; None for a fixed body."""
    surfaces: tuple[Surface, ...] = ()


@dataclass(frozen=True, eq=False)
class RecordedJoint:
    """A joint of a part, as MuJoCo has it."""

    kind: Literal["hinge", "slide", "ball"]
    """Whether the part turns about the axis, slides along it, or turns any way."""
    anchor: _Vec3
    """Place of the joint in the part's own frame [m]."""
    axis: _Vec3
    """Axis in the part's own frame, a unit vector."""
    qpos: int
    """First of the joint's numbers in qpos: an angle [rad], a position [m], or a quaternion (w, x, y, z)."""


@dataclass(frozen=True, eq=False)
class RecordedPart:
    """A part that hangs on another body: a link of an object, a block of a floating dock, or a placard on its block."""

    path: str
    """Its entity, under that of what it hangs on."""
    pose: tuple[float, ...]
    """Position [m] and quaternion (w, x, y, z) in the frame of what it hangs on, where its joints are at 0."""
    joints: tuple[RecordedJoint, ...]
    """Its joints, from what it hangs on outward; without any it is fixed."""
    surfaces: tuple[Surface, ...] = ()


@dataclass(frozen=True, eq=False)
class RecordedThruster:
    """A thruster, in the order of the rows' thrust and angle columns."""

    name: str
    boat: str
    position: _Vec3
    """Place where the engine is mounted, in the body frame [m]."""
    mount: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)
    """Quaternion (w, x, y, z) of the engine at zero steering, which turns about its z: engine to body."""
    direction: _Vec3 = (1.0, 0.0, 0.0)
    """Direction of the force, a unit vector in the engine's frame."""
    surfaces: tuple[Surface, ...] = ()
    """The engine's looks, in its own frame: they turn with the steering angle."""


@dataclass(frozen=True, eq=False)
class RecordedDisplay:
    """A light or a placard, whose colours change."""

    display: Display
    path: str
    """The entity of the body that carries it."""
    surfaces: Mapping[str, tuple[Surface, ...]]
    """Looks of its parts, in the body's frame."""

    def part_path(self, part: str) -> str:
        """The entity of a part."""
        return f"{self.path}/{self.display.kind}/{part}"


@dataclass(frozen=True)
class RecordedSensor:
    """A sensor whose readings are recorded."""

    boat: _Name
    name: _Name
    type: str
    """Type of its readings: camera, lidar, gps, imu, p3d, pinger or ball_shooter."""
    frame: str
    rate: FiniteFloat
    """Readings per simulated second."""
    position: _FiniteVec3
    """Position of the measuring frame (x forward, z up) on the boat [m]."""
    rotation: tuple[_FiniteVec3, _FiniteVec3, _FiniteVec3]
    """Rotation from the measuring frame to the boat's."""
    config: SensorConfig

    @property
    def path(self) -> str:
        """The boat's entity in the recording, which moves with it."""
        return f"/world/boats/{self.boat}/sensors/{self.name}"

    @property
    def gives_points(self) -> bool:
        """Whether its readings are clouds of points."""
        return isinstance(self.config, LidarConfig) and self.config.output == "points"

    @property
    def readings_path(self) -> str:
        """The entity that has what gives its readings back: pictures and points as they are shown, or numbers."""
        shown = self.type == "camera" or self.gives_points
        return self.path if shown else f"/record/readings/{self.boat}/{self.name}"


@dataclass(frozen=True, eq=False)
class RecordScene:
    """All that a recording holds before its first row, or before the first after boats came or went."""

    properties: Mapping[str, Any]
    """The run: world, fleet, seed, versions, platform, hashes. JSON values."""
    timestep: float
    """Physics step [s]."""
    nq: int
    nv: int
    bodies: tuple[RecordedBody, ...]
    thrusters: tuple[RecordedThruster, ...]
    parameters: Parameters
    """The parameters of the world: wind and sea, shore, what its task lays out."""
    files: Mapping[str, bytes] = field(default_factory=dict)
    """The saved form of the world by relative path: what a restart needs."""
    sea_height: SeaHeight | None = None
    sensors: tuple[RecordedSensor, ...] = ()
    displays: tuple[RecordedDisplay, ...] = ()
    parts: tuple[RecordedPart, ...] = ()
    begun: float | None = None
    """Simulated time from which its boats are shown [s]; None: always, and they stay."""
    ended: float | None = None
    """Simulated time at which the recording ends [s]; None: it goes on."""
    follow: str | None = None
    """The boat that the camera follows; None: the fleet."""
    earlier: tuple[str, ...] = ()
    """Boats of the scenes before it in the same recording, in the order in which they came."""

    def of_type(self, kind: str) -> tuple[RecordedSensor, ...]:
        """The recorded sensors of a type, in order."""
        return tuple(sensor for sensor in self.sensors if sensor.type == kind)

    def boats(self) -> tuple[RecordedBody, ...]:
        """The bodies that are boats, in order."""
        return tuple(body for body in self.bodies if body.kind == "boat")

    def roster(self) -> tuple[str, ...]:
        """All boats until now, those that left included: their colours go by this order."""
        return tuple(dict.fromkeys((*self.earlier, *(boat.name for boat in self.boats()))))

    def weather(self) -> tuple[str, ...]:
        """Which of wind, waves and current there are."""
        wind, sea, current = self.parameters.wind, self.parameters.sea, self.parameters.current
        there = {"wind": wind.mean != 0.0 or wind.gain > 0.0, "waves": bool(sea.waves), "current": current is not None}
        return tuple(name for name, found in there.items() if found)

    def colors(self) -> dict[str, Rgb]:
        """The colour of every boat of the roster."""
        return boat_colors(self.roster(), self.parameters.boats)

    def layout(self) -> RowLayout:
        """Names and places of the rows' columns."""
        moving = tuple(body.free for body in self.bodies if body.free)
        thrusters = tuple((thruster.boat, thruster.name) for thruster in self.thrusters)
        marks = sum(len(shown.display.start) for shown in self.displays)
        turning = int(self.parameters.air is not None)
        return RowLayout(self.nq, self.nv, thrusters, moving, marks, turning)


@dataclass(frozen=True)
class MovingBody:
    """Places of a body with a free joint in qpos and qvel."""

    name: _Name
    kind: _Name
    qpos: _Count
    """First of the joint's 7 numbers in qpos."""
    dof: _Count
    """First of its 6 numbers in qvel."""


@dataclass(frozen=True)
class RowLayout:
    """Columns of a row: time, wind speed, thrusts, steering angles, qpos, qvel, marks of what is shown, wind angle."""

    nq: _Count
    nv: _Count
    thrusters: Annotated[tuple[tuple[_Name, _Name], ...], FailFast()]
    """Boat and name of each thruster, in the order of their columns."""
    bodies: Annotated[tuple[MovingBody, ...], FailFast()]
    display_marks: _Count = 0
    """Number of columns for what lights and placards show."""
    wind_angles: _Count = 0
    """1 where the wind's direction changes, else 0."""

    @property
    def width(self) -> int:
        """Number of columns."""
        return int(self.wind_angle.stop)

    @property
    def thrust(self) -> slice:
        """Thrusts [N]."""
        return slice(2, 2 + len(self.thrusters))

    @property
    def angle(self) -> slice:
        """Steering angles [rad]."""
        return slice(self.thrust.stop, self.thrust.stop + len(self.thrusters))

    @property
    def qpos(self) -> slice:
        """Positions, as MuJoCo has them."""
        return slice(self.angle.stop, self.angle.stop + self.nq)

    @property
    def qvel(self) -> slice:
        """Velocities, as MuJoCo has them: a free joint's are world linear [m/s], body angular [rad/s]."""
        return slice(self.qpos.stop, self.qpos.stop + self.nv)

    @property
    def marks(self) -> slice:
        """Marks of lights and placards, as in `sensors.displays`."""
        return slice(self.qvel.stop, self.qvel.stop + self.display_marks)

    @property
    def wind_angle(self) -> slice:
        """Angle by which the wind blows off its direction at the start [rad], counter-clockwise."""
        return slice(self.marks.stop, self.marks.stop + self.wind_angles)

    def pose(self, body: MovingBody) -> slice:
        """The 7 columns of a body's position and quaternion."""
        start = self.qpos.start + body.qpos
        return slice(start, start + 7)

    def velocity(self, body: MovingBody) -> slice:
        """The 6 columns of a body's velocity."""
        start = self.qvel.start + body.dof
        return slice(start, start + 6)

    def names(self) -> tuple[str, ...]:
        """Readable names of the columns: `wamv1 y`, `wamv1 left thrust`, `qpos[30]`."""
        names = ["time", "wind_speed"]
        names += [f"{boat} {name} thrust" for boat, name in self.thrusters]
        names += [f"{boat} {name} angle" for boat, name in self.thrusters]
        names += [f"qpos[{i}]" for i in range(self.nq)] + [f"qvel[{i}]" for i in range(self.nv)]
        names += [f"display[{i}]" for i in range(self.display_marks)]
        names += ["wind_angle"] * self.wind_angles
        for body in self.bodies:
            names[self.pose(body)] = [f"{body.name} {axis}" for axis in POSITION]
            names[self.velocity(body)] = [f"{body.name} {axis}" for axis in VELOCITY]
        return tuple(names)
