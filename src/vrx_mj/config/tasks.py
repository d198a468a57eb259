"""Tasks: what a world asks of a boat and how it is scored, with VRX's values where a file gives none."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import Field, model_validator

from vrx_mj.config.base import Config, Faults, exclusive
from vrx_mj.config.docks import Colors, Symbol
from vrx_mj.config.values import Cartesian, Geodetic, NonNegative, NotEmpty, NumberOf, Pose, Switch, Vec3, demand
from vrx_mj.model import tasks
from vrx_mj.model.kinds import Latitude

Gate = Annotated[
    tuple[str, ...],
    demand(lambda gate: len(gate) == 2, "expected two names [left, right], got {}"),
    demand(lambda gate: gate[0] != gate[1], "a gate has two sides, got {}"),
]
_Buffer = Annotated[float, NumberOf(tasks.TaskBase, "collision_buffer")]
_DOCKS: dict[str, dict[str, Any]] = {
    "dock": {"enable_color_checker": False},
    "scan_dock_deliver": {"dock_bonus_points": 15.0, "correct_dock_bonus_points": 5.0},
}


class ShownObject(Config):
    """An object that appears in front of the boat for a while."""

    time: Annotated[float, NumberOf(tasks.ShownObject, "time")]
    duration: Annotated[float, NumberOf(tasks.ShownObject, "duration")] = 5.0
    type: str | None = None
    """Type in a correct report; by default its model."""
    name: str
    """Name of the object in the world, where it waits elsewhere."""
    pose: Pose
    """Pose relative to the boat [m, rad], in a frame that turns with the boat's yaw only."""


class ChannelConfig(Config):
    """A channel of gates, and the penalty for collisions in it."""

    course: str | None = None
    """Object whose parts form the gates; by default the world itself."""
    gates: tuple[Gate, ...] = ()
    """Names of [left, right] buoys in the order of crossing, with the left one to starboard; by default red_bound_i and
    its partner."""
    obstacle_penalty: Annotated[float, NumberOf(tasks.Channel, "obstacle_penalty")] = 10.0
    collision_buffer: _Buffer = 10.0


class BaySign(Config):
    """The symbol of a bay's placard, and whether the bay is the correct one."""

    name: str | None = None
    """Name of the dock's bay; bays come in the dock's order."""
    symbol: Symbol
    """Symbol on the bay's placard at the start."""
    dock_allowed: Switch = False
    """Whether this is the correct bay."""


class TargetConfig(Config):
    """Points for balls in a hole."""

    bay: Annotated[int, Field(ge=1)]
    """Number of the bay, from 1."""
    size: Literal["big", "small"]
    """Size of the hole in the bay's placard."""
    points: Annotated[float, NumberOf(tasks.Hole, "points")]


class AnimalConfig(Config):
    """An animal and the required behaviour near it."""

    name: str
    """Name of the object in the world."""
    goal: tasks.Habit | None = None
    """Required behaviour near it; by default that of its model: avoid a crocodile, circle a platypus clockwise, a
    turtle counterclockwise."""


class TaskConfig(Config):
    """Keys of all tasks."""

    held: ClassVar[bool] = False
    """Whether the boat is held throughout."""
    type: str
    """Type of the task."""
    name: str = ""
    """VRX's task_name; by default the type."""
    boat: str | None = None
    """The boat that is scored; by default the fleet's first."""
    initial_state_duration: NonNegative = 10.0
    """Time for which the boat is held at the start [s]."""
    ready_state_duration: NonNegative = 10.0
    """Time for which the boat is free before the run counts [s]."""
    running_state_duration: NonNegative = 300.0
    """Maximum duration of the run [s]."""
    collision_buffer: _Buffer = 3.0
    locked: Switch = True
    """Whether the boat is held in surge, sway and yaw until the task is ready."""

    @property
    def geodetic(self) -> tuple[str, ...]:
        """Keys that were given in latitude and longitude, by their types."""
        fields = type(self).model_fields.items()
        return tuple(key for key, field in fields if getattr(self, key) and _is_geodetic(field.annotation))


class GoalConfig(Config):
    """A pose in one of two frames."""

    goal: Geodetic | None = None
    """Latitude, longitude [degrees] and yaw [rad, from east] to hold."""
    goal_cart: Cartesian | None = None
    """Pose to hold as x, y [m] and yaw [rad, from x] in the world frame."""

    def _faults(self) -> Faults:
        return exclusive(self, "goal", "goal_cart", required=True)


class StationkeepingTask(GoalConfig, TaskConfig):
    """Hold a pose."""

    type: Literal["stationkeeping", "station_keeping"]
    heading: Switch = True
    """Whether the yaw counts."""


class WayfindingTask(TaskConfig):
    """Visit poses in any order."""

    type: Literal["wayfinding"]
    waypoints: Annotated[tuple[Geodetic, ...], NotEmpty] | None = None
    """Latitude, longitude [degrees] and yaw [rad, from east] of each."""
    waypoints_cart: Annotated[tuple[Cartesian, ...], NotEmpty] | None = None
    """Poses to visit as x, y [m] and yaw [rad, from x] in the world frame."""

    def _faults(self) -> Faults:
        return exclusive(self, "waypoints", "waypoints_cart", required=True)


