"""MuJoCo Warp takes every world that we ship; putting a model there needs no graphics processor."""

import mujoco
import pytest

import vrx_mj
from needs import WARP, needs
from vrx_mj.config.search import catalogue

pytestmark = [pytest.mark.slow, needs(WARP)]
WORLDS = list(catalogue("worlds"))
BY_DAY = WORLDS[::16]
BY_NIGHT = [name for name in WORLDS if name not in BY_DAY]


@pytest.mark.parametrize("names", [BY_DAY, pytest.param(BY_NIGHT, marks=pytest.mark.nightly)], ids=["day", "night"])
def test_it_takes_the_models(names, tmp_path):
    mujoco_warp = pytest.importorskip("mujoco_warp")

    for name in names:
        scene = vrx_mj.compile_world(name).save(tmp_path / name.replace("/", "_"), simulator="warp")
        model = mujoco.MjModel.from_xml_path(str(scene))
        taken = mujoco_warp.put_model(model)
        assert (taken.nq, taken.nv, taken.nbody) == (model.nq, model.nv, model.nbody), name
        assert taken.opt.timestep.numpy() == pytest.approx(model.opt.timestep), name


def test_it_refuses_what_is_left_out():
    mujoco_warp = pytest.importorskip("mujoco_warp")

    world = vrx_mj.compile_world("ocean")
    with pytest.raises(NotImplementedError):
        mujoco_warp.put_model(mujoco.MjModel.from_xml_string(world.mjcf, dict(world.assets)))
