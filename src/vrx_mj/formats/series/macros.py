"""The macros of VRX's worlds (vrx_gazebo/worlds/xacros, gazebo_classic): what they take and what they make."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from vrx_mj.config.base import COLORS, without_ignored_keys
from vrx_mj.config.scene import FogConfig
from vrx_mj.errors import UnknownNameError
from vrx_mj.formats.series.calls import BLOCK, REQUIRED, At, Block, Call, Given, Tag, included, thing
from vrx_mj.formats.series.pieces import Piece

Parameters = Mapping[str, Any]
BOAT = "wamv"
GEODETIC = "latitude longitude yaw"

_TEAM: Parameters = {"namespace": BOAT, "competition": "vrx"}
_DOCK: Parameters = {
    "model_name": "robotx_dock_2018", "uri": "dock_2018", "x": 60.0, "y": -2.75, "z": 0.0, "R": 0.0, "P": 0.0, "Y": 0.0,
    "bay1_allowed": False, "bay1_symbol": "red_circle", "bay2_allowed": True, "bay2_symbol": "blue_cross",
    "light_buoy_present": False, "color_1": "red", "color_2": "green", "color_3": "blue",
    "lb_x": 90.0, "lb_y": 70.0, "lb_z": 0.0, "lb_R": 0.0, "lb_P": 0.0, "lb_Y": 0.0,
    "enable_color_checker": False, "task_name": "dock",
}  # fmt: skip
TASK_DEFAULTS: Mapping[str, Parameters] = {
    "stationkeeping": {"lat": 21.31091, "lon": -157.88868, "heading": 0.0, **_TEAM},
    "wayfinding": _TEAM,
    "perception": _TEAM,
    "nav_challenge": {
        "name": REQUIRED, "uri": "navigation_course", "x": 58.0, "y": 68.0, "z": 2.0, "R": 0.0, "P": 0.0, "Y": 0.4,
        "running_duration": 300.0,
    },
    "dock": _DOCK,
    "scan_and_dock": {},
    "scan_dock_deliver": {
        **_DOCK,
        "model_name": "robotx_dock_2022",
        "uri": "dock_2022",  # VRX's is dock_2018, which has neither a third bay nor holes
        "bay3_allowed": False,
        "bay3_symbol": "blue_cross",
        "color_1": "blue",
        "color_3": "red",
        "task_name": "scan_dock_deliver",
    },
    "wildlife": _TEAM,
    "gymkhana": {
        "name": "gymkhana", "nav_uri": "short_navigation_course0", "obstacle_uri": "obstacle_course",
        "nx": -524.0, "ny": 186.0, "nz": 0.0, "nR": 0.0, "nP": 0.0, "nY": -1.44,
        "ox": -477.0, "oy": 275.0, "oz": 0.0, "oR": 0.0, "oP": 0.0, "oY": 2.54,
        "gx": -483.0, "gy": 295.5, "running_duration": 300.0,
    },
}  # fmt: skip
"""Parameters of the macros with VRX's defaults."""


def stationkeeping(given: Given) -> dict[str, object]:
    """Hold a pose."""
    goal = given.numbers("lat lon heading")
    return {"task": {"type": "stationkeeping", "goal": goal, **_boat(given)}, **_markers(given)}


def wayfinding(given: Given) -> dict[str, object]:
    """Visit poses."""
    block = _needed(given, "waypoints")
    poses = [_waypoint(tag) for tag in block.each("waypoint")]
    return {"task": {"type": "wayfinding", "waypoints": At(poses, block.place), **_boat(given)}, **_markers(given)}


def perception(given: Given) -> dict[str, object]:
    """Name and place objects that show up before the boat."""
    models, shown = _needed(given, "model_includes"), _needed(given, "object_sequence")
    task = {"type": "perception", "objects": At([_shown(tag) for tag in shown.each("object")], shown.place)}
    return {
        "objects": [included(tag, models.place) for tag in models.each("include")],
        "task": {**task, **_boat(given)},
    }


def nav_challenge(given: Given) -> dict[str, object]:
    """Pass the gates of a channel."""
    name = given.text("name")
    task = {
        "type": "navigation_course",
        "course": name,
        "running_state_duration": given.number("running_duration"),
        **_gates(given),
    }
    return {"objects": [thing(given.text("uri"), given.numbers("x y z R P Y"), name)], "task": task}


def dock(given: Given) -> dict[str, object]:
    """Dock at a dock of two bays; with a light buoy, as its colours demand."""
    kind = "scan_and_dock" if given.switch("light_buoy_present").value else "dock"
    return _docking(given, kind, 2, {})


