"""What a world looks like: SDF's scene vocabulary in MuJoCo's terms."""

import math
import warnings
from typing import Any

from vrx_mj.config.scene import FogConfig, SkyConfig
from vrx_mj.config.world import SceneConfig, WorldConfig
from vrx_mj.errors import VrxWarning
from vrx_mj.mjcf.daylight import DAY, Daylight, daylight
from vrx_mj.model.site import Scene

EXTENT = 20.0
"""`statistic extent` [m] of every world: the unit of MuJoCo's fog and clipping distances."""
FAR = 2000.0
"""Where fog starts and ends [m] in a world without fog: beyond what anybody looks at."""
AMBIENT = (0.4, 0.4, 0.4)
HEADLIGHT = 0.35
"""Light [of full scale] that comes from the eye by day, so that what lies in shade keeps its colour."""
FAINT, DENSE = -math.log(0.95), -math.log(0.05)
"""Optical depths at which fog hides 5 % and 95 %."""


def scene_values(config: WorldConfig) -> dict[str, Any]:
    """Values of the world template that come from `scene`; one warning for what MuJoCo cannot draw."""
    scene = config.scene
    fog = scene.fog if scene.fog and scene.fog.type != "none" else None
    light = _daylight(config)
    horizon = fog.color if fog else scene.background or (*light.horizon, 1.0)
    start, end = fog_range(fog) if fog else (FAR, 2.0 * FAR)
    _warn(config.name, _not_drawn(scene))
    return {
        "extent": EXTENT,
        "ambient": [light.ambient * share for share in (scene.ambient or AMBIENT)[:3]],
        "headlight": [light.ambient * HEADLIGHT] * 3,
        "sun": [-part for part in light.sun],
        "light": light.light,
        "sky": (fog.color[:3] if fog else light.zenith) if scene.sky else horizon[:3],
        "horizon": horizon,
        "haze": horizon,
        "shadows": scene.shadows,
        "fog": {"color": fog.color if fog else horizon, "start": start, "end": end},
    }


def scene_parameters(config: WorldConfig) -> Scene:
    """What renderers and viewers set by hand: fog is a flag of the scene, not of the model."""
    fog = config.scene.fog
    return Scene(fog=bool(fog and fog.type != "none"), grid=config.scene.grid)


def fog_range(fog: FogConfig) -> tuple[float, float]:
    """Distances [m] between which fog grows linearly, the only kind that MuJoCo draws.

    Exponential fog hides 1 - exp(-density d) at distance d, quadratic fog 1 - exp(-(density d)^2): theirs are the
    distances at which 5 % and 95 % are hidden.
    """
    if fog.type == "linear":
        return fog.start, fog.end
    if fog.density * FAR < FAINT:  # so thin that nobody sees it
        return FAR, 2.0 * FAR
    power = 0.5 if fog.type == "quadratic" else 1.0
    return FAINT**power / fog.density, DENSE**power / fog.density


def _daylight(config: WorldConfig) -> Daylight:
    """Light at the sky's hour; a day's where none is said."""
    sky = config.scene.sky
    if not isinstance(sky, SkyConfig):
        return DAY
    return daylight(sky, config.georeference.latitude if config.georeference else 0.0)


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
