"""The sea and the wind that users ask for are those that push."""

import math

import numpy as np
import pytest

from integration.sailing import CALM, GUSTY, ROUGH, same_bits, simulation
from vrx_mj.errors import CommandError
from vrx_mj.model.world import tree_of

BUOY = {"name": "buoy", "model": "polyform_a5", "pose": [5, 5, 0, 0, 0, 0]}


# The sea


def test_many_heights_are_the_heights_one_by_one():
    sea = simulation().sea
    random = np.random.default_rng(0)
    x, y, t = random.uniform(-100, 100, (2, 50)), random.uniform(-100, 100, (2, 50)), random.uniform(0, 60, (2, 50))
    one_by_one = [float(sea.height(*point)) for point in zip(x.flat, y.flat, t.flat, strict=True)]
    assert same_bits(sea.height(x, y, t).ravel(), one_by_one)


def test_heights_have_the_shape_of_their_arguments():
    sea = simulation().sea
    assert sea.height(1.0, 2.0, 3.0).shape == ()
    assert sea.height(np.zeros((4, 1)), np.zeros(3), 0.0).shape == (4, 3)
    assert sea.height([], [], 1.0).shape == (0,)
    with pytest.raises(
        CommandError, match=r"^invalid x, y and t of shapes \(3,\), \(4,\), \(\): they cannot be broadcast$"
    ):
        sea.height(np.zeros(3), np.zeros(4), 0.0)


def test_heights_are_the_waves_that_the_world_was_made_of():
    """Slow numpy: ramp times the sum of cosines."""
    sim = simulation()
    x, y, t = 13.0, -7.0, 4.2
    height = 0.0
    for wave in tree_of(sim.world.parameters)["sea"]["waves"]:
        along = wave["direction"][0] * x + wave["direction"][1] * y
        height += wave["amplitude"] * math.cos(wave["wavenumber"] * along - wave["frequency"] * t)
    assert sim.sea.height(x, y, t) == pytest.approx((1 - math.exp(-t / ROUGH["tau"])) * height, abs=1e-12)


def test_waves_grow_from_nothing():
    sea = simulation().sea
    times = np.linspace(0.0, 60.0, 6001)
    grown = np.abs(sea.height(0.0, 0.0, times))
    assert grown[0] == 0.0
    assert grown[:20].max() < 0.11 * grown.max()  # 1 - exp(-0.2 / 2)
    assert sea.height(3.0, 2.0, 1e4) == pytest.approx(simulation(sea={**ROUGH, "tau": 0.0}).sea.height(3.0, 2.0, 1e4))


def test_a_calm_sea_is_flat():
    assert not simulation(sea=CALM).sea.height(np.arange(9.0), 3.0, np.arange(9.0)).any()


def test_a_sea_that_was_looked_at_earlier_is_the_same():
    """Height depends on place and time alone, not on the run."""
    sim = simulation()
    before = sim.sea.height(np.arange(9.0), 3.0, 7.0)
    sim.step(duration=5.0)
    assert same_bits(sim.sea.height(np.arange(9.0), 3.0, 7.0), before)


def test_the_height_that_lifts_a_buoy_is_the_seas():
    sim = simulation(objects=[BUOY])
    for _ in range(20):
        sim.advance(7)
        place = sim.observe_object("buoy").position.copy()
        sim.advance(1)
        assert sim._live.arrays.float_state["height"][0] == sim.sea.height(place[0], place[1], sim.time)


# The wind


def speeds(sim, steps):
    """The speed that each step applied."""
    out = []
    for _ in range(steps):
        sim.advance(1)
        out.append(float(sim._live.arrays.wind_state["speed"][0]))
    return out


@pytest.mark.parametrize("timestep", [0.01, 0.004, 0.003])
def test_the_wind_is_the_one_that_pushed(timestep):
    sim = simulation(timestep=timestep)
    asked = sim.wind.velocity(timestep * np.arange(1, 301))  # before it blows
    blown = np.array(speeds(sim, 300))
    angle = math.radians(GUSTY["direction"])
    assert asked[:, 0] == pytest.approx(blown * math.cos(angle), abs=1e-12)
    assert asked[:, 1] == pytest.approx(blown * math.sin(angle), abs=1e-12)
    assert not asked[:, 2].any()
    assert same_bits(sim.wind.velocity(timestep * np.arange(1, 301)), asked)
    assert np.std(blown) > 0.1


def test_the_wind_now_is_that_of_the_last_step():
    sim = simulation()
    angle = math.radians(GUSTY["direction"])
    for _ in range(300):
        sim.advance(1)
        now = sim._live.arrays.wind_state["speed"][0]
        assert sim.wind.velocity(sim.time)[:2] == pytest.approx([now * math.cos(angle), now * math.sin(angle)])


def test_the_wind_follows_the_seed_of_a_reset_and_of_a_state():
    sim = simulation(seed=1)
    first, state = sim.wind.velocity(3.0), sim.get_state()
    sim.reset(2)
    assert not same_bits(sim.wind.velocity(3.0), first)
    sim.set_state(state)
    assert same_bits(sim.wind.velocity(3.0), first)


def test_at_the_start_the_wind_is_its_mean():
    assert np.linalg.norm(simulation().wind.velocity(0.0)) == pytest.approx(GUSTY["mean_velocity"])
    assert simulation().wind.velocity([0.0, 1.0]).shape == (2, 3)
    assert simulation().wind.velocity(np.zeros((2, 5))).shape == (2, 5, 3)


def test_a_world_without_wind_has_none():
    assert not simulation(wind=None).wind.velocity(np.arange(5.0)).any()
    sim = simulation(wind=None)
    sim.advance(10)
    assert not sim.forces("a")["wind"].any()


def test_only_what_the_world_lists_is_blown_at():
    unlisted = {**GUSTY, "objects": []}
    sim = simulation(wind=unlisted)
    sim.advance(10)
    assert not sim.forces("a")["wind"].any()
    listed = simulation()
    listed.advance(10)
    assert listed.forces("a")["wind"].any()


def test_a_steady_wind_pushes_as_the_formula_says():
    """6 m/s from abeam, 0.5 N s2/m2: 18 N."""
    steady = {**GUSTY, "direction": 90, "var_gain": 0.0}
    sim = simulation({"boats": [{"name": "a", "pose": [0, 0, -0.1, 0, 0, 0]}]}, sea=CALM, wind=steady)
    assert sim.forces("a")["wind"][:3] == pytest.approx([0.0, 18.0, 0.0])


def test_the_direction_of_the_wind_is_where_it_blows_to():
    assert simulation(wind=GUSTY).wind.direction == pytest.approx(math.radians(120.0))
