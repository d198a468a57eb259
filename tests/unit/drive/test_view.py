import io
import os
import signal
import sys
import threading
import time
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from vrx_mj import Simulation, compile_world
from vrx_mj.draw import display
from vrx_mj.drive import browser, window
from vrx_mj.drive import view as package
from vrx_mj.drive.pilot import Terminal, drive
from vrx_mj.drive.session import Session
from vrx_mj.drive.view import view
from vrx_mj.errors import CommandError, UnknownNameError

WAVES = {"extends": "ocean", "sea": {"model": "pms", "gain": 1.0, "period": 5.0, "tau": 0.01}}


class Clock:
    """Wall time that passes when somebody sleeps."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


class Screen:
    url, ports = None, ()

    def __init__(self, frames, keys=()):
        self.frames, self.script = frames, dict(keys)
        self.times = []

    def is_open(self):
        return len(self.times) < self.frames

    def pressed_keys(self):
        return self.script.pop(len(self.times), ())

    def show(self, session):
        self.times.append(session.sim.time)


@pytest.fixture(scope="module")
def trio():
    return compile_world("ocean", fleet="trio")


def watched(world, frames, keys=(), **options):
    clock, screen = Clock(), Screen(frames, keys)
    session = Session(Simulation(world), clock=clock, **options)
    drive(session, [screen], screen.is_open, sleep=clock.sleep, clock=clock)
    return session, screen


def test_simulated_time_follows_the_clock(trio):
    session, screen = watched(trio, 91)
    assert session.sim.time == pytest.approx(3.0, abs=0.011)  # 90 frames of 1/30 s, to a step
    assert np.diff(screen.times).max() == pytest.approx(0.04)
    assert session.pacer.real_pace == pytest.approx(1.0, abs=0.02)


def test_pace_and_pause_act_at_once(trio):
    session, screen = watched(trio, 91, {30: "+", 60: "p"})
    assert screen.times[30] == pytest.approx(1.0, abs=0.04)
    assert screen.times[90] == screen.times[60] == pytest.approx(3.0, abs=0.08)
    assert dict(session.status())["pace"] == "paused of 2"


def test_keys_move_the_chosen_boat_alone(trio):
    session, _ = watched(trio, 61, {0: "i"}, boat="wamv2")
    speeds = {name: seen.velocity[0] for name, seen in session.sim.observe().items()}
    assert speeds["wamv2"] > 0.3 > 3 * max(abs(speeds["wamv1"]), abs(speeds["wamv3"]))  # waves push these
    assert dict(session.status())["power"] == "+0.50"


def test_watching_is_the_same_run_as_not_watching(trio):
    session, _ = watched(trio, 61, {0: "i"})
    alone = Simulation(trio)
    alone.step({"wamv1": {"left": 0.5, "right": 0.5}}, duration=session.sim.time)
    assert alone.get_state().mujoco.tobytes() == session.sim.get_state().mujoco.tobytes()


def test_a_controller_steers_until_a_key_takes_over(trio):
    def controller(_seen, _time):
        return {boat: {"left": -0.5, "right": -0.5} for boat in trio.boats}

    session, _ = watched(trio, 91, {1: "i"}, controller=controller)
    speeds = [seen.velocity[0] for seen in session.sim.observe().values()]
    assert speeds[0] > 0.2
    assert speeds[1] < -0.1 > speeds[2]


def test_a_view_keeps_to_its_boats(trio):
    clock = Clock()
    sim = Simulation(trio)
    session = Session(sim, clock=clock, controller=lambda _obs, t: sim.remove("wamv2") if t > 0.15 else None)
    with pytest.raises(CommandError) as caught:
        drive(session, [], clock=clock, sleep=clock.sleep)
    assert str(caught.value) == (
        "the boats changed from wamv1, wamv2, wamv3 to wamv1, wamv3: a view needs the boats with which it began"
    )
    again = Session(sim, clock=clock)  # which is of the boats of now
    with pytest.raises(CommandError, match=r"^the boats changed from wamv1, wamv3 to wamv1, wamv2, wamv3: "):
        again.press("backspace")


def test_starting_again_repeats_the_run(trio):
    session, screen = watched(trio, 121, {0: "i", 60: ["backspace"]})
    fresh = Simulation(trio)
    fresh.advance(round(session.sim.time / fresh.timestep))
    assert (session.resets, session.pilot.commands()) == (1, {})
    assert screen.times[60] < 0.1 < screen.times[59]
    assert fresh.get_state().mujoco.tobytes() == session.sim.get_state().mujoco.tobytes()


@pytest.mark.parametrize("pace", [0.0, -1.0, float("nan"), float("inf")])
def test_a_pace_is_above_zero(trio, pace):
    with pytest.raises(CommandError, match=f"^invalid pace {pace:g}: a number above 0 is needed, 1 for real time$"):
        Session(Simulation(trio), pace=pace)


def test_the_boat_must_exist(trio):
    with pytest.raises(UnknownNameError, match=r"^no boat named 'wamv9'; did you mean 'wamv3'\?$"):
        Session(Simulation(trio), boat="wamv9")


def test_an_upload_returns_when_its_mesh_is_drawn():
    """MuJoCo's call, which is made in a thread, takes a while."""
    drawn = []
    handle = SimpleNamespace(is_running=lambda: True, update_mesh=lambda mesh: (time.sleep(0.02), drawn.append(mesh)))
    upload = window.Upload(handle, 7)
    for number in (1, 2):
        upload()
        assert drawn == [7] * number


