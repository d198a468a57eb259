"""Random and regular seas in runs: what users ask for, seeds, and rows."""

import numpy as np
import pytest

from integration.sailing import same_bits, simulation
from vrx_mj import Batch, Simulation, compile_world
from vrx_mj.errors import CommandError
from vrx_mj.spectra import SPECTRA, jonswap

OCEAN = {"model": "jonswap", "significant_height": 0.5, "peak_period": 4.0, "spreading": 10.0}
POINT = {"x": 3.0, "y": -2.0, "z": -0.5, "t": 4.0}


@pytest.fixture(scope="module")
def world():
    return compile_world({"name": "bay", "sea": OCEAN})


def test_three_hours_have_the_significant_height(world):
    sim, times = Simulation(world), np.arange(0.0, 10800.0, 0.4)
    heights = []
    for seed in range(20):
        sim.reset(seed)
        heights.append(4.0 * sim.sea.height(0.0, 0.0, times).std())
    assert np.mean(heights) == pytest.approx(0.5, rel=0.02)
    assert np.ptp(heights) < 0.1


def test_a_seed_s_sea_is_its_own_and_comes_again(world):
    sim, seas = Simulation(world), []
    for seed in (1, 2, 1):
        sim.reset(seed)
        seas.append(sim.sea.height(np.arange(5.0), 0.0, 0.0))
    assert same_bits(seas[0], seas[2])
    assert not np.allclose(seas[0], seas[1])


def test_it_is_there_from_the_start_unless_a_ramp_is_given(world):
    sim = Simulation(world)
    assert np.abs(sim.sea.height(np.arange(50.0), 0.0, 0.0)).max() > 0.1
    grown = simulation(sea={**OCEAN, "ramp": 3.0}).sea
    assert not grown.height(np.arange(50.0), 0.0, 0.0).any()


def test_rows_of_a_batch_have_the_seas_of_their_seeds(world):
    batch, single = Batch(world, 3), Simulation(world)
    batch.reset(seed=5)
    batch.step(duration=1.0)
    for row in range(3):
        single.reset(5 + row)
        single.step(duration=1.0)
        assert batch.get_state(row).sha256 == single.get_state().sha256
        again = Simulation(world)
        again.set_state(batch.get_state(row))
        again.step(duration=0.5)
        single.step(duration=0.5)
        assert again.get_state().sha256 == single.get_state().sha256


def test_rows_share_the_waves_until_their_lengths_or_directions_differ(world):
    """And the sea is the sum of what `waves` gives, whichever way it is stored: in numbers of 8 bytes, or whole."""
    batch, points, turned = Batch(world, 3), np.linspace(-20.0, 20.0, 4), np.linspace(0.0, 6.0, 60)
    x, y = np.broadcast_arrays(points, points[::-1])
    sizes = []
    for change in ({}, {"waves": [0.5, 1.0, 0.7]}, {"rows": [1], "wave_phases": turned}, {"wave_period": [1, 1.1, 1]}):
        batch.vary(**change)
        batch.reset(seed=5)
        batch.step(duration=0.5)
        found = batch.sea_height(np.tile(x, (3, 1)), np.tile(y, (3, 1)))
        for row in range(3):
            own = batch.waves(row)
            along = own["direction"][:, :1] * x + own["direction"][:, 1:] * y
            angle = own["wavenumber"][:, None] * along - own["frequency"][:, None] * 0.5 + own["phase"][:, None]
            np.testing.assert_allclose(found[row], own["amplitude"] @ np.cos(angle), atol=1e-13)
        stacks = batch._rows.stacks
        sizes.append(sum(stacks[name].nbytes for name in ("waves", "own_waves")))
    table = batch.waves(0).nbytes
    assert sizes == [table + 3 * 8 * 121] * 3 + [3 * table]


def test_phases_that_were_given_stay(world):
    batch = Batch(world, 2)
    batch.vary(rows=[1], wave_phases=np.zeros(60))
    batch.reset(seed=5)
    heights = batch.sea_height(np.zeros((2, 1)), np.zeros((2, 1)))[:, 0]
    assert heights[1] == pytest.approx(batch.waves(1)["amplitude"].sum())
    assert abs(heights[0]) < 0.7 * heights[1]


