"""Thrusters, from a command to a force, with their steering servo; rudders; and propellers of profile `marine`.

A rudder is a wing that turns in the water, and in the race of a propeller. Lift and drag are the parts of its normal
force across and along the flow, as in the MMG standard method (Yasukawa and Yoshimura, J. Mar. Sci. Technol. 20, 2015):
F_N = rho / 2 A U^2 f sin(alpha), without stall, so for any angle of attack.

A propeller of profile `marine` has a measured thrust and loses part of it at sea. Thrust at rest is a table over the
command, with a first-order lag. Speed through the water takes thrust as in open water, where K_T falls in a straight
line with the advance ratio J = u / (n D): T = rho D^4 n^2 (a - b J). With u_0 the speed at which full thrust T_full
vanishes, and n^2 going with the thrust T_0 at rest, that is T = T_0 (1 - u / (u_0 sqrt(T_0 / T_full))). Waves and
current are in the speed, and the waves in the depth.

Or it is that of a table over the angle of advance, tan beta = u / (0.7 pi n D), in four quadrants (van Lammeren et al.,
The Wageningen B-Screw Series, Trans. SNAME 77, 1969), with V^2 = u^2 + (0.7 pi n D)^2 and A_0 = pi D^2 / 4:
T = rho / 2 C_T* V^2 A_0 and Q = rho / 2 C_Q* V^2 A_0 D. The shaft turns as fast as gives the thrust at rest.
"""

import math

import numpy as np

from vrx_mj.physics.conditions import current_velocity
from vrx_mj.physics.kernel import expanded_kernel, kernel
from vrx_mj.physics.kinematics import half_step_back, orbital_motion
from vrx_mj.physics.motion import (
    Level,
    Motion,
    Vector,
    Wrench,
    cross,
    dot,
    minus,
    place_of,
    plus,
    relative_motion,
    rotated_wrench,
    times,
    velocity_at,
)
from vrx_mj.physics.tables import LINEAR, NEWTONS, Record, Table, Views, Waves
from vrx_mj.physics.waves import surface_height

_CORNER = 0.01  # the command where one curve ends and the other begins
_STEADY = 1e-9
"""Thrust [N] this near to its target is there: so a propeller comes to rest, and rests."""


def _curve(a: float, k: float, b: float, nu: float, c: float, m: float) -> tuple[float, ...]:
    """Return (A, K - A, B, 1 / nu, C, M); VRX rounds the six and K - A to 32-bit floats, 1 / nu not."""
    low, high, rate, shape, base, middle = (np.float32(value) for value in (a, k, b, nu, c, m))
    return float(low), float(high - low), float(rate), 1.0 / float(shape), float(base), float(middle)


_AHEAD = _curve(0.01, 59.82, 5.0, 0.38, 0.56, 0.28)
_ASTERN = _curve(-199.13, -0.09, 8.84, 5.34, 0.99, -0.57)
"""Generalised logistic functions fitted to a WAM-V's thrusters: VRX usv_gazebo_thrust_plugin.cc."""


@kernel
def thrust_force(thruster: Record, command: float) -> float:
    """Return the force [N] along the thruster's axis, without lag and whatever the speed.

    VRX's quirks are kept: the linear mapping divides by `max_command` twice; the logistic
    one gives 0.0414 N at rest, nothing at exactly 0.01, and jumps there from 0.06 to 1.21 N. VRX 3's
    command is the force itself.
    """
    ahead, astern = thruster.max_forward, thruster.max_reverse
    if thruster.mapping == NEWTONS:
        return float(min(max(command, astern), ahead))
    x = command / thruster.max_command
    if thruster.mapping == LINEAR:
        force = x / thruster.max_command * (ahead if x >= 0.0 else -astern)
    elif x > _CORNER:
        force = _logistic(_AHEAD, x)
    elif x < _CORNER:
        force = _logistic(_ASTERN, x)
    else:
        return 0.0
    return float(min(force, ahead) if x > 0.0 else max(force, astern))


@kernel
def _logistic(curve: tuple[float, ...], x: float) -> float:
    """Return A + (K - A) / (C + exp(-B (x - M)))^(1 / nu)."""
    a, span, b, power, c, m = curve
    return float(a + span / (c + math.exp(-b * (x - m))) ** power)


@kernel
def effective_command(state: Record, t: float) -> float:
    """Return the command that acts at time `t` [s]: the last one, or 0 once it has expired."""
    return 0.0 if t > state.expires else float(state.command)


@kernel
def steering_target(thruster: Record, angle: float) -> float:
    """Return the commanded steering angle [rad] within what the engine may turn."""
    return float(min(max(angle, -thruster.max_angle), thruster.max_angle))


