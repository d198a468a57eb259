"""The wind of profile `marine` in runs: what is asked of it, its seeds, rows and states, and what it cannot be."""

import math

import numpy as np
import pytest

from integration.sailing import same_bits
from vrx_mj import Batch, Simulation, compile_world
from vrx_mj.errors import CommandError, ConfigError

CALM = {"model": "none"}
GUSTY = {"mean_velocity": 10.0, "direction": 90.0, "exponent": 0.11, "spectrum": "npd", "turning": 0.5,
         "var_direction": 5.0}  # fmt: skip


def world_of(**wind):
    return compile_world({"name": "bay", "physics": {"profile": "marine"}, "sea": CALM, "wind": wind})


def test_the_wind_that_is_asked_for_is_the_one_that_blew():
    sim = Simulation(world_of(**GUSTY))
    sim.reset(seed=3)
    for _ in range(5):
        sim.step(duration=0.5)
        velocity = sim.wind.velocity(sim.time)
        assert np.hypot(*velocity[:2]) == pytest.approx(sim.wind.speed)
        assert math.atan2(velocity[1], velocity[0]) == pytest.approx(sim.wind.direction)
        assert sim.row()[1] == sim.wind.speed
    assert abs(sim.wind.direction - math.pi / 2) > 0.01
    before = sim.wind.velocity([0.5, 1.0])
    sim.reset(seed=4)
    assert (sim.wind.velocity([0.5, 1.0]) != before).any()


def test_the_wind_is_weaker_near_the_water():
    wind = Simulation(world_of(mean_velocity=10.0, direction=0.0, exponent=0.11)).wind
    speeds = wind.velocity(0.0, z=[2.0, 10.0, 20.0])
    assert speeds[:, 0] == pytest.approx(10.0 * np.array([0.2, 1.0, 2.0]) ** 0.11)
    assert wind.velocity([0.0, 1.0]).shape == (2, 3)
    with pytest.raises(CommandError, match=r"^invalid t and z of shapes \(2,\), \(3,\): they cannot be broadcast$"):
        wind.velocity([0.0, 1.0], z=[1.0, 2.0, 3.0])
    with pytest.raises(CommandError, match=r"^invalid z inf: finite numbers are needed$"):
        wind.velocity(0.0, z=math.inf)


def test_gusts_are_a_seed_s_and_a_row_s_and_go_on_from_a_state():
    world = world_of(**GUSTY)
    batch, single = Batch(world, 2), Simulation(world)
    batch.reset(seed=4)
    batch.step(duration=2.0)
    for row in range(2):
        single.reset(4 + row)
        single.step(duration=2.0)
        assert batch.get_state(row).sha256 == single.get_state().sha256
        assert batch.wind[row] == pytest.approx(single.wind.velocity(2.0)[:2])
    again = Simulation(world)
    again.set_state(single.get_state())
    for sim in (again, single):
        sim.step(duration=1.0)
    assert same_bits(again.data.qpos, single.data.qpos)
    assert again.get_state().sha256 == single.get_state().sha256


def test_a_saved_world_has_its_wind(tmp_path):
    world = world_of(**GUSTY)
    again = type(world).load(world.save(tmp_path / "bay"))
    assert again.parameters.air == world.parameters.air
    assert again.sha256 == world.sha256


def test_the_gusts_of_a_spectrum_follow_from_speed_and_height():
    low, high = (world_of(mean_velocity=v, spectrum="npd").parameters.wind.gain for v in (5.0, 15.0))
    assert high > 3.0 * low
    still = world_of(spectrum="npd").parameters
    assert (still.wind.gain, still.air.gust_frequencies) == (0.0, ())


@pytest.mark.parametrize(
    ("world", "message"),
    [
        ({"wind": {"exponent": 0.1}}, "wind.exponent: exponent needs `physics: {profile: marine}`, got vrx"),
        ({"wind": {"turning": 1}}, "wind.turning: turning needs `physics: {profile: marine}`, got vrx"),
        (
            {"physics": {"profile": "marine"}, "wind": {"exponent": 0.1, "roughness": 0.001}},
            "wind.roughness: give exponent or roughness, not both",
        ),
        (
            {"physics": {"profile": "marine"}, "wind": {"roughness": 12}},
            "wind.roughness: a roughness below `height`, 10 m, is needed, got 12 m",
        ),
        (
            {"physics": {"profile": "marine"}, "wind": {"spectrum": "npd", "var_gain": 2}},
            "wind.var_gain: not allowed for `spectrum: npd`; allowed for gauss_markov",
        ),
        (
            {"physics": {"profile": "marine"}, "wind": {"spectrum": "kaimal"}},
            "wind.spectrum: expected gauss_markov or npd, got 'kaimal'",
        ),
        ({"physics": {"profile": "marine"}, "wind": {"height": 0}}, "wind.height: must be above 0, got 0"),
    ],
)
def test_what_cannot_be_a_wind(world, message):
    with pytest.raises(ConfigError) as error:
        compile_world({"name": "bay", "physics": {"profile": "vrx"}, **world})
    assert str(error.value) == f"<world>: {message}"
