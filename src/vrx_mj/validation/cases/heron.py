"""The Heron of profile `marine`: its top speed."""

import math

from vrx_mj.draw.chart import Chart, Series
from vrx_mj.validation.rows import Case, Findings, between, near
from vrx_mj.validation.setups import marine_simulation

_SLOWEST, _FASTEST = 1.597, 1.667
"""Top speeds of the published model with 22 and with 24 N a side [m/s]."""
_DAMPING = 17.257603
"""Quadratic damping in surge of that model [N s2/m2]."""
_THRUSTS = {0.7: 16.0, 0.8: 19.5, 0.95: 23.0}
"""Thrust a side [N] at some commands, in assets/robots/heron/robot.yaml."""
_TOP = 0.95
"""The command of the thrust in the middle of those of the top speeds."""


def _top_speed() -> Findings:
    """Speeds from rest, at three commands."""
    sim = marine_simulation({"robot": "heron", "boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}]})
    rows, series = [], []
    for command, thrust in _THRUSTS.items():
        sim.reset()
        times, speeds = [0.0], [0.0]
        for _ in range(100):
            sim.step({"a": {"left": command, "right": command}}, duration=0.1)
            times.append(sim.time)
            speeds.append(float(sim.observe()["a"].velocity[0]))
        if command == _TOP:
            rows.append(between(f"top speed, {thrust:g} N a side", "m/s", _SLOWEST, _FASTEST, speeds[-1]))
        else:
            reference = math.sqrt(2.0 * thrust / _DAMPING)
            rows.append(near(f"speed, {thrust:g} N a side", "m/s", reference, speeds[-1], relative=0.01))
        series.append(Series(f"{thrust:g} N a side", times, speeds))
    edges = [
        Series("published top speeds" if speed == _SLOWEST else "", [0.0, 10.0], [speed] * 2, reference=True)
        for speed in (_SLOWEST, _FASTEST)
    ]
    return Findings(tuple(rows), (Chart("Speed of the Heron", "time [s]", "speed [m/s]", (*edges, *series)),))


CASES = (
    Case(
        name="heron-speed",
        title="Speed of the Heron",
        setup="Robot heron in still water and still air, from rest, with both jets at three commands for 10 s.",
        source="Batista, L. F. W. et al. (2024), A Deep Reinforcement Learning Framework and Methodology for Reducing "
        "the Sim-to-Real Gap in ASV Navigation, IROS: the identified damping in surge, by which 22 to 24 N a side make "
        "1.597 to 1.667 m/s; below that 2 T = d u^2. The robot's file has that model's damping and thrusts: the rows "
        "show that it moves by them, and are no measured speeds.",
        files=("physics/propeller.py", "physics/vessel.py", "runtime/loop.py"),
        run=_top_speed,
    ),
)
