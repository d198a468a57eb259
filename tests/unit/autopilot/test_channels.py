"""From pulses to commands, and the channels of the robots that are shipped."""

import shutil

import pytest

from vrx_mj import compile_world
from vrx_mj.autopilot.board import Channel, channels_of
from vrx_mj.errors import CommandError, VrxError
from vrx_mj.packages import root

CALM = {"physics": {"profile": "vrx"}, "sea": {"model": "none"}}


def names_of(robot, **more):
    world = compile_world(CALM | more, fleet={"boats": [{"name": "b", "robot": robot, "pose": [0, 0, 0, 0, 0, 0]}]})
    return {number: channel.command for number, channel in channels_of(world, "b").items()}


@pytest.mark.parametrize(
    ("pulse", "command"),
    [(1500, 0.0), (1900, 1.0), (1700, 0.5), (1300, -0.4), (1100, -0.8), (2100, 1.0), (900, -0.8), (0, 0.0)],
)
def test_a_pulse_is_a_share_of_all_ahead_or_astern(pulse, command):
    assert Channel("left", -0.8, 1.0).value(pulse) == pytest.approx(command)


def test_a_span_below_0_turns_the_other_way():
    assert Channel("left", -0.8, 1.0, span=(-400.0, -400.0)).value(1100) == 1.0


def test_a_trim_off_the_middle_has_a_span_either_way():
    channel = Channel("left", -1.0, 1.0, trim=1400.0, span=(300.0, 500.0))
    assert [channel.value(pulse) for pulse in (1100, 1250, 1400, 1650, 1900)] == [-1.0, -0.5, 0.0, 0.5, 1.0]


def test_a_winch_is_hauled_in_at_its_trim():
    winch = Channel("sail_angle", -1.5, 1.5, trim=1000.0, span=(1000.0, 1000.0))
    assert [winch.value(pulse) for pulse in (1000, 1500, 2000)] == [0.0, 0.75, 1.5]


@pytest.mark.parametrize("robot", ["wamv", "blueboat", "heron", "otter"])
def test_two_engines_steer_as_a_tank_does(robot):
    assert names_of(robot) == {1: "left", 3: "right"}


def test_a_rudder_is_channel_1_and_the_engine_channel_3():
    assert names_of("skiff") == {1: "rudder_angle", 3: "propeller"}


def test_pulses_in_the_dead_band_command_nothing():
    channel = Channel("left", -1.0, 1.0, dead_band=25.0)
    assert [channel.value(pulse) for pulse in (1475, 1500, 1525)] == [0.0, 0.0, 0.0]
    assert [channel.value(pulse) for pulse in (1474, 1526)] == pytest.approx([-0.065, 0.065])


@pytest.fixture
def kinds(tmp_path):
    """What writes a skiff whose YAML has channels of its own, and gives them."""
    folder = tmp_path / "skiff"
    shutil.copytree(root() / "assets" / "robots" / "skiff", folder)
    text = (folder / "robot.yaml").read_text(encoding="utf-8")

    def channels(written):
        (folder / "robot.yaml").write_text(f"{text}\nautopilot: {written}\n", encoding="utf-8")
        boat = {"name": "b", "robot": str(folder / "robot.yaml"), "pose": [0, 0, 0, 0, 0, 0]}
        return channels_of(compile_world(CALM, fleet={"boats": [boat]}), "b")

    return channels


def test_channels_of_a_robots_yaml(kinds):
    found = kinds("{2: propeller, 14: {thruster: rudder_angle, trim: 1480, span: -350, dead_band: 5}}")
    assert found[2] == Channel("propeller", -1.0, 1.0)
    assert found[14] == Channel("rudder_angle", -0.61, 0.61, 1480.0, (-350.0, -350.0), 5.0)


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ("{1: propellor}", r"no command of b, .* named 'propellor'; did you mean 'propeller'"),
        ("{33: propeller}", r"autopilot\.33: "),
        (
            "{1: {thruster: propeller, span: 0}}",
            r"autopilot\.1\.span: both must be above the dead band, 0, or both below -0, got 0 and 0",
        ),
        ("{1: {thruster: propeller, trim: 100}}", r"autopilot\.1\.trim: must be at least 500, got 100"),
    ],
)
def test_channels_that_cannot_be(kinds, written, message):
    with pytest.raises(VrxError, match=message):
        kinds(written)


def test_other_boats_need_their_channels_written_down():
    with pytest.raises(
        CommandError, match=r"it is not clear which channels command b: set `autopilot:` .* its commands: none"
    ):
        names_of("sphere")
