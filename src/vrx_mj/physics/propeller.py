"""Propellers of profile `marine`: from a command to a thrust that was measured, and what of it is left at sea.

Thrust at rest is a table over the command, with a first-order lag. Speed through the water takes thrust as in open
water, where K_T falls in a straight line with the advance ratio J = u / (n D): T = rho D^4 n^2 (a - b J). With u_0 the
speed at which full thrust T_full vanishes, and n^2 going with the thrust T_0 at rest, that is
T = T_0 (1 - u / (u_0 sqrt(T_0 / T_full))).
"""

import math

from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.tables import Record, Table

__all__ = ["advance_thrust", "disc_share", "measured_thrust", "propeller_power", "propeller_step"]


@kernel
def measured_thrust(propeller: Record, points: Table, command: float) -> float:
    """Return the thrust [N] at rest that belongs to a command: straight lines, and the ends' beyond them.

    Args:
        propeller: a row of `tables.PROPELLER`.
        points: its rows of `tables.PROPELLER_POINT`, by rising command.
        command: -1..1; exactly 0 N within the dead zone.
    """
    if abs(command) <= propeller.dead_zone or points.size == 0:
        return 0.0
    if command <= points[0].command:
        return float(points[0].thrust)
    for i in range(1, points.size):
        if command <= points[i].command:
            below, above = points[i - 1], points[i]
            up = (command - below.command) / (above.command - below.command)
            return float(below.thrust + up * (above.thrust - below.thrust))
    return float(points[points.size - 1].thrust)


@kernel
def advance_thrust(propeller: Record, thrust: float, advance: float) -> float:
    """Return what is left of a `thrust` [N] at rest at a speed of `advance` [m/s] through the water along its axis.

    It does not change its sign: a propeller that the water overtakes gives nothing.
    """
    if thrust == 0.0:
        return 0.0
    ahead = thrust > 0.0
    full = propeller.full_ahead if ahead else -propeller.full_astern
    inflow = advance if ahead else -advance
    vanishing = propeller.vanishing_speed * math.sqrt(abs(thrust) / full)
    return float(thrust * max(0.0, 1.0 - inflow / vanishing))


@kernel
def disc_share(radius: float, depth: float) -> float:
    """Return the share 0..1 of an upright disc that is under water, with its centre at a depth [m]."""
    x = min(max(depth / radius, -1.0), 1.0)
    return (math.pi - math.acos(x) + x * math.sqrt(1.0 - x * x)) / math.pi


@kernel
def propeller_power(propeller: Record, thrust: float, share: float) -> float:
    """Return the electric power [W] at a `thrust` [N] at rest: that of full thrust times |T / T_full|^1.5.

    It goes with the third power of the shaft's rate. The share of the disc that is in air draws nothing; speed through
    the water, which unloads a propeller, is left out.
    """
    full = propeller.full_ahead if thrust >= 0.0 else -propeller.full_astern
    if full <= 0.0:
        return 0.0
    return float(propeller.full_power * share * (abs(thrust) / full) ** 1.5)


@kernel
def propeller_step(
    propeller: Record, state: Record, points: Table, command: float, advance: float, depth: float, dt: float
) -> float:
    """Advance a propeller by `dt` [s] and return its thrust [N] along its axis.

    Args:
        propeller: a row of `tables.PROPELLER`.
        state: its row of `tables.PROPELLER_STATE`.
        points: its rows of `tables.PROPELLER_POINT`.
        command: -1..1.
        advance: speed [m/s] through the water along the axis.
        depth: of its centre under the surface there [m].
        dt: length of the step [s].
    """
    target = measured_thrust(propeller, points, command)
    if propeller.time_constant > 0.0:
        state.thrust += -math.expm1(-dt / propeller.time_constant) * (target - state.thrust)
    else:
        state.thrust = target
    share = disc_share(propeller.radius, depth)
    state.energy += dt * propeller_power(propeller, state.thrust, share)
    return float(share * advance_thrust(propeller, state.thrust, advance))
