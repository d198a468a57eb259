"""Whether a boat is legal: every part of its files against a set of rules.

All parts count. VRX's own generator ends with the result of the last part of each file alone; what it would say is
in `Verdict.generator`, for comparison.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from vrx_mj.config.parts.boxes import FACE, Box, Point, Spot, assigned, nearest_box, nearest_place
from vrx_mj.config.parts.catalogue import TYPES
from vrx_mj.config.parts.files import Instance, Kind, PartsFile
from vrx_mj.config.parts.mounts import name_of, place_of
from vrx_mj.config.parts.rules import KindRules, Rules, load_rules
from vrx_mj.config.parts.vrx_verdict import GeneratorResult, generator_result
from vrx_mj.config.ros_names import ALLOWED, is_ros_name
from vrx_mj.config.wording import shown

__all__ = ["Breach", "PartVerdict", "Verdict", "judge"]

WAYS = (
    ("too far aft", "too far forward"),
    ("too far to starboard", "too far to port"),
    ("too low", "too high"),
)
"""Which way a part misses a box along x, y and z: below its least, above its greatest."""


@dataclass(frozen=True)
class Breach:
    """A rule that a part breaks."""

    rule: Literal["type", "count", "parameter", "place", "name"]
    message: str


@dataclass(frozen=True)
class PartVerdict:
    """What the rules say about one part."""

    instance: Instance
    kind: Kind
    point: Point | None
    """Its place in base_link [m]; None for a part without one that rules speak of."""
    box: Box | None
    """The box that took it."""
    breaches: tuple[Breach, ...]
    legal: Spot | None = None
    """For a part outside every box: the nearest place that would do, if there is any."""

    @property
    def name(self) -> str:
        """What the part is called."""
        return name_of(self.instance)

    @property
    def compliant(self) -> bool:
        """Whether it breaks no rule."""
        return not self.breaches


@dataclass(frozen=True)
class Verdict:
    """What a set of rules says about a boat."""

    rules: Rules
    parts: tuple[PartVerdict, ...]
    """In the order of the files, components first."""
    reasons: tuple[str, ...]
    """Why it is not legal, each once; empty if it is."""
    generator: GeneratorResult

    @property
    def compliant(self) -> bool:
        """Whether no part breaks a rule."""
        return not self.reasons


def judge(components: PartsFile | None, thrusters: PartsFile | None, rules: str = "classic") -> Verdict:
    """Judge the parts of a boat; a file that is None is left out.

    Raises:
        UnknownNameError: there is no such set of rules.
    """
    book = load_rules(rules)
    files = [file for file in (components, thrusters) if file is not None]
    judged = {file.kind: tuple(_judged(file, book)) for file in files}
    reasons = dict.fromkeys(reason for kind, parts in judged.items() for reason in _reasons(parts, book.of(kind)))
    parts = tuple(part for each in judged.values() for part in each)
    return Verdict(book, parts, tuple(reasons), generator_result(files, book))


def _judged(file: PartsFile, book: Rules) -> Iterator[PartVerdict]:
    """The verdict on each part of a file."""
    rules = book.of(file.kind)
    points = {i: point for i, part in enumerate(file.instances) if (point := place_of(part)) is not None}
    boxes = dict(zip(points, assigned(list(points.values()), rules.boxes), strict=True))
    legal = _legal_places(list(points.values()), rules.boxes)
    spots = dict(zip(points, legal, strict=True))
    for i, instance in enumerate(file.instances):
        breaches = [*_against_type(instance, book)]
        point, box = points.get(i), boxes.get(i)
        if point is not None and box is None:
            breaches.append(Breach("place", _outside(point, rules.boxes)))
        yield PartVerdict(instance, file.kind, point, box, tuple(breaches), spots.get(i))


def _legal_places(points: list[Point], boxes: Sequence[Box]) -> list[Spot | None]:
    """For each point outside every box, where it may go if those before it have moved too."""
    moved, found = list(points), list[Spot | None]()
    for index, box in enumerate(assigned(points, boxes)):
        spot = None if box is not None else nearest_place(moved, index, boxes)
        if spot is not None:
            moved[index] = spot.point
        found.append(spot)
    return found


def _against_type(instance: Instance, book: Rules) -> Iterator[Breach]:
    """What a part breaks whatever its place."""
    part, name = TYPES[instance.type], name_of(instance)
    if name and not is_ros_name(name):
        yield Breach("name", f"ROS refuses the name {shown(name)}: {ALLOWED} are allowed")
    rules = book.of(part.kind).types.get(instance.type)
    if rules is None:
        yield Breach("type", f"type {instance.type} is not an accepted {part.kind.removesuffix('s')} type")
        return
    if instance.index >= rules.most:
        yield Breach("count", f"number {instance.index + 1} of its type; at most {rules.most}")
    for key in instance.parameters:
        if key not in rules.parameters:
            release = getattr(part.parameter(key), "release", None)
            missing = "" if release in {None, book.release} else "; this VRX's macro has no such parameter"
            yield Breach("parameter", f"parameter {key} not permitted{missing}")


def _outside(point: Point, boxes: Sequence[Box]) -> str:
    """Why a point got no box, and by how much it misses the nearest."""
    full = [box.name for box in boxes if box.contains(point)]
    if full:
        return f"inside {' and '.join(full)}, which {'is' if len(full) == 1 else 'are'} full"
    near = nearest_box(point, boxes)
    if near is None:
        return "no box exists for it"
    off = (x - there for x, there in zip(point, near.point, strict=True))
    ways = (f"{abs(d):.4g} m {words[d > 0]}" for d, words in zip(off, WAYS, strict=True) if abs(d) > FACE)
    return f"outside every box; it misses {near.box.name} by {near.distance:.4g} m: {', '.join(ways)}"


def _reasons(parts: Sequence[PartVerdict], rules: KindRules) -> Iterator[str]:
    """Why the parts of a file are not legal: counts by type, all else by part."""
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
