"""Lock-step with stand-ins of ArduPilot's SITL over UDP."""

import math
import re
import socket

import pytest

from fake_sitl import FakeSitl, packet
from vrx_mj import Simulation, compile_world, record
from vrx_mj.autopilot import ArduPilot
from vrx_mj.autopilot import ardupilot as module
from vrx_mj.autopilot.board import channels_of
from vrx_mj.errors import CommandError, NetworkError, UnknownNameError

FLEET = {"boats": [{"name": "a", "pose": [0, 0, 0, 0, 0, 0]}, {"name": "b", "pose": [0, 9, 0, 0, 0, 0]}]}
AHEAD = (1900, 1500, 1900, *(1500,) * 13)
PORT = (1100, 1500, 1900, *(1500,) * 13)
"""The left engine astern, the right one ahead."""


@pytest.fixture(scope="module")
def world():
    sea = {"model": "jonswap", "significant_height": 0.3, "peak_period": 3.0}
    return compile_world({"physics": {"profile": "marine"}, "sea": sea}, fleet=FLEET)


@pytest.fixture
def lines():
    return []


@pytest.fixture
def one(world, lines):
    """A simulation whose boat a has an autopilot, the bridge, and the autopilot."""
    sim = Simulation(world)
    bridge = ArduPilot(sim, {"a": 0}, report=lambda _, text: lines.append(text))
    with bridge, FakeSitl(bridge.addresses["a"]) as sitl:
        yield sim, bridge, sitl


def sailed(bridge, sitl, frames, pulses=AHEAD):
    for _ in range(frames):
        sitl.send(pulses)
        assert bridge.step()
        answer = sitl.receive()
    return answer


def test_each_frame_takes_time_on_by_its_length_and_no_further(one):
    sim, bridge, sitl = one
    assert not bridge.step(0.0)
    assert sim.time == 0.0
    assert [sailed(bridge, sitl, 1)["timestamp"][0] for _ in range(3)] == pytest.approx([0.02, 0.04, 0.06])
    assert not bridge.step(0.0)
    assert sim.time == pytest.approx(0.06)


def test_a_frame_that_comes_again_is_answered_again_and_takes_no_time(one):
    sim, bridge, sitl = one
    first = sailed(bridge, sitl, 1)
    for _ in range(3):
        sitl.repeat()
        assert not bridge.step(0.1)
        assert sitl.receive() == first
    assert sim.time == pytest.approx(0.02)


def test_repeats_from_before_an_answer_are_dropped(one):
    """Each would be answered, and the autopilot would be that many frames behind from then on."""
    _, bridge, sitl = one
    sitl.send()
    for _ in range(5):
        sitl.repeat()
    assert bridge.step()
    assert sitl.receive()["timestamp"] == [pytest.approx(0.02)]
    assert not bridge.step(0.05)
    assert not sitl.is_answered
    assert sailed(bridge, sitl, 1)["timestamp"] == [pytest.approx(0.04)]


def test_channels_drive_the_engines(one):
    sim, bridge, sitl = one
    sailed(bridge, sitl, 100, PORT)
    assert sim.observe()["a"].heading > 0.05 > abs(sim.observe()["b"].heading)
    assert sim.thrust("a")["left"] < 0.0 < sim.thrust("a")["right"]


def test_channels_without_output_command_nothing(one):
    sim, bridge, sitl = one
    sailed(bridge, sitl, 50)
    sailed(bridge, sitl, 50, (0,) * 16)
    assert set(sim.thrust("a").values()) == {0.0}


def test_the_same_frames_give_the_same_run_to_the_bit(world):
    def state():
        sim = Simulation(world)
        bridge = ArduPilot(sim, {"a": 0, "b": 0})
        with bridge, FakeSitl(bridge.addresses["a"]) as a, FakeSitl(bridge.addresses["b"], rate=25) as b:
            b.send(PORT)
            for frame in range(40):
                a.send((1500 + 10 * frame, *PORT[1:]))
                bridge.step()
                a.receive()
                if b.is_answered:
                    b.receive()
                    b.send(AHEAD)
        assert sim.time == pytest.approx(0.8)
        return sim.get_state().sha256

    assert state() == state()


