"""Acoustics: come to a beacon that lies still, or stay with one that swims."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from vrx_mj.control.beacon import Heard, MovingBeacon, StillBeacon, heard
from vrx_mj.control.guidance import approach_speed, around, clear_of
from vrx_mj.control.lookout import Lookout
from vrx_mj.control.navigation import Estimate, sensor_named
from vrx_mj.control.pilot import POSITION_RATE
from vrx_mj.control.skipper import Commands, Skipper

if TYPE_CHECKING:
    from vrx_mj.runtime.observation import BoatObservation

__all__ = ["BeaconFollower", "BeaconSeeker"]

HASTE = 1.5
"""How much faster [m/s] than a boat that is to stop at the beacon: it need only pass by."""
BOW = 3.0
"""Within this distance [m] of where it goes the boat keeps its heading: bearings are wild there."""

BERTH = 4.2
"""Distance [m] from buoys: half the boat's length, the buoy's radius, and a metre and a half."""
CAUTIOUS = 3.0
"""Speed [m/s] among buoys."""


class Listener(Skipper):
    """Hears a beacon by the boat's acoustic receiver."""

    def begin(self) -> None:
        """Forget what was heard."""
        self._count = -1

    def sound(self, boat: "BoatObservation", seen: Estimate, t: float) -> Heard | None:
        """What was heard since the last call, if anything."""
        name = sensor_named(boat, "pinger") or sensor_named(boat, "receiver")
        if name is None:
            return None
        reading = boat.sensors[name]
        if reading.sequence == self._count:
            return None
        self._count = reading.sequence
        return heard(reading.data, seen, t - reading.time)


class BeaconSeeker(Listener):
    """Goes to the beacon of an acoustic perception task, with `StillBeacon`'s estimate of where it is.

    The task ends within 3 m in space, also before it is `running`; so the boat sets out as soon as it is let go, having
    listened from its berth, goes as fast as it can, and does not stop there.
    """

    def begin(self) -> None:
        """Forget the beacon."""
        super().begin()
        self._beacon = StillBeacon()

    def listen(self, boat: "BoatObservation", seen: Estimate, task: Mapping[str, Any], t: float) -> None:
        """Take a sound into the estimate, also before the boat is let go."""
        sound = self.sound(boat, seen, t)
        if sound is not None:
            self._beacon.update(sound)

    def steer(self, boat: "BoatObservation", seen: Estimate, task: Mapping[str, Any], t: float) -> Commands:
        """Go to where the beacon seems to be."""
        if self._beacon.place is None:
            return self.pilot.sail(seen, t, 0.0, 0.0, seen.heading)
        distance, bearing = seen.to(*self._beacon.place)
        speed = min(self.pilot.top_speed, HASTE + approach_speed(distance, POSITION_RATE, self.pilot.braking))
        heading = bearing if distance > BOW else seen.heading
        return self.pilot.sail(seen, t, speed * math.cos(bearing), speed * math.sin(bearing), heading)


class BeaconFollower(Listener):
    """Stays with the beacon of an acoustic tracking task, with `MovingBeacon`'s estimate of where it is and goes.

    It wants the beacon's velocity, and besides it one toward the beacon as if that lay still. The beacon swims under
    the buoys, the boat goes around what its lidar sees: a collision costs as much as a metre of distance all the time.
    """

    def begin(self) -> None:
        """Forget the beacon and the buoys."""
        super().begin()
        self._beacon, self._lookout = MovingBeacon(), Lookout()

    def listen(self, boat: "BoatObservation", seen: Estimate, task: Mapping[str, Any], t: float) -> None:
        """Take a sound into the estimate, once the task runs: before, the beacon is not yet where it will be."""
        if task.get("state", "running") != "running":
            return
        sound = self.sound(boat, seen, t)
        if sound is not None:
            self._beacon.update(sound, t)
        self._lookout.look(boat, seen, t, colors=False)

    def steer(self, boat: "BoatObservation", seen: Estimate, task: Mapping[str, Any], t: float) -> Commands:
        """Follow, around the buoys."""
        now = self._beacon.at(t)
        if now is None:
            return self.pilot.sail(seen, t, 0.0, 0.0, seen.heading)
        discs = [(buoy.place, BERTH) for buoy in self._lookout.map.sure]
        goal = clear_of((now[0], now[1]), discs)
        distance, _ = seen.to(*goal)
        aim = around((seen.x, seen.y), goal, discs)
        _, bearing = seen.to(*aim)
        drift = now[2:] if aim == (now[0], now[1]) else (0.0, 0.0)
        speed = min(CAUTIOUS, approach_speed(distance, POSITION_RATE, self.pilot.braking))
        vx, vy = drift[0] + speed * math.cos(bearing), drift[1] + speed * math.sin(bearing)
        heading = bearing if distance > BOW else seen.heading
        return self.pilot.sail(seen, t, vx, vy, heading)
