"""Campaigns of programs: each trial has a ROS master of its own, and ends whatever the program does."""

import os
import re

import pytest

from campaigns import results_in
from needs import ROS1_TOOLS, needs
from vrx_command import vrx
from vrx_mj import Simulation, compile_world
from vrx_mj.campaign.plan import Cell, Serving
from vrx_mj.campaign.program_trial import sail_by_program
from vrx_mj.campaign.results import Tracks
from vrx_mj.errors import VrxError

pytestmark = [
    needs(ROS1_TOOLS),
    pytest.mark.slow,
]

WORLD = """
extends: ocean
georeference: {latitude: -33.7, longitude: 150.6, elevation: 0}
task: {type: stationkeeping, goal_cart: [8, 0, 0], initial_state_duration: 0.5, ready_state_duration: 0.5,
       running_state_duration: 3}
"""
HOLD = """
import os, rospy
from sensor_msgs.msg import NavSatFix
from std_msgs.msg import Float32

print(*(os.environ[name] for name in ("VRX_MJ_WORLD", "VRX_MJ_SEED", "VRX_MJ_ROSBRIDGE_URL")), flush=True)
rospy.init_node("holder")
sides = [rospy.Publisher(f"/wamv/thrusters/{side}_thrust_cmd", Float32, queue_size=1) for side in ("left", "right")]
goal = 150.6 + 8.0 / 92630.0

def steer(fix):
    for side in sides:
        side.publish(1.0 if fix.longitude < goal else -1.0)

rospy.Subscriber("/wamv/sensors/gps/gps/fix", NavSatFix, steer)
rospy.spin()
print("goodbye", flush=True)
"""
LOCK = """
import sys, time, rospy
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Float32

rospy.init_node("locked", disable_rostime=True)
sides = [rospy.Publisher(f"/wamv/thrusters/{side}_thrust_cmd", Float32, queue_size=None) for side in ("left", "right")]
while not all(side.get_num_connections() for side in sides):
    time.sleep(0.01)
seen = []

def answer(clock):
    if clock.clock not in seen[-1:]:
        seen.append(clock.clock)
        for number, side in enumerate(sides):
            time.sleep(float(sys.argv[1]))
            side.publish((len(seen) % (7 + number)) / 10.0)

rospy.Subscriber("/clock", Clock, answer)
rospy.spin()
"""
PYTHON = "/usr/bin/python3"
HOLDS, FAILS, FINISHES = f"{PYTHON} hold.py", "echo about to fail; exit 4", "sleep 60 & echo done here"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("programs")
    (place / "bay.yaml").write_text(WORLD, encoding="utf-8")
    (place / "hold.py").write_text(HOLD, encoding="utf-8")
    (place / "lock.py").write_text(LOCK, encoding="utf-8")
    return place


def campaign(folder, programs, *words, output):
    given = [word for program in programs for word in ("--exec", program)]
    ros = {"ROS_MASTER_URI": "http://127.0.0.1:9", "ROS_HOSTNAME": "nowhere.invalid"}  # of another ROS: not used
    return vrx("campaign", *given, "--worlds", "bay.yaml", "-o", output, *words, cwd=folder, **ros)


def results(folder, output):
    return {
        key: (each, (folder / output / each.cell.folder / "log.txt").read_text(encoding="utf-8"))
        for key, each in results_in(folder / output).items()
    }


@pytest.fixture(scope="module")
def sailed(folder):
    words = ("--seeds", "3", "--jobs", "2", "--rosbridge")
    ended = campaign(folder, [HOLDS, FINISHES, FAILS], *words, output="out")
    return ended, results(folder, "out")


def test_a_program_holds_station_and_is_scored(sailed, folder):
    (code, out, err), found = sailed
    held, log = found[HOLDS, 3]
    assert (code, held.error, "Traceback" in err) == (0, None, False), (err, log)
    assert "2 of 3 trials finished, 1 failed" in out
    assert held.state == "finished"
    assert held.sim_time == pytest.approx(4.0, abs=0.02)  # 0.5 s + 0.5 s + 3 s, and a frame of the referee's
    assert held.score < found[FINISHES, 3][0].score - 0.05  # who does nothing drifts at 8 m
    track = held.tracks["wamv"]
    assert track[0] == [0.0, 0.0]
    assert track[-1][0] > 0.3
    assert re.search(r"^bay\.yaml 3 ws://127\.0\.0\.1:\d+$", log, re.MULTILINE)
    assert "\ngoodbye\n" in log
    assert (folder / "out" / "index.html").read_text(encoding="utf-8").count('class="track') >= 1


def test_each_trial_has_a_master_of_its_own(sailed):
    _, found = sailed
    masters = [re.search(r"own master at (http://127\.0\.0\.1:\d+)", log)[1] for _, log in found.values()]
    assert len(masters) == 3
    first, second = (re.search(r"own master at (\S+),", found[name, 3][1])[1] for name in (HOLDS, FINISHES))
    assert first != second  # these two were sailed at the same time


def test_a_program_that_fails_is_a_failed_trial_with_its_last_lines(sailed):
    _, found = sailed
    failed, log = found[FAILS, 3]
    pattern = r"(at t = [\d.]+ s: )?the program ended with exit code 4; its last lines: about to fail"
    assert re.fullmatch(pattern, failed.error)
    assert "\nabout to fail\n" in log


def test_one_that_ends_well_before_the_task_is_no_failure(sailed):
    _, found = sailed
    ended, log = found[FINISHES, 3]
    assert (ended.error, ended.state) == (None, "finished")
    assert "\ndone here\n" in log


@pytest.fixture
def alone(folder, monkeypatch):
    """Sails a program's trial in this process."""
    monkeypatch.chdir(folder)
    monkeypatch.setattr(os, "environ", os.environ.copy())

    def sail(program, serving, *, wall, duration=None):
        sim, home = Simulation(compile_world("bay.yaml", seed=5)), folder / "alone"
        return sail_by_program(
            Cell(program, "bay.yaml", 5), serving, sim, home, duration, wall, Tracks(), FreeStopwatch()
        )

    return sail


class FreeStopwatch:
    """Allows everything."""

    def allow(self, wall):
        pass

    def reach(self, moment):
        pass

    def lead(self, group):
        pass


def test_a_trial_that_takes_too_long_tells_how_far_it_is(alone):
    pattern = r"^not finished after 6 s of wall time \(t 0\.\d s  pace 0\.\d+  .*\); its last lines: never$"
    with pytest.raises(VrxError, match=pattern):
        alone("echo never; while :; do sleep 0.2; done", Serving(rate=0.02), wall=6.0)


def test_in_lockstep_a_slower_program_sails_the_same_bits(alone):
    serving = Serving(lockstep=tuple(f"/wamv/thrusters/{side}_thrust_cmd" for side in ("left", "right")))
    first, second = (alone(f"{PYTHON} lock.py {delay}", serving, wall=60.0, duration=1.5) for delay in ("0", "0.002"))
    assert first.sim_time == second.sim_time == pytest.approx(1.5)
    assert first.state_sha256 == second.state_sha256
    assert first.boats["wamv"].distance == second.boats["wamv"].distance > 0.01
