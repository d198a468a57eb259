"""NMEA 0183: sentences of boats' instruments at a moment of a run, and AIS messages that their receivers hear.

Each sentence is made of the readings of one moment, with the sensors' noise. When a transponder reports, and what,
follows ITU-R M.1371-5, annex 1, tables 1 and 2.
"""

import math
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import partial
from typing import NamedTuple
from zlib import crc32

import mujoco
import numpy as np
import pynmea2
from pyais import messages
from pyais.encode import encode_msg

from vrx_mj.arrays import FloatArray
from vrx_mj.frames import Geodetic, angles, compass, rotation_matrix
from vrx_mj.model.boats import AisClass
from vrx_mj.runtime.battery import Charge
from vrx_mj.runtime.observation import BoatObservation
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.runtime.timing import Schedule
from vrx_mj.sensors.readings import Fix, Reading

START = datetime(2026, 1, 1, tzinfo=UTC)
"""The moment that a run's time 0 is in sentences."""
KNOT = 1852.0 / 3600.0
"""A knot [m/s]."""
_SATELLITES, _DILUTION = 12, 0.8
"""Satellites in use and horizontal dilution of precision of every fix: errors are those of the sensor."""

HEADINGS = {"gnss_compass": "GP", "imu": "HE"}
"""Sensors that give a `heading`, the better one first, and their talkers."""
LEAST_OF_A = 20.0
"""Length [m] of a hull from which on its transponder is of class A, as most flags ask for."""
_INTERVALS: Mapping[AisClass, Sequence[tuple[float, float, float]]] = {
    "A": ((23.0, 2.0, 2.0), (14.0, 6.0, 2.0), (0.0, 10.0, 10.0 / 3.0)),
    "B": ((23.0, 5.0, 5.0), (14.0, 15.0, 15.0), (2.0, 30.0, 30.0), (0.0, 180.0, 180.0)),
}
"""Speeds above which a class, of B one with SOTDMA, reports so often [knots]; intervals on a course and turning [s]."""
_STATIC_INTERVAL = 360.0
"""Between two reports of name and size [s]."""
_CHANGE, _STEADY, _WINDOW = 5.0, 20.0, 30
"""A class A vessel turns if its heading differs from its mean of 30 s by more than 5 degrees, and for 20 s after it."""
PERIOD = 1.0
"""Between two looks at a transponder [s]."""
FIRST = 10
"""Seconds within which all transponders have reported once."""
_COUNTRY, _OF_COUNTRY = 338_000_000, 1_000_000
"""MMSIs of the United States."""
_KIND_OF_SHIP = 90
"""Other type of ship, no further information."""
_MAX_SPEED, _MAX_TURN = 102.2, 708.0
"""Largest speed and rate of turn that a report holds [knots, degrees per minute]."""


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
    """Rotation (3, 3) from a sensor to its boat."""
    assert reading.mount is not None, "it is a run's, not a recording's"
    return reading.mount.rotation


def _attitude(imu: Reading) -> FloatArray:
    """Rotation (3, 3) from the boat to east, north, up."""
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


class Size(NamedTuple):
    """How far a vessel reaches from where its position is measured [m]."""

    to_bow: int
    to_stern: int
    to_port: int
    to_starboard: int


def size_of(model: mujoco.MjModel, body: str) -> Size:
    """The size of a boat by the shapes that are fixed to its body, from the body's origin."""
    low, high = np.zeros((2, 3))
    for geom in np.flatnonzero(model.geom_bodyid == model.body(body).id):
        axes = rotation_matrix(model.geom_quat[geom])
        centre = model.geom_pos[geom] + axes @ model.geom_aabb[geom, :3]
        half = np.abs(axes) @ model.geom_aabb[geom, 3:]
        low, high = np.minimum(low, centre - half), np.maximum(high, centre + half)
    return Size(*(round(float(reach)) for reach in (high[0], -low[0], high[1], -low[1])))


def mmsi_of(boats: Sequence[str]) -> dict[str, int]:
    """A number for each boat, by its name; of two that would have one the later has the next that is free."""
    found: dict[str, int] = {}
    for boat in boats:
        number = crc32(boat.encode())
        while _COUNTRY + number % _OF_COUNTRY in found.values():
            number += 1
        found[boat] = _COUNTRY + number % _OF_COUNTRY
    return found


