"""A robot with its joints as controls: every link is where the joints put it."""

import warnings
from pathlib import Path

import mujoco
import numpy as np
import pytest
from typer.testing import CliRunner

from sdf_boats import BOATS
from urdf_boats import joint, link, robot
from vrx_mj.cli.robot import app
from vrx_mj.config.fleet import Order
from vrx_mj.errors import CommandError, VrxWarning
from vrx_mj.frames import compose, quaternion
from vrx_mj.mjcf.build import robot_of
from vrx_mj.mjcf.jointed import jointed_model

ARM = robot(
    link("a"), link("b", 1, '<visual><geometry><cylinder radius="0.1" length="2"/></geometry></visual>'), link("c"),
    joint("turn", "a", xyz="1 2 3", rpy="0.1 0.2 0.3", axis="0 0 1", limits=(0.5, 2)),
    joint("slide", "b", "a", "prismatic", xyz="0 1 0", axis="1 0 0", limits=(-0.5, 0.5)),
    joint("spin", "c", "b", "continuous", rpy="1 0 0", axis="0 1 0", limits=None),
)  # fmt: skip


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("arm.urdf").write_text(ARM, encoding="utf-8")


def shown(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VrxWarning)
        found = robot_of(Order(robot=name))
    return found, jointed_model(found)


def placed(model, values):
    data = mujoco.MjData(model)
    data.qpos[:] = values
    mujoco.mj_forward(model, data)
    return {model.body(index).name: data.body(index) for index in range(model.nbody)}


def test_links_are_where_their_joints_put_them():
    _, model = shown("arm.urdf")
    assert [model.actuator(index).name for index in range(model.nu)] == ["turn", "slide", "spin"]
    assert model.actuator_ctrlrange.tolist() == [[0.5, 2], [-0.5, 0.5], [-np.pi, np.pi]]
    a = compose((1, 2, 3, 0.1, 0.2, 0.3), (0, 0, 0, 0, 0, 1.2))
    b = compose(a, (0.3, 1, 0, 0, 0, 0))
    c = compose(compose(b, (0, 0, 0, 1, 0, 0)), (0, 0, 0, 0, -0.7, 0))
    bodies = placed(model, (1.2, 0.3, -0.7))
    for name, pose in {"a": a, "b": b, "c": c}.items():
        assert bodies[name].xpos == pytest.approx(pose[:3], abs=1e-12)
        assert abs(bodies[name].xquat @ quaternion(*pose[3:])) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("name", ["arm.urdf", "wamv", "cora", "catamaran.sdf"])
def test_at_rest_links_are_where_the_robots_table_has_them(name):
    if name.endswith(".sdf"):
        Path(name).write_text(BOATS[name.removesuffix(".sdf")](), encoding="utf-8")
    found, model = shown(name)
    bodies = placed(model, model.qpos0)
    for link_name, place in found.places.items():
        assert bodies[link_name].xpos == pytest.approx(place[:3], abs=1e-9)
    assert model.nu == model.njnt == sum(one.type != "fixed" and not one.locked for one in found.joints.values())


def test_without_a_display_it_says_so(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    result = CliRunner().invoke(app, ["show", "arm.urdf"])
    assert result.output == "boat: 4 links, 3 of 3 joints move\n"
    assert isinstance(result.exception, CommandError)
