"""What MuJoCo's window is given to draw, and what keys command of engines: the numbers of before."""

import contextlib
import itertools
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from fingerprints import check
from integration.test_fingerprints_worlds import SEA, compiled
from unit.drive.test_view import Clock
from vrx_mj import Simulation
from vrx_mj.drive import window
from vrx_mj.drive.pilot import KEYS, Engine, Pilot, Wheel, _engine, engine_commands, window_key
from vrx_mj.drive.session import Session
from vrx_mj.physics.tables import RUDDER


class Handle:
    """A stand-in for MuJoCo's passive viewer, open for some calls."""

    def __init__(self, calls=10**6):
        self.left, self.noted, self.key = calls, [], None
        self.cam = SimpleNamespace(distance=0.0, elevation=0.0, azimuth=0.0, lookat=np.zeros(3))
        self.opt, self.user_scn = mujoco.MjvOption(), SimpleNamespace(flags=np.zeros(mujoco.mjtRndFlag.mjNRNDFLAG))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    @contextlib.contextmanager
    def lock(self):
        yield

    def is_running(self):
        self.left -= 1
        return self.left > 0

    def set_texts(self, texts):
        self.noted.append([(int(font), int(place), *words) for font, place, *words in texts])

    def sync(self):
        self.noted.append("sync")

    def update_mesh(self, mesh):
        self.noted.append(("mesh", mesh))

    def close(self):
        self.noted.append("close")

    def launch(self, model, data, key_callback=None, **shown):
        self.model, self.data, self.key = model, data, key_callback
        self.noted.append(sorted(shown.items()))
        return self

    @property
    def look(self):
        """The camera, and the flags that letters toggle."""
        return vars(self.cam), self.opt.flags, self.opt.geomgroup, self.user_scn.flags


@pytest.fixture
def handle(monkeypatch):
    made = Handle()
    monkeypatch.setattr(mujoco, "viewer", SimpleNamespace(launch_passive=made.launch), raising=False)
    return made


def test_a_window_shows_the_boat_the_sea_and_the_status(handle):
    sim = Simulation(compiled({"extends": "ocean", "sea": SEA}, fleet="trio"), seed=3)
    screen = window.Window(sim)
    found = [handle.look]
    session = Session(sim, clock=Clock())
    session.press("up")
    session.press("2")
    handle.opt.flags[:], handle.opt.geomgroup[:], handle.user_scn.flags[:] = (
        1,
        1,
        1,
    )  # MuJoCo's own letters toggled them
    sim.step({boat: {"left": 0.5, "right": 0.7} for boat in sim.boats}, duration=1.0)
    screen.show(session)
    data = handle.data
    found += [handle.look, data.qpos, data.qvel, data.time, data.xpos, data.subtree_com, data.light_xpos]
    found += [handle.model.mesh_vert[::97], handle.model.mesh_normal[::97], data.geom_xpos, data.geom_xmat]
    for code in (32, ord("P"), ord("["), 321, 265):
        handle.key(code)
    assert list(screen.pressed_keys()) == ["space", "p", "[", "1", "up"]
    assert list(screen.pressed_keys()) == []
    assert screen.is_open()
    screen.close()
    handle.left = 0
    assert not screen.is_open()
    texts = next(each for each in handle.noted if isinstance(each, list) and len(each) == 2 and len(each[0]) == 4)
    assert texts[0][2].split("\n")[:4] == ["boat", "power", "turn", "angle"]
    assert texts[0][3].split("\n")[:4] == ["wamv2", "+0.00", "+0.00", "+0 deg"]
    assert texts[1][2].split("\n") == ["drive", "as in VRX", "steps", "boat", "time"]
    assert handle.noted[-1] == "close"
    check("windows", "sea", found=found, noted=handle.noted)


def test_a_robot_that_stands_still_follows_its_sliders(handle, monkeypatch):
    monkeypatch.setattr(window.time, "sleep", handle.noted.append)
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body pos='1 2 3'><joint name='a' axis='0 0 1'/><geom size='.2 .1 .3' type='box'/></body>"
        "</worldbody><actuator><position joint='a'/></actuator></mujoco>"
    )
    handle.left = 4
    window.show_joints(model)
    handle.data.ctrl[:] = 0.5
    check("windows", "robot", look=handle.look, noted=handle.noted, place=[handle.data.qpos, handle.data.xpos])


def test_the_model_of_a_window_has_its_sea_in_the_place_of_water():
    model = window.window_model(compiled({"extends": "ocean", "sea": SEA}, fleet="trio"))
    parts = (model.geom_type, model.geom_group, model.geom_contype, model.geom_conaffinity, model.mat_reflectance)
    check("windows", "model", parts=parts, shadows=model.vis.quality.shadowsize, faces=model.mesh_face[::97])


# Keys

BOATS = {
    "twin": (Engine("left", 1.0, -1.0, True, 0.8), Engine("right", 0.9, 1.2, True, 0.8, ahead=250.0, astern=100.0)),
    "rudder": (Engine("screw", 1.0, 0.02, True, 0.0), Engine("rudder", 0.0, 0.0, True, 0.6, rudder=True)),
    "bow": (Engine("pull", -1.0, 0.0, False, 0.3), Engine("canard", 0.0, 0.0, False, 0.9, rudder=True)),
}


def test_keys_command_engines_as_they_did():
    """Every key, twice, and again after keys that change sizes; and wheels far over."""
    found = []
    for boat in BOATS:
        for first in ("", "q", "x", "e", "v", "up", ";"):
            for key in sorted(KEYS):
                pilot = Pilot(BOATS, boat)
                taken = [pilot.press(one) for one in (first, key, key) if one]
                found.append((taken, pilot.boat, pilot.wheel, pilot.sizes, pilot.commands()))
    for wheel in itertools.starmap(
        Wheel, itertools.product((-1.0, -0.3, 0.0, 0.8), (-0.9, 0.0, 0.4), (-0.2, 0.0, 0.7))
    ):
        found += [engine_commands(engines, wheel) for engines in BOATS.values()]
    check("windows", "keys", found=found, names=[window_key(code) for code in range(360)])


@pytest.mark.parametrize(
    ("turned", "mapping", "expected"),
    [
        (0.0, 0, Engine("e", 1.0, -0.7, True, 0.4, False, 200.0, 80.0)),
        (np.pi / 2, 0, Engine("e", 0.0, -1.5, True, 0.4, False, 200.0, 80.0)),
        (np.pi / 6, 0, Engine("e", 0.75**0.5, -0.75 - 0.7 * 0.75**0.5, True, 0.4, False, 200.0, 80.0)),
        (0.0, RUDDER, Engine("e", 0.0, 0.0, True, 0.4, True)),
    ],
)
def test_an_engine_has_the_arm_of_its_line_about_the_centre_of_mass(turned, mapping, expected):
    c, s = np.cos(turned), np.sin(turned)
    row = SimpleNamespace(
        name="e", position=(-1.2, 0.7, 0.0), direction=(1.0, 0.0, 0.0), rotation=((c, -s, 0), (s, c, 0), (0, 0, 1)),
        mapping=mapping, max_angle=0.4, command_limits=(-80.0, 200.0),
    )  # fmt: skip
    found = _engine(row, (0.3, 0.5, 0.1))
    assert vars(found) == pytest.approx(vars(expected), abs=1e-12)
