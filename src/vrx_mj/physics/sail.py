"""Sails: lift and drag over the angle at which the apparent wind meets the chord, and the sheet that holds the boom.

A sail's row is one of `tables.THRUSTER`: at angle zero its chord runs aft from the mast, along -x of the hinge.
"""

import math

from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Level, Motion, minus, unrotate_level, velocity_at
from vrx_mj.physics.tables import SAIL, Record, Table
from vrx_mj.physics.thrust import force_point, steering_target, to_hinge
from vrx_mj.physics.wind import piece_of_curve, wind_share

_STALL = math.radians(15.0)
"""Angle of attack at which the flow separates [rad]."""
_LEAST_DRAG = 0.02
"""Coefficient of drag of a sail without lift."""
_REVERSED = 0.7
"""Share of its lift that a wing has in a flow from its trailing edge."""


def sail_curve(aspect_ratio: float) -> list[tuple[float, float, float]]:
    """Return angles of attack [rad] and coefficients of lift and drag, each 5 degrees from 0 to 180.

    To the stall a wing of lifting-line theory (Prandtl): CL = 2 pi sin a / (1 + 2 / AR), CD = CD0 + CL^2 / (pi AR);
    from there to 90 degrees the model of Viterna and Corrigan (1982, NASA CP-2230, 69-85), and beyond the mirror image
    with 0.7 of the lift (Viterna and Janetzke, 1982, NASA TM-82944).
    """
    ahead = [(angle, *_lift_and_drag(angle, aspect_ratio)) for angle in (math.radians(5.0 * k) for k in range(19))]
    astern = [(math.pi - angle, -_REVERSED * lift, drag) for angle, lift, drag in reversed(ahead[:-1])]
    return [*ahead, *astern]


def _lift_and_drag(angle: float, aspect_ratio: float) -> tuple[float, float]:
    """Return the coefficients at an angle of attack [rad] of 0 to pi / 2."""
    lift = 2.0 * math.pi * math.sin(min(angle, _STALL)) / (1.0 + 2.0 / aspect_ratio)
    drag = _LEAST_DRAG + lift * lift / (math.pi * aspect_ratio)
    if angle <= _STALL:
        return lift, drag
    most, s, c = 1.11 + 0.018 * aspect_ratio, math.sin(_STALL), math.cos(_STALL)
    a, b = (lift - most * s * c) * s / (c * c), (drag - most * s * s) / c
    sine, cosine = math.sin(angle), math.cos(angle)
    return most * sine * cosine + a * cosine * cosine / sine, most * sine * sine + b * cosine


@kernel
def wind_on_sail(sail: Record, air: Table, wind_vector: Level, motion: Motion, angle: float) -> Level:
    """Return the wind less the velocity of the centre of effort [m/s], along the hinge's x and y axes.

    The wind is that at the centre's height over the link's origin; `motion` is the hull's and `angle` [rad] the
    boom's, whose own rate is not considered.
    """
    center = force_point(sail, angle)
    share = wind_share(air, center[2])
    wind = unrotate_level(motion, share * wind_vector[0], share * wind_vector[1])
    return to_hinge(sail, minus(wind, velocity_at(motion, center)))


@kernel
def boom_target(sail: Record, flow: Level, angle: float, command: float) -> float:
    """Return the angle [rad] to which the boom goes: the commanded one, or, on a sheet, that in which it streams.

    The sheet lets the boom to lee by the size of the command, either way (Jaulin and Le Bars, 2013, Robotic Sailing).
    `flow` is `wind_on_sail`, `angle` the boom's own, which it keeps in no wind.
    """
    if sail.sheeted == 0:
        return steering_target(sail, command)
    streaming = math.atan2(-flow[1], -flow[0]) if flow[0] != 0.0 or flow[1] != 0.0 else angle
    most = min(abs(command), sail.max_angle)
    return float(min(max(streaming, -most), most))


@kernel
def sail_force(sail: Record, curves: Table, flow: Level, angle: float) -> Level:
    """Return the force [N] on a sail along its own x and y axes, which are the hinge's turned by `angle` [rad].

    Drag is along the apparent wind `flow`, of the hinge's axes, and lift across it, away from the windward side.
    """
    c, s = math.cos(angle), math.sin(angle)
    ahead, aside = c * flow[0] + s * flow[1], c * flow[1] - s * flow[0]
    speed = math.hypot(ahead, aside)
    low, share = piece_of_curve(curves, sail.curve_start, sail.curve_count, math.atan2(abs(aside), -ahead))
    one, two = curves[low], curves[low + 1]
    pressure = 0.5 * sail.density * sail.area * speed
    drag = pressure * (one.drag + share * (two.drag - one.drag))
    lift = math.copysign(pressure, aside) * (one.lift + share * (two.lift - one.lift))
    return drag * ahead + lift * aside, drag * aside - lift * ahead


@kernel
def along_blade(thruster: Record, own: Record) -> float:
    """Return the force [N] along the x axis of a thruster, rudder or sail besides its thrust: 0 of all but sails."""
    return float(own.applied) if thruster.mapping == SAIL else 0.0
