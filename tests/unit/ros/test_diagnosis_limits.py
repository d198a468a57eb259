"""What a diagnosis says of made-up boats, contacts and senders, to the letter, and how much it remembers."""

from types import SimpleNamespace

import numpy as np
import pytest

from trees import partial
from vrx_mj.frames import quaternion
from vrx_mj.ros import diagnosis
from vrx_mj.ros.diagnosis import Diagnosis, TopicHints, overlaps, shared_frames
from vrx_mj.ros.interface import Command, RosInterface, UnknownTopicPublisher
from vrx_mj.runtime.observation import BoatObservation

TOPIC = "/a/thrusters/left_thrust_cmd"


class Simulation:
    """Boats a and b, each with a thruster whose commands last 1 s."""

    boats, model, data, task = ("a", "b"), None, SimpleNamespace(contact=()), None
    world = SimpleNamespace(
        name="bay",
        parameters=partial({
            "georeference": {}, "boats": [{"name": "a"}, {"name": "b"}],
            "thrusters": [{"hull": 0, "name": "left", "timeout": 1.0}, {"hull": 1, "name": "left", "timeout": 0.0}],
        }),
    )  # fmt: skip

    def __init__(self):
        self.time, self.sensors = 0.0, {}

    def mounted(self, boat):
        return self.sensors.get(boat, ())


@pytest.fixture
def scene():
    one = SimpleNamespace(sim=Simulation(), lines=[])
    one.watch = Diagnosis(one.sim, lambda level, text: one.lines.append((level, text)))
    return one


def said(scene):
    """The warnings since the last time."""
    lines, scene.lines[:] = list(scene.lines), []
    assert all(level == "WARN" for level, _ in lines)
    return [text for _, text in lines]


def test_so_many_lines_are_said_and_then_none(scene):
    for number in range(10_001):
        scene.watch.once(str(number), f"line {number}")
    assert len(scene.lines) == 10_000
    assert scene.lines[-1] == ("WARN", "line 9999")


def test_rates_are_measured_over_four_commands_of_one_sender(scene):
    def command(topic, sender, *times):
        for time in times:
            scene.sim.time = time
            scene.watch.note_command(Command(topic, None, sender))

    command(TOPIC, "/x", 0.0, 1.5, 3.0)
    assert said(scene) == []
    command(TOPIC, "/x", 4.5)
    assert said(scene) == [
        f"{TOPIC} arrives every 1.5 s, but a thrust lasts 1 s: it is on 67 % of the time; publish with -r 2 or more"
    ]
    command("/b/thrusters/left_thrust_cmd", "/x", 10.0, 12.0, 14.0, 16.0, 18.0)  # it lasts for ever
    command("/c/thrusters/left_thrust_cmd", "/x", 20.0, 22.0, 24.0, 26.0, 28.0)  # there is no such boat
    command("/a/thrusters/right_thrust_cmd", "/x", 30.0, 32.0, 34.0, 36.0, 38.0)  # nor such a thruster
    command("/a/cmd_vel", "/x", 40.0, 42.0, 44.0, 46.0, 48.0)
    command(TOPIC, "/y", 50.0, 50.0, 50.0, 50.0, 49.0, 51.0)
    assert said(scene) == []
    assert len(scene.watch._times[TOPIC, "/y"]) == 2


def test_gaps_a_hundredth_longer_than_a_thrust_are_no_gaps(scene):
    for gap, slow in ((1.009, 0), (1.011, 1)):
        for number in range(4):
            scene.sim.time = 10.0 * gap + number * gap
            scene.watch.note_command(Command(TOPIC, None, f"/{gap}"))
        assert len([line for line in said(scene) if "arrives" in line]) == slow


def test_so_many_senders_are_timed(scene):
    for number in range(1026):
        scene.sim.time = 10.0 * number
        scene.watch.note_command(Command(TOPIC, None, f"/{number}"))
    assert len(scene.watch._times) == 1025
    assert len(scene.watch._last[TOPIC]) == 1026 % 65


@pytest.mark.parametrize(("gap", "shared"), [(0.49, True), (0.51, False)])
def test_two_senders_take_turns_if_each_comes_twice_within_a_second(scene, gap, shared):
    for number in range(4):
        scene.sim.time = number * gap
        scene.watch.note_command(Command(TOPIC, None, f"/{number % 2}"))
    text = f"{TOPIC} is published by /0 and /1: each message replaces the other's"
    assert said(scene) == ([text] if shared else [])


@pytest.mark.parametrize(
    ("boat", "state", "commands", "is_held"),
    [
        ("a", "initial", {"left": 0.5}, True), ("a", "initial", {"left": 0.0}, False), ("a", "initial", {}, False),
        ("a", "ready", {"left": 0.5}, False), ("b", "initial", {"left": 0.5}, False),
    ],
)  # fmt: skip
def test_the_boat_of_the_task_is_held_before_it_begins(scene, monkeypatch, boat, state, commands, is_held):
    monkeypatch.setattr(diagnosis, "clipped_commands", lambda *_: [])
    scene.sim.task = {"boat": "a", "state": state, "ready_time": 12.5}
    scene.watch.check_commands(boat, commands)
    held = "a is held by its task until t = 12.5 s: thrust has no effect until then"
    assert said(scene) == ([held] if is_held else [])
    scene.sim.task = None
    scene.watch.check_commands(boat, commands)
    assert said(scene) == []


