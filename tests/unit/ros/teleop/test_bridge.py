"""A driver's end of rosbridge on a made-up socket and clock: what is sent, taken, dropped and said."""

import json
import math

import pytest
from websockets.exceptions import ConnectionClosedOK, InvalidHandshake

from vrx_mj.drive.pilot import HELP
from vrx_mj.errors import NetworkError
from vrx_mj.ros.teleop import driving
from vrx_mj.ros.teleop.driving import Bridge, RosbridgeDriver, Scene

URL = "ws://127.0.0.1:9090"
CHART = {
    "name": "bay", "x_from_east": 0.0, "cmd_vel": "velocity",
    "boats": {name: {"engines": []} for name in ("a1", "a2", "a10")},
}  # fmt: skip


class Socket:
    """A connection, and the clock: an empty one waits until its time is over."""

    def __init__(self):
        self.now, self.sent, self.came, self.is_closed, self.slept = 100.0, [], [], False, []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.is_closed = True

    def send(self, text):
        if self.is_closed:
            raise ConnectionClosedOK(None, None)
        self.sent.append(json.loads(text))

    def recv(self, timeout):
        if self.is_closed:
            raise ConnectionClosedOK(None, None)
        if not self.came:
            self.now += timeout + 1e-6
            raise TimeoutError
        return self.came.pop(0)

    def monotonic(self):
        return self.now

    def sleep(self, seconds):
        self.slept.append(seconds)
        self.now += seconds

    def say(self, **message):
        self.came.append(json.dumps(message))

    def taken(self):
        """What was sent since the last time."""
        sent, self.sent = self.sent, []
        return sent


@pytest.fixture
def socket(monkeypatch):
    one = Socket()
    monkeypatch.setattr(driving, "connect", lambda url, **_: one)
    monkeypatch.setattr(driving, "time", one)
    return one


def test_a_topic_is_advertised_once_until_its_last_message(socket):
    bridge = Bridge(URL)
    for last in (False, True, False):
        bridge.publish("/a", "std_msgs/Int8", {"data": 1}, last=last)
    said = [(one["op"], one["topic"]) for one in socket.sent]
    assert said == [(op, "/a") for op in ["advertise", "publish", "publish", "unadvertise", "advertise", "publish"]]
    assert socket.sent[0]["type"] == "std_msgs/Int8"
    assert socket.sent[1]["msg"] == {"data": 1}


def test_what_comes_is_given_to_who_waits_for_it_and_nonsense_to_nobody(socket):
    bridge, came = Bridge(URL), []
    bridge.subscribe("/a", "std_msgs/Int8", came.append, period=0.25)
    assert socket.taken() == [
        {"op": "subscribe", "topic": "/a", "type": "std_msgs/Int8", "throttle_rate": 250, "queue_length": 1}
    ]
    bridge.call("/s", {"x": 1}, lambda *what: came.append(what))
    bridge.call("/t", {}, lambda *what: came.append(what))
    assert socket.taken()[0] == {"op": "call_service", "id": "call:0", "service": "/s", "args": {"x": 1}}
    socket.came += ["{", "[1]", "5"]
    socket.say(op="publish", topic="/a", msg={"data": 2})
    socket.say(op="publish", topic="/b", msg={"data": 3})
    socket.say(op="service_response", id="call:1", values={"ok": True}, result=True)
    socket.say(op="service_response", id="call:0", values="no", result=False)
    socket.say(op="service_response", id="call:0", values="again", result=True)
    socket.say(op="status", topic="/a", msg="text")
    assert bridge.listen(0.5)
    assert came == [{"data": 2}, ({"ok": True}, True), ("no", False)]
    assert socket.now == pytest.approx(100.5, abs=1e-3)


def test_so_many_calls_wait_and_one_more_is_refused(socket):
    bridge, answers = Bridge(URL), []
    for _ in range(65):
        bridge.call("/s", {}, lambda *what: answers.append(what))
    assert len(socket.sent) == 64
    assert answers == [("/s: 64 calls are already waiting", False)]


def test_a_connection_that_has_ended_drops_what_is_sent(socket):
    bridge = Bridge(URL)
    socket.is_closed = True
    bridge.publish("/a", "std_msgs/Int8", {}, last=False)
    assert not bridge.is_open
    bridge.is_open = True
    assert not bridge.listen(0.1)
    bridge = Bridge(URL)
    bridge.close()
    assert not bridge.is_open


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (TimeoutError(), f"no rosbridge answers at {URL} (it timed out); start a world there: vrx-mj serve WORLD"),
        (OSError("no route"), f"no rosbridge answers at {URL} (no route); start a world there: vrx-mj serve WORLD"),
        (OSError(5, "broken"), f"no rosbridge answers at {URL} (broken); start a world there: vrx-mj serve WORLD"),
        (InvalidHandshake("odd"), f"the server at {URL} is not a rosbridge: odd"),
    ],
)
def test_why_there_is_no_connection_is_said(monkeypatch, error, text):
    def connect(*_, **options):
        assert options == {"max_size": 1 << 25, "compression": None, "open_timeout": 5.0, "proxy": None}
        raise error

    monkeypatch.setattr(driving, "connect", connect)
    with pytest.raises(NetworkError) as caught:
        Bridge(URL)
    assert str(caught.value) == text + " --rosbridge" * ("WORLD" in text)


