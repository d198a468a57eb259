"""How episodes of all environments begin, what is drawn for them and told of it, and how lost boats end them."""

import gymnasium
import numpy as np
import pytest

import vrx_mj
from integration.variety import idle
from vrx_mj.rl import Env, ParallelEnv, TeamVectorEnv, VectorEnv
from vrx_mj.rl.options import VARIED
from vrx_mj.rl.problems import ALONE, PROBLEMS, TEAMS

DRAWN = {"wind_speed": (0, 6), "gusts": (0, 1), "waves": (0.5, 1), "mass": (0.9, 1.1), "thrust": (0.9, 1.1)}


def made(problem, n, **options):
    return (VectorEnv if problem in ALONE else TeamVectorEnv)(problem, n, **options)


def still(env):
    shape = env.action_space.shape if isinstance(env, VectorEnv) else (*env.present.shape, 4)
    return np.zeros(shape, np.float32)


@pytest.mark.parametrize("problem", [*ALONE, *TEAMS])
def test_boats_begin_afloat_and_hardly_heave(problem):
    """On flat water they stand still from the first step on; dropped from 0.1 m they fell by 0.28 m."""
    env = made(problem, 3, waves=0, mass=(0.6, 1.8), wind_speed=0, gusts=0)
    env.reset(seed=5)
    first = env._core.batch.features[..., 2].copy()
    assert np.ptp(first) > 0.01  # as heavy as they were drawn
    heights = [(env.step(still(env)), env._core.batch.features[..., 2].copy())[1] for _ in range(20)]
    assert np.abs(np.array(heights) - first).max() < (0.03 if problem in {"Formation", "Encounter"} else 1e-4)


@pytest.mark.parametrize("problem", ["StationKeeping", "Rendezvous"])
def test_boats_begin_on_the_waves(problem):
    """On waves 0.5 m high that are there at once, they keep within 5 cm of where they float on the surface."""
    env = made(problem, 6, waves=2.7)
    env.reset(seed=5)

    def over():
        return env._core.lost_boats._heights()

    first = over()
    assert np.ptp(env._core.batch.features[..., 2]) > 0.1
    heights = [(env.step(still(env)), over())[1] for _ in range(20)]
    assert np.abs(np.array(heights) - first).max() < 0.05


@pytest.mark.parametrize("problem", [*ALONE, *TEAMS])
def test_every_episode_has_a_sea_of_its_own_and_is_told_of_it(problem):
    if idle(problem):
        pytest.skip("calm")
    env = made(problem, 4, **DRAWN)
    _, info = env.reset(seed=2)
    for name in (*VARIED, "wind_direction"):
        assert len(np.unique(info[name].reshape(4, -1)[:, 0])) == 4, name
        assert info[f"_{name}"].all()
    assert info["wave_phase"].shape == (4, 3)
    seas = [env._core.batch.waves(row) for row in range(4)]
    np.testing.assert_array_equal([sea["phase"] for sea in seas], info["wave_phase"])
    for column in ("amplitude", "frequency", "wavenumber", "direction", "phase"):
        assert len({sea[column].tobytes() for sea in seas}) == 4, column
    drawn = env._core.problem.episode_facts()
    again = env.reset(seed=2)[1]
    for name in (*VARIED, *drawn):
        np.testing.assert_array_equal(again[name], info[name])
        assert not np.shares_memory(again[name], info[name])
    assert not np.array_equal(env.reset(seed=3)[1]["wave_phase"], info["wave_phase"])


def test_what_a_problem_varies_at_the_start_acts_in_that_episode_which_has_its_own_seed(monkeypatch):
    class Breezy(PROBLEMS["StationKeeping"]):
        def start(self, row, random):
            self.rows.vary(rows=[row], parameters={"wind.mean": 2.0 + row})
            return super().start(row, random)

        def __init__(self, rows):
            super().__init__(rows)
            self.rows = rows

    monkeypatch.setitem(PROBLEMS, "StationKeeping", Breezy)
    env = VectorEnv("StationKeeping", 3)
    env.reset(seed=5)
    batch = env._core.batch
    assert batch.wind[:, 0] == pytest.approx([2.0, 3.0, 4.0])
    assert len({*batch.seeds.tolist(), batch.world.seed}) == 4


def test_a_row_is_told_what_an_environment_alone_is_told():
    many, alone = VectorEnv("Wayfinding", 2, duration=0.2, **DRAWN), Env("Wayfinding", duration=0.2, **DRAWN)
    rows, own = many.reset(seed=4)[1], alone.reset(seed=4)[1]
    assert {name for name in rows if name[0] != "_"} == set(own)
    for name, value in own.items():
        np.testing.assert_array_equal(rows[name][0], value)
        assert isinstance(value, float | np.ndarray)
    for _ in range(2):
        told = many.step(still(many))[4]
        assert "waypoints" not in told
    told, own = many.step(still(many))[4], alone.reset()[1]  # the next step begins another
    for name, value in own.items():
        np.testing.assert_array_equal(told[name][0], value)


def test_a_boat_of_a_team_is_told_of_the_whole_world():
    env = ParallelEnv("Rendezvous", boats=3)
    _, infos = env.reset(seed=1)
    assert infos["wamv2"]["places"].shape == (2, 2)
    assert infos["wamv2"]["wave_phase"].shape == (3,)
    assert isinstance(infos["wamv3"]["wave_period"], float)
    assert infos["wamv1"]["places"] is not infos["wamv2"]["places"]


