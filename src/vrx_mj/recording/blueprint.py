"""How a recording opens: the fleet from its stern, a plan with a grid, pictures, plots with units, the log."""

from collections.abc import Iterable, Sequence
from itertools import chain, compress
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import rerun as rr
import rerun.blueprint as rrb

from vrx_mj.arrays import FloatArray
from vrx_mj.draw.course import nice_length
from vrx_mj.draw.style import Rgb
from vrx_mj.recording import eyes
from vrx_mj.recording.motion_chunks import track_path
from vrx_mj.recording.parts import APPLICATION
from vrx_mj.recording.record_scene import RecordScene
from vrx_mj.recording.static_chunks import FEW_NAMES, LEGEND_PATH, NAMES, legend_spots, name_width
from vrx_mj.recording.task_chunks import MARKS_PATH, PLOT, STEPS, TOUCH_WORDS, WORDS
from vrx_mj.recording.timeline import TIMELINE
from vrx_mj.sensors import SENSOR_KINDS

_SKY_COLOR = (158, 190, 214)
"""Colours of the sky, of the water in the plan, and of its grid."""
PLAN_WATER = (16, 45, 66)
_GRID = (150, 190, 215, 60)
_LEGEND_MAX = 2
"""Largest number of thrusters that a plot's legend lists: a longer legend would hide the plot."""
_TASK_PLOT = (PLOT.rpartition("/")[2], "Score")
_UNDER_PLAN = (
    (("speed", "Speed [m/s]"), ("course", "Course, compass [°]")),
    (("thrust", "Thrust [N]"), ("steering", "Steering [°]")),
)
"""Plots under the plan, two to a place."""
_UNDER_SEA = (
    (("heading", "Heading, compass [°]"), ("yaw", "Yaw, ENU [°]")),
    (("roll", "Roll [°]"), ("pitch", "Pitch [°]"), ("wind", "Wind [m/s]")),
)
"""Plots under the sea, as many to a place as have room for their titles in a window of 1280 pixels."""
_SHOWN_CAMERAS = 4
"""Number of cameras whose pictures are shown at first."""
_FLAT_ENTITIES = "- /world/trails/**", "- /world/tracks/**", "- /world/shore"
"""What lies flat over the mean water: a drawn sea would cover it in part, and the line of a shore floats off it."""
_EDGE = rr.TimeRangeBoundary.infinite()
_MARGIN, _LEGEND_AFTER = 1.0 / 16.0, 0.35
"""Room behind the run on the axes of plots, in shares of it: the last label is whole, and a legend hides no line."""


def save_views(file: Path, scene: RecordScene, track: FloatArray | None, result: str) -> None:
    """Write a blueprint for `scene` as an `.rbl` file, which has itself used.

    The plan frames `track`, the least and the greatest x and y (2, 2) [m] of all boats over the run, or else follows
    the fleet; `result` of a finished task is in the title of what it says.
    """
    layout(scene, track=track, result=result).save(APPLICATION, file)
    rr.bindings.flush_and_cleanup_orphaned_recordings()  # ends the two threads of the stream that it took


def layout(
    scene: RecordScene, *, live: bool = False, track: FloatArray | None = None, result: str = ""
) -> rrb.Blueprint:
    """The views and their places; `live`: at the newest moment instead of playing from the first."""
    left = rrb.Vertical(sea_view(scene), _under_sea(scene), row_shares=[1.7 if scene.of_type("camera") else 3.4, 1])
    boats = scene.roster()
    steps = rrb.StateTimelineView(
        name="Timeline",
        origin=STEPS,
        contents=[f"+ {STEPS}/**"],
        time_view=rrb.TimeAxis(link="Independent", view_range=whole_run(scene)),
    )
    columns = rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"])
    story = [rrb.TextLogView(name="Events", origin="/events", columns=columns)]
    story.insert(0 if scene.parameters.task else 1, steps)
    rows = [(2.4, plan_view(scene, track)), *((1.0, row) for row in _under_plan(scene, result))]
    many = len(boats) > FEW_NAMES
    rows.append((3.0, rrb.Tabs(_legend_view(boats), *story)) if many else (1.2, rrb.Tabs(*story)))
    if len(boats) > 1 and not many:
        rows.insert(-2, (0.22 * (legend_spots(boats)[-1][1] + 1), _legend_view(boats)))
    shares, views = zip(*rows, strict=True)
    right = rrb.Vertical(*views, row_shares=shares)
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=[2, 1]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(
            state="collapsed", timeline=TIMELINE, play_state="following" if live else "playing", loop_mode="off"
        ),
    )


