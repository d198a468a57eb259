"""The macros of VRX's worlds (vrx_gazebo/worlds/xacros, gazebo_classic): what they take, and what they make of a world.

A piece that a macro makes has the keys of a world file. Defaults are those of VRX's macros.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from vrx_mj.config.series.blocks import Tag
from vrx_mj.config.series.calls import Call
from vrx_mj.config.series.given import At, Given
from vrx_mj.config.series.models import thing
from vrx_mj.config.series.task_macros import DEFAULTS as TASK_DEFAULTS
from vrx_mj.config.series.task_macros import (
    Parameters,
    dock,
    gymkhana,
    nav_challenge,
    perception,
    scan_and_dock,
    scan_dock_deliver,
    stationkeeping,
    wayfinding,
    wildlife,
)
from vrx_mj.errors import UnknownNameError

__all__ = ["MACROS", "Macro", "Piece", "made"]

STALE_LINK = "base_link"
"""What VRX's files of 2019 call the boat's link, which has another name since: their wind acts on nothing."""


@dataclass(frozen=True)
class Macro:
    """What a macro takes, and makes."""

    part: str
    """Of a world, of which there is one; objects: of which there may be any number."""
    make: Callable[[Given], dict[str, Any]]
    defaults: Parameters
    blocks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Piece:
    """What a call makes of a world."""

    part: str
    call: Call
    content: dict[str, Any]
    stale: bool = False
    """Whether the call names a link that boats have no more."""


def made(call: Call) -> Piece:
    """What a call makes.

    Raises:
        ConfigError: there is no such macro, or it does not take what the call gives.
    """
    macro = MACROS.get(call.macro)
    if macro is None:
        raise call.fault(None, str(UnknownNameError("macro", call.macro, MACROS)))
    given = Given(call, macro.defaults, macro.blocks)
    stale = "wind_objs" in macro.blocks and _is_stale(given)
    return Piece(macro.part, call, macro.make(given), stale)


def _base(world: str) -> Macro:
    return Macro("base", lambda given: {"extends": At(world, given.call.place)}, {})


def _waves(given: Given) -> dict[str, Any]:
    sea = {key: given.number(key) for key in ("gain", "period", "angle", "scale")}
    return {"sea": {"model": "pms", **sea, "direction": given.numbers("direction_x direction_y")}}


def _wind(given: Given) -> dict[str, Any]:
    wind: dict[str, Any] = {
        "direction": given.number("direction"),
        "mean_velocity": given.number("mean_vel"),
        "var_gain": given.number("var_gain"),
        "var_time": given.number("var_time"),
        "seed": given.whole("seed"),
        "update_rate": given.number("ros_update_rate"),
    }
    block = given.block("wind_objs")
    if block is not None:
        wind["objects"] = At([_wind_object(tag) for tag in block.each("wind_obj")], block.place)
    return {"wind": wind}


def _wind_object(tag: Tag) -> dict[str, Any]:
    tag.only("name", "link_name", "coeff_vector")
    tag.required("coeff_vector")
    return {"model": tag.required("name"), "coefficients": tag.numbers("coeff_vector", "x y yaw")}


def _is_stale(given: Given) -> bool:
    block = given.block("wind_objs")
    return block is not None and any(tag.text("link_name") == STALE_LINK for tag in block.each("wind_obj"))


def _scene(given: Given) -> dict[str, Any]:
    scene: dict[str, Any] = {"sky": True, "grid": False, "origin_visual": False}
    ambient, fog = given.block("ambient"), given.block("fog")
    if ambient is not None and ambient.text:
        scene["ambient"] = At(_color(ambient.root, ambient.text, "/**ambient"), ambient.place)
    if fog is not None and fog.text:
        inner = fog.root.all("fog")
        scene["fog"] = At(_fog(inner[0] if inner else fog.root), fog.place)
    return {"scene": scene}


def _fog(tag: Tag) -> dict[str, Any]:
    tag.only("type", "color", "start", "end", "density")
    found: dict[str, Any] = {} if tag.text("type") is None else {"type": tag.text("type")}
    color = tag.text("color")
    if color:
        found["color"] = _color(tag, color, "<color>")
    for key in ("start", "end", "density"):
        numbers = tag.numbers(key, key)
        if numbers:
            found[key] = numbers[0]
    return found


def _color(tag: Tag, text: str, where: str) -> list[float]:
    """Red, green, blue, and alpha if it is there."""
    return tag.read_numbers(text, where, ["r", "g", "b", "a"][: 3 if len(text.split()) == 3 else 4])


def _model(given: Given) -> dict[str, Any]:
    return {"objects": [thing(given.text("uri"), given.numbers("x y z R P Y"))]}


def _task(make: Callable[[Given], dict[str, Any]], *blocks: str) -> Macro:
    return Macro("task", make, TASK_DEFAULTS[make.__name__], blocks)


MACROS: Mapping[str, Macro] = {
    "sandisland": _base("sand_island"),
    "sandisland_minus_scene": _base("sand_island"),
    "sydneyregatta": _base("sydney_regatta"),
    "sydneyregatta_minus_scene": _base("sydney_regatta"),
    "marina": _base("marina"),
    "marina_minus_scene": _base("marina"),
    "ocean_waves": Macro(
        "sea",
        _waves,
        {"gain": 0.1, "period": 5.0, "direction_x": 1.0, "direction_y": 0.0, "angle": 0.4, "scale": 1.5},
    ),
    "usv_wind_gazebo": Macro(
        "wind",
        _wind,
        {
            "direction": 270.0,
            "mean_vel": 0.0,
            "var_gain": 0.0,
            "var_time": 2.0,
            "seed": "",
            "ros_update_rate": 10.0,
            "topic_wind_speed": "",
            "topic_wind_direction": "",
        },
        ("wind_objs",),
    ),
    "scene_macro": Macro("scene", _scene, {}, ("fog", "ambient")),
    "insert_model": Macro(
        "objects", _model, {"uri": "dock_2018", "x": 60.0, "y": -2.75, "z": 0.0, "R": 0.0, "P": 0.0, "Y": 0.0}
    ),
    "stationkeeping": _task(stationkeeping, "wp_markers"),
    "wayfinding": _task(wayfinding, "wp_markers", "waypoints"),
    "perception": _task(perception, "model_includes", "object_sequence"),
    "nav_challenge": _task(nav_challenge, "gates"),
    "dock": _task(dock),
    "scan_and_dock": _task(scan_and_dock),
    "scan_dock_deliver": _task(scan_dock_deliver),
    "wildlife": _task(wildlife, "animal_includes", "animal_buoys"),
    "gymkhana": _task(gymkhana, "gates"),
}
"""All macros by name."""
