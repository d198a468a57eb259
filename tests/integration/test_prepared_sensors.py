"""Kernels of cameras and lidars compile before the time of a served world begins, not when somebody subscribes."""

import subprocess
import sys

import pytest

from vrx_command import environment

pytestmark = [pytest.mark.slow, pytest.mark.nightly]

PROGRAM = """
import vrx_mj
from vrx_mj.ros.serve import ServeOptions, serve
from vrx_mj.physics.surface import draw_surface
from vrx_mj.sensors.camera import with_grain
from vrx_mj.sensors.lidar import noisy
from vrx_mj.sensors.rays import cast
from vrx_mj.sensors.lidar import cast_at_sea

KERNELS = {"draw_surface": draw_surface, "with_grain": with_grain, "noisy": noisy, "cast": cast, "sea": cast_at_sea}
def compiled():
    return {name for name, kernel in KERNELS.items() if kernel.signatures}
sim = vrx_mj.Simulation(vrx_mj.compile_world("ocean"))
before = sim.get_state().to_bytes()
assert not compiled()
"""
SERVED = """
at_start = []
def ready(_transports):
    at_start.append((sim.time, compiled(), sim.get_state().to_bytes() == before))
serve(sim, ServeOptions(rosbridge=0, duration=0.05), report=lambda *_: None, ready=ready)
print(at_start[0][0], sorted(at_start[0][1]), at_start[0][2])
counts = {name: len(kernel.signatures) for name, kernel in KERNELS.items() if kernel.signatures}
sim.sense("wamv")["lidar_wamv"]
assert counts == {name: len(kernel.signatures) for name, kernel in KERNELS.items() if kernel.signatures}
"""
CACHED = """
import time
sim.prepare_sensors()
print(sorted(compiled()))
"""


def ran(program, cache):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM + program], env=environment(VRX_MJ_CACHE=cache), capture_output=True,
        encoding="utf-8", check=False, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.strip(), done.stderr


def test_a_served_world_begins_with_its_sensors_compiled(tmp_path):
    out, said = ran(SERVED, tmp_path)
    assert out == "0.0 ['cast', 'draw_surface', 'noisy', 'with_grain'] True"
    assert said.index("compiling the physics") < said.index("compiling the sea's pictures") < said.index("the lidar")
    assert ran(CACHED, tmp_path) == ("[]", "")