def test_time_waits_for_the_autopilots_of_all_boats(world):
    sim = Simulation(world)
    bridge = ArduPilot(sim, {"a": 0, "b": 0})
    with bridge, FakeSitl(bridge.addresses["a"]) as a, FakeSitl(bridge.addresses["b"]) as b:
        a.send()
        assert not bridge.step(0.1)
        assert (bridge.waiting, sim.time) == (("b",), 0.0)
        b.send()
        assert bridge.step(0.1)
        assert a.receive() != b.receive()
        assert bridge.waiting == ("a", "b")


def test_an_autopilot_that_restarts_begins_the_run_anew(one, lines):
    _sim, bridge, sitl = one
    first = sailed(bridge, sitl, 1)
    sailed(bridge, sitl, 50)
    sitl.count = 0
    again = sailed(bridge, sitl, 1)
    assert again == first
    assert lines[1:] == ["a: its autopilot restarted; the simulation restarts too"]


def test_a_run_that_is_recorded_goes_on_when_an_autopilot_restarts(one, lines, tmp_path):
    sim, bridge, sitl = one
    with record(sim, tmp_path / "run.rrd"):
        sailed(bridge, sitl, 10)
        sitl.count = 0
        assert sailed(bridge, sitl, 1)["timestamp"] == [pytest.approx(0.22)]
    assert "restarted; the simulation continues: reset cannot be called while" in lines[1]


def test_lost_frames_are_told_once_and_take_no_time(one, lines):
    sim, bridge, sitl = one
    sailed(bridge, sitl, 1)
    for _ in range(2):
        sitl.count += 3
        sailed(bridge, sitl, 1)
    assert sim.time == pytest.approx(0.06)
    assert lines[1:] == ["a: 3 frames lost before frame 4; time advances by one frame"]


