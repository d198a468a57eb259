"""Time that waits for answers: the same bits however late they come."""

import math
import queue
import random
import threading
import time

import pytest

from ros_scene import Fake, call, served
from vrx_mj import Simulation
from vrx_mj.ros import serve as serving
from vrx_mj.ros.interface import Inbox
from vrx_mj.ros.messages import new
from vrx_mj.ros.ros_server import MOST_ANSWERS, Lockstep, RosServer
from vrx_mj.ros.serve import ServeOptions

LEFT, RIGHT, OTHER = (
    f"/wamv{name}_thrust_cmd" for name in ("1/thrusters/left", "1/thrusters/right", "2/thrusters/left")
)
CLOCK_RATE = 20.0


def thrust(value):
    return new("std_msgs/Float32", data=value)


def at(message):
    """The time of a clock [s]."""
    return message.clock.sec + 1e-9 * message.clock.nanosec


class Nodes(Fake):
    """A node for each topic, in a thread of its own: it answers every clock after a while."""

    def __init__(self, inbox, topics, seed):
        super().__init__(wanted={"/clock"})
        self._inbox, self._heard = inbox, {topic: queue.SimpleQueue() for topic in topics}
        self._threads = [
            threading.Thread(target=self._answer, args=(topic, random.Random(f"{seed} {topic}"))) for topic in topics
        ]
        for thread in self._threads:
            thread.start()

    def publish(self, batch):
        for sent in batch:
            if sent.output.name == "/clock":
                for heard in self._heard.values():
                    heard.put(at(sent.message))

    def _answer(self, topic, random):
        while (moment := self._heard[topic].get()) is not None:
            time.sleep(random.choice((0.0, 0.0005, 0.004)))
            value = math.sin(3.0 * moment + len(topic)) if topic != OTHER else 0.5 * moment - 1.0
            self._inbox.message(topic, thrust(value), "/node")

    def close(self):
        for heard in self._heard.values():
            heard.put(None)
        for thread in self._threads:
            thread.join()


@pytest.fixture
def loop(monkeypatch):
    """Runs a server's loop until something holds; the lines of status."""
    monkeypatch.setattr(serving, "STATUS_PERIOD", 0.03)

    def run(server, network, inbox, over, duration=None):
        lines, give_up = [], time.monotonic() + 60.0
        wanted = ServeOptions(lockstep=(), duration=duration)

        def done():
            assert time.monotonic() < give_up, lines[-1:]
            return over(lines)

        loop = serving._Loop(server, inbox, wanted, [network], done)
        loop.run(threading.Event(), lines.append, lambda *_: None)
        return lines

    return run


def test_the_same_bits_however_late_the_answers_come(bay, loop):
    ends = []
    for seed in range(3):
        sim, inbox = Simulation(bay), Inbox()
        nodes = Nodes(inbox, (LEFT, RIGHT, OTHER), seed)
        server = RosServer(
            sim, [nodes], inbox, report=lambda *_: None, clock_rate=CLOCK_RATE, lockstep=Lockstep((LEFT, RIGHT, OTHER))
        )
        try:
            loop(server, nodes, inbox, lambda _: False, duration=5.0)
        finally:
            nodes.close()
            server.close()
        ends.append((sim.time, sim.get_state().sha256))
    assert ends[0][0] == pytest.approx(5.0)
    assert ends[0] == ends[1] == ends[2]
    moved = math.dist(sim.observe()["wamv2"].position[:2], Simulation(bay).observe()["wamv2"].position[:2])
    assert moved > 0.5  # commands did act


def test_who_never_answers_stops_time_and_the_status_names_it(bay, loop):
    scene = served(bay, lockstep=Lockstep((LEFT, OTHER, RIGHT)))
    scene.inbox.message(LEFT, thrust(1.0), "/quick")
    lines = loop(scene.server, scene.network, scene.inbox, lambda lines: len(lines) >= 2)
    assert scene.sim.time == 0.0
    assert lines[-1].endswith(f"  waits for {OTHER} and 1 more")
    scene.inbox.message(OTHER, thrust(1.0), "/late")
    lines = loop(scene.server, scene.network, scene.inbox, lambda lines: len(lines) >= 1)
    assert (scene.sim.time, lines[-1].split("  ")[-1]) == (0.0, f"waits for {RIGHT}")
    scene.inbox.message(RIGHT, thrust(1.0), "/later")
    loop(scene.server, scene.network, scene.inbox, lambda _: scene.sim.time > 0.0)
    assert scene.sim.time == pytest.approx(0.01)
    assert scene.server.tick() == 0  # each answer counts for one clock


def test_answers_are_taken_one_for_each_clock_in_their_order(scene):
    lockstep = Lockstep((LEFT,))
    for value in range(MOST_ANSWERS + 2):
        scene.inbox.message(LEFT, thrust(float(value)), "/node")
        (command,), _, _ = scene.inbox.drain()
        assert lockstep.keep(command)
    (first,), (second,) = lockstep.answers(), lockstep.answers()
    assert (first.message.data, second.message.data) == (2.0, 3.0)  # of too many the oldest are forgotten


def test_by_steps_alone_time_advances_exactly(bay, loop):
    scene = served(bay, lockstep=Lockstep(()), clock_rate=10.0)
    step = scene.sim.timestep
    scene.server.announce()
    for duration in (0.05, 3 * step, 0.31, 2.0):
        before = scene.sim.time
        told = call(scene, "/vrx_mj/step", "vrx_mj_msgs/Step", duration=duration)
        assert told.sim_time == scene.sim.time == pytest.approx(before + duration, abs=1e-9)
        assert scene.server.tick() == 0
    last = scene.sim.time
    told = call(scene, "/vrx_mj/step", "vrx_mj_msgs/Step", duration=0.0)
    assert told.sim_time == pytest.approx(math.floor(last * 10.0 + 1.0) / 10.0)  # to the clock's next moment
    moments = [at(sent.message) for sent in scene.network.got["/clock"]]
    assert moments == pytest.approx([0.1 * k for k in range(len(moments))])
    assert len(moments) == 1 + round(10.0 * told.sim_time)
    lines = loop(scene.server, scene.network, scene.inbox, lambda lines: len(lines) >= 1)
    assert lines[-1].endswith("  waits for /vrx_mj/step")
    assert scene.sim.time == told.sim_time


def test_commands_on_other_topics_act_at_once(bay):
    scene = served(bay, lockstep=Lockstep((LEFT,)))
    rows = scene.sim._live.commands.thrusters

    def commanded():
        commands = scene.sim._live.arrays.thruster_state["command"]
        return commands[rows["wamv1"]["left"]], commands[rows["wamv2"]["left"]]

    scene.inbox.message(LEFT, thrust(0.25), "/node")
    scene.inbox.message(OTHER, thrust(0.75), "/node")
    scene.server.receive()
    assert commanded() == (0.0, 0.75)
    assert scene.server.tick() == 1
    assert commanded() == (0.25, 0.75)


def test_after_a_reset_the_clock_is_told_again_and_old_answers_are_forgotten(bay):
    scene = served(bay, lockstep=Lockstep((LEFT,)))
    for _ in range(3):
        scene.inbox.message(LEFT, thrust(0.5), "/node")
    scene.server.receive()
    assert scene.server.tick() == 1
    call(scene, "/gazebo/reset_simulation", "std_srvs/Empty")
    assert at(scene.network.got["/clock"][-1].message) == 0.0
    assert scene.server.tick() == 0
    scene.inbox.message(LEFT, thrust(0.5), "/node")
    scene.server.receive()
    assert scene.server.tick() == 1
