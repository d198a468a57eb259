"""Robots: a boat's configuration as one MuJoCo model, and as rows of the runtime's tables.

A boat is one body, `base_link`, whose frame is that of VRX's URDF. With fixed engines everything is part of it;
with hinged engines each engine, with its propeller, is a child body on a hinge about z. Propellers have no joint:
their spin is only looks. There are no actuators: the runtime's kernels apply thrust and steer the hinges.
"""

import hashlib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from vrx_mj.compiler.masses import MassProperties, axis_inertia, joined, mounted, rigid
from vrx_mj.compiler.templates import render
from vrx_mj.config.robots import Mount, RobotConfig
from vrx_mj.config.shapes import Shape
from vrx_mj.constants import HULL_GRAVITY
from vrx_mj.errors import UnknownNameError

__all__ = [
    "Engines",
    "RobotModel",
    "boat_mass",
    "engine_mass",
    "hull_row",
    "link_mass",
    "robot_mjcf",
    "thruster_rows",
]

Engines = Literal["fixed", "hinged"]
"""Are the engines part of the hull's body, or bodies of their own that turn about z?"""

MAPPINGS = {"linear": 0, "glf": 1}
"""Codes of the thrust mappings in the runtime's table."""


@dataclass(frozen=True)
class RobotModel:
    """A boat as MJCF, with the mesh files it names."""

    mjcf: str
    assets: dict[str, bytes]
    base: MassProperties
    """Of the body `base_link`: the whole boat with fixed engines, hull and batteries with hinged ones."""


def link_mass(config: RobotConfig) -> MassProperties:
    """Hull and batteries, joined: VRX's base link, at whose centre of mass its plugins push. Frame: base_link."""
    return joined(rigid(body.mass, body.center_of_mass, body.inertia) for body in config.bodies)


def engine_mass(config: RobotConfig) -> MassProperties:
    """An engine with its propeller, in the frame of the hinge it steers on."""
    engine, propeller = config.engine, config.engine.propeller
    return joined(
        [
            rigid(engine.mass, (0.0, 0.0, 0.0), engine.inertia),
            rigid(propeller.mass, propeller.position, propeller.inertia),
        ]
    )


def boat_mass(config: RobotConfig, layout: str) -> MassProperties:
    """The whole boat with its engines at zero steering angle, in the frame of base_link."""
    engine = engine_mass(config)
    engines = [mounted(engine, mount.position, mount.yaw) for mount in mounts(config, layout)]
    return joined([link_mass(config), *engines])


def body_mass(config: RobotConfig, layout: str, engines: Engines) -> MassProperties:
    """What belongs to the MuJoCo body `base_link`."""
    return boat_mass(config, layout) if engines == "fixed" else link_mass(config)


def mounts(config: RobotConfig, layout: str) -> tuple[Mount, ...]:
    """Where the engines of a thruster layout stand.

    Raises:
        UnknownNameError: the robot has no layout of this name.
    """
    if layout not in config.layouts:
        raise UnknownNameError("thruster layout", layout, known=config.layouts)
    return tuple(config.layouts[layout])


def robot_mjcf(
    config: RobotConfig,
    layout: str,
    engines: Engines = "fixed",
    color: tuple[float, float, float, float] | None = None,
) -> RobotModel:
    """The boat as a MuJoCo model of its own, to be attached under a prefix.

    Collision geoms are in group 3, visual ones in group 2. `color` repaints the first visual, the boat's skin.
    """
    base = body_mass(config, layout, engines)
    painted = config if color is None else _repainted(config, color)
    contents = {shape.file: _content(shape) for shape in _shapes(config) if shape.file}
    files = {file: _asset_name(file, content) for file, content in contents.items()}
    text = render(
        "robot.xml.j2",
        robot=painted,
        base=base,
        engine_mass=engine_mass(config),
        thrusters=mounts(config, layout),
        hinged=engines == "hinged",
        meshes=_mesh_names(config),
        files=files,
        pi=math.pi,
    )
    return RobotModel(text, {files[file]: content for file, content in contents.items()}, base)


