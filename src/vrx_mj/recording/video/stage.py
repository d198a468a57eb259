"""Draws moments of a recording: its world's drawing model, the sea of that moment, foam behind the boats."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np

from vrx_mj.arrays import ByteArray, FloatArray
from vrx_mj.mjcf.drawing import drawing_model
from vrx_mj.physics.surface import EDGE, draw_surface
from vrx_mj.recording.companies import Company
from vrx_mj.recording.session import check_columns
from vrx_mj.recording.video.eye import Eye, view_of
from vrx_mj.recording.video.footage import Instant
from vrx_mj.recording.video.wake import LASTS, PIECES_PER_SECOND, Wake, add_triangles
from vrx_mj.runtime.sights import painted
from vrx_mj.runtime.warmup import announced
from vrx_mj.sensors.canvas import Canvas
from vrx_mj.sensors.displays import check_display_marks, displays_of
from vrx_mj.sensors.sea import SeaSkin
from vrx_mj.sensors.view import View

__all__ = ["Stage", "sterns"]

Paths = Mapping[str, FloatArray]

SAMPLES = 4
"""Per pixel, so that edges are smooth."""
STEEP = 0.5
"""Height of the view's axis [unit vector], negative, from which a picture is one from above."""
RELIEF = 5.0
"""How much more the slopes of waves shade a sea that is seen from above, where little of the sky mirrors in it."""
LIGHTER = 0.14
"""By what share of the sky such a sea is lighter."""
TRIANGLES = 4
"""Of foam: two between two pieces, and as many to spare."""


class Stage:
    """The world of boats that sail together, with a drawing context."""

    def __init__(self, company: Company, paths: Paths, size: tuple[int, int]) -> None:
        """Compile and open what is needed.

        Args:
            company: the boats and their world.
            paths: by boat, times [s], places [m] and headings [rad], (n, 4), of the whole recording.
            size: of the largest picture: width, height [pixels].

        Raises:
            RenderError: there is no way to draw here.
            StateError: the recording holds no world.
            RecordError: its rows are not of that world.
        """
        world = company.world
        parameters = world.tree
        self._model = drawing_model(world)
        check_columns(company, self._model)
        self._data = mujoco.MjData(self._model)
        self._sea = SeaSkin(self._model, parameters)
        self._displays = displays_of(parameters)
        self._wakes = [Wake(paths[boat], stern) for boat, stern in sterns(parameters) if boat in paths]
        self._foam_at = math.nan, (np.zeros((0, 3, 3)), np.zeros(0))
        width, height = size
        self._canvas = Canvas(
            self._model,
            width=width,
            height=height,
            fog=bool(parameters["scene"]["fog"]),
            samples=SAMPLES,
            spare=64 + len(self._wakes) * math.ceil(TRIANGLES * LASTS * PIECES_PER_SECOND),
        )
        self.level = float(parameters["sea"]["level"])
        """Mean height of the water [m]."""

    def draw(self, moment: Instant, eye: Eye, size: tuple[int, int]) -> ByteArray:
        """The picture (height, width, 3) of what an eye sees at a moment."""
        width, height = size
        model, data = self._model, self._data
        data.qpos[:] = moment.qpos
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)
        check_display_marks(self._displays, moment.marks[None])
        for geom, rgba in painted(model, self._displays, moment.marks, moment.time).items():
            model.geom_rgba[geom] = rgba
        view = view_of(eye, width, height)
        with announced(draw_surface, "the sea's pictures", 8):
            self._move_sea(view, moment.time)
        out = np.empty((height, width, 3), np.uint8)
        foam = self._foam(moment.time)
        self._canvas.draw(data, view, self._sea, out, lambda scene: add_triangles(scene, *foam))
        return out[::-1]

    def close(self) -> None:
        """Free the drawing context."""
        self._canvas.close()

    def _foam(self, time: float) -> tuple[FloatArray, FloatArray]:
        """The triangles of foam behind all hulls at a time [s]; the same for several pictures of it."""
        if self._foam_at[0] != time:
            wakes = self._wakes if self._sea.wet else ()
            found = [(np.zeros((0, 3, 3)), np.zeros(0)), *(wake.triangles(time, self._sea.height) for wake in wakes)]
            corners, shades = zip(*found, strict=True)
            self._foam_at = time, (np.concatenate(corners), np.concatenate(shades))
        return self._foam_at[1]

    def _move_sea(self, view: View, time: float) -> None:
        """The sea as it is seen; from above waves are shaded more, and do not glitter."""
        sun = np.array([0.0, 0.0, 1.0])
        if self._model.nlight:
            sun = np.asarray(-self._data.light_xdir[0], np.float64)
        above = view.rotation[2, 0] < -STEEP
        self._sea.move(view.position, RELIEF * sun if above else sun, *view.horizontal_range(), time)
        if above:
            mirrored, glitter = self._sea.palette.T
            np.clip(mirrored + LIGHTER, EDGE, 1.0 - EDGE, out=mirrored)
            glitter[:] = EDGE


def sterns(parameters: Mapping[str, Any]) -> Sequence[tuple[str, tuple[float, float]]]:
    """Boats and where their hulls leave foam, body axes [m]: at engines behind the middle."""
    boats = [boat["name"] for boat in parameters["boats"]]
    found = ((boats[row["hull"]], tuple(row["position"][:2])) for row in parameters["thrusters"])
    return list(dict.fromkeys((boat, (float(x), float(y))) for boat, (x, y) in found if x < 0.0))
