"""The loop that serves a world, its line of status and its greeting, on a clock that only waits move."""

import threading
from types import SimpleNamespace

import pytest

from ros_scene import Fake
from vrx_mj.errors import CommandError
from vrx_mj.ros import serve
from vrx_mj.ros.interface import Inbox, RosInterface, Traffic
from vrx_mj.ros.network import Network
from vrx_mj.ros.serve import Meter, ServeOptions

STEP = 0.01


class World:
    """A clock, an inbox and a server in one: time goes on where somebody waits or steps."""

    def __init__(self, *, cost=0.0, idle=(), stalls=()):
        self.now, self.waits, self.ticks, self.pending, self.paused, self.lockstep = 100.0, [], [], False, False, None
        self.sim = SimpleNamespace(timestep=STEP, time=0.0, task_is_over=False, reading_times={})
        self.cost, self.idle, self.stalls, self.advanced, self.done = cost, idle, dict(stalls), [], []
        self.reset_simulation = self.announce = lambda: self.done.append("begun")

    def perf_counter(self):
        return self.now

    def process_time(self):
        return 0.5 * self.now

    def wait(self, seconds):
        self.waits.append(seconds)
        self.now += seconds + 1e-5

    def receive(self):
        self.now += 1e-4 + self.stalls.pop(len(self.ticks), 0.0)

    def tick(self):
        self.now += self.cost
        self.ticks.append(self.now)
        if len(self.ticks) in self.idle:
            return 0
        self.sim.time += STEP
        return 1

    def advance(self, steps):
        self.advanced.append(steps)
        self.sim.time += steps * STEP


def played(monkeypatch, world, wanted, *, over=lambda: False, autopilots=None):
    """The lines of a run."""
    monkeypatch.setattr(serve, "time", world)
    monkeypatch.setattr(serve, "process_memory", lambda: 3_400_000)
    lines = []
    loop = serve._Loop(world, world, wanted, [Fake()], over, autopilots)
    loop.run(SimpleNamespace(is_set=lambda: False), lines.append, lambda *line: lines.append(line))
    world.loop = loop
    return lines


def test_without_a_pace_it_steps_as_fast_as_it_can_in_bites(monkeypatch):
    world = World(cost=0.02, idle=(50, 51))
    lines = played(monkeypatch, world, ServeOptions(rate=None, duration=1.0))
    assert len(world.ticks) == 102
    assert world.waits == [0.02, 0.02]
    assert world.ticks[1] - world.ticks[0] == pytest.approx(0.02)
    assert world.ticks[3] - world.ticks[2] == pytest.approx(0.0201)  # three steps are 0.05 s: it reads what has come
    assert [line.partition("  pace")[0] for line in lines[:-1]] == ["t 0.5 s", "t 1.0 s"]
    assert lines[-1] == ("INFO", "served 1.0 s in 2.1 s: pace 0.480, CPU 50 %, 3 MB, 0.0 MB sent")
    assert world.done == ["begun"]
    assert world.update_rate == 0.0


def test_what_has_come_ends_a_bite(monkeypatch):
    world = World(cost=0.001)
    world.pending = True
    served = []
    played(monkeypatch, world, ServeOptions(rate=None), over=lambda: served.append(1) or len(served) > 5)
    assert world.ticks == []


def test_paused_time_stands_and_nothing_is_owed_afterwards(monkeypatch):
    world, turns = World(), []
    world.paused = True

    def over():
        turns.append(world.now)
        world.paused = len(turns) < 10
        return False

    played(monkeypatch, world, ServeOptions(rate=1.0, duration=0.5), over=over)
    assert world.waits[:9] == [0.02] * 9
    assert world.ticks[0] > turns[9]
    assert len(world.ticks) == 50
    assert world.ticks[-1] - world.ticks[0] == pytest.approx(0.49, abs=0.02)
    assert world.update_rate == 100.0


