"""Quantities drawn for each trial: their form, their numbers, and the worlds that have them."""

import math

import pytest

from vrx_mj import compile_world
from vrx_mj.campaign.plan import Cell, Plan
from vrx_mj.campaign.vary import Quantity, check_vary, numbers_by_name, parse_vary
from vrx_mj.errors import VrxError

WAVES = {"extends": "ocean", "sea": {"model": "jonswap", "significant_height": 0.3, "peak_period": 4, "components": 9},
         "wind": {"mean_velocity": 2, "var_gain": 1}, "physics": {"profile": "marine"}}  # fmt: skip
SCORED = {"extends": "ocean", "georeference": {"latitude": 0, "longitude": 0, "elevation": 0, "heading": 0},
          "task": {"type": "station_keeping", "goal": [0, 0, 0]}}  # fmt: skip
FLAT = {"extends": "ocean", "sea": {"model": "none"}}


def test_ranges_are_read():
    assert parse_vary(["wind.mean=0..8", " *.hull.drag_linear.surge = -1.5 .. 2e1 "]) == (
        Quantity("wind.mean", 0.0, 8.0), Quantity("*.hull.drag_linear.surge", -1.5, 20.0),
    )  # fmt: skip


def test_a_seed_draws_the_same_whatever_else_is_drawn_and_all_seeds_fill_the_range():
    wind, waves = parse_vary(["wind.mean=2..6", "sea.significant_height=0.1..0.6"])
    small = Plan(("a:f",), ("w",), (7,), (wind,))
    large = Plan(("b:f", "a:f"), ("v", "w"), tuple(range(100)), (waves, wind))
    cell = Cell("a:f", "w", 7)
    drawn = small.trial(cell).parameters
    assert drawn == {"wind.mean": large.trial(cell).parameters["wind.mean"]}
    values = sorted(wind.value(seed) for seed in range(1000))
    assert all(2.0 <= value < 6.0 for value in values)
    off = max(abs((value - 2.0) / 4.0 - k / 1000) for k, value in enumerate(values))
    assert off < 1.95 / math.sqrt(1000)  # Kolmogorov and Smirnov, p = 0.001


def test_keys_of_files_and_patterns_stand_for_the_numbers_that_they_mean():
    values = {
        "sea.significant_height": 0.2, "sea.ramp": 3.0, "wind.mean_velocity": 5.0, "wind.var_gain": 0.5,
        "current.var_gain": 0.1, "current.var_time": 30.0, "*.thrusters.*.max_command": 0.7,
    }  # fmt: skip
    assert numbers_by_name(compile_world(WAVES | {"current": {"speed": 0.3}}), values) == {
        "sea.significant_height": 0.2, "sea.tau": 3.0, "wind.mean": 5.0, "wind.gain": 0.5,
        "current.gain": 0.1, "current.time_constant": 30.0,
        "wamv.thrusters.left.max_command": 0.7, "wamv.thrusters.right.max_command": 0.7,
    }  # fmt: skip


def test_a_height_scales_the_waves_of_a_world_that_its_file_has_with_that_height():
    written = compile_world({**WAVES, "sea": {**WAVES["sea"], "significant_height": 0.5}})
    scaled = compile_world(WAVES, parameters={"sea.significant_height": 0.5})
    for ours, theirs in zip(scaled.parameters.sea.waves, written.parameters.sea.waves, strict=True):
        assert ours.amplitude == pytest.approx(theirs.amplitude, rel=1e-12)
        assert (ours.frequency, ours.direction) == (theirs.frequency, theirs.direction)


@pytest.mark.parametrize(("text", "world", "message"), [
    ("wind.mean", "ocean", r"^invalid --vary 'wind.mean': NAME=LOW..HIGH is needed, as in wind.mean_velocity=0..8$"),
    ("wind.mean=3..3", "ocean", r"'wind.mean=3..3': the range is empty; write the smaller number first$"),
    ("wind.maen=0..3", "ocean", "^--vary wind.maen: world ocean has no parameter named 'wind.maen'; did you mean "),
    ("*.hull.weight=0..3", "ocean", "has no parameter named"),
    ("wind.gain=-1..3", "ocean", r"^--vary in ocean: invalid wind.gain \[m/s\]: must be at least 0, got -1$"),
    ("wamv.hull.mass=100..90000", "ocean", "=100..90000: with 90000 the boat wamv does not float in ocean$"),
    ("wamv.hull.mass=100..90000", SCORED, "=100..90000: with 90000 the boat wamv does not float in "),
    ("sea.significant_height=0..1", FLAT, "^--vary sea.significant_height: the sea of .* is flat or a Stokes wave;"),
    ("sea.significant_height=0.1..6", WAVES, r"a sea of 4 s breaks at 1.66 m, got 6 m$"),
])  # fmt: skip
@pytest.mark.filterwarnings("ignore::vrx_mj.VrxWarning")
def test_quantities_that_a_world_does_not_take_are_refused_in_one_line(text, world, message):
    with pytest.raises(VrxError, match=message) as told:
        check_vary(parse_vary([text]), [world])
    assert len(str(told.value).splitlines()) == 1


def test_a_quantity_is_given_once():
    with pytest.raises(VrxError, match=r"^--vary wind\.mean is given twice$"):
        parse_vary(["wind.mean=0..1", "wind.mean=0..2"])
    with pytest.raises(VrxError, match=r"^--vary wind\.mean_velocity is given twice$"):
        parse_vary(["wind.mean=0..1", "wind.mean_velocity=0..2"])


def test_a_number_is_drawn_by_one_quantity():
    vary = parse_vary(["*.hull.drag_linear.surge=40..60", "wamv.hull.drag_linear.*=10..20"])
    with pytest.raises(VrxError) as told:
        check_vary(vary, ["ocean"])
    both = " and ".join(f"--vary {quantity.name}" for quantity in vary)
    assert str(told.value) == f"{both} both draw wamv.hull.drag_linear.surge"
