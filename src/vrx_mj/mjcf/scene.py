"""Look of a world: SDF's scene vocabulary in MuJoCo's terms, and the light of the sky by the hour.

Markers of goals and waypoints: cylinders in the model that is drawn, which the one that steps never has.
"""

import math
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from vrx_mj.config.world import FogConfig, MarkersConfig, SceneConfig, SkyConfig, WorldConfig
from vrx_mj.errors import VrxWarning
from vrx_mj.model.things import Marker, Scene
from vrx_mj.model.world import Parameters

_RGB = tuple[float, float, float]

_NOON = math.radians(60.0)
"""Elevation of the sun half way between sunrise and sunset [rad]."""
_LOWEST = math.radians(5.0)
"""The light never comes from lower: when the sun is down, it is that of the bright part of the sky, or the moon."""

_SKIES = (
    (-20.0, (0.015, 0.022, 0.055), (0.05, 0.06, 0.11), (0.12, 0.14, 0.20), 0.28),
    (-8.0, (0.03, 0.05, 0.13), (0.12, 0.12, 0.22), (0.13, 0.13, 0.18), 0.34),
    (-2.0, (0.10, 0.15, 0.32), (0.62, 0.40, 0.32), (0.25, 0.16, 0.14), 0.50),
    (3.0, (0.20, 0.31, 0.54), (0.92, 0.63, 0.42), (0.72, 0.45, 0.27), 0.70),
    (10.0, (0.30, 0.50, 0.76), (0.90, 0.82, 0.74), (0.82, 0.70, 0.56), 0.90),
    (22.0, (0.36, 0.58, 0.82), (0.80, 0.88, 0.94), (0.80, 0.80, 0.80), 1.00),
)
"""Elevation of the sun [degrees], colours of zenith, horizon and light, share of ambient light; mixed in between."""
_HEIGHTS, _ZENITH, _HORIZON, _LIGHT, _AMBIENT = zip(*_SKIES, strict=True)


@dataclass(frozen=True)
class Daylight:
    """Colours and light of a clear sky at an hour."""

    zenith: _RGB
    horizon: _RGB
    light: _RGB
    """Color of the sun's light, or of what shines in its place."""
    sun: _RGB
    """Direction to it, east, north, up; in a world's scene x, y, z."""
    ambient: float
    """Share of the day's ambient light and of the light from the camera."""


DAY = Daylight(_ZENITH[-1], _HORIZON[-1], _LIGHT[-1], (0.5, -0.1, 0.9), 1.0)
"""Daylight of a world without an hour: a clear morning."""


def daylight(sky: SkyConfig, latitude: float) -> Daylight:
    """Light at the sky's `time`, at a latitude [degrees] whose sign gives the side on which the sun is at noon.

    The sun rises in the east and sets in the west; its height is a sine of the share of the day, and of the night,
    that has passed. Season and true solar geometry are left out: the file gives the times of sunrise and sunset.
    """
    elevation, course = _sun(sky, latitude)
    shown = max(elevation, _LOWEST)
    degrees = math.degrees(elevation)
    return Daylight(
        zenith=_mix(degrees, _ZENITH),
        horizon=_mix(degrees, _HORIZON),
        light=_mix(degrees, _LIGHT),
        sun=(math.cos(shown) * math.cos(course), math.cos(shown) * math.sin(course), math.sin(shown)),
        ambient=float(np.interp(degrees, _HEIGHTS, _AMBIENT)),
    )


def _sun(sky: SkyConfig, latitude: float) -> tuple[float, float]:
    """Elevation and direction [rad, counter-clockwise from east]; under the horizon at night."""
    day = sky.sunset - sky.sunrise
    passed = sky.time - sky.sunrise
    if 0.0 <= passed <= day:
        turn = math.pi * passed / day
    else:
        night = 24.0 - day
        turn = math.pi * (1.0 + ((sky.time - sky.sunset) % 24.0) / night)
    side = 1.0 if latitude < 0.0 else -1.0  # in the south the sun passes through the north
    return _NOON * math.sin(turn), side * turn


