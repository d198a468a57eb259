"""What the views of a recording show and follow."""

import math
from dataclasses import replace

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis.extra.numpy import arrays
from rerun.blueprint import Corner2D, View
from rerun.blueprint.components import LinkAxis
from rerun.chunk import RrdReader

import recorded_run
from fingerprints import check
from integration.sailing import boats
from integration.sensing import GPS, IMU, PINGER, WIND, sailing
from trees import partial
from vrx_mj.config.sensors import CameraConfig
from vrx_mj.recording.blueprint import (
    hidden_names,
    layout,
    plan_view,
    plot_view,
    sea_view,
    whole_run,
)
from vrx_mj.recording.eyes import (
    LETTER_WIDTH,
    PLAN_ASPECT,
    PLAN_LINE,
    PLAN_LINES,
    PLAN_MARGIN,
    PLAN_SLOPE,
    PLATE_HEIGHT,
    followed_circle,
    name_spots,
    names_apart,
    sea_eye,
    tag_heights,
)
from vrx_mj.recording.simulation_scene import scene_of
from vrx_mj.recording.static_chunks import still_chunks
from vrx_mj.recording.task_chunks import touch_chunks
from vrx_mj.runtime.subscriptions import Touch

CAMERA = CameraConfig(name="camera", link="camera_link", pose=(0.75, 0, 1.5, 0, 0, 0), width=64, height=36)
CALM = recorded_run.PARAMETERS | {"wind": {"mean": 0.0, "gain": 0.0}}


def shown(view, places):
    """Whether a plan shows places (n, 2) [m] at all, at an aspect of its view that it is laid out for."""
    eye = view.properties["EyeControls3D"]
    x, y, height = eye.position.as_arrow_array().to_pylist()[0]
    north = np.array(eye.eye_up.as_arrow_array().to_pylist()[0][:2])
    away = np.abs((places - [x, y]) @ np.array([[north[1], -north[0]], north]).T)
    return bool((away <= np.array([PLAN_ASPECT, 1.0]) * PLAN_SLOPE * height).all())


@pytest.mark.parametrize(("boats", "heading"), [(1, 0.0), (3, 30.0), (100, 30.0)])
def test_the_plan_shows_all_of_the_track(boats, heading):
    georeference = {"latitude": -33.7, "longitude": 150.6, "elevation": 0.0, "heading": heading}
    scene = replace(recorded_run.scene(boats), parameters=partial({**CALM, "georeference": georeference}))
    track = np.array([[-300.0, -20.0], [40.0, 260.0]])
    corners = np.array([(x, y) for x in track[:, 0] for y in track[:, 1]])
    assert shown(plan_view(scene, track), corners)
    assert not shown(plan_view(scene), corners)
    assert plan_view(scene, track).properties["EyeControls3D"].tracking_entity is None
    assert eye_of(plan_view(scene)) == ["/world/fleet/plan"]


def test_a_recording_s_plan_frames_the_track_that_was_sailed(tmp_path):
    """In two minutes the boat drifts 82 m to the east, far out of the plan of the first moment."""
    reader = RrdReader(recorded_run.record_run(tmp_path / "run.rrd", seconds=120.0, boats=1))
    batches = [chunk.to_record_batch() for chunk in reader.stream(store=reader.blueprints()[0])]
    eyes = [batch for batch in batches if "EyeControls3D:position" in batch.schema.names]
    (plan,) = (eye for eye in eyes if "EyeControls3D:tracking_entity" not in eye.schema.names)
    (((x, _, height),),) = plan.column("EyeControls3D:position").to_pylist()
    rows = np.vstack(list(recorded_run.blocks(120.0, boats=1)))
    west, east = (
        min(x for x, _ in recorded_run.BUOYS.values()),
        rows[:, recorded_run.scene(1).layout().qpos.start].max(),
    )
    half = height * PLAN_SLOPE * (1.0 - PLAN_LINE) - PLAN_MARGIN  # a line of wind at the upper edge
    assert (x - PLAN_ASPECT * half, x + PLAN_ASPECT * half) == pytest.approx((west, east), abs=0.5)


