"""What a world looks like: SDF's scene vocabulary in MuJoCo's terms."""

import warnings
from typing import Any

from vrx_mj.config.world import SceneConfig, WorldConfig
from vrx_mj.errors import VrxWarning

EXTENT = 20.0
"""`statistic extent` [m] of every world: the unit of MuJoCo's fog and clipping distances."""
FAR = 2000.0
"""Where fog starts and ends [m] in a world without fog: beyond what anybody looks at."""
SKY, HORIZON = (0.36, 0.58, 0.82, 1.0), (0.80, 0.88, 0.94, 1.0)

RGBA = tuple[float, float, float, float]


def scene_values(config: WorldConfig) -> dict[str, Any]:
    """Values of the world template that come from `scene`; one warning for what MuJoCo cannot draw."""
    scene = config.scene
    fog = scene.fog if scene.fog and scene.fog.type != "none" else None
    horizon = fog.color if fog else scene.background or HORIZON
    _warn(config.name, _not_drawn(scene))
    return {
        "extent": EXTENT,
        "ambient": scene.ambient or (0.4, 0.4, 0.4, 1.0),
        "sky": (fog.color if fog else SKY) if scene.sky else horizon,
        "horizon": horizon,
        "haze": horizon,
        "shadows": scene.shadows,
        "fog": {
            "color": fog.color if fog else horizon,
            "start": fog.start if fog else FAR,
            "end": fog.end if fog else 2.0 * FAR,
        },
    }


def scene_parameters(config: WorldConfig) -> dict[str, Any]:
    """What renderers and viewers set by hand: fog is a flag of the scene, not of the model."""
    fog = config.scene.fog
    return {"fog": bool(fog and fog.type != "none"), "grid": config.scene.grid}


def _not_drawn(scene: SceneConfig) -> list[str]:
    missing = []
    if scene.fog and scene.fog.type in ("exp", "quadratic"):
        missing.append(f"fog type {scene.fog.type} (drawn linear, from start to end)")
    if scene.grid:
        missing.append("grid")
    if scene.origin_visual:
        missing.append("origin_visual")
    if not isinstance(scene.sky, bool):
        missing.append("the sky's clouds and time of day")
    return missing


def _warn(name: str, missing: list[str]) -> None:
    if missing:
        warnings.warn(f"world {name}: MuJoCo cannot draw {', '.join(missing)}", VrxWarning, stacklevel=4)
