"""Drawing a MuJoCo scene into memory. A canvas belongs to the thread that made it."""

import atexit
import ctypes
import functools
import importlib
import math
import os
import sys
import threading
import weakref
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from vrx_mj.arrays import ByteArray, IntArray
from vrx_mj.errors import RenderError
from vrx_mj.packages import load_triton
from vrx_mj.sensors.sea import Skin
from vrx_mj.sensors.view import View

BACKENDS = {"egl": "libegl1 libgl1-mesa-dri libopengl0", "osmesa": "libosmesa6 libopengl0"}
"""Ways to draw without a screen on Linux, in the order in which they are tried, and the packages of Debian and Ubuntu
that each needs."""
_OFF_VALUES = ("disable", "disabled", "off", "false", "0")
"""Values of `MUJOCO_GL` that forbid drawing."""
_AUTOMATIC_VALUES = ("", "enable", "enabled", "on", "true", "1")
"""Values of `MUJOCO_GL` that leave the choice to the program."""

_EGL_PLATFORM_DEVICE = 0x313F

_CYLINDER_LIST = 3
"""Number of the closed cylinder among the display lists of MuJoCo's shapes."""
_SPARE_GEOMS = 16
"""Room in a scene for more than the model's own geoms and skins."""
_FLAGS = {
    mujoco.mjtRndFlag.mjRND_SHADOW: False,  # three times the work
    mujoco.mjtRndFlag.mjRND_REFLECTION: False,
    mujoco.mjtRndFlag.mjRND_HAZE: False,  # the sea reaches the horizon
}
_AS_IDS = [int(mujoco.mjtRndFlag.mjRND_SEGMENT), int(mujoco.mjtRndFlag.mjRND_IDCOLOR)]
"""Flags that draw each shape in one colour: its number from 1 on, in 24 bits, least byte first."""
_OPEN_CANVASES: "weakref.WeakSet[Canvas]" = weakref.WeakSet()
_ORPHANS: dict[threading.Thread, list[tuple[Any, Any]]] = {}
"""Resources of canvases that another thread than theirs has closed: they can be freed in theirs alone."""


def _new_context(width: int, height: int) -> Any:
    """A fresh OpenGL context of the backend that `choose_backend` names.

    Raises:
        RenderError: nothing can draw here, with what to install; or one of `_check_process`.
    """
    _check_process()
    backend = choose_backend()
    try:
        module = "mujoco.rendering.classic.gl_context" if backend == "mujoco" else f"mujoco.{backend}"
        return importlib.import_module(module).GLContext(width, height)
    except (ImportError, RuntimeError, AttributeError, OSError) as error:
        raise RenderError(_advice({backend: str(error)})) from error


def _check_process() -> None:
    """See that OpenGL works in this process: its locks and threads do not live on in a forked one, and it would hang.

    Raises:
        RenderError: the process was forked from one that had drawn.
    """
    if _is_forked():
        raise RenderError(
            "this process was forked from one that had drawn pictures, so it cannot draw: "
            "start it with 'spawn' or 'forkserver', or draw only in processes that were forked before"
        )


def _is_forked() -> bool:
    """Whether the process was forked from one that had drawn."""
    return _drawing_process() != os.getpid()


@functools.cache
def _drawing_process() -> int:
    """The first process that asked."""
    return os.getpid()


@functools.cache
def choose_backend() -> str:
    """`egl`, `osmesa`, or `mujoco` for what MuJoCo has chosen itself: on other systems, or by `MUJOCO_GL=glfw`.

    It is settled once for a process, because PyOpenGL can be imported for one of them only.

    Raises:
        RenderError: none works, with what to install.
    """
    wanted = os.environ.get("MUJOCO_GL", "").lower().strip()
    if wanted in _OFF_VALUES:
        raise RenderError(f"MUJOCO_GL={wanted} disables rendering; unset it, or set it to egl or osmesa")
    load_triton()
    if sys.platform != "linux" or wanted not in (*BACKENDS, *_AUTOMATIC_VALUES):
        return "mujoco"
    problems: dict[str, str] = {}
    for backend in (wanted,) if wanted in BACKENDS else BACKENDS:
        problem = problem_of(backend)
        if problem is None:
            return backend
        problems[backend] = problem
    if wanted not in BACKENDS and os.environ.get("DISPLAY"):
        return "mujoco"
    raise RenderError(_advice(problems))


def problem_of(backend: str) -> str | None:
    """Why `egl` or `osmesa` cannot draw here, or None if it can."""
    platform = os.environ.get("PYOPENGL_PLATFORM", "").lower()
    if platform and platform != backend:
        return f"PYOPENGL_PLATFORM={platform} prevents it"
    try:
        return _egl_problem() if backend == "egl" else _osmesa_problem()
    except OSError as error:
        return str(error)


