"""What VRX's own generator, `generate_wamv.launch`, would say about the same files.

It goes through a file part by part and keeps only the result of the last one; a count that is too high is
logged and forgotten at the next part; a parameter that is not permitted is logged, and it takes any piece of the
list of permitted names for permitted. Sources: vrx_gazebo/src/vrx_gazebo/{configure_wamv,utils,compliance}.py.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from vrx_mj.config.parts.boxes import assigned
from vrx_mj.config.parts.catalogue import TYPES
from vrx_mj.config.parts.files import Instance, PartsFile
from vrx_mj.config.parts.mounts import place_of
from vrx_mj.config.parts.rules import Rules

__all__ = ["GeneratorResult", "generator_result"]


@dataclass(frozen=True)
class GeneratorResult:
    """How VRX's generator would end."""

    passes: bool | None
    """Whether it would end without calling the boat not compliant; None where it stops before that."""
    errors: bool
    """Whether it would log any error: by that a VRX competition decides."""
    stops: tuple[str, ...]
    """What it would stop at."""


def generator_result(files: Sequence[PartsFile], book: Rules) -> GeneratorResult:
    """How VRX's generator would end for these files, by a set of rules."""
    stops = tuple(stop for file in files for stop in (*file.stops, *_unknown(file, book)))
    ends = [_end(file, book) for file in files]
    passes = None if stops else all(passed for passed, _ in ends)
    return GeneratorResult(passes, bool(stops) or not passes or any(logged for _, logged in ends), stops)


def _unknown(file: PartsFile, book: Rules) -> Iterator[str]:
    """Types of which its rules have no count."""
    names = dict.fromkeys(part.type for part in file.instances)
    yield from (f"type {name}" for name in names if name not in book.of(file.kind).types)


def _end(file: PartsFile, book: Rules) -> tuple[bool, bool]:
    """The result of a file, which is that of its last part, and whether an error is logged on the way."""
    if not file.instances:
        return book.empty_passes, False
    rules = book.of(file.kind)
    places = [place_of(part) for part in file.instances]
    boxes = iter(assigned([place for place in places if place is not None], rules.boxes))
    inside = [place is None or next(boxes) is not None for place in places]
    counts = Counter(part.type for part in file.instances)
    too_many = any(name in rules.types and count > rules.types[name].most for name, count in counts.items())
    odd = any(not _permitted(part, book) for part in file.instances)
    return inside[-1], too_many or odd or not all(inside)


def _permitted(instance: Instance, book: Rules) -> bool:
    """Whether each parameter is a piece of the list of permitted ones, which is one text there."""
    rules = book.of(TYPES[instance.type].kind).types.get(instance.type)
    return rules is None or all(key in " ".join(rules.parameters) for key in instance.parameters)
