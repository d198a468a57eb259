"""The wire of chart plotters: UDP, several clients of TCP, those who do not read, and topics of ROS."""

import contextlib
import socket
import time
from functools import partial

import pynmea2
import pytest

import vrx_mj
from ros1_served import free_port
from ros_scene import Fake, served
from vrx_mj.arguments import as_ports
from vrx_mj.cli.ros import check_installed
from vrx_mj.errors import CommandError, NetworkError, UnknownNameError
from vrx_mj.nmea import Instruments
from vrx_mj.ros import cdr
from vrx_mj.ros.interface import Delivery, Inbox, Output, RosInterface
from vrx_mj.ros.messages import new
from vrx_mj.ros.ros_server import RosServer
from vrx_mj.ros.serve import MOST_SENTENCES, SENTENCE_TYPE, Nmea, ServeOptions, nmea_outputs, nmea_topics, serve

SOON = 20.0
"""Wall time after which what does not come is missing [s]."""
OUTPUT = Output(nmea_topics("a")[0], SENTENCE_TYPE, lambda: None)
TABLE = RosInterface({OUTPUT.name: OUTPUT})


@pytest.fixture
def wire():
    with closing(Nmea("a", port=0)) as wire:
        wire.start()
        wire.offer(TABLE)
        yield wire


@contextlib.contextmanager
def closing(wire):
    try:
        yield wire
    finally:
        wire.close()


def line(number=0, size=0):
    return Delivery(OUTPUT, new(SENTENCE_TYPE, sentence=f"$IITXT,{number:06d}".rjust(size)), 0.0)


def until(is_done):
    """Wait for something that another thread does."""
    end = time.monotonic() + SOON
    while not is_done():
        assert time.monotonic() < end
        time.sleep(0.005)


def connected(wire, count=1):
    """A client that the wire knows of."""
    client = socket.create_connection(("127.0.0.1", wire.port), timeout=SOON)
    until(lambda: wire.publish([]) or wire.traffic.clients == count)
    return client


def read(client, size, wire):
    """So many bytes, while the run goes on."""
    found = b""
    while len(found) < size:
        found += client.recv(1 << 16)
        wire.publish([])
    return found


def test_every_client_gets_the_lines_and_so_does_udp(wire):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as plotter:
        plotter.bind(("127.0.0.1", wire.port))
        plotter.settimeout(SOON)
        with connected(wire) as one, connected(wire, 2) as other:
            wire.publish([line(1), line(2)])
            for client in (one, other):
                assert read(client, 30, wire) == b"$IITXT,000001\r\n$IITXT,000002\r\n"
            assert [plotter.recv(1000) for _ in range(2)] == [b"$IITXT,000001\r\n", b"$IITXT,000002\r\n"]
            assert wire.traffic.sent == 3 * 30
    until(lambda: wire.publish([line(3)]) or not wire.traffic.clients)


def test_a_client_that_never_reads_holds_nobody_up_and_gets_the_newest(wire):
    with connected(wire) as silent, connected(wire, 2) as reader:
        for first in range(0, 16_000, 500):
            wire.publish([line(number, size=998) for number in range(first, first + 500)])
            assert read(reader, 500_000, wire).endswith(f"{first + 499:06d}\r\n".encode())
        assert wire.traffic.dropped > 0
        assert max(map(len, wire._clients.values())) <= MOST_SENTENCES
        rest = b""
        while not rest.endswith(b"015999\r\n"):
            wire.publish([])
            rest += silent.recv(1 << 16)
        numbers = [int(text[-6:]) for text in rest.split()]
        assert numbers == sorted(numbers)
        assert len(numbers) + wire.traffic.dropped == 16_000


def test_who_writes_to_us_is_not_read_and_still_gets_all(wire):
    with connected(wire) as writer:
        writer.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            for _ in range(10_000):
                writer.send(b"$GPGGA,1,2,3\r\n" * 1000)
            pytest.fail("140 MB were read")
        writer.settimeout(SOON)
        wire.publish([line(7)])
        assert read(writer, 15, wire) == b"$IITXT,000007\r\n"


def test_who_has_shut_down_writing_still_reads(wire):
    with connected(wire) as client:
        client.shutdown(socket.SHUT_WR)
        time.sleep(0.05)
        wire.publish([line(1)])
        assert read(client, 15, wire) == b"$IITXT,000001\r\n"


def test_a_port_in_use_is_said_with_who_has_it(wire):
    other = Nmea("a", port=wire.port)
    with closing(other), pytest.raises(NetworkError, match=rf"NMEA: port {wire.port} of 127.0.0.1 is taken by process"):
        other.start()


def test_of_all_networks_udp_goes_to_everybody():
    with closing(Nmea("a", port=0, host="0.0.0.0")) as wire:
        (text,) = wire.start()
        assert text == f"NMEA of a: TCP port {wire.port} of 0.0.0.0, UDP to port {wire.port} of 255.255.255.255"
        wire.offer(TABLE)
        with connected(wire) as client:
            wire.publish([line(1)])  # also where there is no network
            assert read(client, 15, wire) == b"$IITXT,000001\r\n"


