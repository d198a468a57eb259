"""The model that is drawn: the saved world with a sea that moves, a sky with a sun, and markers of goals.

The look is SDF's scene in MuJoCo's terms, with the light of the sky by the hour. The sky is a painted cube, and the
surface of the sea takes its colours from a palette. Markers are cylinders, which the model that steps never has.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import chain

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import ByteArray, FloatArray
from vrx_mj.config.world import FogConfig, MarkersConfig, SceneConfig, SkyConfig, WorldConfig
from vrx_mj.errors import CompileError, warn
from vrx_mj.mjcf.world import World
from vrx_mj.model.things import Marker, Scene
from vrx_mj.model.world import Parameters
from vrx_mj.physics.surface import EDGE, PLAIN, WAVELETS, fan_triangles, reflectance, ring_distances, spokes

_RGB = tuple[float, float, float]

_NOON_ELEVATION = math.radians(60.0)
"""Elevation of the sun half way between sunrise and sunset [rad]."""
_MIN_LIGHT_ELEVATION = math.radians(5.0)
"""Least elevation of the light [rad]: when the sun is down, it is that of the bright part of the sky, or the moon."""

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
_EXTENT = 20.0
"""`statistic extent` [m] of every world: the unit of MuJoCo's fog and clipping distances."""
_NO_FOG_DISTANCE = 2000.0
"""Start of the fog in a world without fog [m]: beyond everything that is drawn."""
AMBIENT = (0.4, 0.4, 0.4)
"""Ambient light by day, red, green and blue [of full scale]."""
_HEADLIGHT = 0.35
"""Light from the eye by day [of full scale], so that shaded surfaces keep their colour."""
_FOG_START_DEPTH, _FOG_END_DEPTH = -math.log(0.95), -math.log(0.05)
"""Optical depths at which fog hides 5 % and 95 %."""
MARKER = "vrx_mj/marker"
"""Prefix of the names of their geoms."""
AHEAD = 1.0
"""Distance from the upright cylinder to the middle of the other [m]. VRX: waypoint_markers.cc."""
_GROUP = 1
"""Group of their geoms and of the water: cameras see it, lidars do not."""
SEA = "vrx_mj/sea"
"""Name of the skin that is the sea's surface, of its material and of the material's texture."""
_LAMP = "vrx_mj/lamp"
"""Name of the material of light buoys' panels."""
_WATER, _SKY, _SUN = "water", "sky", "sun"
"""Names of the world's plane of water, of its skybox and of its light."""
SKY_SIDE = 512
"""Pixels along an edge of the sky's cube: 0.2 degrees at the middle of a face."""
_PALETTE = (512, 256)
"""Columns and rows of the sea's palette."""
_EYE_HEIGHT = 2.0
"""Height of the eye [m] for which the sea is shaded until its mover gives another."""
_SLICES, _STACKS, _QUADS = 20, 8, 1
"""Facets around and along round shapes, and on a box's edge: MuJoCo's 28, 16 and 4 take longer to draw."""
_DEEP_COLOR = (0.035, 0.165, 0.215)
"""Colour of deep water by day."""
FOAM_BRIGHTNESS = 0.85
"""Brightness of foam by day."""
_DAY_BRIGHTNESS = 0.85
"""Brightness of a clear day's horizon: the water is darker in proportion where the horizon is."""
_LUMA = np.array([0.2126, 0.7152, 0.0722])
"""Weights of red, green and blue in a colour's brightness (ITU-R BT.709)."""


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
    shown = max(elevation, _MIN_LIGHT_ELEVATION)
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
    return _NOON_ELEVATION * math.sin(turn), side * turn


def _mix(degrees: float, colors: tuple[_RGB, ...]) -> _RGB:
    red, green, blue = (float(np.interp(degrees, _HEIGHTS, channel)) for channel in zip(*colors, strict=True))
    return red, green, blue


def scene_values(config: WorldConfig) -> dict[str, object]:
    """Values of the world template that come from `scene`; one warning for what MuJoCo cannot draw."""
    scene = config.scene
    fog = scene.fog if scene.fog and scene.fog.type != "none" else None
    light = _daylight(config)
    horizon = fog.color if fog else scene.background or (*light.horizon, 1.0)
    start, end = fog_range(fog) if fog else (_NO_FOG_DISTANCE, 2.0 * _NO_FOG_DISTANCE)
    if missing := _not_drawn(scene):
        warn(f"world {config.name}: MuJoCo cannot draw {', '.join(missing)}", 3)
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
    if fog.density * _NO_FOG_DISTANCE < _FOG_START_DEPTH:  # so thin that nobody sees it
        return _NO_FOG_DISTANCE, 2.0 * _NO_FOG_DISTANCE
    power = 0.5 if fog.type == "quadratic" else 1.0
    return _FOG_START_DEPTH**power / fog.density, _FOG_END_DEPTH**power / fog.density


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


