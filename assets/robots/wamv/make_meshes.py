"""Makes the WAM-V's meshes, `meshes/*.obj`, one file for each colour: `python make_meshes.py`.

Their colours are in `meshes/wamv.mtl`, for RViz, and in the xacro files.

Frame of hulls, trim, arches, deck and batteries: base_link (x forward, y to port, z up, at keel level); of
the engine: its steering hinge; of the propeller: its hub; of anything else: that of its link. Lengths in m. The
shapes are drawn from scratch after the dimensions of the WAM-V 16 and the bounding boxes of VRX's meshes. Every
part is a closed surface.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
import trimesh
from trimesh import Trimesh

Array = npt.NDArray[np.float64]
Vector = Sequence[float] | Array

MATERIALS = "wamv.mtl"
HULL_Y, HULL_Z, HULL_RADIUS = 1.03, 0.215, 0.205
"""Axis and radius of a hull where it is straight."""
BOW_START, BOW_END, BOW_RISE, BOW_TAPER = 1.05, 2.493, 0.335, 0.715
"""Where the bow begins to turn up, where its round nose is centred, its rise, its share of lost radius."""
STERN = -2.28
"""Aftmost point of the inflated hull."""
FRONT_ARCH = (
    (0.87, 1.03, 0.76),
    (0.895, 1.005, 0.88),
    (0.9, 0.86, 1.06),
    (0.89, 0.68, 1.16),
    (0.86, 0.46, 1.195),
    (0.86, 0.0, 1.2),
)
"""Points along the port half of the front arch, from the spring's arm to amidships."""
REAR_ARCH = tuple(
    (
        (foot, 1.03, 0.47),
        (low, 1.022, 0.72),
        (high, 0.955, 0.95),
        (shoulder, 0.775, 1.12),
        (deck_edge, 0.5, 1.185),
        (deck_edge, 0.0, 1.19),
    )
    for foot, low, high, shoulder, deck_edge in (
        (-0.70, -0.65, -0.585, -0.55, -0.53),
        (-0.71, -0.745, -0.78, -0.81, -0.83),
    )
)
"""The same for the two legs of the rear arch, from the ball joint."""
COWL = ((0.03, 0.20, 0.086), (0.045, 0.30, 0.126), (0.075, 0.345, 0.15), (0.125, 0.351, 0.156),
        (0.16, 0.325, 0.142), (0.18, 0.25, 0.105), (0.186, 0.12, 0.05))  # fmt: skip
"""Height, length and width of the engine's cowl."""
GEAR_CASE = ((-0.275, 0.040), (-0.25, 0.046), (-0.16, 0.05), (-0.09, 0.044), (-0.055, 0.030), (-0.035, 0.010))
HUB = ((0.0, 0.040), (-0.04, 0.042), (-0.11, 0.036), (-0.145, 0.024), (-0.162, 0.010), (-0.167, 0.003))
"""Profiles of gear case and propeller hub: x, radius."""
BLADE = ((0.03, 0.085, 0.016), (0.07, 0.115, 0.013), (0.12, 0.14, 0.010), (0.17, 0.135, 0.007),
         (0.21, 0.095, 0.005), (0.231, 0.03, 0.003))  # fmt: skip
"""Radius, chord and thickness of a propeller blade."""
BLADE_PITCH = 0.28
"""Advance in one turn."""
SMOOTH = math.radians(40.0)
"""Edges sharper than this stay sharp when the surface is shaded."""


# Solids


def loft(rings: Array) -> Trimesh:
    """Closed surface over `rings` (m, n, 3): m loops of n points each, with flat or domed ends."""
    count, size, _ = rings.shape
    points = np.vstack([rings.reshape(-1, 3), rings[0].mean(axis=0), rings[-1].mean(axis=0)])
    first, last = count * size, count * size + 1
    faces = []
    for i in range(size):
        j = (i + 1) % size
        faces += [(first, j, i), (last, (count - 1) * size + i, (count - 1) * size + j)]
        for row in range(0, (count - 1) * size, size):
            faces += [(row + i, row + j, row + size + j), (row + i, row + size + j, row + size + i)]
    return outward(Trimesh(points, np.array(faces), process=False))


