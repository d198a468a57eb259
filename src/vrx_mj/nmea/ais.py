"""AIS: when a vessel's transponder reports (ITU-R M.1371-5, annex 1, tables 1 and 2), and what."""

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import timedelta
from typing import NamedTuple
from zlib import crc32

import mujoco
import numpy as np
from pyais import messages
from pyais.encode import encode_msg

from vrx_mj.frames import Geodetic, compass, rotation_matrix
from vrx_mj.model.boats import AisClass
from vrx_mj.nmea.sentences import KNOT, START, knots, tenths
from vrx_mj.runtime.observation import BoatObservation

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
_FASTEST, _FASTEST_TURN = 102.2, 708.0
"""What a report can hold [knots, degrees per minute]."""


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
            "speed": min(knots(seen.speed), _FASTEST),
            "course": tenths(compass(seen.course + earth.x_from_east)),
            "heading": round(heading) % 360,
            "second": (START + timedelta(seconds=time)).second,
        }
        if self.ais_class == "B":
            return messages.MessageType18.create(**report, dsc=True, band=True, msg22=True)
        port = math.degrees(float(rotation_matrix(seen.quaternion)[2] @ seen.angular_velocity)) * 60.0
        turn = max(-_FASTEST_TURN, min(_FASTEST_TURN, -port))
        return messages.MessageType1.create(**report, status=messages.NavigationStatus.UnderWayUsingEngine, turn=turn)

    def _static(self) -> list[messages.Payload]:
        named = {"mmsi": self.mmsi, "shipname": self.name.upper()}
        figures = {"mmsi": self.mmsi, "ship_type": _KIND_OF_SHIP, **self.size._asdict()}
        if self.ais_class == "A":
            return [messages.MessageType5.create(**named | figures, epfd=messages.EpfdType.GPS)]
        part_a, part_b = messages.MessageType24PartA, messages.MessageType24PartB
        return [part_a.create(**named, partno=0), part_b.create(**figures, partno=1)]
