"""Robots: a boat's configuration as one MuJoCo model, and as rows of the runtime's tables.

A boat is one body, `base_link`, whose frame is that of VRX's URDF. With fixed engines everything is part of
it; with hinged engines each engine, with its propeller, is a child body on a hinge about z. Propellers have
no joint: their spin is only looks. There are no actuators: the runtime's kernels thrust and steer.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any, Literal

from vrx_mj.compiler.masses import MassProperties, axis_inertia, joined, mounted, rigid
from vrx_mj.compiler.templates import Geom, geoms, meshes, render
from vrx_mj.config.robots import Mount, RobotConfig
from vrx_mj.constants import HULL_GRAVITY
from vrx_mj.errors import UnknownNameError
from vrx_mj.physics.tables import GLF, LINEAR

__all__ = [
    "Engines",
    "RobotModel",
    "boat_mass",
    "body_mass",
    "engine_mass",
    "hull_row",
    "link_mass",
    "mounts",
    "robot_mjcf",
    "thruster_rows",
]

Engines = Literal["fixed", "hinged"]
"""Are the engines part of the hull's body, or bodies of their own that turn about z?"""

Color = tuple[float, float, float, float]

MAPPINGS = {"linear": LINEAR, "glf": GLF}
"""Codes of the thrust mappings in the runtime's table."""


@dataclass(frozen=True)
class RobotModel:
    """A boat as MJCF, with the mesh files it names."""

    mjcf: str
    assets: dict[str, bytes]
    base: MassProperties
    """Of the body `base_link`: the whole boat with fixed engines, hull and batteries with hinged ones."""


def link_mass(config: RobotConfig) -> MassProperties:
    """Hull and batteries, joined, in base_link: VRX's base link, at whose centre of mass its plugins push."""
    return joined(rigid(body.mass, body.center_of_mass, body.inertia) for body in config.bodies)


def engine_mass(config: RobotConfig) -> MassProperties:
    """An engine with its propeller, in the frame of the hinge it steers on."""
    engine, propeller = config.engine, config.engine.propeller
    return joined(
        [
            rigid(engine.mass, engine.center_of_mass, engine.inertia),
            rigid(propeller.mass, propeller.position, propeller.inertia),
        ]
    )


def boat_mass(config: RobotConfig, layout: str) -> MassProperties:
    """The whole boat with its engines at zero steering angle, in base_link."""
    engine = engine_mass(config)
    engines = [mounted(engine, mount.position, mount.yaw) for mount in mounts(config, layout)]
    return joined([link_mass(config), *engines])


def body_mass(config: RobotConfig, layout: str, engines: Engines) -> MassProperties:
    """What belongs to the MuJoCo body `base_link`."""
    return boat_mass(config, layout) if engines == "fixed" else link_mass(config)


def mounts(config: RobotConfig, layout: str) -> tuple[Mount, ...]:
    """Where the engines of a thruster layout sit.

    Raises:
        UnknownNameError: the robot has no layout of this name.
    """
    if layout not in config.layouts:
        raise UnknownNameError("thruster layout", layout, known=config.layouts)
    return config.layouts[layout]


def robot_mjcf(config: RobotConfig, layout: str, engines: Engines = "fixed", color: Color | None = None) -> RobotModel:
    """The boat as a MuJoCo model of its own, to be attached under a prefix.

    Collision geoms are in group 3, visual ones in group 2. `color` repaints the first visual, the skin.
    """
    engine, propeller = config.engine, config.engine.propeller
    base_mass = body_mass(config, layout, engines)
    parts = (config, engine, propeller)
    needed = meshes(chain.from_iterable((*part.collisions, *part.visuals) for part in parts))
    text = render(
        "robot.xml.j2",
        link=config.link,
        meshes=needed,
        base_mass=base_mass,
        engine_mass=engine_mass(config),
        base=[*geoms(config.collisions), *_painted(geoms(config.visuals), color)],
        hub=propeller.position,
        thrusters=[_thruster_view(config, mount) for mount in mounts(config, layout)],
        hinged=engines == "hinged",
        pi=math.pi,
    )
    return RobotModel(text, {item.file: item.content for item in needed}, base_mass)


def hull_row(config: RobotConfig, layout: str, engines: Engines, prefix: str) -> dict[str, Any]:
    """The boat's row of the runtime's table of hulls, with names where that has ids.

    `link_com` is where VRX's plugins push, the centre of mass of hull and batteries; `body_com` and `mass`
    are those of the MuJoCo body. The wind's coefficients belong to the world, which fills them in.
    """
    water = config.hydrodynamics
    body = body_mass(config, layout, engines)
    return {
        "body": prefix + config.link,
        "joint": f"{prefix}free",
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

    `body` is what the thrust pushes and `joint` the hinge, None if the engine is fixed. `position` and `yaw`
    are those of the hinge in base_link, `propeller` is in the hinge's frame, `body_com` in that of `body`;
    `inertia` is about the hinge's axis.
    """
    hinged = engines == "hinged"
    pushed = engine_mass(config) if hinged else boat_mass(config, layout)
    return [
        {
            "name": mount.name,
            "hull": prefix + config.link,
            "body": prefix + (_engine_body(mount) if hinged else config.link),
            "joint": prefix + _engine_joint(mount) if hinged else None,
            "position": list(mount.position),
            "yaw": mount.yaw,
            "propeller": list(config.engine.propeller.position),
            "body_com": pushed.center.tolist(),
            **_drive(config),
        }
        for mount in mounts(config, layout)
    ]


def _drive(config: RobotConfig) -> dict[str, Any]:
    thruster, servo = config.thruster, config.engine.servo
    return {
        "mapping": MAPPINGS[thruster.mapping],
        "max_command": thruster.max_command,
        "max_forward": thruster.max_force_forward,
        "max_reverse": thruster.max_force_reverse,
        "timeout": thruster.timeout,
        "max_angle": thruster.max_angle,
        "kp": servo.kp,
        "kd": servo.kd,
        "effort": servo.effort,
        "velocity": servo.velocity,
        "inertia": axis_inertia(engine_mass(config)),
    }


def _thruster_view(config: RobotConfig, mount: Mount) -> dict[str, Any]:
    engine, propeller = config.engine, config.engine.propeller
    return {
        "body": _engine_body(mount),
        "joint": _engine_joint(mount),
        "position": mount.position,
        "yaw": mount.yaw,
        "engine": _named(geoms((*engine.collisions, *engine.visuals)), f"{mount.name}_engine_"),
        "propeller": _named(geoms((*propeller.collisions, *propeller.visuals)), f"{mount.name}_propeller_"),
    }


def _engine_body(mount: Mount) -> str:
    return f"{mount.name}_engine_link"


def _engine_joint(mount: Mount) -> str:
    """VRX's name and spelling: what joint states carry."""
    return f"{mount.name}_chasis_engine_joint"


def _named(items: Iterable[Geom], prefix: str) -> list[Geom]:
    return [item if item.name is None else replace(item, name=prefix + item.name) for item in items]


def _painted(visuals: list[Geom], color: Color | None) -> list[Geom]:
    if color is None or not visuals:
        return visuals
    return [replace(visuals[0], rgba=color), *visuals[1:]]
