import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pytest

from vrx_mj.errors import UnknownNameError
from vrx_mj.mjcf.compile import compile_world

TITLES = {"warp": "MuJoCo Warp", "mjx": "MJX"}
OTHERS = pytest.mark.parametrize("simulator", ["warp", "mjx"])


@pytest.fixture(scope="module")
def world():
    """A held boat with a ball shooter, whose task counts what it touches."""
    return compile_world("vrx2023/scan_dock_deliver_task")


def accelerations(model):
    """Number of contacts with the boat across a buoy, and accelerations of all but the ball, which sleeps in MuJoCo."""
    data = mujoco.MjData(model)
    data.joint("wamv/free").qpos[:3] = model.body("robotx_light_buoy_rgb/base_link").pos
    data.qvel[:] = 0.1 * np.cos(np.arange(model.nv))
    mujoco.mj_forward(model, data)
    balls = [model.body(number).name.endswith("ball_shooter/link") for number in range(model.nbody)]
    assert sum(balls) == 1
    return data.ncon, data.qacc[~np.array(balls)[model.dof_bodyid]]


@OTHERS
def test_bodies_accelerate_as_in_mujoco(world, simulator, tmp_path):
    scene = world.save(tmp_path, simulator=simulator)
    contacts, expected = accelerations(mujoco.MjModel.from_xml_string(world.mjcf, dict(world.assets)))
    other_contacts, found = accelerations(mujoco.MjModel.from_xml_path(str(scene)))
    assert contacts == other_contacts > 0
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


@OTHERS
def test_what_is_refused_is_left_out_and_named_in_the_header(world, simulator, tmp_path):
    text = world.save(tmp_path, simulator=simulator).read_text(encoding="utf-8")
    root = ET.fromstring(text)
    assert not {"sleep", "sleep_tolerance", "autoreset"} & {key for element in root.iter() for key in element.attrib}
    assert bool(root.findall("sensor/contact")) == (simulator == "warp")
    header, *others = text.split("-->")
    assert f"compiled by vrx_mj for {TITLES[simulator]}." in header
    assert len(others) == 1
    assert ("contact sensors" in header) == (simulator == "mjx")
    assert "Simulation.load" not in text  # there is nothing to load
    assert {path.name for path in tmp_path.iterdir()} == {"scene.xml", "assets"}


def test_an_unknown_simulator_is_refused(world, tmp_path):
    with pytest.raises(UnknownNameError, match="no simulator named 'drake'; known: mujoco, warp, mjx"):
        world.save(tmp_path, simulator="drake")