def outward(mesh: Trimesh) -> Trimesh:
    """The mesh with its faces looking out."""
    if mesh.volume < 0.0:
        mesh.invert()
    return mesh


def box(size: Vector, center: Vector, bevel: float = 0.0, pitch: float = 0.0) -> Trimesh:
    """Box of edges `size`, its edges cut off by `bevel`, turned about y by `pitch` (positive: nose down)."""
    x, y, z = (edge / 2.0 for edge in size)
    inset = [bevel, 0.0, 0.0, bevel] if bevel else [0.0, 0.0]
    heights = [-z, bevel - z, z - bevel, z] if bevel else [-z, z]
    rings = np.array([rectangle(x - cut, y - cut, bevel, h) for cut, h in zip(inset, heights, strict=True)])
    cos, sin = math.cos(pitch), math.sin(pitch)
    return loft(rings @ np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]]).T + np.array(center))


def rectangle(x: float, y: float, cut: float, z: float) -> Array:
    """Rectangle of half edges x, y at height z, with cut corners where `cut` is positive."""
    if not cut:
        return np.array([(x, y, z), (-x, y, z), (-x, -y, z), (x, -y, z)])
    a, b = x - cut, y - cut
    port = [(x, b, z), (a, y, z), (-a, y, z), (-x, b, z)]
    return np.array([*port, *((-px, -py, pz) for px, py, pz in port)])


def circle(sides: int, start: float = 0.0, stop: float = 2.0 * math.pi) -> Array:
    """Unit vectors (sides, 2) at even angles from `start` up to, not including, `stop` [rad]."""
    angle = start + (stop - start) * np.arange(sides) / sides
    return np.round(np.column_stack([np.cos(angle), np.sin(angle)]), 12)  # the same on every CPU


def tube(path: Array, radius: float | Array, sides: int = 12) -> Trimesh:
    """Round tube along `path` (m, 3)."""
    radii = np.broadcast_to(np.asarray(radius, dtype=np.float64), len(path))
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side = np.cross(tangent[0], (0.0, 0.0, 1.0) if abs(tangent[0][2]) < 0.8 else (1.0, 0.0, 0.0))
    rings = []
    for point, ahead, r in zip(path, tangent, radii, strict=True):
        side = side - ahead * (side @ ahead)
        side /= np.linalg.norm(side)
        rings.append(point + r * circle(sides) @ np.array([side, np.cross(ahead, side)]))
    return loft(np.array(rings))


def rod(start: Vector, end: Vector, radius: float, sides: int = 12) -> Trimesh:
    """Straight round rod."""
    return tube(np.array([start, end], dtype=np.float64), radius, sides)


def turned(profile: Sequence[tuple[float, float]], center: Vector, axis: str = "x", sides: int = 14) -> Trimesh:
    """Body of revolution about the x or z axis through `center`; profile: (place along the axis, radius)."""
    ring = circle(sides)
    rings = np.array([np.column_stack([np.full(sides, place), radius * ring]) for place, radius in profile])
    return loft((rings if axis == "x" else rings[:, :, [1, 2, 0]]) + np.array(center))


def curve(points: Sequence[Vector], steps: int = 6) -> Array:
    """Smooth path through `points` (Catmull-Rom), `steps` pieces between two of them."""
    knots = np.array([points[0], *points, points[-1]], dtype=np.float64)
    t = (np.arange(steps) / steps)[:, None]
    pieces = [
        b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))
        for a, b, c, d in zip(knots, knots[1:], knots[2:], knots[3:], strict=False)
    ]
    return np.vstack([*pieces, knots[-1:]])


