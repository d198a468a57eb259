"""A batch: its commands hold as those of a simulation do, and what is varied is a share of what the world has."""

import copy

import numpy as np
import pytest

import vrx_mj
from integration.sailing import GUSTY, boats, same_bits, water
from vrx_mj.errors import CommandError

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


MARINE = {
    "physics": {"profile": "marine"},
    "sea": {"model": "jonswap", "significant_height": 0.4, "peak_period": 4.0, "components": 12},
    "wind": {"mean_velocity": 5.0, "direction": 120, "spectrum": "npd", "var_direction": 0.1},
    "current": {"speed": 0.3, "profile": [[0, 1], [5, 0.5]], "var_gain": 0.1},
}
PLACES = (0.0, 0.0, 0.3), (20.0, 0.0, 0.3)


@pytest.mark.parametrize("sea_and_wind", [water(sea=SWELL, wind=GUSTY), MARINE])
def test_a_row_with_numbers_of_its_own_is_a_world_compiled_with_them(sea_and_wind):
    """All numbers of weather and of one of two boats of a kind, at once; later ones are added to the earlier."""
    world = vrx_mj.compile_world(sea_and_wind, fleet=boats(*PLACES))
    numbers = {
        name: 0.98 * number.value
        for name, number in vrx_mj.parameters(world).items()
        if not (name.startswith("b.") or "battery" in name or number.in_mjcf)
    }
    batch = vrx_mj.Batch(world, 3, seed=3, threads=1)
    batch.vary(rows=[1], parameters={"wind.mean": 1.0, "sea.level": 2.0})
    first, *rest = numbers
    batch.vary(rows=[1], parameters={name: numbers[name] for name in rest})
    batch.vary(rows=[1], parameters={first: numbers[first]})
    batch.reset(seed=3)
    copied = copy.deepcopy(batch)
    changed = vrx_mj.compile_world(sea_and_wind, fleet=boats(*PLACES), parameters=numbers)
    for own, row, one in ((batch, 0, world), (batch, 1, changed), (copied, 1, changed), (batch, 2, world)):
        if own.time[row] == 0.0:
            own.step(commands(own), duration=1.5)
        sim = vrx_mj.Simulation(one, seed=3 + row)
        sim.step(dict.fromkeys("ab", THRUST), duration=1.5)
        assert same_bits(own.get_state(row).mujoco, sim.get_state().mujoco)
        heights = own.sea_height(np.zeros((3, 1)), np.ones((3, 1)))
        assert heights[row, 0] == sim.sea.height(0.0, 1.0, sim.time)


@pytest.mark.parametrize(
    ("given", "error"),
    [
        (
            {"a.hull.drag_linear.serge": 1.0},
            "no parameter named 'a.hull.drag_linear.serge'; did you mean 'a.hull.drag_",
        ),
        ({"a.hull.mass": 200.0}, "a.hull.mass cannot differ between runs of a world: compile a world with it"),
        ({"a.thrusters.left.name": 1.0}, "no parameter named 'a.thrusters.left.name'"),
        ({"a.stations.0.radius": [0.1, -0.1]}, r"invalid a.stations.0.radius \[m\]: must be at least 0, got -0.1"),
        ({"a.stations.0.radius": [0.1, 0.1, 0.1]}, "invalid a.stations.0.radius "),
        ("a.stations.0.radius", "parameters takes a mapping of arrays"),
    ],
)
def test_numbers_of_rows_are_known_and_in_range(batch, given, error):
    with pytest.raises(vrx_mj.VrxError, match=f"^{error}"):
        batch.vary(parameters=given)
    assert batch.get_state(0).varied == {}


@pytest.mark.parametrize("shapes", [((2,), (2,)), ((3, 1), (3, 1)), ((2, 1), (2, 2))])
def test_points_of_heights_are_as_many_for_each_row(batch, shapes):
    with pytest.raises(CommandError, match=r"^invalid x and y of shapes .*: \(2, points\) of both is needed$"):
        batch.sea_height(*map(np.zeros, shapes))


@pytest.mark.parametrize("name", ["n", "threads"])
@pytest.mark.parametrize(("count", "needed"), [(0, "a whole number above 0 is needed"), (1.5, "a whole number above 0"),
                                               (10**6 + 1, "at most 1000000 are possible")])  # fmt: skip
def test_numbers_of_rows_and_threads_have_their_range(world, name, count, needed):
    with pytest.raises(CommandError, match=rf"^invalid {name} {count}: {needed}"):
        vrx_mj.Batch(world, **{"n": 1, name: count})


def test_phases_are_one_for_each_wave(batch):
    for given in (np.zeros(7), np.zeros((3, 3)), np.full(3, np.nan)):
        with pytest.raises(CommandError, match=r"^invalid wave_phases of shape .*, of finite numbers, "):
            batch.vary(wave_phases=given)
