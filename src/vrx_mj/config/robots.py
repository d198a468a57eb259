"""Kinds of boats: bodies, shapes, engines and hydrodynamics, as `robots/NAME/robot.yaml` gives them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, model_validator

from vrx_mj.config.base import (
    Config,
    Folder,
    Name,
    NotEmpty,
    Positive,
    Principal,
    Vec3,
    fault,
    faults,
)
from vrx_mj.config.dynamics import HydrodynamicsConfig, ServoConfig, ThrusterConfig
from vrx_mj.config.loading import Loading, read_source, referenced, validated
from vrx_mj.config.shapes import Shape, Visual
from vrx_mj.config.wording import shown

__all__ = [
    "BodyConfig",
    "EngineConfig",
    "Mount",
    "PropellerConfig",
    "RobotConfig",
    "load_robot",
]


def _with_tuples(value: Any) -> Any:
    if not isinstance(value, Mapping):
        return value
    if not value:
        raise fault("a robot has at least one layout")
    return {key: tuple(mounts) if isinstance(mounts, list) else mounts for key, mounts in value.items()}


class BodyConfig(Config):
    """A rigid part of the hull."""

    name: Name
    mass: Positive
    """Mass [kg]."""
    center_of_mass: Vec3 = (0.0, 0.0, 0.0)
    """In the robot's frame [m]."""
    inertia: Principal
    """About its own centre of mass, along the robot's axes [kg m2]."""


class PropellerConfig(Config):
    """A propeller; its frame is the hub, where thrust acts."""

    position: Vec3
    """Of the hub in the engine's frame [m]."""
    mass: Positive
    inertia: Principal
    collisions: tuple[Shape, ...] = ()
    visuals: tuple[Visual, ...] = ()


class EngineConfig(Config):
    """An engine; its frame is the hinge, which steers about z."""

    mass: Positive
    """Mass [kg]."""
    center_of_mass: Vec3 = (0.0, 0.0, 0.0)
    inertia: Principal
    collisions: tuple[Shape, ...] = ()
    visuals: tuple[Visual, ...] = ()
    propeller: PropellerConfig
    servo: ServoConfig


class Mount(Config):
    """Where an engine's hinge sits."""

    name: Name
    position: Vec3
    """In the robot's frame [m]."""
    yaw: float = 0.0
    """Heading at zero steering angle [rad]."""


class RobotConfig(Config):
    """A kind of boat."""

    folder: Folder = None
    description: str = ""
    link: Name = "base_link"
    bodies: Annotated[tuple[BodyConfig, ...], NotEmpty]
    """Joined rigidly; the first is the hull."""
    collisions: tuple[Shape, ...] = ()
    visuals: tuple[Visual, ...] = ()
    engine: EngineConfig
    thruster: ThrusterConfig
    layouts: Annotated[dict[Name, tuple[Mount, ...]], BeforeValidator(_with_tuples)]
    """Where the engines are, by the layout's name: H, T or X."""
    hydrodynamics: HydrodynamicsConfig

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        found = []
        for layout, mounts in self.layouts.items():
            names = [mount.name for mount in mounts]
            found += [
                (("layouts", layout, index, "name"), f"{shown(name)} is the name of something else already")
                for index, name in enumerate(names)
                if name in names[:index]
            ]
        if found:
            raise faults(*found)
        return self


def load_robot(name: str, near: Path | None = None) -> RobotConfig:
    """The kind of boat of a name, or of a path relative to the folder `near`."""
    file = referenced("robots", name, near).absolute()
    return validated(RobotConfig, read_source("robots", file), Loading())
