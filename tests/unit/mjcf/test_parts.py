"""Rows of a compiled world that single parts give: markers, waves, densities, swimmers, races and rivals."""

import math
from types import SimpleNamespace

import pytest

from vrx_mj.config.objects import PathConfig, load_object
from vrx_mj.config.weather import WindConfig
from vrx_mj.config.world import MarkersConfig, PhysicsConfig, SeaConfig
from vrx_mj.mjcf.objects import DENSITY, PlacedObject, follower_row, object_rows
from vrx_mj.mjcf.parameters import Rows, boat_wind, sea_parameters, wind_parameters
from vrx_mj.mjcf.scene import AHEAD, marker_rows
from vrx_mj.mjcf.tasks import touches_of

STILL = (3.0, -2.0, 0.0, 0.0, 0.0, 0.0)


def test_an_upright_marker_stands_at_its_height_and_the_other_points_ahead_of_its_top():
    config = MarkersConfig(scaling=(0.2, 0.2, 2.0), height=0.5, places=((10.0, 20.0, math.pi / 2),))
    upright, ahead = marker_rows(config, [])
    assert upright.position[2] - upright.length / 2 == pytest.approx(0.5)
    assert ahead.position == pytest.approx([10.0, 20.0 + AHEAD, 1.5])
    assert ahead.axis == pytest.approx([0.0, 1.0, 0.0])
    assert len(marker_rows(config, [(1.0, 2.0, 0.0)])) == 4
    assert len(marker_rows(config.model_copy(update={"task": False}), [(1.0, 2.0, 0.0)])) == 2


def test_the_significant_height_is_four_standard_deviations_of_the_surface():
    """Of cosines: the variance is half the sum of their squared amplitudes."""
    sea = sea_parameters(SeaConfig(model="cwr", number=3, amplitude=0.4, scale=1.5, period=6.0), PhysicsConfig())
    variance = sum(wave.amplitude**2 / 2.0 for wave in sea.waves)
    assert sea.significant_height == pytest.approx(4.0 * math.sqrt(variance))
    assert sea_parameters(SeaConfig(model="none"), PhysicsConfig()).significant_height == 0.0


def test_the_wind_blows_toward_its_direction_and_pushes_whom_it_names():
    wind = WindConfig(direction=120.0, mean_velocity=3.0, objects=[{"model": "a", "coefficients": [1, 2, 3]}])
    row = wind_parameters(wind)
    assert row.direction == pytest.approx([-0.5, math.sqrt(0.75)])
    physics = PhysicsConfig()
    assert boat_wind(wind, physics, "a", "wamv", None) == (1, 2, 3)
    assert boat_wind(wind, physics, "b", "wamv", (4, 5, 6)) == (4, 5, 6)
    assert boat_wind(wind, PhysicsConfig(quirks=("wind_stale_link",)), "a", "wamv", None) == (0, 0, 0)


@pytest.mark.parametrize(("said", "profile", "density"), [
    (None, "vrx3", DENSITY), (1025.0, "vrx3", 1025.0), (1025.0, "vrx", 1025.0), (None, "vrx", 1000.0),
])  # fmt: skip
def test_an_object_says_which_water_it_floats_in_or_takes_its_profile_s(said, profile, density):
    config = load_object("mb_marker_buoy_red")
    settings = config.buoyancy.model_dump(exclude={"fluid_density"} if said is None else set())
    elements = config.buoyancy.elements
    buoyancy = type(config.buoyancy)(**{**settings, "elements": [e.model_dump(exclude_unset=True) for e in elements],
                                        **({} if said is None else {"fluid_density": said})})  # fmt: skip
    thing = PlacedObject("buoy", "mb_marker_buoy_red", config.model_copy(update={"buoyancy": buoyancy}), STILL)
    assert object_rows(thing, None, PhysicsConfig(profile=profile), Rows()).floats[0].density == density


def test_a_swimmer_s_tolerance_is_in_degrees_in_its_file():
    path = PathConfig(waypoints=((1.0, 2.0), (3.0, 4.0)), bearing_tolerance=90.0, start=1)
    thing = PlacedObject("turtle", "turtle", load_object("mb_marker_buoy_red"), STILL, path)
    row, points = follower_row(thing, "vrx", 5)
    assert row.tolerance == pytest.approx(math.pi / 2)
    assert (row.waypoint_start, row.waypoint_count, row.turns_first) == (5, 2, 0)
    assert [point.position for point in points] == [(3.0, 4.0), (1.0, 2.0)]
    assert follower_row(thing, "vrx3", 0)[0].turns_first == 1


def test_the_scored_boat_is_not_its_own_rival():
    buoy = SimpleNamespace(name="buoy", config=load_object("mb_marker_buoy_red"))
    found = touches_of("a", {"a": "a/base_link", "b": "b/base_link"}, [buoy], [], terrain=True)
    assert [touch.name for touch in found] == ["buoy", "terrain", "b"]
