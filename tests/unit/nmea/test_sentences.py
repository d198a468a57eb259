"""Sentences of readings that are typed here: units, signs, hemispheres, rounding; pynmea2 reads each."""

import math
from types import SimpleNamespace

import numpy as np
import pynmea2
import pytest

from vrx_mj.frames import quaternion, rotation
from vrx_mj.nmea import KINDS
from vrx_mj.sensors.readings import Fix, Inertia, Mount, Reading

NORTH = math.pi / 2
"""Heading of a bow to the north [rad], counter-clockwise from east."""


def reading(kind, data, *, time=0.0, mount=(0.0, 0.0, 0.0)):
    return Reading(kind, kind, time, 0, f"b/{kind}", data, Mount.of((0.0, 0.0, 0.0), rotation(*mount)))


def gps(latitude=0.0, longitude=0.0, north=0.0, east=0.0, altitude=0.0, time=0.0):
    velocity = np.array([north, -east, 0.0])
    return reading("gps", Fix(latitude, longitude, altitude, velocity, (0.0,) * 9), time=time)


def imu(roll=0.0, pitch=0.0, yaw=0.0, rates=(0.0, 0.0, 0.0), mount=(0.0, 0.0, 0.0)):
    """Of a boat that is turned so, with rates [rad/s] about its own axes."""
    turned, own = np.array(rotation(*mount)), np.array(rotation(roll, pitch, yaw))
    sensor = own @ turned
    yaw_, pitch_, roll_ = (
        math.atan2(sensor[1, 0], sensor[0, 0]),
        math.asin(-sensor[2, 0]),
        math.atan2(sensor[2, 1], sensor[2, 2]),
    )
    inertia = Inertia(np.array(quaternion(roll_, pitch_, yaw_)), turned.T @ np.array(rates), np.zeros(3))
    return reading("imu", inertia, mount=mount)


def compass(bearing, to_starboard=0.0, mount=(0.0, 0.0, 0.0)):
    """Of a sensor whose x axis has a bearing [degrees] and turns to starboard [degrees/s]."""
    data = SimpleNamespace(heading=math.radians(90.0 - bearing), rate_of_turn=-math.radians(to_starboard))
    return reading("gnss_compass", data, mount=mount)


def wind(speed, from_port, mount=(0.0, 0.0, 0.0)):
    """An apparent wind [m/s] from an angle to port of the bow [degrees]."""
    return reading("anemometer", SimpleNamespace(speed=speed, angle=math.radians(from_port)), mount=mount)


def made(formatter, *readings, number=0):
    """What pynmea2 reads of the sentence of these readings."""
    kind = [kind for kind in KINDS if kind.formatter == formatter][number]
    found = kind.sentence(readings)
    assert found.frame == readings[0].frame
    assert len(found.text) <= 80  # with its end at most 82
    read = pynmea2.parse(found.text, check=True)
    talker = kind.talker or {"gnss_compass": "GP", "imu": "HE"}[readings[0].type]
    assert (read.talker, read.sentence_type) == (talker, formatter)
    return read


@pytest.mark.parametrize(
    ("latitude", "longitude", "shown"),
    [
        (-33.724223, 150.679736, ("3343.45338", "S", "15040.78416", "E")),
        (-33.75, -70.5, ("3345.00000", "S", "07030.00000", "W")),
        (21.30996, -157.8901, ("2118.59760", "N", "15753.40600", "W")),
        (9.9999999999, 0.0999999999, ("1000.00000", "N", "00006.00000", "E")),
        (-0.0000001, 0.0, ("0000.00001", "S", "00000.00000", "E")),
    ],
)
def test_places_are_degrees_and_minutes_with_hemispheres(latitude, longitude, shown):
    for formatter in ("GGA", "RMC"):
        read = made(formatter, gps(latitude, longitude))
        assert (read.lat, read.lat_dir, read.lon, read.lon_dir) == shown
        assert (read.latitude, read.longitude) == pytest.approx((latitude, longitude), abs=0.5e-5 / 60.0 + 1e-12)


def test_a_fix_has_its_altitude_and_quality():
    read = made("GGA", gps(altitude=-1.236))
    assert (read.gps_qual, read.altitude, read.altitude_units, read.geo_sep) == (1, -1.24, "M", "0.0")
    assert read.is_valid


@pytest.mark.parametrize(
    ("time", "clock", "date"),
    [
        (0.0, "000000.00", "010126"),
        (59.996, "000100.00", "010126"),
        (3723.07, "010203.07", "010126"),
        (86400.0 * 31, "000000.00", "010226"),
    ],
)
def test_times_are_of_the_measurement_from_the_first_of_january(time, clock, date):
    assert made("GGA", gps(time=time)).data[0] == clock
    read = made("RMC", gps(time=time))
    assert (read.data[0], read.data[8]) == (clock, date)