def known(socket, *, boats=("a1", "a2", "a10"), chart=CHART):
    """Have the world's chart and its boats come."""
    socket.say(op="publish", topic="/vrx_mj/world", msg={"data": json.dumps(chart)})
    calls = [f"call:{number}" for number in range(40)]
    for call in calls:
        topics = [*(f"/{boat}/cmd_vel" for boat in boats), "/cmd_vel", "/a1/cmd_vel_2"]
        socket.say(op="service_response", id=call, values={"topics": topics}, result=True)


@pytest.fixture
def driver(socket):
    known(socket)
    said = []
    one = RosbridgeDriver(URL, None, say=said.append, clock=socket.monotonic)
    one.said = said
    return one


def test_a_scene_is_asked_for_and_boats_are_in_the_order_of_their_numbers(socket, driver):
    subscribed = [(one["topic"], one["type"], one["throttle_rate"]) for one in socket.sent if one["op"] == "subscribe"]
    assert subscribed == [
        ("/vrx_mj/world", "std_msgs/String", 0),
        ("/clock", "rosgraph_msgs/Clock", 200),
        ("/gazebo/model_states", "gazebo_msgs/ModelStates", 200),
        ("/vrx/debug/wind/speed", "std_msgs/Float64", 200),
        ("/vrx/debug/wind/direction", "std_msgs/Float64", 200),
    ]
    assert driver.said == [
        f"connected to bay at {URL}: a1, a2, a10", "cmd_vel sets a velocity to hold: power is in m/s and turn in rad/s"
    ]  # fmt: skip
    asked = [one for one in socket.sent if one["op"] == "call_service"]
    assert asked[0]["service"] == "/rosapi/topics_for_type"
    assert asked[0]["args"] == {"type": "geometry_msgs/Twist"}


def asked_at(socket, scene, seconds, step=0.01):
    """Times at which the scene asked for the boats [s]."""
    times, begun = [], socket.now
    while socket.now < begun + seconds:
        socket.taken()
        scene.follow()
        times += [socket.now - begun] * bool(socket.sent)
        socket.now += step
    return times


def test_boats_are_asked_for_once_a_second(socket):
    scene = Scene(Bridge(URL), socket.monotonic)
    assert asked_at(socket, scene, 3.0) == pytest.approx([0.0, 1.0, 2.0], abs=0.03)


def test_boats_of_a_world_that_had_not_shown_itself_yet_are_asked_for_again(socket):
    scene, known = Scene(Bridge(URL), socket.monotonic), []
    for boats in ((), ("a1", "a2"), ("a1",)):
        scene._count({"topics": [f"/{boat}/cmd_vel" for boat in boats]}, True)
        known.append((scene.is_known, tuple(scene.engines)))
        scene._world({"data": json.dumps(CHART)})
        known.append((scene.is_known, tuple(scene.engines)))
        assert asked_at(socket, scene, 0.1) == [0.0]
    assert known == [
        (False, ()), (False, ()), (True, ("a1", "a2")), (True, ("a1", "a2")), (True, ("a1",)), (True, ("a1",))
    ]  # fmt: skip


def test_time_counts_as_paused_without_a_clock_and_as_was_asked_for_a_second(socket):
    scene = Scene(Bridge(URL), socket.monotonic)
    seen = []
    for seconds in (0.59, 0.02):
        socket.now += seconds
        seen.append(scene.is_paused)
    scene._tick({"clock": {"secs": 7, "nsecs": 250_000_000}})
    assert scene.time == 7.25
    seen.append(scene.is_paused)
    scene.note_pause(paused=True)
    for seconds in (0.99, 0.02):
        socket.now += seconds
        if len(seen) == 3:
            scene._tick({"clock": {"secs": 8, "nsecs": 0}})
        seen.append(scene.is_paused)
    assert seen == [False, True, False, True, False]


