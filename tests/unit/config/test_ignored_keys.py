"""No key of a file does nothing without a word: with every kind of sea, shape, dock and more, each key is tried."""

import json
import pkgutil
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import pytest

from urdf_boats import BOX as HULL
from urdf_boats import joint, link, robot
from vrx_mj import config, formats
from vrx_mj.config.base import Config, keys_of, limited_keys, without_ignored_keys
from vrx_mj.config.docks import BayConfig, DockPlacement, PlacardConfig
from vrx_mj.config.dynamics import MarineHullConfig
from vrx_mj.config.fleet import FleetConfig
from vrx_mj.config.objects import JointConfig, ObjectConfig, PathConfig, Placement, load_object
from vrx_mj.config.robots import RudderEntry, ThrusterEntry
from vrx_mj.config.sensors import CameraConfig, LidarConfig
from vrx_mj.config.shapes import BuoyancyElement, Visual
from vrx_mj.config.tasks import DockTask
from vrx_mj.config.weather import SeaConfig, WindageConfig, WindConfig
from vrx_mj.config.world import FogConfig, load_world
from vrx_mj.errors import ConfigError, VrxError, VrxWarning
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.pieces import Pieces

Content = dict[str, Any]
Place = Callable[[Content], Content]
"""From the content of a block to the arguments of `compile_world`."""

BOX = {"type": "box", "size": [1, 1, 1]}
BUOYANCY = {"linear_drag": 1, "angular_drag": 1, "elements": [BOX]}
BODY = {"mass": 10, "inertia": [1, 1, 1], "buoyancy": BUOYANCY}
ZONE = {"center": [0, 0, 0], "size": [1, 1, 1]}
BOARD = {"name": "board", "pose": [0, 2, 2, 0, 0, 0], "symbol_pose": [0, 2, 2, 0, 0, 0]}
POSE = [1, 0, 0, 0, 0, 0]
SIX = [1, 1, 1, 1, 1, 1]
HYDRO = {
    "format": 1, "density": 1000, "gravity": 9.81, "point": [0, 0, 0], "frequencies": [1, 2], "fit_error": 0,
    "added_mass": [[SIX] * 6] * 2, "damping": [[SIX] * 6] * 2, "added_mass_infinite": [SIX] * 6,
    "diffraction": [[[[1, 0]] * 6] * 8] * 2,
}  # fmt: skip
FILES = {
    "tank.csv": "0.1, 0.0\n0.2, 2.0\n0.4, 0.0\n",
    "other.csv": "0.1, 0.0\n0.2, 1.0\n0.4, 0.0\n",
    "hull.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n",
    "other.obj": "v 0 0 0\nv 2 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n",
    "hydro.json": json.dumps(HYDRO),
    "boat.urdf": robot(
        link("screw"), joint("shaft", "screw", kind="fixed", axis="1 0 0"),
        link("pod"), joint("steering", "pod"), link("blade"), joint("stock", "blade"),
        hull=link("base_link", mass=1000, shapes=HULL),
    ),
}  # fmt: skip


DRAWING = "XXX\nX X\n"
TASK = {"type": "scan_dock_deliver", "dock": "dock", "bays": [{"symbol": "red_circle"}]}


def world(profile: str = "marine", **content: Any) -> Content:
    return {"world": {"physics": {"profile": profile}, **content}, "fleet": "none"}


def harbour(task: Content | None = None, **content: Any) -> Content:
    """A world with a dock of this content, and a task that wants to know all of it."""
    light = {"name": "light", "model": "robotx_light_buoy", "pose": [20, 0, 0, 0, 0, 0]}
    dock = {"name": "dock", "layout": DRAWING, "pose": [40, 0, 0, 0, 0, 0], **content}
    return {"world": world(docks=[dock], objects=[light], task=TASK | (task or {}))["world"]}


def thing(**content: Any) -> Content:
    """A world with an object of this content."""
    Path("thing.yaml").write_text(json.dumps(content), encoding="utf-8")
    return world(objects=[{"name": "thing", "model": "./thing.yaml"}])


def boat(**content: Any) -> Content:
    """A world with a boat of this content."""
    Path("boat.yaml").write_text(json.dumps({"urdf": "boat.urdf", **content}), encoding="utf-8")
    return {"world": world()["world"], "fleet": {"robot": "./boat.yaml"}}


