"""Headers of a recording, and the boats that come and go in it: a boat set sails together until one joins or leaves.

Rows, frames and saved worlds are each of one boat set. Read back, rows have the columns of all, NaN where a boat was
not there. Headers are JSON, each read by one schema: wrong kinds are errors that name the key.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import FailFast, Field, FiniteFloat, ValidationError

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.config.loading import fault_text
from vrx_mj.errors import RecordError, StateError
from vrx_mj.mjcf.world import World, world_of
from vrx_mj.recording.packing import shape_of, unpack_rows
from vrx_mj.recording.parts import ROWS, Part, unpack_files, validator
from vrx_mj.recording.record_scene import FORMAT, MovingBody, RecordedSensor, RowLayout
from vrx_mj.runtime.state import MAX_TIME

MAX_NUMBER = 1e9
"""Largest number of a row of a valid state; one beyond has diverged."""


@dataclass(frozen=True, eq=False)
class BoatSet:
    """Boats that sailed together."""

    layout: RowLayout
    """Columns of its rows."""
    world_sha256: str
    """Fingerprint of its world, as its states have it."""
    files: Mapping[str, bytes]
    """The saved form of its world, by relative path."""

    @cached_property
    def world(self) -> World:
        """World of the boat set, in memory: nothing of it is written to disk.

        Raises:
            StateError: the recording holds no world, or it is damaged or of another version.
        """
        try:
            return world_of(self.files.__getitem__, "scene", "the recording's ")
        except KeyError as error:
            raise StateError(f"no saved world in the recording: {error}") from error


def read_boat_sets(first: BoatSet, parts: Sequence[Part], most: int) -> tuple[BoatSet, ...]:
    """All companies of a recording, by their number; `most`: bytes of all files.

    Raises:
        RecordError: one is damaged.
    """
    later = [
        (parsed_json(BoatSetHead, "companies", head), files)
        for part in parts
        for head, files in zip(part.texts("head"), part.blobs("files"), strict=True)
    ]
    found, left = [first], most - sum(map(len, first.files.values()))
    for head, blob in sorted(later, key=lambda pair: pair[0].number):
        new = unpack_files(blob, left)
        left -= sum(map(len, new.values()))
        files = {**found[-1].files, **new}
        if head.number != len(found):
            raise RecordError(f"companies: number {head.number} instead of {len(found)}")
        if missing := set(head.files) - files.keys():
            raise RecordError(f"companies: files: {len(missing)} are missing")
        found.append(BoatSet(head.layout, head.world_sha256, {name: files[name] for name in head.files}))
    return tuple(found)


def all_rows(parts: Sequence[Part], layouts: Sequence[RowLayout], most: int) -> tuple[FloatArray, IntArray]:
    """Rows of every block in the columns of the joint layout, sorted by time, and numbers (n,) of their companies.

    `layouts` are those of the companies; `most`: bytes of the rows.

    Raises:
        RecordError: a block is damaged, or of no boat set.
    """
    joint = joint_layout(layouts)
    blocks = numbered_blocks(parts, len(layouts), most)
    for number, block in blocks:
        if block.shape[1] != layouts[number].width:
            raise RecordError(f"{ROWS}: block: rows of {block.shape[1]} columns instead of {layouts[number].width}")
        if not ((block[:, 0] >= 0.0) & (block[:, 0] <= MAX_TIME)).all():
            raise RecordError(f"{ROWS}: block: a time from 0 to {MAX_TIME:g} s is needed")
    lengths = [len(block) for _, block in blocks]
    needed = 8 * (joint.width * sum(lengths) + sum(layout.width for layout in layouts))
    if needed > most:
        raise RecordError(f"{ROWS}: {needed >> 20} MiB with the columns of all boat sets: at most {most >> 20}")
    columns = [columns_in(joint, layout) for layout in layouts]
    numbers = np.repeat(np.array([number for number, _ in blocks], np.int64), lengths)
    rows = np.full((len(numbers), joint.width), np.nan)
    for (number, block), end in zip(blocks, np.cumsum(lengths).tolist(), strict=True):
        rows[end - len(block) : end, columns[number]] = block
    order = np.argsort(rows[:, 0], kind="stable")
    return rows[order], numbers[order]


def numbered_blocks(parts: Sequence[Part], count: int, most: int) -> list[tuple[int, FloatArray]]:
    """The boat set, of so many, and the rows of each block; `most`: bytes of the rows.

    Raises:
        RecordError: a block is damaged, or of no boat set.
    """
    numbers = [number for part in parts for number in part.numbers("company", "i")]
    if unknown := [number for number in numbers if not 0 <= number < count]:
        raise RecordError(f"{parts[0].entity}: company: {unknown[0]}, of {count}")
    blobs = [blob for part in parts for blob in part.blobs("block")]
    if (needed := sum(8 * rows * width for rows, width in map(shape_of, blobs))) > most:
        raise RecordError(f"block: {needed >> 20} MiB of rows: at most {most >> 20}")
    return list(zip(numbers, map(unpack_rows, blobs), strict=True))


def sound_rows(rows: FloatArray, numbers: IntArray, layouts: Sequence[RowLayout]) -> BoolArray:
    """Whether every number of a row's boat set is one that a state can have, (n,)."""
    fine = np.zeros(len(rows), np.bool_)
    joint = joint_layout(layouts)
    for number, layout in enumerate(layouts):
        own = np.flatnonzero(numbers == number)
        fine[own] = (np.abs(rows[np.ix_(own, columns_in(joint, layout))]) < MAX_NUMBER).all(axis=1)
    return fine