class PerceptionTask(TaskConfig):
    """Locate and identify objects that appear in front of the boat, which is held throughout."""

    held: ClassVar[bool] = True
    type: Literal["perception"]
    objects: Annotated[tuple[ShownObject, ...], NotEmpty]
    """Objects that appear: time, duration, type, name and pose of each."""
    loop_forever: Switch = False
    """Whether the sequence starts again when all objects are gone."""


class NavigationTask(ChannelConfig, TaskConfig):
    """Pass the gates of a channel in order."""

    type: Literal["navigation_course"]


class FollowPathTask(ChannelConfig, TaskConfig):
    """Pass the gates of a channel. Some may be left out."""

    type: Literal["follow_path"]
    points_per_gate_crossed: Annotated[float, NumberOf(tasks.FollowPath, "points_per_gate_crossed")] = 10.0
    bonus: Annotated[float, NumberOf(tasks.FollowPath, "bonus")] = 1.0
    obstacle_penalty: Annotated[float, NumberOf(tasks.FollowPath, "obstacle_penalty")] = 3.0


class DockTask(TaskConfig):
    """Dock in the bay that the light buoy and the placards indicate, and deliver balls through holes."""

    type: Literal["dock", "scan_and_dock", "scan_dock_deliver"]
    dock: str
    """Name of the dock: an object or an entry of `docks`."""
    bays: Annotated[tuple[BaySign, ...], NotEmpty]
    """The dock's bays in its order: name, symbol and dock_allowed of each."""
    light_buoy: str | None = None
    """Name of the light buoy."""
    color_sequence: Colors = ("red", "green", "blue")
    """Colours of the light buoy, which must be reported."""
    color_bonus_points: Annotated[float, NumberOf(tasks.Dock, "color_bonus_points")] = 10.0
    dock_bonus_points: Annotated[float, NumberOf(tasks.Dock, "dock_bonus_points")] = 10.0
    """Points for docking [points]; by default 15 in scan_dock_deliver."""
    correct_dock_bonus_points: Annotated[float, NumberOf(tasks.Dock, "correct_dock_bonus_points")] = 10.0
    """Bonus for docking in the correct bay [points]; by default 5 in scan_dock_deliver."""
    enable_color_checker: Switch = True
    """Whether a report of the colours is accepted; by default not in dock."""
    min_dock_time: Annotated[float, NumberOf(tasks.Dock, "min_dock_time")] = 10.0
    targets: tuple[TargetConfig, ...] | None = None
    """Points of holes; by default in scan_dock_deliver all holes of the dock: 5 points for a big one, 10 for a small
    one."""

    @model_validator(mode="before")
    @classmethod
    def _defaults_of_its_type(cls, data: object) -> object:
        if not isinstance(data, Mapping):
            return data
        return {**_DOCKS.get(data.get("type", ""), {}), **data}


class WildlifeTask(TaskConfig):
    """Keep away from some animals and circle others."""

    type: Literal["wildlife"]
    collision_buffer: _Buffer = 10.0
    animals: tuple[AnimalConfig, ...] = ()
    """Name and goal of each; by default all animals of the world."""
    engagement_distance: Annotated[float, NumberOf(tasks.Wildlife, "engagement_distance")] = 10.0
    time_bonus: Annotated[float, NumberOf(tasks.Wildlife, "time_bonus")] = 30.0
    publication_rate: Annotated[float | None, NumberOf(tasks.Wildlife, "publication_rate")] = None


class GymkhanaTask(TaskConfig):
    """Pass a channel, then find a beacon behind obstacles."""

    type: Literal["gymkhana"]
    channel: ChannelConfig
    """Its course, gates, obstacle_penalty and collision_buffer."""
    pinger: Vec3
    """x, y, z of the beacon [m]."""
    obstacle_penalty: Annotated[float, NumberOf(tasks.Gymkhana, "obstacle_penalty")] = 1.0


class AcousticPerceptionTask(TaskConfig):
    """Reach a beacon under water."""

    type: Literal["acoustic_perception"]
    pinger: Vec3
    """x, y, z of the beacon [m]."""
    goal_tolerance: Annotated[float, NumberOf(tasks.AcousticPerception, "goal_tolerance")] = 3.0


class AcousticTrackingTask(TaskConfig):
    """Follow a moving beacon."""

    type: Literal["acoustic_tracking"]
    pinger: str
    """Name of the object that carries the beacon."""
    pinger_depth: Annotated[float, NumberOf(tasks.AcousticTracking, "pinger_depth")] = 2.0
    obstacle_penalty: Annotated[float, NumberOf(tasks.AcousticTracking, "obstacle_penalty")] = 1.0


def _is_geodetic(hint: object) -> bool:
    """Whether values of a type hold a latitude."""
    return hint is Latitude or any(map(_is_geodetic, get_args(hint)))


_AnyTask = (
    StationkeepingTask
    | WayfindingTask
    | PerceptionTask
    | NavigationTask
    | FollowPathTask
    | DockTask
    | WildlifeTask
    | GymkhanaTask
    | AcousticPerceptionTask
    | AcousticTrackingTask
)
"""A task of any type."""
Task = Annotated[_AnyTask, Field(discriminator="type")] | None
"""A task of any type, read by its type; None for none."""
TASKS: Mapping[str, type[TaskConfig]] = {
    name: model
    for model in get_args(_AnyTask)
    for name in get_args(model.model_fields["type"].annotation)
    if name != "station_keeping"  # another name of stationkeeping
}
"""Models of the tasks, by type."""