@pytest.mark.parametrize(
    ("north", "east", "course"),
    [(1.0, 0.0, 0.0), (0.0, 1.0, 90.0), (-1.0, -1.0, 225.0), (1000.0, -0.5, 0.0), (1000.0, -1.0, 359.9)],
)
def test_courses_are_clockwise_from_north_below_360(north, east, course):
    read, speed = made("RMC", gps(north=north, east=east)), math.hypot(north, east)
    assert read.true_course == course
    assert read.spd_over_grnd == pytest.approx(speed * 3600.0 / 1852.0, abs=0.05 + 1e-9)
    read = made("VTG", gps(north=north, east=east))
    assert (read.true_track, read.true_track_sym) == (course, "T")
    assert float(read.spd_over_grnd_kts) == pytest.approx(speed * 3600.0 / 1852.0, abs=0.05 + 1e-9)
    assert read.spd_over_grnd_kmph == pytest.approx(speed * 3.6, abs=0.15)


@pytest.mark.parametrize(("bearing", "shown"), [(0.0, 0.0), (90.0, 90.0), (359.9, 359.9), (359.97, 0.0), (-0.02, 0.0)])
def test_headings_are_true_and_below_360_by_either_sensor(bearing, shown):
    for sensor in (compass(bearing), imu(yaw=math.radians(90.0 - bearing), roll=0.3)):
        read = made("HDT", sensor)
        assert (float(read.heading), read.hdg_true) == (shown, "T")


def test_a_turned_sensor_gives_the_heading_of_the_bow():
    turned = (0.0, 0.0, math.radians(120.0))
    assert float(made("HDT", compass(-120.0 + 10.0, mount=turned)).heading) == 10.0
    assert float(made("HDT", imu(yaw=math.radians(80.0), mount=(0.4, 0.2, 2.0))).heading) == 10.0


def test_rates_of_turn_are_positive_to_starboard_in_degrees_per_minute():
    assert made("ROT", compass(0.0, to_starboard=2.0)).data == ["120.0", "A"]
    assert made("ROT", compass(0.0, to_starboard=-2.0)).data == ["-120.0", "A"]
    port = math.radians(1.0)
    assert made("ROT", imu(rates=(0.0, 0.0, port))).data == ["-60.0", "A"]
    assert made("ROT", imu(rates=(0.0, 0.0, port), mount=(math.pi / 2, 0.0, 1.0))).data == ["-60.0", "A"]
    assert made("ROT", imu()).data == ["0.0", "A"]


@pytest.mark.parametrize(
    ("from_port", "shown"), [(0.0, 0.0), (-90.0, 90.0), (90.0, 270.0), (180.0, 180.0), (0.03, 0.0)]
)
def test_apparent_wind_is_clockwise_from_the_bow(from_port, shown):
    read = made("MWV", wind(7.125, from_port))
    assert (float(read.wind_angle), read.reference, read.wind_speed_units, read.status) == (shown, "R", "M", "A")
    assert float(read.wind_speed) == pytest.approx(7.125, abs=0.005 + 1e-9)
    turned = wind(7.125, from_port - 35.0, mount=(0.0, 0.0, math.radians(35.0)))
    assert made("MWV", turned).data == read.data


@pytest.mark.parametrize("bearing", [0.0, 200.0])
def test_true_wind_is_the_apparent_one_without_that_of_the_way_made(bearing):
    ahead = math.radians(bearing)
    own = gps(north=5.0 * math.cos(ahead), east=5.0 * math.sin(ahead))
    calm = made("MWV", wind(5.0, 0.0), own, compass(bearing), number=1)
    assert (float(calm.wind_speed), calm.reference) == (0.0, "T")
    beam = made("MWV", wind(math.hypot(5.0, 8.0), -math.degrees(math.atan2(8.0, 5.0))), own, compass(bearing), number=1)
    assert (float(beam.wind_angle), float(beam.wind_speed)) == (90.0, 8.0)


def test_drift_to_port_is_wind_from_port():
    drifting = gps(north=0.0, east=-2.0)  # the bow is to the north
    read = made("MWV", wind(2.0, 90.0), drifting, imu(yaw=NORTH), number=1)
    assert float(read.wind_speed) == 0.0


def test_depth_is_below_the_transducer_and_silent_without_an_echo():
    echo = SimpleNamespace(range=12.346, range_max=100.0)
    assert made("DPT", reading("echo_sounder", echo)).data == ["12.35", "0.0", "100.0"]
    kind = next(kind for kind in KINDS if kind.formatter == "DPT")
    assert kind.sentence([reading("echo_sounder", SimpleNamespace(range=math.inf, range_max=100.0))]) is None


@pytest.mark.parametrize("mount", [(0.0, 0.0, 0.0), (0.0, 0.0, math.pi), (math.pi / 2, 0.0, 0.3)])
def test_pitch_is_positive_with_the_bow_up_and_heel_to_starboard(mount):
    read = made("XDR", imu(roll=math.radians(12.0), pitch=math.radians(-3.0), yaw=1.0, mount=mount))
    assert read.data == ["A", "3.0", "D", "PTCH", "A", "12.0", "D", "ROLL"]


def test_a_battery_has_its_voltage_and_current():
    battery = reading("battery", {"voltage": 14.806, "current": 3.0})
    assert made("XDR", battery, number=1).data == ["U", "14.81", "V", "BATTERY", "I", "3.00", "A", "BATTERY"]