def test_what_cannot_be_varied():
    shallow = compile_world({"name": "bay", "sea": {**OCEAN, "depth": 5.0}})
    with pytest.raises(CommandError, match=r"^wave_period cannot be varied in shallow water$"):
        Batch(shallow, 2).vary(wave_period=2.0)
    stokes = compile_world({"name": "bay", "sea": {"model": "stokes5", "height": 0.5, "period": 4.0}})
    with pytest.raises(CommandError, match=r"^waves cannot be varied in a Stokes wave$"):
        Batch(stokes, 2).vary(waves=[1.0, 2.0])
    with pytest.raises(CommandError, match=r"^wave_phases cannot be varied in a Stokes wave$"):
        Batch(stokes, 2).vary(wave_phases=np.zeros(5))
    Batch(stokes, 2).vary(wave_direction=1.0)


@pytest.mark.parametrize(("name", "shape"), [("velocity", (3,)), ("acceleration", (3,)), ("pressure", ())])
def test_the_water_at_points_is_that_at_each(world, name, shape):
    ask = getattr(Simulation(world).sea, name)
    z = np.array([-0.1, -1.0, -7.0])
    found = ask(POINT["x"], POINT["y"], z[:, None], np.array([4.0, 5.0]))
    assert found.shape == (3, 2, *shape)
    assert same_bits(found[1, 0], ask(POINT["x"], POINT["y"], -1.0, 4.0))
    with pytest.raises(CommandError, match=r"^invalid x, y, z and t of shapes \(\), \(2,\), \(3,\), \(\): they"):
        ask(0.0, np.zeros(2), z, 0.0)


def test_pressure_moves_water(world):
    """Euler's equation along the east, for waves of small slope."""
    sea = simulation(sea={**OCEAN, "significant_height": 1e-3}).sea
    x, y, z, t = POINT.values()
    by_x = (sea.pressure(x + 1e-3, y, z, t) - sea.pressure(x - 1e-3, y, z, t)) / 2e-3
    assert by_x == pytest.approx(-1025.0 * sea.acceleration(**POINT)[0], rel=0.02)
    assert sea.slope(x, y, t).shape == (2,)


def test_a_sea_of_five_hundred_waves_runs():
    sim = simulation(sea={**OCEAN, "components": 500})
    sim.step(duration=0.5)
    assert np.isfinite(sim.data.qpos).all()


def test_a_saved_world_has_its_sea(world, tmp_path):
    again = type(world).load(world.save(tmp_path / "bay"))
    assert again.sha256 == world.sha256
    one, other = Simulation(world), Simulation(again)
    assert same_bits(one.sea.height(1.0, 2.0, 3.0), other.sea.height(1.0, 2.0, 3.0))


def test_a_stokes_wave_has_high_crests_and_flat_troughs():
    sea = simulation(sea={"model": "stokes5", "height": 1.0, "period": 4.978639, "depth": 10.0}).sea
    heights = sea.height(np.linspace(0.0, 36.6, 4000), 0.0, 0.0)
    assert heights.max() == pytest.approx(0.5279, abs=1e-3)
    assert np.ptp(heights) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("model", SPECTRA)
