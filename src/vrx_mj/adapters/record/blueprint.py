"""How a recording opens: the fleet from its stern, a plan with a grid, plots with units, the log."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from vrx_mj.adapters.record.moving import TIMELINE
from vrx_mj.adapters.record.scene import RecordedBody, RecordScene

__all__ = ["blueprint_bytes"]

SKY = (158, 190, 214)
PLAN_WATER = (16, 45, 66)
GRID = (150, 190, 215, 60)
PLAN_REACH = 45.0
"""Water around the outermost boat in the plan [m]."""
PLAN_SLOPE = 0.42
"""Half the height of what the plan shows, per height of its eye: the viewer's lens, with a margin."""
PLOTS = (
    ("speed", "Speed [m/s]", ["/plots/speed"]),
    ("thrust", "Thrust [N]", ["/plots/thrust"]),
    ("heading", "Heading [deg, counter-clockwise from east]", ["/plots/heading"]),
    ("attitude", "Roll and pitch [deg]", ["/plots/roll", "/plots/pitch"]),
    ("steering", "Steering angle [deg]", ["/plots/steering"]),
    ("wind", "Wind speed [m/s]", ["/plots/wind"]),
)


def blueprint_bytes(scene: RecordScene, application: str) -> bytes:
    """A blueprint for `scene` as the bytes of an `.rbl` file.

    rerun makes blueprints with a recording stream only; disconnected, it ends its two threads again.
    """
    native = rr.bindings.new_blueprint(
        application_id=application, make_default=False, make_thread_default=False, default_enabled=True
    )
    stream = rr.RecordingStream._from_native(native)  # noqa: SLF001
    try:
        stream.set_time("blueprint", sequence=0)
        layout(scene)._log_to_stream(stream)  # noqa: SLF001
        return bytes(stream.memory_recording().drain_as_bytes())
    finally:
        rr.bindings.disconnect(native)


def layout(scene: RecordScene) -> rrb.Blueprint:
    """The views and where they stand."""
    plots = [plot_view(name, contents) for key, name, contents in PLOTS if wanted(scene, key)]
    half = (len(plots) + 1) // 2
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(sea_view(scene), rrb.Horizontal(*plots[half:]), row_shares=[3, 1]),
            rrb.Vertical(plan_view(scene), *plots[:half], log_view(), row_shares=[2.6, *[1.0] * half, 0.8]),
            column_shares=[2, 1],
        ),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="playing", loop_mode="off"),
    )


def wanted(scene: RecordScene, plot: str) -> bool:
    """Whether a plot will have something to show."""
    return bool(scene.thrusters) if plot in {"thrust", "steering"} else bool(scene.boats())


def sea_view(scene: RecordScene) -> rrb.Spatial3DView:
    """The fleet, followed from behind and above."""
    middle, reach = fleet_circle(scene)
    away = max(15.0, 2.1 * reach)
    eye = middle + away * np.array([-0.72, -0.72, 0.42])
    return rrb.Spatial3DView(
        name="Sea",
        origin="/world",
        contents=["+ /world/**"],
        background=rrb.Background(color=SKY),
        line_grid=rrb.LineGrid3D(visible=False),
        spatial_information=rrb.archetypes.SpatialInformation.from_fields(show_axes=False, show_bounding_box=False),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=eye,
            look_target=middle,
            eye_up=(0.0, 0.0, 1.0),
            tracking_entity="/world/fleet",
        ),
        overrides=trails(scene.boats()),
    )


def plan_view(scene: RecordScene) -> rrb.Spatial3DView:
    """The course from above, north up, with a grid of 10 m."""
    middle, reach = fleet_circle(scene)
    height = (reach + PLAN_REACH) / PLAN_SLOPE
    return rrb.Spatial3DView(
        name="Plan, north up, 10 m grid",
        origin="/world",
        contents=["+ /world/**", "- /world/sea/**", "- /world/fleet/**"],
        background=rrb.Background(color=PLAN_WATER),
        line_grid=rrb.LineGrid3D(
            visible=True, spacing=10.0, color=GRID, stroke_width=1.0, plane=rr.components.Plane3D.XY
        ),
        spatial_information=rrb.archetypes.SpatialInformation.from_fields(show_axes=False, show_bounding_box=False),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=middle + (0.0, -0.001, height),
            look_target=middle,
            eye_up=(0.0, 1.0, 0.0),
        ),
        overrides=trails(scene.boats()),
    )


def trails(boats: Sequence[RecordedBody]) -> dict[str, Any]:
    """Every piece of each trail up to now, instead of the last one only."""
    sofar = rrb.VisibleTimeRanges(
        timeline=TIMELINE,
        start=rrb.TimeRangeBoundary.infinite(),
        end=rrb.TimeRangeBoundary.cursor_relative(),
    )
    return {f"/world/trails/{boat.name}": sofar for boat in boats}


def plot_view(name: str, contents: Sequence[str]) -> rrb.TimeSeriesView:
    """A plot over the whole run."""
    return rrb.TimeSeriesView(
        name=name,
        origin="/plots",
        contents=[f"+ {path}" for path in contents],
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.LeftTop),
        axis_x=rrb.TimeAxis(link="LinkToGlobal"),
    )


def log_view() -> rrb.TextLogView:
    """What happened."""
    return rrb.TextLogView(name="Events", origin="/events")


def fleet_circle(scene: RecordScene) -> tuple[Any, float]:
    """Middle (3,) and radius [m] of the fleet when recording starts."""
    boats = scene.boats() or scene.bodies
    if not boats:
        return np.zeros(3), 10.0
    places = np.array([boat.pose[:2] for boat in boats])
    middle = places.mean(axis=0)
    return np.array([*middle, 0.0]), math.sqrt(float(((places - middle) ** 2).sum(axis=1).max()))