def sensor(content: Content) -> Content:
    return boat(thrusters={}, sensors=[{"name": "own", "link": "base_link", **content}])


def thruster(content: Content) -> Content:
    return boat(thrusters={"main": {"mapping": "linear", "propeller": "screw", **content}})


def rudder(content: Content) -> Content:
    main = {"mapping": "linear", "propeller": "screw"}
    return boat(thrusters={"main": main}, rudders={"helm": {"joint": "stock", "area": 1, "aspect_ratio": 1, **content}})


@dataclass(frozen=True)
class Block:
    """A part of a file, of which one of its keys chooses the kind."""

    model: type[Config]
    place: Place
    kinds: dict[str, Content]
    """What each kind needs."""
    values: Content
    """A value for every other key, which is not its default."""


BLOCKS = {
    "sea.model": Block(SeaConfig, lambda content: world(sea=content), {
        "pms": {},
        "cwr": {"amplitude": 0.4},
        "none": {},
        "jonswap": {"significant_height": 1},
        "pm": {"significant_height": 1},
        "tma": {"significant_height": 0.2, "depth": 9},
        "file": {"file": "tank.csv"},
        "regular": {"height": 0.5},
        "stokes5": {"height": 0.5},
    }, {
        "number": 2, "scale": 1.7, "angle": 0.1, "steepness": 0.2, "gain": 0.3, "amplitude": 0.3, "period": 6,
        "direction": [0, 1], "tau": 3, "significant_height": 0.4, "peak_period": 7, "sea_state": 2, "gamma": 5,
        "spreading": 9, "components": 7, "amplitudes": "fixed", "record": 600,
        "height": 0.3, "file": "other.csv", "depth": 12, "density": 1000, "ramp": 4,
    }),
    "wind.spectrum": Block(WindConfig, lambda content: world(wind=content), {
        "gauss_markov": {"mean_velocity": 5}, "npd": {"mean_velocity": 5},
    }, {
        "direction": 10, "mean_velocity": 6, "var_gain": 1, "var_time": 3, "seed": 4, "update_rate": 5, "height": 9,
        "exponent": 0.1, "roughness": 0.01, "components": 9, "turning": 1, "var_direction": 2, "var_direction_time": 9,
        "objects": [],
    }),
    "fog.type": Block(FogConfig, lambda content: world(scene={"fog": content}), {
        "none": {}, "linear": {}, "exp": {}, "quadratic": {},
    }, {"color": [0.5, 0.5, 0.5], "start": 5, "end": 50, "density": 0.02}),
    "shape.type": Block(Visual, lambda content: thing(static=True, visuals=[content]), {
        "box": {"size": [1, 1, 1]},
        "sphere": {"radius": 1},
        "cylinder": {"radius": 1, "length": 1},
        "capsule": {"radius": 1, "length": 1},
        "ellipsoid": {"size": [1, 1, 1]},
        "mesh": {"file": "hull.obj"},
    }, {
        "name": "own", "size": [2, 1, 1], "radius": 2, "length": 2, "file": "other.obj", "scale": 2, "pose": POSE,
        "color": "red",
    }),
    "element.type": Block(
        BuoyancyElement, lambda content: thing(**BODY | {"buoyancy": {**BUOYANCY, "elements": [content]}}), {
        "box": {"size": [1, 1, 1]},
        "sphere": {"radius": 1},
        "cylinder": {"radius": 1, "length": 1},
    }, {"name": "own", "size": [2, 1, 1], "radius": 2, "length": 2, "pose": POSE}),
    "joint.type": Block(
        JointConfig, lambda content: thing(**BODY, links=[{"name": "arm", "mass": 1, "inertia": [1, 1, 1]}],
                                           joints=[{"name": "elbow", "parent": "link", "child": "arm", **content}]), {
        "revolute": {}, "continuous": {}, "prismatic": {}, "universal": {"axis2": {"xyz": [0, 1, 0]}}, "ball": {},
    }, {
        "name": "own", "parent": "arm", "child": "link", "pose": POSE, "axis": {"xyz": [1, 0, 0]},
        "axis2": {"xyz": [1, 1, 0]},
    }),
    "object.static": Block(ObjectConfig, lambda content: thing(**{"visuals": [{**BOX, "name": "panel"}], **content}), {
        "true": {}, "false": BODY,
    }, {
        "description": "own", "link": "own", "mass": 11, "center_of_mass": [0, 0, 0.1], "inertia": [1, 1, 1.1],
        "collisions": [BOX], "visuals": [BOX, BOX], "buoyancy": {**BUOYANCY, "linear_drag": 2},
        "path": {"circle": {"radius": 5}}, "light": {"panels": ["panel"]},
        "links": [{"name": "arm", "mass": 1, "inertia": [1, 1, 1]}],
        "joints": [{"name": "own", "type": "ball", "parent": "link", "child": "arm"}],
        "objects": [{"name": "own", "model": "mb_marker_buoy_red"}], "docks": [{"name": "own", "layout": "X"}],
    }),
    "placement.model": Block(Placement, lambda content: world(objects=[{"name": "thing", **content}]), {
        "mb_marker_buoy_red": {}, "black_totem": {}, "short_navigation_course0": {}, "dock_2022": {},
    }, {
        "name": "own", "pose": POSE, "path": {"circle": {"radius": 5}}, "symbols": ["red_cross"],
        "mooring": {"length": 3},
    }),
    "path": Block(PathConfig, lambda content: thing(**BODY, path=content), {
        "waypoints": {"waypoints": [[0, 0], [1, 1]]}, "circle": {"circle": {"radius": 5}},
        "line": {"line": {"length": 5}},
    }, {
        "waypoints": [[0, 0], [2, 1]], "circle": {"radius": 6}, "line": {"length": 6}, "force": 9, "torque": 2,
        "bearing_tolerance": 3, "range_tolerance": 1, "loop": False, "start": 1, "turns_first": True,
    }),
    "dock.dynamic": Block(DockPlacement, lambda content: harbour(**content), {
        "true": {"placards": [{**BOARD, "block": [0, 0]}]}, "false": {"placards": [BOARD]},
    }, {
        "name": "own", "pose": POSE, "layout": "XX", "block": 1, "mooring": {"stiffness": 1000},
        "bays": [{"name": "own"}], "placards": [{"name": "own", "pose": POSE, "symbol_pose": POSE}],
        "holes": [{"bay": 1, "size": "big", "center": [1, 1, 1], "box": [1, 1, 1]}], "symbols": ["red_cross"],
    }),
    "bay.placard": Block(
        BayConfig, lambda content: harbour(bays=[content]), {
        "placard": {}, "placard_2022": {}, "none": {},
    }, {"name": "own", "symbol": "red_cross", "internal": ZONE, "external": ZONE}),
    "placard.model": Block(
        PlacardConfig, lambda content: harbour(placards=[{**BOARD, **content}]), {
        "placard": {}, "placard_2022": {},
    }, {
        "name": "own", "pose": SIX, "symbol_pose": SIX, "symbol": "red_cross", "shapes": ["cross"], "block": [0, 2],
    }),
    "fleet.layout": Block(FleetConfig, lambda content: {
        **world(spawn={"pose": [9, 0, 0, 0, 0, 0]}), "fleet": {"name": "f", "usv_count": 2, **content}}, {
        **{name: {"heading": 10} for name in ("circle", "line", "column", "wedge", "grid", "random")},
        "": {"positions": [{"x": 0, "y": 0}, {"x": 0, "y": 20, "Y": 30}]},
    }, {
        "robot": "skiff", "arguments": {"locked": True}, "thrusters": "X", "components": "./x.yaml", "sensors": "none",
        "engines": "hinged", "controller": "a:b", "ais": "A", "name": "own", "description": "own", "usv_count": 3,
        "radius": 30, "start_angle": 20, "spacing": 15, "size": 200, "seed": 9, "heading": 45, "headings": "compass",
        "positions": [{"x": 0, "y": 0}, {"x": 0, "y": 30}], "origin": "spawn", "boats": [{"name": "own"}],
    }),
    "task.type": Block(DockTask, lambda content: harbour(
        placards=[{**BOARD, "model": "placard_2022"}], task={"bays": [{"symbol": "blue_cross"}], **content}), {
        "dock": {}, "scan_and_dock": {}, "scan_dock_deliver": {},
    }, {
        "name": "own", "boat": "own", "initial_state_duration": 3, "ready_state_duration": 3,
        "running_state_duration": 100, "collision_buffer": 5, "locked": False, "dock": "own",
        "bays": [{"symbol": "red_cross"}], "light_buoy": "light", "color_sequence": ["red", "red", "red"],
        "color_bonus_points": 7, "dock_bonus_points": 7, "correct_dock_bonus_points": 7,
        "enable_color_checker": "own", "min_dock_time": 7, "targets": [{"bay": 1, "size": "big", "points": 3}],
    }),
    "lidar.output": Block(LidarConfig, lambda content: sensor({"type": "lidar", **content}), {
        "points": {}, "scan": {"rings": 1},
    }, {
        "type": "own", "name": "mine", "link": "pod", "frame": "own", "pose": POSE, "topic": "own", "rate": 7,
        "rings": 4, "samples": 90, "azimuth": [-1, 1], "elevation": [-0.1, 0.1], "range": [1, 9], "resolution": 0.1,
        "noise": 0.3, "sea_returns": True,
    }),
    "camera.info": Block(CameraConfig, lambda content: sensor({"type": "camera", **content}), {
        "vrx": {}, "vrx3": {}, "centered": {},
    }, {
        "type": "own", "name": "mine", "link": "pod", "frame": "own", "pose": POSE, "topic": "own", "rate": 7,
        "width": 90, "height": 90, "horizontal_fov": 1, "near": 1, "far": 9, "noise": 0.3, "baseline": 0.1,
        "antialiasing": 4, "labels": True,
    }),
    "windage": Block(WindageConfig, lambda content: boat(
        windage={"frontal_area": 1, "lateral_area": 2, "length": 3, "height": 1, **content}), {
        "coefficients": {"coefficients": [1, 1, 1]}, "curve": {"curve": [[0, 1, 0, 0], [180, 1, 0, 0]]},
        "isherwood": {"isherwood": {"breadth": 1, "perimeter": 3}}, "vessel": {"vessel": "ferry"},
    }, {
        "frontal_area": 2, "lateral_area": 3, "length": 4, "height": 2, "offset": 1, "coefficients": [2, 1, 1],
        "curve": [[0, 2, 0, 0], [180, 1, 0, 0]], "isherwood": {"breadth": 2, "perimeter": 3}, "vessel": "tender",
    }),
    "hull.hydrostatics": Block(MarineHullConfig, lambda content: boat(hull=content), {
        "mesh": {}, "matrix": {"restoring": [0, 0, 9000, 9000, 9000, 0]},
    }, {
        "shapes": [{"type": "box", "size": [3, 1, 1]}], "point": [1, 0, 0], "added_mass": SIX, "munk": False,
        "damping_linear": SIX, "damping_quadratic": SIX,
        "crossflow": {"stern": -1, "bow": 1, "draft": 0.2, "coefficient": 1}, "restoring": [0, 0, 8000, 9000, 9000, 0],
        "displacement": 900, "waterline": 0.1, "hydro": "hydro.json", "diffraction": False,
        "resistance": [[0, 0], [1, 30], [2, 200]],
        "skegs": [{"x": -1, "z": -0.2, "area": 0.1, "aspect_ratio": 1}],
    }),
    "thruster.joint": Block(ThrusterEntry, thruster, {
        "": {}, "steering": {"propeller": "pod", "joint": "steering"},
    }, {
        "mapping": "glf", "max_command": 2, "max_force_forward": 300, "max_force_reverse": -200, "timeout": 2,
        "max_angle": 0.5, "propeller": "blade", "servo": {"kp": 1, "kd": 1, "effort": 1, "velocity": 1},
    }),
    "thruster.mapping": Block(ThrusterEntry, thruster, {"linear": {}, "glf": {}, "newtons": {}}, {
        "max_command": 2, "max_force_forward": 300, "max_force_reverse": -200, "timeout": 2, "propeller": "blade",
        "joint": "steering", "max_angle": 0.5, "servo": {"kp": 1, "kd": 1, "effort": 1, "velocity": 1},
    }),
    "rudder.propeller": Block(RudderEntry, rudder, {
        "": {}, "main": {"propeller_diameter": 0.5},
    }, {
        "joint": "steering", "area": 2, "aspect_ratio": 2, "center": [0.1, 0, 0], "propeller_diameter": 0.6,
        "race_share": 0.5, "max_angle": 0.3, "servo": {"kp": 1, "kd": 1, "effort": 1, "velocity": 1},
    }),
}  # fmt: skip
_hull = BLOCKS["hull.hydrostatics"]
BLOCKS["sea.amplitudes"] = Block(
    SeaConfig, lambda content: world(sea={"model": "jonswap", "significant_height": 1, **content}),
    {"drawn": {}, "fixed": {}}, {**BLOCKS["sea.model"].values, "model": "pm"},
)  # fmt: skip
BLOCKS["hull.hydro"] = Block(
    MarineHullConfig, _hull.place, {"": {}, "hydro.json": {}}, {**_hull.values, "hydrostatics": "matrix"}
)
for name in ("sea.model", "wind.spectrum"):
    for profile in ("vrx", "vrx3"):
        part, known = name.partition(".")[0], BLOCKS[name]

        def place(content: Content, part: str = part, profile: str = profile) -> Content:
            return world(profile, **{part: content})

        kinds = known.kinds if part == "sea" else {"": {"mean_velocity": 5}}
        BLOCKS[f"{name} of {profile}"] = Block(known.model, place, kinds, known.values)