def _mix(degrees: float, colors: tuple[_RGB, ...]) -> _RGB:
    red, green, blue = (float(np.interp(degrees, _HEIGHTS, channel)) for channel in zip(*colors, strict=True))
    return red, green, blue


_EXTENT = 20.0
"""`statistic extent` [m] of every world: the unit of MuJoCo's fog and clipping distances."""
_FAR = 2000.0
"""Start of the fog [m] in a world without fog, beyond all that is looked at."""
AMBIENT = (0.4, 0.4, 0.4)
_HEADLIGHT = 0.35
"""Light [of full scale] that comes from the eye by day, so that what lies in shade keeps its colour."""
_FAINT, _DENSE = -math.log(0.95), -math.log(0.05)
"""Optical depths at which fog hides 5 % and 95 %."""


def scene_values(config: WorldConfig) -> dict[str, object]:
    """Values of the world template that come from `scene`; one warning for what MuJoCo cannot draw."""
    scene = config.scene
    fog = scene.fog if scene.fog and scene.fog.type != "none" else None
    light = _daylight(config)
    horizon = fog.color if fog else scene.background or (*light.horizon, 1.0)
    start, end = fog_range(fog) if fog else (_FAR, 2.0 * _FAR)
    _warn(config.name, _not_drawn(scene))
    return {
        "extent": _EXTENT,
        "ambient": [light.ambient * share for share in (scene.ambient or AMBIENT)[:3]],
        "headlight": [light.ambient * _HEADLIGHT] * 3,
        "sun": [-part for part in light.sun],
        "light": light.light,
        "sky": (fog.color[:3] if fog else light.zenith) if scene.sky else horizon[:3],
        "horizon": horizon,
        "haze": horizon,
        "shadows": scene.shadows,
        "fog": {"color": fog.color if fog else horizon, "start": start, "end": end},
    }


def scene_parameters(config: WorldConfig) -> Scene:
    """Options of renderers and viewers: fog is a flag of MuJoCo's scene, not of the model."""
    fog = config.scene.fog
    return Scene(fog=bool(fog and fog.type != "none"), grid=config.scene.grid)


def fog_range(fog: FogConfig) -> tuple[float, float]:
    """Distances [m] between which fog grows linearly, the only kind that MuJoCo draws.

    Exponential fog hides 1 - exp(-density d) at distance d, quadratic fog 1 - exp(-(density d)^2): theirs are the
    distances at which 5 % and 95 % are hidden.
    """
    if fog.type == "linear":
        return fog.start, fog.end
    if fog.density * _FAR < _FAINT:  # so thin that nobody sees it
        return _FAR, 2.0 * _FAR
    power = 0.5 if fog.type == "quadratic" else 1.0
    return _FAINT**power / fog.density, _DENSE**power / fog.density


def _daylight(config: WorldConfig) -> Daylight:
    """Light at the sky's hour, a day's without one; the sun in the world's axes."""
    sky, earth = config.scene.sky, config.georeference
    light = daylight(sky, earth.latitude if earth else 0.0) if isinstance(sky, SkyConfig) else DAY
    return replace(light, sun=earth.from_east_north_up(*light.sun)) if earth else light


def _not_drawn(scene: SceneConfig) -> list[str]:
    missing = []
    if scene.fog and scene.fog.type in ("exp", "quadratic"):
        missing.append(f"fog type {scene.fog.type} (drawn linear, from where it hides 5 % to where it hides 95 %)")
    if scene.grid:
        missing.append("grid")
    if scene.origin_visual:
        missing.append("origin_visual")
    if isinstance(scene.sky, SkyConfig) and "clouds" in scene.sky.model_fields_set:
        missing.append("the sky's clouds")
    return missing


def _warn(name: str, missing: list[str]) -> None:
    if missing:
        warnings.warn(f"world {name}: MuJoCo cannot draw {', '.join(missing)}", VrxWarning, stacklevel=4)


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
