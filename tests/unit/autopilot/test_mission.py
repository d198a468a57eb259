"""A mission in waves, sailed by a stand-in of ArduPilot that knows nothing but what it is answered."""

import pytest

from fake_sitl import FakeSitl, helm
from vrx_mj import Simulation, compile_world
from vrx_mj.autopilot import ArduPilot

SEA = {"model": "jonswap", "significant_height": 0.3, "peak_period": 3.0}
FLEET = {
    "boats": [
        {"name": "blue", "robot": "blueboat", "pose": [0, 0, 0, 0, 0, 1.0]},
        {"name": "wamv", "robot": "wamv", "pose": [0, 20, 0, 0, 0, -1.0]},
    ]
}
WAYPOINTS = {"blue": [(-10.0, 15.0), (-25.0, 5.0)], "wamv": [(25.0, 18.0), (35.0, 5.0)]}
"""North and east [m], to port and to starboard of the bow."""
REACHED = 3.0


def sailed(world, duration):
    """The state after a mission, and how many waypoints each boat reached."""
    sim, reached = Simulation(world), dict.fromkeys(WAYPOINTS, 0)
    bridge = ArduPilot(sim, {"blue": 0, "wamv": 0})
    with bridge, FakeSitl(bridge.addresses["blue"]) as blue, FakeSitl(bridge.addresses["wamv"]) as wamv:
        sitls = {"blue": blue, "wamv": wamv}
        pulses = dict.fromkeys(sitls, (1500,) * 16)
        while sim.time < duration:
            for boat, sitl in sitls.items():
                sitl.send(pulses[boat])
            assert bridge.step(5.0)
            for boat, sitl in sitls.items():
                number = min(reached[boat], len(WAYPOINTS[boat]) - 1)
                pulses[boat], distance = helm(sitl.receive(), WAYPOINTS[boat][number])
                reached[boat] += distance < REACHED and reached[boat] < len(WAYPOINTS[boat])
    return sim.get_state().sha256, reached


@pytest.mark.slow
@pytest.mark.nightly
def test_two_boats_sail_their_missions_twice_to_the_same_bit():
    world = compile_world({"physics": {"profile": "marine"}, "sea": SEA}, fleet=FLEET)
    first, reached = sailed(world, 60.0)
    assert reached == {"blue": 2, "wamv": 2}
    assert sailed(world, 60.0)[0] == first
