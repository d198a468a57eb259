"""The whole of a compiled world except its MJCF, its form in JSON, and the check that its tables fit each other."""

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass, replace
from functools import cache
from itertools import chain, pairwise
from typing import Annotated, Any, Final, Literal, get_args, get_origin, get_type_hints

import pydantic
from pydantic import BaseModel, TypeAdapter

from vrx_mj.config.sensors import SensorConfig
from vrx_mj.constants import PHYSICS_VERSION
from vrx_mj.frames import compass
from vrx_mj.model import kinds, tasks
from vrx_mj.model.boats import Boat, Hull, Spawn, Station, Thruster
from vrx_mj.model.kinds import Angle, Count, Matrix, NonNegative, Pose, Real, RowOf, Seed, Text, Vec3, left_out, record
from vrx_mj.model.things import (
    Block,
    Dock,
    Element,
    Float,
    Follower,
    Georeference,
    Light,
    Marker,
    Mooring,
    Object,
    PathPoint,
    Placard,
    Ring,
    Rope,
    Scene,
)
from vrx_mj.model.water import Air, Current, Sea, Wind
from vrx_mj.physics.tables import SAIL

FORMAT: Final = 4
"""Version of the saved form."""
FORMER: Final = 3
"""Version that had no pieces, which is read too."""
MOST_BYTES = 200_000_000
"""Bytes of the largest file of a saved world that is read."""
_FLOATING = "floating"


@record
class Sensor:
    """A sensor on a boat."""

    boat: Text
    """Name of the boat."""
    body: Text
    """Name of the MJCF's body that carries it."""
    position: Vec3
    """Place in that body [m]."""
    rotation: Matrix
    """Axes of the sensor in that body's axes."""
    frame: Text
    """Name of the frame of its readings."""
    config: SensorConfig
    """Type, rate, errors, and the pose on its boat."""

    @property
    def name(self) -> str:
        """Name of the sensor on its boat."""
        return self.config.name

    @property
    def type(self) -> str:
        """Kind of sensor: `camera`, `gps`, `ball_shooter`..."""
        return self.config.type


@record
class Parameters:
    """Tables and names that belong to an MJCF."""

    format: Annotated[int, pydantic.Field(ge=3, le=4)]
    """Version of the saved form."""
    physics_version: Count = left_out(default=1)
    """`constants.PHYSICS_VERSION` that compiled it."""
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
    timestep: kinds.Step
    """Physics step [s]."""
    gravity: NonNegative
    """Gravity, downwards [m/s2]."""
    at_base_link: kinds.AtBaseLink
    """Sensors that measure at the origin of `base_link`."""
    sea: Sea
    """The waves."""
    current: Current | None = left_out(default=None)
    """The current."""
    wind: Wind
    """The wind."""
    air: Air | None = left_out(default=None)
    """Profile over height and gusts of the wind in profile `marine`."""
    hulls: tuple[Hull, ...]
    """Hulls of the boats, in their order."""
    stations: tuple[Station, ...]
    """Stations of the hulls."""
    thrusters: tuple[Thruster, ...]
    """Thrusters of the hulls."""
    floats: tuple[Float, ...]
    """Floating objects, in the order of `objects`."""
    links: tuple[Float, ...] = left_out(default=())
    """Links of objects that have joints: all but those that never move, in the order of `objects`."""
    elements: tuple[Element, ...]
    """Shapes of floating objects and blocks that displace water."""
    blocks: tuple[Block, ...]
    """Blocks of floating docks, in the order of `docks`."""
    moorings: tuple[Mooring, ...]
    """Lines that hold blocks."""
    ropes: tuple[Rope, ...] = left_out(default=())
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
    task: tasks.Task | None
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
    lives: Mapping[Text, Count] = left_out(default_factory=dict)
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


def checked_rows(rows: Mapping[str, tuple[object, ...]]) -> dict[str, tuple[object, ...]]:
    """Rows of some tables of a world, held to the same.

    Raises:
        ValidationError: a value is of the wrong kind, or a number is out of range.
    """
    return {table: _table(table).validate_python(own) for table, own in rows.items()}


@cache
def _table(name: str) -> TypeAdapter[Any]:
    return TypeAdapter(get_type_hints(Parameters, include_extras=True)[name])


def json_entries(values: Parameters | Mapping[str, object]) -> dict[str, str]:
    """JSON texts of the entries of parameters, or of some of them by name, for `joined_entries`."""
    tree = tree_of(values).items()
    return {key: json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False) for key, value in tree}


def joined_entries(entries: Mapping[str, str]) -> str:
    """The text of all entries of parameters, of which `parameters_of` makes the same parameters again."""
    lines = (f'"{key}": {text}'.replace("\n", "\n ") for key, text in entries.items())
    return "{\n " + ",\n ".join(lines) + "\n}\n"


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


def other_physics(version: object) -> str | None:
    """Remark on a run of another version of the physics than this one; None for this one."""
    if version == PHYSICS_VERSION:
        return None
    return f"of physics version {version}, and this is {PHYSICS_VERSION}: equal runs differ"


@dataclass(frozen=True)
class _SavedVersion:
    """Any version of the saved form."""

    format: Any


_VERSIONED = TypeAdapter(_SavedVersion)


def _each_once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """A JSON object's keys and values; readers differ about a key that is given twice."""
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"the key '{next(key for key in found if keys.count(key) > 1)}' is given twice")
    return found


_Spans = Iterable[tuple[int, int]]