@pytest.mark.parametrize(("duration", "ticks"), [(0.1, 10), (0.1 + 2e-6, 11), (0.1 + 5e-7, 10), (0.0, 0)])
def test_it_ends_at_the_first_step_of_the_duration(monkeypatch, duration, ticks):
    world = World()
    played(monkeypatch, world, ServeOptions(rate=None, duration=duration))
    assert len(world.ticks) == ticks


@pytest.mark.parametrize("exits", [True, False])
def test_it_ends_with_the_task_if_that_is_wanted(monkeypatch, exits):
    world = World()
    world.sim.task_is_over = True
    played(monkeypatch, world, ServeOptions(rate=None, duration=0.3, exit_on_completion=exits))
    assert (len(world.ticks) == 0) is exits


def test_autopilots_take_time_on_by_their_steps(monkeypatch):
    world, asked = World(), []
    pilots = SimpleNamespace(steps=4, answer=lambda: asked.append("answered"))

    def receive(timeout):
        asked.append(timeout)
        world.now += 0.01
        return len(asked) % 2 == 0

    pilots.receive = receive
    played(monkeypatch, world, ServeOptions(rate=1.0, duration=0.12), autopilots=pilots)
    assert world.advanced == [4, 4, 4]
    assert asked[:4] == [0.02, 0.02, "answered", 0.02]
    assert world.ticks == []
    assert world.update_rate == 0.0
    pilots.restart()
    assert world.done == ["begun"] * 2


def test_a_line_of_status_has_the_differences_since_the_last(monkeypatch):
    world = World()
    monkeypatch.setattr(serve, "time", world)
    monkeypatch.setattr(serve, "process_memory", lambda: 1_600_000)
    sides = [SimpleNamespace(traffic=Traffic(2, 0, 0)), SimpleNamespace(traffic=Traffic(1, 0, 0))]
    meter = Meter(world, sides, 100.0)
    world.now, world.sim.time = 102.0, 3.0
    sides[0].traffic, world.sim.reading_times = Traffic(2, 7000, 0), {("a", "lidar"): 0.5, ("a", "imu"): 0.0}
    assert meter.line() == ("t 3.0 s  pace 1.50  CPU 50 %  2 MB  4 KB/s to 3 clients  slowest sensor: lidar of a, 25 %")
    assert (meter.pace, meter.load) == (1.5, {("a", "lidar"): 0.25})
    world.now, world.sim.time, world.paused = 103.0, 1.0, True  # somebody has begun anew
    sides[1].traffic = Traffic(0, 500, 4)
    world.sim.reading_times = {("a", "lidar"): 0.5, ("a", "imu"): 0.01, ("b", "camera"): 0.2}
    world.lockstep = SimpleNamespace(missing=["/cmd"])
    assert meter.line() == (
        "t 1.0 s  paused  CPU 50 %  2 MB  0 KB/s to 2 clients  4 messages dropped  "
        "slowest sensor: camera of b, 20 %  waits for /cmd"
    )
    assert (meter.pace, meter.load) == (0.0, {("a", "imu"): 0.01, ("b", "camera"): 0.2})
    world.now, world.sim.time, world.lockstep.missing = 104.0, 1.5, ["/cmd", "/x", "/y"]
    assert meter.line().endswith("4 messages dropped  waits for /cmd and 2 more")
    world.sim.time, world.lockstep.missing = 2.0, []
    assert meter.summary() == "served 4.0 s in 4.0 s: pace 1.000, CPU 50 %, 2 MB, 0.0 MB sent"
    assert meter.line().endswith("4 messages dropped")


def greeted(monkeypatch, boats, tables, **wanted):
    """The lines with which a run begins."""
    lines = []
    sim = SimpleNamespace(boats=boats, world=SimpleNamespace(name="bay"))
    monkeypatch.delenv("VRX_DEBUG", raising=False)
    if wanted.pop("quiet", False):
        monkeypatch.setenv("VRX_DEBUG", "false")
    serve._greet(SimpleNamespace(sim=sim, tables=tables), ServeOptions(**wanted), lambda *line: lines.append(line))
    return lines


