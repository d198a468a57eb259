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
    """Goes to the beacon of an acoustic perception task, whose position `StillBeacon` estimates.

    The task ends within 3 m of the beacon, even before it is `running`. So the boat listens while it is held, leaves
    as soon as it is released, goes as fast as it can, and does not stop at the beacon.
    """

    def begin(self) -> None:
        """Forget the beacon, at the start of a run."""
        super().begin()
        self._beacon = StillBeacon()

    def listen(self, boat: "BoatObservation", seen: Estimate, task: Mapping[str, Any], t: float) -> None:
        """Add a sound to the estimate, also before the boat is released."""
        sound = self.sound(boat, seen, t)
        if sound is not None:
            self._beacon.update(sound)

    def steer(self, boat: "BoatObservation", seen: Estimate, task: Mapping[str, Any], t: float) -> Commands:
        """Commands that lead to the estimated position of the beacon."""
        if self._beacon.place is None:
            return self.pilot.sail(seen, t, 0.0, 0.0, seen.heading)
        distance, bearing = seen.to(*self._beacon.place)
        speed = min(self.pilot.top_speed, HASTE + approach_speed(distance, POSITION_RATE, self.pilot.braking))
        heading = bearing if distance > BOW else seen.heading
        return self.pilot.sail(seen, t, speed * math.cos(bearing), speed * math.sin(bearing), heading)


class BeaconFollower(Listener):
    """Follows the beacon of an acoustic tracking task, whose position and velocity `MovingBeacon` estimates.

    The commanded velocity is that of the beacon plus one toward the beacon. The beacon moves under the buoys, and the
    boat goes around what its lidar sees: a collision costs as much as one metre of mean distance.
    """

    def begin(self) -> None:
        """Forget the beacon and the buoys, at the start of a run."""
        super().begin()
        self._beacon, self._lookout = MovingBeacon(), Lookout()

    def listen(self, boat: "BoatObservation", seen: Estimate, task: Mapping[str, Any], t: float) -> None:
        """Add a sound to the estimate once the task runs; before, the beacon is elsewhere."""
        if task.get("state", "running") != "running":
            return
        sound = self.sound(boat, seen, t)
        if sound is not None:
            self._beacon.update(sound, t)
        self._lookout.look(boat, seen, t, colors=False)

    def steer(self, boat: "BoatObservation", seen: Estimate, task: Mapping[str, Any], t: float) -> Commands:
        """Commands that follow the beacon around the buoys."""
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
