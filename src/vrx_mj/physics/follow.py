"""Things that swim along a path by themselves: animals and a moving beacon, as VRX's plugins drive them.

VRX classic's follow_plugin.cc pushes with a constant force along the body's x and turns with a constant torque about
its z, one way or the other, while the waypoint is more than 2 degrees off the bow. Gazebo's TrajectoryFollower.cc,
which the worlds of 2023 use, turns first: it pushes only while the waypoint is ahead. Both push at the link's origin
(AddLinkForce, AddWorldWrench), which for an animal is 2 m above its centre of mass.
"""

import math

from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion, Vector, Wrench, rotated_wrench, unrotate, zero_wrench
from vrx_mj.physics.tables import Record, Table

__all__ = ["follow"]


@kernel
def follow(follower: Record, waypoints: Table, state: Record, com: Vector, body: Motion) -> Wrench:
    """Return what drives a follower toward its waypoint: world axes, about its centre of mass `com` [m, body axes].

    In the step in which it reaches a waypoint nothing drives it; from then on it is bound for the next one. At the last
    one of a path that is no loop it rests, and comes back when it drifts off.
    """
    goal = waypoints[follower.waypoint_start + state.target].position
    rise = 0.0 if follower.turns_first != 0 else -body.z
    ahead, left, up = unrotate(body, goal[0] - body.x, goal[1] - body.y, rise)
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
    """Return the waypoint after `target`; the last one's is the first, or itself where the path is no loop."""
    if target + 1 < follower.waypoint_count:
        return target + 1
    return 0 if follower.loop != 0 else target
