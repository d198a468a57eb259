"""Rudders: the normal force of a wing that turns in the water, and in the race of a propeller.

Lift and drag are the parts of the normal force across and along the flow, as in the MMG standard method (Yasukawa and
Yoshimura, J. Mar. Sci. Technol. 20, 2015): F_N = rho / 2 A U^2 f sin(alpha), without stall, so for any angle of attack.
"""

import math

from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion
from vrx_mj.physics.tables import Record
from vrx_mj.physics.thrust import force_point

__all__ = ["normal_slope", "race_speed", "rudder_force"]


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
def rudder_force(rudder: Record, motion: Motion, angle: float, thrust: float) -> float:
    """Return the force [N] on a rudder along its own y axis, the normal of a blade that lies along its x.

    `motion` is the hull's, over still water; `angle` [rad] is the rudder's, and `thrust` [N] that of its propeller.
    Waves, current and the emerged part of the blade are not considered, as for thrusters.
    """
    x, y, z = force_point(rudder, angle)
    u = motion.u + motion.q * z - motion.r * y
    v = motion.v + motion.r * x - motion.p * z
    w = motion.w + motion.p * y - motion.q * x
    m = rudder.rotation
    ahead = m[0, 0] * u + m[1, 0] * v + m[2, 0] * w
    aside = m[0, 1] * u + m[1, 1] * v + m[2, 1] * w
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
