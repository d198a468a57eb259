"""Motion through the water does not depend on what carries the water, where it heads, or which side is which.

For every robot in profile `marine`, with all its engines and rudders at work.
"""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from vrx_mj import Simulation, compile_world
from vrx_mj.config.search import catalogue

ROBOTS = sorted(catalogue("robots"))
STREAM, WIND = np.array([0.5, 0.64]), np.array([-3.0, 2.0])
TIDE = {"speed": 0.3, "direction": 20.0, "period": 60.0}
SYMMETRIC = [
    "skiff", "heron", "heron_hydro", "blueboat", "blueboat_hydro", "otter", "cylinder", "barge_4m", "barge_10m",
]  # fmt: skip
SIDES = {"left": "right", "right": "left"}
ANGLE = math.radians(37.0)
pytestmark = pytest.mark.filterwarnings("ignore::vrx_mj.errors.VrxWarning")


def flow(key, velocity, **more):
    speed, direction = math.hypot(*velocity), math.degrees(math.atan2(velocity[1], velocity[0]))
    return {key: speed, "direction": direction, **more}


def world_of(robot, stream, wind, turn=0.0, side=1.0, **keys):
    """A world with a tide, whose x axis is turned by an angle [rad], or with its sides changed."""
    stream, wind = (turned(np.array(each), turn, side) for each in (stream, wind))
    tide = TIDE | {"direction": side * TIDE["direction"] + math.degrees(turn)}
    keys = {"current": flow("speed", stream, tide=tide), "wind": flow("mean_velocity", wind), **keys}
    fleet = {"robot": robot, "boats": [{"name": "a", "pose": [0.0] * 6}]}
    return compile_world({"physics": {"profile": "marine"}, "sea": {"model": "none"}, **keys}, fleet=fleet)


def turned(vector, turn, side=1.0):
    x, y = vector[..., 0], side * vector[..., 1]
    return np.stack([math.cos(turn) * x - math.sin(turn) * y, math.sin(turn) * x + math.cos(turn) * y], axis=-1)


def crossing(side):
    """A sea of three waves off the bow, or of those mirrored."""
    sea = {"model": "cwr", "number": 3, "scale": 1.5, "amplitude": 0.08, "period": 2.5, "steepness": 0.0, "tau": 1.0}
    return {"sea": sea | {"angle": 0.4 * side, "direction": [0.8, 0.6 * side]}}


def commands(sim, side=1.0):
    """All engines at other powers, and all that turns to one side; with `side` -1 those of the other sides."""
    powers = {}
    for name in sim.command_names("a"):
        other = name if side > 0.0 else re.sub("left|right", lambda word: SIDES[word[0]], name)
        powers[name] = side * 0.25 if name.endswith(("_angle", "lateral")) else 0.3 + 0.1 * (len(other) % 4)
    return {"a": powers}


def path(world, pace, turn=0.0, side=1.0):
    """Places (n, 2) of a boat that starts with a velocity (2,) over ground."""
    sim, found, ahead = Simulation(world), [], turned(turned(np.array(pace), turn, side), -turn)
    sim.set_boat("a", pose=(0.0, 0.0, 0.0, 0.0, 0.0, turn), velocity=(*ahead, 0.0, 0.0, 0.0, 0.0))
    for _ in range(20):
        sim.step(commands(sim, side), duration=1.0)
        found.append(sim.observe()["a"].position[:2])
    return np.array(found)


@pytest.mark.slow
def test_a_stream_that_carries_water_and_air_carries_the_path(subtests):
    times = np.arange(1, 21)[:, None]
    for robot in ROBOTS:
        with subtests.test(robot=robot):
            still = path(world_of(robot, (0.0, 0.0), WIND), (1.0, 0.0))
            carried = path(world_of(robot, STREAM, WIND + STREAM), STREAM + np.array([1.0, 0.0]))
            assert np.abs(carried - STREAM * times - still).max() < 1e-9
            assert np.ptp(still, axis=0).max() > 0.5


@pytest.mark.slow
def test_a_turned_world_has_the_turned_path(subtests):
    for robot in ROBOTS:
        with subtests.test(robot=robot):
            one = path(world_of(robot, STREAM, WIND), (1.0, 0.0))
            other = path(world_of(robot, STREAM, WIND, ANGLE), (1.0, 0.0), ANGLE)
            assert np.abs(turned(one, ANGLE) - other).max() < 1e-9


@pytest.mark.parametrize("waves", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_mirrored_world_has_the_mirrored_path(waves, subtests):
    """In waves all that a hull without or with a `hydro` file has of them: motions of 20 s make more of rounding."""
    for robot in SYMMETRIC:
        with subtests.test(robot=robot):
            one, other = (
                path(
                    world_of(robot, STREAM, WIND, side=side, **(crossing(side) if waves else {})), (1.0, 0.0), side=side
                )
                for side in (1.0, -1.0)
            )
            assert np.abs(turned(one, 0.0, -1.0) - other).max() < (1e-8 if waves else 1e-9)


@pytest.mark.slow
def test_engines_and_rudders_feel_waves_and_stream_as_one_flow(subtests):
    """Waves travel over ground as in still water: with k . U added, their frequency at the shifted boat is the same."""
    for robot in ROBOTS:
        with subtests.test(robot=robot):
            sea = {"model": "jonswap", "significant_height": 0.3, "peak_period": 3.0, "spreading": 5}
            still, carried = (world_of(robot, stream, WIND, sea=sea) for stream in ((0.0, 0.0), STREAM))
            known = carried.parameters.sea
            waves = [
                replace(
                    wave,
                    frequency=wave.frequency + wave.wavenumber * float(np.dot(wave.direction, STREAM)),
                    orbital=known.gravity * wave.wavenumber * wave.amplitude / wave.frequency,
                )
                for wave in known.waves
            ]
            parameters = replace(carried.parameters, sea=replace(known, waves=tuple(waves)))
            sims = [Simulation(still), Simulation(replace(carried, parameters=parameters))]
            for shift, sim in zip((np.zeros(2), STREAM), sims, strict=True):
                sim.step(commands(sim), duration=5.0)
                x, y = (
                    np.array([1.0, 2.0]) + (sim.time + sim.timestep) * shift
                )  # at the end of the step whose forces are seen
                sim.set_boat(
                    "a", pose=(x, y, 0.0, 0.0, 0.0, 0.0), velocity=(1.5 + shift[0], shift[1], 0.0, 0.0, 0.0, 0.0)
                )
            one, other = (sim.forces("a")["thrust"] for sim in sims)
            assert other == pytest.approx(one, rel=1e-9, abs=1e-9 * np.abs(one).max())
