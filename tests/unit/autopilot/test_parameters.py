"""The files of parameters for ArduPilot say what the boats do."""

import pytest

from vrx_mj import Simulation, compile_world
from vrx_mj.autopilot.board import channels_of
from vrx_mj.packages import root

FILES = sorted((root() / "assets" / "robots").glob("*/ardurover.parm"))
CALM = {"physics": {"profile": "marine"}, "sea": {"model": "none"}}
FUNCTIONS = {"73": "left", "74": "right", "26": "rudder_angle", "70": "propeller"}
"""Commands by ArduPilot's numbers of functions: throttle left and right, steering, throttle."""


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.parent.name)
def test_channels_speeds_and_turns_are_those_of_the_boat(file):
    known = dict(line.split() for line in file.read_text().splitlines() if not line.startswith("#"))
    fleet = {"boats": [{"name": "b", "robot": file.parent.name, "pose": [0, 0, 0, 0, 0, 0]}]}
    sim = Simulation(compile_world(CALM, fleet=fleet))
    first, second = (FUNCTIONS[known[f"SERVO{number}_FUNCTION"]] for number in (1, 3))
    channels = channels_of(sim.world, "b")
    assert {number: channel.command for number, channel in channels.items()} == {1: first, 3: second}
    skid, share = first == "left", float(known["CRUISE_THROTTLE"]) / 100.0
    ahead = sim.step({"b": {second: share} | ({first: share} if skid else {})}, duration=60.0)["b"]
    assert ahead.velocity[0] == pytest.approx(float(known["CRUISE_SPEED"]), rel=0.05)
    sim.reset()
    steering = {first: share, second: -share} if skid else {first: share * channels[1].ahead, second: share}
    turning = sim.step({"b": steering}, duration=60.0)["b"]
    assert share / -turning.angular_velocity[2] == pytest.approx(float(known["ATC_STR_RAT_FF"]), rel=0.05)
    assert 1.0 / sim.timestep % float(known["SIM_RATE_HZ"]) == 0.0


def test_some_boats_have_such_a_file():
    assert {file.parent.name for file in FILES} >= {"wamv", "blueboat", "heron", "skiff"}
