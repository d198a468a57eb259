"""MuJoCo Warp takes every world that we ship; putting a model there needs no graphics processor."""

import mujoco
import pytest

import vrx_mj
from needs import WARP, needs
from vrx_mj.config.search import catalogue

pytestmark = [pytest.mark.slow, needs(WARP)]
WORLDS = list(catalogue("worlds"))
BY_DAY = WORLDS[::16]
BY_NIGHT = [pytest.param(world, marks=pytest.mark.nightly) for world in WORLDS if world not in BY_DAY]


@pytest.mark.parametrize("name", [*BY_DAY, *BY_NIGHT])
def test_it_takes_the_model(name, tmp_path):
    mujoco_warp = pytest.importorskip("mujoco_warp")

    scene = vrx_mj.compile_world(name).save(tmp_path, simulator="warp")
    model = mujoco.MjModel.from_xml_path(str(scene))
    taken = mujoco_warp.put_model(model)
    assert (taken.nq, taken.nv, taken.nbody) == (model.nq, model.nv, model.nbody)
    assert taken.opt.timestep.numpy() == pytest.approx(model.opt.timestep)


def test_it_refuses_what_is_left_out():
    mujoco_warp = pytest.importorskip("mujoco_warp")

    world = vrx_mj.compile_world("ocean")
    with pytest.raises(NotImplementedError):
        mujoco_warp.put_model(mujoco.MjModel.from_xml_string(world.mjcf, dict(world.assets)))
