"""Wind: gusts about a mean in one direction, and its load on what floats, by areas and coefficients over the angle."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from vrx_mj.arrays import FloatArray
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import (
    Level,
    Motion,
    Wrench,
    from_origin,
    rotate,
    rotated_wrench,
    shift,
    unrotate_level,
    velocity_of,
    zero_wrench,
)
from vrx_mj.physics.noise import normal
from vrx_mj.physics.tables import MARINE, VRX3, Record, Table

AIR_DENSITY = 1.225
"""Density of the air [kg/m3]: ISO 2533, sea level, 15 C."""
_STEPS = 180
"""Number of straight pieces of a curve that a formula gives; they are within 4e-5 of a cosine."""

BLENDERMANN: Mapping[str, tuple[float, float, float, float, float]] = {
    "car_carrier": (0.95, 0.55, 0.60, 0.80, 1.2),
    "cargo_vessel": (0.85, 0.65, 0.55, 0.40, 1.7),
    "cargo_vessel_containers": (0.85, 0.55, 0.50, 0.40, 1.4),
    "container_ship": (0.90, 0.55, 0.55, 0.40, 1.4),
    "destroyer": (0.85, 0.60, 0.65, 0.65, 1.1),
    "diving_support_vessel": (0.90, 0.60, 0.80, 0.55, 1.7),
    "drilling_vessel": (1.00, 0.85, 0.925, 0.10, 1.7),
    "ferry": (0.90, 0.45, 0.50, 0.80, 1.1),
    "fishing_vessel": (0.95, 0.70, 0.70, 0.40, 1.1),
    "lng_tanker": (0.70, 0.60, 0.65, 0.50, 1.1),
    "offshore_supply_vessel": (0.90, 0.55, 0.80, 0.55, 1.2),
    "passenger_liner": (0.90, 0.40, 0.40, 0.80, 1.2),
    "research_vessel": (0.85, 0.55, 0.65, 0.60, 1.4),
    "speed_boat": (0.90, 0.55, 0.60, 0.60, 1.1),
    "tanker_loaded": (0.70, 0.90, 0.55, 0.40, 3.1),
    "tanker_ballast": (0.70, 0.75, 0.55, 0.40, 2.2),
    "tender": (0.85, 0.55, 0.55, 0.65, 1.1),
}
"""Parameters of types of vessels: CD_t, CD_l,AF of wind from ahead and from astern, delta and kappa.

