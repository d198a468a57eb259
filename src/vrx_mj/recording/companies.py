"""Boats that come and go in a recording: a company is those that sail together until one joins or leaves.

Rows, frames and saved worlds are each of one company. Read back, rows have the columns of all, NaN where a boat was not
there.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from vrx_mj.arrays import BoolArray, FloatArray, IntArray
from vrx_mj.errors import RecordError, StateError
from vrx_mj.mjcf.world import World, world_of
from vrx_mj.model.world import Parameters
from vrx_mj.recording.headers import company_head
from vrx_mj.recording.packing import archive, unpack_rows, unpacked
from vrx_mj.recording.record_scene import MovingBody, RecordScene, RowLayout
from vrx_mj.recording.rrd_file import LONGEST

if TYPE_CHECKING:
    from rerun.chunk import Chunk

    from vrx_mj.recording.rrd_file import Part

__all__ = [
    "COMPANIES",
    "HUGE",
    "Company",
    "all_rows",
    "columns_in",
    "company_chunk",
    "company_numbers",
    "joint_layout",
    "read_companies",
    "sound_rows",
]

COMPANIES = "/record/companies"
HUGE = 1e9
"""A number of a row beyond this is of a state that has diverged."""


@dataclass(frozen=True, eq=False)
class Company:
    """Boats that sailed together."""

    layout: RowLayout
    """Columns of its rows."""
    world_sha256: str
    """Fingerprint of its world, as its states have it."""
    files: Mapping[str, bytes]
    """The saved form of its world, by relative path."""

    @cached_property
    def world(self) -> World:
        """Its world, in memory: nothing of it is written to disk.

        Raises:
            StateError: the recording holds no world, or it is damaged or of another version.
        """
        files = self.files
        try:
            mjcf, parameters = files["scene.xml"], files["scene.json"]
            return world_of(mjcf, parameters, lambda name: files[f"assets/{name}"], "the recording's scene.json")
        except KeyError as error:
            raise StateError(f"no saved world in the recording: {error}") from error

    @property
    def parameters(self) -> Parameters:
        """The parameters of its world.

        Raises:
            StateError: the recording holds no world, or it is damaged or of another version.
        """
        return self.world.parameters


def company_chunk(scene: RecordScene, before: RecordScene, number: int) -> Chunk:
    """The company of a scene, the one of this number, from its first moment on; of files those that are new."""
    import rerun as rr
    from rerun.chunk import Chunk

    from vrx_mj.recording.motion_chunks import times

    assert scene.begun is not None, "boats come and go at a time"
    new = {name: content for name, content in scene.files.items() if before.files.get(name) != content}
    head = {
        "number": number,
        "layout": scene.layout().to_json(),
        "world_sha256": scene.properties["world_sha256"],
        "files": sorted(scene.files),
    }
    columns = rr.AnyValues.columns(head=[json.dumps(head)], files=[archive(new)])
    return Chunk.from_columns(COMPANIES, [times([scene.begun])], columns)


def read_companies(first: Company, parts: Sequence[Part], most: int) -> tuple[Company, ...]:
    """All companies of a recording, by their number; `most`: bytes of all files.

    Raises:
        RecordError: one is damaged.
    """
    later = [
        (company_head(head), files)
        for part in parts
        for head, files in zip(part.texts("head"), part.blobs("files"), strict=True)
    ]
    found, left = [first], most - size_of(first.files)
    for head, blob in sorted(later, key=lambda pair: pair[0].number):
        new = unpacked(blob, left)
        left -= size_of(new)
        files = {**found[-1].files, **new}
        if head.number != len(found):
            raise RecordError(f"companies: number {head.number} instead of {len(found)}")
        if missing := set(head.files) - files.keys():
            raise RecordError(f"companies: files: {len(missing)} are missing")
        found.append(Company(head.layout, head.world_sha256, {name: files[name] for name in head.files}))
    return tuple(found)


def size_of(files: Mapping[str, bytes]) -> int:
    """Bytes of files."""
    return sum(map(len, files.values()))


def all_rows(parts: Sequence[Part], layouts: Sequence[RowLayout], most: int) -> tuple[FloatArray, IntArray]:
    """Rows of every block in the columns of the joint layout, sorted by time, and numbers (n,) of their companies.

    `layouts` are those of the companies; `most`: bytes of the rows.

    Raises:
        RecordError: a block is damaged, or of no company.
    """
    joint = joint_layout(layouts)
    blocks = [
        (number, unpack_rows(blob))
        for part in parts
        for number, blob in zip(company_numbers(part, len(layouts)), part.blobs("block"), strict=True)
    ]
    for number, rows in blocks:
        check_rows(rows, layouts[number].width)
    needed = 8 * (joint.width * sum(len(rows) for _, rows in blocks) + sum(layout.width for layout in layouts))
    if needed > most:
        raise RecordError(f"/record/rows: {needed >> 20} MiB with the columns of all companies: at most {most >> 20}")
    places = [columns_in(joint, layout) for layout in layouts]
    found, owners = [np.empty((0, joint.width))], [np.zeros(0, np.int64)]
    for number, rows in blocks:
        wide = np.full((len(rows), joint.width), np.nan)
        wide[:, places[number]] = rows
        found.append(wide)
        owners.append(np.full(len(rows), number))
    rows, numbers = np.concatenate(found), np.concatenate(owners)
    order = np.argsort(rows[:, 0], kind="stable")
    return rows[order], numbers[order]


def company_numbers(part: Part, count: int) -> list[int]:
    """The company of each block of a part, of so many; the first in a recording from before boats could come and go.

    Raises:
        RecordError: there is no such company.
    """
    numbers = part.numbers("company", "i") if "company" in part.columns else [0] * len(part.blobs("block"))
    for number in numbers:
        if not 0 <= number < count:
            raise RecordError(f"{part.entity}: company: {number}, of {count}")
    return numbers


def check_rows(rows: FloatArray, width: int) -> None:
    """Check that a block's rows have so many columns, and a time each.

    Raises:
        RecordError: they do not.
    """
    if rows.shape[1] != width:
        raise RecordError(f"/record/rows: block: rows of {rows.shape[1]} columns instead of {width}")
    if not ((rows[:, 0] >= 0.0) & (rows[:, 0] <= LONGEST)).all():
        raise RecordError(f"/record/rows: block: a time from 0 to {LONGEST:g} s is needed")


def sound_rows(rows: FloatArray, numbers: IntArray, layouts: Sequence[RowLayout]) -> BoolArray:
    """Of which rows (n,) every number of their company is one that a state can have."""
    fine = np.zeros(len(rows), np.bool_)
    joint = joint_layout(layouts)
    for number, layout in enumerate(layouts):
        own = np.flatnonzero(numbers == number)
        fine[own] = (np.abs(rows[np.ix_(own, columns_in(joint, layout))]) < HUGE).all(axis=1)
    return fine


def joint_layout(layouts: Sequence[RowLayout]) -> RowLayout:
    """Columns for the rows of all companies: those of who joined later come last."""
    if len(layouts) == 1:
        return layouts[0]
    widths: dict[str, tuple[int, int]] = {}
    for layout in layouts:
        for name, (qpos, qvel) in spans(layout).items():
            wide, fast = widths.get(name, (0, 0))
            widths[name] = max(wide, len(qpos)), max(fast, len(qvel))
    starts = dict(zip(widths, np.cumsum([(0, 0), *widths.values()], axis=0).tolist(), strict=False))
    kinds = {body.name: body.kind for layout in layouts for body in layout.bodies}
    nq, nv = np.sum([*widths.values()], axis=0).tolist()
    return RowLayout(
        nq=nq,
        nv=nv,
        thrusters=tuple(dict.fromkeys(thruster for layout in layouts for thruster in layout.thrusters)),
        bodies=tuple(MovingBody(name, kind, *starts[name]) for name, kind in kinds.items()),
        display_marks=layouts[0].display_marks,
    )


def spans(layout: RowLayout) -> dict[str, tuple[range, range]]:
    """By body, in MuJoCo's order, its numbers in qpos and qvel: of its free joint, and of what hangs on it."""
    bodies = sorted(layout.bodies, key=lambda body: body.qpos)
    ends = [*((body.qpos, body.dof) for body in bodies[1:]), (layout.nq, layout.nv)]
    return {
        body.name: (range(body.qpos, qpos), range(body.dof, dof))
        for body, (qpos, dof) in zip(bodies, ends, strict=True)
    }


def columns_in(joint: RowLayout, layout: RowLayout) -> IntArray:
    """Where the columns of a company's rows are in the joint layout."""
    runs = [range(2), *_engines_in(joint, layout), *_bodies_in(joint, layout)]
    return np.concatenate([np.arange(run.start, run.stop, dtype=np.int64) for run in runs])


def _engines_in(joint: RowLayout, layout: RowLayout) -> Iterator[range]:
    places = {thruster: place for place, thruster in enumerate(joint.thrusters)}
    for table in (joint.thrust, joint.angle):
        starts = (table.start + places[thruster] for thruster in layout.thrusters)
        yield from (range(start, start + 1) for start in starts)


def _bodies_in(joint: RowLayout, layout: RowLayout) -> Iterator[range]:
    """Columns of qpos, of qvel and of what lights and placards show."""
    own, places = spans(layout), spans(joint)
    for i, table in enumerate((joint.qpos, joint.qvel)):
        for name in own:
            start = table.start + places[name][i].start
            yield range(start, start + len(own[name][i]))
    yield range(joint.marks.start, joint.marks.stop)