def hull_row(config: RobotConfig, layout: str, engines: Engines, prefix: str) -> dict[str, Any]:
    """The boat's row of the runtime's table of hulls, with names where that has ids.

    `link_com` is where VRX's plugins push, the centre of mass of hull and batteries; `body_com` and `mass` are
    those of the MuJoCo body. The wind's coefficients belong to the world, which fills them in.
    """
    water = config.hydrodynamics
    body = body_mass(config, layout, engines)
    return {
        "body": prefix + config.link,
        "joint": prefix + "free",
        "length": water.boat_length,
        "beam": water.boat_width,
        "radius": water.hull_radius,
        "stations": water.length_n,
        "density": water.water_density,
        "gravity": HULL_GRAVITY,
        "level": water.water_level,
        "added_mass": list(water.added_mass),
        "drag_linear": list(water.drag_linear),
        "drag_quadratic": list(water.drag_quadratic),
        "link_com": link_mass(config).center.tolist(),
        "body_com": body.center.tolist(),
        "mass": body.mass,
        "wind": [0.0, 0.0, 0.0],
        "thruster_count": len(mounts(config, layout)),
    }


def thruster_rows(config: RobotConfig, layout: str, engines: Engines, prefix: str) -> list[dict[str, Any]]:
    """The boat's rows of the runtime's table of thrusters, with names where that has ids.

    `body` is what the thrust pushes and `joint` the hinge, null if the engine is fixed; `position` and `yaw` are
    of the hinge in base_link, `propeller` is in the hinge's frame, `body_com` in that of `body`.
    """
    return [_thruster_row(config, mount, layout, engines, prefix) for mount in mounts(config, layout)]


def _thruster_row(
    config: RobotConfig, mount: Mount, layout: str, engines: Engines, prefix: str
) -> dict[str, Any]:
    engine, thruster, hinged = engine_mass(config), config.thruster, engines == "hinged"
    body = engine if hinged else boat_mass(config, layout)
    return {
        "name": mount.name,
        "hull": prefix + config.link,
        "body": prefix + (f"{mount.name}_engine_link" if hinged else config.link),
        "joint": f"{prefix}{mount.name}_chasis_engine_joint" if hinged else None,
        "position": list(mount.position),
        "yaw": mount.yaw,
        "propeller": list(config.engine.propeller.position),
        "body_com": body.center.tolist(),
        "mapping": MAPPINGS[thruster.mapping],
        "max_command": thruster.max_command,
        "max_forward": thruster.max_force_forward,
        "max_reverse": thruster.max_force_reverse,
        "timeout": thruster.timeout,
        "max_angle": thruster.max_angle,
        **config.engine.servo.model_dump(include={"kp", "kd", "effort", "velocity"}),
        "inertia": axis_inertia(engine),
    }


def _shapes(config: RobotConfig) -> Iterator[Shape]:
    for part in (config, config.engine, config.engine.propeller):
        yield from part.collisions
        yield from part.visuals


def _repainted(config: RobotConfig, color: tuple[float, float, float, float]) -> RobotConfig:
    skin, *rest = config.visuals
    return config.model_copy(update={"visuals": (skin.model_copy(update={"color": color}), *rest)})


def _mesh_names(config: RobotConfig) -> dict[tuple[str, tuple[float, float, float]], str]:
    """A name for each mesh at each scale: the file's stem, numbered from the second use of it on."""
    names: dict[tuple[str, tuple[float, float, float]], str] = {}
    for shape in _shapes(config):
        if shape.file is not None and (shape.file, shape.scale) not in names:
            stem = Path(shape.file).stem
            taken = sum(Path(file).stem == stem for file, _ in names)
            names[shape.file, shape.scale] = f"{stem}_{taken}" if taken else stem
    return names


def _content(shape: Shape) -> bytes:
    assert shape.file is not None
    return (shape.folder or Path()).joinpath(shape.file).read_bytes()


def _asset_name(file: str, content: bytes) -> str:
    """A name that two different files never share, however many robots and objects a world has."""
    path = Path(file)
    return f"{path.stem}-{hashlib.sha256(content).hexdigest()[:12]}{path.suffix.lower()}"
