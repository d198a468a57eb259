"""Fleets of one boat whose file or folder is named instead of a fleet: a URDF or xacro, a robot, a model of Gazebo."""

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TypeGuard

from vrx_mj.config.loading import file_of, path_of
from vrx_mj.config.search import SCHEME, XML_SUFFIXES, display, kind_name
from vrx_mj.config.tree import File, Place, Section
from vrx_mj.errors import VrxWarning, first_names, shortened
from vrx_mj.formats.gazebo.document import read_document
from vrx_mj.formats.gazebo.launch import is_launch, launch_of
from vrx_mj.formats.gazebo.launched import fleet_of
from vrx_mj.formats.gazebo.models import ROBOT, file_in_folder, is_gazebo_model, model_element, model_file
from vrx_mj.formats.gazebo.sdf_boats import is_boat
from vrx_mj.formats.series.pieces import Content
from vrx_mj.formats.urdf.xml_document import file_error

_MODELS_SHOWN = 6
"""Names of models that a warning lists."""
_BESIDE = {"thrusters": "thruster_config.yaml", "components": "component_config.yaml"}
"""Keys of a fleet, and the files of VRX that a robot's folder may have for them."""


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
        names = shortened(", ".join(thing.name for thing in launch.objects))
        text = f"{source}: a fleet has its boats alone; it spawns other models too: {names}"
        warnings.warn(f"{text}; vrx-mj run {source} has them, where it opens a world", VrxWarning, stacklevel=4)
    return found, Path(source).stem


def fleet_document(source: str | Path) -> tuple[Section, str]:
    """The fleet of the one boat of a description."""
    return robot_fleet(source), ""


def folder_document(source: str | Path) -> tuple[Section, str] | None:
    """The fleet of the one boat in a folder."""
    file = file_in_folder(source)
    return None if file is None else (robot_fleet(file, name=file.parent.name), "")


def robot_fleet(source: str | Path, arguments: Mapping[str, str] | None = None, *, name: str | None = None) -> Section:
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
    text = f"{display(file)}: the boat is its model '{name}'; for another one: --fleet FILE#NAME, NAME one of {others}"
    warnings.warn(text, VrxWarning, stacklevel=5)
    return f"#{name}"
