"""The Heron of profile `marine`: its top speed."""

import math

from vrx_mj.draw.chart import Chart, Series
from vrx_mj.validation.rows import Outcome, between, case, near
from vrx_mj.validation.setups import marine_simulation, only_boat, record

_SLOWEST, _FASTEST = 1.597, 1.667
"""Top speeds of the published model with 22 and with 24 N a side [m/s]."""
_DAMPING = 17.257603
"""Quadratic damping in surge of that model [N s2/m2]."""
_THRUSTS = {0.7: 16.0, 0.8: 19.5, 0.95: 23.0}
"""Thrust a side [N] at some commands, in assets/robots/heron/robot.yaml."""
_TOP = 0.95
"""The command of the thrust in the middle of those of the top speeds."""


@case("physics/propeller.py", "physics/vessel.py", "runtime/loop.py")
def heron_speed() -> Outcome:
    """Speed of the Heron.

    Robot heron in still water and still air, from rest, with both jets at three commands for 10 s.

    Reference: Batista, L. F. W. et al. (2024), A Deep Reinforcement Learning Framework and Methodology for Reducing
    the Sim-to-Real Gap in ASV Navigation, IROS: the identified damping in surge, by which 22 to 24 N a side make
    1.597 to 1.667 m/s; below that 2 T = d u^2. The robot's file has that model's damping and thrusts: the rows show
    that it moves by them, and are no measured speeds.
    """
    sim = marine_simulation({"robot": "heron", "boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}]})
    edges = [Series("published top speeds", [0.0, 10.0], [speed] * 2, reference=True) for speed in (_SLOWEST, _FASTEST)]
    series = []
    for command, thrust in _THRUSTS.items():
        sim.reset()
        times, speeds = record(sim, lambda sim: only_boat(sim).velocity[0], 100, 0.1, left=command, right=command)
        if command == _TOP:
            yield between(f"top speed, {thrust:g} N a side", "m/s", _SLOWEST, _FASTEST, speeds[-1])
        else:
            reference = math.sqrt(2.0 * thrust / _DAMPING)
            yield near(f"speed, {thrust:g} N a side", "m/s", reference, speeds[-1], relative=0.01)
        series.append(Series(f"{thrust:g} N a side", times, speeds))
    yield Chart("Speed of the Heron", "time [s]", "speed [m/s]", (*edges, *series))