@pytest.mark.parametrize("follow", [None, "wamv2"])
def test_a_viewer_that_meets_what_it_follows_in_its_first_picture_looks_from_the_same_distance(follow):
    """It then goes to 1.5 times the diagonal of what the followed entity holds (rerun 0.41), whatever the views say."""
    scene = replace(recorded_run.scene(), follow=follow)
    chunks = list(still_chunks(scene))
    for view in (sea_view(scene), plan_view(scene)):
        (path,), eye = eye_of(view), view.properties["EyeControls3D"]
        columns = [chunk.to_record_batch().to_pydict() for chunk in chunks if chunk.entity_path == path]
        (points,) = (one["Points3D:positions"][0] for one in columns if "Points3D:positions" in one)
        away = np.subtract(*(np.array(part.as_arrow_array().to_pylist()) for part in (eye.position, eye.look_target)))
        assert 1.5 * math.dist(*(np.array(points)[-2:])) == pytest.approx(np.linalg.norm(away), rel=1e-3)


def eye_of(view):
    """What the camera of a view tracks."""
    return view.properties["EyeControls3D"].tracking_entity.as_arrow_array().to_pylist()


def test_the_camera_follows_the_fleet_or_a_boat():
    scene = recorded_run.scene()
    assert eye_of(sea_view(scene)) == ["/world/fleet"]
    assert eye_of(sea_view(replace(scene, follow="wamv2"))) == ["/world/boats/wamv2/label"]


def test_the_camera_begins_at_the_boat_that_it_follows():
    scene = recorded_run.scene()
    middle, reach = followed_circle(replace(scene, follow="wamv2"))
    assert middle == pytest.approx(scene.boats()[1].pose[:2])
    assert reach == 0.0
    assert followed_circle(scene)[1] == pytest.approx(recorded_run.RADIUS)


def views_in(part):
    """A view, or all views in a container."""
    return [part] if isinstance(part, View) else [view for one in part.contents for view in views_in(one)]


def names_of(part):
    """Names of a view, or of all views in a container."""
    return [view.name for view in views_in(part)]


@pytest.mark.parametrize(("boats", "heights"), [(1, []), (3, [0.22]), (20, [0.66]), (100, [3.0])])
def test_the_names_of_many_boats_are_beside_the_plots(boats, heights):
    """One line holds seven names; a hundred have a place of their own, which they share with the events."""
    _, right = layout(recorded_run.scene(boats=boats)).root_container.contents
    found = [share for share, row in zip(right.row_shares, right.contents, strict=True) if "Boats" in names_of(row)]
    assert found == pytest.approx(heights)


def test_a_wind_that_never_blows_has_no_plot():
    calm = replace(recorded_run.scene(), parameters=partial({**CALM, "georeference": None}))
    for scene, there in ((calm, False), (recorded_run.scene(), True)):
        assert ("Wind [m/s]" in names_of(layout(scene).root_container)) is there


def told(part):
    """What a view or a container is told to show, and how."""
    if isinstance(part, View):
        every = {**part.properties, **part.visualizer_overrides}
        shown = [[name, columns_of(one)] for name, one in every.items()]
        return [type(part).__name__, part.name, part.titlebar, part.origin, [*part.contents], shown]
    shares = [getattr(part, name, None) for name in ("row_shares", "column_shares", "grid_columns", "active_tab")]
    return [type(part).__name__, shares, [told(one) for one in part.contents]]


def columns_of(archetypes):
    """The numbers and texts of archetypes."""
    every = archetypes if isinstance(archetypes, list) else [archetypes]
    batches = [batch for one in every for batch in one.as_component_batches()]
    return [[str(batch.component_descriptor()), flat(batch.as_arrow_array().to_pylist())] for batch in batches]


def flat(values):
    """What is in lists and records."""
    if isinstance(values, dict):
        values = [*values.values()]
    return [one for value in values for one in flat(value)] if isinstance(values, list) else [values]


