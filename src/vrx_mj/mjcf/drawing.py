"""The model that is drawn: the saved world, with a sea that can move and a sky with a sun in it."""

import math
from itertools import chain

import mujoco
import numpy as np

from vrx_mj.arrays import ByteArray
from vrx_mj.errors import CompileError
from vrx_mj.mjcf.markers import add_markers
from vrx_mj.mjcf.sky import sea_palette, sky_cube
from vrx_mj.mjcf.world import World
from vrx_mj.physics.surface import EDGE, RINGS, SPOKES, fan, fan_triangles, reflectance

__all__ = ["SEA", "add_signs", "drawing_model", "drawing_spec"]


SEA = "vrx_mj/sea"
"""Name of the skin that is the sea's surface, of its material and of the material's texture."""
LAMP = "vrx_mj/lamp"
"""Name of the material of light buoys' panels."""
WATER, SKY, SUN = "water", "sky", "sun"
"""Names of the world's plane of water, of its skybox and of its light."""
SKY_SIDE = 512
"""Pixels along an edge of the sky's cube: 0.2 degrees at the middle of a face."""
PALETTE = (512, 256)
"""Columns and rows of the sea's palette."""
LOOKOUT = 2.0
"""Height of the eye [m] for which the sea is shaded until its mover says better."""
SLICES, STACKS, QUADS = 20, 8, 1
"""Facets around and along round shapes, and on a box's edge: MuJoCo's 28, 16 and 4 take longer to draw."""


def drawing_model(world: World) -> mujoco.MjModel:
    """The model that is drawn; its bodies and its `qpos` are those of the model that steps.

    Raises:
        CompileError: MuJoCo cannot compile the saved world.
    """
    try:
        return drawing_spec(world).compile()
    except ValueError as error:
        raise CompileError(f"MuJoCo cannot compile the saved world {world.name}: {error}") from error


def drawing_spec(world: World) -> mujoco.MjSpec:
    """The saved world with what only pictures need.

    A skin takes the place of the plane of water, so that waves can be drawn: `vrx_mj.physics.surface` gives its
    vertices. Until somebody moves them it is a calm sea. A painted sky takes the place of MuJoCo's gradient.
    """
    spec = mujoco.MjSpec.from_string(world.mjcf, assets=dict(world.assets))
    quality = spec.visual.quality
    quality.numslices, quality.numstacks, quality.numquads = SLICES, STACKS, QUADS
    add_signs(spec, world)
    light, sky, plane = spec.light(SUN), spec.texture(SKY), spec.geom(WATER)
    if light is None or sky is None:
        return spec
    colors = np.array(sky.rgb1), np.array(sky.rgb2)
    if plane is not None:
        level = float(plane.pos[2])
        spec.delete(plane)
        _add_material(spec, sea_palette(*PALETTE, *colors, np.array(light.diffuse)))
        _add_sea(spec, level)
    _paint(sky, sky_cube(SKY_SIDE, *colors, -np.array(light.dir) / np.linalg.norm(light.dir), np.array(light.diffuse)))
    return spec


def add_signs(spec: mujoco.MjSpec, world: World) -> None:
    """Add what only pictures show of a world's signs: its markers, and that the panels of light buoys shine."""
    add_markers(spec, world.parameters)
    lights = world.parameters.lights
    if lights:
        spec.add_material(name=LAMP, emission=1.0, specular=0.0)
    for name in chain.from_iterable(light.geoms for light in lights):
        spec.geom(name).material = LAMP


def _add_material(spec: mujoco.MjSpec, palette: ByteArray) -> None:
    """A material that shines by itself: the palette holds the light already."""
    texture = spec.add_texture(name=SEA, type=mujoco.mjtTexture.mjTEXTURE_2D)
    _paint(texture, palette)
    material = spec.add_material(name=SEA, rgba=[1.0, 1.0, 1.0, 1.0], emission=1.0, specular=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = SEA


def _paint(texture: mujoco.MjsTexture, pixels: ByteArray) -> None:
    texture.builtin = mujoco.mjtBuiltin.mjBUILTIN_NONE
    texture.height, texture.width, texture.nchannel = pixels.shape
    texture.data = pixels.tobytes()


def _add_sea(spec: mujoco.MjSpec, level: float) -> None:
    """The sea's skin, a flat disc around the world's centre. Its only bone is the world itself."""
    distances, spokes = fan()
    r, angle = np.meshgrid(distances, math.pi * spokes, indexing="ij")
    x, y = spec.stat.center[0] + r * np.cos(angle), spec.stat.center[1] + r * np.sin(angle)
    points = np.stack([x, y, np.full_like(x, level)], axis=-1)
    slant = LOOKOUT / np.hypot(r, LOOKOUT)
    mirrored = EDGE + (1.0 - 2.0 * EDGE) * np.vectorize(reflectance)(slant)
    number = RINGS * SPOKES
    spec.add_skin(
        name=SEA,
        material=SEA,
        vert=points.reshape(-1).tolist(),
        texcoord=np.stack([mirrored, np.full_like(mirrored, EDGE)], axis=-1).reshape(-1).tolist(),
        face=fan_triangles().reshape(-1).tolist(),
        bodyname=["world"],
        bindpos=[0.0, 0.0, 0.0],
        bindquat=[1.0, 0.0, 0.0, 0.0],
        vertid=[list(range(number))],
        vertweight=[[1.0] * number],
        group=1,
    )
