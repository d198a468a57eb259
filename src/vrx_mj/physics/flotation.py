"""Floating objects: buoyancy and drag of spheres, boxes and cylinders on one link, as VRX has them.

Element e of a link, with submerged volume V_e, pushes at its submerged centroid with
    (0, 0, rho V_e g) - k_e (v - (0, 0, rise)),     k_e = c_lin m V_e / V_shape,
whose vertical component is 0 at least, and turns the link with -kappa_e omega,
    kappa_e = m V_e / V_shape c_ang L^2.
v is the velocity of the link's *origin*, `rise` the vertical velocity of the water there, and m the link's
mass. g is the world's 9.8 m/s2, not the 9.815 m/s2 of hulls. VRX classic takes the water's height and `rise` at the
link's origin for all elements, VRX 3 for each element at the element's own place.

VRX takes v and omega as they are, which at 10 ms diverges: a dock block's drag stops it within a
millisecond, and a marker's centre of mass hangs 2 m below the float. Here drag is that of the velocities at
the end of the step, v + dt a and omega + dt alpha, and a and alpha come from Newton's and Euler's equations
of the link as a free body (about its centre of mass at r from the origin):
    m (a + alpha x r + omega x (omega x r)) = F(a) + m g,      I alpha + omega x I omega = T(a, alpha).
F is diagonal in a; with a eliminated, three equations for alpha remain. As dt goes to 0 it is VRX's formula.

What touches the link must meet that drag too. So MuJoCo's inertia gets dt D, D = diag(k, k, k_z, kappa, kappa, kappa)
for the velocity of the origin and the turn, and the wrench that is applied is (F, T) + dt D (a, alpha):
    (M + dt D) (v' - v) = dt ((F, T) + dt D (a, alpha) + what touches it).
While nothing touches it v' - v = dt (a, alpha), as above; a contact is resisted by M + dt D.

Some follow a path by themselves: animals and a moving beacon, as VRX's plugins drive them. VRX classic's
follow_plugin.cc pushes with a constant force along the body's x and turns with a constant torque about its z, one way
or the other, while the waypoint is more than 2 degrees off the bow. Gazebo's TrajectoryFollower.cc, which the worlds of
2023 use, turns first: it pushes only while the waypoint is ahead. Both push at the link's origin (AddLinkForce,
AddWorldWrench), which for an animal is 2 m above its centre of mass.
"""

import math
from typing import NamedTuple

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.physics.kernel import expanded_kernel, kernel
from vrx_mj.physics.motion import (
    Motion,
    Vector,
    Wrench,
    add,
    cross,
    dot,
    minus,
    place_of,
    plus,
    position_of,
    rotate,
    rotated_wrench,
    spin_of,
    times,
    unrotate,
    velocity_of,
    zero_wrench,
)  # fmt: skip
from vrx_mj.physics.tables import OwnWaves, Record, Table, Waves
from vrx_mj.physics.volumes import submerged_part
from vrx_mj.physics.waves import surface_height

_Rows = tuple[Vector, Vector, Vector]
"""Rows of a matrix."""
_TINY = 1.0e-6
"""Submerged volumes up to this are dry [m3]: VRX buoyancy_gazebo_plugin.cc."""


class Sums(NamedTuple):
    """What the wet elements add up to; levers s lead from the link's centre of mass, world axes.

    `lift` [N] and the moments `lift_x`, `lift_y` [N m] are of buoyancy and of the drag of water that rises; `k`
    [N s/m], `sx`, `sy`, `sz` [N s] are sums of k_e and k_e s_e. `kz`, `zx`, `zy` are those over the elements that push
    upward: they alone have vertical drag and buoyancy. `kappa` [N m s]. `limit` [m/s]: the lowest upward speed relative
    to the water at which one of those would pull down.
    """

    lift: float
    lift_x: float
    lift_y: float
    k: float
    sx: float
    sy: float
    sz: float
    kz: float
    zx: float
    zy: float
    kappa: float
    limit: float


