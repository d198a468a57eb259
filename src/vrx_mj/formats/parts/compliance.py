"""Sets of rules on what a boat may carry, and where (`assets/robots/wamv/compliance/*.yaml`), and checks of its files.

Beside our own result there is that of VRX's generator, `generate_wamv.launch`. It goes through a file part by part and
keeps only the result of the last one; a count that is too high is logged and forgotten at the next part; a parameter
that is not permitted is logged, and any piece of the list of permitted names counts as permitted. Sources:
vrx_gazebo/src/vrx_gazebo/{configure_wamv,utils,compliance}.py.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from pydantic import Field

from vrx_mj.arguments import check_name
from vrx_mj.config.base import Config
from vrx_mj.config.loading import Loading, validate
from vrx_mj.config.search import display
from vrx_mj.config.tree import ALLOWED, File, is_ros_name, literal
from vrx_mj.config.values import Name, Positive, Vec3, numbers
from vrx_mj.config.yaml_text import parse, read_lines
from vrx_mj.formats.parts.read import Instance, Kind, PartsFile, Release, name_of, part_types, place_of
from vrx_mj.frames import Vector
from vrx_mj.packages import root

_FACE = 1e-9
"""Distance beyond a face that still counts as on it [m]: 0.8 - 0.5 is not 0.3 to the last bit."""
INSET = 1e-3
"""Distance from a face that two boxes share at which a place is in one of them alone [m]."""
_WAYS = (("too far aft", "too far forward"), ("too far to starboard", "too far to port"), ("too low", "too high"))
"""Words for missing a box along x, y and z: below its least, above its greatest."""


class Box(Config):
    """A box along the axes of base_link; its faces belong to it."""

    name: Name
    """Name of the box, as messages give it."""
    center: Vec3
    """Centre of the box [m]."""
    size: Annotated[tuple[Positive, Positive, Positive], numbers("x y z")]
    """Edges [m]."""
    capacity: Annotated[int, Field(ge=0)] | None = None
    """How many parts it takes; None for any number."""

    @property
    def low(self) -> Vector:
        """Least x, y and z [m]."""
        return self._corner(-0.5)

    @property
    def high(self) -> Vector:
        """Greatest x, y and z [m]."""
        return self._corner(0.5)

    def _corner(self, share: float) -> Vector:
        """The centre, moved by a share of the edges [m]."""
        (x, y, z), (a, b, c) = self.center, self.size
        return x + share * a, y + share * b, z + share * c

    def contains(self, point: Vector) -> bool:
        """Whether a point is inside or on a face."""
        return all(abs(x - near) <= _FACE for x, near in zip(point, self.nearest(point).point, strict=True))

    def nearest(self, point: Vector, inset: float = 0.0) -> "Spot":
        """The place nearest to a point that is at least `inset` [m], or half an edge, inside."""
        x, y, z = (
            min(max(x, low + min(inset, edge / 2.0)), high - min(inset, edge / 2.0))
            for x, low, high, edge in zip(point, self.low, self.high, self.size, strict=True)
        )
        return Spot((x, y, z), self, math.dist((x, y, z), point))


class Spot(NamedTuple):
    """A place in a box."""

    point: Vector
    box: Box
    distance: float
    """Distance from the part's present place [m]."""


def assign_boxes(points: Sequence[Vector], boxes: Sequence[Box]) -> list[Box | None]:
    """The box of each point in turn: the first that contains it and has room. VRX's algorithm."""
    room = [math.inf if box.capacity is None else box.capacity for box in boxes]
    found: list[Box | None] = []
    for point in points:
        free = (i for i, box in enumerate(boxes) if room[i] > 0 and box.contains(point))
        index = next(free, None)
        if index is not None:
            room[index] -= 1
        found.append(None if index is None else boxes[index])
    return found


def nearest_box(point: Vector, boxes: Sequence[Box]) -> Spot | None:
    """The box nearest to a point, whether it has room or not, and its nearest place."""
    return min((box.nearest(point) for box in boxes), key=attrgetter("distance"), default=None)


def nearest_place(points: Sequence[Vector], index: int, boxes: Sequence[Box]) -> Spot | None:
    """The nearest place at which point `index` gets a box and no other point loses its own.

    None if no box has room. Exact but for places on a face that two boxes share: there it may be `INSET` off.
    """
    point, had = points[index], assign_boxes(points, boxes)
    near = [box.nearest(point, inset) for box in boxes for inset in (0.0, INSET)]
    for spot in sorted(near, key=attrgetter("distance")):
        moved = [*points[:index], spot.point, *points[index + 1 :]]
        gets = assign_boxes(moved, boxes)
        box = gets[index]
        if box is not None and all(gets[i] or not had[i] for i in range(len(points)) if i != index):
            return spot._replace(box=box)
    return None


