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


def test_a_pid_that_divides_by_the_time_between_messages_finds_none_that_is_zero(tmp_path, rate):
    done = outcome(program("pid.py"), tmp_path, rate=rate, seconds=15.0)
    assert done.code == 0, done.text
    (line,) = [line for line in done.text.splitlines() if line.startswith("heading")]
    assert line.endswith("faults []")
    assert float(line.split()[1]) == pytest.approx(60.0, abs=20.0)
    assert 0.0 < done.task.score < 20.0


@pytest.mark.nightly
def test_a_stack_that_advertises_the_topics_of_all_tasks_sails_without_false_hints(tmp_path, rate):
    done = outcome(program("whole_stack.py"), tmp_path, rate=rate, seconds=SECONDS)
    assert done.code == 0, done.text
    assert "/vrx/station_keeping/goal /vrx/station_keeping/pose_error /vrx/task/info" in done.text
    assert done.way == pytest.approx(way_of(0.2, 0.2), rel=0.1)
    assert not done.said("did you mean")
    assert len(done.said("/vrx/perception/landmark")) == 1
    assert 0.0 < done.task.score < 20.0


@pytest.mark.nightly
def test_a_wait_for_a_service_that_is_not_there_is_told_once_with_the_nearest(tmp_path, rate):
    done = outcome(program("waits.py"), tmp_path, rate=rate, seconds=SECONDS)
    assert done.code == 0, done.text
    assert done.text.count("without ") == 3
    (line,) = done.said("/gazebo/get_model_stat:")
    assert "did you mean '/gazebo/get_model_state'?" in line
    assert len(done.said("/vrx/reset_task:")) == 1
    assert not done.said("/team/own_service")
    assert done.way > 0.5


def test_a_caller_of_gazebos_services_gets_what_they_promise(tmp_path, rate):
    done = outcome(program("gazebo_caller.py"), tmp_path, rate=rate, seconds=SECONDS)
    assert done.code == 0, done.text
    said = {line.rpartition(" ")[0]: line.rpartition(" ")[2] for line in done.text.splitlines()}
    assert float(said["placed"]) < 0.2
    assert float(said["pushed to"]) > 0.2
    assert 0.5 <= float(said["time went on by"]) < 2.0
    assert 0.0 < done.task.score < 20.0


def test_what_cannot_be_is_refused_in_words_or_told_once_and_time_goes_on(tmp_path, rate):
    fleet = FLEET.replace("]\n", ", {name: other, pose: [-532, 172, 0.1, 0, 0, 0]}]\n", 1)
    done = outcome(program("hostile.py"), tmp_path, rate=rate, seconds=30.0, fleet=fleet)
    assert done.code == 0, done.text
    said = done.text.splitlines()
    assert [line.partition(" apply_body_wrench: ")[0] for line in said[:5]] == [
        "ready", "force nan", "force inf", "force 1e+300", "force -1e+300",
    ]  # fmt: skip
    assert said[5:7] == ["lasting taken", "delete True"]
    assert said[7].startswith("gone apply_body_wrench: no link named 'other::other/base_link'; known: ")
    assert said[-1] == "done"
    assert len(done.said("is published by /.* and /.*: each message replaces the other's")) == 1
    assert len(done.said("invalid command nan for left of wamv")) == 1
    assert len(done.said("the force on other::other/base_link ends: it left")) == 1
    assert len(done.said("the force would accelerate wamv::wamv/base_link by 3.86e.297")) == 1
