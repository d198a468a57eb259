"""Fleets of one boat whose file or folder is named instead of a fleet: a URDF or xacro, a robot, a model of Gazebo."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeGuard

from vrx_mj.config.gazebo.models import ROBOT, SCHEME, is_gazebo_model, kind_name, model_file
from vrx_mj.config.loading import file_of, path_of
from vrx_mj.config.search import XML_SUFFIXES
from vrx_mj.config.tree import Entry, File, Place, Section

__all__ = ["is_description", "is_robot_xacro", "robot_fleet"]


BESIDE = {"thrusters": "thruster_config.yaml", "components": "component_config.yaml"}
"""Keys of a fleet, and the files of VRX that a robot's folder may have for them."""


def is_description(source: object) -> TypeGuard[str | Path]:
    """Whether a source, of whatever type, is the path of a URDF or xacro, or a model of Gazebo."""
    return isinstance(source, str | Path) and (
        str(source).lower().endswith(XML_SUFFIXES) or is_gazebo_model(str(source))
    )


def is_robot_xacro(source: object) -> TypeGuard[str | Path]:
    """Whether a source is the path of the xacro of a boat."""
    return is_description(source) and str(source).lower().endswith(XML_SUFFIXES) and not is_gazebo_model(str(source))


def robot_fleet(source: str | Path, arguments: Mapping[str, str] | None = None, *, name: str | None = None) -> Section:
    """A fleet of one boat, with arguments of its xacro; by default it is called as its file.

    A robot's YAML may have VRX's thruster and component files beside it.
    """
    if is_gazebo_model(str(source)):
        path, mark, model = str(source).partition("#")
        file = model_file(path, None) if path.startswith(SCHEME) else path_of("robots", path)
        file = Path(f"{file}{mark}{model}")
    else:
        file = file_of("robots", source)
    place = Place(File(file.name, file.absolute().parent))
    values: dict[str, Any] = {"name": name or kind_name(str(source)).partition(".")[0], "robot": file.name}
    if file.name == ROBOT:
        values |= {key: name for key, name in BESIDE.items() if (file.parent / name).is_file()}
    if arguments:
        values["arguments"] = Section(dict(arguments), place, dict.fromkeys(arguments, Entry(place, place)))
    return Section(values, place, dict.fromkeys(values, Entry(place, place)))