def scan_dock_deliver(given: Given) -> dict[str, object]:
    """Dock at a dock of three bays as the light buoy's colours demand, and throw balls."""
    return _docking(given, "scan_dock_deliver", 3, _SHORT)


def scan_and_dock(_: Given) -> dict[str, object]:
    """Dock as the light buoy's colours demand, at fixed places.

    VRX's macro has no symbols, and its bays never detect a boat. The symbol that is right by its colours, red
    then blue, is a red cross; the other placard has the blue circle that placards start with.
    """
    bays = [
        {"name": "bay1", "symbol": "blue_circle"},
        {"name": "bay2", "symbol": "red_cross", "dock_allowed": True},
    ]
    task = {"type": "scan_and_dock", **_SHORT, "dock": "robotx_dock_2018", "light_buoy": "robotx_light_buoy"}
    return {
        "objects": [
            {"name": "robotx_light_buoy", "model": "robotx_light_buoy", "pose": [90.0, 70.0, 0.25, 0.0, 0.0, 0.0]},
            {"name": "robotx_dock_2018", "model": "dock_2018", "pose": [60.0, -2.75, 0.0, 0.0, 0.0, 0.0]},
        ],
        "task": {**task, "color_sequence": ["red", "green", "blue"], "bays": bays},
    }


def wildlife(given: Given) -> dict[str, object]:
    """Keep away from some animals and circle others."""
    models, animals = _needed(given, "animal_includes"), _needed(given, "animal_buoys")
    task = {"type": "wildlife", "animals": At([_animal(tag) for tag in animals.each("buoy")], animals.place)}
    return {
        "objects": [included(tag, models.place) for tag in models.each("include")],
        "task": {**task, **_boat(given)},
    }


def gymkhana(given: Given) -> dict[str, object]:
    """Pass a channel, then find a beacon behind obstacles."""
    name = given.text("name")
    course = At(f"{name.value}_navigation_course", name.place)
    objects = [thing(given.text("nav_uri"), given.numbers("nx ny nz nR nP nY"), course)]
    if given.text("obstacle_uri").value:  # a competition world had none
        obstacles = At(f"{name.value}_obstacle_course", name.place)
        objects.append(thing(given.text("obstacle_uri"), given.numbers("ox oy oz oR oP oY"), obstacles))
    task = {
        "type": "gymkhana",
        "running_state_duration": given.number("running_duration"),
        "channel": {"course": course, **_gates(given)},
        "pinger": [*given.numbers("gx gy"), 0.0],
    }
    return {"objects": objects, "task": task}


_SHORT: Parameters = {"initial_state_duration": 3.0, "ready_state_duration": 3.0}


def _docking(given: Given, kind: str, bays: int, durations: Parameters) -> dict[str, object]:
    light, checker, name = (
        given.switch("light_buoy_present"),
        given.switch("enable_color_checker"),
        given.text("model_name"),
    )
    objects = [thing(given.text("uri"), given.numbers("x y z R P Y"), name)]
    task: dict[str, Any] = {"type": kind, "name": given.text("task_name"), **durations, "dock": name}
    if light.value:
        buoy = {"name": "robotx_light_buoy", "model": "robotx_light_buoy"}
        objects.append({**buoy, "pose": given.numbers("lb_x lb_y lb_z lb_R lb_P lb_Y")})
        task["light_buoy"] = At(buoy["name"], light.place)
    if light.value or checker.value:
        task["color_sequence"] = [given.text(f"color_{i}") for i in (1, 2, 3)]
    signs = [
        {"name": f"bay{i}", "symbol": given.text(f"bay{i}_symbol"), "dock_allowed": given.switch(f"bay{i}_allowed")}
        for i in range(1, bays + 1)
    ]
    return {"objects": objects, "task": {**task, "enable_color_checker": checker, "bays": signs}}


def _needed(given: Given, name: str) -> Block:
    block = given.block(name)
    if block is None:
        raise given.call.needs(BLOCK + name)
    return block


def _boat(given: Given) -> Parameters:
    boat = given.text("namespace")
    return {} if boat.value == BOAT else {"boat": boat}


def _gates(given: Given) -> Parameters:
    """Gates as the call lists them; without any, all those of the course."""
    block = given.block("gates")
    return {} if block is None else {"gates": At([_gate(tag) for tag in block.each("gate")], block.place)}


def _gate(tag: Tag) -> list[str]:
    tag.only("left_marker", "right_marker")
    return [tag.required("left_marker"), tag.required("right_marker")]


def _waypoint(tag: Tag) -> list[float]:
    tag.only("pose")
    tag.required("pose")
    return tag.numbers("pose", GEODETIC) or []


