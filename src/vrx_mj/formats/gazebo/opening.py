"""What a command opens: a world, a launch file with its boats, a boat alone, or the one that is meant in a folder.

A folder may be a catkin workspace, a package or a folder of worlds. A URDF, a xacro, a robot or a model of Gazebo that
is named in place of a fleet is a fleet of one boat.
"""

import contextlib
import os
import os.path
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path, PurePath
from typing import TypeGuard

from vrx_mj.config.loading import Source, file_of, path_of, read_source
from vrx_mj.config.search import (
    SCHEME,
    WORLD_SUFFIXES,
    XML_SUFFIXES,
    catalogue,
    display,
    is_built_in,
    is_inside,
    kind_name,
    package_paths,
    packages_around,
    packages_named,
)
from vrx_mj.config.tree import File, Place, Section, literal
from vrx_mj.errors import ChoiceError, ConfigError, UnknownNameError, VrxError, first_lines, first_names, shorten, warn
from vrx_mj.formats.gazebo.document import read_document
from vrx_mj.formats.gazebo.launch import is_launch, launch_of, read_launch
from vrx_mj.formats.gazebo.launched import (
    NAMED_PACKAGES,
    TABLE,
    Launch,
    fleet_of,
    instead_of,
    is_tool,
    stock_launch,
    with_objects,
)
from vrx_mj.formats.gazebo.models import ROBOT, file_in_folder, is_gazebo_model, model_element, model_file
from vrx_mj.formats.gazebo.sdf_boats import is_boat
from vrx_mj.formats.gazebo.worlds import NO_BOATS, GazeboWorld, gazebo_world, is_gazebo_world, warn_of_losses
from vrx_mj.formats.series.pieces import Content
from vrx_mj.formats.urdf.expand import Arguments
from vrx_mj.formats.urdf.expand import arguments as declared_arguments
from vrx_mj.formats.urdf.xml_document import MAX_BYTES, file_error, read_bytes
from vrx_mj.packages import shell_word

_MODELS_SHOWN = 6
"""Names of models that a warning lists."""
_BESIDE = {"thrusters": "thruster_config.yaml", "components": "component_config.yaml"}
"""Keys of a fleet, and the files of VRX that a robot's folder may have for them."""
_BUILT = {"build", "devel", "install", "log"}
"""Folders of a workspace that are made from the others."""
MOST_FILES = 2000
"""Files of these kinds below a folder."""
MOST_FOLDERS = 20_000
"""Folders below a folder."""
_MOST_MEGABYTES = 32
"""Size of the files together."""
MAX_DEPTH = 50
"""Largest depth of folders below a folder."""
_LAUNCH = (".launch",)
_MOST_LAUNCHES = 200
"""Launch files of a folder that are read to choose one."""
_NEWER = ("vrx_gz", "vrx_ros")
"""VRX's packages whose launch files are programs of ROS 2, or open no world."""
_LISTED = 3
"""Names of boats that a line lists."""


def is_robot_xacro(source: object) -> TypeGuard[str | Path]:
    """Whether a source, of whatever type, is the path of the URDF or xacro of a boat."""
    text = str(source)
    return isinstance(source, str | Path) and text.lower().endswith(XML_SUFFIXES) and not is_gazebo_model(text)


def launch_document(source: str | Path) -> tuple[Section, str] | None:
    """The boats that a launch file spawns, as a fleet's file says them, and its name."""
    if not is_launch(source):
        return None
    launch = launch_of(str(source), {})
    found = fleet_of(launch)
    if found is None:
        raise file_error(str(source), "spawns no boats")
    if launch.objects:
        names = shorten(", ".join(thing.name for thing in launch.objects))
        text = f"{source}: a fleet takes only its boats; it also spawns {names}"
        warn(f"{text}; vrx-mj run {source} includes them if it opens a world", 4)
    return found, Path(source).stem


def fleet_document(source: str | Path) -> tuple[Section, str]:
    """The fleet of the one boat of a description."""
    return robot_fleet(source), ""


def folder_document(source: str | Path) -> tuple[Section, str] | None:
    """The fleet of the one boat in a folder."""
    file = file_in_folder(source)
    return None if file is None else (robot_fleet(file, name=file.parent.name), "")