@kernel
def thruster_wrench(
    thruster: Record, hull: Record, motion: Motion, force: float, angle: float, along: float = 0.0
) -> Wrench:
    """Return what `force` [N] at the propeller does: world axes, about `hull.link_com`.

    `motion` is the hull's; `angle` [rad] is the steering angle, positive counter-clockwise about the hinge's axis.
    `along` [N] is a force along the engine's x axis besides, as a sail has.
    """
    c, s = math.cos(angle), math.sin(angle)
    lever = minus(plus(thruster.position, _from_hinge(thruster, thruster.propeller, c, s)), hull.link_com)
    push = times(force, _from_hinge(thruster, thruster.direction, c, s))
    if along != 0.0:
        push = plus(push, _from_hinge(thruster, (along, 0.0, 0.0), c, s))
    return rotated_wrench(motion, Wrench(*push, *cross(lever, push)))


@kernel
def engine_wrench(thruster: Record, motion: Motion, force: float, angle: float, along: float = 0.0) -> Wrench:
    """Return the same for an engine that is a body of its own: world axes, about that body's CoM.

    `motion` is the hull's, and the engine's frame is the hinge's turned by `angle` [rad].
    """
    c, s = math.cos(angle), math.sin(angle)
    d, lever = thruster.direction, minus(thruster.propeller, thruster.body_com)
    push = d[0] * force + along, d[1] * force, d[2] * force
    turn = _from_hinge(thruster, cross(lever, push), c, s)
    return rotated_wrench(motion, Wrench(*_from_hinge(thruster, push, c, s), *turn))


@kernel
def force_point(thruster: Record, angle: float) -> Vector:
    """Return where the force acts at a steering `angle` [rad]: hull axes from the link's origin [m]."""
    return plus(thruster.position, _from_hinge(thruster, thruster.propeller, math.cos(angle), math.sin(angle)))


@kernel
def _from_hinge(thruster: Record, v: Vector, c: float, s: float) -> Vector:
    """Return a vector of the engine's axes, steered by an angle of cosine `c` and sine `s`, in the hull's axes."""
    r, turned = thruster.rotation, (c * v[0] - s * v[1], s * v[0] + c * v[1], v[2])
    return dot(r[0], turned), dot(r[1], turned), dot(r[2], turned)


@kernel
def to_hinge(thruster: Record, v: Vector) -> Level:
    """Return the parts of a vector of the hull's axes along the hinge's x and y."""
    m, (x, y, z) = thruster.rotation, v
    return m[0, 0] * x + m[1, 0] * y + m[2, 0] * z, m[0, 1] * x + m[1, 1] * y + m[2, 1] * z


@kernel
def servo_torque(thruster: Record, angle: float, rate: float, target: float, dt: float) -> float:
    """Return the torque [N m] with which the servo turns the engine toward `target` [rad].

    A PD controller on the angle and rate that it will have at the end of the step of `dt` [s], with
    nothing else turning the engine: stable at any step, and VRX's -kp e - kd de/dt as
    `dt` goes to 0. Limited to `effort`, and to what does not push beyond `velocity`.
    """
    ahead = angle + dt * rate - target
    stiffness = dt * (dt * thruster.kp + thruster.kd) / thruster.inertia
    torque = -(thruster.kp * ahead + thruster.kd * rate) / (1.0 + stiffness)
    up = max(0.0, (thruster.velocity - rate) * thruster.inertia / dt)
    down = max(0.0, (thruster.velocity + rate) * thruster.inertia / dt)
    return float(max(min(torque, thruster.effort, up), -thruster.effort, -down))


@kernel
def servo_step(thruster: Record, angle: float, rate: float, target: float, dt: float) -> tuple[float, float]:
    """Return the engine's angle [rad] and rate [rad/s] a step later, where no joint integrates it."""
    rate_next = rate + dt * servo_torque(thruster, angle, rate, target, dt) / thruster.inertia
    return angle + dt * rate_next, rate_next


def normal_slope(aspect_ratio: float) -> float:
    """Return f, the slope of the normal force over sin(alpha), of a rudder: Fujii's 6.13 L / (L + 2.25)."""
    return 6.13 * aspect_ratio / (aspect_ratio + 2.25)


@kernel
def race_speed(inflow: float, thrust: float, density: float, area: float) -> float:
    """Return the speed [m/s] of the water behind a propeller that it reaches at `inflow` [m/s].

    Momentum theory (Rankine, Froude): T = rho / 2 A (w^2 - u^2) far behind a disc of `area` [m2] with `thrust` [N].
    A propeller that pushes astern, or in water that overtakes it, leaves no race on a rudder behind it.
    """
    if thrust <= 0.0 or inflow < 0.0:
        return inflow
    return math.sqrt(inflow * inflow + 2.0 * thrust / (density * area))