def test_packets_of_foreigners_are_told_once_and_do_nothing(one, lines):
    sim, bridge, sitl = one
    sailed(bridge, sitl, 1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as foreign:
        for data in (b"", b"hello", packet(7)[:-1], packet(7, magic=1), bytes(60000)):
            foreign.sendto(data, sitl.address)
    with FakeSitl(sitl.address) as other:
        other.count = 99
        other.send()
        for _ in range(3):
            assert not bridge.step(0.05)
    assert sim.time == pytest.approx(0.02)
    assert sailed(bridge, sitl, 1)["timestamp"] == [pytest.approx(0.04)]
    assert [line.split(" from ")[0] for line in lines[1:]] == ["a: a packet of 0 bytes", "a: packets"]
    assert "is not ArduPilot's" in lines[1]
    assert "are ignored: the autopilot is 127.0.0.1:" in lines[2]


def test_another_autopilot_takes_a_boat_whose_own_is_gone(one, lines, monkeypatch):
    sim, bridge, sitl = one
    sailed(bridge, sitl, 30)
    monkeypatch.setattr(module, "TIMEOUT", 0.05)
    while len(lines) < 2:
        bridge.step(0.06)
    assert lines[1] == "a: no frame from its autopilot for 0.05 s: the simulation waits"
    with FakeSitl(sitl.address) as other:
        sailed(bridge, other, 1)
    assert sim.time == pytest.approx(0.02)
    assert "restarted" in lines[3]


def test_a_rate_that_does_not_suit_gets_the_next_one_and_is_told_when_it_stays(one, lines):
    sim, bridge, sitl = one
    times = []
    for sitl.rate in (1200, 100, 0, 400, 70, 400, 65535):  # the first is what SITL begins with
        times.append(sailed(bridge, sitl, 1)["timestamp"][0])
    assert times == pytest.approx([0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07])
    assert sim.time == pytest.approx(0.07)
    (line,) = lines[1:]
    suited = "set SIM_RATE_HZ to 100, 50, 25, 20, or `physics: timestep` of the world"
    assert line == f"a: its autopilot expects 70 frames per second but gets 100: {suited}"


def test_an_autopilot_need_not_keep_to_the_clock_when_the_rate_is_none(world):
    sim = Simulation(world)
    with ArduPilot(sim, {"a": 0}, rate=None) as bridge, FakeSitl(bridge.addresses["a"]) as sitl:
        answers = []
        for sitl.rate in (1200, 100):
            sitl.send()
            bridge.step()
            answers.append(b'"no_time_sync":1' in sitl.socket.recv(65000))
    assert answers == [False, True]  # SITL takes our rate over only while it keeps to the clock


@pytest.mark.parametrize("rate", [0.0, -1.0, math.inf, math.nan])
def test_a_rate_has_to_be_above_zero(world, rate):
    with pytest.raises(CommandError, match=r"invalid --rate .*: a number above 0"):
        ArduPilot(Simulation(world), {"a": 0}, rate=rate)


def test_each_boat_has_the_arguments_of_its_sitl(world):
    with ArduPilot(Simulation(world), {"a": 9082, "b": 9005}, rate=5.0) as bridge:
        a, b = bridge.arguments.values()
    home = r" --model JSON:127\.0\.0\.1 --speedup 5 --defaults .*ardurover\.parm"
    assert re.fullmatch(f"--instance 8{home}", a)
    assert re.fullmatch(f"--sim-port-out 9005{home}", b)


def test_a_pulse_that_no_servo_gets_counts_as_none(one, lines):
    sim, bridge, sitl = one
    sailed(bridge, sitl, 50, (60000, 1500, 300, *(1500,) * 13))
    assert set(sim.thrust("a").values()) == {0.0}
    assert lines[1:] == [
        f"a: channel {channel} has {pulse} us: pulses from 500 to 2500 us are needed; it is taken as no pulse"
        for channel, pulse in ((1, 60000), (3, 300))
    ]


def test_a_packet_of_32_channels_is_answered_too(one):
    _, bridge, sitl = one
    assert sailed(bridge, sitl, 1, AHEAD + (1500,) * 16)["timestamp"] == [pytest.approx(0.02)]


def test_channels_that_a_packet_does_not_have_are_at_rest(world, lines, monkeypatch):
    left, right = channels_of(world, "a").values()
    monkeypatch.setattr(module, "channels_of", lambda *_: {16: left, 17: right})
    sim, found = Simulation(world), []
    bridge = ArduPilot(sim, {"a": 0}, report=lambda _, text: lines.append(text))
    with bridge, FakeSitl(bridge.addresses["a"]) as sitl:
        for pulses in ((1900,) * 32, (1900,) * 16):
            sailed(bridge, sitl, 50, pulses)
            found.append([sim.thrust("a")[name] > 0.0 for name in ("left", "right")])
    assert found == [[True, True], [True, False]]
    assert len(lines) == 1  # that it has connected


def test_a_run_ends_with_its_duration_or_when_it_is_over(one):
    sim, bridge, sitl = one
    sitl.socket.settimeout(0.0)
    asked = []

    def over():
        sitl.send()
        asked.append(sim.time)
        return len(asked) > 5

    bridge.run(duration=0.06, over=over)
    assert sim.time == pytest.approx(0.06)
    assert asked == pytest.approx([0.0, 0.02, 0.04, 0.06])
    bridge.run(over=over)
    assert (len(asked), sim.time) == (6, pytest.approx(0.08))


def test_what_cannot_be_listened_to(world):
    sim = Simulation(world)
    with pytest.raises(UnknownNameError, match="no boat named 'c'; known: a, b"):
        ArduPilot(sim, {"c": 0})
    with pytest.raises(CommandError, match="each boat needs one of its own"):
        ArduPilot(sim, {"a": 9002, "b": 9002})
    with ArduPilot(sim, {"a": 0}) as bridge:
        port = bridge.addresses["a"][1]
        with pytest.raises(NetworkError, match=rf"on 127\.0\.0\.1:{port}: Address already"):
            ArduPilot(sim, {"b": port})
    with pytest.raises(NetworkError, match=r"cannot listen for ArduPilot on 127\.0\.0\.1:70000: Invalid argument"):
        ArduPilot(sim, {"a": 70000})
