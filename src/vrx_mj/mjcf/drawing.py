"""The model that is drawn: the saved world, with a sea that can move and a sky with a sun in it.

The sky is a painted cube; the surface of the sea takes its colours from a palette.
"""

import math
from collections.abc import Iterator
from functools import lru_cache
from itertools import chain

import mujoco
import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import ByteArray, FloatArray
from vrx_mj.errors import CompileError
from vrx_mj.mjcf.scene import add_markers
from vrx_mj.mjcf.world import World
from vrx_mj.physics.surface import EDGE, PLAIN, WAVELETS, fan_triangles, reflectance, ring_distances, spokes

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
_LOOKOUT = 2.0
"""Height of the eye [m] for which the sea is shaded until its mover gives another."""
_SLICES, _STACKS, _QUADS = 20, 8, 1
"""Facets around and along round shapes, and on a box's edge: MuJoCo's 28, 16 and 4 take longer to draw."""


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
    r, angle = np.meshgrid(ring_distances(_LOOKOUT, 0.0, -0.5 * math.pi, 0.0), math.pi * spokes(), indexing="ij")
    x, y = spec.stat.center[0] + r * np.cos(angle), spec.stat.center[1] + r * np.sin(angle)
    slant = _LOOKOUT / np.hypot(r, _LOOKOUT)
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


_DEEP = (0.035, 0.165, 0.215)
"""Colour of deep water by day."""
FOAM = 0.85
"""Brightness of foam by day."""
_DAY = 0.85
"""Brightness of a clear day's horizon: the water is darker in proportion where the horizon is."""
_LUMA = np.array([0.2126, 0.7152, 0.0722])


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
    day = min(float(horizon @ _LUMA) / _DAY, 1.0)
    deep = np.array(_DEEP) * day
    mirrored = deep + (_sky_color(sine, zenith, horizon) - deep) * share[:, None]
    return _bytes(mirrored + light * np.any(zenith != horizon) * glitter + (FOAM * day - mirrored) * foam)


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