def robot_fleet(source: str | Path, arguments: Arguments | None = None, *, name: str | None = None) -> Section:
    """A fleet of one boat, with arguments of its xacro; by default it is called as its file.

    A robot's YAML may have VRX's thruster and component files beside it.
    """
    if is_gazebo_model(str(source)):
        path, mark, model = str(source).partition("#")
        file = model_file(path, None) if path.startswith(SCHEME) else path_of("robots", path)
        file = Path(f"{file}{mark}{model}" if mark else f"{file}{_boat_fragment(file)}")
    else:
        file = file_of("robots", source)
    place = Place(File(file.name, file.absolute().parent))
    values: Content = {"name": name or kind_name(str(source)).partition(".")[0], "robot": file.name}
    if file.name == ROBOT:
        values |= {key: name for key, name in _BESIDE.items() if (file.parent / name).is_file()}
    if arguments:
        values["arguments"] = Section(arguments, place)
    return Section(values, place)


def _boat_fragment(file: Path) -> str:
    """`#NAME` of the model that is the boat in a file of several, with a warning: the first boat, else the first."""
    root = read_document(file)
    names = [one.attributes.get("name", "") for one in (root.child("world") or root).all("model")]
    if len(names) < 2 or not all(names):
        return ""
    name = next((name for name in names if is_boat(model_element(Path(f"{file}#{name}")).model)), names[0])
    others = first_names((each for each in names if each != name), _MODELS_SHOWN)
    text = f"{display(file)}: the boat is its model '{name}'; for another, --fleet FILE#NAME with NAME one of {others}"
    warn(text, 5)
    return f"#{name}"


def is_folder(path: str | Path) -> bool:
    """Whether there is a folder of this path, which may be too long for any."""
    with contextlib.suppress(ValueError):
        return os.path.isdir(path)  # noqa: PTH112 - Path.is_dir raises an OSError for a name that is too long
    return False


def files_below(folder: Path, kinds: tuple[str, ...]) -> Iterator[Path]:
    """The files below a folder with one of these endings, but for those that catkin makes from others beside them.

    Links to folders are not followed, links to files not where they lead out or nowhere.

    Raises:
        VrxError: there are too many, or too much is in them.
    """
    found, size = 0, 0
    for place, names in _places(folder):
        present = set(names)
        for name in sorted(names):
            file = Path(place, name)
            made = f"{name}.xacro" in present or f"{name}.erb" in present
            if made or not name.lower().endswith(kinds) or not (os.path.exists(file) and is_inside(file, folder)):  # noqa: PTH110 - as is_folder
                continue
            length = file.stat().st_size
            found, size = found + 1, size + (length if length <= MAX_BYTES else 0)  # a longer one is not read
            if found > MOST_FILES:
                raise VrxError(f"more than {MOST_FILES} files to read in {display(folder)}: name a smaller folder")
            if size > _MOST_MEGABYTES * 10**6:
                raise VrxError(f"more than {_MOST_MEGABYTES} MB to read in {display(folder)}: name a smaller folder")
            yield file


def _places(folder: Path) -> Iterator[tuple[str, list[str]]]:
    """The folders below a folder that may hold sources, and the names of the files in each; none that are locked."""
    top = str(folder)
    try:
        os.scandir(top).close()
    except OSError as error:
        raise VrxError(f"{display(folder)}: cannot be read: {error.strerror}") from None
    for number, (place, folders, names) in enumerate(os.walk(top)):
        folders[:] = sorted(name for name in folders if not name.startswith(".") and name not in _BUILT)
        if number > MOST_FOLDERS:
            raise VrxError(f"more than {MOST_FOLDERS} folders in {display(folder)}: name a smaller one")
        if folders and place[len(top) :].count(os.sep) > MAX_DEPTH:
            raise VrxError(f"folders more than {MAX_DEPTH} deep in {display(folder)}: name a smaller one")
        yield place, names


def has_world(file: Path) -> bool:
    """Whether a file has a world, not only models; for one that cannot be read by its name."""
    if not file.name.lower().endswith((".sdf", ".sdf.xacro")):
        return True
    with contextlib.suppress(VrxError):
        return re.search(rb"<world[\s>]", read_bytes(file)) is not None
    return not file.name.startswith("model")


def links_below(folder: Path) -> list[Path]:
    """Links to folders in a folder and in its `src`, which are not followed."""
    places = [folder, folder / "src"]
    inside = (Path(entry.path) for place in places if is_folder(place) for entry in os.scandir(place))
    return sorted(path for path in inside if path.is_symlink() and is_folder(path))


def short_names(files: Sequence[Path], folder: Path) -> list[str]:
    """The shortest end of each file's path in a folder that no other one has: its name, where that is its own."""
    parts = [PurePath(os.path.relpath(file, folder)).parts for file in files]
    ends = Counter(one[-length:] for one in parts for length in range(1, len(one) + 1))
    shortest = (next((one[-size:] for size in range(1, len(one)) if ends[one[-size:]] == 1), one) for one in parts)
    return ["/".join(one) for one in shortest]


