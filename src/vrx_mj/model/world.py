"""The whole of a compiled world but for its MJCF, and its form in JSON."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass, replace
from functools import cache
from typing import Annotated, Any, Final, Literal, get_args, get_origin, get_type_hints

import pydantic
from pydantic import BaseModel, TypeAdapter

from vrx_mj.config.values import Seed
from vrx_mj.constants import LONGEST_STEP, SHORTEST_STEP
from vrx_mj.frames import compass
from vrx_mj.model.afloat import Block, Element, Float, Follower, Mooring, PathPoint, Rope
from vrx_mj.model.boats import Boat, Hull, Sensor, Spawn, Station, Thruster
from vrx_mj.model.kinds import LEFT_OUT, Angle, Count, NonNegative, Pose, Real, RowOf, Text, record
from vrx_mj.model.site import Dock, Georeference, Light, Marker, Object, Placard, Ring, Scene
from vrx_mj.model.tasks import Task
from vrx_mj.model.water import Air, Current, Sea, Wind

FORMAT: Final = 4
"""Version of the saved form."""
FORMER: Final = 3
"""Version that had no pieces, which is read too."""
MOST_BYTES = 200_000_000
"""Bytes of the largest file of a saved world that is read."""


@record
class Parameters:
    """Tables and names that belong to an MJCF."""

    format: Literal[3, 4]
    """Version of the saved form."""
    name: Text
    """Name of the world."""
    fleet: Text
    """Name of the fleet."""
    description: Annotated[str, pydantic.Field(max_length=10_000)]
    """Description of the world."""
    seed: Seed
    """Default seed of a run."""
    profile: Literal["vrx", "vrx3", "marine"]
    """Profile of physics."""
    timestep: Annotated[float, pydantic.Field(ge=SHORTEST_STEP, le=LONGEST_STEP)]
    """Physics step [s]."""
    gravity: NonNegative
    """Gravity, downwards [m/s2]."""
    at_base_link: tuple[Literal["gps", "imu", "pinger"], ...]
    """Sensors that measure at the origin of `base_link`."""
    sea: Sea
    """The waves."""
    current: Current | None = field(default=None, metadata=LEFT_OUT)
    """The current."""
    wind: Wind
    """The wind."""
    air: Air | None = field(default=None, metadata=LEFT_OUT)
    """Profile over height and gusts of the wind in profile `marine`."""
    hulls: tuple[Hull, ...]
    """Hulls of the boats, in their order."""
    stations: tuple[Station, ...]
    """Stations of the hulls."""
    thrusters: tuple[Thruster, ...]
    """Thrusters of the hulls."""
    floats: tuple[Float, ...]
    """Floating objects, in the order of `objects`."""
    links: tuple[Float, ...] = field(default=(), metadata=LEFT_OUT)
    """Links of objects that have joints: all but those that never move, in the order of `objects`."""
    elements: tuple[Element, ...]
    """Shapes of floating objects and blocks that displace water."""
    blocks: tuple[Block, ...]
    """Blocks of floating docks, in the order of `docks`."""
    moorings: tuple[Mooring, ...]
    """Lines that hold blocks."""
    ropes: tuple[Rope, ...] = field(default=(), metadata=LEFT_OUT)
    """Lines that hold floating objects."""
    followers: tuple[Follower, ...] = ()
    """Controllers that drive floating objects along paths."""
    path_points: tuple[PathPoint, ...] = ()
    """Waypoints of the followers."""
    lights: tuple[Light, ...] = ()
    """Light buoys."""
    sensors: tuple[Sensor, ...]
    """Sensors of the boats."""
    boats: tuple[Boat, ...]
    """The boats."""
    spawn: Spawn = field(default_factory=Spawn)
    """Defaults of boats that join later."""
    objects: tuple[Object, ...]
    """The objects."""
    docks: tuple[Dock, ...]
    """The docks."""
    placards: tuple[Placard, ...] = ()
    """Placards of the docks."""
    task: Task | None
    """The task."""
    waypoints: tuple[tuple[Real, Real, Angle], ...]
    """The task's goal or waypoints: x, y [m], yaw [rad]."""
    markers: tuple[Marker, ...] = ()
    """Cylinders that mark places in pictures."""
    georeference: Georeference | None
    """Geodetic position of the origin."""
    terrain: Text | None
    """Name of the terrain."""
    shoreline: tuple[Ring, ...]
    """The waterline as rings."""
    scene: Scene
    """Options of renderers."""
    camera: Pose | None = None
    """Pose from which a viewer looks at first [m, rad]."""
    lives: Mapping[Text, Count] = field(default_factory=dict, metadata=LEFT_OUT)
    """Number of boats that a name had before, for those that left."""

    @property
    def has_random_loads(self) -> bool:
        """Whether a run's seed draws what moves boats: waves, gusts, the wind's direction or the current."""
        air, current = self.air, self.current
        wind = self.wind.gain or (air is not None and (air.spread or air.gust_frequencies))
        return bool(self.sea.random or wind or (current is not None and current.gain))

    @property
    def x_from_east(self) -> float:
        """Direction of the x axis [rad], counter-clockwise from east; 0 without a georeference."""
        return self.georeference.x_from_east if self.georeference else 0.0

    def compass(self, angle: float) -> float:
        """Compass degrees, clockwise from true north, of an angle [rad] counter-clockwise from x."""
        return compass(angle + self.x_from_east)

    def thrusters_of(self, boat: str) -> tuple[Thruster, ...]:
        """The thrusters and rudders of a boat."""
        hull = next(index for index, own in enumerate(self.boats) if own.name == boat)
        return tuple(thruster for thruster in self.thrusters if thruster.hull == hull)


