"""Worlds and boats of launch files as documents of ours; VRX's own launch files and packages need not be installed."""

import json
import os.path
import re
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import Any

from vrx_mj.config.fleet import FleetConfig
from vrx_mj.config.kinds import MARKS
from vrx_mj.config.loading import Loading, read_source, validate
from vrx_mj.config.search import WORLD_SUFFIXES, catalogue, is_built_in
from vrx_mj.config.tree import File, Items, Place, Section, literal, merge
from vrx_mj.errors import ConfigError, UnknownNameError, VrxError, shorten
from vrx_mj.formats.gazebo.document import LIBRARIES, Report, home_path, is_file
from vrx_mj.formats.gazebo.sdf_models import safe_name
from vrx_mj.formats.series.pieces import At, Content, with_places
from vrx_mj.formats.urdf.elements import numbers_of, truth
from vrx_mj.formats.urdf.expand import LEFT_OUT, Arguments
from vrx_mj.frames import Pose
from vrx_mj.packages import root, shell_word

ENDING = ".launch"
"""How the names of launch files end."""


POSE = ("x", "y", "z", "R", "P", "Y")
"""Names of arguments for a pose."""
_FLAGS = ("urdf", "sdf", "stdin", "unpause", "b", "gazebo", "package_to_model", "h", "help")
"""Options of spawn_model without a value."""
_VALUED = ("file", "param", "database", "model", *POSE, "reference_frame", "gazebo_namespace", "robot_namespace",
          "wait", "J", "entity", "topic", "timeout")  # fmt: skip
"""Options with a value, those of ROS 2 among them; that of -J is two words."""
_CLASSIC, _OLDER, _WAVES, _MARITIME = PACKAGES = ("vrx_gazebo", "vrx_2019", "wave_gazebo", "vorc_gazebo")
"""Packages that hold launch files; a launch file that two of them have is that of the earlier one."""
_FOLDER = root() / "assets" / "launch"
"""Launch files of ours by VRX's names, in folders of their packages: arguments with VRX's defaults, and our node."""
TABLE: Mapping[str, Any] = json.loads(Path(__file__).with_suffix(".json").read_bytes())
"""VRX's launch files: the boats of those that have several, what to do instead of arguments that have no effect here
(nothing is lost where the value is the default), and those that open no world. Packages of ROS and VRX that need not be
there, and what a folder may hold instead of worlds, by what to do with it and the ends of the files' names."""
_USUAL = {"paused": "false"}
"""Defaults that are others than those of all launch files."""
_LOCKS = ("wamv_locked", "robot_locked")
"""Arguments that hold a boat in its place."""
PLACES = {"sandisland": "sand_island", "sydneyregatta": "sydney_regatta", "nbpark": "vrx2023/nbpark"}
"""World files of VRX that have other names here."""
_SERIES = re.compile(r"(?:(\d{4})_(practice|phase\d)/(\w+)|(practice|phase\d)_(\d{4})_(\w+?)(?:_task)?)")
"""The end of the path of a world of a competition in VRX, up to 2022 and since, without the file's suffix."""
_ENDINGS = (".launch.py", ".launch.xml", ".launch", *WORLD_SUFFIXES)
_TOOLS: Mapping[str, Mapping[str, Any]] = TABLE["tools"]
"""VRX's launch files that open no world here: the `command` that does the work of each, its `options` by the names of
arguments, each with what to type where it is not given (empty: nothing), and the `reason`: what to know before."""
NAMED_PACKAGES = LIBRARIES | {*TABLE["packages"]}
"""Packages of ROS and VRX that need not be there: what they hold is known here, or not needed."""
NOWHERE = "/package:/"
"""Beginning of a path in such a package that is missing."""
_OURS = {"wamv_gazebo": "wamv", "cora_gazebo": "cora"}
"""How the names of VRX's descriptions begin, and our robots."""
_MAX_LEVELS = 5
"""Number of folders above a file in which its package is looked for."""


@dataclass(frozen=True)
class SpawnedModel:
    """A boat, or an object of SDF, that a launch file spawns."""

    name: str
    """Name in Gazebo."""
    pose: Pose
    """Pose in the world [m, rad]."""
    place: Place
    """Place of the element that spawns it."""
    model: Path | str = "wamv"
    """File of its description, or the name of a robot or an object of ours."""
    arguments: Arguments = field(default_factory=dict)
    """Arguments of its xacro."""


@dataclass
class Launch:
    """The simulation that a launch file starts."""

    world: Path | str | None = None
    """File of the world, or the name of one of ours; None: it opens none."""
    boats: list[SpawnedModel] = field(default_factory=list)
    objects: list[SpawnedModel] = field(default_factory=list)
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


def _boat(boat: SpawnedModel) -> At:
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


def _wamv(boat: SpawnedModel) -> Content:
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
        text = f"the world already has a model named '{name}' ({where}): give each its own -model NAME"
        problems.append(place.problem(f"<node> '{name}' / args", text))
    if problems:
        raise ConfigError(problems)
    return merge(world, Section({"objects": items}, items.places[0]))