class TypeRules(Config):
    """The rules of a type of part."""

    most: Annotated[int, Field(ge=0)]
    """Most parts of this type."""
    parameters: tuple[str, ...]
    """Parameters that a file may give."""


class KindRules(Config):
    """The rules for a kind of file."""

    boxes: tuple[Box, ...]
    """The boxes in the order in which they are tried."""
    types: dict[str, TypeRules]
    """Types that a file may have."""


class Rules(Config):
    """A set of rules."""

    description: str
    """Competition whose rules they are."""
    release: Release
    """Release of VRX whose macros they go with."""
    empty_passes: bool
    """Whether VRX's own generator lets an empty file pass."""
    components: KindRules
    thrusters: KindRules

    def of(self, kind: Kind) -> KindRules:
        """The rules for a kind of file."""
        return self.components if kind == "components" else self.thrusters


def rule_sets() -> dict[str, Path]:
    """The file of each set of rules, by name: `classic`, `jazzy`, `2019`."""
    folder = root() / "assets" / "robots" / "wamv" / "compliance"
    return {file.stem: file for file in sorted(folder.glob("*.yaml"), reverse=True)}


def load_rules(name: str) -> Rules:
    """The set of rules of this name.

    Raises:
        UnknownNameError: no set has that name.
    """
    known = rule_sets()
    check_name("set of rules", name, known)
    file = known[name]
    return validate(Rules, parse(File(display(file), file.parent, read_lines(file))), Loading())


@dataclass(frozen=True)
class GeneratorResult:
    """Verdict of VRX's own generator."""

    passes: bool | None
    """Whether it would end without calling the boat not compliant; None where it stops before that."""
    errors: bool
    """Whether it would log any error: by that a VRX competition decides."""
    stops: tuple[str, ...]
    """Problems at which it would stop."""


def _generator_result(
    files: Sequence[PartsFile], judged: Mapping[Kind, Sequence["PartVerdict"]], book: Rules
) -> GeneratorResult:
    """Verdict of VRX's generator on files whose parts are judged by a set of rules."""
    unknown = {
        kind: [f"type {one.instance.type}" for one in parts if one.breaks("type")] for kind, parts in judged.items()
    }
    stops = tuple(stop for file in files for stop in (*file.stops, *dict.fromkeys(unknown[file.kind])))
    ends = [_end(parts, book) for parts in judged.values()]
    passes = None if stops else all(passed for passed, _ in ends)
    return GeneratorResult(passes, bool(stops) or not passes or any(logged for _, logged in ends), stops)


def _end(parts: Sequence["PartVerdict"], book: Rules) -> tuple[bool, bool]:
    """The result of a file, which is that of its last part, and whether an error is logged on the way."""
    inside = [part.point is None or part.box is not None for part in parts]
    logged = any(part.breaks("count") or not _is_permitted(part.instance, book) for part in parts)
    return inside[-1] if parts else book.empty_passes, logged or not all(inside)


def _is_permitted(instance: Instance, book: Rules) -> bool:
    """Whether each parameter is a piece of the list of permitted ones, which is one text there."""
    rules = book.of(part_types()[instance.type].kind).types.get(instance.type)
    return rules is None or all(key in " ".join(rules.parameters) for key in instance.parameters)


@dataclass(frozen=True)
class Breach:
    """A rule that a part breaks."""

    rule: Literal["type", "count", "parameter", "place"]
    message: str


@dataclass(frozen=True)
class PartVerdict:
    """The verdict of the rules on one part."""

    instance: Instance
    kind: Kind
    point: Vector | None
    """Place in base_link [m]; None for a part without one that rules speak of."""
    box: Box | None
    """The box that took it."""
    breaches: tuple[Breach, ...]
    legal: Spot | None = None
    """Nearest legal place of a part outside every box; None if no place is legal, or its own is."""

    @property
    def name(self) -> str:
        """Name of the part."""
        return name_of(self.instance)

    @property
    def compliant(self) -> bool:
        """Whether it breaks no rule."""
        return not self.breaches

    def breaks(self, rule: str) -> bool:
        """Whether it breaks a rule of this kind."""
        return any(breach.rule == rule for breach in self.breaches)

    @property
    def warning(self) -> str:
        """Warning about a name that ROS refuses and no rule of VRX forbids; empty if ROS takes it."""
        refused = self.name and not is_ros_name(self.name)
        return f"ROS refuses the name {literal(self.name)}: {ALLOWED} are allowed" if refused else ""