def wing(sections: Iterable[tuple[Vector, float, float]], sides: int = 10) -> Trimesh:
    """Streamlined strut; sections: centre, chord along x, thickness along y, each level."""
    ring = circle(sides)
    return loft(np.array([np.array(at) + ring * (c / 2, t / 2) @ np.eye(2, 3) for at, c, t in sections]))


def both_sides(parts: Iterable[Trimesh]) -> list[Trimesh]:
    """The parts and their mirror images across the plane y = 0."""
    port = list(parts)
    mirror = [outward(Trimesh(part.vertices * (1.0, -1.0, 1.0), part.faces, process=False)) for part in port]
    return port + mirror


# The boat


def hull_axis(x: Array) -> tuple[Array, Array]:
    """Centre line (m, 3) and radius (m,) of the port hull at stations `x`."""
    t = np.clip((x - BOW_START) / (BOW_END - BOW_START), 0.0, None)
    line = np.column_stack([x, np.full_like(x, HULL_Y), HULL_Z + BOW_RISE * t**2])
    radius = HULL_RADIUS * (1.0 - BOW_TAPER * np.clip(t, 0.0, 1.0) ** 2.1)
    nose = np.clip((x - BOW_END) / 0.055, 0.0, 1.0)
    stern = np.clip((STERN + 0.16 - x) / 0.16, 0.0, 1.0)
    return line, radius * np.sqrt(1.0 - 0.97 * nose**2) * (1.0 - 0.35 * stern**2.5)


def hull() -> Trimesh:
    """The port hull's skin."""
    stern = STERN + np.array([0.0, 0.03, 0.08, 0.16])
    bow = np.linspace(BOW_START, BOW_END, 12)
    nose = BOW_END + np.array([0.02, 0.038, 0.05])
    line, radius = hull_axis(np.concatenate([stern, [-1.0, 0.0], bow, nose]))
    return tube(line, radius, sides=20)


def water_hull() -> Trimesh:
    """The port hull for water pressure: few faces, most of them below; its sections have the area of the round ones."""
    straight = np.linspace(STERN + 0.16, BOW_START, 7)
    bow = np.linspace(BOW_START, BOW_END, 5)[1:]
    line, radius = hull_axis(np.concatenate([[STERN], straight, bow, [BOW_END + 0.05]]))
    below, above = 6, 3
    lower = math.sqrt(math.pi / (below * math.sin(math.pi / below)))
    wedge = math.sin(math.pi / above)
    upper = (math.sqrt(lower**2 + (above - 2) * math.pi / wedge) - lower) / (above - 2)
    circles = circle(below, math.pi), circle(above, stop=math.pi)
    section = np.vstack([lower * circles[0], lower * circles[1][:1], upper * circles[1][1:]])
    return outward(loft(np.array([at + r * section @ np.eye(3)[1:] for at, r in zip(line, radius, strict=True)])))


def sleeve(start: float, stop: float, swell: float, pieces: int) -> Trimesh:
    """A ring of cloth around the port hull, `swell` thick."""
    line, radius = hull_axis(np.linspace(start, stop, pieces + 1))
    return tube(line, radius + swell, sides=20)


def strip(angle: float, half_width: float, swell: float, start: float, stop: float) -> Trimesh:
    """A strip along the port hull's skin; angle about the axis: 0 outboard, -pi/2 at the keel."""
    line, radius = hull_axis(np.concatenate([[start], np.linspace(BOW_START, stop, 10)]))
    slope = np.gradient(line[:, 2], line[:, 0])
    arc = circle(3, angle - half_width, angle + 2 * half_width)
    rings = []
    for point, r, rise in zip(line, radius, slope, strict=True):
        up = np.array([-rise, 0.0, 1.0]) / math.hypot(1.0, rise)
        shell = np.vstack([(r + swell) * arc, (r - 0.012) * arc[::-1]])
        rings.append(point + shell @ np.array([(0.0, 1.0, 0.0), up]))
    return loft(np.array(rings))