@cache
def row_columns() -> Mapping[str, Mapping[str, RowOf]]:
    """Columns that are numbers of rows, by table."""
    found: dict[str, dict[str, RowOf]] = {}
    for table, kind in get_type_hints(Parameters, include_extras=True).items():
        row = get_args(kind)[0] if get_origin(kind) is tuple else None
        marked = (
            (own.name, getattr(own.type, "__metadata__", ())) for own in (fields(row) if is_dataclass(row) else ())
        )
        if columns := {name: mark for name, marks in marked for mark in marks if isinstance(mark, RowOf)}:
            found[table] = columns
    return found


def linked_rows(world: Parameters) -> Iterator[tuple[str, int, str, RowOf, range]]:
    """All that refers to rows: its table, row and column, and the numbers of these rows with their table."""
    for table, columns in row_columns().items():
        for number, row in enumerate(getattr(world, table)):
            for column, mark in columns.items():
                first, stem = getattr(row, column), column.removesuffix("_start")
                if first >= 0:
                    count = 1 if stem == column else getattr(row, f"{stem}_count")
                    yield table, number, column, mark, range(first, first + count)


@cache
def _adapter() -> TypeAdapter[Parameters]:
    return TypeAdapter(Parameters)


def parameters_of(text: bytes) -> Parameters:
    """The parameters in a JSON text.

    Raises:
        ValidationError: it is not JSON, a key is missing, unknown or of the wrong kind, or a number is out of range.
        ValueError: a key is given twice, or the text is too long.
    """
    if len(text) > MOST_BYTES:
        raise ValueError(f"{len(text):,} bytes; at most {MOST_BYTES:,} are read")
    parameters = _adapter().validate_json(text)
    json.loads(text, object_pairs_hook=_each_once)
    return parameters


def checked_parameters(parameters: Parameters) -> Parameters:
    """The parameters, held to what `parameters_of` holds a text to.

    Raises:
        ValidationError: a value is of the wrong kind, or a number is out of range.
    """
    return _adapter().validate_python(parameters)


def checked_rows(rows: Mapping[str, tuple[object, ...]]) -> dict[str, tuple[Any, ...]]:
    """Rows of some tables of a world, held to the same.

    Raises:
        ValidationError: a value is of the wrong kind, or a number is out of range.
    """
    return {table: _table(table).validate_python(own) for table, own in rows.items()}


@cache
def _table(name: str) -> TypeAdapter[Any]:
    return TypeAdapter(get_type_hints(Parameters, include_extras=True)[name])


def json_of(parameters: Parameters) -> str:
    """The text from which `parameters_of` makes the same parameters again."""
    return json.dumps(tree_of(parameters), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def without_descriptions(parameters: Parameters) -> Parameters:
    """The parameters without the URDFs of the boats, which nothing but a program of ROS reads."""
    return replace(parameters, boats=tuple(replace(boat, description="") for boat in parameters.boats))


def tree_of(value: object) -> Any:
    """Parameters, or a part of them, as what JSON is made of: mappings, lists, texts and numbers."""
    if isinstance(value, tuple | list):
        return [tree_of(item) for item in value]
    if isinstance(value, Mapping):
        return {key: tree_of(item) for key, item in value.items()}
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    if not is_dataclass(value):
        return value
    pairs = ((own, getattr(value, own.name)) for own in _json_fields(value.__class__))
    return {own.name: tree_of(item) for own, item in pairs if not _left_out(own, item)}


@cache
def _json_fields(kind: type) -> tuple[Field[Any], ...]:
    """The fields of a dataclass in the order in which JSON has them."""
    return tuple(sorted(fields(kind), key=lambda own: own.metadata.get("rank", 0)))


def _left_out(own: Field[object], value: object) -> bool:
    default = own.default if own.default_factory is MISSING else own.default_factory()
    return "left_out" in own.metadata and bool(value == default)


def format_of(text: bytes) -> object:
    """The version that a JSON text of any version gives.

    Raises:
        ValidationError: it gives none.
    """
    return _VERSIONED.validate_json(text).format


@dataclass(frozen=True)
class _Versioned:
    """Any version of the saved form."""

    format: Any


_VERSIONED = TypeAdapter(_Versioned)


def _each_once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """A JSON object's keys and values; readers differ about a key that is given twice."""
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"the key '{next(key for key in found if keys.count(key) > 1)}' is given twice")
    return found
