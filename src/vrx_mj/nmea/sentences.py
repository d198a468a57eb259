"""Sentences of NMEA 0183, each made of the readings of one moment, with the sensors' noise."""

import math
from collections.abc import Callable, Sequence
from datetime import UTC, datetime, timedelta
from typing import NamedTuple

import pynmea2

from vrx_mj.arrays import FloatArray
from vrx_mj.frames import angles, compass, rotation_matrix
from vrx_mj.sensors.readings import Fix, Reading

START = datetime(2026, 1, 1, tzinfo=UTC)
"""The moment that a run's time 0 is in sentences."""
KNOT = 1852.0 / 3600.0
"""[m/s]"""
_SATELLITES, _DILUTION = 12, 0.8
"""Satellites in use and horizontal dilution of precision of every fix: errors are those of the sensor."""

HEADINGS = {"gnss_compass": "GP", "imu": "HE"}
"""Sensors that give a `heading`, the better one first, and their talkers."""


class Sentence(NamedTuple):
    """A sentence as it is sent."""

    text: str
    """Text from `$` or `!` to the checksum."""
    time: float
    """When its first sensor measured [s]."""
    frame: str
    """Frame of its first sensor."""


class SentenceKind(NamedTuple):
    """A kind of sentence, and what it is made of."""

    formatter: str
    talker: str
    """Empty: that of the sensor that gives the heading."""
    rate: float
    """Sentences per simulated second, at most [Hz]."""
    sources: tuple[str, ...]
    """Types of sensors, or `heading` and `battery`; it is sent at most as often as the first of them measures."""
    fields: Callable[..., Sequence[object]]
    """Makes its fields of their readings; empty: there is nothing to send."""

    def sentence(self, readings: Sequence[Reading]) -> Sentence | None:
        """The sentence of these readings."""
        first, fields = readings[0], [str(field) for field in self.fields(*readings)]
        talker = self.talker or HEADINGS[first.type]
        text = getattr(pynmea2, self.formatter)(talker, self.formatter, fields).render()
        return Sentence(text, first.time, first.frame) if fields else None


def knots(speed: float) -> float:
    """Knots, to a tenth, of a speed [m/s]."""
    return round(speed / KNOT, 1)


def tenths(angle: float) -> float:
    """An angle [degrees] from 0 to 359.9, to a tenth."""
    return round(angle, 1) % 360.0


def _mounting(reading: Reading) -> FloatArray:
    """(3, 3) rotation from a sensor to its boat."""
    assert reading.mount is not None, "it is a run's, not a recording's"
    return reading.mount.rotation


def _attitude(imu: Reading) -> FloatArray:
    """(3, 3) rotation from the boat to east, north, up."""
    return rotation_matrix(imu.data.orientation) @ _mounting(imu).T


def _yaw(rotation: FloatArray) -> float:
    """Direction [rad] of a frame's x axis, counter-clockwise from that of the outer frame."""
    return math.atan2(rotation[1, 0], rotation[0, 0])


def _heading(reading: Reading) -> float:
    """Heading of the bow [rad], counter-clockwise from east, by a GNSS compass or an IMU."""
    if reading.type == "imu":
        return _yaw(_attitude(reading))
    return float(reading.data.heading) - _yaw(_mounting(reading))


def _time(reading: Reading) -> tuple[str, str]:
    """Time of day and date, hhmmss.ss and ddmmyy, of a measurement."""
    moment = START + timedelta(milliseconds=10 * round(100.0 * reading.time))
    return f"{moment:%H%M%S}.{moment.microsecond // 10_000:02d}", f"{moment:%d%m%y}"


def _place(fix: Fix) -> tuple[str, str, str, str]:
    """Latitude and longitude, each in degrees and minutes with its hemisphere."""
    return *_minutes(fix.latitude, 2, "NS"), *_minutes(fix.longitude, 3, "EW")


def _minutes(angle: float, width: int, hemispheres: str) -> tuple[str, str]:
    whole, rest = divmod(round(60.0 * abs(angle), 5), 60.0)
    return f"{whole:0{width}.0f}{rest:08.5f}", hemispheres[angle < 0.0]


