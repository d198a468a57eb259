"""What the controllers to start from command on their tasks: the numbers that they commanded before."""

import pytest

import vrx_mj
from fingerprints import check
from integration.test_fingerprints_worlds import compiled
from vrx_mj.control import Captain

BRIEF = ("wayfinding_task", "wildlife_task", "vrx2023/acoustic_perception_task", "vrx2023/acoustic_tracking_task")
LONG = {
    **dict.fromkeys(BRIEF, 60.0), "stationkeeping_task": 30.0, "gymkhana": 60.0, "vrx2023/follow_path_task": 60.0,
    "vrx2023/gymkhana_task": 60.0,
}  # fmt: skip
BY_CAMERA = {"scan_dock_deliver": 90.0, "vrx2019/dock": 60.0, "perception_task": 60.0}
PIXELS = 1e-2
"""Share of a fingerprint that another renderer's pixels may change."""


class Listener:
    """A controller that keeps what another commands."""

    def __init__(self, controller):
        self.controller, self.commands = controller, []

    def __call__(self, obs, t):
        self.commands.append(self.controller(obs, t))
        return self.commands[-1]


def check_commands(name, seconds, **options):
    sim = vrx_mj.Simulation(compiled(name), seed=2)
    captain = Captain()
    captain.reset(2)
    listener = Listener(captain)
    result = vrx_mj.run(sim, seconds, controller=listener)
    check("controllers", f"{name} for {seconds:g} s", commands=listener.commands, task=result.task, **options)


@pytest.mark.parametrize("name", BRIEF)
def test_the_captain_commands_what_it_did(name):
    check_commands(name, 14.0)


@pytest.mark.slow
@pytest.mark.nightly
def test_it_still_does_a_minute_later():
    for name, seconds in LONG.items():
        check_commands(name, seconds)


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.render
def test_it_does_what_it_did_by_what_its_camera_sees():
    for name, seconds in BY_CAMERA.items():
        check_commands(name, seconds, rounding=PIXELS)