@dataclass(frozen=True)
class Verdict:
    """The verdicts of a set of rules on a boat."""

    rules: Rules
    parts: tuple[PartVerdict, ...]
    """Verdicts in the order of the files, components first."""
    reasons: tuple[str, ...]
    """Reasons why the boat is not legal; empty if it is."""
    generator: GeneratorResult

    @property
    def compliant(self) -> bool:
        """Whether no part breaks a rule."""
        return not self.reasons


def judge(components: PartsFile | None, thrusters: PartsFile | None, rules: str = "classic") -> Verdict:
    """Judge the parts of a boat; a file that is None is left out.

    Raises:
        UnknownNameError: no set of rules has that name.
    """
    book = load_rules(rules)
    files = [file for file in (components, thrusters) if file is not None]
    judged = {file.kind: tuple(_verdicts(file, book)) for file in files}
    reasons = dict.fromkeys(reason for kind, parts in judged.items() for reason in _reasons(parts, book.of(kind)))
    parts = tuple(part for each in judged.values() for part in each)
    return Verdict(book, parts, tuple(reasons), _generator_result(files, judged, book))


def _verdicts(file: PartsFile, book: Rules) -> Iterator[PartVerdict]:
    """The verdict on each part of a file."""
    rules = book.of(file.kind)
    points = {i: point for i, part in enumerate(file.instances) if (point := place_of(part)) is not None}
    boxes = dict(zip(points, assign_boxes([*points.values()], rules.boxes), strict=True))
    moved = dict(points)  # a part outside every box may go where those before it leave room, which have moved too
    for i, instance in enumerate(file.instances):
        breaches, spot = [*_against_type(instance, book)], None
        point, box = points.get(i), boxes.get(i)
        if point is not None and box is None:
            breaches.append(Breach("place", _outside(point, rules.boxes)))
            spot = nearest_place([*moved.values()], [*moved].index(i), rules.boxes)
            moved[i] = spot.point if spot else point
        yield PartVerdict(instance, file.kind, point, box, tuple(breaches), spot)


def _against_type(instance: Instance, book: Rules) -> Iterator[Breach]:
    """Rules that a part breaks wherever it is."""
    part = part_types()[instance.type]
    rules = book.of(part.kind).types.get(instance.type)
    if rules is None:
        yield Breach("type", f"type {instance.type} is not an accepted {part.kind.removesuffix('s')} type")
        return
    if instance.index >= rules.most:
        yield Breach("count", f"number {instance.index + 1} of its type; at most {rules.most}")
    for key in instance.parameters:
        if key not in rules.parameters:
            release = getattr(part.parameter(key), "release", None)
            missing = "" if release in {None, book.release} else "; the macro of this VRX release has no such parameter"
            yield Breach("parameter", f"parameter {key} not permitted{missing}")


def _outside(point: Vector, boxes: Sequence[Box]) -> str:
    """Reason why a point got no box, with its distance from the nearest."""
    full = [box.name for box in boxes if box.contains(point)]
    if full:
        return f"inside {' and '.join(full)}, which {'is' if len(full) == 1 else 'are'} full"
    near = nearest_box(point, boxes)
    if near is None:
        return "there is no box for it"
    off = (x - there for x, there in zip(point, near.point, strict=True))
    ways = (f"{abs(d):.4g} m {words[d > 0]}" for d, words in zip(off, _WAYS, strict=True) if abs(d) > _FACE)
    return f"outside every box; it misses {near.box.name} by {near.distance:.4g} m: {', '.join(ways)}"


def _reasons(parts: Sequence[PartVerdict], rules: KindRules) -> Iterator[str]:
    """Reasons why the parts of a file are not legal: counts by type, all else by part."""
    counts = Counter(part.instance.type for part in parts)
    for part in parts:
        name = part.instance.type
        for breach in part.breaches:
            if breach.rule == "type":
                yield breach.message
            elif breach.rule == "count":
                yield f"{counts[name]} {name} requested, maximum {rules.types[name].most}"
            else:
                yield f"{name} {part.name}: {breach.message}"