@dataclass
class Transponder:
    """Transponder of one vessel, updated once a second."""

    name: str
    mmsi: int
    ais_class: AisClass
    size: Size
    due: float
    """When it reports its position next [s]."""
    due_static: float
    """When it reports name and size next [s]."""
    reported: float = math.inf
    """When it last reported its position [s]; infinite before the first time."""
    turned: float = -math.inf
    """When it last turned [s]."""
    headings: deque[float] = field(default_factory=lambda: deque(maxlen=_WINDOW))
    """Compass headings of the last seconds, without jumps at north [degrees]."""

    def sentences(self, time: float, seen: BoatObservation, earth: Geodetic) -> list[str]:
        """Sentences that it sends at a moment [s]."""
        time, found = round(time, 3), list[messages.Payload]()  # steps add up to 0.9999999 s
        heading = compass(seen.heading + earth.x_from_east)
        interval = self._interval(time, seen.speed / KNOT, heading)
        self.due = min(self.due, self.reported + interval)
        if time >= self.due:
            found.append(self._position(time, seen, earth, heading))
            self.reported, self.due = time, (self.due if self.due > time - PERIOD else time) + interval
        if time >= self.due_static:
            found += self._static()
            self.due_static += _STATIC_INTERVAL
        return [text for message in found for text in encode_msg(message, talker_id="AI", sentence_type="VDM")]

    def _interval(self, time: float, speed: float, heading: float) -> float:
        """Between two reports of the position [s], at a speed [knots] and a heading [degrees]."""
        last = self.headings[-1] if self.headings else heading
        self.headings.append(last + math.remainder(heading - last, 360.0))
        if abs(self.headings[-1] - sum(self.headings) / len(self.headings)) > _CHANGE:
            self.turned = time
        rows = _INTERVALS[self.ais_class]
        _, ahead, turning = next((row for row in rows if speed > row[0]), rows[-1])
        return turning if time - self.turned <= _STEADY else ahead

    def _position(self, time: float, seen: BoatObservation, earth: Geodetic, heading: float) -> messages.Payload:
        latitude, longitude, _ = earth.to_geodetic(*seen.position.tolist())
        report = {
            "mmsi": self.mmsi,
            "lat": latitude,
            "lon": longitude,
            "accuracy": True,
            "speed": min(knots(seen.speed), _MAX_SPEED),
            "course": tenths(compass(seen.course + earth.x_from_east)),
            "heading": round(heading) % 360,
            "second": (START + timedelta(seconds=time)).second,
        }
        if self.ais_class == "B":
            return messages.MessageType18.create(**report, dsc=True, band=True, msg22=True)
        port = math.degrees(float(rotation_matrix(seen.quaternion)[2] @ seen.angular_velocity)) * 60.0
        turn = max(-_MAX_TURN, min(_MAX_TURN, -port))
        return messages.MessageType1.create(**report, status=messages.NavigationStatus.UnderWayUsingEngine, turn=turn)

    def _static(self) -> list[messages.Payload]:
        named = {"mmsi": self.mmsi, "shipname": self.name.upper()}
        figures = {"mmsi": self.mmsi, "ship_type": _KIND_OF_SHIP, **self.size._asdict()}
        if self.ais_class == "A":
            return [messages.MessageType5.create(**named | figures, epfd=messages.EpfdType.GPS)]
        part_a, part_b = messages.MessageType24PartA, messages.MessageType24PartB
        return [part_a.create(**named, partno=0), part_b.create(**figures, partno=1)]


RATE = max(kind.rate for kind in KINDS)
"""How often there may be sentences, per simulated second [Hz]."""


