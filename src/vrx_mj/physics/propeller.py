"""Propellers of profile `marine`: from a command to a thrust that was measured, and what of it is left at sea.

Thrust at rest is a table over the command, with a first-order lag. Speed through the water takes thrust as in open
water, where K_T falls in a straight line with the advance ratio J = u / (n D): T = rho D^4 n^2 (a - b J). With u_0 the
speed at which full thrust T_full vanishes, and n^2 going with the thrust T_0 at rest, that is
T = T_0 (1 - u / (u_0 sqrt(T_0 / T_full))). Waves and current are in the speed, and the waves in the depth.
"""

import math

from vrx_mj.physics.current import current_velocity
from vrx_mj.physics.kernel import expanded_kernel, kernel
from vrx_mj.physics.kinematics import orbital_motion
from vrx_mj.physics.motion import Motion, dot, place_of, plus, relative_motion, velocity_at
from vrx_mj.physics.tables import Record, Table, Views, Waves
from vrx_mj.physics.thrust import effective_command, force_direction, force_point
from vrx_mj.physics.waves import surface_height

_STEADY = 1e-9
"""Thrust [N] this near to its target is there: so a propeller comes to rest, and rests."""


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
    return float(propeller.power * share * (abs(thrust) / full) ** 1.5)


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
    if propeller.time_constant > 0.0 and abs(target - state.thrust) > _STEADY:
        state.thrust += -math.expm1(-dt / propeller.time_constant) * (target - state.thrust)
    else:
        state.thrust = target
    share = disc_share(0.5 * propeller.diameter, depth)
    state.energy += dt * propeller_power(propeller, state.thrust, share)
    return float(share * advance_thrust(propeller, state.thrust, advance))


@kernel
def advance_speed(thruster: Record, through: Motion, angle: float) -> float:
    """Return the speed [m/s] through the water at a propeller, along its axis at a steering `angle` [rad].

    `through` is the hull's motion through the water that is at the propeller.
    """
    return dot(force_direction(thruster, angle), velocity_at(through, force_point(thruster, angle)))


@expanded_kernel
def update_propeller(
    hull: Record, thruster: Record, own: Record, a: Views, waves: Waves, body: Motion, time: float, dt: float
) -> None:
    """Advance a thruster that has a measured propeller by `dt` [s]: its force `own.thrust` [N].

    Args:
        hull: a row of `tables.HULL`.
        thruster: a row of `tables.THRUSTER`.
        own: its row of `tables.THRUSTER_STATE`.
        a: tables of the run: propellers, sea and current.
        waves: `tables.WAVE`, or the columns of it.
        body: motion of the hull's link.
        time: time [s].
        dt: length of the step [s].
    """
    propeller, state, sea = a.propellers[thruster.measured], a.propeller_state[thruster.measured], a.sea[0]
    curve = a.propeller_points[propeller.point_start : propeller.point_start + propeller.point_count]
    command = effective_command(own, time)
    share = command / thruster.max_command
    own.applied, own.fresh, own.thrust = command, 1, 0.0
    if state.thrust == 0.0 and measured_thrust(propeller, curve, share) == 0.0:
        return  # at rest: no need to look at the water
    x, y, z = place_of(body, force_point(thruster, own.angle))
    depth = surface_height(waves, sea, x, y, time) + hull.level - z
    advance = 0.0
    if propeller.vanishing_speed < math.inf:
        east, north = current_velocity(a.current, a.current_state, a.layers, sea.level - z, time)
        water = plus((east, north, 0.0), orbital_motion(waves, sea, x, y, z, time)[:3])
        advance = advance_speed(thruster, relative_motion(body, water), own.angle)
    own.thrust = thruster.gain * propeller_step(propeller, state, curve, share, advance, depth, dt)