def drawing_model(world: World) -> mujoco.MjModel:
    """The model that is drawn; its bodies and its `qpos` are those of the model that steps.

    Raises:
        CompileError: MuJoCo cannot compile the saved world.
    """
    return compiled_spec(drawing_spec(world), world.name)


def compiled_spec(spec: mujoco.MjSpec, name: str) -> mujoco.MjModel:
    """The model of the spec of a world of a name; errors are those of `drawing_model`."""
    try:
        return spec.compile()
    except ValueError as error:
        raise CompileError(f"MuJoCo cannot compile the saved world {name}: {error}") from error


def drawing_spec(world: World) -> mujoco.MjSpec:
    """The saved world with what only pictures need.

    A skin takes the place of the plane of water, so that waves can be drawn: `vrx_mj.physics.surface` gives its
    vertices. Until somebody moves them it is a calm sea. A painted sky takes the place of MuJoCo's gradient.
    """
    spec = mujoco.MjSpec.from_string(world.mjcf, assets=dict(world.assets))
    add_signs(spec, world)
    quality = spec.visual.quality
    quality.numslices, quality.numstacks, quality.numquads = _SLICES, _STACKS, _QUADS
    light, sky, plane = spec.light(_SUN), spec.texture(_SKY), spec.geom(_WATER)
    if light is None or sky is None:
        return spec
    colors = np.array(sky.rgb1), np.array(sky.rgb2)
    if plane is not None:
        level = float(plane.pos[2])
        spec.delete(plane)
        _add_sea(spec, level, sea_palette(*_PALETTE, *colors, np.array(light.diffuse)))
    sun = -np.array(light.dir) / np.linalg.norm(light.dir)
    _paint(sky, _sky_picture(*(tuple(each.tolist()) for each in (*colors, sun, np.array(light.diffuse)))))
    return spec


def add_signs(spec: mujoco.MjSpec, world: World) -> None:
    """Add what only pictures show of a world's signs: its markers, and that the panels of light buoys shine."""
    add_markers(spec, world.parameters)
    lights = world.parameters.lights
    if lights:
        spec.add_material(name=_LAMP, emission=1.0, specular=0.0)
    for name in chain.from_iterable(light.geoms for light in lights):
        spec.geom(name).material = _LAMP


def _paint(texture: mujoco.MjsTexture, pixels: ByteArray) -> None:
    texture.builtin = mujoco.mjtBuiltin.mjBUILTIN_NONE
    texture.height, texture.width, texture.nchannel = pixels.shape
    texture.data = pixels.tobytes()


def _add_sea(spec: mujoco.MjSpec, level: float, palette: ByteArray) -> None:
    """The sea's skin, a flat disc around the world's centre."""
    r, angle = np.meshgrid(ring_distances(_EYE_HEIGHT, 0.0, -0.5 * math.pi, 0.0), math.pi * spokes(), indexing="ij")
    x, y = spec.stat.center[0] + r * np.cos(angle), spec.stat.center[1] + r * np.sin(angle)
    slant = _EYE_HEIGHT / np.hypot(r, _EYE_HEIGHT)
    mirrored = EDGE + (1.0 - 2.0 * EDGE) * np.vectorize(reflectance)(slant, math.sqrt(WAVELETS))
    points = np.stack([x, y, np.full_like(x, level)], axis=-1).reshape(-1, 3)
    places = np.stack([mirrored, np.full_like(mirrored, PLAIN)], axis=-1).reshape(-1, 2)
    add_skin(spec, SEA, palette, points, places, fan_triangles())