class Instruments:
    """The instruments of all boats of a run, which may be asked at any moments: what is due since the last is made.

    Ask after every step, as `[each.text for each in instruments.sentences("wamv")]`.
    """

    def __init__(self, sim: Simulation) -> None:
        self._sim = sim
        self._begin()

    def _begin(self) -> None:
        """Forget what was sent: time starts over."""
        self._now = self._sim.time
        self._schedule = Schedule()
        self._charges: dict[tuple[str, int], Charge] = {}
        self._written: dict[str, tuple[float, Sequence[Sentence]]] = {}
        self._transponders: dict[str, Transponder] = {}
        self._heard: tuple[float, Sequence[tuple[str, Sentence]]] = -1.0, ()

    def _update_time(self) -> float:
        """Return the present moment [s]; one before the last starts over."""
        if self._sim.time < self._now:
            self._begin()
        self._now = self._sim.time
        return self._now

    def sentences(self, boat: str) -> Sequence[Sentence]:
        """Sentences of a boat's instruments at this moment; UnknownNameError if no boat has that name."""
        time = self._update_time()
        if self._written.get(boat, (-1.0, ()))[0] != time:
            self._written[boat] = time, [*self._write(boat, time)]
        return self._written[boat][1]

    def reports(self, boat: str) -> Sequence[Sentence]:
        """AIS reports of all other vessels at this moment, in a world with a georeference."""
        time = self._update_time()
        if self._schedule.take("AIS", 1.0 / PERIOD, time):
            self._heard = time, [*self._transmit(time)]
        then, heard = self._heard
        return [sentence for sender, sentence in heard if sender != boat] if then == time else ()

    def description(self, boat: str) -> str:
        """One line that says which sentences a boat has the sensors for."""
        known = self._sources(boat)
        sent = dict.fromkeys(kind.formatter for kind in KINDS if known.keys() >= set(kind.sources))
        ais = "AIVDM" if self._sim.world.parameters.georeference else "no AIS, since the world has no georeference"
        return f"{boat} sends {', '.join(sent) or 'no sentences'}; it receives {ais}"

    def _sources(self, boat: str) -> dict[str, tuple[float, Callable[[], Reading]]]:
        """Rate and reading of what a boat's sentences are made of."""
        sensors = {one.config.type: one for one in reversed(self._sim.mounted(boat))}
        if self._sim.world.parameters.georeference is None:
            sensors.pop("gps", None)
        best = next((sensors[kind] for kind in HEADINGS if kind in sensors), None)
        if best is not None:
            sensors["heading"] = best
        sensed = self._sim.sense(boat)
        found: dict[str, tuple[float, Callable[[], Reading]]] = {
            kind: (one.config.rate, partial(sensed.__getitem__, one.name)) for kind, one in sensors.items()
        }
        own = next(one for one in self._sim.world.parameters.boats if one.name == boat)
        if own.battery is not None:
            key = boat, own.life
            self._charges[key] = self._charges.get(key) or Charge(self._sim, boat, own.battery)
            measure = self._charges[key].measure
            found["battery"] = (
                math.inf,
                lambda: Reading("battery", "battery", self._now, 0, f"{boat}/base_link", measure()),
            )
        return found

    def _write(self, boat: str, time: float) -> Iterator[Sentence]:
        """The sentences of a boat that are due."""
        sources = self._sources(boat)
        for number, kind in enumerate(KINDS):
            if sources.keys() >= set(kind.sources):
                rate = min(kind.rate, sources[kind.sources[0]][0])
                if self._schedule.take(f"{boat} {number}", rate, time):
                    sentence = kind.sentence([sources[source][1]() for source in kind.sources])
                    if sentence is not None:
                        yield sentence

    def _transmit(self, time: float) -> Iterator[tuple[str, Sentence]]:
        """AIS messages of the transponders of all boats, each with its boat."""
        parameters, seen = self._sim.world.parameters, self._sim.observe()
        earth, known = parameters.georeference, self._transponders
        if earth is None:
            return
        numbers = mmsi_of(self._sim.boats)
        for boat, hull in zip(parameters.boats, parameters.hulls, strict=True):
            name = boat.name
            if name not in known:
                own, due = seen[name].hull, time + numbers[name] % FIRST
                ais_class: AisClass = boat.ais or ("A" if own and own.length >= LEAST_OF_A else "B")
                size = size_of(self._sim.model, hull.body)
                known[name] = Transponder(name, numbers[name], ais_class, size, due, due)
            for text in known[name].sentences(time, seen[name], earth):
                yield name, Sentence(text, time, "")
        self._transponders = {name: known[name] for name in self._sim.boats}
