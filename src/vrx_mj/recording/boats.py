"""The boats of a recording: how they look from the moment on at which they are there, and their end."""

from __future__ import annotations

from collections.abc import Iterator

import rerun as rr
from rerun.chunk import Chunk

from vrx_mj.recording.colors import boat_colors
from vrx_mj.recording.moving import wake_path
from vrx_mj.recording.scene import RecordedBody, RecordScene
from vrx_mj.recording.still import body_chunks, mesh, named_series, pose, shown, static
from vrx_mj.recording.wake import FADES

__all__ = ["boat_chunks", "change_chunks"]

THRUST_COLOR = (255, 84, 48)
GONE = (0.0, 0.0, -1e4)
"""Where the frames of cameras go with a boat that leaves [m]: a camera without one is a mistake to the viewer."""
WAKE_RADIUS = 0.25
"""Half the thickness of a wake [m]."""
TAG_HEIGHT = 2.9
"""Height of a boat's name over its origin [m]."""


def boat_chunks(scene: RecordScene) -> Iterator[Chunk]:
    """Looks of a scene's boats, names over them, colours of their trails and arrows."""
    for boat in scene.boats():
        yield from joining_chunks(boat, scene)


def change_chunks(scene: RecordScene, before: RecordScene, first: RecordScene) -> Iterator[Chunk]:
    """What comes, and the end of what goes, when boats have joined or left since the scene before."""
    kept, known = ({body.path for body in one.bodies} for one in (scene, before))
    for body in before.bodies:
        if body.path not in kept:
            yield shown(scene.begun, body.path, rr.Clear(recursive=True))
        if body.path not in kept and body.kind == "boat":
            yield shown(scene.begun, body.path, rr.Transform3D(translation=GONE))
    for body in scene.bodies:
        if body.path not in known and body.kind == "boat":
            yield from joining_chunks(body, scene)
            yield from series_chunks(body.name, scene, first)
        elif body.path not in known:
            yield from body_chunks(body)


def joining_chunks(boat: RecordedBody, scene: RecordScene) -> Iterator[Chunk]:
    """A boat, its name over it and its engines, which turn in its frame; its first pose until rows move it."""
    begun, rgb = scene.begun, boat_colors(scene.roster())[boat.name]
    if begun is not None:
        yield shown(begun, boat.path, pose(boat.pose))
    if boat.surfaces:
        yield shown(begun, f"{boat.path}/shape", mesh(boat.surfaces))
    for thruster in scene.thrusters:
        if thruster.boat == boat.name and thruster.surfaces:
            yield shown(begun, f"{boat.path}/{thruster.name}/shape", mesh(thruster.surfaces))
    yield shown(begun, f"{boat.path}/label", name_tag(boat.name, rgb))
    trail = rr.LineStrips3D.from_fields(colors=[rgb], radii=[rr.Radius.ui_points(1.2)])
    yield static(f"/world/trails/{boat.name}", trail)
    if scene.sea_height is not None:
        yield static(wake_path(boat.name), rr.LineStrips3D.from_fields(colors=FADES, radii=[WAKE_RADIUS]))
    arrows = rr.Arrows3D.from_fields(colors=[THRUST_COLOR], radii=[0.12])
    yield static(f"{boat.path}/thrust", arrows)


def series_chunks(boat: str, scene: RecordScene, first: RecordScene) -> Iterator[Chunk]:
    """Names of the series that a boat has and the scene in which the recording began has not."""
    boats = [boat] if all(one.name != boat for one in first.boats()) else []
    known = {(one.boat, one.name) for one in first.thrusters}
    new = [(boat, one.name) for one in scene.thrusters if one.boat == boat and (boat, one.name) not in known]
    yield from named_series(boats, new, boat_colors(scene.roster()), own=f"/{boat}")


def name_tag(name: str, rgb: tuple[int, int, int]) -> rr.Points3D:
    """A boat's name over it."""
    return rr.Points3D([[0.0, 0.0, TAG_HEIGHT]], labels=[name], colors=[rgb], radii=[0.06], show_labels=True)
