"""What a client knows of the world that it drives in: boats, their engines and motion, wind and time."""

import json
import math
import re
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from vrx_mj.drive.helm.engines import Engine
from vrx_mj.ros.teleop.client import Bridge

__all__ = ["Motion", "Scene"]

WORLD = "/vrx_mj/world"
TWIST = "geometry_msgs/Twist"
COMMANDED = re.compile(r"/(.+)/cmd_vel")
"""Topics of boats: each takes one."""
SEEN_PERIOD = 0.2
"""Wall time between two looks at where boats are [s]."""
ASKED_PERIOD = 1.0
"""Wall time between two questions which boats there are [s]."""
STILL = 0.6
"""Wall time after which a clock that says nothing stands [s]."""
SETTLES = 1.0
"""Wall time after which the clock has told of a pause, or of its end [s]."""

Clock = Callable[[], float]


class Motion(NamedTuple):
    """How a boat moves."""

    speed: float
    """Over ground [m/s]."""
    heading: float
    """Of its bow [rad], counter-clockwise from east."""


class Scene:
    """Filled by the messages of one connection."""

    def __init__(self, bridge: Bridge, clock: Clock = time.monotonic) -> None:
        self.name = ""
        self.keeps_velocity = False
        """Whether `cmd_vel` commands a velocity that is kept, instead of thrust."""
        self.boats: tuple[str, ...] | None = None
        """None until they are known."""
        self.motions: Mapping[str, Motion] = {}
        self.wind_speed: float | None = None
        self.wind_direction: float | None = None
        """Where it blows to [degrees], counter-clockwise from east."""
        self.time: float | None = None
        """Simulated [s]."""
        self._engines: dict[str, tuple[Engine, ...]] | None = None
        self._bridge, self._clock = bridge, clock
        self._ticked, self._asked = clock(), -math.inf
        self._meant, self._asked_pause = False, -math.inf
        for topic, kind, take, period in (
            (WORLD, "std_msgs/String", self._world, 0.0),
            ("/clock", "rosgraph_msgs/Clock", self._tick, SEEN_PERIOD),
            ("/gazebo/model_states", "gazebo_msgs/ModelStates", self._see, SEEN_PERIOD),
            ("/vrx/debug/wind/speed", "std_msgs/Float64", self._blow, SEEN_PERIOD),
            ("/vrx/debug/wind/direction", "std_msgs/Float64", self._veer, SEEN_PERIOD),
        ):
            bridge.subscribe(topic, kind, take, period=period)

    @property
    def is_known(self) -> bool:
        """Whether the world has told of itself, and which boats it has."""
        return self.boats is not None and self._engines is not None

    @property
    def is_paused(self) -> bool:
        """Whether time stands."""
        now = self._clock()
        return self._meant if now - self._asked_pause < SETTLES else now - self._ticked > STILL

    def note_pause(self, *, paused: bool) -> None:
        """Time was stopped, or goes on: the clock will tell, but what it told before may still be on its way."""
        self._meant, self._asked_pause = paused, self._clock()

    @property
    def engines(self) -> dict[str, Sequence[Engine]]:
        """What the keys drive, by boat; none yet of a boat that has just come."""
        known = self._engines or {}
        return {boat: known.get(boat, ()) for boat in self.boats or ()}

    def follow(self) -> None:
        """Ask which boats there are, if it is time; a world that is paused tells too."""
        if self._clock() - self._asked > ASKED_PERIOD:
            self._asked = self._clock()
            self._bridge.call("/rosapi/topics_for_type", {"type": TWIST}, self._count)

    def _count(self, answer: Any, well: bool) -> None:
        if well:
            found = [COMMANDED.fullmatch(topic) for topic in answer["topics"]]
            self.boats = tuple(sorted((match.group(1) for match in found if match), key=_by_number))

    def _world(self, message: Mapping[str, Any]) -> None:
        told = json.loads(message["data"])
        self.name, self.keeps_velocity = told["name"], told["cmd_vel"] == "velocity"
        if self._engines is None:
            self.boats = None  # those of a world that had not offered its topics yet
        self._engines = {
            boat: tuple(Engine(**engine) for engine in row["engines"]) for boat, row in told["boats"].items()
        }
        self._asked = -math.inf  # boats may have come or gone

    def _tick(self, message: Mapping[str, Any]) -> None:
        self.time, self._ticked = message["clock"]["secs"] + 1e-9 * message["clock"]["nsecs"], self._clock()

    def _see(self, message: Mapping[str, Any]) -> None:
        rows = zip(message["name"], message["pose"], message["twist"], strict=True)
        self.motions = {name: _motion(pose["orientation"], twist["linear"]) for name, pose, twist in rows}

    def _blow(self, message: Mapping[str, Any]) -> None:
        self.wind_speed = message["data"]

    def _veer(self, message: Mapping[str, Any]) -> None:
        self.wind_direction = message["data"]


def _motion(turn: Mapping[str, float], velocity: Mapping[str, float]) -> Motion:
    w, x, y, z = (turn[axis] for axis in "wxyz")
    heading = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return Motion(math.hypot(velocity["x"], velocity["y"]), heading)


def _by_number(name: str) -> tuple[str, int]:
    """wamv2 before wamv10."""
    stem = name.rstrip("0123456789")
    return stem, int(name[len(stem) :] or 0)
