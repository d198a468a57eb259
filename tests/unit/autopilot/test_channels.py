"""From pulses to commands, and the channels of the robots that are shipped."""

import pytest

from vrx_mj import compile_world
from vrx_mj.autopilot.channels import Channel, default_channels
from vrx_mj.errors import CommandError

CALM = {"physics": {"profile": "vrx"}, "sea": {"model": "none"}}


def channels_of(robot, **more):
    world = compile_world(CALM | more, fleet={"boats": [{"name": "b", "robot": robot, "pose": [0, 0, 0, 0, 0, 0]}]})
    return {number: channel.command for number, channel in default_channels(world, "b").items()}


@pytest.mark.parametrize(
    ("pulse", "command"),
    [(1500, 0.0), (1900, 1.0), (1700, 0.5), (1300, -0.4), (1100, -0.8), (2100, 1.0), (900, -0.8), (0, 0.0)],
)
def test_a_pulse_is_a_share_of_all_ahead_or_astern(pulse, command):
    assert Channel("left", -0.8, 1.0).value(pulse) == pytest.approx(command)


def test_a_span_below_0_turns_the_other_way():
    assert Channel("left", -0.8, 1.0, span=-400.0).value(1100) == 1.0


def test_a_winch_is_hauled_in_at_its_trim():
    winch = Channel("sail_angle", -1.5, 1.5, trim=1000.0, span=1000.0)
    assert [winch.value(pulse) for pulse in (1000, 1500, 2000)] == [0.0, 0.75, 1.5]


@pytest.mark.parametrize("robot", ["wamv", "blueboat", "heron", "otter"])
def test_two_engines_steer_as_a_tank_does(robot):
    assert channels_of(robot) == {1: "left", 3: "right"}


def test_a_rudder_is_channel_1_and_the_engine_channel_3():
    assert channels_of("skiff") == {1: "rudder_angle", 3: "propeller"}


def test_other_boats_need_their_channels_written_down():
    with pytest.raises(
        CommandError, match=r"which channels command b is not clear: `autopilot:` .* its commands: none"
    ):
        channels_of("sphere")