def test_an_upload_returns_when_its_window_is_closed():
    """MuJoCo's call then does not return."""
    looks, closed = iter((True, False)), threading.Event()
    upload = window.Upload(SimpleNamespace(is_running=looks.__next__, update_mesh=lambda _: closed.wait()), 7)
    upload()
    assert list(looks) == []
    closed.set()


# The sea of the window


@pytest.fixture(scope="module")
def waves():
    """A simulation in waves, the model and data of its window, and the sea there."""
    sim = Simulation(compile_world(WAVES))
    model = window.window_model(sim.world)
    return sim, model, mujoco.MjData(model), window.sea_of(model, sim.sea.height)


def drawn(model, data):
    """The mesh's vertices in the world."""
    geom, mesh = model.geom("vrx_mj/sea").id, model.mesh("vrx_mj/sea").id
    start = model.mesh_vertadr[mesh]
    points = model.mesh_vert[start : start + model.mesh_vertnum[mesh]].astype(float)
    return points @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]


def test_before_anything_moves_the_mesh_is_flat_water(waves):
    model = window.window_model(waves[0].world)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    points = drawn(model, data)
    assert np.abs(points[:, 2]).max() < 1e-3
    assert np.ptp(points[:, 0]) == pytest.approx(2 * window.HORIZON)


def test_the_mesh_lies_on_the_sea_near_the_boat_and_flat_at_the_horizon(waves):
    sim, model, data, mesh = waves
    mesh.follow(data, (140.3, -507.1), 20.0)
    mujoco.mj_kinematics(model, data)
    points = drawn(model, data)
    away = np.hypot(points[:, 0] - 140.3, points[:, 1] + 507.1)
    near = away < 50.0
    heights = sim.sea.height(points[near, 0], points[near, 1], 20.0)
    assert np.abs(heights).max() > 0.2
    np.testing.assert_allclose(points[near, 2], heights, atol=1e-4)  # float32 of some 50 m
    assert away.min() < window.CELL
    assert not points[away > 200.0, 2].any()


def test_the_mesh_is_lit_from_above_and_moves(waves):
    _, model, data, mesh = waves
    mesh.follow(data, (0.0, 0.0), 20.0)
    before, normals = model.mesh_vert.copy(), model.mesh_normal[-(window.SIDE**2) :].copy()
    mesh.follow(data, (0.0, 0.0), 21.0)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, rtol=1e-6)
    assert normals[:, 2].min() > 0.0
    assert np.abs(model.mesh_vert - before).max() > 0.1


def test_the_window_draws_the_same_state(trio):
    model = window.window_model(trio)
    assert model.nq == Simulation(trio).model.nq
    assert mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "water") == -1