def trim() -> list[Trimesh]:
    """Dark fittings of the hulls: nose caps, wear strips, saddles, top tracks and the motor brackets."""
    top = HULL_Z + HULL_RADIUS
    parts = [nose_cap(), strip(-math.pi / 2, 0.32, 0.004, -2.1, 2.3)]
    parts += [strip(side, 0.06, 0.009, -2.15, 2.36) for side in (0.0, math.pi)]
    parts += [sleeve(x - 0.05, x + 0.05, 0.004, 1) for x in (-1.55, -0.706, 0.36)]
    parts += [box((0.9, 0.15, 0.03), (x, HULL_Y, top + 0.002), 0.01) for x in (-1.55, 0.62)]
    parts += [box((0.95, 0.30, 0.035), (-0.30, HULL_Y, top + 0.006), 0.012)]
    return parts + motor_bracket()


def nose_cap() -> Trimesh:
    """The dark cap on the port bow."""
    nose = BOW_END + np.array([0.02, 0.038, 0.05, 0.0545])
    stations = np.concatenate([[2.30], np.linspace(2.36, BOW_END, 3), nose])
    line, radius = hull_axis(stations)
    return tube(line, radius + 0.004 * (stations < BOW_END + 0.03) + 0.0015, sides=20)


def motor_bracket() -> list[Trimesh]:
    """Cheeks and transom behind the port hull, which carry an engine."""
    cheeks = [box((0.46, 0.024, 0.13), (-2.226, HULL_Y + y, 0.355), 0.008) for y in (-0.13, 0.13)]
    feet = [box((0.06, 0.03, 0.26), (-2.40, HULL_Y + y, 0.27)) for y in (-0.128, 0.128)]
    plate = box((0.035, 0.25, 0.24), (-2.391, HULL_Y, 0.30))
    back = box((0.06, 0.29, 0.03), (-2.19, HULL_Y, 0.415))
    return [*cheeks, *feet, plate, back]


def arches() -> list[Trimesh]:
    """The arches from ball joint or spring to deck, the springs' arms and the frame under the deck."""
    tubes = [tube(curve(FRONT_ARCH, 3), 0.04, 10)] + [tube(curve(leg, 3), 0.03, 8) for leg in REAR_ARCH]
    arm = [box((0.66, 0.035, 0.075), (0.59, HULL_Y + y, 0.60), 0.012, pitch=-0.6) for y in (-0.075, 0.075)]
    pins = ((0.345, 0.437, 0.11, 0.028), (0.865, 0.775, 0.11, 0.028), (0.56, 0.58, 0.08, 0.02))
    arm += [rod((x, HULL_Y - half, z), (x, HULL_Y + half, z), r) for x, z, half, r in pins]
    brace = [rod((-0.79, 0.93, 0.985), (-0.585, 0.93, 0.985), 0.018)]
    rails = [box((1.72, 0.05, 0.05), (0.0, 0.42, 1.205), 0.012)]
    return tubes + arm + brace + rails


def deck() -> list[Trimesh]:
    """Payload tray with panels and rim; bright metal of the ball joints and springs."""
    tray = [box((1.83, 0.98, 0.055), (0.0, 0.0, 1.2475), 0.012)]
    tray += [box((0.585, 0.45, 0.016), (x, y, 1.2805)) for x in (-0.6, 0.0, 0.6) for y in (-0.235, 0.235)]
    tray += [box((1.80, 0.034, 0.083), (0.0, y, 1.2545), 0.01) for y in (-0.483, 0.483)]
    tray += [box((0.034, 1.0, 0.085), (x, 0.0, 1.2545), 0.01) for x in (-0.908, 0.908)]
    return tray + both_sides([*ball_joint(), *spring()])


