import numpy as np
import pytest

import vrx_mj
from vrx_mj.control.perception import OLD, SYDNEY, Blob, blobs, catalogue_of, kind_of

WATER = (20, 55, 75)
COLORS = {
    "red": (200, 10, 10),
    "orange": (250, 50, 5),
    "green": (20, 110, 65),
    "yellow": (230, 225, 10),
    "white": (220, 222, 225),
    "black": (8, 9, 10),
    "blue": (10, 15, 240),
}


def sea(light=1.0):
    """A picture of water, darker below."""
    shade = np.linspace(1.3, 0.7, 720)[:, None, None] * light
    return (np.broadcast_to(np.array(WATER, float), (720, 1280, 3)) * shade).clip(0, 255).astype(np.uint8)


def painted(picture, color, left, top, width, height, light=1.0):
    picture[top : top + height, left : left + width] = np.array(COLORS[color]) * light
    return picture


@pytest.mark.parametrize("color", COLORS)
@pytest.mark.parametrize("light", [0.5, 1.0])
def test_a_thing_is_found_by_its_colour(color, light):
    (found,) = blobs(painted(sea(light), color, 600, 300, 60, 100, light), 200.0)
    assert found.color == color
    assert (found.column, found.row) == pytest.approx((630, 350), abs=1.5)
    assert (found.width, found.height) == pytest.approx((60, 100), abs=2.0)


@pytest.mark.parametrize(
    ("pixel", "color"),
    [
        ((20, 30, 131), "blue"), ((20, 30, 130), None), ((30, 59, 150), "blue"), ((30, 60, 150), None),
        ((91, 95, 95), "white"), ((91, 94, 95), None), ((90, 95, 97), None),
        ((50, 50, 49), "black"), ((50, 50, 50), None), ((54, 40, 40), "black"), ((55, 40, 40), None),
        ((14, 14, 40), None), ((15, 14, 40), "black"),
        ((100, 54, 54), "red"), ((100, 55, 55), None), ((31, 5, 5), "red"), ((30, 5, 5), "black"),
        ((120, 29, 20), "red"), ((120, 30, 20), "orange"), ((100, 70, 25), "orange"), ((100, 71, 25), "yellow"),
        ((87, 100, 60), "green"), ((88, 100, 60), None), ((10, 26, 10), "green"), ((10, 25, 10), "black"),
        ((51, 100, 10), "yellow"), ((50, 100, 10), "green"),
    ],
)  # fmt: skip
def test_colours_end_where_they_end_in_grey_water(pixel, color):
    """Each pair differs by one step of one channel or two; grey is a sum of 180."""
    picture = np.full((720, 1280, 3), 60, np.uint8)
    picture[300:400, 600:660] = pixel
    assert [blob.color for blob in blobs(picture, 200.0)] == [color] * (color is not None)


def test_empty_water_is_empty():
    assert blobs(sea(), 200.0) == []


def test_a_band_divides_nothing():
    picture = painted(sea(), "red", 600, 300, 60, 100)
    painted(picture, "white", 605, 330, 50, 16)
    (found,) = blobs(picture, 200.0)
    assert (found.color, found.height) == ("red", pytest.approx(100, abs=2.0))


def test_two_things_are_two():
    picture = painted(painted(sea(), "red", 600, 300, 60, 100), "red", 700, 300, 60, 100)
    assert len(blobs(picture, 200.0)) == 2


def test_streaks_bows_and_sky_are_nothing():
    picture = painted(sea(), "white", 600, 300, 120, 20)
    painted(picture, "white", 100, 600, 150, 120)
    painted(picture, "white", 300, 20, 50, 100)
    assert blobs(picture, 200.0) == []


@pytest.mark.parametrize(
    ("color", "size", "pale", "catalogue", "name"),
    [
        ("red", (60, 100), False, SYDNEY, "mb_marker_buoy_red"),
        ("black", (60, 100), True, SYDNEY, "mb_marker_buoy_black"),
        ("black", (60, 50), True, SYDNEY, "mb_round_buoy_black"),
        ("orange", (60, 50), False, SYDNEY, "mb_round_buoy_orange"),
        ("red", (30, 100), False, OLD, "red_totem"),
        ("red", (40, 100), True, OLD, "surmark950410"),
        ("green", (40, 100), True, OLD, "surmark950400"),
        ("white", (40, 100), True, OLD, "surmark46104"),
        ("black", (30, 100), True, OLD, "black_totem"),
        ("black", (43, 40), True, OLD, "polyform_a3"),
        ("black", (69, 60), True, OLD, "polyform_a5"),
        ("black", (99, 90), True, OLD, "polyform_a7"),
    ],
)
def test_what_something_is(color, size, pale, catalogue, name):
    assert kind_of(Blob(color, 640.0, 300.0, *size, pale), catalogue, scale=100.0).type == name


def test_what_the_catalogue_lacks_is_nothing():
    assert kind_of(Blob("blue", 640.0, 300.0, 50.0, 100.0, False), SYDNEY) is None


@pytest.mark.parametrize("latitude", [-33.7, 21.3])
@pytest.mark.parametrize(("world", "catalogue"), [("perception_task", SYDNEY), ("vrx2019/phase2/perception1", OLD)])
def test_the_catalogue_is_that_of_the_task_on_either_side_of_the_equator(world, catalogue, latitude):
    here = {"extends": world, "georeference": {"latitude": latitude, "longitude": 150.0}, "spawn": {"sensors": "none"}}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(here))
    assert catalogue_of(sim.task["types"]) == catalogue


def test_of_unknown_types_the_newer_catalogue_is_taken():
    assert catalogue_of([]) == catalogue_of(["whale"]) == SYDNEY
