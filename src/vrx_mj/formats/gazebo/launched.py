"""Worlds and boats of launch files as documents of ours: a world and a fleet."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath

from vrx_mj.config.fleet import FleetConfig
from vrx_mj.config.kinds import MARKS
from vrx_mj.config.loading import Loading, read_source, validate
from vrx_mj.config.tree import File, Items, Place, Section, literal, merge
from vrx_mj.errors import ConfigError, UnknownNameError, VrxError
from vrx_mj.formats.gazebo.document import Report
from vrx_mj.formats.gazebo.sdf_models import safe_name
from vrx_mj.formats.series.pieces import At, Content, with_places
from vrx_mj.formats.urdf.elements import numbers_of, truth
from vrx_mj.frames import Pose

ENDING = ".launch"
"""How the names of launch files end."""


POSE = ("x", "y", "z", "R", "P", "Y")
"""Names of arguments for a pose."""
_FLAGS = ("urdf", "sdf", "stdin", "unpause", "b", "gazebo", "package_to_model", "h", "help")
"""Options of spawn_model without a value."""
_VALUED = ("file", "param", "database", "model", *POSE, "reference_frame", "gazebo_namespace", "robot_namespace",
          "wait", "J", "entity", "topic", "timeout")  # fmt: skip
"""Options with a value, those of ROS 2 among them; that of -J is two words."""


@dataclass(frozen=True)
class Spawned:
    """A boat, or an object of SDF, that a launch file spawns."""

    name: str
    """Name in Gazebo."""
    pose: Pose
    """Pose in the world [m, rad]."""
    place: Place
    """Place of the element that spawns it."""
    model: Path | str = "wamv"
    """File of its description, or the name of a robot or an object of ours."""
    arguments: Mapping[str, str] = field(default_factory=dict)
    """Arguments of its xacro."""


@dataclass
class Launch:
    """The simulation that a launch file starts."""

    world: Path | str | None = None
    """File of the world, or the name of one of ours; None: it opens none."""
    boats: list[Spawned] = field(default_factory=list)
    objects: list[Spawned] = field(default_factory=list)
    report: Report = field(default_factory=Report)
    unlocked: bool = False
    """Whether it frees the boat that a task would hold at the start."""
    included: list[Path] = field(default_factory=list)
    """The launch files that it includes."""
    fleet: Path | None = None
    """A fleet's file among those that its parameters are loaded from."""

    @property
    def fleet_of_world(self) -> str | None:
        """The fleet of the world where nothing is spawned: none in a world of ours; None: that of a world of Gazebo."""
        return "none" if isinstance(self.world, str) else None


def pose_of_words(values: Iterable[object]) -> Pose:
    """Six numbers. Raises ValueError: they are others."""
    x, y, z, roll, pitch, yaw = numbers_of(" ".join(map(str, values)), "x y z roll pitch yaw")
    return x, y, z, roll, pitch, yaw


def spawn_options(words: Iterable[str]) -> dict[str, str]:
    """The options of spawn_model of gazebo_ros by name; those without a value are empty.

    VRX's spawn_wamv.bash has `--urdf FILE` and `--model NAME`.

    Raises:
        VrxError: an option is unknown, or lacks its value.
    """
    known = [f"-{name}" for name in (*_FLAGS, *_VALUED)]
    found, left = dict[str, str](), [word for word in words if ":=" not in word]  # those that roslaunch adds
    while left:
        word = left.pop(0)
        option = "-file" if word == "--urdf" else word.replace("--", "-", 1)
        if option not in known:
            raise UnknownNameError("option of spawn_model", word, known)
        count = 0 if option[1:] in _FLAGS else 2 if option == "-J" else 1
        if len(left) < count or (count and left[0].replace("--", "-", 1) in known):
            raise VrxError(f"{option} needs a value")
        found[option[1:]] = " ".join(left[:count])
        del left[:count]
    return found


