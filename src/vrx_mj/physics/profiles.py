"""What differs between the profiles of physics, effect by effect: a hull's or an object's row says which is its own.

| effect | VRX classic | VRX 3 |
|---|---|---|
| drag | at the centre of mass of the base link | the same formula at the link's origin |
| added mass | on the rate of change of the body components of the velocity | on the origin's acceleration |
| wind | true wind in body axes, at that centre of mass | apparent wind in world axes, at the link's origin |

All other effects have one kernel, and their rows differ.
"""

from vrx_mj.physics.drag import added_bias, drag
from vrx_mj.physics.kernel import kernel
from vrx_mj.physics.motion import Motion, Wrench, from_origin, zero_wrench
from vrx_mj.physics.tables import VRX3, Record
from vrx_mj.physics.wind import apparent_wind_load, wind_load

__all__ = ["bias_on_hull", "drag_on_hull", "wind_on_float", "wind_on_hull"]

Air = tuple[float, float]


@kernel
def drag_on_hull(hull: Record, motion: Motion) -> Wrench:
    """Return `drag`: world axes, about `hull.link_com`."""
    wrench = drag(hull, motion)
    if hull.profile == VRX3:
        return from_origin(wrench, motion, hull.link_com)
    return wrench


@kernel
def bias_on_hull(hull: Record, motion: Motion) -> Wrench:
    """Return the added mass' force at zero acceleration: world axes, about `hull.link_com`."""
    if hull.profile == VRX3:
        return zero_wrench()
    return added_bias(hull, motion)


@kernel
def wind_on_hull(hull: Record, motion: Motion, air: Air) -> Wrench:
    """Return what `air`, the wind's velocity [m/s], does to a hull: world axes, about `hull.link_com`."""
    if hull.profile == VRX3:
        return from_origin(apparent_wind_load(hull.wind, motion, air), motion, hull.link_com)
    return wind_load(hull.wind, motion, air)


@kernel
def wind_on_float(item: Record, motion: Motion, air: Air) -> Wrench:
    """Return the same for a floating object: world axes, about its centre of mass."""
    if item.profile == VRX3:
        return from_origin(apparent_wind_load(item.wind, motion, air), motion, item.com)
    return wind_load(item.wind, motion, air)
