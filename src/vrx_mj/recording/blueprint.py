"""How a recording opens: the fleet from its stern, a plan with a grid, pictures, plots with units, the log."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.course import course_of
from vrx_mj.recording.record_scene import RecordedSensor, RecordScene
from vrx_mj.recording.sensor_chunks import track_path
from vrx_mj.recording.task_chunks import MARKS, PLOT, WORDS
from vrx_mj.recording.timeline import TIMELINE
from vrx_mj.sensors.registry import SENSOR_KINDS

__all__ = ["blueprint_bytes", "layout"]

SKY = (158, 190, 214)
PLAN_WATER = (16, 45, 66)
GRID = (150, 190, 215, 60)
PLAN_MARGIN = 8.0
"""Water around the outermost body in the plan [m]."""
PLAN_REACH = 40.0
"""How far from the outermost boat a body may be and still be fitted into the plan [m]."""
PLAN_SLOPE = 0.5
"""Half the height of what the plan shows, per height of its eye: the viewer's lens."""
PLAN_ASPECT = 1.3
"""Width of the plan's view, in its heights, about."""
LEGEND = 4
"""Most series of thrusters that a legend lists: a longer one would hide the plot."""
CROWD = 4
"""Most boats whose legend fits into a low plot."""
SPEED, THRUST, STEERING = ("speed", "Speed [m/s]"), ("thrust", "Thrust [N]"), ("steering", "Steering [deg]")
TASK = (PLOT.rpartition("/")[2], "Score and collisions")
BELOW = (
    ("heading", "Heading, compass [deg]"),
    ("course", "Course, compass [deg]"),
    ("yaw", "Yaw from x [deg]"),
    ("roll", "Roll [deg]"),
    ("pitch", "Pitch [deg]"),
    ("wind", "Wind [m/s]"),
)
"""Plots under the sea; the boats' colours are those of the speed's legend."""
PICTURES = 4
"""Cameras whose pictures are shown at first."""


def blueprint_bytes(scene: RecordScene, application: str) -> bytes:
    """A blueprint for `scene` as the bytes of an `.rbl` file.

    rerun makes blueprints with a recording stream only; disconnected and swept, it ends its two threads.
    """
    try:
        return streamed(scene, application)
    finally:
        rr.bindings.flush_and_cleanup_orphaned_recordings()


def streamed(scene: RecordScene, application: str) -> bytes:
    """The blueprint by way of a stream that is dropped at once."""
    native = rr.bindings.new_blueprint(
        application_id=application, make_default=False, make_thread_default=False, default_enabled=True
    )
    stream = rr.RecordingStream._from_native(native)
    try:
        stream.set_time("blueprint", sequence=0)
        layout(scene)._log_to_stream(stream)
        return bytes(stream.memory_recording().drain_as_bytes())
    finally:
        rr.bindings.disconnect(native)


def layout(scene: RecordScene, *, live: bool = False) -> rrb.Blueprint:
    """The views and their places; `live`: at the newest moment instead of playing from the first."""
    pictured = bool(scene.of_type("camera"))
    left = rrb.Vertical(sea_view(scene), below(scene), row_shares=[1.7 if pictured else 3.4, 1])
    rows = beside(scene)
    shares = [2.0, 3.2] if len(rows) == 1 and is_crowded(scene) else [2.4, *[1.0] * len(rows)]
    right = rrb.Vertical(plan_view(scene), *rows, log_view(), row_shares=[*shares, 1.0])
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=[2, 1]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(
            state="collapsed", timeline=TIMELINE, play_state="following" if live else "playing", loop_mode="off"
        ),
    )