def _egl_problem() -> str | None:
    """Whether some device gives a display, asked of the library itself: PyOpenGL could not be taken back."""
    egl = ctypes.CDLL("libEGL.so.1")
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    names = (b"eglQueryDevicesEXT", b"eglGetPlatformDisplayEXT")
    query, display_of = (egl.eglGetProcAddress(name) for name in names)
    if not (query and display_of):
        return "libEGL does not support drawing without a screen"
    devices, number = (ctypes.c_void_p * 16)(), ctypes.c_int()
    ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)(query)(
        16, ctypes.addressof(devices), ctypes.addressof(number)
    )
    open_display = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p)(display_of)
    egl.eglInitialize.argtypes = [ctypes.c_void_p] * 3
    for device in devices[: number.value]:
        display = open_display(_EGL_PLATFORM_DEVICE, device, None)
        if display and egl.eglInitialize(display, None, None):
            return None
    return "libEGL finds no device, neither a graphics card nor Mesa's software"


def _osmesa_problem() -> str | None:
    names = ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")
    errors = []
    for name in names:
        try:
            ctypes.CDLL(name)
        except OSError as error:
            errors.append(str(error))
        else:
            return None
    return errors[0]


def _advice(problems: dict[str, str]) -> str:
    found = "".join(f"\n  {backend}: {problem}" for backend, problem in problems.items())
    lines = "".join(f"\n  sudo apt-get install -y {BACKENDS[name]}    # then MUJOCO_GL={name}" for name in BACKENDS)
    return (
        f"cannot draw pictures without a screen:{found}\nInstall one of these; it is found automatically, "
        f"or selected by the variable MUJOCO_GL:{lines}"
    )