Blendermann (1994), J. Wind Eng. Ind. Aerodyn. 51, 339-351; Fossen (2021), table 10.1."""

_ISHERWOOD = """
0  2.152 -5 0.243 -0.164 0 0 0  0 0 0 0 0 0 0  0 0 0 0 0 0
10  1.714 -3.33 0.145 -0.121 0 0 0  0.096 0.22 0 0 0 0 0  0.0596 0.061 0 0 0 -0.074
20  1.818 -3.97 0.211 -0.143 0 0 0.033  0.176 0.71 0 0 0 0 0  0.1106 0.204 0 0 0 -0.17
30  1.965 -4.81 0.243 -0.154 0 0 0.041  0.225 1.38 0 0.023 0 -0.29 0  0.2258 0.245 0 0 0 -0.38
40  2.333 -5.99 0.247 -0.19 0 0 0.042  0.329 1.82 0 0.043 0 -0.59 0  0.2017 0.457 0 0.0067 0 -0.472
50  1.726 -6.54 0.189 -0.173 0.348 0 0.048  1.164 1.26 0.121 0 -0.242 -0.95 0  0.1759 0.573 0 0.0118 0 -0.523
60  0.913 -4.68 0 -0.104 0.482 0 0.052  1.163 0.96 0.101 0 -0.177 -0.88 0  0.1925 0.48 0 0.0115 0 -0.546
70  0.457 -2.88 0 -0.068 0.346 0 0.043  0.916 0.53 0.069 0 0 -0.65 0  0.2133 0.315 0 0.0081 0 -0.526
80  0.341 -0.91 0 -0.031 0 0 0.032  0.844 0.55 0.082 0 0 -0.54 0  0.1827 0.254 0 0.0053 0 -0.443
90  0.355 0 0 0 -0.247 0 0.018  0.889 0 0.138 0 0 -0.66 0  0.2627 0 0 0 0 -0.508
100  0.601 0 0 0 -0.372 0 -0.02  0.799 0 0.155 0 0 -0.55 0  0.2102 0 -0.0195 0 0.0335 -0.492
110  0.651 1.29 0 0 -0.582 0 -0.031  0.797 0 0.151 0 0 -0.55 0  0.1567 0 -0.0258 0 0.0497 -0.457
120  0.564 2.54 0 0 -0.748 0 -0.024  0.996 0 0.184 0 -0.212 -0.66 0.34  0.0801 0 -0.0311 0 0.074 -0.396
130  -0.142 3.58 0 0.047 -0.7 0 -0.028  1.014 0 0.191 0 -0.28 -0.69 0.44  -0.0189 0 -0.0488 0.0101 0.1128 -0.42
140  -0.677 3.64 0 0.069 -0.529 0 -0.032  0.784 0 0.166 0 -0.209 -0.53 0.38  0.0256 0 -0.0422 0.01 0.0889 -0.463
150  -0.723 3.14 0 0.064 -0.475 0 -0.032  0.536 0 0.176 -0.029 -0.163 0 0.27  0.0552 0 -0.0381 0.0109 0.0689 -0.476
160  -2.148 2.56 0 0.081 0 1.27 -0.027  0.251 0 0.106 -0.022 0 0 0  0.0881 0 -0.0306 0.0091 0.0366 -0.415
170  -2.707 3.97 -0.175 0.126 0 1.81 0  0.125 0 0.046 -0.012 0 0 0  0.0851 0 -0.0122 0.0025 0 -0.22
180  -2.529 3.76 -0.174 0.128 0 1.55 0  0 0 0 0 0 0 0  0 0 0 0 0 0
"""
"""Angles off the bow [degrees], and regression coefficients A0 to A6, B0 to B6 and C0 to C5 of wind on merchant ships.

Isherwood (1972), Wind resistance of merchant ships, Trans. RINA 115, 327-338, table 1."""

_Curve = list[tuple[float, float, float, float, float]]
"""Rows of an angle [rad] and of coefficients of the forces ahead and to lee, of roll, and of the bow's turn to lee."""


class Areas(NamedTuple):
    """Areas of a boat in the wind."""

    frontal: float
    """Area seen from ahead [m2]."""
    lateral: float
    """Area seen from the side [m2]."""
    length: float
    """Length overall [m]."""
    height: float
    """Height of the lateral area's centre [m]."""


class Superstructure(NamedTuple):
    """Inputs of Isherwood's formulas besides the areas."""

    breadth: float
    """Breadth [m]."""
    perimeter: float
    """Length of the outline of the lateral area over the water, without masts [m]."""
    area: float
    """Lateral area of the superstructure [m2]."""
    masts: int
    """Groups of masts seen from the side."""


def _angles() -> list[float]:
    return [math.pi * index / _STEPS for index in range(_STEPS + 1)]


def three_number_curve(cx: float, cy: float, cn: float) -> _Curve:
    """Return CX = -cx cos g, CY = cy sin g, CN = cn sin 2g (Fossen, 2021, 10.1)."""
    return [(g, -cx * math.cos(g), cy * math.sin(g), 1.0, cn * math.sin(2.0 * g)) for g in _angles()]


def blendermann_curve(vessel: Sequence[float], areas: Areas) -> _Curve:
    """Return the coefficients of a type of vessel by Blendermann (1994).

    With CDl = CD_l,AF A_F / A_L and D = 1 - delta/2 (1 - CDl / CDt) sin^2 2g: CX = -CD_l,AF cos g / D,
    CY = CDt sin g / D, CN = -0.18 (g - pi / 2) CY; the moment of roll is kappa times that of CY at the
    centre of the lateral area.
    """
    side, bow, stern, delta, kappa = vessel
    rows = []
    for g in _angles():
        ahead = bow if g <= 0.5 * math.pi else stern
        share = 1.0 - 0.5 * delta * (1.0 - ahead * areas.frontal / areas.lateral / side) * math.sin(2.0 * g) ** 2
        cy = side * math.sin(g) / share
        rows.append((g, -ahead * math.cos(g) / share, cy, kappa, -0.18 * (g - 0.5 * math.pi) * cy))
    return rows


