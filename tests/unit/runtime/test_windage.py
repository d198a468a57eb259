"""Boats with areas in the wind, in runs."""

import shutil

import numpy as np
import pytest
from scipy.optimize import brentq

from vrx_mj import Batch, Simulation, compile_world
from vrx_mj.errors import ConfigError
from vrx_mj.packages import root

AREAS = "frontal_area: 0.4, lateral_area: 1.1, length: 2.4, height: 0.3"
THREE = f"{{{AREAS}, coefficients: [0.6, 0.9, 0.05]}}"


@pytest.fixture(autouse=True)
def _in_its_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def skiff(folder, windage):
    """The path in `folder` of a skiff's file with a windage."""
    shutil.copytree(root() / "assets" / "robots" / "skiff", folder / "skiff")
    file = folder / "skiff" / "robot.yaml"
    file.write_text(file.read_text(encoding="utf-8") + f"\nwindage: {windage}\n", encoding="utf-8")
    return "skiff/robot.yaml"


def world_of(robot, profile="marine", **wind):
    return compile_world(
        {"name": "bay", "physics": {"profile": profile}, "sea": {"model": "none"},
         "spawn": {"robot": robot}, "wind": {"mean_velocity": 10.0, "direction": 90.0} | wind}
    )  # fmt: skip


def test_a_beam_wind_drifts_a_boat_as_fast_as_drag_lets_it(tmp_path):
    """The root of the air's force and the water's drag, by a second hand; drag of the skiff's file."""
    sim = Simulation(world_of(skiff(tmp_path, THREE)))
    (boat,) = sim.boats
    drift = brentq(lambda v: 0.5 * 1.225 * 1.1 * 0.9 * (10.0 - v) ** 2 - 60.0 * v - 220.0 * v * v, 0.0, 10.0)
    sim.set_boat(boat, pose=(0, 0, -0.08, 0, 0, 0), velocity=(0, drift, 0, 0, 0, 0))
    forces = sim.forces(boat)
    assert forces["wind"][1] == pytest.approx(-forces["drag"][1], rel=1e-3)
    assert forces["wind"][3] < 0.0 < forces["wind"][1]  # it heels to lee


def test_a_boat_lies_over_in_a_beam_wind(tmp_path):
    robot = skiff(tmp_path, THREE)
    heel = []
    for speed in (0.0, 10.0):
        sim = Simulation(world_of(robot, mean_velocity=speed))
        sim.step(duration=3.0)
        w, x, y, z = sim.data.qpos[3:7]
        heel.append(np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)))
    assert heel[1] < heel[0] - 0.002


def test_rows_and_simulation_are_bit_equal_and_a_world_is_saved_with_it(tmp_path):
    world = world_of(skiff(tmp_path, f"{{{AREAS}, vessel: speed_boat}}"), exponent=0.11, spectrum="npd")
    batch, single = Batch(world, 2), Simulation(world)
    batch.reset(seed=4)
    batch.step(duration=1.0)
    single.reset(5)
    single.step(duration=1.0)
    assert batch.get_state(1).sha256 == single.get_state().sha256
    again = type(world).load(world.save(tmp_path / "bay"))
    assert again.parameters.hulls == world.parameters.hulls
    assert again.sha256 == world.sha256


def test_other_profiles_and_worlds_with_coefficients_have_no_windage(tmp_path):
    robot = skiff(tmp_path, THREE)
    assert world_of(robot, "vrx").parameters.hulls[0].windage is None
    listed = world_of(robot, objects=[{"model": robot, "coefficients": [1, 2, 3]}]).parameters.hulls[0]
    assert (listed.windage, listed.wind) == (None, (1.0, 2.0, 3.0))
    assert world_of(robot, objects=[]).parameters.hulls[0].windage is None
    assert world_of(robot).parameters.hulls[0].windage.coefficients == (0.6, 0.9, 0.05)


@pytest.mark.parametrize(
    ("windage", "message"),
    [
        (f"{{{AREAS}}}", "windage.coefficients: required unless curve, isherwood or vessel is given"),
        (
            f"{{{AREAS}, isherwood: {{breadth: 1, perimeter: 0, superstructure_area: -1, masts: 1.5}}}}",
            "windage.isherwood.perimeter: must be above 0, got 0",
        ),
        (
            f"{{{AREAS}, isherwood: {{breadth: 1, perimeter: 6, superstructure_area: 90}}}}",
            "windage.isherwood.superstructure_area: must be at most lateral_area",
        ),
        (
            f"{{{AREAS}, vessel: ferry, coefficients: [1, 1, 0]}}",
            "windage.vessel: give coefficients, curve, isherwood or vessel, not coefficients and vessel",
        ),
        (
            f"{{{AREAS}, curve: [[0, -1, 0, 0], [90, 0, 1, 0]]}}",
            "windage.curve: angles from 0 to 180 are needed, got 0 to 90",
        ),
        (
            f"{{{AREAS}, curve: [[0, -1, 0, 0], [90, 0, 1, 0], [80, 0, 1, 0], [180, 1, 0, 0]]}}",
            "windage.curve[2]: an angle above 90, that of the previous row, is needed, got 80",
        ),
        (
            f"{{{AREAS}, curve: [[0, -1, 0.1, 0], [180, 1, 0, 0]]}}",
            "windage.curve[0]: cy and cn of 0 are needed at 0, where the sides meet",
        ),
        ("{frontal_area: 0, lateral_area: 1, length: 2, height: 1, vessel: tender}",
         "windage.frontal_area: must be above 0, got 0"),
    ],
)  # fmt: skip
def test_what_cannot_be_a_windage(tmp_path, windage, message):
    with pytest.raises(ConfigError) as error:
        world_of(skiff(tmp_path, windage))
    assert message in str(error.value)