def joint_layout(layouts: Sequence[RowLayout]) -> RowLayout:
    """Columns for the rows of all boat sets: those of who joined later come last."""
    widths: dict[_ColumnGroup, int] = {}
    for group, width in chain.from_iterable(_column_groups(layout).items() for layout in layouts):
        widths[group] = max(width, widths.get(group, 0))
    starts: dict[_ColumnGroup, int] = {}
    ends = {table: widths.pop((table, ""), 0) for table in ("qpos", "dof")}
    for (table, name), width in widths.items():
        if table in ends:
            starts[table, name] = ends[table]
            ends[table] += width
    kinds = {body.name: body.kind for layout in layouts for body in layout.bodies}
    return RowLayout(
        nq=ends["qpos"],
        nv=ends["dof"],
        thrusters=tuple(dict.fromkeys(thruster for layout in layouts for thruster in layout.thrusters)),
        bodies=tuple(MovingBody(name, kind, starts["qpos", name], starts["dof", name]) for name, kind in kinds.items()),
        display_marks=widths["marks", ""],
        wind_angles=widths["wind angle", ""],
    )


_ColumnGroup = tuple[str, str | tuple[str, str]]
"""A table of a row, and the body, or boat and thruster, to which the columns in it belong."""


def _column_groups(layout: RowLayout) -> dict[_ColumnGroup, int]:
    """Widths of the groups of columns, in their order; in qpos and dof, of a free joint and all that hangs on it."""
    groups: dict[_ColumnGroup, int] = {("time and wind", ""): 2}
    groups |= {(table, thruster): 1 for table in ("thrust", "angle") for thruster in layout.thrusters}
    for table, end in (("qpos", layout.nq), ("dof", layout.nv)):
        bodies = sorted((getattr(body, table), body.name) for body in layout.bodies)
        anchored = bodies[0][0] if bodies else end  # on joints of what does not move, before all else
        groups |= {(table, ""): anchored} if anchored else {}
        ends = [*(start for start, _ in bodies[1:]), end]
        groups |= {(table, name): after - start for (start, name), after in zip(bodies, ends, strict=False)}
    return groups | {("marks", ""): layout.display_marks, ("wind angle", ""): layout.wind_angles}