LOOKED_AT = {"description"}
"""Keys that only lists of files show."""
REFERRED_TO = {(BuoyancyElement, "name"), (Visual, "name")}
"""Names for other keys to refer to."""
FREE = {
    "AnimalConfig.goal", "BoatConfig.ais", "BoatConfig.engines", "BoatEntry.ais", "BoatEntry.engines",
    "CameraConfig.antialiasing", "FleetConfig.ais", "FleetConfig.engines",
    "FleetConfig.headings", "FleetConfig.heading", "FleetConfig.origin", "HoleConfig.size", "Layout.headings",
    "Layout.heading", "Rules.release",
    "_JoiningBoat.ais", "_JoiningBoat.engines",
    "StationkeepingTask.type", "TargetConfig.size", "_BoatKeys.ais", "_BoatKeys.engines",
    "WindageConfig.vessel", "PhysicsConfig.profile",
}  # fmt: skip
"""Choices with which no other key of theirs has another meaning; that of the profile is tried with sea and wind."""


def outcome(arguments: Content) -> object:
    """The compiled world, the refusal or the warnings; worlds of the same MJCF and tables are equal."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            found = compile_world(**arguments)
        except VrxError as error:
            return str(error)
    return (found.mjcf, found.assets, found.parameters, sorted(str(one.message) for one in told))


@pytest.fixture(autouse=True)
def _files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        (tmp_path / name).write_text(text, encoding="utf-8")


SLOW = {("hull.hydro", ""), ("hull.hydrostatics", "mesh"), ("fleet.layout", "circle")}
"""Kinds of which a world takes long to compile, or which have the most keys."""


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        pytest.param(name, kind, marks=[pytest.mark.slow] * ((name, kind) in SLOW))
        for name, block in BLOCKS.items()
        for kind in block.kinds
    ],
)
def test_every_key_of_every_kind_changes_the_world_or_is_refused(name, kind, monkeypatch):
    block, selector = BLOCKS[name], name.partition(".")[2].partition(" ")[0]
    assert set(block.values) | {selector} == {*keys_of(block.model), selector}
    chosen = {selector: {"true": True, "false": False}.get(kind, kind)} if selector and kind else {}
    own = {**block.kinds[kind], **chosen}
    plain = outcome(block.place(own))
    assert isinstance(plain, tuple), plain
    monkeypatch.setattr(Pieces, "check", lambda _: None)  # what MuJoCo refuses has changed
    others = {key: value for key, value in block.values.items() if key != selector}
    silent = [key for key, value in others.items() if outcome(block.place({**own, key: value})) == plain]
    assert [key for key in silent if key not in LOOKED_AT and (block.model, key) not in REFERRED_TO] == []


for package in (config, formats):
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        import_module(module.name)


def models(base: type[Config] = Config) -> Iterator[type[Config]]:
    """Every model of files."""
    for model in base.__subclasses__():
        if model.__module__.startswith(("vrx_mj.config.", "vrx_mj.formats.")):
            yield model
        yield from models(model)


def is_choice(annotation: object) -> bool:
    """Whether a key takes one of several words."""
    if get_origin(annotation) is Literal:
        return len(get_args(annotation)) > 1
    return get_origin(annotation) is not tuple and any(map(is_choice, get_args(annotation)))


def test_every_choice_of_a_file_is_tried():
    choices = {(model, key) for model in models() for key, field in model.model_fields.items()
               if is_choice(field.annotation)}  # fmt: skip
    choices |= {(model, only.selector) for model in models() for _, only in limited_keys(model)}
    tried = [(block.model, name.partition(".")[2]) for name, block in BLOCKS.items()]
    left = {f"{model.__name__}.{key}" for model, key in choices
            if not any(issubclass(other, model) and key == selector for other, selector in tried)}  # fmt: skip
    assert left == FREE


def test_no_model_has_a_key_that_all_of_its_kinds_refuse():
    refused = [f"{model.__name__}.{key}" for model in models() for key, only in limited_keys(model)
               if get_origin(kinds := model.model_fields[only.selector].annotation) is Literal
               and only.values and not set(only.values) & set(get_args(kinds))]  # fmt: skip
    assert refused == []


def written(**files: str) -> None:
    for name, text in files.items():
        Path(f"{name}.yaml").write_text(text, encoding="utf-8")


@pytest.mark.parametrize("middle", ["", "wind: {mean_velocity: 2}\n"])
def test_keys_of_a_base_fall_away_with_its_kind(middle):
    base = "sea: {model: jonswap, significant_height: 1, gamma: 5}\nscene: {fog: {type: linear, end: 50}}\n"
    written(
        base=base,
        middle=f"extends: ./base.yaml\n{middle}",
        bay="extends: ./middle.yaml\nsea: {model: pms}\nscene: {fog: {type: exp}}\n",
        cove="extends: ./bay.yaml\nsea: {gain: 0.3}\n",
    )
    assert load_world("bay.yaml").sea == SeaConfig(folder=Path.cwd(), model="pms")
    assert load_world("cove.yaml").sea == SeaConfig(folder=Path.cwd(), model="pms", gain=0.3)
    assert load_world("bay.yaml").scene.fog == FogConfig(type="exp")
    assert load_world({"extends": "./base.yaml", "sea": {"model": "none"}}).sea.significant_height is None


def test_a_key_that_the_kind_of_a_base_does_not_have_is_refused_with_the_place_of_that():
    written(base="sea: {model: pms}\n", bay="extends: ./base.yaml\nsea: {amplitude: 0.2}\n")
    with pytest.raises(ConfigError) as caught:
        load_world("bay.yaml")
    assert str(caught.value) == (
        "bay.yaml:2:18: sea.amplitude: not allowed for `model: pms`; allowed for cwr; model is from base.yaml:1"
    )


def test_where_no_kind_is_given_its_default_counts():
    given = {"gain": 0.3, "significant_height": 1.0, "direction": [0.0, 1.0]}
    assert SeaConfig.model_fields["model"].default == "pms"
    assert without_ignored_keys(SeaConfig, given) == {"gain": 0.3, "direction": [0.0, 1.0]}
    assert without_ignored_keys(SeaConfig, {"model": "jonswap", **given}).keys() == given.keys() - {"gain"} | {"model"}


def test_a_floating_object_is_fixed_by_one_key():
    written(post="extends: ./buoy.yaml\nstatic: true\n", buoy=json.dumps(BODY))
    assert load_object("./post.yaml", Path.cwd()).kind == "static"


@pytest.mark.parametrize("profile", ["vrx", "vrx3", "marine"])
def test_a_height_of_a_spectrum_on_top_of_another_sea_makes_it_one(profile):
    written(storm="extends: base.yaml\nsea: {significant_height: 1.0, peak_period: 6}\n",
            base=f"physics: {{profile: {profile}}}\nsea: {{model: pms, gain: 0.1, period: 5, tau: 2}}\n")  # fmt: skip
    with pytest.warns(VrxWarning, match=r"its sea is jonswap: `pms` has no significant height"):
        sea = compile_world("./storm.yaml").parameters.sea
    assert (sea.model, sea.significant_height, sea.period) == ("jonswap", 1.0, 6.0)
    variance = sum(wave.amplitude**2 for wave in sea.waves) / 2
    assert 4 * variance**0.5 == pytest.approx(1.0, rel=1e-9)


def test_what_has_no_pose_is_at_the_origin_of_its_frame():
    poses = {model.__name__: model.model_fields["pose"].default for model in models() if "pose" in model.model_fields}
    given = {name: pose for name, pose in poses.items() if isinstance(pose, tuple)}
    assert len(given) > 10
    assert {name: pose for name, pose in given.items() if any(pose)} == {"SpawnConfig": (0.0, 0.0, 0.1, 0.0, 0.0, 0.0)}
