"""What a simulation starts with, and what a thing knows of the water where it is put."""

import pytest

from integration.sailing import GUSTY, boats, simulation

BUOY = {"name": "buoy", "model": "mb_marker_buoy_red", "pose": [0, 30, 0, 0, 0, 0]}
SWELL = {"model": "pms", "gain": 1.0, "period": 6.0, "scale": 2.5, "tau": 0.0}


def test_at_the_start_the_wind_has_its_mean_speed():
    sim = simulation(wind=GUSTY)
    assert sim.row()[1] == 6.0
    sim.advance(200)
    assert sim.row()[1] != 6.0
    sim.reset()
    assert sim.row()[1] == 6.0


@pytest.mark.parametrize("profile", ["vrx", "vrx3"])
def test_a_thing_that_is_put_somewhere_does_not_take_the_water_there_for_rising(profile):
    """The waves are more than a metre high: water that rose so much within a step would fling it up."""
    sim = simulation(boats((0.0, 0.0, 0.0)), sea=SWELL, wind=None, objects=[BUOY], physics={"profile": profile})
    sim.advance(200)
    heights = [(x, float(sim.sea.height(x, 30.0, sim.time))) for x in range(60)]
    for x, height in (min(heights, key=lambda pair: pair[1]), max(heights, key=lambda pair: pair[1])):
        sim.set_object("buoy", pose=(x, 30.0, height, 0.0, 0.0, 0.0), velocity=[0.0] * 6)
        before = sim.observe_object("buoy").velocity[2]
        sim.advance(1)
        assert abs(sim.observe_object("buoy").velocity[2] - before) < 1.0
