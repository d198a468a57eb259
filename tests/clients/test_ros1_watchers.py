"""Programs that look and say where things are, in ROS 1's own client libraries and in a browser: each as the others."""

import json
import math
import re
import sys
from types import SimpleNamespace

import pytest

import roslibjs
from clients.runner import PROGRAMS, RATES, messages, outcome, program
from needs import CHROMIUM, ROS1_TOOLS, TF2, needs, require
from ros1_served import tools
from rosbridge_client import Talk

pytestmark = [pytest.mark.slow, needs(ROS1_TOOLS), pytest.mark.parametrize("rate", RATES)]

BEACON = "geographic_msgs/GeoPoseStamped"


@pytest.mark.nightly
def test_who_comes_after_a_stall_still_hears_a_latched_beacon(tmp_path, rate):
    heard = []

    def late(served):
        with Talk(SimpleNamespace(url=f"ws://127.0.0.1:{served.bridge}")) as talk:
            talk.say("subscribe", topic="/team/beacon", type=BEACON)
            heard.append(talk.hear()["msg"])
        paths = " ".join(f"{name}='{value}'" for name, value in messages().items())
        heard.append(tools(f"export {paths}; rostopic echo -n 1 /team/beacon", served.port, tmp_path))

    done = outcome(program("beacon.py"), tmp_path, rate=rate, during=late)
    assert done.code == 0, done.text
    by_json, by_tcp = heard
    assert by_json["header"]["frame_id"] == "beacon"
    assert by_json["pose"]["position"]["latitude"] == pytest.approx(-33.7227)
    assert re.search(r'frame_id: "beacon".*latitude: -33\.7227', by_tcp, re.S), by_tcp
    assert done.task.state == "running"


@pytest.mark.nightly
def test_a_keyboard_script_in_a_terminal_drives(tmp_path, rate):
    done = outcome(program("keyboard.py"), tmp_path, rate=rate)
    assert (done.code, done.said("cmd_vel does not drive")) == (0, [])
    assert "the terminal ended with 0" in done.text
    assert done.way > 3.0
    assert done.task.score > 0.0


@needs(TF2)
def test_a_filter_over_gps_and_imu_with_tf_is_where_the_localization_is(tmp_path, rate):
    done = outcome(program("ekf.py"), tmp_path, "--localization", rate=rate)
    assert done.code in {0, -2}, done.text
    assert "dt =" not in done.text, done.text
    fixes, future, apart = re.search(r"fixes (\d+) future (\d+) apart (\S+)", done.text).groups()
    assert int(fixes) > 100
    assert int(future) > 10  # a transform that is to come is said to be so, and nobody waits for it
    assert float(apart) < 0.5
    places = [float(number) for number in re.search(r"tf (\S+) (\S+) at (\S+) (\S+)", done.text).groups()]
    assert math.dist(places[:2], places[2:]) < 0.5
    assert done.task.state == "running"


def test_a_page_shows_frames_and_thrusts(tmp_path, rate):
    require(CHROMIUM)
    roslibjs.installed()
    command = [sys.executable, PROGRAMS / "page.py", roslibjs.CLASSIC]
    done = outcome(command, tmp_path, "--localization", "truth", rate=rate)
    assert done.code == 0, done.text
    seen, said = re.search(r"^(\{.*\})\nsaid (.*)$", done.text, re.M).groups()
    seen = json.loads(seen)
    assert (seen["errors"], said) == ([], "[]")
    assert min(seen["action"], seen["service"], seen["thrusts"]) > 30 / rate
    assert seen["thrust"] == pytest.approx(0.3)
    assert seen["nulls"] > 10
    near = [seen[name + " at"] for name in ("action", "service")]
    assert math.dist(*([one["x"], one["y"]] for one in near)) < 0.5
    assert done.way > 3.0