class Flotation(NamedTuple):
    """Loads of a link's elements in a step: the wrench at its end, and its parts."""

    wrench: Wrench
    """Buoyancy and drag at the end of the step: world axes, about the link's centre of mass."""
    sums: Sums
    """What its wet elements add up to."""
    acceleration: Vector
    """Acceleration of the link's origin as a free body [m/s2], world axes."""
    turning: Vector
    """Angular acceleration of the link as a free body [rad/s2], world axes."""


@kernel
def water_rise(state: Record, height: float, dt: float) -> float:
    """Return the water's vertical speed [m/s] at the link since the step before, and keep `height` [m].

    `height` is `waves.surface_height` at the link's origin.
    """
    rise = (height - state.height) / dt
    state.height = height
    return float(rise)


@kernel
def water_at_elements(
    body: Record, elements: Table, water: Table, motion: Motion, waves: Waves, sea: Record, t: float, dt: float,
    own: OwnWaves = None,
) -> None:  # fmt: skip
    """Keep in `water` the surface's height [m] at each of the link's elements, and how fast [m/s] it rose there."""
    for i in range(body.element_start, body.element_start + body.element_count):
        x, y, _ = place_of(motion, elements[i].position)
        height = surface_height(waves, sea, x, y, t, own)
        water[i].rise = (height - water[i].height) / dt
        water[i].height = height


@expanded_kernel
def flotation(
    body: Record, elements: Table, water: Table | None, motion: Motion,
    height: float, rise: float, dt: float, external: Wrench,
) -> Flotation:  # fmt: skip
    """Return buoyancy and drag at the end of a step: world axes, about the link's centre of mass, without weight.

    `height` [m] and `rise` [m/s] are the water's at the link's origin; what `water`, if any, returns for an element
    in its row of `ELEMENT_STATE` is added to them. Without it what compiles knows nothing of it, and is faster.
    `external` is every other wrench on the link but weight, world axes about its centre of mass (`zero_wrench()` for
    none). `dt` = 0 gives VRX's explicit force.
    """
    return flotation_under(body.gravity, body, elements, water, motion, height, rise, dt, external)


@kernel
def flotation_under(
    gravity: float, body: Record, elements: Table, water: Table | None, motion: Motion,
    height: float, rise: float, dt: float, external: Wrench,
) -> Flotation:  # fmt: skip
    """Return `flotation` in water that presses as under another gravity [m/s2] than the body's own."""
    lever, inertia = rotate(motion, body.com), _world_inertia(body, motion)
    velocity, spin = rotate(motion, velocity_of(motion)), rotate(motion, spin_of(motion))
    slip = (velocity[0], velocity[1], velocity[2] - rise)
    lowest = -math.inf
    for _ in range(body.element_count + 1):
        sums = wet_sums(body, elements, water, motion, lever, height + body.level, lowest, gravity)
        a, alpha = _accelerations(body, sums, inertia, lever, slip, spin, dt, external)
        if slip[2] + dt * a[2] <= sums.limit:
            break
        lowest = sums.limit  # elements that would pull down let go, and more of them may follow
    wrench = sums_wrench(sums, plus(slip, times(dt, a)), plus(spin, times(dt, alpha)))
    return Flotation(wrench, sums, a, alpha)


@kernel
def flotation_of_step(body: Record, motion: Motion, found: Flotation, dt: float, damping: FloatArray) -> Wrench:
    """Return the wrench to apply in a step whose inertia has dt D, about the link's centre of mass.

    `damping`, (3,), gets dt (k, k_z, kappa) for `add_flotation_drag` [kg, kg, kg m2].
    """
    k, kz, kappa = dt * found.sums.k, dt * found.sums.kz, dt * found.sums.kappa
    damping[0], damping[1], damping[2] = k, kz, kappa
    a = found.acceleration
    force = k * a[0], k * a[1], kz * a[2]
    torque = minus(times(kappa, found.turning), cross(rotate(motion, body.com), force))
    return add(found.wrench, Wrench(*force, *torque))