def fleet_of(launch: Launch) -> Section | None:
    """The boats of a launch file as a fleet's file says them; None: it spawns none."""
    loaded = read_source("fleets", launch.fleet) if launch.fleet else None
    if loaded is not None and launch.fleet:
        loaded = loaded.holding({"name": launch.fleet.stem, **loaded})
    if not launch.boats:
        return loaded
    place = Place(launch.boats[0].place.file, 1)
    name = PurePosixPath(place.file.name).name.removesuffix(ENDING)
    spawned: Section = with_places({"name": name, "boats": [*map(_boat, launch.boats)]}, place)
    return spawned if loaded is None else merge(loaded, spawned, ("boats",))


def checked_fleet(file: Path) -> Path:
    """The file, if it is a fleet's. Raises VrxError: it is another."""
    section = read_source("fleets", file)
    if MARKS["fleets"].isdisjoint(validate(FleetConfig, section, Loading()).model_fields_set):
        raise VrxError(f"{file} is not a fleet")
    return file


def _boat(boat: Spawned) -> At:
    """One boat of a fleet's file; the path of a robot begins where its file is."""
    values: Content = {"name": safe_name(boat.name), "pose": list(boat.pose)}
    if isinstance(boat.model, str):
        values |= {"robot": boat.model, **_wamv(boat)}
    else:
        values["robot"] = At(boat.model.name, _in_folder(boat.place, boat.model.absolute().parent))
        values |= {"arguments": dict(boat.arguments)} if boat.arguments else {}
    return At(values, boat.place)


def _in_folder(place: Place, folder: Path) -> Place:
    """A place whose relative paths begin in a folder."""
    return place._replace(file=replace(place.file, folder=folder))


def _wamv(boat: Spawned) -> Content:
    """Thrusters and sensors of VRX's WAM-V, by the arguments of its description or of a launch file.

    Raises ConfigError for what switches sensors and is neither true nor false.
    """
    layout = boat.arguments.get("thruster_config") or boat.arguments.get("thrust_config")
    switches = {key: value for key, value in boat.arguments.items() if key.endswith("_enabled")}
    for key, value in switches.items():
        if truth(value) is None:
            text = f"expected true or false, got {literal(value)}"
            raise ConfigError([boat.place.problem(f"'{boat.name}' / {key}:=", text)])
    on = (key.removesuffix("_enabled") for key, value in switches.items() if truth(value))
    suites = [key.replace("vrx_sensors", "vrx") for key in on]
    return {**({"thrusters": layout} if layout else {}), "sensors": suites or "none"}


def with_objects(world: Section, launch: Launch) -> Section:
    """A world with a launch file's lock and the objects that it spawns. Raises ConfigError for names that are taken."""
    if launch.unlocked and isinstance(world.get("task"), Section):
        place = world.entries["task"].value
        world = merge(world, Section({"task": Section({"locked": False}, place)}, place))
    items = objects_of(launch)
    if not items:
        return world
    there = [one for one in world.get("objects") or () if isinstance(one, Section) and "name" in one]
    first = {thing["name"]: thing.entries["name"].value for thing in there}
    problems = []
    for name, place in ((thing["name"], thing.place) for thing in items if thing["name"] in first):
        where = f"{first[name].file.name}:{first[name].line}"
        text = f"a model named '{name}' is in the world already ({where}): each needs -model NAME of its own"
        problems.append(place.problem(f"<node> '{name}' / args", text))
    if problems:
        raise ConfigError(problems)
    return merge(world, Section({"objects": items}, items.places[0]))


def objects_of(launch: Launch) -> Items:
    """The objects of a launch file as a world's file says them."""
    found: Items = with_places([*map(_object, launch.objects)], Place(File("", None)))
    return found


def _object(thing: Spawned) -> At:
    """One object of a world's file, whose model is named as a file beside the folder of the model names it."""
    model, place = str(thing.model), thing.place
    if isinstance(thing.model, Path):
        folder = thing.model.absolute().parent
        model, place = f"./{folder.name}/{thing.model.name}", _in_folder(place, folder.parent)
    return At({"name": safe_name(thing.name), "model": model, "pose": list(thing.pose)}, place)