def add_skin(
    spec: mujoco.MjSpec,
    name: str,
    palette: ByteArray,
    points: npt.NDArray[np.floating],
    places: npt.NDArray[np.floating],
    triangles: npt.NDArray[np.int32],
    opacity: float = 1.0,
) -> None:
    """Add a skin that shines in the colours of a palette, with its material and texture; its bone is the world.

    Args:
        spec: the model.
        name: of all three.
        palette: (height, width, 3), or 4 with opacities, which count where `opacity` is below 1.
        points: (n, 3) [m].
        places: (n, 2) of the points on the palette, 0 to 1.
        triangles: (m, 3) numbers of points, counter-clockwise.
        opacity: of all of it.
    """
    _paint(spec.add_texture(name=name, type=mujoco.mjtTexture.mjTEXTURE_2D), palette)
    material = spec.add_material(name=name, rgba=[1.0, 1.0, 1.0, opacity], emission=1.0, specular=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
    spec.add_skin(
        name=name,
        material=name,
        vert=points.reshape(-1).tolist(),
        texcoord=places.reshape(-1).tolist(),
        face=triangles.reshape(-1).tolist(),
        bodyname=["world"],
        bindpos=[0.0, 0.0, 0.0],
        bindquat=[1.0, 0.0, 0.0, 0.0],
        vertid=[list(range(len(points)))],
        vertweight=[[1.0] * len(points)],
        group=1,
    )


@lru_cache(maxsize=4)
def _sky_picture(*colors: tuple[float, ...]) -> ByteArray:
    """The `sky_cube` of a world, which takes 0.15 s to paint: few worlds differ in their sky."""
    return sky_cube(SKY_SIDE, *map(np.array, colors))


def sky_cube(side: int, zenith: FloatArray, horizon: FloatArray, sun: FloatArray, light: FloatArray) -> ByteArray:
    """A sky as MuJoCo's cube of six faces one above the other, (6 side, side, 3).

    Args:
        side: pixels along an edge.
        zenith: colour overhead.
        horizon: colour at the horizon, and below it.
        sun: unit vector to the sun.
        light: the sun's colour; a weak one has no disc.
    """
    return np.concatenate([_sky_face(rays, zenith, horizon, sun, light) for rays in cube_rays(side)])


def _sky_face(
    rays: FloatArray, zenith: FloatArray, horizon: FloatArray, sun: FloatArray, light: FloatArray
) -> ByteArray:
    """The sky where rays (side, side, 3) point, as `sky_cube` has it: a face at a time needs little memory."""
    color = _sky_color(rays[..., 2], zenith, horizon)
    if np.any(zenith != horizon):
        toward = np.clip(rays @ sun, 0.0, 1.0)[..., None]
        glow = 0.25 * toward**6 + 0.35 * toward**60
        disc = np.clip((toward - 0.9998) / 0.0001, 0.0, 1.0) * (light.max() > 0.4)  # 2 degrees wide, with a soft rim
        warm = np.clip(light / max(float(light.max()), 1e-6), 0.0, 1.0)
        color += (warm - color) * np.clip(light.max() * glow + disc, 0.0, 1.0) * (rays[..., 2:] > -0.02)
    return _bytes(color)


def _sky_color(sine: FloatArray, zenith: FloatArray, horizon: FloatArray) -> FloatArray:
    """The sky's colour without the sun (..., 3) at the sine of an elevation (...)."""
    share = (1.0 - np.clip(sine, 0.0, 1.0)[..., None]) ** 3
    return np.asarray(zenith + (horizon - zenith) * share)


def sea_palette(width: int, height: int, zenith: FloatArray, horizon: FloatArray, light: FloatArray) -> ByteArray:
    """Colours of the sea (height, width, 3): columns by the share of sky that is mirrored, rows from foam to glitter.

    What mirrors much is seen at a grazing angle and shows the sky near the horizon, so a column's share gives the
    elevation too: Schlick's law of reflectance, solved for the angle. A sky of one colour has no sun that glitters.
    """
    share = np.clip(((np.arange(width) + 0.5) / width - EDGE) / (1.0 - 2.0 * EDGE), 0.0, 1.0)  # at middles of pixels
    rows = ((np.arange(height) + 0.5) / height - PLAIN) / (PLAIN - EDGE)
    glitter, foam = np.clip(rows, 0.0, 1.0)[:, None, None], np.clip(-rows, 0.0, 1.0)[:, None, None]
    sine = 1.0 - (np.clip(share - 0.02, 0.0, None) / 0.98) ** 0.2
    day = min(float(horizon @ _LUMA) / _DAY_BRIGHTNESS, 1.0)
    deep = np.array(_DEEP_COLOR) * day
    mirrored = deep + (_sky_color(sine, zenith, horizon) - deep) * share[:, None]
    return _bytes(mirrored + light * np.any(zenith != horizon) * glitter + (FOAM_BRIGHTNESS * day - mirrored) * foam)


def cube_rays(side: int) -> Iterator[FloatArray]:
    """Where the middles of the pixels of the cube's six faces lie, unit vectors (side, side, 3), world axes.

    MuJoCo's faces are east, west, up, down, south, north, seen from inside and mirrored left to right.
    """
    line = 2.0 * (np.arange(side) + 0.5) / side - 1.0
    b, a = np.meshgrid(line, line, indexing="ij")
    one = np.ones_like(a)
    faces = [(one, a, -b), (-one, -a, -b), (a, -b, one), (a, b, -one), (a, -one, -b), (-a, one, -b)]
    for face in faces:
        rays = np.stack(face, axis=-1)
        yield rays / np.linalg.norm(rays, axis=-1, keepdims=True)


def _bytes(color: FloatArray) -> ByteArray:
    return np.rint(np.clip(color, 0.0, 1.0) * 255.0).astype(np.uint8)