def test_lines_grow_toward_the_horizon():
    lines = window.sea_lines()
    gaps = np.diff(lines)
    assert gaps[window.SIDE // 2] == pytest.approx(window.CELL, rel=0.01)
    np.testing.assert_allclose(lines, -lines[::-1], atol=1e-9)
    assert (np.diff(gaps[window.SIDE // 2 :]) > 0.0).all()


# Where it is shown


@pytest.mark.parametrize("variables", [{}, {"DISPLAY": "", "WAYLAND_DISPLAY": ""}])
def test_without_a_display_there_is_no_window(variables):
    assert display.no_window(variables, "linux") == "no display: neither DISPLAY nor WAYLAND_DISPLAY is set"


def test_macos_wants_its_own_python():
    told = display.no_window({}, "darwin")
    assert told == "on macOS MuJoCo's window needs mjpython: mjpython -m vrx_mj view ..."


def test_a_display_that_cannot_draw_is_no_display(monkeypatch):
    monkeypatch.setattr(display, "try_backend", lambda *_: display.Attempt(False, "no pixels"))
    assert display.no_window({"DISPLAY": ":7"}, "linux") == "the display cannot draw: no pixels"
    monkeypatch.setattr(display, "try_backend", lambda *_: display.Attempt(True, "a card"))
    assert display.no_window({"DISPLAY": ":7"}, "linux") is None


def test_a_way_to_draw_that_fails_says_why():
    attempt = display.try_backend("glfw", {**os.environ, "DISPLAY": ":99999", "WAYLAND_DISPLAY": ""})
    assert (attempt.works, bool(attempt.detail)) == (False, True)


def test_a_missing_library_is_said_to_be_missing(monkeypatch):
    """PyOpenGL's own words for a library that it does not find."""
    said = "Traceback\nAttributeError: 'NoneType' object has no attribute 'glGetError'\n"
    done = SimpleNamespace(returncode=1, stdout="", stderr=said)
    monkeypatch.setattr(display.subprocess, "run", lambda *_, **__: done)
    assert display.try_backend("osmesa") == display.Attempt(False, "its library of OpenGL is not installed")


@pytest.mark.parametrize("keys", [True, False])
def test_the_page_says_which_boat_keys_drive_only_where_keys_are_read(monkeypatch, keys):
    sent = []
    monkeypatch.setattr(browser.rr, "send_chunks", lambda chunk, **_: sent.append(chunk))
    page = object.__new__(browser.Browser)
    page.__dict__ |= {"_resets": 0, "_keys": keys, "_boat": "", "_stream": None, "_shown": 9.0, "_clock": lambda: 0.0}
    page.show(SimpleNamespace(resets=0, sim=SimpleNamespace(time=1.0), pilot=SimpleNamespace(boat="a")))
    assert len(sent) == keys


def addresses(port):
    """The addresses on which this machine listens on a port, by the kernel's tables."""
    found = []
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        with open(table, encoding="ascii") as file:  # noqa: PTH123
            rows = [line.split() for line in file.readlines()[1:]]
        found += [row[1].split(":")[0] for row in rows if row[3] == "0A" and int(row[1].split(":")[1], 16) == port]
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="reads Linux's tables")
def test_the_browser_is_served_on_the_loopback_address_alone(trio, monkeypatch):
    told, shown = [], []

    def few_frames(session, consoles, is_open):
        screen = consoles[0]
        clock = Clock()
        monkeypatch.setattr(screen, "_clock", clock)
        for _ in range(30):
            clock.sleep(0.05)
            session.sim.advance(5)
            screen.show(session)
        session.press("backspace")
        screen.show(session)
        ports = screen.server.ports
        shown.extend((ports, [addresses(port) for port in ports], is_open()))
        os.kill(os.getpid(), signal.SIGTERM)  # ends as Ctrl-C does

    monkeypatch.setattr(package, "drive", few_frames)
    before = signal.getsignal(signal.SIGTERM)
    view(Simulation(trio), browser=True, write=told.append)
    ports, listening, running = shown
    assert (running, listening) == (True, [["0100007F"], ["0100007F"]])  # 127.0.0.1
    page = f"http://127.0.0.1:{ports[0]}/?url=rerun%2Bhttp%3A%2F%2F127.0.0.1%3A{ports[1]}%2Fproxy&hide_welcome_screen=1"
    assert told[:2] == ["Opening in the browser (--browser).", f"Open {page}"]
    assert told[-1] == "stopped at 0.0 s of simulated time"
    assert [addresses(port) for port in ports] == [[], []]
    assert signal.getsignal(signal.SIGTERM) == before


# The terminal


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs a pseudo-terminal")
def test_keys_come_from_a_terminal_and_its_settings_are_put_back(trio, monkeypatch):
    import termios

    ours, theirs = os.openpty()
    with open(theirs, encoding="utf-8") as stdin:  # noqa: PTH123
        monkeypatch.setattr(os, "tcgetpgrp", lambda _: os.getpgrp())
        before = termios.tcgetattr(stdin)
        with Terminal(stdin, io.StringIO()) as terminal:
            assert terminal.reads
            os.write(ours, b"i\x1b[A2")
            assert list(terminal.pressed_keys()) == ["i", "up", "2"]
            assert list(terminal.pressed_keys()) == []
            terminal.show(Session(Simulation(trio)))
        assert termios.tcgetattr(stdin) == before
    os.close(ours)


def test_what_is_no_terminal_gives_no_keys():
    with Terminal(io.StringIO("iii"), io.StringIO()) as terminal:
        assert (terminal.reads, list(terminal.pressed_keys())) == (False, [])


def test_triangles_of_the_sea_tile_its_square_and_look_up():
    """Twice the area of each, of cells of 1 x 1."""
    y, x = np.divmod(np.arange(window.SIDE**2), window.SIDE)
    (x0, y0), (x1, y1), (x2, y2) = ((x[corner], y[corner]) for corner in window._sea_faces().T)
    assert ((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0) == 1).all()
    middles = np.stack([x0 + x1 + x2, y0 + y1 + y2], axis=1)
    assert len(np.unique(middles, axis=0)) == len(middles) == 2 * (window.SIDE - 1) ** 2
