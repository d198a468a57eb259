"""MuJoCo's window on a robot that stands still, its joints as sliders."""

import contextlib
import time

import mujoco
import numpy as np

from vrx_mj.signals import ended_by_signals

_PERIOD = 1 / 60
"""Wall time between two pictures [s]."""
_AZIMUTH, _ELEVATION = 140.0, -20.0
"""Where the camera starts [deg]."""


def show_joints(model: mujoco.MjModel) -> None:
    """Show a model whose joints are where its controls are, until the window is closed, or Ctrl-C."""
    from mujoco import viewer

    data = mujoco.MjData(model)
    data.ctrl[:] = data.qpos
    mujoco.mj_forward(model, data)
    with (
        ended_by_signals(),
        contextlib.suppress(KeyboardInterrupt),
        viewer.launch_passive(model, data, show_left_ui=False) as window,
    ):
        with window.lock():
            _look_at_all(window.cam, model, data)
        while window.is_running():
            data.qpos[:] = data.ctrl
            mujoco.mj_forward(model, data)
            window.sync()
            time.sleep(_PERIOD)


def _look_at_all(camera: mujoco.MjvCamera, model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Place the camera where it sees all that is drawn."""
    reach = model.geom_rbound[:, np.newaxis]
    low, high = (data.geom_xpos - reach).min(axis=0, initial=0.0), (data.geom_xpos + reach).max(axis=0, initial=0.0)
    camera.lookat[:] = (low + high) / 2
    camera.distance = 0.8 * np.linalg.norm(high - low)
    camera.azimuth, camera.elevation = _AZIMUTH, _ELEVATION
