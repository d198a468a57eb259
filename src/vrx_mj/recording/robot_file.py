"""A robot that stands still as a rerun file, in which its joints move one after the other."""

from __future__ import annotations

import uuid
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
import rerun as rr
from rerun.archetypes import RecordingInfo
from rerun.chunk import Chunk, LazyChunkStream

from vrx_mj.errors import RecordError
from vrx_mj.outputs import atomic_write
from vrx_mj.recording.motion_chunks import part_poses, transforms
from vrx_mj.recording.record_scene import RecordedPart
from vrx_mj.recording.simulation_scene import geom_surface, hanging_part
from vrx_mj.recording.static_chunks import looks_chunks
from vrx_mj.recording.timeline import static

_APPLICATION = "vrx_mj robot"
_ROOT = "/robot"
_SWEEP, _ROWS = 2.0, 40
"""Time [s] in which a joint goes to its upper limit, to its lower one and back, and the rows in it."""


def save_joints(model: mujoco.MjModel, name: str, path: Path) -> None:
    """Write a recording of this name, of a robot whose joints sweep the ranges of their controls, each in its turn.

    Raises:
        RecordError: the file cannot be written.
    """
    stream = LazyChunkStream.from_iter(list(_chunks(model, name)))
    with atomic_write(path, "the recording", RecordError) as draft:
        try:
            stream.write_rrd(draft, application_id=_APPLICATION, recording_id=str(uuid.uuid4()))
        except RuntimeError as error:  # of a place or a disk, as rerun raises it
            raise OSError(str(error)) from error


def _chunks(model: mujoco.MjModel, name: str) -> Iterator[Chunk]:
    yield Chunk.from_property("RecordingInfo", RecordingInfo(name=name))
    yield static(_ROOT, rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    paths = [_ROOT]
    for body in range(1, model.nbody):
        own = rr.escape_entity_path_part(model.body(body).name)
        paths.append(f"{paths[model.body_parentid[body]]}/{own}")
        geoms = np.flatnonzero(model.geom_bodyid == body).tolist()
        part = hanging_part(model, body, paths[body], (geom_surface(model, geom) for geom in geoms))
        yield from looks_chunks(part.path, part.fixed_pose, part.surfaces, None)
        for joint in part.joints:
            yield _sweep(model, joint.qpos, part)


def _sweep(model: mujoco.MjModel, joint: int, part: RecordedPart) -> Chunk:
    """The poses of what a joint moves, at the start and while it is its turn; `part` is at rest with 0."""
    share, (low, high), rest = np.linspace(0.0, 1.0, _ROWS), model.actuator_ctrlrange[joint], model.qpos0[joint]
    qpos = np.zeros((1 + _ROWS, model.nq))
    qpos[1:, joint] = np.interp(share, [0.0, 0.25, 0.75, 1.0], [rest, high, low, rest]) - rest
    position, quaternion = part_poses(part, qpos)
    time = np.concatenate([[0.0], (joint + share) * _SWEEP])
    return transforms(part.path, time, position, quaternion[:, [1, 2, 3, 0]])
