"""Things in the water and on the shore: floating, static, or courses composed of others."""

import math
import warnings
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import field_validator, model_validator
from pydantic_core.core_schema import ValidationInfo

from vrx_mj.config.base import (
    Config,
    Folder,
    Name,
    NonNegative,
    NotEmpty,
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
from vrx_mj.config.loading import Loading, check, read_source, referenced, validated
from vrx_mj.config.search import display
from vrx_mj.config.shapes import Shape, Visual
from vrx_mj.constants import WATER_DENSITY
from vrx_mj.errors import VrxError, VrxWarning

__all__ = [
    "BuoyancyConfig",
    "BuoyancyElement",
    "DockPlacement",
    "ObjectConfig",
    "Placed",
    "Placement",
    "load_object",
    "repeated",
]

BODY_KEYS = ("mass", "inertia", "center_of_mass", "collisions", "visuals", "buoyancy", "static", "link")
"""Keys of a single body, which a composite has not."""

MOST_LEVELS = 8
"""Objects inside objects, nested."""
MOST_OBJECTS = 10_000
"""Single objects in a world or an object."""


class Placed(Config):
    """Something with a name of its own, somewhere: in a world, or as part of a composite object."""

    folder: Folder = None
    name: Name
    pose: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Placement(Placed):
    """An object somewhere."""

    model: str
    """A name from `objects`, or the path of a YAML file relative to this one."""

    @field_validator("model")
    @classmethod
    def _exists(cls, value: str, info: ValidationInfo) -> str:
        whole = info.context
        if isinstance(whole, Loading):
            folder = info.data.get("folder")
            whole.check(lambda: _count(referenced("objects", value, folder), whole))
        return value


class DockPlacement(Placed):
    """A dock somewhere."""

    layout: str
    """A drawing, a name from `docks`, or the path of a text file relative to this one."""
    dynamic: Switch = False

    @field_validator("layout")
    @classmethod
    def _is_a_dock(cls, value: str, info: ValidationInfo) -> str:
        found = dock_faults(value.split("\n")) if is_drawing(value) else []
        if found:
            raise text_faults(*found)
        if not is_drawing(value):
            check(info, lambda: load_dock(value, info.data.get("folder")))
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
    elements: Annotated[tuple[BuoyancyElement, ...], NotEmpty]


class ObjectConfig(Config):
    """An object's file. One that floats has mass, inertia and buoyancy; a composite only has parts."""

    folder: Folder = None
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


def repeated(**groups: Iterable[Placed]) -> list[Fault]:
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
    file = referenced("objects", name, near)
    return validated(ObjectConfig, read_source("objects", file), Loading((file.resolve(),)))


def _count(file: Path, whole: Loading) -> None:
    """Checks an object's file, once in a load, and counts the single objects in it as part of the whole."""
    key = file.resolve()
    if key in whole.chain:
        names = " > ".join(step.stem for step in (*whole.chain[whole.chain.index(key) :], key))
        raise VrxError(f"this object contains itself: {names}")
    if len(whole.chain) >= MOST_LEVELS:
        raise VrxError(f"over {MOST_LEVELS} levels of objects in objects")
    if key not in whole.counts:
        whole.counts[key] = 1
        part = Loading((*whole.chain, key), whole.counts)
        _warn_if_it_sinks(validated(ObjectConfig, read_source("objects", file), part), file)
        whole.counts[key] = max(part.count, 1)
    before, whole.count = whole.count, whole.count + whole.counts[key]
    if before <= MOST_OBJECTS < whole.count:
        raise VrxError(f"over {MOST_OBJECTS} objects, those in objects included")


def _warn_if_it_sinks(thing: ObjectConfig, file: Path) -> None:
    if thing.buoyancy is None or thing.mass is None:
        return
    displaced = thing.buoyancy.fluid_density * sum(element.volume for element in thing.buoyancy.elements)
    if thing.mass > displaced:
        text = f"{display(file)}: sinks: mass {thing.mass:g} kg; its buoyancy displaces at most {displaced:g} kg"
        warnings.warn(text, VrxWarning, stacklevel=2)