def objects_of(launch: Launch) -> Items:
    """The objects of a launch file as a world's file says them."""
    found: Items = with_places([*map(_object, launch.objects)], Place(File("", None)))
    return found


def _object(thing: SpawnedModel) -> At:
    """One object of a world's file, whose model is named as a file beside the folder of the model names it."""
    model, place = str(thing.model), thing.place
    if isinstance(thing.model, Path):
        folder = thing.model.absolute().parent
        model, place = f"./{folder.name}/{thing.model.name}", _in_folder(place, folder.parent)
    return At({"name": safe_name(thing.name), "model": model, "pose": list(thing.pose)}, place)


@dataclass(frozen=True)
class StockLaunch:
    """A launch file of VRX."""

    name: str
    world: str
    """Name of the world, here."""
    boats: tuple[SpawnedModel, ...]
    arguments: Arguments
    """Arguments that it takes, with their defaults."""
    package: str
    """Package that it is in."""
    file: Path
    """The file of ours, which starts it by roslaunch."""

    @property
    def own(self) -> Mapping[str, str]:
        """Arguments that its boats' descriptions take, with their defaults."""
        return self.boats[0].arguments if self.boats else {}

    def boats_with(self, given: Arguments, place: Place) -> Iterator[SpawnedModel]:
        """Boats that it spawns with arguments; several have names and places of their own. Raises ConfigError."""
        fixed = {*POSE, "namespace", "thrust_config"} if len(self.boats) > 1 else set()
        given = {key: value for key, value in given.items() if key not in fixed}
        for boat in self.boats:
            texts = [given.get(key, repr(value)) for key, value in zip(POSE, boat.pose, strict=True)]
            try:
                pose = pose_of_words(texts)
            except ValueError as error:
                raise ConfigError([place.problem("x:= y:= z:= R:= P:= Y:=", str(error))]) from None
            arguments = {key: given.get(key, value) for key, value in boat.arguments.items()}
            yield SpawnedModel(given.get("namespace", boat.name), pose, place, boat.model, arguments)


def _stock_launch(file: Path) -> StockLaunch:
    """The launch file of VRX that a file of ours is."""
    package, text = file.parent.name, file.read_text(encoding="utf-8")
    given = dict(re.findall(r'<arg name="(\w+)" default="(.*?)"/>', text))
    world = PurePosixPath(given["world"]).stem
    own = {key: value for key, value in given.items() if key in {"thrust_config", *_LOCKS} or key.endswith("_enabled")}
    alone = {"name": given["namespace"], "thrust_config": given["thrust_config"], "pose": [given[key] for key in POSE]}
    place, robot = Place(File(file.name, None)), "wamv" if given["urdf"] else "cora"
    boats = tuple(
        SpawnedModel(boat["name"], pose_of_words(boat["pose"]), place, robot, {
            key: value for key, value in {**own, "thrust_config": boat["thrust_config"]}.items() if value
        })
        for boat in TABLE["boats"].get(file.name, [alone])
        if len(own) > 1
    )  # fmt: skip
    return StockLaunch(file.name, f"vrx2019/{world}" if package == _OLDER else world, boats, given, package, file)


_ALL = tuple(_stock_launch(file) for package in PACKAGES for file in sorted((_FOLDER / package).glob("*.launch")))
_BY_PACKAGE: Mapping[tuple[str, str], StockLaunch] = {(launch.package, launch.name): launch for launch in _ALL}
STOCK_LAUNCHES: Mapping[str, StockLaunch] = {launch.name: launch for launch in reversed(_ALL)}
"""VRX's launch files by their names."""
LAUNCHED: Mapping[str, str] = {
    name.removesuffix(".launch"): launch.world
    for name, launch in STOCK_LAUNCHES.items()
    if name != f"{launch.world}.launch"
} | {"competition": "vrx2023/sydney_regatta"}
"""Worlds that VRX's launch files open if nothing else is said, where these have other names."""


def world_of_series(path: str) -> str:
    """The name here of a world of a competition, by its path in VRX; empty for another."""
    *folders, file = PurePosixPath(path).parts[-2:] or ("",)
    stem = file.partition(".")[0]
    found = _SERIES.fullmatch("/".join([*folders, stem])) or _SERIES.fullmatch(stem)
    if found is None:
        return ""
    year, part, name = found.groups()[:3] if found[1] else (found[5], found[4], found[6])
    return f"vrx{year}/{part}/{name}"


def world_message(name: str, known: Container[str]) -> str | None:
    """The message about a name that VRX has for a launch file or a world; None: it has no such name."""
    base = Path(name).name
    stem = next((base[: -len(end)] for end in _ENDINGS if base.lower().endswith(end)), base)
    ending = base[len(stem) :]
    if (series := world_of_series(name)) in known:
        return f"VRX's {base} is '{series}'"
    launched = LAUNCHED.get(stem) if not ending or ending.startswith(".launch") else None
    place = PLACES.get(stem) if not ending.startswith(".launch") else None
    if launched and place:
        return f"VRX's {stem}.launch opens '{launched}', its {stem}.world is '{place}'"
    if launched:
        return f"VRX's {stem}{ending or '.launch'} opens '{launched}'"
    if place or (ending and stem in known):
        return f"VRX's {base} is '{place or stem}'" if ending else f"VRX's {stem}.world is '{place}'"
    return None


