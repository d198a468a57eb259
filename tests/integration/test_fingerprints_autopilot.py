"""What autopilots are told, and when, by a clock that is set by hand; and what their boards measure: as before."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from fake_sitl import packet
from fingerprints import check
from unit.autopilot.test_ardupilot import FLEET
from unit.autopilot.test_board import measured, moved
from vrx_mj import Simulation, compile_world
from vrx_mj.autopilot import ardupilot
from vrx_mj.autopilot.ardupilot import ArduPilot, ports_of, servos_of
from vrx_mj.autopilot.board import Channel, _usual_channels, is_servo_pulse
from vrx_mj.errors import CommandError
from vrx_mj.physics.tables import RUDDER


class Line:
    """A stand-in for a socket: packets that come, and answers that go."""

    def __init__(self):
        self.coming, self.sent = [], []

    def recvfrom(self, _size, *flags):
        if not self.coming:
            raise BlockingIOError
        return self.coming[0] if flags else self.coming.pop(0)

    def recv(self, size):
        return self.recvfrom(size)[0]

    def sendto(self, data, address):
        self.sent.append((data, address))

    def getsockname(self):
        return "127.0.0.1", 9002

    def close(self):
        """Nothing to close."""


FIRST, SECOND = ("10.0.0.1", 5), ("10.0.0.2", 6)


@pytest.fixture
def heard(monkeypatch):
    """A bridge of two boats without sockets, its lines, what it reports, and the clock."""
    clock, reports = SimpleNamespace(now=100.0), []
    monkeypatch.setattr(ardupilot.time, "monotonic", lambda: clock.now)
    monkeypatch.setattr(ardupilot, "_listening", lambda *_: Line())
    selector = SimpleNamespace(register=lambda *_: None, close=lambda: None)
    monkeypatch.setattr(ardupilot.selectors, "DefaultSelector", lambda: selector)
    sim = Simulation(compile_world({"physics": {"profile": "marine"}, "sea": {"model": "none"}}, fleet=FLEET))
    bridge = ArduPilot(sim, report=lambda *report: reports.append(report))
    selector.select = lambda _timeout: [(SimpleNamespace(data=link), 1) for link in bridge._links if link.socket.coming]
    return sim, bridge, reports, clock


def test_frames_are_answered_and_reported_as_they_were(heard):
    """Frames that come late, again, too far on, from elsewhere, too seldom or from the start."""
    sim, bridge, reports, clock = heard
    a, b = (link.socket for link in bridge._links)
    found = []

    def come(line, *frames, peer=FIRST, **options):
        line.coming += [(packet(number, (1900, 1500, 1700, *(1500,) * 13), **options), peer) for number in frames]
        found.append([bridge.step(0.0), bridge.waiting, bridge.steps, sim.time, len(reports), len(a.sent), len(b.sent)])

    come(a, 0)
    come(b, 0, peer=SECOND)
    come(a, 1, 1, 1)
    come(b, 0, 1, rate=25, peer=SECOND)
    come(a, 2, rate=400)
    come(a, 4)  # one is lost
    come(b, 2, peer=SECOND)
    come(a, 3, 3)  # it has restarted
    for seconds in (4.9, 0.1, 0.2):
        clock.now += seconds
        come(b)
    come(a, 7, peer=SECOND)
    clock.now += 4.9
    come(a, 5, peer=("10.0.0.3", 7))
    clock.now += 0.1
    come(a, 6, peer=("10.0.0.3", 7))
    a.coming.append((b"foreign", SECOND))
    come(b, 9, rate=70)
    for number in range(10, 16):
        come(b, number, rate=70, peer=SECOND)
        come(a, number, rate=1000, peer=("10.0.0.3", 7))
    answers = [data for line in (a, b) for data, _ in line.sent]
    peers = [peer for line in (a, b) for _, peer in line.sent]
    check(
        "autopilot",
        "frames",
        found=found,
        answers=[str(data, "ascii").replace(",", " ") for data in answers],
        peers=peers,
    )
    check("autopilot", "reports", reports=[[level, *text.replace(",", "").split(" ")] for level, text in reports])


def test_what_a_board_measures_is_what_it_was():
    random, found = np.random.default_rng(2), []
    for number in range(12):
        poses = [
            moved(
                position=random.uniform(-9.0, 9.0, 3), roll=random.uniform(-0.5, 0.5), pitch=random.uniform(-0.5, 0.5),
                yaw=random.uniform(-3.0, 3.0), velocity=random.uniform(-2.0, 2.0, 3), spin=random.uniform(-1.0, 1.0, 3),
                time=0.5 * step,
            )
            for step in range(1 + number % 3)
        ]  # fmt: skip
        mounted, wind = random.uniform(-1.0, 1.0, 3), random.uniform(-5.0, 5.0, 3)
        found.append(measured(*poses, mounted=mounted, wind=wind, x_from_east=0.3 * number))
    check("autopilot", "boards", found=found)


def test_channels_command_what_they_did():
    pulses = (0, 499, 500, 501, 1000, 1100, 1449, 1451, 1499, 1500, 1501, 1560, 1900, 1950, 2499, 2500, 2501)
    channels = [
        Channel("one", -80.0, 200.0),
        Channel("two", -1.0, 1.0, 1450.0, (300.0, -500.0), 49.0),
        Channel("sail", -0.5, 1.2, 1000.0, (1000.0, 1000.0)),
    ]
    check(
        "autopilot",
        "channels",
        values=[channel.value(pulse) for channel in channels for pulse in pulses],
        servo=[is_servo_pulse(pulse) for pulse in pulses],
    )


def thruster(name, *, mapping=0, sail=None, max_angle=0.0):
    return SimpleNamespace(name=name, mapping=mapping, sail=sail, max_angle=max_angle, command_limits=(-1.0, 1.0))


LEFT, RIGHT, SCREW = (thruster(name) for name in ("left", "right", "screw"))
HELM, POD = thruster("helm", mapping=RUDDER, max_angle=0.5), thruster("pod", max_angle=0.4)
SAIL = thruster("main", mapping=RUDDER, sail=object(), max_angle=1.2)
FLEETS = {
    "pair": (LEFT, RIGHT, HELM), "screw": (SCREW, HELM), "pod": (POD,), "sail": (SAIL, HELM),
    "all": (SCREW, SAIL, HELM), "two screws": (SCREW, LEFT, HELM), "no helm": (SCREW,),
    "two helms": (SCREW, HELM, POD), "none": (),
}  # fmt: skip


@pytest.mark.parametrize("fleet", FLEETS)
def test_a_boat_has_the_channels_that_it_had_or_none_that_are_clear(fleet):
    world = SimpleNamespace(parameters=SimpleNamespace(thrusters_of=lambda _: FLEETS[fleet]))
    try:
        found = _usual_channels(world, "boat")
    except CommandError as error:
        found = str(error).replace(",", "").split(" ")
    check("autopilot", fleet.replace(" ", "_"), found=found)


@pytest.mark.parametrize(
    ("text", "ports"),
    [
        ("", {"a": 9002, "b": 9012}),
        ("7000", {"a": 7000, "b": 7010}), ("b:1,a:2", {"b": 1, "a": 2}),
        ("x:y:5", {"x:y": 5}),
        ("a", None), (":5", None), ("a:b", None), ("a:1,", None),
    ],
)  # fmt: skip
def test_ports_are_counted_or_given(text, ports):
    sim = SimpleNamespace(boats=("a", "b"))
    if ports is None:
        with pytest.raises(CommandError) as caught:
            ports_of(sim, text)
        rule = "BOAT:PORT,... or a PORT is needed, as in wamv:9002"
        assert str(caught.value) == f"invalid --ardupilot '{text}': {rule}"
    else:
        assert ports_of(sim, text) == ports


def test_a_boat_has_one_port():
    with pytest.raises(CommandError, match=r"^invalid --ardupilot 'a:1,b:2,a:3': 'a' occurs twice$"):
        ports_of(SimpleNamespace(boats=("a", "b")), "a:1,b:2,a:3")


def test_packets_are_read_as_they_were():
    pulses = [tuple(range(1000 + 7 * size, 1000 + 8 * size)) for size in (16, 32)]
    whole = [packet(2**31 + number, each, rate=number) for number, each in itertools.product((0, 1, 400), pulses)]
    found = (
        [servos_of(data) for data in whole]
        + [servos_of(data[:-1]) for data in whole]
        + [servos_of(b"\x1a"), servos_of(b"")]
    )
    check("autopilot", "packets", found=found)