def test_views_show_what_they_showed():
    scene, track = recorded_run.scene(), np.array([[-30.0, -20.0], [40.0, 60.0]])
    calm = replace(scene, parameters=partial(CALM | {"georeference": None}), thrusters=scene.thrusters[:3])
    suite = (GPS, IMU, PINGER, WIND, *(CAMERA.model_copy(update={"name": f"camera{i}"}) for i in range(5)))
    sensing, one_eye = (
        scene_of(sailing(some, fleet=boats((0, 0, 0))), {("a", one.name): 5.0 for one in some})
        for some in (suite, suite[:5])
    )
    laid = {
        "made up": layout(scene), "live": layout(replace(scene, follow="wamv2"), live=True),
        "calm": layout(replace(calm, begun=2.0, ended=20.0), track=track), "sensing": layout(sensing, track=track),
        "one camera": layout(one_eye, result="12 points"), "many": layout(recorded_run.scene(20), track=track),
        "fleet": layout(recorded_run.scene(9)),
    }  # fmt: skip
    for name, blueprint in laid.items():
        panels = [vars(one) for one in (blueprint.blueprint_panel, blueprint.selection_panel, blueprint.time_panel)]
        check("views", name, views=told(blueprint.root_container), panels=str(panels).split())


def test_plots_and_the_timeline_show_the_whole_run():
    """An axis that is linked to others shows a minute around the cursor (rerun 0.41), whatever its own range is."""
    timed = [
        view
        for view in views_in(layout(recorded_run.scene()).root_container)
        if view.class_identifier in {"TimeSeries", "StateTimeline"}
    ]
    assert len(timed) > 5
    for view in timed:
        axis = view.properties["TimeAxis"]
        assert axis.link.as_arrow_array().to_pylist() == [LinkAxis.Independent.value], view.name
        assert axis.view_range.as_arrow_array().to_pylist() == [{"start": None, "end": None}], view.name  # infinite


def test_the_shown_range_ends_a_little_after_the_run():
    """A sixteenth of it, so that the last label of an axis is whole."""
    span = whole_run(replace(recorded_run.scene(), begun=20.0, ended=100.0))
    assert (span.start.kind, span.end.kind) == ("infinite", "absolute")
    assert span.end.inner.value == 105_000_000_000


def test_a_legend_stands_behind_the_run():
    """In its last quarter there is no line that it could hide; while a run goes on, that is where it is."""
    ended = replace(recorded_run.scene(), begun=0.0, ended=100.0)
    for scene, corner, end in ((ended, "RightTop", 135_000_000_000), (recorded_run.scene(), "LeftTop", None)):
        view = plot_view(scene, ("speed", "Speed"), legend=True)
        assert view.properties["PlotLegend"].corner.as_arrow_array().to_pylist() == [Corner2D[corner].value]
        span = view.properties["TimeAxis"].view_range.as_arrow_array().to_pylist()[0]["end"]
        assert span == end


def test_names_and_forces_of_touches_are_beside_the_boats_and_not_under_their_names_in_the_plan():
    scene = recorded_run.scene()
    touch = Touch("wamv1", "wamv2", 4.0, 1e3, point=(0, 0, 0), vector=(1e3, 0, 0))
    words = [chunk.entity_path for chunk in touch_chunks([touch]) if any("labels" in name for name in columns(chunk))]
    assert words
    for path in words:
        left_out = [f"- {path.rpartition('/')[0].rpartition('/')[0]}/**"]
        assert left_out[0] in plan_view(scene).contents
        assert left_out[0] not in sea_view(scene).contents


def columns(chunk):
    """Names of a chunk's columns."""
    return chunk.to_record_batch().schema.names


LINE = 2.0 / PLAN_LINES
"""Height of a line of text in a plan, in halves of its height."""


