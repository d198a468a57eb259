"""Thruster and component files as read, and the parts that they may have, with their parameters."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from vrx_mj.config.tree import Place

Kind = Literal["components", "thrusters"]


@dataclass(frozen=True)
class Instance:
    """One part that a file asks for."""

    type: str
    """Name of its macro: `wamv_camera`, `engine`, ..."""
    index: int
    """Among those of its type, from 0."""
    parameters: Mapping[str, Any]
    """The parameters in the file's order: numbers, booleans and texts; `position` and `orientation` are texts.

    Expressions are worked out, and numbers in quotes are numbers.
    """
    place: Place

    @property
    def name(self) -> str:
        """What it is called."""
        return str(self.parameters.get("name", self.parameters.get("prefix", self.parameters.get("sensor_name", ""))))


@dataclass(frozen=True)
class PartsFile:
    """A file's parts in its order; a file may be empty."""

    path: Path
    kind: Kind
    instances: tuple[Instance, ...]
    stops: tuple[str, ...] = ()
    """What VRX's own generator stops at, with its place, though the file is read here."""


Form = Literal["name", "word", "number", "switch", "triple"]
Release = Literal["classic", "jazzy"]


@dataclass(frozen=True)
class Parameter:
    """A parameter of a part's macro."""

    name: str
    form: Form
    """`name`: of a link and a topic. `triple`: three numbers in one text."""
    default: str | float | bool | None
    """None for one that must be given."""
    unit: str
    meaning: str
    release: Release | None = None
    """The only VRX that has it; None for both."""


@dataclass(frozen=True)
class PartType:
    """A type of part: a macro that a file may call."""

    name: str
    kind: Kind
    meaning: str
    parameters: tuple[Parameter, ...]
    drop: float | None = None
    """Height of the origin of a part on a post over the top of the post [m]; None: it has no post."""

    def parameter(self, name: str) -> Parameter | None:
        """The parameter of this name, if the type has it."""
        return next((each for each in self.parameters if each.name == name), None)

    def default(self, name: str) -> str | float | bool | None:
        """What a parameter is where the file does not give it; None where it must, or does not exist."""
        found = self.parameter(name)
        return found.default if found else None


def _name(default: str | None, meaning: str = "of its link, its sensor and its topic") -> Parameter:
    return Parameter("name", "name", default, "", meaning)


def _place(x: float, y: float, z: float) -> tuple[Parameter, ...]:
    return (
        Parameter("x", "number", x, "m", "forward of base_link"),
        Parameter("y", "number", y, "m", "to port of base_link"),
        Parameter("z", "number", z, "m", "above base_link, which is at keel level"),
    )


_TURN = (
    Parameter("R", "number", 0.0, "rad", "roll"),
    Parameter("P", "number", 0.0, "rad", "pitch; positive looks down"),
    Parameter("Y", "number", 0.0, "rad", "yaw; positive looks to port"),
)
_POST_YAW = Parameter("post_Y", "number", 0.0, "rad", "direction of the arm that carries it")
_POST_FOOT = Parameter("post_z_from", "number", 1.2965, "m", "height of the post's foot: the deck")

