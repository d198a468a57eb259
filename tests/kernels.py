"""Compiles the kernels that most tests need: `python tests/kernels.py GROUP`; conftest.py starts all groups at once.

The groups take about as long as each other, and each kernel is compiled in one of them.
"""

import gc
import sys
import tempfile
from pathlib import Path

import numpy as np

from vrx_mj.mjcf.compile import compile_world
from vrx_mj.mjcf.scene import drawing_model
from vrx_mj.recording import record
from vrx_mj.recording.antialiasing import antialias
from vrx_mj.runtime.batch import Batch
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.sensors.camera import Cameras

WATERS = ("vrx", "none"), ("vrx", "jonswap"), ("marine", "none")
"""Profiles and seas that have loops of their own."""


def world_of(profile, sea):
    """A world of one boat."""
    waves = {"model": sea} | ({"significant_height": 0.5} if sea != "none" else {})
    return compile_world({"physics": {"profile": profile}, "sea": waves}, fleet={"sensors": "none"})


def loop(profile, sea):
    """The loop of a simulation, and its forces."""
    sim = Simulation(world_of(profile, sea))
    sim.forces(sim.boats[0])


def loops():
    """Those of VRX's boats alone, in few and in many waves."""
    for water in WATERS[:2]:
        loop(*water)


def pictures():
    """Pictures of the sea, which need no loop; that of any boat; then what needs those that `loops` has compiled."""
    antialias(np.zeros((8, 8, 4), np.uint8))
    world = compile_world({"physics": {"profile": "vrx"}}, fleet={"sensors": "vrx"})
    Cameras(drawing_model(world), world.parameters).compile()
    loop(*WATERS[2])
    sim = Simulation(world)
    sim.prepare_sensors()
    with tempfile.TemporaryDirectory() as folder, record(sim, Path(folder) / "run.rrd"):
        sim.step(duration=1.0)
    for water in WATERS:
        Batch(world_of(*water), 2)


GROUPS = {"loops": loops, "pictures": pictures}

if __name__ == "__main__":
    gc.disable()  # a sixth of the time is spent looking for garbage, of which there is little
    GROUPS[sys.argv[1]]()
