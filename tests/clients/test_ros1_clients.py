"""Programs as teams have them, in ROS 1's own client libraries: each at two rates, through a stall, to a score."""

import math
from functools import cache

import pytest
import yaml

import vrx_mj
from clients.runner import FLEET, RATES, WORLD, outcome, program
from needs import ROS1_TOOLS, needs

pytestmark = [pytest.mark.slow, needs(ROS1_TOOLS), pytest.mark.parametrize("rate", RATES)]

SECONDS = 12.0


@cache
def way_of(left, right):
    """Distance that the boat comes in `SECONDS` by these shares of full thrust [m]."""
    sim = vrx_mj.Simulation(vrx_mj.compile_world(yaml.safe_load(WORLD), fleet=yaml.safe_load(FLEET)))
    sim.advance(200)
    begun = sim.observe()["wamv"].position.copy()
    for _ in range(round(10 * SECONDS)):
        sim.command("wamv", left=left, right=right)
        sim.advance(10)
    return math.dist(sim.observe()["wamv"].position[:2], begun[:2])


def test_a_mixer_of_the_teams_own_has_cmd_vel_for_itself(tmp_path, rate):
    done = outcome(program("mixer.py"), tmp_path, rate=rate, seconds=SECONDS)
    assert done.code == 0, done.text
    assert done.way == pytest.approx(way_of(0.2, 0.2), rel=0.1)  # what is published late, and lost by the stall
    (line,) = done.said("cmd_vel does not drive")
    assert line == "/wamv/cmd_vel does not drive wamv: /mixer publishes /wamv/thrusters/left_thrust_cmd\n"
    assert done.task.state == "running"
    assert 0.0 < done.task.score < 20.0
