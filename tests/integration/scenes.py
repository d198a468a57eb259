"""Made-up waters for controllers: a boat of few equations, with lidar, camera and receiver, among boxes and panels."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np

PAINT = {
    "red": (202, 1, 7), "orange": (253, 48, 0), "green": (16, 112, 66), "blue": (0, 0, 255), "yellow": (255, 255, 0),
    "white": (245, 245, 245), "black": (5, 5, 5), "grey": (150, 150, 150),
}  # fmt: skip
LIDAR, CAMERA = np.array([0.7, 0.0, 1.8]), np.array([0.75, 0.1, 1.5])
"""Places of the sensors on the boat [m]."""
PICTURE = (640, 360, 380.0)
"""Width and height of a picture, and its focal length [pixels]."""


@dataclass
class Engine:
    """A thruster whose command is its force."""

    position: tuple[float, float, float]
    direction: tuple[float, float, float] = (1.0, 0.0, 0.0)
    max_angle: float = 0.0
    max_forward: float = 250.0
    max_reverse: float = -100.0

    def command(self, force):
        return force


SIN = math.sqrt(0.5)
STEERED = {"left": Engine((-2.65, 1.03, 0.0), max_angle=1.57), "right": Engine((-2.65, -1.03, 0.0), max_angle=1.57)}
LATERAL = {
    "left": Engine((-2.65, 1.03, 0.0)), "right": Engine((-2.65, -1.03, 0.0)),
    "lateral": Engine((0.0, -0.28, 0.0), (0.0, 1.0, 0.0)),
}  # fmt: skip
TWIN = {name: LATERAL[name] for name in ("left", "right")}
CORNERS = {
    "left_rear": Engine((-2.57, 0.83, 0.0), (SIN, SIN, 0.0)),
    "right_rear": Engine((-2.57, -0.83, 0.0), (SIN, -SIN, 0.0)),
    "left_front": Engine((1.4, 0.9, 0.0), (SIN, -SIN, 0.0)),
    "right_front": Engine((1.4, -0.9, 0.0), (SIN, SIN, 0.0)),
}


@dataclass
class Thing:
    """A box that stands in the water, or a panel that faces somewhere, with what is painted on it."""

    x: float
    y: float
    color: str = "grey"
    width: float = 0.6
    bottom: float = -0.2
    top: float = 1.0
    facing: float | None = None
    """Direction in which a panel looks [rad]; None of a box, which looks alike from everywhere."""
    symbol: str = ""
    lamps: Sequence[str] = ()
    """What a light above it shows, a second each."""
    until: float = math.inf
    """When it is gone [s]."""
    since: float = 0.0
    """When it comes up [s]."""

    def returns(self) -> np.ndarray:
        """What a lidar sees of it, (n, 3) [m]."""
        heights = np.linspace(self.bottom, self.top, 5)
        if self.facing is None:
            angles = np.arange(0.0, math.tau, math.tau / 6)
            across = 0.5 * self.width * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        else:
            across = np.linspace(-0.5, 0.5, 13)[:, None] * self.width * (-math.sin(self.facing), math.cos(self.facing))
        level = np.repeat(across + np.array([self.x, self.y]), len(heights), axis=0)
        points = np.column_stack([level, np.tile(heights, len(across))])
        return points + np.random.default_rng(len(points)).normal(0.0, 0.02, points.shape)

    def boxes(self, eye: np.ndarray, t: float) -> list[tuple[str, float, float, float]]:
        """What a camera sees of it: colour, width, bottom and top [m], one box upon the other."""
        painted = [(self.color, self.width, self.bottom, self.top)]
        if self.symbol and (eye[0] - self.x) * math.cos(self.facing) + (eye[1] - self.y) * math.sin(self.facing) > 0.0:
            color, shape = self.symbol.split("_")
            rows = np.linspace(-0.5, 0.5, 21)
            wide = {
                "circle": np.sqrt(0.25 - rows**2) * 2.0, "rectangle": np.full(21, 0.75),
                "cross": np.where(abs(rows) < 0.17, 1.0, 0.33), "triangle": 0.5 - rows,
            }[shape]  # fmt: skip
            painted += [(color, wide[i] + 0.01, 1.9 + rows[i] - 0.025, 1.9 + rows[i] + 0.026) for i in range(21)]
        if self.lamps:
            painted.append(("yellow", 0.3, 0.8, 1.0))
            lamp = [*self.lamps, "", ""][int(t % (len(self.lamps) + 2))]
            painted += [(lamp, 0.2, 1.45, 1.8)] if lamp else []
        return painted


@dataclass
class Vessel:
    """A boat whose sensors see the things, and whose mass its engines push."""

    things: Sequence[Thing] = ()
    thrusters: dict[str, Engine] = field(default_factory=lambda: LATERAL)
    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0
    wind: tuple[float, float] = (0.0, 0.0)
    """What else pushes it [N]."""
    beacon: Callable[[float], tuple[float, float, float]] | None = None
    """Where a beacon is at a time [s]."""
    anchored: bool = False
    """Whether it stays where it is, whatever its engines do."""

    def __post_init__(self) -> None:
        self.surge = self.sway = self.turn = 0.0
        self.x, self.y, self.heading = (
            self.x + 0.1234,
            self.y - 0.0567,
            self.heading + 0.0123,
        )  # nothing lies on a border
        self.returns = [(thing, thing.returns()) for thing in self.things]

    def rotation(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Orientation, body to east-north-up, as a quaternion and as a matrix (3, 3): it pitches a little."""
        half, c, s = 0.01 * math.sin(t + 0.1), math.cos(self.heading), math.sin(self.heading)
        a, b, q, p = math.cos(self.heading / 2), math.sin(self.heading / 2), math.cos(half), math.sin(half)
        level = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        pitch = np.array(
            [[math.cos(2 * half), 0, math.sin(2 * half)], [0, 1, 0], [-math.sin(2 * half), 0, math.cos(2 * half)]]
        )
        return np.array([a * q, -b * p, a * p, b * q]), level @ pitch

    def observation(self, t: float) -> SimpleNamespace:
        """What the boat observes at a time [s]; clouds and pictures are made when somebody looks at them."""
        quaternion, rotation = self.rotation(t)
        here = np.array([self.x, self.y, 0.0])
        width, height, focal = PICTURE
        matrix = (focal, 0.0, width / 2, 0.0, focal, height / 2, 0.0, 0.0, 1.0)
        sensors = {
            "lidar": SimpleNamespace(data=_Cloud(self, here, rotation, t), mount=_mount(LIDAR)),
            "front": SimpleNamespace(
                data=_Picture(self, here, rotation, t, SimpleNamespace(K=matrix)), mount=_mount(CAMERA)
            ),
        }
        if self.beacon is not None:
            heard = math.floor(t)
            away = rotation.T @ (np.array(self.beacon(heard)) - here)
            noise = np.random.default_rng(heard).normal(size=3) * (1.0, 0.01, 0.01)
            sound = SimpleNamespace(
                range=float(np.linalg.norm(away) + noise[0]),
                bearing=float(math.atan2(away[1], away[0]) + noise[1]),
                elevation=float(math.atan2(away[2], math.hypot(away[0], away[1])) + noise[2]),
            )
            sensors["pinger"] = SimpleNamespace(data=sound, time=float(heard), sequence=heard)
        return SimpleNamespace(
            sensors=sensors,
            thrusters=self.thrusters,
            position=here,
            quaternion=quaternion,
            velocity=rotation.T @ self._velocity(),
            angular_velocity=rotation.T @ (0.0, 0.0, self.turn),
        )

    def move(self, commands: dict[str, float], interval: float, steps: int = 3) -> None:
        """Go on for an interval [s]: mass, drag, thrusters within their limits, and wind."""
        surge = sway = yaw = 0.0
        for name, engine in self.thrusters.items():
            force = min(max(commands.get(name, 0.0), engine.max_reverse), engine.max_forward)
            angle = math.atan2(engine.direction[1], engine.direction[0]) + commands.get(f"{name}_angle", 0.0)
            ahead, left = force * math.cos(angle), force * math.sin(angle)
            surge, sway = surge + ahead, sway + left
            yaw += (engine.position[0] + 0.25) * left - engine.position[1] * ahead
        step = interval / steps
        for _ in range(0 if self.anchored else steps):
            c, s = math.cos(self.heading), math.sin(self.heading)
            ahead = surge + self.wind[0] * c + self.wind[1] * s - (51.3 + 72.4 * abs(self.surge)) * self.surge
            left = sway + self.wind[1] * c - self.wind[0] * s - 40.0 * self.sway
            spun = self.turn
            self.surge, self.sway = (
                self.surge + step * (ahead / 299.0 + spun * self.sway),
                self.sway + step * (left / 299.0 - spun * self.surge),
            )
            self.turn += step * (yaw - 400.0 * spun) / 780.0
            east, north, _ = self._velocity()
            self.x, self.y, self.heading = (
                self.x + step * east, self.y + step * north, self.heading + step * self.turn
            )  # fmt: skip

    def _velocity(self) -> np.ndarray:
        c, s = math.cos(self.heading), math.sin(self.heading)
        return np.array([self.surge * c - self.sway * s, self.surge * s + self.sway * c, 0.0])

    def there(self, t: float) -> list[tuple[Thing, np.ndarray]]:
        """The things that are up at a time [s], and their returns."""
        return [(thing, returns) for thing, returns in self.returns if thing.since <= t < thing.until]