def _shown(tag: Tag) -> dict[str, object]:
    tag.only("time", "duration", "type", "name", "pose")
    found: dict[str, Any] = {key: tag.required(key) for key in ("type", "name")}
    for key in ("time", "duration"):
        numbers = tag.numbers(key, key)
        if numbers:
            found[key] = numbers[0]
    pose = tag.numbers("pose", "x y z roll pitch yaw")
    return {**found, "pose": pose} if pose else found


def _animal(tag: Tag) -> dict[str, object]:
    tag.only("model_name", "link_name", "name", "goal")
    name = tag.text("model_name") or tag.text("name") or tag.required("link_name")
    return {"name": name.partition("::")[0], "goal": tag.required("goal")}


def _markers(given: Given) -> Parameters:
    """How the places that the task is about are marked."""
    block = given.block("wp_markers")
    tags = [] if block is None else list(block.each("markers"))
    if block is None or not tags:
        return {}
    tags[0].only("scaling", "height", "material", "initial_id")
    scaling, height = tags[0].numbers("scaling", "x y z"), tags[0].numbers("height", "height")
    color = (tags[0].text("material") or "").rpartition("/")[2].lower()
    found = {
        **({"scaling": scaling} if scaling else {}),
        **({"height": height[0]} if height else {}),
        **({"color": color} if color in COLORS else {}),
    }
    return {"markers": At(found, block.place)}


STALE_LINK = "base_link"
"""What VRX's files of 2019 call the boat's link, which has another name since: their wind acts on nothing."""


@dataclass(frozen=True)
class Macro:
    """What a macro takes, and makes."""

    part: str
    """Part of the world that the macro makes; there is one of each, but any number of objects."""
    make: Callable[[Given], dict[str, Any]]
    defaults: Parameters
    blocks: tuple[str, ...] = ()


def made(call: Call) -> Piece:
    """What a call makes.

    Raises:
        ConfigError: the macro is unknown, or does not take what the call gives.
    """
    macro = MACROS.get(call.macro)
    if macro is None:
        raise call.fault(None, str(UnknownNameError("macro", call.macro, MACROS)))
    given = Given(call, macro.defaults, macro.blocks)
    stale = "wind_objs" in macro.blocks and _is_stale(given)
    return Piece(macro.part, call.macro, call.place, call.loc, macro.make(given), stale)


def _base(world: str) -> Macro:
    return Macro("base", lambda given: {"extends": At(world, given.call.place)}, {})


def _waves(given: Given) -> dict[str, object]:
    sea = {key: given.number(key) for key in ("gain", "period", "angle", "scale")}
    return {"sea": {"model": "pms", **sea, "direction": given.numbers("direction_x direction_y")}}


def _wind(given: Given) -> dict[str, object]:
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


def _wind_object(tag: Tag) -> dict[str, object]:
    tag.only("name", "link_name", "coeff_vector")
    tag.required("coeff_vector")
    return {"model": tag.required("name"), "coefficients": tag.numbers("coeff_vector", "x y yaw")}


def _is_stale(given: Given) -> bool:
    block = given.block("wind_objs")
    return block is not None and any(tag.text("link_name") == STALE_LINK for tag in block.each("wind_obj"))


def _scene(given: Given) -> dict[str, object]:
    scene: dict[str, Any] = {"sky": True, "grid": False, "origin_visual": False}
    ambient, fog = given.block("ambient"), given.block("fog")
    if ambient is not None and ambient.text:
        scene["ambient"] = At(_color(ambient.root, ambient.text, "/**ambient"), ambient.place)
    if fog is not None and fog.text:
        inner = fog.root.all("fog")
        scene["fog"] = At(_fog(inner[0] if inner else fog.root), fog.place)
    return {"scene": scene}


def _fog(tag: Tag) -> dict[str, object]:
    tag.only("type", "color", "start", "end", "density")
    found: dict[str, Any] = {} if tag.text("type") is None else {"type": tag.text("type")}
    color = tag.text("color")
    if color:
        found["color"] = _color(tag, color, "<color>")
    for key in ("start", "end", "density"):
        numbers = tag.numbers(key, key)
        if numbers:
            found[key] = numbers[0]
    return without_ignored_keys(FogConfig, found)


def _color(tag: Tag, text: str, where: str) -> list[float]:
    """Red, green, blue, and alpha if it is there."""
    return tag.read_numbers(text, where, ["r", "g", "b", "a"][: 3 if len(text.split()) == 3 else 4])


def _model(given: Given) -> dict[str, object]:
    return {"objects": [thing(given.text("uri"), given.numbers("x y z R P Y"))]}


def _task(make: Callable[[Given], dict[str, object]], *blocks: str) -> Macro:
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