def columns_in(joint: RowLayout, layout: RowLayout) -> IntArray:
    """Where the columns of a boat set's rows are in the joint layout."""
    groups = _column_groups(joint)
    starts = dict(zip(groups, np.cumsum([0, *groups.values()]).tolist(), strict=False))
    places = [starts[group] + np.arange(width) for group, width in _column_groups(layout).items()]
    return np.concatenate(places)


@dataclass(frozen=True)
class Version:
    """Version of a header of any format."""

    format: int


@dataclass(frozen=True, eq=False, kw_only=True)
class Head:
    """Header of a recording: its run, columns and sensors."""

    properties: Mapping[str, Any]
    """The run: world, fleet, seed, versions, platform."""
    timestep: Annotated[float, Field(gt=0.0, le=1.0)]
    """Physics step [s]."""
    wind_direction: tuple[FiniteFloat, FiniteFloat]
    """Unit vector the wind blows toward, along x and y."""
    layout: RowLayout
    """Columns of the rows of the first boat set."""
    sensors: Annotated[tuple[RecordedSensor, ...], FailFast()] = ()
    """The sensors whose readings are recorded."""
    begun: FiniteFloat = 0.0
    """Simulated time at which it begins [s]."""
    sea: bool = True
    """Whether the sea is shown."""
    follow: str | None = None
    """The boat that the camera follows; None: the fleet."""


@dataclass(frozen=True)
class BoatSetHead:
    """Header of the boats that sail together from some time on."""

    number: Annotated[int, Field(ge=1, le=1_000_000)]
    layout: RowLayout
    world_sha256: str
    files: Annotated[tuple[str, ...], FailFast()]
    """Names of the files of the saved world."""


SentMessages = list[tuple[int, list[tuple[str, Any]]]]
"""Numbers of frames, and topic and content of what was sent with each."""
_Schema = TypeVar("_Schema")


def head_of(text: str) -> Head:
    """The header of a recording.

    Raises:
        RecordError: it is damaged, or of another version.
    """
    version = parsed_json(Version, "head", text)
    if version.format != FORMAT:
        raise RecordError(f"head: format {version.format}; this version reads {FORMAT}")
    head = parsed_json(Head, "head", text)
    _check_sensors(head.sensors)
    return head


def parsed_json(schema: Callable[..., _Schema], name: str, text: str) -> _Schema:
    """The values in a JSON text, by its schema; a layout in them is checked.

    Raises:
        RecordError: it does not fit.
    """
    try:
        found: _Schema = validator(schema).validate_json(text, strict=True)
    except ValidationError as error:
        raise RecordError(f"{name}: {fault_text(error)}") from None
    if isinstance(found, Head | BoatSetHead):
        _check_layout(name, found.layout)
    return found


def _check_layout(name: str, layout: RowLayout) -> None:
    """Check that the bodies of a layout share its columns, one after another.

    Raises:
        RecordError: they do not.
    """
    for key, values in (("bodies", [body.name for body in layout.bodies]), ("thrusters", layout.thrusters)):
        if len(set(values)) < len(values):
            raise RecordError(f"{name}: layout.{key}: duplicate name")
    groups = _column_groups(layout)
    for table, total, least in (("qpos", layout.nq, 7), ("dof", layout.nv, 6)):
        widths = {name: width for (own, name), width in groups.items() if own == table}
        if sum(widths.values()) != total or min((widths[name] for name in widths if name), default=least) < least:
            raise RecordError(f"{name}: layout.bodies: their places in qpos and qvel are not those of free joints")


def _check_sensors(sensors: Sequence[RecordedSensor]) -> None:
    """Check what the sensors of a recording are.

    Raises:
        RecordError: two have one name, or a sensor's configuration is of another type.
    """
    if len({(one.boat, one.name) for one in sensors}) < len(sensors):
        raise RecordError("head: sensors: duplicate name")
    for one in sensors:
        if one.config.type != one.type:
            wrong = f"of type {one.type}, configured as {one.config.type}"
            raise RecordError(f"head: sensors: {one.boat} {one.name}: {wrong}")
