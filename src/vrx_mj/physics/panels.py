"""Pressure on a hull's surface: its mesh in water, whatever its shape and pose.

The surface is triangles, seen from outside counter-clockwise. A pressure is given at every vertex and is linear
between; where it is below zero the hull is dry. Force and torque of a linear pressure on the wet part of each triangle
are exact, so still water's on a mesh of flat faces are exact however it lies.
"""

from vrx_mj.arrays import FloatArray, IntArray
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Vector, Wrench

__all__ = ["panel_wrench", "still_pressures"]


@kernel
def _triangle(a: Vector, b: Vector, c: Vector, p: float, q: float, r: float) -> Wrench:
    """Return the wrench about the origin of pressures p, q, r [Pa] at the corners of a triangle that is all wet."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    nx, ny, nz = 0.5 * (uy * vz - uz * vy), 0.5 * (uz * vx - ux * vz), 0.5 * (ux * vy - uy * vx)
    total = p + q + r
    mean = total / 3.0
    mx = (total * (a[0] + b[0] + c[0]) + p * a[0] + q * b[0] + r * c[0]) / 12.0
    my = (total * (a[1] + b[1] + c[1]) + p * a[1] + q * b[1] + r * c[1]) / 12.0
    mz = (total * (a[2] + b[2] + c[2]) + p * a[2] + q * b[2] + r * c[2]) / 12.0
    return Wrench(
        -mean * nx, -mean * ny, -mean * nz, mz * ny - my * nz, mx * nz - mz * nx, my * nx - mx * ny
    )  # fmt: skip


@kernel
def _between(a: Vector, b: Vector, share: float) -> Vector:
    return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2])


@kernel
def _sum(one: Wrench, other: Wrench) -> Wrench:
    return Wrench(
        one.fx + other.fx, one.fy + other.fy, one.fz + other.fz,
        one.tx + other.tx, one.ty + other.ty, one.tz + other.tz,
    )  # fmt: skip


@kernel
def _one_wet(a: Vector, b: Vector, c: Vector, p: float, q: float, r: float) -> Wrench:
    """Return the wrench on a triangle of which only the corner a is wet."""
    return _triangle(a, _between(a, b, p / (p - q)), _between(a, c, p / (p - r)), p, 0.0, 0.0)


@kernel
def _one_dry(a: Vector, b: Vector, c: Vector, p: float, q: float, r: float) -> Wrench:
    """Return the wrench on a triangle of which only the corner a is dry."""
    to_b, to_c = _between(a, b, p / (p - q)), _between(a, c, p / (p - r))
    return _sum(_triangle(to_b, b, c, 0.0, q, r), _triangle(to_b, c, to_c, 0.0, r, 0.0))


@kernel
def panel_wrench(vertices: FloatArray, triangles: IntArray, pressures: FloatArray) -> Wrench:
    """Return the wrench of the water on a mesh: body axes, about the link's origin.

    Args:
        vertices: (n, 3) [m], body axes.
        triangles: (m, 3).
        pressures: (n,) over the air's [Pa]; below zero: dry.
    """
    total = Wrench(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for i in range(len(triangles)):
        one, two, three = triangles[i, 0], triangles[i, 1], triangles[i, 2]
        p, q, r = pressures[one], pressures[two], pressures[three]
        wet = (p > 0.0) + (q > 0.0) + (r > 0.0)
        if wet == 0:
            continue
        a = vertices[one, 0], vertices[one, 1], vertices[one, 2]
        b = vertices[two, 0], vertices[two, 1], vertices[two, 2]
        c = vertices[three, 0], vertices[three, 1], vertices[three, 2]
        if wet == 3:
            total = _sum(total, _triangle(a, b, c, p, q, r))
        elif wet == 1:
            if p > 0.0:
                total = _sum(total, _one_wet(a, b, c, p, q, r))
            elif q > 0.0:
                total = _sum(total, _one_wet(b, c, a, q, r, p))
            else:
                total = _sum(total, _one_wet(c, a, b, r, p, q))
        elif p <= 0.0:
            total = _sum(total, _one_dry(a, b, c, p, q, r))
        elif q <= 0.0:
            total = _sum(total, _one_dry(b, c, a, q, r, p))
        else:
            total = _sum(total, _one_dry(c, a, b, r, p, q))
    return total


@kernel
def still_pressures(vertices: FloatArray, up: Vector, height: float, weight: float, out: FloatArray) -> None:
    """Write the pressures of still water [Pa] at vertices (n, 3) [m, body axes] into `out`, (n,).

    Args:
        vertices: of the hull.
        up: the vertical, unit vector, body axes.
        height: of the link's origin over the water [m].
        weight: rho g [N/m3].
        out: below zero over the water.
    """
    for i in range(len(vertices)):
        x = vertices[i]
        out[i] = -weight * (height + up[0] * x[0] + up[1] * x[1] + up[2] * x[2])