@pytest.mark.parametrize("way", [(20.0, 0.0), (0.0, 20.0)])
def test_names_that_would_cover_each_other_are_not_in_a_plan_that_follows(way):
    """From heights at which a name is as wide, or as high, as the boats are apart, the second boat in the north."""
    full = recorded_run.scene(boats=2)
    places = iter([(0.0, 0.0), way])
    bodies = tuple(
        replace(body, pose=(*next(places), *body.pose[2:])) if body.kind == "boat" else body for body in full.bodies
    )
    scene = replace(full, bodies=bodies, parameters=partial(CALM | {"waypoints": []}))
    size = LETTER_WIDTH * (len("wamv1") + 2) if way[0] else PLATE_HEIGHT
    height = 20.0 / (size * LINE) / PLAN_SLOPE
    assert hidden_names(scene, np.zeros(2), 0.99 * height) == []
    assert hidden_names(scene, np.zeros(2), 1.01 * height) == ["- /world/boats/wamv2/label/name"]


def test_names_of_bays_stand_apart_and_in_the_middle_of_their_dock():
    """Bays of 6 m in a plan of 105 m, of which a line is an 18th, each name on a plate of a line and a half."""
    bays = [np.array([30.0, 6.0 * number]) for number in range(3)]
    spots = names_apart(bays)
    assert np.diff([y for _, y in spots]).min() > PLATE_HEIGHT * 105.0 / PLAN_LINES
    assert np.mean(spots, axis=0) == pytest.approx(bays[1])
    assert names_apart(bays[:1])[0] == pytest.approx(bays[0])
    assert names_apart([]) == []


def boxes(spots, names):
    """West, south, east and north (4, boats) of names at places (boats, 2), which a viewer writes under them."""
    half = LINE * LETTER_WIDTH * (0.5 * np.array([len(name) for name in names]) + 1.0)
    return np.array([spots[:, 0] - half, spots[:, 1] - PLATE_HEIGHT * LINE, spots[:, 0] + half, spots[:, 1]])


BESIDE, ABOVE = LINE * LETTER_WIDTH * (0.5 * len("wamv") + 1.0 + 0.5 * len("a") + 1.0), PLATE_HEIGHT * LINE
"""How far apart places are whose names touch at their sides, or at top and bottom."""


@pytest.mark.parametrize(
    ("places", "stays"),
    [
        ([(0.5, 1.0)], False),  # on the plan's upper edge
        ([(0.5, 1.0 - 1e-12)], True),
        ([(0.0, 0.0), (BESIDE, 0.0)], True),
        ([(0.0, 0.0), (BESIDE - 1e-12, 0.0)], False),
        ([(0.0, 0.0), (0.1, ABOVE)], True),
        ([(0.0, 0.0), (0.1, ABOVE - 1e-12)], False),
        ([(0.5, 0.5), (0.6, 0.5 - 0.1 * LINE + 1e-12)], True),  # a boat that the name's upper edge just covers
        ([(0.5, 0.5), (0.6, 0.5 - 0.1 * LINE - 1e-12)], False),
    ],
)
def test_a_name_is_under_its_boat_until_it_would_cover_something_there(places, stays):
    scene, boats = replace(recorded_run.scene(1), parameters=partial(CALM)), ["wamv", "a"]
    names = boats[: len(places)]
    spots = name_spots(scene, names, np.array([places]), np.zeros(2), 1.0 / PLAN_SLOPE)[0]
    moved = int(len(places) == 2 and places[0] == (0.0, 0.0))  # which name has to give way
    assert (tuple(spots[moved]) == pytest.approx(places[moved], abs=0.0)) == stays