def beside(scene: RecordScene) -> list[rrb.View | rrb.Container]:
    """Under the plan: how the task goes, if there is one, then speed and thrust, which share a place with it."""
    plots: list[rrb.View | rrb.Container] = [plot_view(SPEED, legend=True, marked=True)]
    if scene.thrusters:
        legend = len(scene.thrusters) <= LEGEND
        plots += [plot_view(THRUST, legend=legend), plot_view(STEERING, legend=legend)]
    if scene.parameters and scene.parameters.task:
        return [task_view(), rrb.Tabs(*plots)]
    if is_crowded(scene):
        return [rrb.Tabs(*plots)]
    return [plots[0], *([rrb.Tabs(*plots[1:])] if plots[1:] else [])]


def is_crowded(scene: RecordScene) -> bool:
    """Whether the legend of all boats needs a plot of twice the height."""
    return len(scene.roster()) > CROWD


def task_view() -> rrb.Container:
    """Phase, score and parts of the task in words, and score and collisions as a plot."""
    words = rrb.TextDocumentView(name="Task", origin=WORDS, contents=[f"+ {WORDS}"])
    return rrb.Horizontal(words, plot_view(TASK, legend=True, marked=True), column_shares=[1, 1])


def below(scene: RecordScene) -> rrb.Container:
    """Under the sea: the pictures of cameras, and the plots, of which fewer are seen at a time the more there are."""
    shown = [plot for kind in SENSOR_KINDS.values() if scene.of_type(kind.type) for plot in kind.plots]
    sensed = [plot_view((plot.name, plot.title), legend=True) for plot in shown]
    pictures = [picture_view(sensor) for sensor in scene.of_type("camera")[:PICTURES]]
    if not pictures:
        return rrb.Horizontal(*map(plot_view, BELOW), *([rrb.Tabs(*sensed)] if sensed else []))
    plots = rrb.Tabs(*sensed, *map(plot_view, BELOW))
    if len(pictures) == 1:
        return rrb.Horizontal(pictures[0], plots)
    return rrb.Horizontal(rrb.Grid(*pictures, grid_columns=2), plots, column_shares=[2, 1])


def picture_view(sensor: RecordedSensor) -> rrb.Spatial2DView:
    """What a camera saw."""
    return rrb.Spatial2DView(name=f"{sensor.boat} {sensor.name}", origin=sensor.path, contents=[f"+ {sensor.path}"])


def sea_view(scene: RecordScene) -> rrb.Spatial3DView:
    """The fleet, or the boat of `scene.follow`, followed from behind and above."""
    middle, reach = followed_circle(scene)
    away = 9.0 + 1.35 * reach
    eye = middle + away * np.array([-0.72, -0.72, 0.42])
    return rrb.Spatial3DView(
        name="Sea",
        origin="/world",
        contents=["+ /world/**", *(["- /world/trails/**"] if scene.sea_height else [])],
        background=rrb.Background(color=SKY),
        line_grid=rrb.LineGrid3D(visible=False),
        spatial_information=bare(),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=eye,
            look_target=middle,
            eye_up=(0.0, 0.0, 1.0),
            tracking_entity=followed_path(scene),
        ),
        overrides=trails(scene),
    )


def plan_view(scene: RecordScene) -> rrb.Spatial3DView:
    """The course from above, north up, with a grid of 10 m."""
    middle, radius = plan_circle(scene)
    height = (radius + PLAN_MARGIN) / PLAN_SLOPE
    earth = scene.parameters.georeference if scene.parameters else None
    north = np.array(earth.from_east_north_up(0.0, 1.0, 0.0) if earth else (0.0, 1.0, 0.0))
    return rrb.Spatial3DView(
        name="Plan, north up, 10 m grid",
        origin="/world",
        contents=[
            "+ /world/**",
            "- /world/sea/**",
            "- /world/wakes/**",
            "- /world/fleet/**",
            *(f"- {camera.path}" for camera in scene.of_type("camera")),
        ],
        background=rrb.Background(color=PLAN_WATER),
        line_grid=rrb.LineGrid3D(
            visible=True, spacing=10.0, color=GRID, stroke_width=1.0, plane=rr.components.Plane3D.XY
        ),
        spatial_information=bare(),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=(*(middle - 0.001 * north)[:2], height),
            look_target=middle,
            eye_up=north,
        ),
        overrides=trails(scene),
    )


