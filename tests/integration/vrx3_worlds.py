"""Worlds of profile vrx3, as several tests need them."""

import vrx_mj
from integration.sailing import CALM, COEFFICIENTS, boats, edited

BREEZE = {"direction": 120, "mean_velocity": 7.0, "objects": [{"model": "wamv", "coefficients": COEFFICIENTS}]}
MOST = 2353.53383668
"""Largest force of one of the WAM-V's thrusters [N]."""


def sailing(sea=CALM, wind=None, fleet=None, edit=None, **more):
    """A simulation of a boat, or a fleet, in open water; `edit` changes the world's parameters before it starts."""
    world = {"physics": {"profile": "vrx3"}, "sea": sea, **more} | ({"wind": wind} if wind else {})
    compiled = vrx_mj.compile_world(world, fleet=fleet or boats((0.0, 0.0, 0.3)))
    return vrx_mj.Simulation(compiled if edit is None else edited(compiled, edit))