def ball_joint() -> list[Trimesh]:
    """The joint on which the rear arch stands."""
    ball = [(0.062 * math.sin(a), 0.062 * math.cos(a)) for a in np.radians([-12, 12, 36, 60, 84])]
    cup = [(-0.05, 0.11), (-0.03, 0.11), (-0.005, 0.07), (0.012, 0.07)]
    return [turned(ball, (-0.706, HULL_Y, 0.49), "z"), turned(cup, (-0.706, HULL_Y, 0.468), "z")]


def spring() -> list[Trimesh]:
    """Coil spring and damper under the arm of the front arch."""
    low, high = np.array([0.93, HULL_Y, 0.425]), np.array([0.80, HULL_Y, 0.75])
    turns, per_turn = 5, 8
    t = np.arange(turns * per_turn + 1) / (turns * per_turn)
    along = (high - low) / np.linalg.norm(high - low)
    across, aside = np.cross(along, (0.0, 1.0, 0.0)), np.array([0.0, 1.0, 0.0])
    angle = 2.0 * math.pi * turns * t[:, None]
    around = 0.042 * (np.cos(angle) * across + np.sin(angle) * aside)
    coil = low + (0.08 + 0.84 * t[:, None]) * (high - low) + around
    seats = [rod(low + s * (high - low), low + (s + 0.04) * (high - low), 0.055) for s in (0.04, 0.92)]
    eye = rod(low - 0.06 * aside, low + 0.06 * aside, 0.03)
    return [tube(coil, 0.009, 4), rod(low, high, 0.022), eye, *seats]


def batteries() -> list[Trimesh]:
    """A case on each hull, in a frame of feet, with lid, ribs, handles and latches."""
    case = [box((0.605, 0.388, 0.225), (-0.0255, 1.027, 0.5725), 0.02)]
    case += [box((0.625, 0.408, 0.075), (-0.0255, 1.027, 0.7145), 0.018)]
    case += [box((0.56, 0.343, 0.02), (-0.0255, 1.027, 0.757), 0.008)]
    case += [box((0.035, 0.398, 0.215), (x, 1.027, 0.57)) for x in (-0.24, -0.0255, 0.19)]
    case += [box((0.56, 0.05, 0.045), (-0.0255, y, 0.4615)) for y in (0.90, 1.154)]
    case += [box((0.05, 0.018, 0.085), (x, 1.222, 0.69)) for x in (-0.17, 0.12)]
    return both_sides(case)


def engine() -> list[Trimesh]:
    """Electric outboard: clamp, cowl, leg, anti-ventilation plate, gear case and skeg."""
    aft = -0.2355
    cowl = wing([((aft - 0.55 * max(z - 0.15, 0.0), 0.0, z), c, t) for z, c, t in COWL], 16)
    shaft = [(-0.16, 0.04, 0.15, 0.075), (-0.16, -0.10, 0.14, 0.062), (-0.165, -0.30, 0.13, 0.05)]
    leg = wing([((x, 0, z), c, t) for x, z, c, t in [*shaft, (-0.165, -0.50, 0.14, 0.045)]], 12)
    plate = wing([((-0.19, 0, -0.335), 0.27, 0.13), ((-0.19, 0, -0.323), 0.28, 0.14)], 16)
    case = turned(GEAR_CASE, (0.0, 0.0, -0.509371))
    fin = [(-0.18, -0.53, 0.14, 0.018), (-0.20, -0.66, 0.075, 0.012), (-0.215, -0.72, 0.03, 0.008)]
    skeg = wing([((x, 0, z), c, t) for x, z, c, t in fin], 10)
    return [cowl, leg, plate, case, skeg, *clamp()]


