"""Things in the water and on the shore: floating, static, or courses composed of others."""

import math
import warnings
from collections import Counter
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Literal, Self

from pydantic import Field, field_validator, model_validator
from pydantic_core.core_schema import ValidationInfo

from vrx_mj.config.base import (
    Config,
    Folder,
    Name,
    NonNegative,
    Pose,
    Positive,
    Principal,
    Switch,
    Vec3,
    fault,
    faults,
    text_faults,
)
from vrx_mj.config.docks import dock_faults, is_drawing, load_dock
from vrx_mj.config.loading import Loading, read_section, referenced, validated
from vrx_mj.config.search import display
from vrx_mj.config.shapes import Shape, Visual
from vrx_mj.constants import WATER_DENSITY
from vrx_mj.errors import ConfigError, Problem, VrxWarning

__all__ = [
    "BuoyancyConfig",
    "BuoyancyElement",
    "DockPlacement",
    "ObjectConfig",
    "Placement",
    "load_object",
    "repeated",
]

BODY_KEYS = ("mass", "inertia", "center_of_mass", "collisions", "visuals", "buoyancy", "static", "link")
"""Keys of a single body, which a composite has not."""

MOST_PARTS = 8
"""Composites inside composites that may be nested."""


class Placement(Config):
    """An object somewhere: in a world, or as part of a composite object."""

    folder: Folder
    name: Name
    model: str
    """A name from `objects`, or the path of a YAML file relative to this one."""
    pose: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    @field_validator("model")
    @classmethod
    def _exists(cls, value: str, info: ValidationInfo) -> str:
        if isinstance(info.context, Loading):
            chain = info.context.chain
            info.context.check(lambda: _load(value, info.data.get("folder"), chain))
        return value


class DockPlacement(Config):
    """A dock somewhere."""

    folder: Folder
    name: Name
    pose: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    layout: str
    """A drawing, a name from `docks`, or the path of a text file relative to this one."""
    dynamic: Switch = False

    @field_validator("layout")
    @classmethod
    def _is_a_dock(cls, value: str, info: ValidationInfo) -> str:
        found = dock_faults(value.split("\n")) if is_drawing(value) else []
        if found:
            raise text_faults(*found)
        if not is_drawing(value) and isinstance(info.context, Loading):
            info.context.check(lambda: load_dock(value, info.data.get("folder")))
        return value

    @field_validator("dynamic")
    @classmethod
    def _static(cls, value: bool) -> bool:
        if value:
            raise fault("dynamic docks come with the tasks; this version has static ones only")
        return value


class BuoyancyElement(Shape):
    """A shape that displaces water."""

    type: Literal["box", "sphere", "cylinder"]

    @property
    def volume(self) -> float:
        """Volume [m3]."""
        if self.type == "box":
            return math.prod(self.size or ())
        radius, length = self.radius or 0.0, self.length or 0.0
        return 4 / 3 * math.pi * radius**3 if self.type == "sphere" else math.pi * radius**2 * length


class BuoyancyConfig(Config):
    """VRX's buoyancy_gazebo_plugin: what an object displaces, and its drag in water."""

    fluid_density: Positive = WATER_DENSITY
    """Density [kg/m3]."""
    fluid_level: float = 0.0
    """Mean water level [m]."""
    linear_drag: NonNegative
    """Of the link's linear velocity [N s/m], as a share of the volume under water."""
    angular_drag: NonNegative
    """Of the link's angular velocity [N m s], as a share of the volume under water."""
    elements: tuple[BuoyancyElement, ...] = Field(min_length=1)


class ObjectConfig(Config):
    """An object's file. One that floats has mass, inertia and buoyancy; a composite only has parts."""

    folder: Folder
    description: str = ""
    static: Switch = False
    link: Name = "link"
    mass: Positive | None = None
    """Mass [kg]."""
    center_of_mass: Vec3 = (0.0, 0.0, 0.0)
    """Centre of mass in the link's frame [m]."""
    inertia: Principal | None = None
    """Ixx, Iyy, Izz about the centre of mass, along the link's axes [kg m2]."""
    collisions: tuple[Shape, ...] = ()
    visuals: tuple[Visual, ...] = ()
    buoyancy: BuoyancyConfig | None = None
    objects: tuple[Placement, ...] = ()
    docks: tuple[DockPlacement, ...] = ()

    @property
    def kind(self) -> Literal["floating", "static", "composite"]:
        """What this is: it floats, it stands, or it is made of other objects."""
        if self.objects or self.docks:
            return "composite"
        return "static" if self.static else "floating"

    @model_validator(mode="after")
    def _is_one_kind(self) -> Self:
        found = {"composite": _composite, "static": _static, "floating": _floating}[self.kind](self)
        if found:
            raise faults(*found)
        return self

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        found = repeated(objects=self.objects, docks=self.docks)
        if found:
            raise faults(*found)
        return self


Fault = tuple[tuple[str | int, ...], str]


def _composite(thing: ObjectConfig) -> list[Fault]:
    written = [key for key in BODY_KEYS if key in thing.model_fields_set]
    return [((key,), "an object made of `objects` or `docks` has no body of its own") for key in written]


def _static(thing: ObjectConfig) -> list[Fault]:
    return [(("buoyancy",), "a static object does not float; remove this or `static`")] if thing.buoyancy else []


def _floating(thing: ObjectConfig) -> list[Fault]:
    needs = "an object that floats needs it; one that stands says `static: true`"
    return [((key,), needs) for key in ("mass", "inertia", "buoyancy") if getattr(thing, key) is None]


def repeated(**groups: Iterable[Placement | DockPlacement]) -> list[Fault]:
    """Names that are given more than once, as faults at the later ones."""
    seen: Counter[str] = Counter()
    found: list[Fault] = []
    for key, group in groups.items():
        for index, thing in enumerate(group):
            if seen[thing.name]:
                found.append(((key, index, "name"), f"'{thing.name}' is the name of something else already"))
            seen[thing.name] += 1
    return found


def load_object(name: str, near: Path | None = None) -> ObjectConfig:
    """The object model of a name, or of a path relative to the folder `near`."""
    return _load(name, near, ())


def _load(name: str, near: Path | None, chain: tuple[Path, ...]) -> ObjectConfig:
    file = referenced("objects", name, near).absolute()
    if file.resolve() in chain:
        names = " > ".join(step.stem for step in (*chain[chain.index(file.resolve()) :], file))
        raise ConfigError([Problem(display(file), None, None, "objects", f"this object contains itself: {names}")])
    if len(chain) >= MOST_PARTS:
        raise ConfigError([Problem(display(file), None, None, "objects", f"over {MOST_PARTS} objects inside objects")])
    stat = file.stat()
    return _read(file, stat.st_mtime_ns, stat.st_size, chain)


@lru_cache(maxsize=256)
def _read(file: Path, _changed: int, _size: int, chain: tuple[Path, ...]) -> ObjectConfig:
    thing = validated(ObjectConfig, read_section("objects", file), Loading((*chain, file.resolve())))
    _warn_if_it_sinks(thing, file)
    return thing


def _warn_if_it_sinks(thing: ObjectConfig, file: Path) -> None:
    if thing.buoyancy is None or thing.mass is None:
        return
    displaced = thing.buoyancy.fluid_density * sum(element.volume for element in thing.buoyancy.elements)
    if thing.mass > displaced:
        text = f"{display(file)}: sinks: mass {thing.mass:g} kg; its buoyancy displaces at most {displaced:g} kg"
        warnings.warn(text, VrxWarning, stacklevel=2)