def bare() -> rrb.archetypes.SpatialInformation:
    """No axes, no boxes."""
    return rrb.archetypes.SpatialInformation.from_fields(show_axes=False, show_bounding_box=False)


def trails(scene: RecordScene) -> dict[str, Any]:
    """Every piece of each trail, and every fix, up to now, instead of the last one only."""
    sofar = rrb.VisibleTimeRanges(
        timeline=TIMELINE,
        start=rrb.TimeRangeBoundary.infinite(),
        end=rrb.TimeRangeBoundary.cursor_relative(),
    )
    paths = [f"/world/trails/{boat}" for boat in scene.roster()]
    return dict.fromkeys((*paths, *map(track_path, scene.of_type("gps"))), sofar)


def plot_view(plot: tuple[str, str], *, legend: bool = False, marked: bool = False) -> rrb.TimeSeriesView:
    """A plot over the whole run; `marked`: with the marks of what happened."""
    quantity, name = plot
    return rrb.TimeSeriesView(
        name=name,
        origin=f"/plots/{quantity}",
        contents=[f"+ /plots/{quantity}/**", *([f"+ {MARKS}/**"] if marked else [])],
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.LeftTop, visible=legend),
        axis_x=rrb.TimeAxis(link="LinkToGlobal"),
    )


def log_view() -> rrb.TextLogView:
    """What happened."""
    return rrb.TextLogView(
        name="Events",
        origin="/events",
        columns=rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"]),
    )


def plan_circle(scene: RecordScene) -> tuple[FloatArray, float]:
    """Middle (3,) and radius [m] of the plan: the fleet and what is near it, or all that a task lays out."""
    middle, reach = fleet_circle(scene)
    if not (scene.parameters and scene.parameters.task):
        return middle, plan_radius(scene, middle, reach)
    spots = [*course_of(scene.parameters).spots(), *(waypoint.position[:2] for waypoint in scene.waypoints)]
    places = np.array([*spots, *(boat.pose[:2] for boat in scene.boats())])
    low, high = places.min(axis=0), places.max(axis=0)
    width, height = high - low
    return np.array([*(low + high) / 2.0, 0.0]), max(10.0, float(height) / 2.0, float(width) / 2.0 / PLAN_ASPECT)


def plan_radius(scene: RecordScene, middle: FloatArray, reach: float) -> float:
    """Radius [m] around `middle` that holds the fleet and all that is near it."""
    away = [math.dist(body.pose[:2], middle[:2]) for body in scene.bodies if body.kind != "ball"]
    return max([reach, *(distance for distance in away if distance < reach + PLAN_REACH)])


def followed_path(scene: RecordScene) -> str:
    """The entity that the camera follows: one that has a size, without which nothing is followed."""
    if scene.follow is None:
        return "/world/fleet"
    shaped = any(boat.surfaces for boat in scene.boats() if boat.name == scene.follow)
    return f"/world/boats/{scene.follow}/{'shape' if shaped else 'label'}"


def followed_circle(scene: RecordScene) -> tuple[FloatArray, float]:
    """Middle (3,) and radius [m] of what is followed when recording starts."""
    own = [boat.pose[:2] for boat in scene.boats() if boat.name == scene.follow]
    return (np.array([*own[0], 0.0]), 0.0) if own else fleet_circle(scene)


def fleet_circle(scene: RecordScene) -> tuple[FloatArray, float]:
    """Middle (3,) and radius [m] of the fleet when recording starts."""
    boats = scene.boats() or scene.bodies
    if not boats:
        return np.zeros(3), 10.0
    places = np.array([boat.pose[:2] for boat in boats])
    middle = places.mean(axis=0)
    return np.array([*middle, 0.0]), math.sqrt(float(((places - middle) ** 2).sum(axis=1).max()))
