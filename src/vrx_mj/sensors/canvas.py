"""Drawing a MuJoCo scene into memory. A canvas belongs to the thread that made it."""

import atexit
import functools
import importlib
import threading
import weakref
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from vrx_mj.arrays import ByteArray
from vrx_mj.errors import RenderError
from vrx_mj.sensors.gl import check_process, is_forked, new_context
from vrx_mj.sensors.sea import SeaSkin
from vrx_mj.sensors.view import View

__all__ = ["Canvas"]

SPARE_GEOMS = 16
"""Room in a scene for more than the model's own geoms and skins."""
FLAGS = {
    mujoco.mjtRndFlag.mjRND_SHADOW: False,  # three times the work
    mujoco.mjtRndFlag.mjRND_REFLECTION: False,
    mujoco.mjtRndFlag.mjRND_HAZE: False,  # the sea reaches the horizon
    mujoco.mjtRndFlag.mjRND_SKYBOX: True,
}


_OPEN: "weakref.WeakSet[Canvas]" = weakref.WeakSet()
_LEFT: dict[threading.Thread, list[tuple[Any, Any]]] = {}
"""What canvases held that another thread than theirs has closed: it can be freed in theirs alone."""


class Canvas:
    """One OpenGL context with a model's meshes and textures in it, for pictures of any size.

    The model must not be used elsewhere: what a picture does not show is hidden in it.
    """

    def __init__(
        self, model: mujoco.MjModel, *, width: int, height: int, fog: bool, samples: int = 0, spare: int = SPARE_GEOMS
    ) -> None:
        """Open a context.

        Args:
            model: what is drawn.
            width: of the largest picture at first [pixels].
            height: likewise.
            fog: whether there is any.
            samples: per pixel, which smooths edges: 0, or 4, which takes twice as long.
            spare: room for geoms that are drawn besides the model's.
        """
        self._gl: Any = None
        self._context: Any = None
        self._model = model
        self.thread = threading.current_thread()
        self._size = (width, height)
        self._groups = model.geom_group.copy()
        model.vis.quality.offsamples = samples
        model.vis.quality.shadowsize = 0
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        self._scene = mujoco.MjvScene(model, maxgeom=model.ngeom + model.nskin + spare)
        for flag, value in {**FLAGS, mujoco.mjtRndFlag.mjRND_FOG: fog}.items():
            self._scene.flags[flag] = value
        self._option = mujoco.MjvOption()
        self._option.sitegroup[:] = 0
        self._free_camera = mujoco.MjvCamera()
        _free_left()
        self._gl = new_context(width, height)
        _OPEN.add(self)
        _close_at_exit()
        self._gl.make_current()
        self._context = _context(model)
        self._functions: Any = importlib.import_module("OpenGL.GL")
        self._simplify_textures()

    def draw(
        self,
        data: mujoco.MjData,
        view: View,
        sea: SeaSkin,
        out: ByteArray,
        add: Callable[[mujoco.MjvScene], None] | None = None,
    ) -> None:
        """Draw what `view` sees into `out` (height, width, 3), the lowest row first; `add` adds geoms to the scene."""
        if threading.current_thread() is not self.thread:
            raise RenderError("a camera's pictures must be drawn in the thread that drew its first one")
        check_process()
        self._gl.make_current()
        height, width = out.shape[:2]
        self._grow(width, height)
        self._collect(data, view)
        if sea.wet:
            self._pour(sea)
        if add is not None:
            add(self._scene)
        area = mujoco.MjrRect(0, 0, width, height)
        mujoco.mjr_render(area, self._scene, self._context)
        mujoco.mjr_readPixels(out, None, area, self._context)

    def __del__(self) -> None:
        self.close()

    def close(self) -> None:
        """Free what the graphics card or its stand-in holds, and show again what was hidden in the model.

        In another thread than the canvas's own, such as one in which garbage is collected, it is freed later: when
        its own makes or closes a canvas. Another canvas may be drawing there.
        """
        if self._gl is None:
            return
        self._model.geom_group[:] = self._groups
        _LEFT.setdefault(self.thread, []).append((self._gl, self._context))
        self._gl = self._context = None
        _free_left()

    def _simplify_textures(self) -> None:
        """Look up one pixel of sea and sky instead of eight: without a graphics card that saves a sixth of the time."""
        model, gl = self._model, self._functions
        skies = np.flatnonzero(model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX)
        palettes = model.mat_texid[model.skin_matid, mujoco.mjtTextureRole.mjTEXROLE_RGB]
        for textures, kind in ((skies, gl.GL_TEXTURE_CUBE_MAP), (palettes, gl.GL_TEXTURE_2D)):
            for texture in textures:
                gl.glBindTexture(kind, int(self._context.texture[int(texture)]))
                gl.glTexParameteri(kind, gl.GL_TEXTURE_MIN_FILTER, gl.GL_NEAREST)
                gl.glTexParameteri(kind, gl.GL_TEXTURE_MAG_FILTER, gl.GL_NEAREST)
                gl.glBindTexture(kind, 0)

    def _grow(self, width: int, height: int) -> None:
        """Make room for a larger picture."""
        wider, higher = max(width, self._size[0]), max(height, self._size[1])
        if (wider, higher) != self._size:
            self._size = (wider, higher)
            mujoco.mjr_resizeOffscreen(wider, higher, self._context)

    def _collect(self, data: mujoco.MjData, view: View) -> None:
        """Fill the scene with what is in view."""
        model = self._model
        hidden = ~view.shows(data.geom_xpos, model.geom_rbound)
        model.geom_group[:] = np.where(hidden, mujoco.mjNGROUP - 1, self._groups)
        mujoco.mjv_updateScene(
            model, data, self._option, None, self._free_camera, mujoco.mjtCatBit.mjCAT_ALL, self._scene
        )
        for camera in self._scene.camera:
            camera.pos[:] = view.position
            camera.forward[:] = view.rotation[:, 0]
            camera.up[:] = view.rotation[:, 2]
            camera.orthographic = 0
            camera.frustum_center = 0.0
            camera.frustum_width = view.near * view.half_width
            camera.frustum_top = view.near * view.half_height
            camera.frustum_bottom = -view.near * view.half_height
            camera.frustum_near, camera.frustum_far = view.near, view.end

    def _pour(self, sea: SeaSkin) -> None:
        """Give the sea's skin its vertices, normals and colours."""
        self._scene.skinvert[:] = sea.vertices.reshape(self._scene.skinvert.shape)
        self._scene.skinnormal[:] = sea.normals.reshape(self._scene.skinnormal.shape)
        gl, buffer = self._functions, int(self._context.skintexcoordVBO[0])
        gl.glBindBuffer(gl.GL_ARRAY_BUFFER, buffer)
        gl.glBufferSubData(gl.GL_ARRAY_BUFFER, 0, sea.palette.nbytes, sea.palette)
        gl.glBindBuffer(gl.GL_ARRAY_BUFFER, 0)


def _free_left() -> None:
    """Free what is left of this thread's canvases; in a forked process it is its parent's."""
    if is_forked():
        return
    for gl, context in _LEFT.pop(threading.current_thread(), ()):
        if context is not None:
            with gl.as_current():
                context.free()
        gl.free()


@functools.cache
def _close_at_exit() -> None:
    """Once for the process: OSMesa's contexts complain when they outlive the library that they belong to."""
    atexit.register(_close_all)


def _close_all() -> None:
    _free_left()
    for canvas in list(_OPEN):
        if canvas.thread is threading.current_thread():
            canvas.close()


def _context(model: mujoco.MjModel) -> mujoco.MjrContext:
    """The model's meshes and textures in the current OpenGL context, which draws into memory."""
    try:
        context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50)
    except mujoco.FatalError as error:
        raise RenderError(f"MuJoCo cannot draw with the OpenGL found here: {error}") from error
    mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, context)
    return context
