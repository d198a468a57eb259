"""Trials that a program sails, with a false program and clock: what it is told, its way, and when it is over."""

import math
import os
import signal
from contextlib import contextmanager
from io import StringIO
from types import SimpleNamespace

import numpy as np
import pytest

from vrx_mj.campaign import program_trial
from vrx_mj.campaign.plan import Cell, Serving
from vrx_mj.campaign.program_trial import _Pilot, sail_by_program
from vrx_mj.campaign.results import ALLOWED, END, GROUP, REACHED, Stopwatch, Tracks
from vrx_mj.errors import NetworkError, VrxError

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="process groups of other systems")

BEGUN = 100.0


class Boats:
    """A simulation of two boats, of which one goes ahead by 3 m and aside by 4 m in a second."""

    boats, timestep, task, task_is_over = ("a", "b"), 0.5, None, False

    def __init__(self, time=0.0):
        self.time = time

    def observe(self):
        places = {"a": np.array([3.0, 4.0, 9.0]) * self.time, "b": np.zeros(3)}
        return {boat: SimpleNamespace(position=place) for boat, place in places.items()}


class FalseProgram:
    """A program that runs until it is ended."""

    group, code, last_lines = 77, None, ""

    def __init__(self, line, environment, log):
        self.line, self.environment, self.log, self.ends = line, environment, log, 0
        started.append(self)

    def end(self):
        self.ends += 1


started = []


@pytest.fixture(autouse=True)
def clock(monkeypatch):
    now = [BEGUN]
    started.clear()
    clocks = SimpleNamespace(monotonic=lambda: now[0], perf_counter=lambda: now[0])
    monkeypatch.setattr(program_trial, "time", clocks)
    monkeypatch.setattr("vrx_mj.campaign.results.time", clocks)
    monkeypatch.setattr(program_trial, "Program", FalseProgram)
    monkeypatch.setattr(program_trial, "sys", SimpleNamespace(stdout=SimpleNamespace(buffer="log", write=print)))
    monkeypatch.setattr(os, "environ", {"SIDE": "port"})
    return now


def piloted(sim, duration=None, wall=30.0):
    """A pilot that has started its program, and the memory that it shares."""
    shared = [0.0] * 4
    pilot = _Pilot("./sail", sim, duration, wall, Tracks(), Stopwatch(shared))
    pilot.start()
    return pilot, shared


def test_its_time_begins_with_the_program_and_ends_with_what_it_takes_to_end_it():
    _, shared = piloted(Boats())
    (program,) = started
    assert (program.line, program.environment, program.log) == ("./sail", os.environ, "log")
    assert (shared[ALLOWED], shared[END], shared[GROUP]) == (45.0, BEGUN + 45.0, 77)


@pytest.mark.parametrize(("duration", "last"), [(None, 62.0), (5.0, 7.0)])
def test_it_is_over_after_its_duration_or_a_minute(duration, last):
    pilot, shared = piloted(sim := Boats(2.0), duration)
    sim.time = last - 1e-5
    assert (pilot.is_over(), pilot.finished, shared[REACHED]) == (False, False, sim.time)
    sim.time = last - 1e-7
    assert (pilot.is_over(), pilot.finished, shared[GROUP], started[0].ends) == (True, True, 0, 1)


@pytest.mark.parametrize(("duration", "over"), [(None, True), (5.0, False)])
def test_the_end_of_the_task_ends_it_unless_a_duration_is_given(duration, over):
    pilot, _ = piloted(sim := Boats(), duration)
    sim.task_is_over = True
    assert pilot.is_over() is pilot.finished is over


def test_way_is_over_ground_ten_times_a_second():
    pilot, _ = piloted(sim := Boats())
    for sim.time in (0.0, 0.05, 0.1, 0.18, 1.2):
        pilot.is_over()
    assert pilot.way == {"a": pytest.approx(5.0 * 1.2), "b": 0.0}
    assert pilot._tracks.lines() == {"a": [[0.0, 0.0], [3.6, 4.8]], "b": [[0.0, 0.0]]}


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (1, "ended with exit code 1"),
        (3, "ended with exit code 3"),
        (-signal.SIGSEGV, "was ended by SIGSEGV"),
        (-99, "was ended by signal 99"),
    ],
)
def test_a_program_that_fails_fails_its_trial(code, words):
    pilot, shared = piloted(Boats())
    started[0].code = code
    with pytest.raises(VrxError, match=rf"^the program {words}; it printed nothing$"):
        pilot.is_over()
    assert (started[0].ends, shared[GROUP], pilot.finished) == (1, 0, False)


def test_a_program_that_ends_well_leaves_the_trial_to_its_time():
    pilot, _ = piloted(Boats())
    started[0].code = 0
    assert pilot.is_over() is False


@pytest.mark.parametrize(("status", "words"), [("", ""), ("waits for /cmd", " (waits for /cmd)")])
def test_one_that_takes_too_long_says_what_it_waited_for(clock, status, words):
    pilot, _ = piloted(Boats())
    pilot.note(status)
    started[0].last_lines = "one | two"
    clock[0] = BEGUN + 30.0
    assert pilot.is_over() is False
    clock[0] += 0.125
    with pytest.raises(VrxError) as caught:
        pilot.is_over()
    assert str(caught.value) == f"not finished after 30 s of wall time{words}; its last lines: one | two"
    assert started[0].ends == 1


def test_one_that_never_started_is_not_ended():
    pilot = _Pilot("./sail", Boats(), None, 30.0, Tracks(), Stopwatch(shared := [9.0] * 4))
    pilot.end()
    assert (shared, started, pilot._deadline) == ([9.0] * 4, [], math.inf)