def clamp() -> list[Trimesh]:
    """What holds the engine on the transom and lets it turn."""
    jaws = [box((0.024, 0.13, 0.2), (x, 0, 0.02)) for x in (0.02, -0.055)]
    swivel = rod((-0.095, 0, -0.16), (-0.095, 0, 0.08), 0.036)
    screws = [rod((0.0, y, -0.03), (0.03, y, -0.03), 0.018, 8) for y in (-0.04, 0.04)]
    return [box((0.055, 0.13, 0.05), (-0.02, 0, 0.11)), *jaws, swivel, *screws]


def propeller() -> list[Trimesh]:
    """Three twisted blades on a hub that tapers aft."""
    hub = turned(HUB, (0, 0, 0), sides=12)
    return [hub, *(blade(math.pi / 2 + 2.0 * math.pi * i / 3) for i in range(3))]


def blade(angle: float) -> Trimesh:
    """A blade whose span points to `angle` [rad] in the y-z plane, from 0 at port."""
    out = np.array([0.0, math.cos(angle), math.sin(angle)])
    ahead = np.array([1.0, 0.0, 0.0])
    rings = []
    for r, chord, thickness in BLADE:
        slope = math.atan2(BLADE_PITCH / (2.0 * math.pi), r)
        along = math.cos(slope) * np.cross(ahead, out) + math.sin(slope) * ahead
        section = circle(8) * (chord / 2, thickness / 2) @ np.array([along, np.cross(out, along)])
        rings.append(r * out - 0.075 * ahead + section)
    return loft(np.array(rings))