def isherwood_curve(more: Superstructure, areas: Areas, offset: float) -> tuple[tuple[float, float, float, float], ...]:
    """Return angles [rad] and coefficients of surge, sway and yaw of a merchant ship by Isherwood (1972).

    His moment is about amidships; here it is about the lateral area's centre, `offset` [m] ahead of that.
    """
    length = areas.length
    shares = (
        1.0,
        2.0 * areas.lateral / length**2,
        2.0 * areas.frontal / more.breadth**2,
        length / more.breadth,
        more.perimeter / length,
        0.5 - offset / length,
    )
    own = more.area / areas.lateral
    rows = []
    for line in _ISHERWOOD.split("\n")[1:-1]:
        degrees, *row = map(float, line.split())
        cx = -math.fsum(x * y for x, y in zip(row[:7], (*shares, float(more.masts)), strict=True))
        cy = math.fsum(x * y for x, y in zip(row[7:14], (*shares, own), strict=True))
        cn = math.fsum(x * y for x, y in zip(row[14:], shares, strict=True))
        rows.append((math.radians(degrees), cx, cy, cn - cy * offset / length))
    return tuple(rows)


class WindageRow(NamedTuple):
    """Wind load coefficients of a hull at an angle off its bow."""

    angle: float
    """Angle from which the apparent wind comes [rad], 0 to pi."""
    surge: float
    """Force ahead [N s2/m2]."""
    sway: float
    """Force to lee [N s2/m2]."""
    roll: float
    """Heeling torque besides that of the force at its height [N m s2/m2]."""
    yaw: float
    """Torque that turns the bow to lee [N m s2/m2]."""


def windage_rows(curve: Sequence[Sequence[float]], areas: Areas) -> list[WindageRow]:
    """Return rows of `tables.WINDAGE`: coefficients times areas and half the density of the air."""
    half = 0.5 * AIR_DENSITY
    return [
        WindageRow(
            angle=g,
            surge=half * areas.frontal * cx,
            sway=half * areas.lateral * cy,
            roll=half * areas.lateral * cy * (lever - 1.0) * areas.height,
            yaw=half * areas.lateral * areas.length * cn,
        )
        for g, cx, cy, lever, cn in curve
    ]


@kernel
def piece_of_curve(curve: Table, start: int, count: int, angle: float) -> tuple[int, float]:
    """Return the row of `curve` from which `angle` [rad] is on the way to the next, and the share of that way.

    The curve's rows are `count`, at least two, from `start` on, by rising `angle`.
    """
    first, last = start, start + count - 1
    while last - first > 1:
        middle = (first + last) // 2
        if curve[middle].angle <= angle:
            first = middle
        else:
            last = middle
    low, high = curve[first], curve[first + 1]
    return first, min(max((angle - low.angle) / (high.angle - low.angle), 0.0), 1.0)


@kernel
def windage_load(hull: Record, windage: Table, motion: Motion, wind_vector: Level) -> Wrench:
    """Return the wind's wrench on a hull of a coefficients' curve: world axes, about `hull.link_com`.

    The apparent wind is that at the centre of the lateral area, `hull.windage_height` over the link's origin and
    `hull.windage_offset` ahead of it, where the force acts: a beam wind heels the boat, and rolling is damped.
    """
    height, ahead = hull.windage_height, hull.windage_offset
    u, v, _ = unrotate_level(motion, wind_vector[0], wind_vector[1])
    u, v = u - (motion.u + motion.q * height), v - (motion.v + motion.r * ahead - motion.p * height)
    square = u * u + v * v
    if square == 0.0:
        return zero_wrench()
    angle = math.atan2(abs(v), -u)
    first, share = piece_of_curve(windage, hull.windage_start, hull.windage_count, angle)
    low, high = windage[first], windage[first + 1]
    lee = math.copysign(square, v)
    surge = square * (low.surge + share * (high.surge - low.surge))
    sway = lee * (low.sway + share * (high.sway - low.sway))
    roll = -lee * (low.roll + share * (high.roll - low.roll))
    yaw = lee * (low.yaw + share * (high.yaw - low.yaw))
    load = rotated_wrench(motion, Wrench(surge, sway, 0.0, roll, 0.0, yaw))
    com = hull.link_com
    return shift(load, rotate(motion, (ahead - com[0], -com[1], height - com[2])))