@kernel
def add_flotation_drag(inertia: FloatArray, inertia_row: IntArray, dof: int, damping: FloatArray) -> None:
    """Add dt D to the block of a free joint at `dof` in MuJoCo's sparse lower inertia.

    D is diagonal, and a row ends with its diagonal: that of a body whose frame is its principal one has nothing else.
    """
    for i in range(dof, dof + 6):
        end = inertia_row[i + 1] if i + 1 < inertia_row.size else inertia.size
        inertia[end - 1] += damping[0] if i < dof + 2 else damping[1] if i == dof + 2 else damping[2]


@kernel
def wet_sums(
    body: Record, elements: Table, water: Table | None, motion: Motion, lever: Vector, level: float, lowest: float,
    gravity: float,
) -> Sums:  # fmt: skip
    """Return the sums over the elements, whose water has a gravity; up to a limit of `lowest` they do not push up."""
    lift = lift_x = lift_y = k = sx = sy = sz = kz = zx = zy = kappa = 0.0
    nearest = math.inf
    center = plus(position_of(motion), lever)
    for i in range(body.element_start, body.element_start + body.element_count):
        element = elements[i]
        height, rise = 0.0, 0.0
        if water is not None:
            height, rise = water[i].height, water[i].rise
        wet = submerged_part(element, motion, level + height)
        if wet.volume <= _TINY:
            continue
        moving = body.mass * wet.volume / element.volume
        drag = body.linear_drag * moving
        x, y, z = minus(wet[1:], center)
        k, sx, sy, sz = k + drag, sx + drag * x, sy + drag * y, sz + drag * z
        kappa += moving * body.angular_drag * element.mean_dimension * element.mean_dimension
        limit = _pull_speed(body, element) + rise
        if limit > lowest:
            buoyancy = body.density * wet.volume * gravity + drag * rise
            lift, lift_x, lift_y = lift + buoyancy, lift_x + y * buoyancy, lift_y - x * buoyancy
            kz, zx, zy = kz + drag, zx + drag * x, zy + drag * y
            nearest = min(nearest, limit)
    return Sums(lift, lift_x, lift_y, k, sx, sy, sz, kz, zx, zy, kappa, nearest)


@kernel
def _pull_speed(body: Record, element: Record) -> float:
    """Return the upward speed [m/s] relative to the water at which drag equals an element's buoyancy.

    Both are proportional to the submerged volume, so it does not depend on that.
    """
    if body.linear_drag <= 0.0:
        return math.inf
    return float(body.density * body.gravity * element.volume / (body.linear_drag * body.mass))


@kernel
def sums_wrench(sums: Sums, slip: Vector, spin: Vector) -> Wrench:
    """Return buoyancy and drag at the velocity `slip` [m/s] through the water and the rate `spin` [rad/s]."""
    x, y, z = slip
    s = sums
    return Wrench(
        -s.k * x,
        -s.k * y,
        s.lift - s.kz * z,
        s.lift_x - (s.zy * z - s.sz * y) - s.kappa * spin[0],
        s.lift_y - (s.sz * x - s.zx * z) - s.kappa * spin[1],
        -(s.sx * y - s.sy * x) - s.kappa * spin[2],
    )


@kernel
def _accelerations(
    body: Record, sums: Sums, inertia: _Rows, r: Vector, slip: Vector, spin: Vector, dt: float, external: Wrench
) -> tuple[Vector, Vector]:
    """Return the accelerations a [m/s2] of the link's origin and alpha [rad/s2], world axes.

    With F = f - dt k a, k diagonal: a = (f + m [r x] alpha) / (m + dt k). With T = h - dt P a - dt kappa
    alpha, P a the drag's torque: (I + dt kappa + dt m P D [r x]) alpha = h - dt P D f, D = 1 / (m + dt k).
    """
    m, s, now = body.mass, sums, add(sums_wrench(sums, slip, spin), external)
    turning = minus(times(dot(spin, r), spin), times(dot(spin, spin), r))
    fx, fy, fz = minus(now[:3], times(m, turning))
    fz -= m * body.gravity
    d, dz = 1.0 / (m + dt * s.k), 1.0 / (m + dt * s.kz)
    drag = s.zy * dz * fz - s.sz * d * fy, s.sz * d * fx - s.zx * dz * fz, s.sx * d * fy - s.sy * d * fx
    h = minus(minus(now[3:], cross(spin, _times(inertia, spin))), times(dt, drag))
    alpha = _solve(_effective_inertia(m, s, inertia, r, d, dz, dt), h)
    x, y, z = plus((fx, fy, fz), times(m, cross(r, alpha)))
    return (d * x, d * y, dz * z), alpha