class Canvas:
    """One OpenGL context with a model's meshes and textures in it, for pictures of any size.

    The model must not be used in another thread: while a picture is drawn, what it does not show is hidden in it.
    """

    def __init__(
        self, model: mujoco.MjModel, *, width: int, height: int, fog: bool, samples: int = 0, sky: bool = True
    ) -> None:
        """Open a context.

        Args:
            model: what is drawn.
            width: of the largest picture at first [pixels].
            height: likewise.
            fog: whether there is any.
            samples: per pixel, which smooth edges: 0, or 4, which take twice as long.
            sky: whether it is drawn; where nothing is, opacities are 0 without it.
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
        self._scene = mujoco.MjvScene(model, maxgeom=model.ngeom + model.nskin + _SPARE_GEOMS)
        for flag, value in {**_FLAGS, mujoco.mjtRndFlag.mjRND_FOG: fog, mujoco.mjtRndFlag.mjRND_SKYBOX: sky}.items():
            self._scene.flags[flag] = value
        self._option = mujoco.MjvOption()
        self._option.sitegroup[:] = 0
        self._free_camera = mujoco.MjvCamera()
        _free_left()
        self._gl = _new_context(width, height)
        _OPEN_CANVASES.add(self)
        _close_at_exit()
        self._gl.make_current()
        self._context = _context(model)
        self._functions: Any = importlib.import_module("OpenGL.GL")
        self._drop_stencil()
        self._simplify_textures()
        self._simplify_cylinders()

    def draw(self, data: mujoco.MjData, view: View, skins: Sequence[Skin], out: ByteArray) -> None:
        """Draw what `view` sees into `out`, the lowest row first; `skins` are the model's.

        `out` is (height, width, 3), or 4 with opacities, which is read faster, from a canvas without samples.
        """
        if threading.current_thread() is not self.thread:
            raise RenderError("a camera's pictures must be drawn in the thread that drew its first one")
        _check_process()
        self._gl.make_current()
        height, width = out.shape[:2]
        wider, higher = max(width, self._size[0]), max(height, self._size[1])
        if (wider, higher) != self._size:
            self._size = (wider, higher)
            mujoco.mjr_resizeOffscreen(wider, higher, self._context)
            self._drop_stencil()
        self._collect(data, view)
        self._move(skins[: self._model.nskin])
        area = mujoco.MjrRect(0, 0, width, height)
        mujoco.mjr_render(area, self._scene, self._context)
        if out.shape[2] == 4:
            gl = self._functions
            gl.glReadPixels(0, 0, width, height, gl.GL_RGBA, gl.GL_UNSIGNED_BYTE, out)
        else:
            mujoco.mjr_readPixels(out, None, area, self._context)

    def seen_geoms(self, out: ByteArray) -> IntArray:
        """Numbers (height, width) of the geoms that the last picture shows, the lowest row first; -1: none.

        `out` (height, width, 3) is of the picture's size, and is overwritten. What fog hides is not seen.
        """
        height, width = out.shape[:2]
        area, fog = mujoco.MjrRect(0, 0, width, height), self._scene.flags[mujoco.mjtRndFlag.mjRND_FOG]
        for camera in self._scene.camera if fog else ():
            camera.frustum_far = min(camera.frustum_far, self._model.vis.map.fogend * self._model.stat.extent)
        self._scene.flags[_AS_IDS] = 1
        mujoco.mjr_render(area, self._scene, self._context)
        self._scene.flags[_AS_IDS] = 0
        mujoco.mjr_readPixels(out, None, area, self._context)
        ids = out[..., 0] | out[..., 1].astype(np.intp) << 8 | out[..., 2].astype(np.intp) << 16
        geoms: IntArray = np.full(self._scene.ngeom + 1, -1)
        for drawn in np.flatnonzero(np.bincount(ids.reshape(-1))[1:]):
            shape = self._scene.geoms[drawn]
            geoms[drawn + 1] = shape.objid if shape.objtype == mujoco.mjtObj.mjOBJ_GEOM else -1
        return np.asarray(geoms[ids])

    def __del__(self) -> None:
        self.close()

    def close(self) -> None:
        """Free what the graphics card or its substitute holds.

        In another thread than the canvas's own, such as one in which garbage is collected, it is freed later: when
        its own makes or closes a canvas. Another canvas may be drawing there.
        """
        if self._gl is None:
            return
        _ORPHANS.setdefault(self.thread, []).append((self._gl, self._context))
        self._gl = self._context = None
        _free_left()

    def _drop_stencil(self) -> None:
        """Keep depths alone: beside MuJoCo's stencil, which no picture needs, they take twice the memory and time."""
        gl, context = self._functions, self._context
        gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, int(context.offFBO))
        gl.glBindRenderbuffer(gl.GL_RENDERBUFFER, int(context.offDepthStencil))
        gl.glRenderbufferStorageMultisample(
            gl.GL_RENDERBUFFER, int(context.offSamples), gl.GL_DEPTH_COMPONENT32F, *self._size
        )
        gl.glFramebufferRenderbuffer(gl.GL_FRAMEBUFFER, gl.GL_STENCIL_ATTACHMENT, gl.GL_RENDERBUFFER, 0)

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

    def _simplify_cylinders(self) -> None:
        """Draw the side of a cylinder in one stack instead of as many as a sphere needs, and its ends as fans."""
        gl, slices = self._functions, int(self._model.vis.quality.numslices)
        around = [(math.cos(angle), math.sin(angle)) for angle in np.linspace(0.0, 2.0 * math.pi, slices + 1)]
        gl.glNewList(self._context.baseBuiltin + _CYLINDER_LIST, gl.GL_COMPILE)
        gl.glBegin(gl.GL_QUAD_STRIP)
        for x, y in around:
            gl.glNormal3f(x, y, 0.0)
            gl.glVertex3f(x, y, 1.0)
            gl.glVertex3f(x, y, -1.0)
        gl.glEnd()
        for z in (1.0, -1.0):
            gl.glBegin(gl.GL_POLYGON)
            gl.glNormal3f(0.0, 0.0, z)
            for x, y in around[1:]:
                gl.glVertex3f(x, z * y, z)
            gl.glEnd()
        gl.glEndList()

    def _collect(self, data: mujoco.MjData, view: View) -> None:
        """Fill the scene with what is in view."""
        model = self._model
        hidden = ~view.shows(data.geom_xpos, model.geom_rbound)
        model.geom_group[:] = np.where(hidden, mujoco.mjNGROUP - 1, self._groups)
        mujoco.mjv_updateScene(
            model, data, self._option, None, self._free_camera, mujoco.mjtCatBit.mjCAT_ALL, self._scene
        )
        model.geom_group[:] = self._groups
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

    def _move(self, skins: Sequence[Skin]) -> None:
        """Give skins their vertices, normals and colours."""
        gl, first = self._functions, 0
        for number, skin in enumerate(skins):
            part = slice(3 * first, 3 * (first + len(skin.vertices)))
            self._scene.skinvert.reshape(-1)[part] = skin.vertices.reshape(-1)
            self._scene.skinnormal.reshape(-1)[part] = skin.normals.reshape(-1)
            gl.glBindBuffer(gl.GL_ARRAY_BUFFER, int(self._context.skintexcoordVBO[number]))
            gl.glBufferSubData(gl.GL_ARRAY_BUFFER, 0, skin.palette.nbytes, skin.palette)
            gl.glBindBuffer(gl.GL_ARRAY_BUFFER, 0)
            first += len(skin.vertices)


def _free_left() -> None:
    """Free what is left of this thread's canvases; in a forked process it is its parent's."""
    if _is_forked():
        return
    for gl, context in _ORPHANS.pop(threading.current_thread(), ()):
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
    for canvas in list(_OPEN_CANVASES):
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
