"""Objects that macros include: our model of VRX's folder, and the name that an object has where none is given."""

import re
from typing import Any

from vrx_mj.config.poses import Pose
from vrx_mj.config.series.blocks import Tag
from vrx_mj.config.series.given import At
from vrx_mj.config.tree import Place

__all__ = ["included", "named_as", "thing"]

SCHEME = "model://"
HERE: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
SYMBOLS = re.compile(r"vrx_dock_([a-z]+_[a-z]+)__([a-z]+_[a-z]+)")
"""The floating docks of 2018 with fixed symbols, one folder for each pair."""
OWN_NAMES = (
    (re.compile(r"short_navigation_course(\d)"), r"short_navigation_course_\1"),
    (re.compile(r"navigation_course(\d)"), r"vrx_navigation_course_\1"),
    (re.compile(r"navigation_course"), "vrx_navigation_course"),
    (re.compile(r"obstacle_course"), "robotx_obstacle_course"),
    (re.compile(r"(dock_20(?:16|18|22))(?:_dynamic)?"), r"robotx_\1"),
)
"""Folders whose models go by another name."""
PLUGIN = "libfollow_plugin.so"
Object = dict[str, Any]


def thing(uri: At, pose: Any, name: At | None = None) -> Object:
    """An object of a world; without a name until the world has all of them."""
    folder = str(uri.value).removeprefix(SCHEME).strip("/")
    symbols = SYMBOLS.fullmatch(folder)
    known: Object = {"model": At("dock_2018_dynamic" if symbols else folder, uri.place), "pose": pose}
    if symbols:
        known["symbols"] = At([symbols[1], symbols[2]], uri.place)
    return known if name is None else {"name": name, **known}


def named_as(model: str) -> str:
    """The name that a model has by itself."""
    for pattern, name in OWN_NAMES:
        found = pattern.fullmatch(model)
        if found:
            return found.expand(name)
    return model


def included(tag: Tag, place: Place) -> Object:
    """The object of an <include>."""
    tag.only("name", "uri", "pose", "plugin")
    name, pose = tag.text("name"), tag.numbers("pose", "x y z roll pitch yaw")
    found = thing(At(tag.required("uri"), place), At(pose or list(HERE), place), At(name, place) if name else None)
    plugins = tag.all("plugin")
    if plugins:
        found["path"] = At(_path(plugins[0]), place)
    return found


def _path(tag: Tag) -> Object:
    """The path of a follow plugin."""
    if tag.element.get("filename") != PLUGIN:
        raise tag.fault(f"<plugin>: only {PLUGIN} is known in an <include>, got '{tag.element.get('filename')}'")
    path: Object = {"loop": bool(tag.all("loop_forever"))}  # VRX goes by its presence
    for waypoints in tag.all("waypoints"):
        points = ["".join(point.element.itertext()) for point in waypoints.all("waypoint")]
        path["waypoints"] = [waypoints.read_numbers(text, "<waypoint>", ["x", "y"]) for text in points]
    for circle in tag.all("circle"):
        path["circle"] = _values(circle, "radius")
    for line in tag.all("line"):
        path["line"] = _values(line, "length", "direction")
    return path


def _values(tag: Tag, *names: str) -> Object:
    found = {name: tag.numbers(name, name) for name in names}
    return {name: values[0] for name, values in found.items() if values}