@pytest.mark.parametrize(
    ("count", "text"),
    [(0, "no boats"), (1, "1 boat, b0"), (8, "8 boats, b0, b1, b2, b3, b4, b5, b6, b7"), (9, "9 boats, b0 ... b8")],
)
def test_a_greeting_names_so_many_boats(monkeypatch, count, text):
    lines = greeted(monkeypatch, tuple(f"b{number}" for number in range(count)), {})
    assert lines[0] == ("INFO", f"bay: {text}")
    assert len(lines) == 2


def test_a_greeting_says_what_is_served_and_what_time_waits_for(monkeypatch):
    table = RosInterface({"/a": None, "/b": None}, {"/in": None}, {})
    drawn = "cameras and lidars are rendered only while they have subscribers"
    lines = greeted(
        monkeypatch, ("a",), {"vrx": table, "vrx3": RosInterface({}, {}, {"/s": None})}, cmd_vel="off",
        lockstep=("/in", "/typo"), paused=True, quiet=True,
    )  # fmt: skip
    assert lines[1:] == [
        ("INFO", f"2 topics out, 1 in, 0 services; {drawn}"),
        ("INFO", f"0 topics out by VRX 3's names, 0 in, 1 services; {drawn}"),
        ("INFO", "cmd_vel is not subscribed to; with --cmd-vel thrust it is VRX's twist2thrust"),
        ("INFO", "lockstep: time waits for /in, /typo"),
        ("WARN", "lockstep: nothing here subscribes to /typo, so time does not advance"),
        ("INFO", "paused: start time with rosservice call /gazebo/unpause_physics"),
        ("INFO", "VRX_DEBUG=false: no wind and contact topics"),
    ]
    assert greeted(monkeypatch, ("a",), {}, lockstep=())[-1] == (
        "INFO", "lockstep: time waits for /vrx_mj/step alone"
    )  # fmt: skip


@pytest.mark.parametrize(("master", "port"), [("", 11311), ("http://far:4000", 4000), ("http://far", 11311)])
def test_what_to_type_elsewhere_has_the_port_of_the_master(monkeypatch, master, port):
    monkeypatch.setenv("ROS_MASTER_URI", master)
    uri = f"http://10.0.0.1:{port}"
    monkeypatch.setattr(serve, "unreachable", lambda *_: None)
    monkeypatch.setattr(serve, "announced_address", lambda *_: "10.0.0.1")
    told = []
    for wanted in (ServeOptions(ros1=True, rosbridge=9091), ServeOptions()):
        serve._show_addresses(wanted, lambda *line: told.append(line))
    assert told == [
        ("INFO", f"on the other machine, in a shell: export ROS_MASTER_URI={uri} ROS_IP=ADDRESS_OF_THAT_MACHINE"),
        ("INFO", f"in MATLAB: setenv('ROS_IP', 'ADDRESS_OF_THAT_MACHINE'); rosinit('{uri}')"),
        ("INFO", "roslibpy: roslibpy.Ros('10.0.0.1', 9091)"),
    ]


def test_transports_are_those_that_are_wanted():
    network, ending = Network(), threading.Event()
    try:

        def kinds(**wanted):
            return [type(one).__name__ for one in serve._transports(network, Inbox(), ServeOptions(**wanted), ending)]

        assert kinds(ros2=True) == ["Ros2"]
        assert kinds(ros2=True, nmea={"a": 10110, "b": 10111}) == ["Ros2", "Nmea", "Nmea"]
        wires, *_ = serve._transports(network, Inbox(), ServeOptions(ros1=True, rosbridge=0), ending)
        ros1, bridge = wires.servers
        ros1.on_shutdown("rosnode kill")
        assert ending.is_set()
        assert bridge.port == 0
        with pytest.raises(CommandError, match=r"^no transport: --ros1, --rosbridge, --foxglove, --nmea or --ros2 is"):
            kinds()
    finally:
        network.close()
