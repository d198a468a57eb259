"""The rerun executable: joins a recording and its blueprint, and opens recordings."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import uuid
from dataclasses import replace
from pathlib import Path

from vrx_mj.arguments import check_name
from vrx_mj.errors import RecordError
from vrx_mj.recording.parsed import copy_without_views
from vrx_mj.recording.reader import Record, read_record

__all__ = ["join_views", "open_viewer", "viewer_binary"]

JOIN_SECONDS = 600.0
"""Longest that joining may take."""
MANY_CHUNKS = 4000
"""Recordings of more chunks are compacted when they are closed: a viewer opens those faster."""


def viewer_binary() -> Path:
    """The executable inside the installed rerun package: the script beside Python only wraps it."""
    import rerun

    name = "rerun.exe" if sys.platform == "win32" else "rerun"
    path = Path(rerun.__file__).parent.parent / "rerun_cli" / name
    if not path.is_file():
        raise RecordError(f"no rerun viewer at '{path}': install rerun-sdk for this platform")
    return path


def join_views(recording: Path, views: bytes, output: Path, *, chunks: int) -> None:
    """Write `recording`, its blueprint `views` and a table of contents to `output`, alone in its folder."""
    blueprint = output.with_suffix(".rbl")
    blueprint.write_bytes(views)
    how = ["optimize", "--profile", "live"] if chunks > MANY_CHUNKS else ["merge"]
    command = [str(viewer_binary()), "rrd", *how, str(recording), str(blueprint), "-o", str(output)]
    done = subprocess.run(command, capture_output=True, timeout=JOIN_SECONDS, check=False)
    if done.returncode != 0:
        said = done.stderr.decode("utf-8", "replace").strip().splitlines()
        raise RecordError(f"rerun cannot finish '{recording}': {said[-1] if said else done.returncode}")


def open_viewer(path: str | Path, *, follow: str | None = None) -> int:
    """Open a recording in the viewer, which listens to this machine only; the viewer's exit code.

    The camera follows the boat `follow`, or else what it followed when the run was recorded. The file of a killed run
    has no blueprint yet: it is opened with the one that the recording carries.

    Raises:
        UnknownNameError: there is no such boat.
        RecordError: the file is no recording, or damaged: all of it is parsed before the viewer has it.
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
        UnknownNameError: there is no such boat.
    """
    from vrx_mj.recording.writer import APPLICATION

    views, bare, copy = views_following(record, boat), folder / "bare.rrd", folder / record.path.name
    copy_without_views(record.path, bare, APPLICATION, str(uuid.uuid4()))
    copy = copy.with_stem(f"{copy.stem}_{boat}")
    join_views(bare, views, copy, chunks=0)
    return copy


def views_following(record: Record, boat: str) -> bytes:
    """The blueprint of a recording with a camera that follows a boat, as the bytes of an `.rbl` file.

    Raises:
        UnknownNameError: there is no such boat.
    """
    from vrx_mj.recording.blueprint import blueprint_bytes
    from vrx_mj.recording.session import scene_of
    from vrx_mj.recording.writer import APPLICATION
    from vrx_mj.runtime.simulation import Simulation

    check_name("boat", boat, record.boats)
    sim = Simulation(record.companies[0].world)
    scene = scene_of(sim, looks_of=[boat] if boat in sim.boats else [])
    scene = replace(scene, sensors=record.sensors, earlier=tuple(record.boats), follow=boat)
    return blueprint_bytes(scene, APPLICATION)