@given(places=arrays(np.float64, (3, 5, 2), elements=st.floats(-1.0, 0.6)))
@example(np.zeros((3, 5, 2)))
@example(np.linspace(-0.1, 0.1, 30).reshape(3, 5, 2))
def test_names_in_the_plan_of_a_track_cover_neither_each_other_nor_another_boat(places):
    """Nor the names of waypoints, nor is any left out where all is far apart."""
    names, scene = ["wamv", "a", "starboard_bound", "port", "b"], recorded_run.scene(1)
    still, texts = np.array([[0.0, 30.0], [-30.0, 0.0]]), ["waypoint 1", "waypoint 2"]
    spots = name_spots(scene, names, 100.0 * places, np.zeros(2), 100.0 / PLAN_SLOPE)
    every = np.concatenate([places, np.tile(still / 100.0, (3, 1, 1))], axis=1)
    east, north = np.moveaxis(np.abs(every[:, None] - every[:, :, None]) + np.eye(7)[..., None], -1, 0)
    lonely = ((east > 1.2) | (north > 0.2)).all(axis=(1, 2)) & (places[..., 1].min(axis=1) > 2.0 * LINE - 1.0)
    assert spots[lonely] == pytest.approx(places[lonely])
    assert np.nanmin(spots[..., 1], initial=0.0) > PLATE_HEIGHT * LINE - 1.0
    for moment, there in zip(spots, places, strict=True):
        known = np.flatnonzero(np.isfinite(moment[:, 0]))
        west, south, east, north = boxes(
            np.concatenate([still / 100.0, moment[known]]), [*texts, *(names[i] for i in known)]
        )
        apart = (east[:, None] < west + 1e-9) | (north[:, None] < south + 1e-9)
        assert (apart | apart.T | np.eye(len(west), dtype=bool) | (np.arange(len(west)) < 2)).all()
        for number, i in enumerate(known, 2):
            x, y = np.delete(there, i, axis=0).T
            inside = (west[number] < x) & (x < east[number]) & (south[number] < y) & (y < north[number] - 0.1 * LINE)
            assert not inside.any()


@pytest.mark.parametrize(("boats", "named"), [(8, 8), (100, 0)])
def test_names_of_many_boats_do_not_cover_them(boats, named):
    """A hundred names hide the fleet; that of a boat that is followed stays."""
    scene = recorded_run.scene(boats=boats)
    for follow in (None, "wamv7"):
        hidden = [path for path in sea_view(replace(scene, follow=follow)).contents if path.endswith("/label/name")]
        assert len(hidden) == boats - named - (follow is not None and not named)
        assert f"- /world/boats/{follow}/label/name" not in hidden


def test_names_over_twenty_boats_do_not_cover_each_other():
    """As measured in a window of 1280 pixels: what is as long as it is away has 512, plates of six letters 58 by 23."""
    full = recorded_run.scene(boats=20)
    boats = [
        replace(boat, pose=(8.0 * (i // 5), -8.0 * (i % 5), *boat.pose[2:])) for i, boat in enumerate(full.boats())
    ]
    scene = replace(full, bodies=tuple(boats))
    (x, y), reach = followed_circle(scene)
    ahead = -sea_eye(reach) / np.linalg.norm(sea_eye(reach))
    right = np.cross(ahead, (0.0, 0.0, 1.0)) / math.hypot(*ahead[:2])
    heights = tag_heights(scene)
    way = [
        np.add(boat.pose[:3], (-x, -y, heights[boat.name])) - sea_eye(reach) for boat in boats if boat.name in heights
    ]
    spots = 512.0 * np.array([(one @ right, one @ np.cross(right, ahead)) / (one @ ahead) for one in way])
    beside, above = np.abs(spots[:, None] - spots).transpose(2, 0, 1)
    assert not ((beside < 58.0) & (above < 23.0) & ~np.eye(len(spots), dtype=bool)).any()
    hidden = {path.split("/")[3] for path in sea_view(scene).contents if path.endswith("/label/name")}
    assert hidden == {boat.name for boat in boats} - heights.keys()
    assert len(heights) > 12


@pytest.mark.parametrize("reach", [5.0, 20.0, 100.0])
def test_the_seas_view_holds_boats_that_have_gone_a_third_as_far_again(reach):
    way = sea_eye(reach)
    ahead = -way / np.linalg.norm(way)
    right = np.cross(ahead, (0.0, 0.0, 1.0)) / math.hypot(*ahead[:2])
    angle = np.linspace(0.0, 2.0 * math.pi, 60)
    rays = 4.0 / 3.0 * reach * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]) - way
    x, y, z = (rays @ np.column_stack([right, np.cross(right, ahead), ahead])).T
    assert np.all(z > 0.0)
    assert np.abs(y / z).max() < PLAN_SLOPE  # the viewer's lens has this slope at the upper and the lower edge
    assert np.abs(x / z).max() < 1.5 * PLAN_SLOPE  # in a window of 1280 x 800 the view is 1.58 times as wide as high
