"""What the views of a recording show and follow."""

from dataclasses import replace

import pytest

import recorded_run
from vrx_mj.recording.blueprint import followed_circle, layout, sea_view


def eye_of(view):
    """What the camera of a view tracks."""
    return view.properties["EyeControls3D"].tracking_entity.as_arrow_array().to_pylist()


def test_the_camera_follows_the_fleet_or_a_boat():
    scene = recorded_run.scene()
    assert eye_of(sea_view(scene)) == ["/world/fleet"]
    assert eye_of(sea_view(replace(scene, follow="wamv2"))) == ["/world/boats/wamv2/shape"]


def test_the_camera_begins_at_the_boat_that_it_follows():
    scene = recorded_run.scene()
    middle, reach = followed_circle(replace(scene, follow="wamv2"))
    assert middle[:2] == pytest.approx(scene.boats()[1].pose[:2])
    assert reach == 0.0
    assert followed_circle(scene)[1] == pytest.approx(recorded_run.RADIUS)


@pytest.mark.parametrize(("boats", "shares"), [(3, [2.4, 1.0, 1.0, 1.0]), (10, [2.0, 3.2, 1.0])])
def test_many_boats_have_a_plot_in_which_their_legend_fits(boats, shares):
    _, right = layout(recorded_run.scene(boats=boats)).root_container.contents
    assert right.row_shares == shares
