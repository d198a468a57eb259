"""Hulls that are the same to port and to starboard, in waves from ahead and astern."""

import math

import numpy as np
import pytest

from vrx_mj import Simulation, compile_world

LEVELS = {"barge_4m": 0.0, "barge_10m": 0.0, "wamv": -0.1, "heron": 0.0, "blueboat": 0.0, "cylinder": 0.0}


@pytest.mark.filterwarnings("ignore:.*waves shorter than its waterline")
@pytest.mark.parametrize("toward", [0.0, math.pi])
@pytest.mark.parametrize("robot", LEVELS)
def test_waves_along_a_hull_do_not_push_it_aside(robot, toward):
    """Sway against heave, roll and yaw against pitch, about the link: a WAM-V's centre of mass is 0.5 mm aside."""
    sea = {"model": "regular", "height": 0.1, "period": 2.5, "direction": [math.cos(toward), math.sin(toward)]}
    physics, pose = {"profile": "marine", "gravity": 9.81}, [0.4, 0.0, LEVELS[robot], 0.0, 0.0, 0.0]
    spawn = {"robot": robot, "pose": pose, "sensors": "none"}
    world = {"name": "tank", "physics": physics, "wind": {"objects": []}, "sea": sea, "spawn": spawn}
    sim = Simulation(compile_world(world))
    (boat,) = sim.boats
    found = []
    for _ in range(10):
        sim.set_boat(boat, pose=pose, velocity=[0.0] * 6)
        forces = sim.forces(boat)
        force, torque = np.split(forces["hydrostatics"] + forces["diffraction"], 2)
        found.append([*force, *(torque + np.cross(sim.world.parameters.hulls[0].body_com, force))])
        sim.step(duration=0.25)
    swings = np.ptp(found, axis=0)
    assert swings[2] > 100.0
    assert swings[1] < 1e-9 * swings[2]
    assert max(swings[3], swings[5]) < 1e-9 * swings[4]