@kernel
def gust_step(wind: Record, state: Record, dt: float) -> float:
    """Advance the gust in `state` by `dt` [s] and return the wind's speed [m/s].

    VRX's first-order Gauss-Markov process, one normal number a step:
    g += dt / tau (-g + gain sqrt(2 tau / dt) xi). Its standard deviation is `gain` / sqrt(1 - dt / (2 tau)).
    The speed may become negative: the wind then blows backwards. VRX 3 takes its first step for one of 1 ms
    (`wind.first_step`), however long it is.
    """
    if wind.gain != 0.0:
        tau = wind.time_constant
        if wind.first_step > 0.0 and state.counter == 0:
            dt = wind.first_step
        kick = wind.gain * math.sqrt(2.0 * tau / dt) * normal(wind.key, state.counter)
        state.gust += dt / tau * (kick - state.gust)
        state.counter += np.uint64(1)
    state.speed = wind.mean + state.gust
    return float(state.speed)


@kernel
def wind_velocity(wind: Record, state: Record) -> Level:
    """Return the wind's velocity [m/s] east and north, where it blows toward."""
    return state.speed * wind.direction[0], state.speed * wind.direction[1]


@kernel
def wind_step(wind: Record, state: Record, bands: Table, air: Table, air_state: Table, dt: float) -> None:
    """Advance gusts and direction by `dt` [s]; without `air`, of 0 or 1 rows, it is `gust_step`.

    Gusts of a spectrum are gain sqrt(2 / N) sum cos(omega_i t + phase_i) over the N `bands`, whose standard deviation
    is `wind.gain`. The direction is off by turning t + v, where v is an exact Gauss-Markov process:
    v' = v exp(-dt / tau) + spread sqrt(1 - exp(-2 dt / tau)) xi.
    """
    for i in range(air.size):
        own, now = air[i], air_state[i]
        if own.spread > 0.0:
            keep = math.exp(-dt / own.time_constant)
            now.deviation = keep * now.deviation + own.spread * math.sqrt(1.0 - keep * keep) * normal(
                own.key, now.counter
            )
        now.counter += np.uint64(1)
        t = float(now.counter) * dt
        now.angle = own.turning * t + now.deviation
        if bands.size > 0:
            state.gust = wind.gain * _harmonics(bands, t)
            state.speed = wind.mean + state.gust
    if bands.size == 0:
        gust_step(wind, state, dt)


@kernel
def _harmonics(bands: Table, t: float) -> float:
    """Return the sum of the bands' harmonics at a time [s], of variance 1."""
    total = 0.0
    for i in range(bands.size):
        total += math.cos(bands[i].frequency * t + bands[i].phase)
    return total * math.sqrt(2.0 / bands.size)


@kernel
def air_velocity(wind: Record, state: Record, air_state: Table) -> Level:
    """Return `wind_velocity`, turned by the angle in `air_state` if there is one."""
    east, north = wind_velocity(wind, state)
    for i in range(air_state.size):
        cos, sin = math.cos(air_state[i].angle), math.sin(air_state[i].angle)
        east, north = cos * east - sin * north, sin * east + cos * north
    return east, north


@kernel
def wind_series(
    wind: Record, state: Record, bands: Table, air: Table, air_state: Table, dt: float, out: FloatArray
) -> None:
    """Advance by steps of `dt` [s], and write the velocity [m/s] east and north after each into `out`, (steps, 2)."""
    for n in range(out.shape[0]):
        wind_step(wind, state, bands, air, air_state, dt)
        out[n, 0], out[n, 1] = air_velocity(wind, state, air_state)


