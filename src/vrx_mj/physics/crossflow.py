"""Drag of the flow across a hull, by strips along it (ITTC; Fossen 2021, 6.7: cross-flow drag).

A strip of the lateral area T dx moves across the water with v + x r - z p, and has the drag of a cylinder:

    Y = -rho / 2 sum C_d T dx |v + x r - z p| (v + x r - z p)

which acts at the strip, hence the moments -z Y_i of roll and x Y_i of yaw. A skeg is a wing that does not turn: its
normal force, rho / 2 A f U^2 sin(alpha) of the MMG standard method (`thrust.normal_slope`), has U times the velocity
across in the place of the square.
"""

import math

from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion, Wrench
from vrx_mj.physics.tables import Table


@kernel
def crossflow_drag(strips: Table, through: Motion) -> Wrench:
    """Return the forces on strips and skegs, `tables.STRIP`, about the link's origin in body axes.

    `through` is the link's motion through the water, of its origin.
    """
    fy, tx, tz = 0.0, 0.0, 0.0
    for i in range(strips.size):
        strip = strips[i]
        across = through.v + strip.x * through.r - strip.z * through.p
        force = -strip.drag * abs(across) * across
        if strip.lift > 0.0:
            force -= strip.lift * math.hypot(through.u + through.q * strip.z, across) * across
        fy += force
        tx -= strip.z * force
        tz += strip.x * force
    return Wrench(0.0, fy, 0.0, tx, 0.0, tz)