def _under_plan(scene: RecordScene, result: str = "") -> list[rrb.View | rrb.Container]:
    """Views under the plan: how the task goes in words and as a plot, if there is one, then speed and thrust."""
    speed, thrust = _UNDER_PLAN
    score = [plot_view(scene, _TASK_PLOT, legend=True)] if scene.parameters.task else []
    plots: list[rrb.View | rrb.Container] = [rrb.Tabs(*score, *(plot_view(scene, plot, marked=True) for plot in speed))]
    if scene.thrusters:
        plots.append(rrb.Tabs(*(plot_view(scene, plot, legend=len(scene.thrusters) <= _LEGEND_MAX) for plot in thrust)))
    words = rrb.TextDocumentView(name=f"Task: {result}" if result else "Task", origin=WORDS, contents=[f"+ {WORDS}"])
    return [words, *plots] if scene.parameters.task else plots


def _legend_view(boats: Sequence[str]) -> rrb.Spatial2DView:
    """The names of boats in their colours, beside the plots: few stay in view, many share a place."""
    width, lines = name_width(len(boats)), legend_spots(boats)[-1][1] + 1
    bounds = rrb.VisualBounds2D(x_range=(-width / 2, (NAMES - 0.5) * width), y_range=(-0.3, lines + 0.1))
    return rrb.Spatial2DView(name="Boats", origin=LEGEND_PATH, titlebar=len(boats) > FEW_NAMES, visual_bounds=bounds)


def _under_sea(scene: RecordScene) -> rrb.Container:
    """Views under the sea: pictures of cameras, and plots, of which fewer are seen at a time the more there are."""
    shown = [plot for kind in SENSOR_KINDS.values() if scene.of_type(kind.type) for plot in kind.plots]
    sensed = [plot_view(scene, (plot.name, plot.title), legend=True) for plot in shown]
    pictures = [
        rrb.Spatial2DView(name=f"{sensor.boat} {sensor.name}", origin=sensor.path, contents=[f"+ {sensor.path}"])
        for sensor in scene.of_type("camera")[:_SHOWN_CAMERAS]
    ]
    windy = "wind" in scene.weather()
    moved = [[plot_view(scene, plot) for plot in place if plot[0] != "wind" or windy] for place in _UNDER_SEA]
    if not pictures:
        return rrb.Horizontal(*(rrb.Tabs(*plots) for plots in (*moved, sensed) if plots))
    plots = rrb.Tabs(*sensed, *chain.from_iterable(moved))
    if len(pictures) == 1:
        return rrb.Horizontal(pictures[0], plots)
    return rrb.Horizontal(rrb.Grid(*pictures, grid_columns=2), plots, column_shares=[2, 1])


def sea_view(scene: RecordScene) -> rrb.Spatial3DView:
    """The fleet, or the boat of `scene.follow`, followed from behind and above."""
    circle, reach = eyes.followed_circle(scene)
    middle = np.array([*circle, 0.0])
    named = {*eyes.tag_heights(scene), scene.follow}
    others = [boat for boat in scene.roster() if boat != scene.follow]
    crowded = others if len(others) > FEW_NAMES else [boat.name for boat in scene.boats() if boat.name not in named]
    unseen = [
        f"- {eyes.PLAN}/**",
        *(_FLAT_ENTITIES if scene.sea_height else []),
        *_without_names(crowded),
    ]
    followed = eyes.FLEET if scene.follow is None else f"/world/boats/{scene.follow}/label"
    return _view(scene, "Sea", unseen, _SKY_COLOR, (middle + eyes.sea_eye(reach), middle, (0.0, 0.0, 1.0)), followed)