def test_a_sea_is_as_the_options_say_and_none_leaves_the_world_s():
    nominal = vrx_mj.Batch(VectorEnv("StationKeeping", 1)._core.batch.world, 1).waves(0)
    names = [name for name in VARIED if name.startswith("wave")]
    env = VectorEnv("StationKeeping", 1, **dict.fromkeys(names))
    env.reset(seed=1)
    assert env._core.batch.waves(0).tobytes() == nominal.tobytes()
    env = VectorEnv("StationKeeping", 1, wave_period=2, wave_band=0, wave_direction=1.0, wave_spread=0, wave_phase=0.5)
    _, info = env.reset(seed=1)
    sea = env._core.batch.waves(0)
    np.testing.assert_allclose(sea["frequency"], 2 * np.pi / 10)
    np.testing.assert_allclose(sea["direction"], [[np.cos(1), np.sin(1)]] * 3)
    assert sea["phase"].tolist() == [0.5] * 3
    assert (info["wave_period"][0], info["wave_direction"][0]) == (2.0, 1.0)


@pytest.mark.parametrize("reason", ["sunk", "capsized"])
@pytest.mark.parametrize("problem", [*ALONE, *TEAMS])
def test_a_lost_boat_ends_its_episode_and_forfeits_more_than_standing_by_costs(problem, reason):
    """Not so for the others: neither of the row beside, nor of the team."""
    env = made(problem, 2)
    env.reset(seed=3)
    height, roll = (-3.0, 0.0) if reason == "sunk" else (0.0, 2.0)
    pose = [*env._core.batch.features[0, 0, :2], height, roll, 0.0, 0.0]
    env._core.batch.set_boat(env._core.batch.boats[0], pose=pose, rows=[0])
    _, reward, ended, cut, info = env.step(still(env))
    assert info[reason].ravel().tolist() == [True] + [False] * (info[reason].size - 1)
    assert ended.ravel().tolist() == [True] + [False] * (ended.size - 1)
    assert not cut.any()
    _, beside, *_ = env.step(still(env))
    own, steps = reward.ravel()[0], env._core.most
    assert own < -19
    assert own <= steps * min(0.0, beside.ravel()[-1]) * (problem in {"StationKeeping", "Formation"})


def test_a_team_that_loses_a_boat_loses_its_share():
    env = TeamVectorEnv("Formation", 1, boats=4, reward="team")
    env.reset(seed=3)
    env._core.batch.set_boat("wamv1", pose=[*env._core.batch.features[0, 0, :2], -4.0, 0, 0, 0])
    _, reward, *_, info = env.step(still(env))
    assert reward[0, 1] == info["team_reward"][0]
    assert info["team_reward"][0] == pytest.approx(info["own_reward"][0].mean())
    assert info["own_reward"][0, 0] < -1000


@pytest.mark.parametrize(("robot", "limit"), [("wamv", "2.19"), ("skiff", "2.9"), ("cora", "10.7")])
def test_a_mass_with_which_the_boat_does_not_float_is_refused(robot, limit):
    with pytest.raises(gymnasium.error.Error) as caught:
        VectorEnv("StationKeeping", 1, fleet={"robot": robot, "sensors": "none"}, mass=(0.5, 30))
    name = VectorEnv("StationKeeping", 1, fleet={"robot": robot, "sensors": "none"})._core.batch.boats[0]
    text = f"at most {limit} is allowed; with more, an end of {name} is under water"
    assert str(caught.value) == f"invalid mass (0.5, 30): {text}"


def test_up_to_the_greatest_mass_a_boat_floats_and_beyond_it_does_not():
    """On end, and a third beyond, where all its volume is too little, down for good."""
    batch = VectorEnv("StationKeeping", 3)._core.batch
    batch.vary(mass=batch.largest_masses * [0.98, 1.05, 1.3], waves=0)
    batch.reset()
    poses, velocities = batch.afloat("wamv", (0, 0, 0))
    batch.set_boat("wamv", pose=poses, velocity=velocities)
    batch.step(np.zeros((3, 4)), duration=10.0)
    assert batch.features[0, 0, 2] == pytest.approx(poses[0, 2], abs=1e-3)
    upright = 1.0 - 2.0 * (batch.features[:, 0, 4:6] ** 2).sum(axis=1)
    assert upright[0] > 0.999
    assert upright[1] < 0.8
    assert batch.features[2, 0, 2] < -5.0


@pytest.mark.parametrize(
    ("sea", "kept"),
    [
        ({"model": "none"}, set()),
        ({"model": "jonswap", "significant_height": 0.4, "depth": 6.0}, {"wave_period", "wave_band"}),
        (
            {"model": "stokes5", "height": 0.5, "period": 4.0},
            {"wave_period", "wave_band", "wave_phase"},
        ),
    ],
)
def test_a_world_keeps_what_its_sea_does_not_let_differ(sea, kept):
    world = {"name": "bay", "sea": sea}
    rows = VectorEnv("StationKeeping", 2, world=world)
    _, info = rows.reset(seed=3)
    drawn = {"wave_period", "wave_band", "wave_direction", "wave_spread", "wave_phase"}
    assert drawn & {*info} == drawn - kept
    rows.step(np.zeros(rows.action_space.shape, np.float32))
    for name in kept:
        with pytest.raises(vrx_mj.VrxError, match="cannot be varied in"):
            VectorEnv("StationKeeping", 2, world=world, **{name: (0.5, 0.7)}).reset(seed=3)


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (
            {"wave_phase": "x"},
            "invalid wave_phase 'x': a number from -1e+06 to 1e+06, or a pair (low, high), is needed",
        ),
        (
            {"wave_period": 0},
            "invalid wave_period 0: a number from 0.001 to 1e+06, or a pair (low, high), is needed",
        ),
    ],
)
def test_seas_that_are_none(option, message):
    with pytest.raises(gymnasium.error.Error) as caught:
        VectorEnv("StationKeeping", 1, **option)
    assert str(caught.value) == message
