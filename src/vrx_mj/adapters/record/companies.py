"""Boats that come and go in a recording: a company is those that sail together until one joins or leaves.

Rows, frames and saved worlds are each of one company. Read back, rows have the columns of all, NaN where a boat was not
there.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from vrx_mj.adapters.record.rows import unpack_rows
from vrx_mj.adapters.record.scene import MovingBody, RecordScene, RowLayout

if TYPE_CHECKING:
    from rerun.chunk import Chunk

__all__ = [
    "COMPANIES",
    "Company",
    "all_rows",
    "columns_in",
    "company_chunk",
    "joint_layout",
    "read_companies",
    "unpacked",
]

COMPANIES = "/record/companies"
FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Company:
    """Boats that sailed together."""

    layout: RowLayout
    """Columns of its rows."""
    world_sha256: str
    """Fingerprint of its world, as its states have it."""
    files: Mapping[str, bytes]
    """The saved form of its world, by relative path."""

    @property
    def parameters(self) -> Mapping[str, Any]:
        """The parameters of its world."""
        return json.loads(self.files["scene.json"])  # type: ignore[no-any-return]


def company_chunk(scene: RecordScene, before: RecordScene, number: int) -> Chunk:
    """The company of a scene, the one of this number, from its first moment on; of files those that are new."""
    import rerun as rr
    from rerun.chunk import Chunk

    from vrx_mj.adapters.record.moving import times
    from vrx_mj.adapters.record.still import archive

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


def read_companies(first: Company, parts: Sequence[Mapping[str, Any]]) -> tuple[Company, ...]:
    """All companies of a recording, by their number."""
    found = [first]
    later = [
        (json.loads(head[0]), unpacked(files[0]))
        for part in parts
        for head, files in zip(part["head"], part["files"], strict=True)
    ]
    for head, new in sorted(later, key=lambda pair: int(pair[0]["number"])):
        files = {**found[-1].files, **new}
        kept = {name: files[name] for name in head["files"]}
        found.append(Company(RowLayout.from_json(head["layout"]), head["world_sha256"], kept))
    return tuple(found)


def unpacked(blob: bytes) -> dict[str, bytes]:
    """Files of the archive in a recording."""
    with zipfile.ZipFile(io.BytesIO(blob)) as stored:
        return {name: stored.read(name) for name in stored.namelist()}


def all_rows(
    parts: Sequence[Mapping[str, Any]], layouts: Sequence[RowLayout]
) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Rows of every block in the columns of the joint layout, sorted by time, and numbers (n,) of their companies.

    `layouts` are those of the companies.
    """
    joint = joint_layout(layouts)
    places = [columns_in(joint, layout) for layout in layouts]
    found, owners = [np.empty((0, joint.width))], [np.zeros(0, np.int64)]
    for part in parts:
        numbers = part.get("company") or [[0]] * len(part["block"])
        for blob, (number,) in zip(part["block"], numbers, strict=True):
            rows = unpack_rows(blob[0])
            wide = np.full((len(rows), joint.width), np.nan)
            wide[:, places[number]] = rows
            found.append(wide)
            owners.append(np.full(len(rows), number))
    rows, numbers = np.concatenate(found), np.concatenate(owners)
    order = np.argsort(rows[:, 0], kind="stable")
    return rows[order], numbers[order]


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


def columns_in(joint: RowLayout, layout: RowLayout) -> npt.NDArray[np.int64]:
    """Where the columns of a company's rows are in the joint layout."""
    return np.array([0, 1, *_engines_in(joint, layout), *_bodies_in(joint, layout)], np.int64)


def _engines_in(joint: RowLayout, layout: RowLayout) -> Iterator[int]:
    for table in (joint.thrust, joint.angle):
        yield from (table.start + joint.thrusters.index(thruster) for thruster in layout.thrusters)


def _bodies_in(joint: RowLayout, layout: RowLayout) -> Iterator[int]:
    """Columns of qpos, of qvel and of what lights and placards show."""
    own, places = spans(layout), spans(joint)
    for i, table in enumerate((joint.qpos, joint.qvel)):
        yield from (table.start + places[name][i].start + k for name in own for k in range(len(own[name][i])))
    yield from range(joint.marks.start, joint.marks.stop)