@kernel
def wind_share(air: Table, z: float) -> float:
    """Return the wind's speed at a height `z` [m] above the water over that at `air.height`: 1 without `air`.

    Power law (z / h)^exponent, or the logarithmic profile ln(z / z0) / ln(h / z0), which is 0 up to the roughness
    length z0 (DNV-RP-C205, 2.3.2).
    """
    share = 1.0
    for i in range(air.size):
        own = air[i]
        if own.roughness > 0.0:
            share = math.log(max(z, own.roughness) / own.roughness) / math.log(own.height / own.roughness)
        elif own.exponent > 0.0:
            share = (max(z, 0.0) / own.height) ** own.exponent
    return share


@kernel
def wind_at_hull(hull: Record, air: Table, wind_vector: Level) -> Level:
    """Return the wind [m/s] at the height at which it acts on a hull; on one without windage, at its own height."""
    if hull.windage_count == 0:
        return wind_vector
    share = wind_share(air, hull.windage_height)
    return share * wind_vector[0], share * wind_vector[1]


@kernel
def wind_load(coefficients: FloatArray, motion: Motion, wind_vector: Level) -> Wrench:
    """Return the wind's wrench: world axes, about the link's centre of mass.

    In body axes X = cx u |u|, Y = cy v |v|, N = -2 cz u v, with (u, v) the wind [m/s] and `coefficients`
    (cx, cy [N s2/m2], cz [N m s2/m2]). VRX's quirk is kept: it is the *true* wind, so the link's own velocity
    changes nothing and the wind damps nothing.
    """
    u, v, _ = unrotate_level(motion, wind_vector[0], wind_vector[1])
    fx = coefficients[0] * u * abs(u)
    fy = coefficients[1] * v * abs(v)
    turning = -2.0 * coefficients[2] * u * v
    return rotated_wrench(motion, Wrench(fx, fy, 0.0, 0.0, 0.0, turning))


@kernel
def apparent_wind_load(coefficients: FloatArray, motion: Motion, wind_vector: Level) -> Wrench:
    """Return the wind's wrench as VRX 3 has it: world axes, about the link's *origin*.

    With (rx, ry) the wind less the velocity of the link's origin over ground [m/s], in *world* axes: force
    (cx rx |rx|, cy ry |ry|), torque -2 cz rx ry about the vertical. VRX 3's quirk is kept: the coefficients belong to
    east and north, so that the force on a boat depends on where the wind comes from and not on the boat's heading.
    """
    rx, ry = _apparent_wind(wind_vector, motion)
    fx = coefficients[0] * rx * abs(rx)
    fy = coefficients[1] * ry * abs(ry)
    return Wrench(fx, fy, 0.0, 0.0, 0.0, -2.0 * coefficients[2] * rx * ry)


@kernel
def _apparent_wind(wind_vector: Level, motion: Motion) -> Level:
    """Return the wind less the velocity of the link's origin [m/s, world]: the apparent wind."""
    vx, vy, _ = rotate(motion, velocity_of(motion))
    return wind_vector[0] - vx, wind_vector[1] - vy


@kernel
def wind_on_hull(hull: Record, windage: Table | None, motion: Motion, wind_vector: Level) -> Wrench:
    """Return what the wind does to a hull by the profile of its row: world axes, about `hull.link_com`.

    `windage` is `tables.WINDAGE`; None where no hull has any.
    """
    if windage is not None and hull.windage_count > 0:
        return windage_load(hull, windage, motion, wind_vector)
    return _wind_by_profile(hull, hull.link_com, motion, wind_vector)


@kernel
def _wind_by_profile(row: Record, com: FloatArray, motion: Motion, wind_vector: Level) -> Wrench:
    """Return the wind's wrench by the profile and coefficients of a row: world axes, about `com` [m], body axes."""
    if row.profile == MARINE:
        return wind_load(row.wind, motion, _apparent_wind(wind_vector, motion))
    if row.profile == VRX3:
        return from_origin(apparent_wind_load(row.wind, motion, wind_vector), motion, com)
    return wind_load(row.wind, motion, wind_vector)


@kernel
def wind_on_float(item: Record, motion: Motion, wind_vector: Level) -> Wrench:
    """Return what the wind does to a floating object: world axes, about its centre of mass."""
    return _wind_by_profile(item, item.com, motion, wind_vector)