def open_source(world: Source, fleet: Source | None, arguments: Arguments) -> tuple[Source, Source | None]:
    """World and fleet that a source opens: a launch file, a folder, or a world of Gazebo with arguments or boats.

    Other sources stay as they are. Of a fleet that is a xacro those arguments are the robot's which the world has not.

    Raises:
        ConfigError: the file is wrong, or opens no world, or a file without arguments is given some.
        VrxError: there is nothing to open in the folder.
        ChoiceError: there are several.
    """
    if isinstance(world, str | Path) and is_folder(world) and str(world) not in catalogue("worlds"):
        world = file_of_folder(Path(world), arguments)
    if is_launch(world):
        launch = launch_of(str(world), arguments)
        if launch.world is None:
            raise _no_world(world, launch, arguments)
        warn_of_losses(launch.report.notes, str(world), stacklevel=4)
        if fleet is None and launch.fleet is not None:
            text = f"its <rosparam> loads a fleet, as --fleet {shell_word(display(launch.fleet))} does"
            warn(f"{shorten(world)}: {text}", 4)
        fleet = fleet_of(launch) or launch.fleet_of_world if fleet is None else fleet
        if launch.objects or launch.unlocked:
            return joined_world(launch.world, launch, fleet)
        world, arguments = launch.world, {}
    if arguments and is_robot_xacro(fleet):
        is_xacro = is_gazebo_world(world) and str(world).lower().endswith(".xacro")
        known = declared_arguments(path_of("worlds", str(world))) if is_xacro else {}
        fleet = robot_fleet(fleet, {name: value for name, value in arguments.items() if name not in known})
        arguments = {name: value for name, value in arguments.items() if name in known}
    if not arguments and (fleet is not None or not is_gazebo_world(world)):
        return world, fleet
    if not is_gazebo_world(world):
        message = "takes no NAME:=VALUE: only launch files and the xacro of worlds and boats have arguments"
        raise file_error(str(world), message)
    found = gazebo_world(path_of("worlds", world), arguments)
    fleet = _fleet_in(found, world) if fleet is None else fleet
    warn_of_losses(found.notes, str(world), stacklevel=4)
    return found.whole, fleet


def _no_world(source: str | Path, launch: Launch, arguments: Arguments) -> ConfigError:
    """The error about a launch file that opens no world, and what to do with it."""
    name, file = Path(source).name, shell_word(shorten(source))
    beside = f" and spawns no boat; start it beside one: vrx-mj serve WORLD --ros1, then roslaunch {file}"
    sails = f"; sail its boats in one: vrx-mj run WORLD --fleet {file}"
    text = f"opens no Gazebo world{sails if launch.boats or launch.fleet else beside}"
    text = instead_of(name, arguments) if is_tool(name) and not launch.boats else text
    return file_error(str(source), text)


def joined_world(world: Path | str, launch: Launch, fleet: Source | None) -> tuple[Section, Source | None]:
    """The world of a launch file with the objects that it spawns, and the fleet, by default that in the world.

    Raises:
        ConfigError: the world is wrong, or has a model of the name of an object.
    """
    if is_gazebo_world(world):
        found = gazebo_world(path_of("worlds", world))
        warn_of_losses(found.notes, str(world), stacklevel=5)
        name, section = found.name, found.section
        fleet = _fleet_in(found, world) if fleet is None else fleet
    else:
        file = file_of("worlds", world)
        name, section = world if isinstance(world, str) else file.stem, read_source("worlds", file)
    return with_objects(section.holding({"name": name, **section}), launch), fleet


def _fleet_in(found: GazeboWorld, world: str | Path) -> Source | None:
    """The boats of a world of Gazebo, with a warning where it has none."""
    if found.fleet == NO_BOATS:
        text = "this world has no boats; add some with --fleet FLEET, as in --fleet trio"
        warn(f"{shorten(world)}: {text}", 5)
    return found.fleet


def file_of_folder(folder: Path, arguments: Arguments | None = None) -> Path:
    """The file of a folder that is meant: its one launch file that starts a world, without any its one world.

    Launch files that another one includes do not count.

    Raises:
        ChoiceError: there are several.
        VrxError: the folder holds nothing that can be opened; the message says what it holds.
    """
    launches, failed = _launches(folder, arguments or {})
    opening = {file: launch for file, launch in launches.items() if launch.world is not None}
    included = {file for launch in opening.values() for file in launch.included}
    meant = {file: _summary(launch) for file, launch in opening.items() if file.resolve() not in included}
    kind = "launch files that open a world" if meant else "worlds"
    meant = meant or {file: "" for file in files_below(folder, WORLD_SUFFIXES) if has_world(file)}
    if not meant:
        raise VrxError("\n".join(failed) or f"{literal(display(folder))}: {next(_reasons(folder, launches))}")
    if len(meant) > 1:
        raise _choice(folder, kind, meant)
    if failed:
        lines = [f"{display(folder)}: launch files that are not read", *first_lines(failed, _LISTED)]
        warn("\n".join(lines), 4)
    return next(iter(meant))


