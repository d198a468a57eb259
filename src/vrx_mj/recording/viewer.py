"""Opens recordings in rerun's viewer."""

from __future__ import annotations

import subprocess
import tempfile
import uuid
from dataclasses import replace
from pathlib import Path

from vrx_mj.arguments import check_name
from vrx_mj.recording.reader import Record, read_record
from vrx_mj.recording.rrd_file import copy_without_views
from vrx_mj.recording.simulation_scene import scene_of
from vrx_mj.recording.writer import APPLICATION, join_views, viewer_binary
from vrx_mj.runtime.simulation import Simulation

__all__ = ["open_viewer"]


def open_viewer(path: str | Path, *, follow: str | None = None) -> int:
    """Open a recording in the viewer, which listens to this machine only; the viewer's exit code.

    The camera follows the boat `follow`, or else what it followed when the run was recorded. The file of a killed run
    has no blueprint yet: it is opened with the one that the recording carries.

    Raises:
        UnknownNameError: unknown boat.
        RecordError: the file is not a recording, or damaged: all of it is parsed before the viewer has it.
    """
    record = read_record(path, whole=True)
    command = [str(viewer_binary()), "--bind", "127.0.0.1"]
    if follow is None and record.has_views:
        return subprocess.run([*command, str(record.path)], check=False).returncode
    with tempfile.TemporaryDirectory() as folder:
        if follow is not None:
            return subprocess.run([*command, str(following(record, follow, Path(folder)))], check=False).returncode
        blueprint = Path(folder) / "views.rbl"
        blueprint.write_bytes(record.views)
        return subprocess.run([*command, str(record.path), str(blueprint)], check=False).returncode


def following(record: Record, boat: str, folder: Path) -> Path:
    """A copy of a recording in a folder, with a camera that follows a boat: a viewer prefers the views in a file.

    Raises:
        UnknownNameError: unknown boat.
    """
    views, bare, copy = views_following(record, boat), folder / "bare.rrd", folder / record.path.name
    copy_without_views(record.path, bare, APPLICATION, str(uuid.uuid4()))
    copy = copy.with_stem(f"{copy.stem}_{boat}")
    join_views(bare, views, copy, chunks=0)
    return copy


def views_following(record: Record, boat: str) -> bytes:
    """The blueprint of a recording with a camera that follows a boat, as the bytes of an `.rbl` file.

    Raises:
        UnknownNameError: unknown boat.
    """
    from vrx_mj.recording.blueprint import blueprint_bytes

    check_name("boat", boat, record.boats)
    sim = Simulation(record.companies[0].world)
    scene = scene_of(sim, looks_of=[boat] if boat in sim.boats else [])
    scene = replace(scene, sensors=record.sensors, earlier=tuple(record.boats), follow=boat)
    return blueprint_bytes(scene, APPLICATION)