_ALL = (
    PartType(
        "wamv_camera",
        "components",
        "camera on a post, 1280 x 720, 30 pictures a second",
        (
            _name(None),
            *_place(0.5, 0.0, 1.5),
            *_TURN,
            _POST_YAW,
            Parameter("visualize", "switch", False, "", "draw the camera's view in VRX's window"),
            _POST_FOOT,
        ),
        drop=0.027,
    ),
    PartType(
        "wamv_gps",
        "components",
        "GPS receiver: fix and velocity",
        (
            _name("gps", "of its link"),
            *_place(0.3, 0.0, 1.3),
            *_TURN,
            Parameter("update_rate", "number", 15.0, "Hz", "fixes a second; 20 by default in VRX jazzy"),
        ),
    ),
    PartType(
        "wamv_imu",
        "components",
        "inertial measurement unit",
        (
            _name("imu", "of its link"),
            *_place(0.3, 0.5, 1.3),
            *_TURN,
            Parameter("update_rate", "number", 15.0, "Hz", "readings a second; 100 by default in VRX jazzy"),
        ),
    ),
    PartType(
        "lidar",
        "components",
        "scanning 3D lidar on a post",
        (
            _name(None),
            Parameter("type", "word", "16_beam", "", "16_beam or 32_beam"),
            *_place(0.7, 0.0, 1.8),
            *_TURN,
            _POST_YAW,
            _POST_FOOT,
        ),
        drop=0.05,
    ),
    PartType(
        "wamv_ball_shooter",
        "components",
        "launcher of balls",
        (
            _name("ball_shooter"),
            *_place(0.55, 0.35, 1.4),
            Parameter("pitch", "number", 0.0, "rad", "elevation of the launcher; negative is up"),
            Parameter("yaw", "number", 0.0, "rad", "heading of its base; positive to port"),
            Parameter("frameId", "word", "wamv/ball_shooter", "", "without effect"),
        ),
    ),
    PartType(
        "wamv_pinger",
        "components",
        "receiver of an acoustic pinger",
        (
            Parameter("name", "name", "pinger", "", "of its link and its topic", "classic"),
            Parameter("sensor_name", "name", "receiver", "", "of its link and its topic", "jazzy"),
            Parameter("pinger_name", "name", "pinger", "", "of the beacon, and the frame of readings", "jazzy"),
            Parameter("position", "triple", "0 0 0", "m", "x y z on the boat; in jazzy the beacon's in the world"),
            Parameter("orientation", "triple", "0 0 0", "rad", "roll pitch yaw; without effect in jazzy"),
            Parameter("frameId", "word", "wamv/pinger", "", "frame of readings; without effect in jazzy"),
        ),
    ),
    PartType(
        "wamv_p3d",
        "components",
        "ground truth of the boat's pose and velocity",
        (_name("ground_truth_odometry", "of its topic"),),
    ),
    PartType(
        "engine",
        "thrusters",
        "outboard engine: 250 N ahead, 100 N astern, steers 90 degrees either way",
        (
            Parameter("prefix", "name", None, "", "of its links, its joints and its topics"),
            Parameter("position", "triple", None, "m", "x y z of its hinge in base_link"),
            Parameter("orientation", "triple", "0 0 0", "rad", "roll pitch yaw"),
        ),
    ),
)

TYPES: dict[str, PartType] = {each.name: each for each in _ALL}
"""Every type by name, in the order in which they are listed."""

JAZZY_NAMES = frozenset({"sensor_name", "pinger_name"})
"""Parameters that only a pinger of VRX jazzy has."""

HULL_LINKS = ("base", "dummy", "left_battery", "right_battery", "cpu_cases")
"""Links of the bare hull, without their suffix `_link`."""

ELSEWHERE = {
    "wamv_3d_lidar": "VRX does not allow this macro in a component file; write 'lidar'",
    "wamv_multibeam_laser": "VRX does not allow this macro in a component file; write 'lidar'",
    "wamv_planar_lidar": "VRX does not allow a planar lidar in a component file; write 'lidar'",
    "battery": "not allowed in a component file: the boat always has its two batteries",
    "cpu_cases": "not allowed in a component file: a boat with components always has them",
}
"""What VRX has and its files may not ask for, and what to do instead."""

MISNAMED = {
    "camera": "wamv_camera",
    "gps": "wamv_gps",
    "imu": "wamv_imu",
    "p3d": "wamv_p3d",
    "pinger": "wamv_pinger",
    "ball_shooter": "wamv_ball_shooter",
    "wamv_lidar": "lidar",
    "3d_lidar": "lidar",
    "thruster": "engine",
    "engines": "engine",
}
"""Names of types that come to mind, and the right ones."""

FIXED = {
    "wamv_camera": ("update_rate", "rate", "width", "height", "fov", "horizontal_fov", "noise"),
    "lidar": ("update_rate", "vertical_lasers", "samples", "resolution", "min_angle", "max_angle",
              "min_vertical_angle", "max_vertical_angle", "max_range", "noise_stddev"),
}  # fmt: skip
"""What one may want to set and VRX does not let a file set, by type."""