@kernel
def rudder_force(rudder: Record, through: Motion, angle: float, thrust: float) -> float:
    """Return the force [N] on a rudder in the water along its own y axis, the normal of a blade that lies along its x.

    `through` is the hull's motion through the water that is at the blade; `angle` [rad] is the rudder's, and `thrust`
    [N] that of its propeller.
    """
    ahead, aside = to_hinge(rudder, velocity_at(through, force_point(rudder, angle)))
    sine, cosine = math.sin(angle), math.cos(angle)
    pressure = 0.5 * rudder.density * rudder.area * rudder.slope
    share = rudder.race_share if rudder.race >= 0 else 0.0
    raced = race_speed(ahead, thrust, rudder.density, rudder.race_area) if share > 0.0 else 0.0
    outside = (1.0 - share) * _head(ahead, aside, sine, cosine)
    return float(pressure * (share * _head(raced, aside, sine, cosine) + outside))


@kernel
def _head(ahead: float, aside: float, sine: float, cosine: float) -> float:
    """Return U^2 sin(alpha) [m2/s2] of water met at `ahead` and `aside` [m/s] by a blade at an angle."""
    return math.hypot(ahead, aside) * (ahead * sine - aside * cosine)


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

    It does not change its sign: a propeller that the water overtakes gives nothing, and one that the water meets from
    behind what it gives at rest, from which K_T of B4-70 is within 15 % down to J = -0.6.
    """
    if thrust == 0.0:
        return 0.0
    ahead = thrust > 0.0
    full = propeller.full_ahead if ahead else -propeller.full_astern
    inflow = max(advance if ahead else -advance, 0.0)
    vanishing = propeller.vanishing_speed * math.sqrt(abs(thrust) / full)
    return float(thrust * max(0.0, 1.0 - inflow / vanishing))


@kernel
def quadrant_loads(
    propeller: Record, quadrants: Table, density: float, thrust: float, advance: float
) -> tuple[float, float]:
    """Return the thrust [N] at a speed, and the power there over that at rest, below 0 where the water drives it.

    A propeller without thrust at rest is held: it has the drag of its blades, and no power.

    Args:
        propeller: a row of `tables.PROPELLER`.
        quadrants: `tables.QUADRANT`, in which it has rows.
        density: of the water [kg/m3].
        thrust: at rest [N].
        advance: speed [m/s] through the water along the axis.
    """
    first, half = propeller.quadrant_start, propeller.quadrant_count // 2
    rest = quadrants[first + half] if thrust >= 0.0 else quadrants[first]
    scale = 0.125 * math.pi * density * propeller.diameter**2  # [kg/m]
    turning = thrust / (scale * rest.thrust)  # square of 0.7 pi n D
    place = half * (1.0 + math.atan2(advance, math.copysign(math.sqrt(turning), thrust)) / math.pi)
    low = min(int(place), propeller.quadrant_count - 2)
    below, above, up = quadrants[first + low], quadrants[first + low + 1], place - low
    square = advance * advance + turning
    pushes = scale * square * (below.thrust + up * (above.thrust - below.thrust))
    if turning == 0.0:
        return pushes, 0.0
    return pushes, square * (below.torque + up * (above.torque - below.torque)) / (turning * rest.torque)


@kernel
def disc_share(radius: float, depth: float) -> float:
    """Return the share 0..1 of an upright disc that is under water, with its centre at a depth [m]."""
    x = min(max(depth / radius, -1.0), 1.0)
    return (math.pi - math.acos(x) + x * math.sqrt(1.0 - x * x)) / math.pi


@kernel
def propeller_power(propeller: Record, thrust: float, share: float) -> float:
    """Return the electric power [W] at a `thrust` [N] at rest: that of full thrust times |T / T_full|^1.5.

    It goes with the third power of the shaft's rate. The share of the disc that is in air draws nothing; what speed
    through the water does to it is in `quadrant_loads`.
    """
    full = propeller.full_ahead if thrust >= 0.0 else -propeller.full_astern
    if full <= 0.0:
        return 0.0
    return float(propeller.power * share * (abs(thrust) / full) ** 1.5)


@kernel
def propeller_step(
    propeller: Record, state: Record, points: Table, quadrants: Table, command: float, advance: float, depth: float,
    density: float, dt: float,
) -> float:  # fmt: skip
    """Advance a propeller by `dt` [s] and return its thrust [N] along its axis.

    Args:
        propeller: a row of `tables.PROPELLER`.
        state: its row of `tables.PROPELLER_STATE`.
        points: its rows of `tables.PROPELLER_POINT`.
        quadrants: `tables.QUADRANT`, in which it may have rows.
        command: -1..1.
        advance: speed [m/s] through the water along the axis.
        depth: of its centre under the surface there [m].
        density: of the water [kg/m3].
        dt: length of the step [s].
    """
    target = measured_thrust(propeller, points, command)
    if propeller.time_constant > 0.0 and abs(target - state.thrust) > _STEADY:
        state.thrust += -math.expm1(-dt / propeller.time_constant) * (target - state.thrust)
    else:
        state.thrust = target
    share = disc_share(0.5 * propeller.diameter, depth)
    power = propeller_power(propeller, state.thrust, share)
    if propeller.quadrant_count > 0:
        thrust, load = quadrant_loads(propeller, quadrants, density, state.thrust, advance)
        state.energy += dt * power * max(load, 0.0)
        return float(share * thrust)
    state.energy += dt * power
    return float(share * advance_thrust(propeller, state.thrust, advance))


@expanded_kernel
def depth_of_force(
    hull: Record, thruster: Record, angle: float, sea: Record, waves: Waves, body: Motion, time: float
) -> float:
    """Return how deep [m] under the surface the force of a thruster or rudder acts, at a steering `angle` [rad]."""
    x, y, z = place_of(body, force_point(thruster, angle))
    return float(surface_height(waves, sea, x, y, time) + hull.level - z)


@expanded_kernel
def motion_at_force(
    thruster: Record, angle: float, a: Views, waves: Waves, body: Motion, time: float, dt: float
) -> Motion:
    """Return a hull's motion through the water that current and waves move where a thruster's or rudder's force acts.

    Args:
        thruster: a row of `tables.THRUSTER`.
        angle: of steering [rad].
        a: tables of the run: sea and current.
        waves: `tables.WAVE`, or the columns of it.
        body: motion of the hull's link.
        time: time [s].
        dt: length of the step [s].
    """
    sea, point = a.sea[0], force_point(thruster, angle)
    x, y, z = place_of(body, point)
    past = half_step_back(body, point, dt)
    east, north = current_velocity(a.current, a.current_state, a.layers, sea.level - z, time - past[2])
    orbital = orbital_motion(waves, sea, x, y, z, time, past=past)
    return relative_motion(body, plus((east, north, 0.0), orbital[:3]))


@expanded_kernel
def rudder_force_at_sea(
    hull: Record, rudder: Record, angle: float, thrust: float, a: Views, waves: Waves, body: Motion, time: float,
    dt: float,
) -> float:  # fmt: skip
    """Return `rudder_force` [N] in the water that current and waves move, of the share of the blade that is in it.

    That share is an upright disc's of the blade's area.

    Args:
        hull: a row of `tables.HULL`.
        rudder: a row of `tables.THRUSTER`.
        angle: of the rudder [rad].
        thrust: of the propeller in whose race it is [N].
        a: tables of the run: sea and current.
        waves: `tables.WAVE`, or the columns of it.
        body: motion of the hull's link.
        time: time [s].
        dt: length of the step [s].
    """
    depth = depth_of_force(hull, rudder, angle, a.sea[0], waves, body, time)
    through = motion_at_force(rudder, angle, a, waves, body, time, dt)
    share = disc_share(math.sqrt(rudder.area / math.pi), depth)
    return float(share * rudder_force(rudder, through, angle, thrust))


@kernel
def advance_speed(thruster: Record, through: Motion, angle: float) -> float:
    """Return the speed [m/s] through the water at a propeller, along its axis at a steering `angle` [rad].

    `through` is the hull's motion through the water that is at the propeller.
    """
    direction = _from_hinge(thruster, thruster.direction, math.cos(angle), math.sin(angle))
    return dot(direction, velocity_at(through, force_point(thruster, angle)))


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
    propeller, state = a.propellers[thruster.measured], a.propeller_state[thruster.measured]
    curve = a.propeller_points[propeller.point_start : propeller.point_start + propeller.point_count]
    command = effective_command(own, time)
    share = command / thruster.max_command
    own.applied, own.fresh, own.thrust = command, 1, 0.0
    if state.thrust == 0.0 and propeller.quadrant_count == 0 and measured_thrust(propeller, curve, share) == 0.0:
        return  # at rest: no need to look at the water
    depth = depth_of_force(hull, thruster, own.angle, a.sea[0], waves, body, time)
    advance = 0.0
    if propeller.vanishing_speed < math.inf or propeller.quadrant_count > 0:
        advance = advance_speed(thruster, motion_at_force(thruster, own.angle, a, waves, body, time, dt), own.angle)
    thrust = propeller_step(propeller, state, curve, a.quadrants, share, advance, depth, a.sea[0].density, dt)
    own.thrust = thruster.gain * thrust