@pytest.fixture
def summaries(monkeypatch):
    monkeypatch.setattr(program_trial, "summarize", lambda *given, **named: (*given[1:], named))


def sailed(folder, **serving):
    cell = Cell("./sail", "bay", 5)
    return sail_by_program(cell, Serving(**serving), Boats(), folder, 3.0, 30.0, Tracks(), Stopwatch([0.0] * 4))


def test_a_world_is_served_on_a_master_of_its_own(monkeypatch, tmp_path, summaries, clock):
    def serve(sim, wanted, *, report, status, ready, over):
        report("info", "serves")
        status("waits")
        ready(["rosbridge", Ros1()])
        served.append((wanted, {name: value for name, value in os.environ.items() if "PYTEST" not in name}))
        assert not over()
        sim.time, clock[0] = 3.0, BEGUN + 2.0
        assert over()

    class Ros1:
        def settle(self):
            served.append(f"settled {len(started)}")

    served, out = [], StringIO()
    monkeypatch.setattr("vrx_mj.ros.ros1.Ros1", Ros1)
    monkeypatch.setattr("vrx_mj.ros.serve.serve", serve)
    os.environ["ROS_HOSTNAME"] = "elsewhere"
    monkeypatch.setattr(program_trial.sys.stdout, "write", out.write)
    steps, wall, way, named = sailed(tmp_path, rate=2.0, lockstep=("/cmd",), rosbridge=True)
    settled, (wanted, environment) = served
    assert settled == "settled 0"  # before the program starts
    assert (wanted.ros1, wanted.rate, wanted.lockstep) == (True, 2.0, ("/cmd",))
    port = wanted.rosbridge
    assert environment == {
        "SIDE": "port", "VRX_MJ_WORLD": "bay", "VRX_MJ_SEED": "5", "VRX_MJ_FOLDER": str(tmp_path.resolve()),
        "ROS_MASTER_URI": environment["ROS_MASTER_URI"], "ROS_IP": "127.0.0.1",
        "ROS_HOME": str(tmp_path.resolve() / "ros"), "ROS_LOG_DIR": str(tmp_path.resolve() / "ros" / "log"),
        "VRX_MJ_ROSBRIDGE_PORT": str(port), "VRX_MJ_ROSBRIDGE_URL": f"ws://127.0.0.1:{port}",
    }  # fmt: skip
    assert environment["ROS_MASTER_URI"] != f"http://127.0.0.1:{port}"
    assert (steps, wall, way, named) == (6, 2.0, {"a": 15.0, "b": 0.0}, {"interrupted": False})
    assert started[0].ends == 2
    assert out.getvalue() == "[info] serves\n"
    monkeypatch.setattr("vrx_mj.ros.serve.serve", lambda _sim, wanted, **_: served.append(wanted))
    assert sailed(tmp_path)[-1] == {"interrupted": True}
    assert served[-1].rosbridge is None


def test_a_world_is_served_to_a_sitl_for_each_boat(monkeypatch, tmp_path, summaries):
    @contextmanager
    def autopilots(sim, rate):
        def run(over):
            ran.append((rate, len(started)))
            sim.time = 3.0
            assert over()

        addresses = {"a": ("127.0.0.1", 9012), "b": ("127.0.0.1", 9022)}
        yield SimpleNamespace(arguments={"a": "-I1", "b": "-I2"}, addresses=addresses, run=run)

    ran = []
    monkeypatch.setattr(program_trial, "_autopilots", autopilots)
    assert sailed(tmp_path, rate=None, ardupilot=True)[-1] == {"interrupted": False}
    assert ran == [(None, 1)]
    told = {name: value for name, value in os.environ.items() if "ARDUPILOT" in name or "MAVLINK" in name}
    assert told == {
        "VRX_MJ_ARDUPILOT": "-I1", "VRX_MJ_MAVLINK": "tcp:127.0.0.1:5770",
        "VRX_MJ_ARDUPILOT_1": "-I2", "VRX_MJ_MAVLINK_1": "tcp:127.0.0.1:5780",
    }  # fmt: skip


class Listening:
    """Listens for SITLs unless their first port is taken."""

    def __init__(self, _sim, ports, *, rate, report):
        tried.append(ports)
        if ports["a"] in taken:
            raise NetworkError("taken")
        self.ports, self.rate, self.closed = ports, rate, False

    def close(self):
        closed.append(self.ports["a"])


tried, taken, closed = [], set(), []


def test_instances_are_taken_whose_ports_are_all_free(monkeypatch):
    class Probe:
        def bind(self, address):
            assert address[0] == "127.0.0.1"
            if address[1] in {5790, 5800}:  # MAVLink ports of instances 3 and 4
                raise OSError

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

    monkeypatch.setattr(program_trial, "ArduPilot", Listening)
    monkeypatch.setattr(program_trial, "socket", SimpleNamespace(socket=Probe))
    taken.add(9012)
    found = program_trial._autopilots(Boats(), 2.0)
    assert (found.ports, found.rate) == ({"a": 9052, "b": 9062}, 2.0)
    assert [ports["a"] for ports in tried] == [9012, 9022, 9032, 9042, 9052]
    assert closed == [9022, 9032, 9042]  # instance 2 has a second boat, whose port is that of 3


def test_without_a_free_instance_it_says_so(monkeypatch):
    def listen(*_, **__):
        raise NetworkError("taken")

    monkeypatch.setattr(program_trial, "ArduPilot", listen)
    with pytest.raises(NetworkError, match=r"^no ports are free for ArduPilot's SITL of instances up to 249$"):
        program_trial._autopilots(Boats(), None)