@pytest.mark.parametrize(("force", "is_clamped"), [(250.0, False), (250.1, True), (-100.0, False), (-100.1, True)])
def test_forces_beyond_a_thrusters_range_are_said(scene, force, is_clamped):
    scene.watch.check_force("a", SimpleNamespace(name="left", max_reverse=-100.0, max_forward=250.0), force)
    text = f"left of a is {force:g} N, outside -100 to 250 N: it is clamped to this range"
    assert said(scene) == ([text] if is_clamped else [])


def seen(spin=0.0):
    return BoatObservation(np.zeros(3), np.array(quaternion(0, 0, 0)), np.zeros(3), np.array([0.0, 0.0, spin]))


def test_boats_are_looked_at_once_a_second_and_what_ends_is_said(scene, monkeypatch):
    monkeypatch.setattr(diagnosis, "_touching_land", lambda _: set())
    looks, spin = [], [13.0]

    def observe():
        looks.append(scene.sim.time)
        return {"a": seen(spin[0]), "b": seen(11.9)}

    scene.sim.observe = observe
    for time in (0.0, 0.5, 0.99, 1.0, 1.4, 2.0):
        scene.sim.time = time
        scene.watch.look()
    assert looks == [0.0, 1.0, 2.0]
    fast = "a spins at 13 rad/s, more than 12: check masses, inertias and floats of its robot"
    assert said(scene) == [f"t = 0.0 s: {fast}"]
    spin[0], scene.sim.time = 1.0, 3.0
    scene.watch.look()
    assert scene.lines == [("INFO", "t = 3.0 s: a has stopped spinning")]


class Model:
    """Bodies by number, a shape for each."""

    names = ("", "a/base_link", "a/wheel", "b/base_link", "dock/plank", "rock/stone")
    geom_bodyid = np.arange(6)

    def body(self, number):
        return SimpleNamespace(name=self.names[number])


def contact(one, other, dist=-0.1):
    return SimpleNamespace(geom=(one, other), dist=dist)


def test_what_overlaps_is_named_once_for_a_pair_and_boats_on_land_are_known(scene):
    contacts = [contact(1, 3), contact(3, 2), contact(1, 2), contact(4, 5, -0.06), contact(1, 4, -0.05), contact(0, 3)]
    sim = SimpleNamespace(model=Model(), data=SimpleNamespace(contact=contacts), boats=("a", "b"))
    assert list(overlaps(sim)) == [
        "a and b overlap by 0.10 m: move one of them", "dock and rock overlap by 0.06 m: move one of them",
        "the land and b overlap by 0.10 m: move one of them",
    ]  # fmt: skip
    assert diagnosis._touching_land(sim) == {"b", "the land"}
    contacts[-1].dist = 0.0
    assert diagnosis._touching_land(sim) == set()


def sensor(name, frame, kind="imu"):
    return SimpleNamespace(name=name, frame=frame, config=SimpleNamespace(type=kind))


def test_frames_that_two_boats_share_are_said_at_the_start():
    sim, lines = Simulation(), []
    sim.sensors = {
        "a": [sensor("imu", "imu_link"), sensor("second", "imu_link"), sensor("truth", "map", "p3d")],
        "b": [sensor("imu", "imu_link"), sensor("truth", "map", "p3d"), sensor("gps", "b/gps")],
    }
    Diagnosis(sim, lambda level, text: lines.append(text))
    text = (
        "the frame imu_link belongs to imu of b and of a: their readings cannot be distinguished; "
        "remove the namespace from the frame's name"
    )
    assert lines == list(shared_frames(sim)) == [text]


def test_hints_are_looked_up_once_for_a_table_and_so_many_are_kept(scene, monkeypatch):
    asked = []
    monkeypatch.setattr(diagnosis, "_hint", lambda topic, *_: asked.append(topic) or "")
    hints, table, other = TopicHints(), RosInterface(), RosInterface()
    for _ in range(2):
        hints("/x", "*", table, ("a",))
    hints("/x", "*", other, ("a",))
    hints("/x", "a/B", other, ("a",))
    assert asked == ["/x"] * 3
    for number in range(4096):
        hints(f"/{number}", "*", other, ("a",))
    assert len(hints._hints) == 1
    assert RosInterface(elsewhere={"/y": "of another"}).elsewhere["/y"] == hints(
        "/y", "*", RosInterface(elsewhere={"/y": "of another"}), ()
    )


def test_an_unknown_publisher_is_asked_about_once_and_only_where_nobody_subscribes(scene, monkeypatch):
    monkeypatch.setattr(diagnosis, "_hint", lambda *_: "did you mean /z?")
    table = RosInterface(inputs={"/in": None})
    for topic, sender in (("/in", "/x"), ("/typo", "/x"), ("/typo", "/x"), ("/typo", "/y")):
        scene.watch.unknown_publisher(UnknownTopicPublisher(topic, "*", sender), table)
    text = "/typo has a publisher, %s, but no subscriber: did you mean /z?"
    assert said(scene) == [text % "/x", text % "/y"]


@pytest.mark.parametrize(
    ("topic", "boats", "hint"),
    [
        ("/a/cmd_vel", ("a",), "cmd_vel is off; enable it with --cmd-vel thrust or velocity"),
        ("/swarm/x", ("a",), "this world has no such topic"),
        ("/vrx/x", (), "this world has no such topic"),
        ("/zzz/shooters/ball", ("a",), "topics of boats begin with /a/"),
        ("/zzz/shooters/ball", (), "the world has no boat now"),
        ("/chatter", ("a",), ""),
        ("/a/thrusters/x", ("a",), "topics of boats begin with /a/"),
    ],
)
def test_hints_without_a_topic_that_is_alike(topic, boats, hint):
    assert TopicHints()(topic, "*", RosInterface(), boats) == hint