def test_every_spectrum_has_its_height_and_the_phases_of_its_seed(model, tmp_path):
    (tmp_path / "tank.csv").write_text("0.1 0\n0.25 2\n0.5 0\n", encoding="utf-8")
    keys = {"tma": {"depth": 8.0}, "file": {"file": str(tmp_path / "tank.csv")}}.get(model, {})
    sea = {"model": model, "significant_height": 0.5, "peak_period": 4.0, **keys}
    batch = Batch(compile_world({"name": "bay", "sea": sea}), 2)
    batch.reset(seed=5)
    one, other = batch.waves(0), batch.waves(1)
    assert 4.0 * np.sqrt((one["amplitude"] ** 2).sum() / 2.0) == pytest.approx(0.5, rel=0.1)
    assert not np.isclose(one["amplitude"], other["amplitude"]).all()
    assert abs(np.exp(1j * one["phase"]).mean()) < 0.5  # all 0 would give 1
    assert not np.isclose(one["phase"], other["phase"]).any()
    assert not np.isclose(batch.sea_height(np.zeros((2, 1)), np.zeros((2, 1))), one["amplitude"].sum()).any()
    batch.vary(rows=[0], wave_phases=np.zeros(60))
    fixed = compile_world({"name": "bay", "sea": {**sea, "amplitudes": "fixed"}})
    assert same_bits(batch.waves(0)["amplitude"], np.array([wave.amplitude for wave in fixed.parameters.sea.waves]))


def _gaussian_deviation(record):
    """Standard deviation of Hs / Hs in records of `record` [s] of OCEAN: half of that of m0, int S^2 df / (m0^2 T)."""
    peak = 2.0 * np.pi / 4.0
    omega = np.linspace(0.25 * peak, 6.0 * peak, 20_000)
    density = np.array([jonswap(peak)(each) for each in omega])
    return 0.5 * np.sqrt(2.0 * np.pi * np.trapezoid(density**2, omega) / np.trapezoid(density, omega) ** 2 / record)


@pytest.mark.parametrize("number", [60, 200])
@pytest.mark.parametrize("record", [600.0, 3600.0])
def test_energies_and_beats_make_the_deviation_of_a_gaussian_sea(number, record):
    """Var m0 of records: that of the energies drawn, a^4 / 4 over the shape, and of the beats of all pairs of waves."""
    waves = compile_world({"sea": {**OCEAN, "components": number, "record": record}}).parameters.sea.waves
    hertz, shapes = np.array([(wave.frequency / (2.0 * np.pi), wave.energy_shape) for wave in waves]).T
    beats = (np.sinc((hertz[:, None] - hertz) * record) ** 2).sum() - number
    found = 0.5 * np.sqrt((1.0 / shapes).sum() + beats) / number
    assert found == pytest.approx(_gaussian_deviation(record), rel=0.02)


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("number", [60, 200])
def test_records_of_four_hundred_seeds_scatter_as_those_of_a_gaussian_sea_do(number, subtests):
    for record, band in ((600.0, 0.2), (3600.0, 0.15)):
        with subtests.test(record=record):
            world = compile_world({"sea": {**OCEAN, "components": number, "record": record}})
            fixed = compile_world({"sea": {**OCEAN, "components": number, "amplitudes": "fixed"}})
            drawn, before = (_records(each, np.arange(0.0, record, 0.8)) for each in (world, fixed))
            assert np.std(drawn["hs"]) / 0.5 == pytest.approx(_gaussian_deviation(record), rel=band)
            assert np.mean(drawn["hs"]) == pytest.approx(0.5, rel=0.01)
            for name in ("period", "kurtosis", "group"):
                assert np.mean(drawn[name]) == pytest.approx(np.mean(before[name]), rel=0.02)


def _records(world, times):
    """Hs [m], mean period between upward crossings [s], kurtosis and mean run of crests over Hs / 2, of 400 seeds."""
    sim, found = Simulation(world), {"hs": [], "period": [], "kurtosis": [], "group": []}
    for seed in range(400):
        sim.reset(seed)
        heights = sim.sea.height(0.0, 0.0, times)
        deviation = heights.std()
        starts = np.flatnonzero((heights[:-1] < 0.0) & (heights[1:] >= 0.0))
        high = np.maximum.reduceat(heights, starts) > 2.0 * deviation
        runs = np.count_nonzero(high[1:] & ~high[:-1]) + high[0]
        found["hs"].append(4.0 * deviation)
        found["period"].append((times[1] - times[0]) * (starts[-1] - starts[0]) / (len(starts) - 1))
        found["kurtosis"].append(np.mean(heights**4) / deviation**4)
        found["group"].append(np.count_nonzero(high) / max(runs, 1))
    return found
