"""Depths under a transducer, over flat and sloping bottoms, in closed form."""

import math

import numpy as np
import pytest

from unit.sensors.test_lidar import scene
from vrx_mj.config.sensors import EchoSounderConfig
from vrx_mj.frames import rotation
from vrx_mj.sensors.instruments import ECHO_SOUNDER, Draw, beam, bottom_distance, echo
from vrx_mj.sensors.lidar import Lidar
from vrx_mj.sensors.readings import Place

SONAR = EchoSounderConfig(name="sonar", link="keel", range=(0.3, 100.0), noise=0.0)
DRAW = Draw(1, "a", "sonar", 12, 10.0)
DOWN = rotation(0.0, math.pi / 2, 0.0)
UNDER_A_HULL = (
    '<geom group="2" type="box" size="2 1 0.4"/>'
    '<body pos="0 0 -1"><joint/><geom group="2" type="sphere" size="0.2"/></body>'
)
"""A hull with the transducer in it, and a propeller under it that turns."""


def under(*, heel=0.0, trim=0.0, up=0.0):
    """A transducer that points down on a boat that heels and trims, at a height [m]."""
    turned = np.array(rotation(heel, trim, 0.7)) @ DOWN
    return Place(np.array([3.0, 4.0, up]), turned, np.zeros(4), np.zeros(3), np.zeros(3))


@pytest.mark.parametrize(("up", "level", "found"), [(0.0, 0.0, 7.0), (-0.5, 0.0, 6.5), (-0.5, 1.0, 5.5)])
def test_over_a_flat_bottom_it_is_the_depth_under_the_transducer(up, level, found):
    assert bottom_distance(under(up=up), level, 7.0) == pytest.approx(found)


@pytest.mark.parametrize(("heel", "trim"), [(0.35, 0.0), (0.0, -0.2), (-0.5, 0.3)])
def test_heeled_it_is_farther_by_the_slant_of_the_beam(heel, trim):
    assert bottom_distance(under(heel=heel, trim=trim), 0.0, 7.0) == pytest.approx(
        7 / (math.cos(heel) * math.cos(trim))
    )


def test_deep_water_and_beams_that_rise_give_no_echo():
    assert bottom_distance(under(), 0.0, None) == math.inf
    assert bottom_distance(under(heel=math.pi), 0.0, 7.0) == math.inf
    assert echo(SONAR, math.inf, DRAW).range == math.inf


@pytest.mark.parametrize(
    ("distance", "heard"), [(0.3, 0.3), (100.0, 100.0), (0.29, math.inf), (100.1, math.inf), (-2.0, math.inf)]
)
def test_what_is_out_of_range_gives_no_echo(distance, heard):
    found = echo(SONAR, distance, DRAW)
    assert (found.range, found.range_min, found.range_max, found.field_of_view) == (heard, 0.3, 100.0, 0.436)


def test_a_plot_has_a_gap_where_there_is_no_echo():
    (plot,) = ECHO_SOUNDER.plots
    assert plot.values(echo(SONAR, 7.0, DRAW)) == 7.0
    assert math.isnan(plot.values(echo(SONAR, math.inf, DRAW)))


@pytest.mark.parametrize(
    ("number", "problem"), [(7.0, ""), (math.inf, ""), (-1.0, "a range of -1 m"), (math.nan, "a range of nan m")]
)
def test_a_recorded_range_is_not_negative(number, problem):
    assert ECHO_SOUNDER.numbers.problem(np.array([number])) == problem


def test_noise_has_its_standard_deviation():
    noisy = SONAR.model_copy(update={"noise": 0.05})
    found = [echo(noisy, 7.0, Draw(1, "a", "sonar", index, 10.0)).range for index in range(4000)]
    assert np.mean(found) == pytest.approx(7.0, abs=4 * 0.05 / 4000**0.5)  # 4 standard errors
    assert np.std(found) == pytest.approx(0.05, rel=4 / 8000**0.5)


def met(geoms, *, own=False, heel=0.0):
    """How far the beam goes from the middle of a boat with geoms until it meets one of them."""
    model, data = scene(geoms)
    sounder = Lidar(model, beam(SONAR), 1, (0.0, 0.0, 0.0), np.array(rotation(heel, 0.0, 0.0)) @ DOWN, own=own)
    return float(sounder.ranges(data)[0])


@pytest.mark.parametrize("heel", [0.0, 0.3, -0.2])
@pytest.mark.parametrize("slope", [0.1, -0.5])
def test_over_a_slope_it_is_where_the_beam_meets_it(slope, heel):
    """A bottom 6 m under the boat that rises to port by `slope`: a heel to starboard sends the beam to port."""
    rise = math.degrees(math.atan(slope))
    bottom = f'</body><geom group="2" type="plane" size="90 90 1" pos="0 0 -6" euler="{rise} 0 0"/><body>'
    assert met(bottom, heel=heel) == pytest.approx(6.0 / (math.cos(heel) + slope * math.sin(heel)))


def test_it_does_not_hear_its_own_hull_and_propeller():
    assert met(UNDER_A_HULL, own=True) == pytest.approx(0.4)
    assert met(UNDER_A_HULL) == math.inf
