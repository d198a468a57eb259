"""Every robot of the catalogue floats, sails and senses."""

import importlib.util
import math

import numpy as np
import pytest

import vrx_mj
from vrx_mj.config.fleet import Order
from vrx_mj.config.search import catalogue
from vrx_mj.mjcf.build import build_boat
from vrx_mj.resources import root

ROBOTS = sorted(catalogue("robots"))
FOLDER = root() / "assets" / "robots"
SYDNEY = {"latitude": -33.724223, "longitude": 150.679736}


def calm(robot):
    """One boat in still water, at rest there."""
    world = {"sea": {"model": "none"}, "georeference": SYDNEY}
    fleet = {"robot": robot, "boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}]}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet=fleet))
    sim.step({}, duration=20.0)
    return sim


def all_ahead(sim, power=0.5):
    return {"a": {name: power for name in sim.command_names("a") if not name.endswith("_angle") and name != "lateral"}}


def test_the_robots_are_those_of_the_documents():
    assert ROBOTS == ["cora", "otter", "skiff", "wamv", "wamv_stereo"]


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_robot_floats_upright_and_sails_ahead(robot):
    sim = calm(robot)
    rest = sim.observe()["a"]
    assert abs(rest.roll) < 0.02
    assert abs(rest.pitch) < 0.05
    assert -1.5 < rest.position[2] < 0.0
    sim.step(all_ahead(sim), duration=10.0)
    sailed = sim.observe()["a"]
    assert sailed.velocity[0] > 0.5
    assert abs(sailed.heading) < 0.1


@pytest.mark.parametrize("robot", ROBOTS)
def test_every_sensor_of_a_robot_reads(robot):
    sim = calm(robot)
    sensors = build_boat(Order(robot)).sensors
    assert sim.sensors("a") == tuple(sensor.name for sensor in sensors)
    for sensor in sensors:
        if sensor.type == "camera":
            continue  # needs a picture: tests/unit/sensors/test_camera.py
        reading = sim.sense("a")[sensor.name]
        assert (reading.type, reading.time) == (sensor.type, pytest.approx(20.0))
        if sensor.type == "imu":
            assert reading.data.linear_acceleration[2] == pytest.approx(9.8, abs=0.05)


def test_the_mast_stands_on_the_skiff_and_its_engine_pushes_it():
    boat = build_boat(Order("skiff"))
    assert [thruster.name for thruster in boat.thrusters] == ["propeller", "rudder"]
    assert math.fsum(part.inertial.mass for part in boat.parts if part.inertial) == 59.0  # and the rudder, 1 kg


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_skiff_s_rudder_turns_the_bow_to_starboard_when_positive(side):
    sim = calm("skiff")
    sim.step({"a": {"propeller": 0.8, "rudder_angle": 0.0}}, duration=5.0)
    sim.step({"a": {"propeller": 0.8, "rudder_angle": 0.3 * side}}, duration=3.0)
    seen = sim.observe()["a"]
    assert np.sign(seen.angular_velocity[2]) == -side
    assert abs(seen.angular_velocity[2]) > 0.1


def test_cora_weighs_what_vrx_s_weighs():
    sim = calm("cora")
    assert sim.model.body_subtreemass[sim.model.body("a/base_link").id] == pytest.approx(33004.65, abs=0.01)


def test_the_otter_floats_at_its_waterline_in_every_profile():
    for profile in ("vrx", "vrx3", "marine"):
        world = {"physics": {"profile": profile}, "sea": {"model": "none"}}
        sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet={"robot": "otter", "usv_count": 1}))
        sim.step({}, duration=20.0)
        assert sim.data.qpos[2] == pytest.approx(0.0, abs=1e-3), profile


def test_the_wamv_of_marine_floats_level_and_keeps_its_course():
    """Its hulls carry 298.8 kg with 0.135 m of draft, 0.43 deg by the bow: their volume is farther aft."""
    world = {"physics": {"profile": "marine"}, "sea": {"model": "none"}}
    fleet = {"robot": "wamv", "boats": [{"name": "a", "pose": [0, 0, -0.14, 0, 0, 0]}]}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet=fleet))
    sim.step({}, duration=20.0)
    rest = sim.observe()["a"]
    assert (sim.data.qpos[2], rest.pitch) == pytest.approx((-0.150, 0.0073), abs=1e-3)
    assert abs(rest.roll) < 1e-3
    sim.step({"a": {"left": 1.0, "right": 1.0}}, duration=30.0)
    sailed = sim.observe()["a"]
    assert sailed.velocity[0] == pytest.approx(2.24, abs=0.02)
    assert abs(sailed.angular_velocity[2]) < 1e-3
    assert sim.energy("a") == pytest.approx(2.0 * 2000.0 * 30.0)


def test_the_wamv_of_marine_rides_a_rough_sea():
    sea = {"model": "jonswap", "significant_height": 0.9, "peak_period": 4.5, "components": 60}
    world = {"physics": {"profile": "marine"}, "sea": sea}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(world, fleet={"robot": "wamv", "usv_count": 1}))
    (boat,) = sim.boats
    heights, rolls = [], []
    for _ in range(600):
        sim.step({}, duration=0.1)
        seen = sim.observe()[boat]
        heights.append(sim.data.qpos[2] - sim.sea.height(seen.position[0], seen.position[1], sim.time))
        rolls.append(seen.roll)
    assert np.std(heights) < 0.1  # it follows waves that are long against it
    assert np.abs(rolls).max() < 0.6


@pytest.mark.parametrize("robot", ["cora", "otter", "skiff"])
def test_the_script_writes_the_hulls_that_are_shipped(robot, tmp_path):
    spec = importlib.util.spec_from_file_location("make_hulls", FOLDER / "make_hulls.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    script.write_meshes(robot, tmp_path)
    written = sorted(tmp_path.iterdir())
    assert [path.name for path in written] == ["bottom.obj", "deck.obj", "hull.obj"]
    for path in written:
        assert path.read_bytes() == (FOLDER / robot / "meshes" / path.name).read_bytes()