def stock_launch(name: str, package: str = "") -> StockLaunch | None:
    """VRX's launch file of a name, with `.launch` or without, in a package or any; None: it has none."""
    full = name if name.endswith(".launch") else f"{name}.launch"
    return _BY_PACKAGE.get((package, full)) or STOCK_LAUNCHES.get(full)


def stock_launches(package: str) -> Sequence[StockLaunch]:
    """The launch files that a package of VRX has, or had in an earlier release."""
    own = [launch for launch in _ALL if launch.package == package]
    names = {launch.name for launch in own}
    moved = [launch for launch in _ALL if package == _CLASSIC and launch.package == _OLDER and launch.name not in names]
    return [*own, *moved]


def advice(launch: StockLaunch, name: str, value: str) -> str:
    """Advice on an argument that has no effect here; empty if nothing is lost."""
    if name in _LOCKS:
        if truth(value) is None:
            return "expected true or false"
        held = truth(value) and not truth(launch.own.get(name, "true"))
        return "the task holds the boat until it is ready" if held else ""
    usual = _USUAL.get(name, launch.arguments[name])
    same = value.lower() == usual or (truth(value) is not None and truth(value) == truth(usual))
    return "" if same else TABLE["unused"].get(name, "")


def unlocks(launch: StockLaunch, given: Arguments) -> bool:
    """Whether arguments of a launch file free its boat, which it would lock."""
    return any(truth(given.get(name, "true")) is False and truth(launch.own.get(name, "")) for name in _LOCKS)


def is_tool(name: str) -> bool:
    """Whether VRX has a launch file of this name that opens no world here."""
    return name in _TOOLS


def instead_of(name: str, given: Arguments) -> str:
    """Message on one of VRX's launch files that open no world here: the command to type instead, with its arguments."""
    tool = {"command": "", "options": {}, "reason": "", **_TOOLS[name]}
    command = " ".join([tool["command"], *_words(tool["options"], given)])
    return "; ".join(filter(None, ("opens no world here", tool["reason"], tool["command"] and f"type: {command}")))


def _words(options: Mapping[str, Sequence[str]], given: Arguments) -> Iterator[str]:
    """The options of a command."""
    for name, (option, usual) in options.items():
        value = given.get(name, usual)
        if option == "--locked":
            yield from ["--locked"] if value.lower() in {"true", "1"} else []
        elif value:
            yield from (
                (world_of_series(value) or f"{option}{value}",)
                if option.endswith("/")
                else filter(None, (option, shell_word(value)))
            )


def _is_nowhere(path: str) -> bool:
    """Whether a path leads into a package that is missing, or that `vrx-mj ros packages` wrote for roslaunch alone."""
    return path.startswith(NOWHERE) or any(map(is_built_in, list(Path(path).parents)[:_MAX_LEVELS]))


def named_world(path: str) -> Path | str:
    """A world's file, or the name here of one of VRX's that is not at hand.

    Raises:
        UnknownNameError: it leads into a package of VRX, which has none of this name, nor a link to one.
    """
    if not _is_nowhere(path):
        return home_path(path)
    parts = PurePosixPath(path).parts
    stem = parts[-1].partition(".")[0]
    known = catalogue("worlds")
    names = (world_of_series(path), f"vrx2019/{stem}" if "vrx_2019" in parts else stem, PLACES.get(stem, stem))
    found = next((name for name in names if name in known), None) or _link_target(path) or _link_target(f"{path}.xacro")
    if found is None:
        raise UnknownNameError("world of VRX", stem, known)
    return found


def robot_named(path: str) -> str | None:
    """The name here of a description of VRX's that is not at hand; None: it is another."""
    name = PurePosixPath(path).name
    if not _is_nowhere(path) or _link_target(path):
        return None
    return next((robot for start, robot in _OURS.items() if name.startswith(start)), None)


def package_left_out(path: str) -> str:
    """The name of the package that a path of one that is missing leads into."""
    return shorten(path.removeprefix(LEFT_OUT).partition("/")[0])


def _link_target(path: str) -> Path | None:
    """The file of a user's to which a link of `vrx-mj ros packages --over` leads; None: there is no such file."""
    real = Path(os.path.realpath(path))
    return real if is_file(real) and not _is_nowhere(str(real)) else None


def object_named(path: str) -> str | None:
    """The name here of a model of VRX's that is not at hand, by the folder of its file; None: it is another."""
    file = PurePosixPath(path)
    name = file.parent.name
    return name if _is_nowhere(path) and file.name == "model.sdf" and name in catalogue("objects") else None
