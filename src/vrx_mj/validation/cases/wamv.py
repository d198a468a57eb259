"""The WAM-V 16 of profile `marine`: what its propellers pull."""

import numpy as np

from vrx_mj.draw.chart import Chart, Series
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import Outcome, case, near
from vrx_mj.validation.setups import marine_simulation, only_boat

_MEASURED = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
_PULLS = (9.0, 53.0, 85.0, 120.0, 157.0, 182.0, 219.0, 240.0)
"""Measured bollard pull of a propeller at those commands [N]."""


def _pull(sim: Simulation, command: float) -> float:
    """Half the force ahead [N] that both propellers put on a boat at rest, by how its centre of mass is accelerated."""
    sim.reset()
    sim.step({}, duration=20.0)
    pose = sim.data.qpos[:3].tolist()
    seen = only_boat(sim)
    sim.set_boat(sim.boats[0], pose=[*pose, seen.roll, seen.pitch, seen.heading], velocity=[0.0] * 6)
    sim.step({sim.boats[0]: {"left": command, "right": command}}, duration=sim.timestep)
    hull, after = sim.world.parameters.hulls[0], only_boat(sim)
    assert hull.vessel is not None
    center = np.cross(after.angular_velocity, hull.body_com) + after.velocity
    whole = float(sim.model.body_subtreemass[sim.model.body(hull.body).id]) + hull.vessel.added_mass[0][0]
    return 0.5 * whole * float(center[0]) / sim.timestep


@case("physics/propeller.py", "runtime/loop.py", "mjcf/hulls.py")
def wamv_bollard() -> Outcome:
    """Bollard pull of the WAM-V 16.

    Robot wamv in still water, let float for 20 s, then put to rest; both propellers at a command for one step. The
    pull is that of its mass with added mass times the acceleration of its centre of mass. The robot's table of
    thrust is made of these measurements: the rows show that what is in it gets to the boat.

    Reference: Sarda, E. I., Qu, H., Bertaska, I. R., von Ellenrieder, K. D. (2016), Station-keeping control of an
    unmanned surface vehicle exposed to current and wind disturbances, Ocean Engineering 127: one propeller.
    """
    sim = marine_simulation({"robot": "wamv", "boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}]})
    ours = [_pull(sim, command) for command in _MEASURED]
    yield from (
        near(f"pull at command {command:g}", "N", pull, own, absolute=5.0)
        for command, pull, own in zip(_MEASURED, _PULLS, ours, strict=True)
    )
    lines = Series("measured", _MEASURED, _PULLS, reference=True), Series("ours", _MEASURED, ours)
    yield Chart("Bollard pull of a WAM-V 16", "command", "pull of a propeller [N]", lines)