def broken_references(world: Parameters) -> Iterator[str]:
    """Faults of references, each with its place; none if all fit."""
    floating = [item for item in world.objects if item.kind == _FLOATING]
    for table, things, kind in (("hulls", world.boats, "boats"), ("floats", floating, "floating objects")):
        if (count := len(getattr(world, table))) != len(things):
            yield f"{table}: {count} rows for {len(things)} {kind}"
    for table, number, column, mark, rows in linked_rows(world):
        size = len(getattr(world, mark.table))
        if rows.stop > size:
            yield f"{table}[{number}].{column}: there is no row {rows.stop - 1} among {size} {mark.table}"
    yield from _boats(world)
    yield from _floating_faults(world)
    yield from _blocks(world)
    yield from _unique(world)
    if world.task is not None:
        yield from _task(world, world.task)


def _boats(world: Parameters) -> Iterator[str]:
    spans = [("station", world.stations), ("thruster", world.thrusters)]
    for kind, rows in spans:
        owned = [(getattr(hull, f"{kind}_start"), getattr(hull, f"{kind}_count")) for hull in world.hulls]
        yield from _partition("hulls", kind, owned, len(rows))
    for number, thruster in enumerate(world.thrusters):
        own = world.hulls[thruster.hull : thruster.hull + 1]
        if not any(0 <= number - hull.thruster_start < hull.thruster_count for hull in own):
            yield f"thrusters[{number}].hull: {thruster.hull} is not the hull whose thruster it is"
        if (thruster.mapping == SAIL) != (thruster.sail is not None):
            yield f"thrusters[{number}].sail: a sail has a curve, and nothing else has"
    boats = {boat.name for boat in world.boats}
    for number, sensor in enumerate(world.sensors):
        if sensor.boat not in boats:
            yield f"sensors[{number}].boat: there is no boat '{sensor.boat}'"


def _floating_faults(world: Parameters) -> Iterator[str]:
    floating = [item for item in world.objects if item.kind == _FLOATING]
    for number, (row, item) in enumerate(zip(world.floats, floating, strict=False)):
        if row.body != item.body:
            yield f"floats[{number}].body: '{row.body}' is not '{item.body}', the body of the object '{item.name}'"
    driven = sorted(row.follower for row in world.floats if row.follower >= 0)
    if driven != list(range(len(world.followers))):
        yield f"floats: their followers are {driven}, each of {len(world.followers)} is needed once"
    bodies = {body for item in world.objects for body in (item.body, *item.links)}
    for number, link in enumerate(world.links):
        if link.body not in bodies:
            yield f"links[{number}].body: '{link.body}' is not a body of an object"
        if link.follower >= 0:
            yield f"links[{number}].follower: a link has none"


def _blocks(world: Parameters) -> Iterator[str]:
    """Blocks come tree after tree, each after the one that it hangs on; a floating dock is a tree."""
    docks = [dock for dock in world.docks if dock.dynamic]
    bodies = list(chain.from_iterable(dock.bodies for dock in docks))
    if [block.body for block in world.blocks] != bodies:
        yield "blocks: their bodies are not those of the floating docks"
        return
    starts = [0]
    for dock in docks:
        starts.append(starts[-1] + len(dock.bodies))
    for first, end in pairwise(starts):
        for number in range(first, end):
            block = world.blocks[number]
            root = number == first
            if block.parent != -1 if root else not first <= block.parent < number:
                yield f"blocks[{number}].parent: {block.parent} is not a block of its dock that comes before"
            elif block.depth != (0 if root else world.blocks[block.parent].depth + 1):
                yield f"blocks[{number}].depth: {block.depth} is not the number of hinges to its root"


def _unique(world: Parameters) -> Iterator[str]:
    """Names by which something is looked up."""
    things: list[Boat | Object | Dock] = [*world.boats, *world.objects, *world.docks]
    kinds: list[tuple[str, list[Any]]] = [
        ("boats, objects and docks", [thing.name for thing in things]),
        ("lights", [light.name for light in world.lights]),
        ("placards", [placard.name for placard in world.placards]),
        ("thrusters of a boat", [(thruster.hull, thruster.name) for thruster in world.thrusters]),
        ("sensors of a boat", [(sensor.boat, sensor.name) for sensor in world.sensors]),
    ]
    for kind, names in kinds:
        for name, count in Counter(names).items():
            if count > 1:
                yield f"{kind}: the name {name!r} is given {count} times"


def _task(world: Parameters, task: tasks.Task) -> Iterator[str]:
    boats = {boat.name for boat in world.boats}
    if task.boat not in boats:
        yield f"task.boat: there is no boat '{task.boat}'"
    moving = {item.name for item in world.objects if item.kind == _FLOATING}
    moving |= {dock.name for dock in world.docks if dock.dynamic}
    still = ({item.name for item in world.objects} | {dock.name for dock in world.docks}) - moving
    for name in task.fixed:
        if name not in still:
            yield f"task.fixed: '{name}' is not an object or dock that never moves"
    known = {
        tasks.THING: moving | set(task.fixed),
        tasks.BOAT: boats,
        "placard": {placard.name for placard in world.placards},
        "light": {light.name for light in world.lights},
    }
    for place, kind, name in tasks.names_in(task):
        if name not in known[kind]:
            yield f"task.{place}: there is no {kind} '{name}'"


def _partition(table: str, kind: str, spans: _Spans, size: int) -> Iterator[str]:
    """Whether spans of rows follow each other and leave none out."""
    end = 0
    for first, count in spans:
        if first != end:
            yield f"{table}: {kind}_start is {first} where {kind}s were left at {end}"
            return
        end += count
    if end != size:
        yield f"{table}: they have {end} {kind}s of {size}"
