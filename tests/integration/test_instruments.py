"""Wind, heading and depth from a robot's YAML to readings, topics and recordings; a bank of a shore by its slope."""

import json
import math

import pytest

import vrx_mj
from ros_scene import run, served
from vrx_mj.frames import rotation_matrix

SURVEYOR = """
extends: blueboat
sensors:
  - {type: anemometer, name: wind, link: mast_link, pose: [0, 0, 0.4, 0, 0, 0], rate: 20}
  - {type: gnss_compass, name: gnss, link: base_link, rate: 5}
  - {type: echo_sounder, name: sonar, link: base_link, pose: [0, 0, 0.5, 0, 1.5707963267948966, 0], range: [0.1, 50]}
"""
TOPICS = {"/a/sensors/wind/apparent_wind": 20, "/a/sensors/gnss/heading": 5, "/a/sensors/sonar/range": 10}
SEA = {"model": "jonswap", "significant_height": 0.2, "peak_period": 3.0, "depth": 7.0}
WIND = {"direction": 90, "mean_velocity": 5.0, "var_gain": 1.0}


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    file = tmp_path_factory.mktemp("robot") / "surveyor.yaml"
    file.write_text(SURVEYOR, encoding="utf-8")
    return str(file)


@pytest.fixture(scope="module")
def world(robot):
    fleet = {"boats": [{"name": "a", "robot": robot, "pose": [0, 0, 0, 0, 0, 0]}]}
    return vrx_mj.compile_world({"physics": {"profile": "marine"}, "sea": SEA, "wind": WIND}, fleet=fleet)


@pytest.mark.parametrize("dialect", ["vrx", "vrx3"])
def test_messages_say_what_was_sensed(world, dialect):
    scene = served(world, wanted=set(TOPICS), dialect=dialect)
    sensed = {name: {} for name in scene.sim.sensors("a")}
    for name, readings in sensed.items():
        scene.sim.subscribe("a", name, lambda one, kept=readings: kept.update({round(one.time, 6): one.data}))
    run(scene, 2.0)
    got = scene.network.got
    assert {topic: len(got[topic]) for topic in TOPICS} == {topic: 2 * rate for topic, rate in TOPICS.items()}
    wind, gnss, sonar = (got[topic][-1].message for topic in TOPICS)
    stamps = [one.header.stamp for one in (wind, gnss, sonar)]
    data = {
        name: readings[round(stamp.sec + 1e-9 * stamp.nanosec, 6)]
        for (name, readings), stamp in zip(sensed.items(), stamps, strict=True)
    }
    along = math.cos(data["wind"].angle), math.sin(data["wind"].angle)
    assert (wind.vector.x, wind.vector.y) == pytest.approx([-data["wind"].speed * each for each in along])
    turn = gnss.orientation
    bow = rotation_matrix((turn.w, turn.x, turn.y, turn.z))[:, 0]
    assert math.atan2(bow[1], bow[0]) == pytest.approx(data["gnss"].heading)
    assert sonar.range == data["sonar"].range
    assert [one.header.frame_id for one in (wind, gnss, sonar)] == ["a/mast_link", "a/base_link", "a/base_link"]


def test_a_recording_has_them_to_the_last_bit(world, tmp_path):
    sim = vrx_mj.Simulation(world, seed=5)
    with vrx_mj.record(sim, tmp_path / "run.rrd", sensors="a"):
        sim.step({"a": {"left": 1.0, "right": 0.5}}, duration=2.0)
    record = vrx_mj.read_record(tmp_path / "run.rrd")
    for name, rate in (("wind", 20), ("gnss", 5), ("sonar", 10)):
        found, sensed = record.readings("a", name), sim.sense("a")[name]
        assert (len(found), found[-1].data) == (2 * rate + 1, sensed.data)


@pytest.mark.parametrize("away", [0.25, 0.75])
def test_off_a_shore_it_reads_down_to_the_bank(robot, tmp_path, away):
    """The bank's foot is 0.6 m deep 1 m off the waterline; the transducer is 0.5 m above the boat's origin."""
    (tmp_path / "terrain").mkdir()
    land = {"land": [{"exterior": [[-30, 0], [30, 0], [30, 40], [-30, 40]]}]}
    (tmp_path / "terrain" / "strand.json").write_text(json.dumps(land), encoding="utf-8")
    file = tmp_path / "strand.yaml"
    file.write_text("terrain: strand\nsea: {model: none, depth: 7}\n", encoding="utf-8")
    fleet = {"boats": [{"name": "a", "robot": robot, "pose": [0, -9, 0, 0, 0, 0]}]}
    sim = vrx_mj.Simulation(vrx_mj.compile_world(file, fleet=fleet))
    sim.set_boat("a", pose=(0, -away, 0, 0, 0, 0))
    assert sim.sense("a")["sonar"].data.range == pytest.approx(0.5 + 0.6 * away, abs=0.1)  # 5 deviations
    sim.set_boat("a", pose=(0, -3, 0, 0, 0, 0))
    assert sim.sense("a")["sonar"].data.range == pytest.approx(7.5, abs=0.1)
