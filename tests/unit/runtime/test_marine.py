"""Profile `marine`: water that streams, and boats that move through it and through the air."""

import numpy as np
import pytest

from integration.sailing import same_bits
from vrx_mj import Batch, Simulation, compile_world
from vrx_mj.errors import ConfigError

CALM = {"model": "none"}


def sim_of(**world):
    return Simulation(compile_world({"name": "bay", "physics": {"profile": "marine"}, "sea": CALM, **world}))


def test_a_boat_adrift_goes_with_the_current():
    sim = sim_of(current={"speed": 0.5, "direction": 30.0}, wind={"objects": []})
    sim.step(duration=300.0)
    stream = 0.5 * np.array([np.cos(np.pi / 6), 0.5])
    assert np.linalg.norm(sim.data.qvel[:2] - stream) < 1e-3 * 0.5
    assert not sim.forces("wamv")["thrust"].any()


@pytest.mark.parametrize(("profile", "creeps"), [("marine", False), ("vrx", True)])
def test_engines_at_rest_push_nothing_but_in_profile_vrx(profile, creeps):
    sim = sim_of(physics={"profile": profile}, wind={"objects": []})
    for command in (0.5, 0.0):  # also after they have pushed
        sim.step({"wamv": {"left": command, "right": command}}, duration=0.1)
    assert sim.forces("wamv")["thrust"].any() == creeps


def test_the_air_holds_back_a_boat_adrift():
    """Apparent wind: cx u |u| of the air against the drag of the water."""
    sim = sim_of(current={"speed": 0.5})
    sim.step(duration=300.0)
    boat = sim.forces("wamv")
    assert 0.49 < sim.data.qvel[0] < 0.4999
    assert boat["drag"][0] + boat["wind"][0] + boat["thrust"][0] == pytest.approx(0.0, abs=1e-4)


def test_a_long_swell_carries_a_boat_along():
    """The drift is with the waves, and of the order of Stokes'; VRX's is against them."""
    swell = {"model": "regular", "height": 2.48, "period": 20.0}
    sim = sim_of(sea=swell, wind={"objects": []})
    sim.step(duration=200.0)
    before = sim.observe()["wamv"].position.copy()
    sim.step(duration=400.0)
    speed = (sim.observe()["wamv"].position - before)[0] / 400.0
    omega = 2.0 * np.pi / 20.0
    assert 0.0 < speed < 3.0 * omega * omega**2 / 9.80665 * 1.24**2


def test_a_random_current_is_a_seed_s_and_a_row_s():
    world = compile_world(
        {"name": "bay", "physics": {"profile": "marine"}, "sea": {"model": "jonswap", "sea_state": 2},
         "current": {"speed": 0.3, "var_gain": 0.1, "tide": {"speed": 0.2}}}
    )  # fmt: skip
    batch, single = Batch(world, 2), Simulation(world)
    batch.reset(seed=4)
    batch.step(duration=2.0)
    for row in range(2):
        single.reset(4 + row)
        single.step(duration=2.0)
        assert batch.get_state(row).sha256 == single.get_state().sha256
    again = Simulation(world)
    again.set_state(single.get_state())
    for sim in (again, single):
        sim.step(duration=1.0)
    assert same_bits(again.data.qpos, single.data.qpos)


def test_a_saved_world_has_its_current(tmp_path):
    world = compile_world(
        {
            "name": "bay",
            "physics": {"profile": "marine"},
            "sea": CALM,
            "current": {"speed": 1, "profile": [[0, 1], [3, 0]]},
        }
    )
    again = type(world).load(world.save(tmp_path / "bay"))
    assert again.parameters.current == world.parameters.current
    assert again.sha256 == world.sha256


@pytest.mark.parametrize(
    ("world", "message"),
    [
        ({"current": {"speed": 1}}, "<world>: current: a current needs `physics: {profile: marine}`, got vrx"),
        (
            {"physics": {"profile": "marine"}, "current": {"profile": [[3, 1], [2, 1]]}},
            "<world>: current.profile[1]: a depth above 3 m, that of the previous row, is needed, got 2",
        ),
        (
            {"physics": {"profile": "marine"}, "current": {"profile": [[-3, 1], [2, 1]]}},
            "<world>: current.profile[0][0]: must be at least 0, got -3",
        ),
        (
            {"physics": {"profile": "marine"}, "current": {"speed": -1}},
            "<world>: current.speed: must be at least 0, got -1",
        ),
        (
            {"physics": {"profile": "marine", "gravity": 0}},
            "<world>: physics.gravity: marine needs gravity for its waves, got 0",
        ),
        (
            {"physics": {"profile": "vrx", "gravity": 0}, "sea": {"model": "jonswap", "sea_state": 2}},
            "<world>: physics.gravity: a sea of model jonswap needs gravity for its waves, got 0",
        ),
    ],
)
def test_what_cannot_be_a_current(world, message):
    with pytest.raises(ConfigError) as error:
        compile_world({"name": "bay", "physics": {"profile": "vrx"}, **world})
    assert str(error.value) == message
