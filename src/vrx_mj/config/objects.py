"""Things in the water and on the shore: floating, static, or courses composed of others."""

import contextlib
import math
import warnings
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal, Protocol, Self

from pydantic import BeforeValidator, field_validator, model_validator
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
from vrx_mj.config.bays import BLOCKS, BayConfig, HoleConfig, MooringConfig, PlacardConfig
from vrx_mj.config.berths import berth_faults, berths
from vrx_mj.config.displays import LightConfig, Symbol
from vrx_mj.config.docks import dock_faults, drawn, is_drawing, load_dock
from vrx_mj.config.loading import Loading, check, read_source, referenced, validated
from vrx_mj.config.paths import PathConfig
from vrx_mj.config.search import display
from vrx_mj.config.shapes import Shape, Visual
from vrx_mj.config.wording import one_of, shown
from vrx_mj.constants import WATER_DENSITY
from vrx_mj.errors import UnknownNameError, VrxError, VrxWarning

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

BODY_KEYS = ("mass", "inertia", "center_of_mass", "collisions", "visuals", "buoyancy", "static", "link", "path",
             "light")  # fmt: skip
"""Keys of a single body, which a composite has not."""

MOST_LEVELS = 8
"""Objects inside objects, nested."""
MOST_OBJECTS = 10_000
"""Single objects in a world or an object."""


class Placed(Config):
    """Something with a name of its own, somewhere: in a world, or as part of a composite object."""

    folder: Folder = None
    name: Name
    """Name in the world; nothing else has it."""
    pose: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """Pose in the world, or in the object that this is a part of [m, rad]."""


class Placement(Placed):
    """An object somewhere."""

    model: str
    """A name from `objects`, or the path of a YAML file relative to this one."""
    path: PathConfig | None = None
    """Path along which it swims; by default its model's own. `null`: it drifts."""
    symbols: tuple[Symbol, ...] = ()
    """Symbols that the placards of its docks show at the start, in their order."""

    @field_validator("symbols")
    @classmethod
    def _has_placards(cls, value: tuple[str, ...], info: ValidationInfo) -> tuple[str, ...]:
        if value and "model" in info.data:
            check(info, lambda: _must_have_placards(info.data["model"], info.data.get("folder"), len(value)))
        return value

    @field_validator("path")
    @classmethod
    def _swims(cls, value: PathConfig | None, info: ValidationInfo) -> PathConfig | None:
        if value is not None and "model" in info.data:
            check(info, lambda: _must_float(info.data["model"], info.data.get("folder")))
        return value

    @field_validator("model")
    @classmethod
    def _exists(cls, value: str, info: ValidationInfo) -> str:
        whole = info.context
        if isinstance(whole, Loading):
            folder = info.data.get("folder")
            whole.check(lambda: _count(referenced("objects", value, folder), whole))
        return value


def _drawing(value: Any) -> Any:
    """A list of rows becomes the block of text that it stands for."""
    if isinstance(value, list | tuple):
        text, found = drawn(value)
        if found:
            raise faults(*(((row,), message) for row, message in found))
        return text
    if not isinstance(value, str):
        raise fault(
            f"expected a drawing (`|` and rows of X and blanks, or a list of rows), name or path, got {shown(value)}"
        )
    return value


Drawing = Annotated[str, BeforeValidator(_drawing)]
"""A dock's drawing, or what names one."""


class DockPlacement(Placed):
    """A dock somewhere."""

    layout: Drawing
    """A drawing, as a block of text `|` or a list of rows; a name from `docks`; or the path of a text file."""
    dynamic: Switch = False
    """Whether it floats: its blocks hang together by hinges."""
    block: float = 2.0
    """Edge of a block [m]: 1 x 1 to 4 x 4 cubes of 0.5 m."""
    mooring: MooringConfig | None = None
    """Lines that hold a dynamic dock; without them it drifts."""
    bays: tuple[BayConfig, ...] | None = None
    """What is said of the first bays, or of all. Without it a dock has all bays of its drawing, and no placards."""
    placards: tuple[PlacardConfig, ...] | None = None
    """Placards of the bays in their order; by default one at the inner end of each bay of `bays`."""
    holes: tuple[HoleConfig, ...] | None = None
    """Holes for balls; by default those of the placards."""
    symbols: tuple[Symbol, ...] = ()
    """Symbols that the placards show at the start, in their order."""

    @field_validator("layout")
    @classmethod
    def _is_a_dock(cls, value: str, info: ValidationInfo) -> str:
        found = dock_faults(value.split("\n")) if is_drawing(value) else []
        if found:
            raise text_faults(*found)
        if not is_drawing(value):
            check(info, lambda: load_dock(value, info.data.get("folder")))
        return value

    @field_validator("block", mode="before")
    @classmethod
    def _is_a_size(cls, value: Any) -> Any:
        if isinstance(value, bool) or value not in BLOCKS:
            raise fault(f"a block is {one_of([f'{edge:g}' for edge in BLOCKS])} m long, got {shown(value)}")
        return float(value)

    @model_validator(mode="after")
    def _hangs_together(self) -> Self:
        with contextlib.suppress(VrxError):  # what is wrong with the drawing is told with it
            found = list(berth_faults(self, load_dock(self.layout, self.folder).cells))
            if found:
                raise faults(*found)
        return self


class BuoyancyElement(Shape):
    """A shape that displaces water."""

    type: Literal["box", "sphere", "cylinder"]
    """Kind of shape."""

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
    """Density of the water [kg/m3]."""
    fluid_level: float = 0.0
    """Mean water level [m]."""
    linear_drag: NonNegative
    """Drag of each element over the link's mass and linear velocity [1/s], scaled by the share of it under water."""
    angular_drag: NonNegative
    """Drag torque of each element over mass, mean extent squared and angular velocity [1/s], scaled likewise."""
    elements: Annotated[tuple[BuoyancyElement, ...], NotEmpty]
    """Shapes that displace water; the whole volume of each counts."""


