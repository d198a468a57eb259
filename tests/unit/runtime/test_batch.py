"""A batch: its commands hold as those of a simulation do, and what is varied is a share of what the world has."""

import numpy as np
import pytest

import vrx_mj
from integration.sailing import GUSTY, boats, same_bits, water

SWELL = {"model": "pms", "gain": 0.6, "period": 6.0, "scale": 2.5, "tau": 0.5}
THRUST = {"left": 0.8, "right": 0.2}


@pytest.fixture(scope="module")
def world():
    return vrx_mj.compile_world(water(sea=SWELL, wind=GUSTY), fleet=boats((0.0, 0.0, 0.3)))


@pytest.fixture(scope="module")
def batch(world):
    return vrx_mj.Batch(world, 2, seed=3, threads=1)


@pytest.fixture(autouse=True)
def _at_the_start(batch):
    batch.vary(waves=1.0)
    batch.reset(seed=3)


def commands(batch):
    return np.tile([THRUST.get(name, 0.0) for _, name in batch.channels], (batch.n, 1))


def test_a_command_given_to_a_step_holds_for_all_of_it(world, batch):
    """Longer than the second after which VRX forgets a command."""
    sim = vrx_mj.Simulation(world, seed=3)
    sim.step({"a": THRUST}, duration=1.5)
    batch.step(commands(batch), duration=1.5)
    seen = sim.observe()["a"]
    assert same_bits(batch.features[0, 0, :7], [*seen.position, *seen.quaternion])


def test_a_command_given_by_itself_is_forgotten_after_its_timeout(world, batch):
    sim = vrx_mj.Simulation(world, seed=3)
    sim.command("a", **THRUST)
    sim.advance(150)
    batch.command(commands(batch))
    batch.advance(150)
    assert same_bits(batch.features[0, 0, :3], sim.observe()["a"].position)


def test_waves_are_a_share_of_the_world_s_however_often_they_are_varied(batch):
    batch.vary(waves=[0.5, 0.5])
    batch.vary(rows=[1], waves=4.0)
    batch.vary(rows=[1], waves=0.5)
    batch.reset(seed=[7, 7])
    batch.advance(100)
    assert same_bits(batch.features[0], batch.features[1])
    batch.vary(rows=[1], waves=1.0)
    batch.reset(seed=[7, 7])
    batch.advance(100)
    assert not same_bits(batch.features[0], batch.features[1])


def test_rows_have_the_seeds_that_follow_the_first(batch):
    assert batch.seeds.tolist() == [3, 4]
    batch.reset([1], seed=10)
    assert batch.seeds.tolist() == [3, 11]


NUMBERS = {"a.hull.drag_linear.surge": 90.0, "a.hull.wind.y": 1.5, "a.stations.0.radius": 0.25}


def test_a_row_with_numbers_of_its_own_is_a_world_compiled_with_them(world):
    batch = vrx_mj.Batch(world, 2, seed=3, threads=1)
    batch.vary(rows=[1], parameters=NUMBERS)
    batch.reset(seed=3)
    batch.step(commands(batch), duration=1.5)
    state = vrx_mj.State.from_bytes(batch.get_state(1).to_bytes())
    assert state.varied == {name: (value, vrx_mj.parameters(world)[name].value) for name, value in NUMBERS.items()}
    for row, changed in enumerate(
        (world, vrx_mj.compile_world(water(sea=SWELL, wind=GUSTY), fleet=boats((0.0, 0.0, 0.3)), parameters=NUMBERS))
    ):
        sim = vrx_mj.Simulation(changed, seed=3 + row)
        sim.step({"a": THRUST}, duration=1.5)
        seen = sim.observe()["a"]
        assert same_bits(batch.features[row, 0, :7], [*seen.position, *seen.quaternion])


@pytest.mark.parametrize(
    ("given", "error"),
    [
        (
            {"a.hull.drag_linear.serge": 1.0},
            "no parameter named 'a.hull.drag_linear.serge'; did you mean 'a.hull.drag_",
        ),
        ({"a.thrusters.left.timeout": 1.0}, "no parameter named 'a.thrusters.left.timeout'"),
        ({"a.hull.mass": 200.0}, "no parameter named 'a.hull.mass'"),
        ({"a.stations.0.radius": [0.1, -0.1]}, r"invalid a.stations.0.radius \[m\]: must be at least 0, got -0.1"),
        ({"a.stations.0.radius": [0.1, 0.1, 0.1]}, "invalid a.stations.0.radius "),
        ("a.stations.0.radius", "parameters takes a mapping of arrays"),
    ],
)
def test_numbers_of_rows_are_known_and_in_range(batch, given, error):
    with pytest.raises(vrx_mj.VrxError, match=f"^{error}"):
        batch.vary(parameters=given)
    assert batch.get_state(0).varied == {}