def battery() -> list[Trimesh]:
    """The port battery's case in its own frame: the middle of its foot."""
    case = batteries()
    return [part.apply_translation((0.0, -1.0, -0.45)) for part in case[: len(case) // 2]]


# What it carries, each in the frame of its own link


def cpu_cases() -> list[Trimesh]:
    """Two transit cases on deck; the larger forward, its lid parted from its base."""
    large, small = (0.185, 0.0), (-0.3, 0.0)
    case = [box((0.595, 0.83, 0.31), (*large, -0.078), 0.02), box((0.595, 0.83, 0.145), (*large, 0.1575), 0.02)]
    case += [box((0.57, 0.805, 0.02), (*large, 0.08))]
    case += [box((0.03, 0.845, 0.43), (x, 0.0, 0.0), 0.006) for x in (-0.02, 0.39)]
    case += [box((0.375, 0.64, 0.19), (*small, -0.137), 0.015), box((0.375, 0.64, 0.075), (*small, 0.0105), 0.015)]
    case += [box((0.355, 0.62, 0.02), (*small, -0.035))]
    return case


def cpu_fittings() -> list[Trimesh]:
    """Latches, handles, connectors and the vent of the cases."""
    latches = [box((0.05, 0.014, 0.07), (x, y, 0.075), 0.004) for x in (0.06, 0.31) for y in (-0.419, 0.419)]
    latches += [box((0.05, 0.014, 0.06), (-0.3, y, -0.035), 0.004) for y in (-0.324, 0.324)]
    handles = [
        tube(
            curve([(0.11, y, -0.06), (0.11, 1.055 * y, -0.065), (0.26, 1.055 * y, -0.065), (0.26, y, -0.06)], 2),
            0.009,
            8,
        )
        for y in (-0.418, 0.418)
    ]
    plugs = [rod((-0.485, y, -0.12), (-0.515, y, -0.12), 0.018, 10) for y in (-0.18, -0.06, 0.06, 0.18)]
    vent = [box((0.012, 0.16, 0.012), (0.484, 0.0, z)) for z in (-0.12, -0.09, -0.06, -0.03)]
    return [*latches, *handles, *plugs, *vent]


def post_arm() -> list[Trimesh]:
    """The arm from the top of a post to below a sensor, with the plate and the stud that carry it."""
    bend = curve([(-0.03, 0.0, -0.012), (-0.03, 0.0, -0.003), (-0.022, 0.0, 0.0), (0.032, 0.0, 0.0)], 3)
    plate = box((0.032, 0.024, 0.003), (0.012, 0.0, 0.006), 0.001)
    return [tube(bend, 0.0065, 10), plate, rod((0.028, 0.0, 0.003), (0.028, 0.0, 0.0126), 0.009, 12)]


def camera() -> list[Trimesh]:
    """Body, cooling ribs, foot, barrel and lens ring; it looks along x."""
    body = [box((0.036, 0.03, 0.03), (-0.0205, 0.0, 0.0), 0.003)]
    ribs = [box((0.003, 0.032, 0.032), (x, 0.0, 0.0)) for x in (-0.030, -0.0235, -0.017, -0.0105)]
    foot = box((0.03, 0.018, 0.006), (-0.014, 0.0, -0.0165), 0.001)
    barrel = [(-0.003, 0.0125), (0.018, 0.0125), (0.0185, 0.0145), (0.0375, 0.0145), (0.0385, 0.0125)]
    return [*body, *ribs, foot, turned(barrel, (0.0, 0.0, 0.0), sides=20)]


def lidar() -> list[Trimesh]:
    """Base, dark window's core and lid of a spinning lidar, and the socket of its cable."""
    body = [(-0.0375, 0.044), (-0.034, 0.052), (-0.010, 0.052), (-0.009, 0.0495), (0.021, 0.0495), (0.022, 0.052),
            (0.032, 0.052), (0.0365, 0.046), (0.0375, 0.03)]  # fmt: skip
    socket = rod((-0.05, 0.0, -0.024), (-0.062, 0.0, -0.024), 0.008, 8)
    return [turned(body, (0.0, 0.0, 0.0), "z", 28), socket]


def gps() -> list[Trimesh]:
    """Mushroom antenna on a short mast."""
    mast = [(0.0, 0.034), (0.006, 0.034), (0.008, 0.015), (0.058, 0.015), (0.062, 0.045)]
    dome = [(0.060, 0.040), (0.062, 0.125), (0.070, 0.148), (0.086, 0.154), (0.104, 0.148), (0.126, 0.126),
            (0.145, 0.092), (0.158, 0.052), (0.164, 0.015)]  # fmt: skip
    return [turned(mast, (0.0, 0.0, 0.0), "z", 16), turned(dome, (0.0, 0.0, 0.0), "z", 28)]


def shooter_base() -> list[Trimesh]:
    """Foot and the two cheeks that hold the launcher's axle."""
    foot = box((0.07, 0.12, 0.008), (-0.011, 0.0, 0.004), 0.002)
    cheeks = [box((0.05, 0.006, 0.112), (-0.0204, y, 0.063), 0.001) for y in (-0.056, 0.056)]
    bolts = [rod((-0.0204, 0.051 * side, 0.107877), (-0.0204, 0.0605 * side, 0.107877), 0.009, 10) for side in (-1, 1)]
    return [foot, *cheeks, *bolts]


def shooter_launcher() -> list[Trimesh]:
    """Barrel along x with its rings, wheel housings at the breech and a hopper for four balls."""
    barrel = [
        (-0.085, 0.030),
        (-0.084, 0.037),
        (0.094, 0.037),
        (0.096, 0.042),
        (0.106, 0.042),
        (0.106, 0.0325),
        (0.0, 0.03),
    ]
    wheels = [rod((-0.035, y - 0.009, 0.0), (-0.035, y + 0.009, 0.0), 0.046, 18) for y in (-0.043, 0.043)]
    hopper = [(0.03, 0.032), (0.045, 0.033), (0.060, 0.046), (0.060, 0.041), (0.042, 0.028)]
    axle = rod((0.0, -0.05, 0.0), (0.0, 0.05, 0.0), 0.012, 10)
    return [turned(barrel, (0.0, 0.0, 0.0), sides=20), *wheels, axle, turned(hopper, (-0.035, 0.0, 0.0), "z", 16)]


def hydrophone() -> list[Trimesh]:
    """Receiver of the acoustic beacon: a bulb under a flange, between guard rods."""
    body = [(0.05, 0.02), (0.046, 0.03), (0.034, 0.03), (0.032, 0.018), (0.005, 0.018), (0.0, 0.024), (-0.014, 0.029),
            (-0.03, 0.026), (-0.04, 0.016), (-0.044, 0.004)]  # fmt: skip
    legs = [rod((0.045 * x, 0.045 * y, -0.048), (0.045 * x, 0.045 * y, 0.04), 0.003, 6) for x, y in circle(4)]
    flange = turned([(0.034, 0.049), (0.04, 0.049)], (0.0, 0.0, 0.0), "z", 20)
    return [turned(body[::-1], (0.0, 0.0, 0.0), "z", 16), *legs, flange]


# Files

PARTS: dict[str, Callable[[], list[Trimesh]]] = {
    "hulls": lambda: both_sides([hull()]),
    "water_hulls": lambda: both_sides([water_hull()]),
    "trim": lambda: both_sides(trim()),
    "arches": lambda: both_sides(arches()),
    "deck": deck,
    "batteries": batteries,
    "engine": engine,
    "propeller": propeller,
    "battery": battery,
    "cpu_cases": cpu_cases,
    "cpu_fittings": cpu_fittings,
    "post_arm": post_arm,
    "camera": camera,
    "lidar": lidar,
    "gps": gps,
    "shooter_base": shooter_base,
    "shooter_launcher": shooter_launcher,
    "hydrophone": hydrophone,
}


def corner_normals(points: Array, faces: npt.NDArray[np.int64]) -> Array:
    """Normals (m, 3, 3) at the corners of faces: the mean, by area, of those that meet there smoothly."""
    area = np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
    unit = area / np.maximum(np.linalg.norm(area, axis=1, keepdims=True), 1e-12)
    around: list[list[int]] = [[] for _ in points]
    for face, corners in enumerate(faces):
        for corner in corners:
            around[corner].append(face)
    normals = np.empty((len(faces), 3, 3))
    for face, corners in enumerate(faces):
        for k, corner in enumerate(corners):
            near = np.array(around[corner])
            smooth = area[near[unit[near] @ unit[face] > math.cos(SMOOTH)]].sum(axis=0)
            normals[face, k] = smooth / np.linalg.norm(smooth)
    return normals


def obj_text(parts: Sequence[Trimesh], material: str = "") -> str:
    """The parts as one Wavefront OBJ, coordinates to 0.1 mm; `material` is one of `wamv.mtl`."""
    mesh = trimesh.util.concatenate(parts)
    faces = np.asarray(mesh.faces)
    normals = np.round(corner_normals(mesh.vertices, faces), 3) + 0.0
    unique, index = np.unique(normals.reshape(-1, 3), axis=0, return_inverse=True)
    lines = [f"mtllib {MATERIALS}", f"usemtl {material}"] if material else []
    lines += ["v " + " ".join(f"{x:.4f}".replace("-0.0000", "0.0000") for x in v) for v in mesh.vertices]
    lines += ["vn " + " ".join(f"{x:.3f}" for x in n) for n in unique]
    for corners, directions in zip(faces + 1, index.reshape(-1, 3) + 1, strict=True):
        lines.append("f " + " ".join(f"{v}//{n}" for v, n in zip(corners, directions, strict=True)))
    return "\n".join(lines) + "\n"


def write_meshes(folder: Path) -> None:
    """Write every part into `folder`; those that are drawn have a material."""
    folder.mkdir(parents=True, exist_ok=True)
    known = (Path(__file__).parent / "meshes" / MATERIALS).read_text(encoding="utf-8").split()
    for name, parts in PARTS.items():
        material = name if name in known else ""
        (folder / f"{name}.obj").write_text(obj_text(parts(), material), encoding="utf-8", newline="\n")


if __name__ == "__main__":
    write_meshes(Path(__file__).parent / "meshes")