class ObjectConfig(Config):
    """An object's file. One that floats has mass, inertia and buoyancy; a composite only has parts."""

    folder: Folder = None
    description: str = ""
    """What `vrx-mj list objects --verbose` shows."""
    static: Switch = False
    """Whether it is fixed to the world instead of floating."""
    link: Name = "link"
    """Name of its link, as ROS and VRX's files know it."""
    mass: Positive | None = None
    """Mass [kg]."""
    center_of_mass: Vec3 = (0.0, 0.0, 0.0)
    """Centre of mass in the link's frame [m]."""
    inertia: Principal | None = None
    """Ixx, Iyy, Izz about the centre of mass, along the link's axes [kg m2]."""
    collisions: tuple[Shape, ...] = ()
    """Shapes that boats and other objects collide with."""
    visuals: tuple[Visual, ...] = ()
    """Shapes that are seen."""
    buoyancy: BuoyancyConfig | None = None
    """What it displaces, and its drag; an object that floats needs it."""
    path: PathConfig | None = None
    """Path along which it swims, unless the world gives another."""
    light: LightConfig | None = None
    """Panels of a light buoy."""
    objects: tuple[Placement, ...] = ()
    """Other objects that this one is made of."""
    docks: tuple[DockPlacement, ...] = ()
    """Docks that this object is made of."""

    @property
    def kind(self) -> Literal["floating", "static", "composite"]:
        """What this is: it floats, it stands, or it is made of other objects."""
        if self.objects or self.docks:
            return "composite"
        return "static" if self.static else "floating"

    @model_validator(mode="after")
    def _is_one_kind(self) -> Self:
        found = {"composite": _composite, "static": _static, "floating": _floating}[self.kind](self) + _unlit(self)
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
    return [((key,), "not allowed: an object made of `objects` or `docks` has no body of its own") for key in written]


def _static(thing: ObjectConfig) -> list[Fault]:
    afloat = [key for key in ("buoyancy", "path") if getattr(thing, key)]
    return [((key,), "not allowed: a static object does not float; remove this or `static`") for key in afloat]


def _floating(thing: ObjectConfig) -> list[Fault]:
    needs = "required for a floating object; for a fixed one write `static: true`"
    return [((key,), needs) for key in ("mass", "inertia", "buoyancy") if getattr(thing, key) is None]


def _unlit(thing: ObjectConfig) -> list[Fault]:
    panels = thing.light.panels if thing.light else ()
    known = [visual.name for visual in thing.visuals if visual.name]
    wrong = [(index, name) for index, name in enumerate(panels) if name not in known]
    return [(("light", "panels", index), str(UnknownNameError("visual", name, known))) for index, name in wrong]


class _Called(Protocol):
    """What has a name."""

    @property
    def name(self) -> str: ...


def repeated(**groups: Iterable[_Called]) -> list[Fault]:
    """Names that are given more than once, as faults at the later ones."""
    seen: Counter[str] = Counter()
    found: list[Fault] = []
    for key, group in groups.items():
        for index, thing in enumerate(group):
            if seen[thing.name]:
                found.append(((key, index, "name"), f"duplicate name '{thing.name}'"))
            seen[thing.name] += 1
    return found


def load_object(name: str, near: Path | None = None) -> ObjectConfig:
    """The object model of a name, or of a path relative to the folder `near`."""
    file = referenced("objects", name, near)
    return validated(ObjectConfig, read_source("objects", file), Loading((file.resolve(),)))


def _must_float(model: str, near: Path | None) -> None:
    if load_object(model, near).kind != "floating":
        raise VrxError(f"'{model}' does not float, so it cannot follow a path")


def _must_have_placards(model: str, near: Path | None, symbols: int) -> None:
    docks = load_object(model, near).docks
    count = sum(len(berths(dock, load_dock(dock.layout, dock.folder).cells).placards) for dock in docks)
    if symbols > count:
        raise VrxError(f"{symbols} symbols; '{model}' has {count} placard{'s' * (count != 1)}")


def _count(file: Path, whole: Loading) -> None:
    """Checks an object's file, once in a load, and counts the single objects in it as part of the whole."""
    key = file.resolve()
    if key in whole.chain:
        names = " > ".join(step.stem for step in (*whole.chain[whole.chain.index(key) :], key))
        raise VrxError(f"this object contains itself: {names}")
    if len(whole.chain) >= MOST_LEVELS:
        raise VrxError(f"more than {MOST_LEVELS} levels of objects in objects")
    if key not in whole.counts:
        whole.counts[key] = 1
        part = Loading((*whole.chain, key), whole.counts)
        _warn_if_it_sinks(validated(ObjectConfig, read_source("objects", file), part), file)
        whole.counts[key] = max(part.count, 1)
    before, whole.count = whole.count, whole.count + whole.counts[key]
    if before <= MOST_OBJECTS < whole.count:
        raise VrxError(f"more than {MOST_OBJECTS} objects, including those in objects")


def _warn_if_it_sinks(thing: ObjectConfig, file: Path) -> None:
    if thing.buoyancy is None or thing.mass is None:
        return
    displaced = thing.buoyancy.fluid_density * sum(element.volume for element in thing.buoyancy.elements)
    if thing.mass > displaced:
        text = f"{display(file)}: sinks: mass {thing.mass:g} kg; its buoyancy displaces at most {displaced:g} kg"
        warnings.warn(text, VrxWarning, stacklevel=2)
