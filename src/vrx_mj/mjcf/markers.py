"""Markers of goals and waypoints: cylinders in the model that is drawn, which the one that steps never has."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import mujoco

from vrx_mj.config.scene import MarkersConfig
from vrx_mj.model.site import Marker
from vrx_mj.model.world import Parameters

MARKER = "vrx_mj/marker"
"""Prefix of the names of their geoms."""
AHEAD = 1.0
"""Distance from the upright cylinder to the middle of the other [m]. VRX: waypoint_markers.cc."""
_GROUP = 1
"""Group of their geoms and of the water: cameras see it, lidars do not."""


def marker_rows(config: MarkersConfig, goals: Iterable[Sequence[float]]) -> tuple[Marker, ...]:
    """The cylinders of a world's markers, two for each place: those of `goals` [x, y, yaw] come first."""
    diameter, _, length = config.scaling
    middle = config.height + length / 2.0
    rows: list[Marker] = []
    for x, y, yaw in (*(goals if config.task else ()), *config.places):
        along = (math.cos(yaw), math.sin(yaw), 0.0)
        upright = Marker(
            position=(x, y, middle), axis=(0.0, 0.0, 1.0), radius=diameter / 2.0, length=length, color=config.color
        )
        ahead = (x + AHEAD * along[0], y + AHEAD * along[1], middle)
        rows += [upright, replace(upright, position=ahead, axis=along)]
    return tuple(rows)


def marker_names(world: Parameters) -> list[str]:
    """Names of the geoms that `add_markers` makes."""
    return [f"{MARKER}_{number}" for number in range(len(world.markers))]


def add_markers(spec: mujoco.MjSpec, world: Parameters) -> None:
    """Put the markers of a compiled world into a model in the making."""
    for name, row in zip(marker_names(world), world.markers, strict=True):
        middle, half = row.position, [0.5 * row.length * part for part in row.axis]
        spec.worldbody.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            fromto=[m + side * h for side in (-1.0, 1.0) for m, h in zip(middle, half, strict=True)],
            size=[row.radius, 0.0, 0.0],
            rgba=row.color,
            group=_GROUP,
            contype=0,
            conaffinity=0,
        )
