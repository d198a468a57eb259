"""The sentences of a run: equal to its sensors' readings, the same for one seed, only of what a boat has."""

import math

import numpy as np
import pynmea2
import pytest
from pyais import decode

import vrx_mj
from integration.sailing import CALM, boats
from integration.sensing import GPS, IMU, sailing
from vrx_mj.config.sensors import ErrorModel, GpsConfig, ImuConfig
from vrx_mj.errors import UnknownNameError
from vrx_mj.frames import compass
from vrx_mj.nmea import Instruments

SPREAD = (0.4, 0.4, 0.4)
NOISY_GPS = GPS.model_copy(update={"position": ErrorModel(noise=SPREAD), "velocity": ErrorModel(noise=SPREAD)})
NOISY_IMU = IMU.model_copy(update={"heading": ErrorModel(noise=(0.0, 0.0, 0.05))})
VALPARAISO = {"latitude": -33.03, "longitude": -71.62}


def two(**more):
    """Boats a and b, of which a has noisy sensors."""
    fleet = boats((0.0, 0.0, 0.3), (30.0, 10.0, 1.0))
    return sailing({"a": (NOISY_GPS, NOISY_IMU), "b": ()}, fleet=fleet, sea=CALM, wind=None, **more)


def stream(sim, duration, boat="a", instruments=None):
    """What a boat sends in so long [s], with the simulation at a moment."""
    instruments = instruments or Instruments(sim)
    lines = []
    for _ in range(round(duration * 10)):
        lines += [*instruments.sentences(boat), *instruments.reports(boat)]
        sim.step({"a": {"left": 0.5, "right": 0.4}, "b": {"left": 1.0, "right": 1.0}}, duration=0.1)
    return lines


def test_sentences_are_the_sensors_readings_with_their_noise():
    sim = two(georeference=VALPARAISO)
    instruments = Instruments(sim)
    for _ in range(30):
        sim.step({"a": {"left": 0.8, "right": -0.2}}, duration=0.1)
        gps, imu = (sim.sense("a")[name] for name in ("gps", "imu"))
        for sentence in instruments.sentences("a"):
            read = pynmea2.parse(sentence.text, check=True)
            if sentence.text.startswith("$GP"):
                assert (sentence.time, sentence.frame) == (gps.time, gps.frame)
            if read.sentence_type == "RMC":
                place = read.latitude, read.longitude
                assert place == pytest.approx((gps.data.latitude, gps.data.longitude), abs=1e-7)
                north, west, _ = gps.data.velocity
                assert read.spd_over_grnd == pytest.approx(math.hypot(north, west) * 3600 / 1852, abs=0.051)
                assert (read.lat_dir, read.lon_dir) == ("S", "W")
            if read.sentence_type == "HDT":
                assert sentence.time == imu.time
                yaw = 2.0 * math.atan2(imu.data.orientation[3], imu.data.orientation[0])
                assert abs(math.remainder(float(read.heading) - compass(yaw), 360.0)) < 0.06


def test_rates_are_those_of_the_table_or_of_the_sensor_if_it_is_slower():
    slow = GpsConfig(name="gps", link="gps_link", rate=0.5)
    sim = sailing({"a": (slow, ImuConfig(name="imu", link="imu", rate=4.0))}, fleet=boats((0.0, 0.0, 0.0)))
    instruments, kinds = Instruments(sim), []
    for _ in range(100):
        kinds += [sentence.text[3:6] for sentence in instruments.sentences("a")]
        sim.step(duration=0.1)
    assert {kind: kinds.count(kind) for kind in dict.fromkeys(kinds)} == {
        "GGA": 5, "RMC": 5, "VTG": 5, "HDT": 40, "ROT": 40, "XDR": 10
    }  # fmt: skip


def test_a_run_of_one_seed_has_the_same_sentences_each_time():
    first, second, other = (stream(two(seed=seed), 12.0) for seed in (3, 3, 4))
    assert first == second
    assert first != other
    assert {"$", "!"} == {sentence.text[0] for sentence in first}


def test_two_who_ask_at_one_moment_get_the_same_and_a_reset_begins_anew():
    sim = two(seed=3)
    instruments = Instruments(sim)
    assert instruments.sentences("a") is instruments.sentences("a")
    first = stream(sim, 12.0, instruments=instruments)
    sim.reset(seed=3)
    assert stream(sim, 12.0, instruments=instruments) == first


def test_reports_are_of_all_others_and_carry_their_true_places():
    sim = two(seed=3, georeference=VALPARAISO)
    instruments, heard = Instruments(sim), {"a": {}, "b": {}}
    for _ in range(120):
        for boat, found in heard.items():
            for sentence in instruments.reports(boat):
                message = decode(sentence.text)
                if message.msg_type == 18:
                    found[message.mmsi] = message
                    (sender,) = {"a", "b"} - {boat}
                    earth, seen = sim.world.parameters.georeference, sim.observe()[sender]
                    latitude, longitude, _ = earth.to_geodetic(*seen.position)
                    assert (message.lat, message.lon) == pytest.approx((latitude, longitude), abs=2e-6)
                    assert message.heading == round(compass(seen.heading)) % 360
        sim.step({"b": {"left": 1.0, "right": 1.0}}, duration=0.1)
    assert [len(found) for found in heard.values()] == [1, 1]
    assert heard["a"].keys() != heard["b"].keys()


def test_the_class_of_a_transponder_is_the_files():
    fleet = boats((0.0, 0.0, 0.0), (20.0, 0.0, 0.0), ais="A")
    fleet["boats"][1]["ais"] = "B"
    sim = sailing({"a": (), "b": ()}, fleet=fleet)
    assert {decode(one.text).msg_type for one in stream(sim, 12.0, "a")} == {18, 24}
    of_a = [one.text for one in stream(sim, 12.0, "b")]
    assert {decode(text).msg_type for text in of_a if ",1,1," in text} == {1}


def test_a_boat_without_sensors_sends_nothing_of_its_own():
    sim = two()
    assert {sentence.text[0] for sentence in stream(sim, 12.0, "b")} == {"!"}
    assert Instruments(sim).description("b") == "b sends no sentences; it receives AIVDM"
    text = "a sends GGA, RMC, VTG, HDT, ROT, XDR; it receives AIVDM"
    assert Instruments(sim).description("a") == text


def test_nowhere_on_earth_there_are_no_places():
    sim = sailing((GPS, IMU), fleet=boats((0.0, 0.0, 0.0), (20.0, 0.0, 0.0)), georeference=None)
    assert {sentence.text[3:6] for sentence in stream(sim, 3.0)} == {"HDT", "ROT", "XDR"}
    assert Instruments(sim).description("a").endswith("no AIS, since the world has no georeference")


def test_an_unknown_boat_is_named():
    with pytest.raises(UnknownNameError, match="no boat named 'c'"):
        Instruments(two()).sentences("c")


def test_a_battery_has_the_voltage_of_what_its_propellers_draw():
    sim = vrx_mj.Simulation(
        vrx_mj.compile_world(
            {"extends": "sydney_regatta", "physics": {"profile": "marine"}}, fleet={"robot": "blueboat"}
        )
    )
    (boat,), instruments, volts = sim.boats, Instruments(sim), []
    for _ in range(31):
        volts += [float(pynmea2.parse(one.text).value) for one in instruments.sentences(boat) if "BATTERY" in one.text]
        sim.step({boat: {"left": 1.0, "right": 1.0}}, duration=0.1)
    assert len(volts) == 4
    assert volts[0] > volts[1] > 12.0
    assert np.ptp(volts[1:]) < 1.0
