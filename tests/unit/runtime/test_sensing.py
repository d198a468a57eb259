"""Asking for readings: the mapping, its names, and what is refused."""

import gc
import re
import weakref
from types import SimpleNamespace

import numpy as np
import pytest

from integration.sailing import boats
from integration.sensing import GPS, GUN, IMU, P3D, PINGER, SUITE, sailing
from vrx_mj.config.world import Georeference
from vrx_mj.errors import CommandError, SensorError, UnknownNameError
from vrx_mj.model.world import tree_of
from vrx_mj.runtime import sensing
from vrx_mj.runtime.state import State

TWO = boats((0.0, 0.0, 0.3), (30.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def sim():
    second = GUN.model_copy(update={"name": "second"})
    return sailing({"a": (*SUITE, GUN), "b": (GUN, second)}, fleet=TWO)


@pytest.fixture(autouse=True)
def _at_the_start(sim):
    sim.reset()


def test_a_boat_has_the_sensors_of_its_rows(sim):
    assert sim.sensors("a") == ("gps", "imu", "p3d", "pinger", "gun")
    assert tuple(sim.sense("a")) == sim.sensors("a")
    assert len(sim.sense("b")) == 2


def test_readings_are_a_mapping(sim):
    readings = sim.sense("a")
    assert "gps" in readings
    assert "sonar" not in readings
    assert readings.get("sonar") is None
    assert readings.get("imu").type == "imu"
    assert {name: reading.type for name, reading in readings.items()} == {
        "gps": "gps", "imu": "imu", "p3d": "p3d", "pinger": "pinger", "gun": "ball_shooter",
    }  # fmt: skip


def test_a_reading_says_what_it_is(sim):
    sim.advance(50)
    reading = sim.sense("a")["gps"]
    assert (reading.name, reading.type, reading.frame) == ("gps", "gps", "a/gps_link")
    assert (reading.time, reading.sequence) == (sim.time, 7)


def test_a_reading_stays_until_the_next_one(sim):
    readings = sim.sense("a")
    first = readings["p3d"]
    sim.advance(9)
    assert readings["p3d"] is first
    sim.advance(1)
    later = readings["p3d"]
    assert (later.sequence, later.time) == (1, pytest.approx(0.1))


def test_a_shot_between_two_readings_is_in_the_later_one(sim):
    """A reading tells of its own moment, whoever asks for it and when."""
    sim.advance(10)
    first = sim.sense("a")["gun"]
    sim.advance(5)
    sim.fire("a")
    assert (sim.sense("a")["gun"].time, sim.sense("a")["gun"].data) == (first.time, first.data)
    sim.advance(5)
    assert sim.sense("a")["gun"].data.shots_left == first.data.shots_left - 1


def test_a_run_that_nobody_holds_is_gone_at_once():
    """With its models and its drawing context: many runs in one process, as in training, do not pile up."""
    left = sailing(SUITE)
    left.sense("a")["imu"]
    kept = weakref.ref(left), weakref.ref(left.data), weakref.ref(left._sensing)
    gc.collect()
    gc.disable()
    try:
        del left
        assert [thing() for thing in kept] == [None, None, None]
    finally:
        gc.enable()


def test_what_is_not_asked_for_is_not_kept(sim):
    size = len(sim.get_state().ours)
    sim.sense("a")
    list(sim.sense("a"))
    assert "imu" in sim.sense("a")
    assert len(sim.get_state().ours) == size
    sim.sense("a")["imu"]
    one = len(sim.get_state().ours)
    sim.sense("a")["gps"]
    assert size < one == len(sim.get_state().ours)


def test_a_reset_stops_the_clocks(sim):
    fresh = sim.get_state().ours
    dict(sim.sense("a"))
    assert sim.get_state().ours != fresh
    sim.reset()
    assert sim.get_state().ours == fresh


def test_readings_are_not_in_the_fingerprint_but_shots_and_beacons_are(sim):
    """A run that is recorded with its sensors has the fingerprint of one that is not."""
    sim.advance(10)
    alone = sim.get_state().sha256
    sim.reset()
    dict(sim.sense("a"))
    sim.advance(10)
    assert sim.get_state().sha256 == alone
    sim.set_pinger("a", "pinger", (1.0, 2.0, -3.0))
    heard = sim.get_state()
    assert heard.sha256 != alone
    sim.fire("b", "second")
    assert len({alone, heard.sha256, sim.get_state().sha256}) == 3
    sim.set_state(State.from_bytes(heard.to_bytes()))
    assert sim.get_state().sha256 == heard.sha256


@pytest.mark.parametrize(
    ("ask", "error", "message"),
    [
        (lambda sim: sim.sensors("c"), UnknownNameError, "no boat named 'c'; known: a, b"),
        (lambda sim: sim.sense("c"), UnknownNameError, "no boat named 'c'; known: a, b"),
        (lambda sim: sim.sense("a")["pingr"], UnknownNameError, "no sensor of a named 'pingr'; did you mean 'pinger'?"),
        (lambda sim: sim.set_pinger("a", "gps", (0, 0, 0)), UnknownNameError,
         "no pinger of a named 'gps'; known: pinger"),
        (lambda sim: sim.set_pinger("b", "pinger", (0, 0, 0)), UnknownNameError,
         "no pinger of b named 'pinger'; known: none"),
        (lambda sim: sim.set_pinger("a", "pinger", (0, 0)), CommandError,
         "invalid position of pinger's beacon (0, 0): three numbers below 1e+07 are needed"),
        (lambda sim: sim.set_pinger("a", "pinger", (0, float("nan"), 0)), CommandError,
         "invalid position of pinger's beacon (0, nan, 0): three numbers below 1e+07 are needed"),
        (lambda sim: sim.set_pinger("a", "pinger", None), CommandError,
         "invalid position of pinger's beacon None: three numbers below 1e+07 are needed"),
        (lambda sim: sim.fire("c"), UnknownNameError, "no boat named 'c'; known: a, b"),
        (lambda sim: sim.fire("b"), CommandError, "b has 2 ball shooters: name one of gun, second"),
        (lambda sim: sim.fire("b", "third"), UnknownNameError,
         "no ball shooter of b named 'third'; known: gun, second"),
    ],
)  # fmt: skip
def test_nonsense_is_refused(sim, ask, error, message):
    before = sim.get_state().sha256
    with pytest.raises(error, match=f"^{re.escape(message)}$"):
        ask(sim)
    assert sim.get_state().sha256 == before


def test_a_world_without_a_georeference_has_no_fixes():
    sim = sailing((GPS, IMU), georeference=None, name="nowhere")
    message = "gps of a cannot measure its position: the world nowhere has no georeference"
    with pytest.raises(SensorError, match=f"^{message}$"):
        sim.sense("a")["gps"]
    assert sim.sense("a")["imu"].data.linear_acceleration[2] > 9.0


def test_a_boat_without_a_shooter_cannot_shoot():
    with pytest.raises(CommandError, match=r"^a has no ball shooter$"):
        sailing((P3D,)).fire("a")


def test_sensors_measure_at_base_link_or_at_their_own_place(sim):
    exact = {"range_noise": 0.0, "bearing_noise": 0.0, "elevation_noise": 0.0}
    quiet = (GPS, PINGER.model_copy(update=exact))
    fixes, ranges = [], []
    for at_base in (["gps", "imu", "pinger"], []):
        run = sailing(quiet, physics={"at_base_link": at_base})
        run.set_boat("a", pose=(10.0, 20.0, 0.5, 0.0, 0.0, np.pi / 2))
        run.set_pinger("a", "pinger", (10.0, 120.0, 0.5))
        fix = run.sense("a")["gps"].data
        fixes.append((fix.latitude, fix.longitude, fix.altitude))
        sound = run.sense("a")["pinger"].data
        ranges.append((sound.range, sound.bearing, sound.elevation))
    earth = Georeference(**tree_of(sim.world.parameters)["georeference"])
    assert earth.to_enu(*fixes[0]) == pytest.approx((10.0, 20.0, 0.5), abs=1e-6)
    assert earth.to_enu(*fixes[1]) == pytest.approx((10.0, 20.0 - 0.85, 0.5 + 1.3), abs=1e-6)
    assert ranges[0] == pytest.approx((100.0, 0.0, 0.0), abs=1e-9)
    assert ranges[1] == pytest.approx(
        (np.sqrt(99.0**2 + 0.5**2 + 1.0), np.arctan2(-0.5, 99.0), np.arctan2(1.0, np.hypot(99.0, 0.5)))
    )


@pytest.mark.parametrize("kind", ["camera", "lidar", "echo_sounder", "imu"])
@pytest.mark.parametrize("is_cached", [True, False])
def test_what_a_sensor_needs_is_compiled_ahead_unless_it_was(monkeypatch, is_cached, kind):
    compiled = []
    monkeypatch.setattr(sensing, "is_cached", lambda _: is_cached)
    pictures = SimpleNamespace(compile=lambda: compiled.append("camera"))
    monkeypatch.setattr(sensing, "Cameras", lambda *_: pictures)
    sights = sensing.Sights(SimpleNamespace(parameters=None), None, lambda: None)
    monkeypatch.setattr(sights, "scan", lambda *_: compiled.append("lidar"))
    monkeypatch.setattr(sights, "echo", lambda *_: compiled.append("echo_sounder"))
    sensor = SimpleNamespace(
        boat="a", name="s", config=SimpleNamespace(type=kind, sea_returns=kind == "lidar", rate=1.0)
    )
    sights.compile([sensor], None)
    assert compiled == ([] if is_cached or kind == "imu" else [kind])


def test_a_ball_flies_as_its_launcher_points_and_does_not_spin():
    """Whatever it did when it was put back; its speed is that of the impulse, less gravity in half a step."""
    sim = sailing((GUN,))
    arrays, (gun,) = sim._live.arrays, sim._live.arrays.sensors
    ball = arrays.floats[gun.ball]
    sim.data.qvel[ball["dof"] :][:6] = 1.0
    assert sim.fire("a")
    velocity = sim.data.qvel[ball["dof"] :][:6].copy()
    place = gun.place(sim.data.qpos, sim.data.qvel, gun.mount)
    along = place.rotation[:, 0] * GUN.impulse / float(ball["mass"])
    assert not velocity[3:].any()
    assert velocity[:3] == pytest.approx(along - 0.5 * sim.timestep * sim.model.opt.gravity, abs=1e-9)
    muzzle = place.position + place.rotation @ GUN.muzzle
    assert sim.data.qpos[ball["qpos"] :][:3] == pytest.approx(muzzle)