@kernel
def _effective_inertia(m: float, s: Sums, i: _Rows, r: Vector, d: float, dz: float, dt: float) -> _Rows:
    """Return the rows of I + dt kappa + dt m P D [r x] [kg m2]."""
    (x, y, z), ((xx, xy, xz), (_, yy, yz), (_, _, zz)) = r, i
    g, gz, turn = dt * m * d, dt * m * dz, dt * s.kappa
    return (
        (xx + turn - gz * s.zy * y - g * s.sz * z, xy + gz * s.zy * x, xz + g * s.sz * x),
        (xy + gz * s.zx * y, yy + turn - g * s.sz * z - gz * s.zx * x, yz + g * s.sz * y),
        (xz + g * s.sx * z, yz + g * s.sy * z, zz + turn - g * (s.sx * x + s.sy * y)),
    )


@kernel
def _solve(rows: _Rows, h: Vector) -> Vector:
    """Return the solution of three linear equations (Cramer's rule)."""
    a, b, c = rows
    bc = cross(b, c)
    det = dot(a, bc)
    ca, ab = cross(c, a), cross(a, b)
    return (
        (bc[0] * h[0] + ca[0] * h[1] + ab[0] * h[2]) / det,
        (bc[1] * h[0] + ca[1] * h[1] + ab[1] * h[2]) / det,
        (bc[2] * h[0] + ca[2] * h[1] + ab[2] * h[2]) / det,
    )


@kernel
def _world_inertia(body: Record, motion: Motion) -> _Rows:
    """Return R I R^T, the link's inertia about its centre of mass in world axes."""
    b = body.inertia
    i = (b[0], b[3], b[4]), (b[3], b[1], b[5]), (b[4], b[5], b[2])
    x, y, z = motion[3:6], motion[6:9], motion[9:12]
    iy, iz = _times(i, y), _times(i, z)
    xy, xz, yz = dot(x, iy), dot(x, iz), dot(y, iz)
    return (dot(x, _times(i, x)), xy, xz), (xy, dot(y, iy), yz), (xz, yz, dot(z, iz))


@kernel
def _times(rows: _Rows, v: Vector) -> Vector:
    """Return the product of a matrix and a vector."""
    return dot(rows[0], v), dot(rows[1], v), dot(rows[2], v)


@kernel
def follow(follower: Record, waypoints: Table, state: Record, com: Vector, body: Motion) -> Wrench:
    """Return what drives a follower toward its waypoint: world axes, about its centre of mass `com` [m, body axes].

    In the step in which it reaches a waypoint nothing drives it; from then on it is bound for the next one. At the last
    one of an open path it rests, and comes back when it drifts off.
    """
    goal = waypoints[follower.waypoint_start + state.target].position
    rise = 0.0 if follower.turns_first != 0 else -body.z
    ahead, left, up = unrotate(body, (goal[0] - body.x, goal[1] - body.y, rise))
    if ahead * ahead + left * left + up * up <= follower.reach * follower.reach:
        state.target = _next(follower, state.target)
        return zero_wrench()
    bearing = math.atan2(left, ahead)
    off = abs(bearing) > follower.tolerance
    force = 0.0 if off and follower.turns_first != 0 else follower.force
    torque = math.copysign(follower.torque, bearing) if off else 0.0
    return rotated_wrench(body, Wrench(force, 0.0, 0.0, 0.0, -com[2] * force, com[1] * force + torque))


@kernel
def _next(follower: Record, target: int) -> int:
    """Return the waypoint after `target`; the last one's is the first, or itself on an open path."""
    if target + 1 < follower.waypoint_count:
        return target + 1
    return 0 if follower.loop != 0 else target