def test_commands_go_out_ten_times_a_second_and_the_last_one_leaves_the_topic(socket, driver):
    socket.taken()
    driver.press("i")
    sent = []
    begun = socket.now
    while socket.now < begun + 1.0:
        driver.advance()
        sent += [one for one in socket.taken() if one["op"] == "publish"]
    assert {one["topic"] for one in sent} == {"/a1/cmd_vel"}
    assert {one["msg"]["linear"]["x"] for one in sent} == {0.5}
    assert sent[0]["msg"]["angular"] == {"x": 0.0, "y": 0.0, "z": 0.0}
    assert 7 <= len(sent) <= 9  # a turn of 0.03 s may come just before one is due
    driver.press("k")
    for _ in range(9):
        driver.advance()
    ops = [one["op"] for one in socket.taken() if one["op"] != "call_service"]
    assert ops == ["publish", "unadvertise"]
    driver.press("i")
    driver.advance()
    driver.close()
    assert [one["msg"]["linear"]["x"] for one in socket.taken() if one["op"] == "publish"] == [0.5, 0.0]
    assert socket.is_closed


def test_refusals_of_the_simulation_are_said(socket, driver):
    socket.taken()
    driver.reset()
    (call,) = socket.taken()
    assert (call["service"], call["args"]) == ("/gazebo/reset_world", {})
    socket.say(op="service_response", id=call["id"], values="busy", result=False)
    driver.pause()
    (call,) = socket.taken()
    assert call["service"] == "/gazebo/pause_physics"
    socket.say(op="service_response", id=call["id"], values={}, result=True)
    driver.advance()
    assert driver.said[2:] == ["/gazebo/reset_world was refused: busy"]
    assert list(driver.conditions()) == []
    socket.say(op="publish", topic="/vrx/debug/wind/speed", msg={"data": 3.0})
    socket.say(op="publish", topic="/clock", msg={"clock": {"secs": 7, "nsecs": 250_000_000}})
    driver.advance()
    assert list(driver.conditions()) == [("time", "7.2 s, paused")]
    socket.say(op="publish", topic="/vrx/debug/wind/direction", msg={"data": 120.0})
    driver.advance()
    assert next(iter(driver.conditions())) == ("wind", "3.0 m/s to 330 deg compass")


def test_motions_are_over_ground_in_compass_degrees(socket, driver):
    turned = {"x": 0.0, "y": 0.0, "z": math.sin(0.25), "w": math.cos(0.25)}
    socket.say(
        op="publish", topic="/gazebo/model_states",
        msg={
            "name": ["a1", "buoy"], "pose": [{"orientation": turned}] * 2,
            "twist": [{"linear": {"x": 3.0, "y": 4.0}}, {"linear": {"x": 0.0, "y": -1.0}}],
        },
    )  # fmt: skip
    driver.advance()
    motion = driver.motion()
    assert motion.speed == 5.0
    assert motion[1:] == pytest.approx((90.0 - math.degrees(0.5), 90.0 - math.degrees(math.atan2(4.0, 3.0))))


def test_a_lost_connection_is_tried_again_every_second(socket, driver, monkeypatch):
    attempts = []
    socket.is_closed = True
    driver.advance()
    assert driver.said[-1] == f"lost the connection to {URL}: trying again"
    driver.press("i")
    assert driver.pilot.wheels == {}

    def connect(*_, **__):
        attempts.append(socket.now)
        raise OSError(5, "gone")

    monkeypatch.setattr(driving, "connect", connect)
    begun = socket.now
    while socket.now < begun + 3.2:
        driver.advance()
    assert len(attempts) == 4
    assert [later - attempts[0] for later in attempts] == pytest.approx([0.0, 1.0, 2.0, 3.0], abs=0.1)
    assert set(socket.slept) == {0.03}
    again = Socket()
    again.now = socket.now
    for name in ("monotonic", "recv", "sleep"):
        setattr(socket, name, getattr(again, name))
    monkeypatch.setattr(driving, "connect", lambda *_, **__: again)
    driver._clock = again.monotonic
    for _ in range(40):
        driver.advance()
    assert again.is_closed  # within 5 s nothing came of a world
    assert driver.said[-1] == f"lost the connection to {URL}: trying again"
    assert again.now - socket.now > 5.0
    again.is_closed = False
    known(again)
    for _ in range(80):
        driver.advance()
    assert driver.said[-1] == "connected again, to bay"


def test_keys_are_explained_and_the_boats_stop_at_the_end(socket, monkeypatch):
    lines = []
    known(socket)

    class Terminal:
        reads, write_line = True, lines.append

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

    monkeypatch.setattr(driving, "Terminal", Terminal)
    monkeypatch.setattr(driving, "drive", lambda driver, _keys: lines.append(driver.pilot.boat))
    driving.drive_served_world(URL, boat="a2")
    shown = [f"  {name:<10} {text}" for name, text in HELP if name != "time"]
    assert lines[2:] == [
        *shown, "  time       p: pause or resume; backspace: reset",
        "Ctrl-C stops the boats that you drove and quits.", "a2",
    ]  # fmt: skip
    assert socket.is_closed