@pytest.mark.parametrize("dialect", ["vrx", "vrx3"])
def test_sentences_are_topics_of_ros_1_and_ros_2(bay, dialect):
    sim = vrx_mj.Simulation(bay)
    boat, other = sim.boats
    own, ais = nmea_topics(boat)
    scene = served(sim, wanted=(own, ais), dialect=dialect, further=partial(nmea_outputs, Instruments(sim)))
    assert {nmea_topics(name)[0] for name in (boat, other)} <= scene.network.table.outputs.keys()
    scene.server.announce()
    for _ in range(12):
        scene.server.advance(100)
    sentences = [sent.message.sentence for sent in scene.network.got[own]]
    kinds = [pynmea2.parse(text, check=True).sentence_type for text in sentences]
    assert (kinds.count("RMC"), kinds.count("HDT")) == (13, 121)
    assert all(sent.message.sentence.startswith("!AIVDM") for sent in scene.network.got[ais])
    fix = next(sent.message for sent in scene.network.got[own] if "RMC" in sent.message.sentence)
    assert fix.header.frame_id.startswith(f"{boat}/gps")
    assert cdr.decode(cdr.encode(fix, SENTENCE_TYPE), SENTENCE_TYPE).sentence == fix.sentence


def test_both_generations_of_topics_and_the_wire_carry_the_same(bay):
    sim = vrx_mj.Simulation(bay)
    topics = [name for boat in sim.boats for name in nmea_topics(boat)]
    networks = [Fake(topics), Fake(topics, "vrx3")]
    server = RosServer(sim, networks, Inbox(), report=lambda *_: None, further=partial(nmea_outputs, Instruments(sim)))
    for _ in range(12):
        server.advance(100)
    server.close()
    one, other = ([[sent.message for sent in network.got[topic]] for topic in topics] for network in networks)
    assert one == other


def test_without_instruments_there_are_no_such_topics(scene):
    assert not [name for name in scene.server.table.outputs if "nmea" in name]


class Heard:
    """A socket that keeps what is sent."""

    def __init__(self):
        self.lines = []

    def sendto(self, line, _address):
        self.lines.append(line)
        return len(line)


def test_a_world_is_served_to_plotters_alone(bay):
    """Two runs give the same bytes, whenever somebody connects."""
    found, (boat, _) = [], vrx_mj.Simulation(bay).boats
    for _ in range(2):
        wanted, said = ServeOptions(nmea={boat: free_port()}, rate=None, duration=1.0), []
        heard = Heard()

        def keep(transports, heard=heard):
            (wire,) = transports
            wire._udp = heard

        serve(vrx_mj.Simulation(bay, seed=5), wanted, report=lambda _, text, said=said: said.append(text), ready=keep)
        found.append(heard.lines)
        assert said[0] == f"{boat} sends GGA, RMC, VTG, HDT, ROT, XDR; it receives AIVDM"
        assert not any("drive the boats" in text for text in said)
    assert found[0] == found[1]
    assert len(found[0]) > 20


@pytest.mark.parametrize(
    ("text", "ports"),
    [
        ("10110", {"a": 10110}),
        ("b:10111", {"b": 10111}),
        ("a:1,b:2", {"a": 1, "b": 2}),
    ],
)
def test_ports_are_those_of_boats_or_of_the_first(text, ports):
    assert as_ports("--nmea", text, "ports are needed", "a") == ports


@pytest.mark.parametrize(
    ("text", "first"), [("x", "a"), ("a:", "a"), ("a:b", "a"), ("", "a"), ("a:-1", "a"), ("1", "")]
)
def test_invalid_ports_are_said(text, first):
    with pytest.raises(CommandError, match=r"invalid --nmea '.*': ports are needed"):
        as_ports("--nmea", text, "ports are needed", first)


@pytest.mark.parametrize("text", ["a:1,a:2", "1,a:2", "b:3,1,2"])
def test_a_boat_has_one_port(text):
    with pytest.raises(CommandError, match=f"^invalid --nmea '{text}': 'a' occurs twice$"):
        as_ports("--nmea", text, "ports are needed", "a")


def test_unknown_boats_are_named_and_a_port_is_of_one_boat(bay):
    sim, port = vrx_mj.Simulation(bay), free_port()
    with pytest.raises(UnknownNameError, match="no boat named 'c'; known: "):
        serve(sim, ServeOptions(nmea={"c": port}), report=lambda *_: None)
    with pytest.raises(NetworkError, match=f"NMEA: port {port} of 127.0.0.1 is taken by process"):
        serve(sim, ServeOptions(nmea=dict.fromkeys(sim.boats, port)), report=lambda *_: None)


def test_a_missing_extra_is_named(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name == "pyais" else True)
    with pytest.raises(NetworkError, match=r"not installed: pyais; run in the clone of vrx_mj: .*\.\[nmea\]"):
        check_installed("nmea", "ros1")
