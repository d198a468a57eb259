"""A robot with its joints as controls: every link is where the joints put it."""

import warnings
from pathlib import Path

import mujoco
import numpy as np
import pytest
from rerun.chunk import RrdReader
from typer.testing import CliRunner

from sdf_boats import BOATS
from urdf_boats import joint, link, robot
from vrx_mj.cli.robot import app
from vrx_mj.config.fleet import Order
from vrx_mj.errors import RecordError, VrxWarning
from vrx_mj.frames import compose, quaternion
from vrx_mj.mjcf.build import robot_of
from vrx_mj.mjcf.robots import jointed_model

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


@pytest.mark.parametrize(("kind", "limits", "slider"), [
    ("revolute", (-0.5, 9e9), (-0.5, 9e9)), ("revolute", (-9e9, 0.5), (-9e9, 0.5)),
    ("revolute", (-0.5, 1e10), (-np.pi, np.pi)), ("prismatic", (-1e16, 0.5), (-1, 1)),
])  # fmt: skip
def test_a_joint_without_an_end_has_a_short_slider(kind, limits, slider):
    """Limits of 1e10 and more, as Gazebo's 1e16, are none."""
    Path("one.urdf").write_text(robot(link("a"), joint("j", "a", kind=kind, limits=limits)), encoding="utf-8")
    assert shown("one.urdf")[1].actuator_ctrlrange.tolist() == [pytest.approx(slider)]


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
    assert model.nu == model.njnt == sum(one.type != "fixed" and not one.is_locked for one in found.joints.values())


@pytest.fixture
def no_display(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)


def poses(file):
    """Times [s], positions and quaternions (w, x, y, z) of what moves in a recording, by its entity."""
    found = {}
    for chunk in RrdReader(file).stream().filter(content="/robot/**", is_static=False):
        rows = chunk.to_record_batch().to_pydict()
        times = [time.total_seconds() for time in rows["sim_time"]]
        turns = np.squeeze(rows["Transform3D:quaternion"])[:, [3, 0, 1, 2]]
        found[chunk.entity_path] = times, np.squeeze(rows["Transform3D:translation"]), turns
    return found


def test_without_a_display_each_joint_moves_in_its_turn_in_a_recording(no_display):
    result = CliRunner().invoke(app, ["show", "arm.urdf"])
    assert result.output == (
        "boat: 4 links, 3 of 3 joints move\n"
        "no sliders, as the viewer cannot open: no display: neither DISPLAY nor WAYLAND_DISPLAY is set\n"
        "arm_joints.rrd: each joint moves in turn; open it with: rerun arm_joints.rrd\n"
    )
    _, model = shown("arm.urdf")
    recorded, data = poses("arm_joints.rrd"), mujoco.MjData(model)
    assert list(recorded) == ["/robot/base_link/a", "/robot/base_link/a/b", "/robot/base_link/a/b/c"]
    for joint_id, (times, places, turns) in enumerate(recorded.values()):
        body = int(model.jnt_bodyid[joint_id])
        assert (times[0], times[1], times[-1]) == (0.0, 2.0 * joint_id, 2.0 * joint_id + 2.0)
        low, high = model.actuator_ctrlrange[joint_id]
        rest = model.qpos0[joint_id]
        share = (np.array(times) - times[1]) / 2.0
        share[0] = 0.0
        values = np.interp(share, [0.0, 0.25, 0.75, 1.0], [rest, high, low, rest])
        for value, place, turn in zip(values, places, turns, strict=True):
            data.qpos[:] = model.qpos0
            data.qpos[joint_id] = value
            mujoco.mj_kinematics(model, data)
            outer, inner = data.body(model.body_parentid[body]), data.body(body)
            relative, back = np.zeros(4), np.zeros(4)
            mujoco.mju_negQuat(back, outer.xquat)
            mujoco.mju_mulQuat(relative, back, inner.xquat)
            assert place == pytest.approx(outer.xmat.reshape(3, 3).T @ (inner.xpos - outer.xpos), abs=1e-6)
            assert abs(relative @ turn) == pytest.approx(1.0, abs=1e-6)  # the file has float32


def test_a_recording_is_written_where_it_is_asked_for():
    result = CliRunner().invoke(app, ["show", "arm.urdf", "--record", "there.rrd"])
    assert result.output.splitlines()[1:] == [
        "no sliders: they need the viewer",
        "there.rrd: each joint moves in turn; open it with: rerun there.rrd",
    ]
    assert Path("there.rrd").stat().st_size > 1000
    refused = CliRunner().invoke(app, ["show", "arm.urdf", "--record", "missing/there.rrd"])
    assert isinstance(refused.exception, RecordError)
    assert str(refused.exception).startswith("cannot write the recording 'missing/there.rrd': ")