def file_in(folder: str, name: str) -> str:
    """The file of a name in a folder or a package, as roslaunch finds it.

    Args:
        folder: a folder, or the name of a package in the current folder's workspace, on ROS_PACKAGE_PATH or of VRX.
        name: its name, or the end of its path in that folder.

    Raises:
        UnknownNameError: no such package, or no such file in it.
        ChoiceError: several files end so.
    """
    place = Path(folder) if is_folder(folder) else _package(folder)
    if place is None:
        if folder not in NAMED_PACKAGES and not (folder in _NEWER and is_tool(name)):
            raise UnknownNameError("folder or package", folder, sorted({*packages_around(Path.cwd()), *NAMED_PACKAGES}))
        if not is_tool(name):
            launch_of(name, {})  # raises where VRX has none of this name
        return f"{folder}/{name}" if stock_launch(name) else name
    ends = (*_LAUNCH, *WORLD_SUFFIXES, ".yaml")
    files = list(files_below(place, ends))
    path = f"/{name}"
    found = [file for file in files if f"/{file.relative_to(place).as_posix()}".endswith(path)]
    if not found:
        raise UnknownNameError(f"launch file or world in {display(place)}", name, short_names(files, place))
    if len(found) > 1:
        raise _choice(place, f"files that end in {name}", dict.fromkeys(found, ""), files)
    return str(found[0])


def _package(name: str) -> Path | None:
    """The folder of a package, by its name."""
    found = packages_named(name, Path.cwd(), [packages_around(Path.cwd())], package_paths())
    place = next(filter(is_folder, found), None)
    return None if place is None or is_built_in(place) else place


def _launches(folder: Path, arguments: Arguments) -> tuple[dict[Path, Launch], list[str]]:
    """Launches of the launch files in a folder, with the arguments that each takes, and messages about faulty ones."""
    files = list(files_below(folder, _LAUNCH))
    if len(files) > _MOST_LAUNCHES:
        raise VrxError(f"{len(files)} launch files in {display(folder)}: name one, or a smaller folder")
    launches, failed = dict[Path, Launch](), list[str]()
    for file in files:
        try:
            launches[file] = read_launch(file, arguments, strict=False)
        except VrxError as error:
            failed += str(error).splitlines()[:1]
    return launches, failed


def _summary(launch: Launch) -> str:
    """World and boats of a launch file, in a few words."""
    world = launch.world.name if isinstance(launch.world, Path) else str(launch.world)
    names = [boat.name for boat in launch.boats]
    count = f"{len(names)} boat{'s' * (len(names) > 1)}: {first_names(names, _LISTED)}" if names else "no boat"
    return f"{world}, {count if launch.fleet is None or names else launch.fleet.name}"


def _choice(folder: Path, kind: str, files: Mapping[Path, str], among: Sequence[Path] = ()) -> ChoiceError:
    """The error about a folder of which several files may be meant, each with what it opens."""
    names = [os.path.relpath(file, folder) for file in files] if among else short_names([*files], folder)
    typed = shell_word("." if folder.absolute() == Path.cwd() else display(folder))  # as a command line names it
    words = [f"{typed} {shell_word(name)}" for name in names]
    return ChoiceError(display(folder), kind, dict(zip(words, files.values(), strict=True)))


def _reasons(folder: Path, launches: Mapping[Path, Launch]) -> Iterator[str]:
    """Reasons why nothing in a folder can be opened, the most helpful first: what there is instead of a world."""
    if launches:
        listed = ", ".join(short_names([*launches], folder)[:_LISTED])
        yield f"its launch files open no world: {listed}; pass one to --fleet, with a world"
    for text, kinds in TABLE["instead"].items():
        files = list(files_below(folder, tuple(kinds)))
        names = [file.parent.name for file in files] if "model.sdf" in kinds else short_names(files, folder)
        if files:
            yield text.format(", ".join(list(dict.fromkeys(names))[:_LISTED]))
    links = links_below(folder)
    if links:
        yield f"no world; symbolic links are not followed: name the folder that {literal(display(links[0]))} points to"
    yield "no launch file and no Gazebo world in this folder"
