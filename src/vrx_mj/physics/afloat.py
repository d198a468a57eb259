"""Floating objects in water that moves: buoyancy square to the surface, and drag on the velocity through the water.

The water around a small body presses as if it were at rest in a frame that falls with it: with the acceleration a of
the water, by Euler's equation, its pressure falls along a - g, with g downward. So the body floats as in still water
whose plane is square to that apparent gravity and goes through the surface above the body; in linear waves that is the
surface's own plane. `flotation` computes there, in axes that are turned accordingly, with the water's velocity taken
off; its result is turned back.

A mooring is a rope to an anchor, which pulls beyond its length.
"""

import math

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.flotation import Flotation, flotation_under
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.kinematics import Orbital
from vrx_mj.physics.motion import (
    Motion,
    Vector,
    Wrench,
    dot,
    motion_at_rest,
    place_of,
    plus,
    relative_motion,
    rotate,
    rotated_wrench,
    spin_of,
    unrotate,
    velocity_of,
    zero_vector,
    zero_wrench,
)  # fmt: skip
from vrx_mj.physics.tables import Record, Table


@kernel
def apparent_gravity(gravity: float, water: Orbital) -> Vector:
    """Return the vector against which still water would press as the moving water does [m/s2], world axes: upward."""
    return water.du, water.dv, max(gravity + water.dw, 0.1 * gravity)


@kernel
def _level_axes(up: Vector) -> Motion:
    """Return axes at rest whose z is `up`, which is above the horizon, turned from the world's as little as can be."""
    length = math.sqrt(dot(up, up))
    x, y, z = up[0] / length, up[1] / length, up[2] / length
    share = 1.0 / (1.0 + z)
    cross = -share * x * y
    rows = (1.0 - share * x * x, cross, x, cross, 1.0 - share * y * y, y, -x, -y, z)
    return motion_at_rest(zero_vector(), rows)


@kernel
def _seen_from(axes: Motion, m: Motion, height: float) -> Motion:
    """Return a motion in level axes whose origin is on the surface, `height` [m] high, above the link's."""
    a = unrotate(axes, (m.r00, m.r10, m.r20))
    b = unrotate(axes, (m.r01, m.r11, m.r21))
    c = unrotate(axes, (m.r02, m.r12, m.r22))
    place = unrotate(axes, (0.0, 0.0, m.z - height))
    return Motion(*place, a[0], b[0], c[0], a[1], b[1], c[1], a[2], b[2], c[2], *m[12:])


@kernel
def flotation_in_waves(
    body: Record, elements: Table, motion: Motion, height: float, stream: Vector, water: Orbital, dt: float,
    external: Wrench,
) -> Flotation:  # fmt: skip
    """Return buoyancy and drag at the end of a step: world axes, about the link's centre of mass, without weight.

    Args:
        body: a row of `tables.FLOAT`.
        elements: `tables.ELEMENT`.
        motion: of the link.
        height: of the surface at the link's origin [m].
        stream: the current there [m/s], world axes.
        water: how the waves move the water there.
        dt: step [s].
        external: every other wrench on the link but weight, world axes about its centre of mass.
    """
    up = apparent_gravity(body.gravity, water)
    axes = _level_axes(up)
    level = _seen_from(axes, relative_motion(motion, plus(stream, water[:3])), height)
    weight = body.mass * body.gravity
    fx, fy, fz = plus(unrotate(axes, external[:3]), unrotate(axes, (0.0, 0.0, -weight)))
    beside = Wrench(fx, fy, fz + weight, *unrotate(axes, external[3:]))
    found = flotation_under(math.sqrt(dot(up, up)), body, elements, None, level, 0.0, 0.0, dt, beside)
    wrench, acceleration = rotated_wrench(axes, found.wrench), rotate(axes, found.acceleration)
    return Flotation(wrench, found.sums, acceleration, rotate(axes, found.turning))


@kernel
def rope_pull(rope: Record, body: Record, motion: Motion, dt: float, damping: FloatArray) -> Wrench:
    """Return the pull of a rope on what floats [N], world axes, about its centre of mass, at which it holds it.

    It counts on the horizontal plane, and within its length it is slack. Stretched by d it pulls with
    s d + (c + dt s) d', and `damping[0]` gets dt (c + dt s) [kg] for the inertia, as for drag: so a stiff rope is
    stable on a light buoy.
    """
    lever, place = rotate(motion, body.com), place_of(motion, body.com)
    x, y = place[0] - rope.anchor[0], place[1] - rope.anchor[1]
    distance = math.sqrt(x * x + y * y)
    if distance <= rope.length:
        return zero_wrench()
    x, y = x / distance, y / distance
    velocity, spin = rotate(motion, velocity_of(motion)), rotate(motion, spin_of(motion))
    east = velocity[0] + spin[1] * lever[2] - spin[2] * lever[1]
    north = velocity[1] + spin[2] * lever[0] - spin[0] * lever[2]
    resistance = rope.damping + dt * rope.stiffness
    force = -rope.stiffness * (distance - rope.length) - resistance * (x * east + y * north)
    damping[0] += dt * resistance
    force = min(force, 0.0)
    return Wrench(force * x, force * y, 0.0, 0.0, 0.0, 0.0)