def _mount(position: np.ndarray) -> SimpleNamespace:
    return SimpleNamespace(position=position, rotation=np.eye(3))


@cache
def _water(width: int, height: int) -> np.ndarray:
    """A picture of nothing but water, darker below."""
    rows = np.linspace(1.25, 0.75, height)[:, None, None]
    return np.broadcast_to(rows * (60, 100, 125), (height, width, 3)).astype(np.uint8)


@dataclass
class _Cloud:
    vessel: Vessel
    here: np.ndarray
    rotation: np.ndarray
    t: float

    @property
    def points(self) -> np.ndarray:
        there = [returns for _, returns in self.vessel.there(self.t)]
        return (np.concatenate(there) - self.here) @ self.rotation - LIDAR if there else np.empty((0, 3))


@dataclass
class _Picture:
    vessel: Vessel
    here: np.ndarray
    rotation: np.ndarray
    t: float
    info: SimpleNamespace

    @property
    def rgb(self) -> np.ndarray:
        width, height, focal = PICTURE
        picture = _water(width, height).copy()
        seen, upright = [], float(self.rotation[2, 2])
        for thing, _ in self.vessel.there(self.t):
            ahead, left, base = (self.rotation.T @ ((thing.x, thing.y, 0.0) - self.here) - CAMERA).tolist()
            if ahead > 2.0 and abs(left) < 1.2 * ahead:
                seen.append((ahead, left, base, thing))
        for ahead, left, base, thing in sorted(seen, key=lambda one: -one[0]):
            scale = focal / ahead
            column = width / 2 - scale * left
            for color, wide, bottom, top in thing.boxes(self.here, self.t):
                first, last = (max(0, round(column + way * wide / 2 * scale)) for way in (-1, 1))
                start, end = (max(0, round(height / 2 - (base + upright * up) * scale)) for up in (top, bottom))
                picture[start:end, first:last] = PAINT[color]
        return picture


def played(
    controller: Callable[[Any, float], dict[str, Any]],
    vessel: Vessel,
    task: dict[str, Any] | Callable[[float, dict[str, Any]], dict[str, Any]],
    seconds: float,
    *,
    interval: float = 0.25,
) -> list[dict[str, Any]]:
    """All that a controller commands in a scene, and the messages that it sends, call by call.

    By default times are whole quarters of seconds, so that some lie just where a controller's patience ends.
    """
    sent, told = list[dict[str, Any]](), dict[str, Any]()
    for number in range(round(seconds / interval)):
        t = number * interval
        state = task(t, told) if callable(task) else task
        sent.append(controller({"wamv": vessel.observation(t), "task": state}, t))
        told |= sent[-1].get("task", {})
        vessel.move(sent[-1]["wamv"], interval)
    return sent