def plan_view(scene: RecordScene, track: FloatArray | None = None) -> rrb.Spatial3DView:
    """The course from above, north up, with a grid: all of `track`, or where the fleet is."""
    middle, height = eyes.plan_eye(scene, track)
    spacing, (_, north) = nice_length(height / 6.0), eyes.east_and_north(scene)
    unseen = [
        "- /world/sea/**",
        "- /world/wakes/**",
        f"- {TOUCH_WORDS}/**",  # boats that touch have their names there
        f"- {eyes.FLEET}/weather/**" if track is None else f"- {eyes.FLEET}/**",
        *(f"- {camera.path}" for camera in scene.of_type("camera")),
        *(hidden_names(scene, middle, height) if track is None else _without_names(scene.roster())),
    ]
    eye = (*middle - 0.001 * north, height), (*middle, 0.0), (*north, 0.0)
    name, followed = f"Plan, north up, {spacing:g} m grid", eyes.PLANNED if track is None else None
    return _view(scene, name, unseen, PLAN_WATER, eye, followed, spacing)


def _view(
    scene: RecordScene, name: str, unseen: Sequence[str], color: Rgb, eye: Sequence[npt.ArrayLike],
    followed: str | None, spacing: float | None = None,
) -> rrb.Spatial3DView:  # fmt: skip
    """The world without some entities, without axes and boxes, with a grid `spacing` apart [m] if that is given.

    `eye`: place, what it looks at, and what is up, each (3,) [m]; it moves with the entity that is `followed`.
    """
    position, target, up = eye
    return rrb.Spatial3DView(
        name=name,
        origin="/world",
        contents=["+ /world/**", *unseen],
        background=rrb.Background(color=color),
        line_grid=rrb.LineGrid3D(
            visible=spacing is not None, spacing=spacing, color=_GRID, stroke_width=1.0, plane=rr.components.Plane3D.XY
        ),
        spatial_information=rrb.archetypes.SpatialInformation.from_fields(show_axes=False, show_bounding_box=False),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital, position=position, look_target=target, eye_up=up, tracking_entity=followed
        ),
        overrides=_trails(scene),
    )


def hidden_names(scene: RecordScene, middle: FloatArray, height: float) -> list[str]:
    """Names of boats left out that would cover something as the fleet starts, in a plan from a `height` [m]."""
    names = [boat.name for boat in scene.boats()]
    places = np.reshape([boat.pose[:2] for boat in scene.boats()], (1, -1, 2))
    spots = middle + height * eyes.PLAN_SLOPE * eyes.name_spots(scene, names, places, middle, height)
    return _without_names(compress(names, ~(np.abs(spots - places) < 1e-6).all(axis=(0, 2))))


def _without_names(boats: Iterable[str]) -> list[str]:
    """Names of boats left out of a view's contents: dots in their colours stay, and the legend beside the plots."""
    return [f"- /world/boats/{boat}/label/name" for boat in boats]


def _trails(scene: RecordScene) -> dict[str, Any]:
    """Every piece of each trail, and every fix, up to now, instead of the last one only."""
    sofar = rrb.VisibleTimeRanges(timeline=TIMELINE, start=_EDGE, end=rrb.TimeRangeBoundary.cursor_relative())
    paths = [f"/world/trails/{boat}" for boat in scene.roster()]
    return dict.fromkeys((*paths, *map(track_path, scene.of_type("gps"))), sofar)


def whole_run(scene: RecordScene, after: float = _MARGIN) -> rr.TimeRange:
    """Range from the first moment to a little after the last; a linked axis shows a minute around the cursor."""
    if scene.ended is None:
        return rr.TimeRange(start=_EDGE, end=_EDGE)
    end = scene.ended + after * (scene.ended - (scene.begun or 0.0))
    return rr.TimeRange(start=_EDGE, end=rr.TimeRangeBoundary.absolute(seconds=end))


def plot_view(
    scene: RecordScene, plot: tuple[str, str], *, legend: bool = False, marked: bool = False
) -> rrb.TimeSeriesView:
    """A plot over the whole run; `marked`: with the marks of what happened."""
    quantity, name = plot
    corner = rrb.Corner2D.LeftTop if scene.ended is None else rrb.Corner2D.RightTop
    return rrb.TimeSeriesView(
        name=name,
        origin=f"/plots/{quantity}",
        contents=[f"+ /plots/{quantity}/**", *([f"+ {MARKS_PATH}/**"] if marked else [])],
        plot_legend=rrb.PlotLegend(corner=corner, visible=legend),
        axis_x=rrb.TimeAxis(link="Independent", view_range=whole_run(scene, _LEGEND_AFTER if legend else _MARGIN)),
    )
