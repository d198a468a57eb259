"""The wind's load on a boat by its areas: coefficients over the angle at which the apparent wind comes."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion, Wrench, rotate, rotated_wrench, shift, zero_wrench
from vrx_mj.physics.tables import Record, Table

__all__ = ["BLENDERMANN", "Areas", "blendermann_curve", "three_number_curve", "windage_load", "windage_rows"]

AIR_DENSITY = 1.225
"""Density of the air [kg/m3]: ISO 2533, sea level, 15 C."""
STEPS = 180
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

Curve = list[tuple[float, float, float, float, float]]
"""Rows of an angle [rad] and of coefficients of the forces ahead and to lee, of roll, and of the bow's turn to lee."""


class Areas(NamedTuple):
    """What a boat shows to the wind."""

    frontal: float
    """Area seen from ahead [m2]."""
    lateral: float
    """Area seen from the side [m2]."""
    length: float
    """Length overall [m]."""
    height: float
    """Height of the lateral area's centre [m]."""


def _angles() -> list[float]:
    return [math.pi * index / STEPS for index in range(STEPS + 1)]


def three_number_curve(cx: float, cy: float, cn: float) -> Curve:
    """Return CX = -cx cos g, CY = cy sin g, CN = cn sin 2g (Fossen, 2021, 10.1)."""
    return [(g, -cx * math.cos(g), cy * math.sin(g), 1.0, cn * math.sin(2.0 * g)) for g in _angles()]


def blendermann_curve(vessel: Sequence[float], areas: Areas) -> Curve:
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


def windage_rows(curve: Sequence[Sequence[float]], areas: Areas) -> list[dict[str, float]]:
    """Return rows of `tables.WINDAGE`: coefficients times areas and half the density of the air."""
    half = 0.5 * AIR_DENSITY
    return [
        {
            "angle": g,
            "surge": half * areas.frontal * cx,
            "sway": half * areas.lateral * cy,
            "roll": half * areas.lateral * cy * (lever - 1.0) * areas.height,
            "yaw": half * areas.lateral * areas.length * cn,
        }
        for g, cx, cy, lever, cn in curve
    ]


@kernel
def windage_load(hull: Record, windage: Table, motion: Motion, wind_vector: tuple[float, float]) -> Wrench:
    """Return the wind's wrench on a hull of a coefficients' curve: world axes, about `hull.link_com`.

    The apparent wind is that at the centre of the lateral area, `hull.windage_height` over the link's origin and
    `hull.windage_offset` ahead of it, where the force acts: a beam wind heels the boat, and rolling is damped.
    """
    height, ahead = hull.windage_height, hull.windage_offset
    x, y = wind_vector
    u = motion.r00 * x + motion.r10 * y - (motion.u + motion.q * height)
    v = motion.r01 * x + motion.r11 * y - (motion.v + motion.r * ahead - motion.p * height)
    square = u * u + v * v
    if square == 0.0:
        return zero_wrench()
    angle = math.atan2(abs(v), -u)
    first, last = hull.windage_start, hull.windage_start + hull.windage_count - 1
    while last - first > 1:
        middle = (first + last) // 2
        if windage[middle].angle <= angle:
            first = middle
        else:
            last = middle
    low, high = windage[first], windage[last]
    share = min(max((angle - low.angle) / (high.angle - low.angle), 0.0), 1.0)
    lee = math.copysign(square, v)
    surge = square * (low.surge + share * (high.surge - low.surge))
    sway = lee * (low.sway + share * (high.sway - low.sway))
    roll = -lee * (low.roll + share * (high.roll - low.roll))
    yaw = lee * (low.yaw + share * (high.yaw - low.yaw))
    load = rotated_wrench(motion, Wrench(surge, sway, 0.0, roll, 0.0, yaw))
    com = hull.link_com
    return shift(load, rotate(motion, ahead - com[0], -com[1], height - com[2]))
