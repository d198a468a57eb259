"""Whether the tables of a compiled world fit each other: what a row points at, by number or by name, is there."""

from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import chain, pairwise
from typing import Any

from vrx_mj.model import tasks
from vrx_mj.model.boats import Boat
from vrx_mj.model.site import Dock, Object
from vrx_mj.model.world import Parameters, linked_rows
from vrx_mj.physics.tables import SAIL

_Spans = Iterable[tuple[int, int]]
_FLOATING = "floating"


def broken_references(world: Parameters) -> Iterator[str]:
    """Faults of references, each with its place; none if all fit."""
    floating = [item for item in world.objects if item.kind == _FLOATING]
    for table, things, kind in (("hulls", world.boats, "boats"), ("floats", floating, "floating objects")):
        if (count := len(getattr(world, table))) != len(things):
            yield f"{table}: {count} rows for {len(things)} {kind}"
    for table, number, column, mark, rows in linked_rows(world):
        size = len(getattr(world, mark.table))
        if rows.stop > size:
            yield f"{table}[{number}].{column}: there is no row {rows.stop - 1} among {size} {mark.table}"
    yield from _boats(world)
    yield from _afloat(world)
    yield from _blocks(world)
    yield from _unique(world)
    if world.task is not None:
        yield from _task(world, world.task)


def _boats(world: Parameters) -> Iterator[str]:
    spans = [("station", world.stations), ("thruster", world.thrusters)]
    for kind, rows in spans:
        owned = [(getattr(hull, f"{kind}_start"), getattr(hull, f"{kind}_count")) for hull in world.hulls]
        yield from _partition("hulls", kind, owned, len(rows))
    for number, thruster in enumerate(world.thrusters):
        own = world.hulls[thruster.hull : thruster.hull + 1]
        if not any(0 <= number - hull.thruster_start < hull.thruster_count for hull in own):
            yield f"thrusters[{number}].hull: {thruster.hull} is not the hull whose thruster it is"
        if (thruster.mapping == SAIL) != (thruster.sail is not None):
            yield f"thrusters[{number}].sail: a sail has a curve, and nothing else has"
    boats = {boat.name for boat in world.boats}
    for number, sensor in enumerate(world.sensors):
        if sensor.boat not in boats:
            yield f"sensors[{number}].boat: there is no boat '{sensor.boat}'"


def _afloat(world: Parameters) -> Iterator[str]:
    floating = [item for item in world.objects if item.kind == _FLOATING]
    for number, (row, item) in enumerate(zip(world.floats, floating, strict=False)):
        if row.body != item.body:
            yield f"floats[{number}].body: '{row.body}' is not '{item.body}', the body of the object '{item.name}'"
    driven = sorted(row.follower for row in world.floats if row.follower >= 0)
    if driven != list(range(len(world.followers))):
        yield f"floats: their followers are {driven}, each of {len(world.followers)} is needed once"
    bodies = {body for item in world.objects for body in (item.body, *item.links)}
    for number, link in enumerate(world.links):
        if link.body not in bodies:
            yield f"links[{number}].body: '{link.body}' is not a body of an object"
        if link.follower >= 0:
            yield f"links[{number}].follower: a link has none"


def _blocks(world: Parameters) -> Iterator[str]:
    """Blocks come tree after tree, each after the one that it hangs on; a floating dock is a tree."""
    docks = [dock for dock in world.docks if dock.dynamic]
    bodies = list(chain.from_iterable(dock.bodies for dock in docks))
    if [block.body for block in world.blocks] != bodies:
        yield "blocks: their bodies are not those of the floating docks"
        return
    starts = [0]
    for dock in docks:
        starts.append(starts[-1] + len(dock.bodies))
    for first, end in pairwise(starts):
        for number in range(first, end):
            block = world.blocks[number]
            root = number == first
            if block.parent != -1 if root else not first <= block.parent < number:
                yield f"blocks[{number}].parent: {block.parent} is not a block of its dock that comes before"
            elif block.depth != (0 if root else world.blocks[block.parent].depth + 1):
                yield f"blocks[{number}].depth: {block.depth} is not the number of hinges to its root"


def _unique(world: Parameters) -> Iterator[str]:
    """Names by which something is looked up."""
    things: list[Boat | Object | Dock] = [*world.boats, *world.objects, *world.docks]
    kinds: list[tuple[str, list[Any]]] = [
        ("boats, objects and docks", [thing.name for thing in things]),
        ("lights", [light.name for light in world.lights]),
        ("placards", [placard.name for placard in world.placards]),
        ("thrusters of a boat", [(thruster.hull, thruster.name) for thruster in world.thrusters]),
        ("sensors of a boat", [(sensor.boat, sensor.name) for sensor in world.sensors]),
    ]
    for kind, names in kinds:
        for name, count in Counter(names).most_common(1):
            if count > 1:
                yield f"{kind}: the name {name!r} is given {count} times"


def _task(world: Parameters, task: tasks.Task) -> Iterator[str]:
    boats = {boat.name for boat in world.boats}
    if task.boat not in boats:
        yield f"task.boat: there is no boat '{task.boat}'"
    moving = {item.name for item in world.objects if item.kind == _FLOATING}
    moving |= {dock.name for dock in world.docks if dock.dynamic}
    still = ({item.name for item in world.objects} | {dock.name for dock in world.docks}) - moving
    for name in task.fixed:
        if name not in still:
            yield f"task.fixed: '{name}' is not an object or dock that never moves"
    known = {
        "object or dock": moving | set(task.fixed),
        "placard": {placard.name for placard in world.placards},
        "light": {light.name for light in world.lights},
    }
    for place, kind, name in tasks.names_in(task):
        if name not in known[kind]:
            yield f"task.{place}: there is no {kind} '{name}'"


def _partition(table: str, kind: str, spans: _Spans, size: int) -> Iterator[str]:
    """Whether spans of rows follow each other and leave none out."""
    end = 0
    for first, count in spans:
        if first != end:
            yield f"{table}: {kind}_start is {first} where {kind}s were left at {end}"
            return
        end += count
    if end != size:
        yield f"{table}: they have {end} {kind}s of {size}"