def _over_ground(fix: Fix) -> tuple[float, float]:
    """Speed over ground [knots] and course [degrees]."""
    north, west, _ = fix.velocity.tolist()
    return knots(math.hypot(north, west)), tenths(compass(math.atan2(north, -west)))


def _gga(gps: Reading) -> Sequence[object]:
    fix = gps.data
    return _time(gps)[0], *_place(fix), 1, _SATELLITES, _DILUTION, f"{fix.altitude:.2f}", "M", "0.0", "M", "", ""


def _rmc(gps: Reading) -> Sequence[object]:
    time, date = _time(gps)
    return time, "A", *_place(gps.data), *_over_ground(gps.data), date, "", "", "A"


def _vtg(gps: Reading) -> Sequence[object]:
    speed, course = _over_ground(gps.data)
    return course, "T", "", "M", speed, "N", f"{speed * 1.852:.1f}", "K", "A"


def _rot(compass_or_imu: Reading) -> Sequence[object]:
    data = compass_or_imu.data
    if compass_or_imu.type == "imu":
        turn = float((rotation_matrix(data.orientation) @ data.angular_velocity)[2])
    else:
        turn = data.rate_of_turn
    return round(-60.0 * math.degrees(turn), 1) + 0.0, "A"


def _air(anemometer: Reading) -> tuple[float, float]:
    """Apparent wind from ahead and from port [m/s]."""
    wind, angle = anemometer.data, anemometer.data.angle + _yaw(_mounting(anemometer))
    return wind.speed * math.cos(angle), wind.speed * math.sin(angle)


def _wind(ahead: float, port: float, reference: str) -> Sequence[object]:
    angle = tenths(-math.degrees(math.atan2(port, ahead)))
    return angle, reference, f"{math.hypot(ahead, port):.2f}", "M", "A"


def _true_wind(anemometer: Reading, gps: Reading, heading: Reading) -> Sequence[object]:
    """The wind over ground, by the speed over ground, relative to the bow."""
    (ahead, port), (north, west, _), yaw = _air(anemometer), gps.data.velocity.tolist(), _heading(heading)
    cos, sin = math.cos(yaw), math.sin(yaw)
    return _wind(ahead - (sin * north - cos * west), port - (cos * north + sin * west), "T")


def _dpt(echo_sounder: Reading) -> Sequence[object]:
    echo = echo_sounder.data
    return (f"{echo.range:.2f}", "0.0", f"{echo.range_max:.1f}") if math.isfinite(echo.range) else ()


def _attitude_xdr(imu: Reading) -> Sequence[object]:
    """Pitch, positive with the bow up, and heel, positive to starboard."""
    (a, b, c), (d, e, f), (g, h, i) = _attitude(imu).tolist()
    roll, pitch, _ = angles(((a, b, c), (d, e, f), (g, h, i)))
    bow_up, heel = (round(math.degrees(angle), 1) + 0.0 for angle in (-pitch, roll))
    return "A", bow_up, "D", "PTCH", "A", heel, "D", "ROLL"


def _battery_xdr(battery: Reading) -> Sequence[object]:
    voltage, current = battery.data["voltage"], battery.data["current"]
    return "U", f"{voltage:.2f}", "V", "BATTERY", "I", f"{current:.2f}", "A", "BATTERY"


KINDS = (
    SentenceKind("GGA", "GP", 1.0, ("gps",), _gga),
    SentenceKind("RMC", "GP", 1.0, ("gps",), _rmc),
    SentenceKind("VTG", "GP", 1.0, ("gps",), _vtg),
    SentenceKind("HDT", "", 10.0, ("heading",), lambda reading: (tenths(compass(_heading(reading))), "T")),
    SentenceKind("ROT", "", 10.0, ("heading",), _rot),
    SentenceKind("MWV", "WI", 2.0, ("anemometer",), lambda anemometer: _wind(*_air(anemometer), "R")),
    SentenceKind("MWV", "WI", 2.0, ("anemometer", "gps", "heading"), _true_wind),
    SentenceKind("DPT", "SD", 1.0, ("echo_sounder",), _dpt),
    SentenceKind("XDR", "II", 1.0, ("imu",), _attitude_xdr),
    SentenceKind("XDR", "II", 1.0, ("battery",), _battery_xdr),
)
"""All kinds, in the order in which sentences of one moment are sent."""
