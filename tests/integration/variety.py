"""What episodes of a learning problem may differ in: its world may be calm, and its boats in no wind."""

import functools
from collections.abc import Mapping
from typing import Any

from vrx_mj.config.world import load_world
from vrx_mj.rl.problems import PROBLEMS


@functools.cache
def idle(problem: str) -> frozenset[str]:
    """Options that a problem's own world warns of, as nothing there depends on them."""
    world = load_world(PROBLEMS[problem].world)
    calm = () if world.sea.model != "none" else ("waves",)
    return frozenset((*calm, *(() if world.wind.objects else ("wind_speed", "gusts"))))


def variety(problem: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """The options that make a difference."""
    return {name: value for name, value in options.items() if name not in idle(problem)}
