"""What a `Simulation` offers of its boats' sensors."""

import weakref
from collections.abc import Callable, Mapping, Sequence

from vrx_mj.arguments import check_name
from vrx_mj.errors import CommandError, shown
from vrx_mj.runtime.commands import Helm
from vrx_mj.runtime.contacts import ContactWatch, Touch
from vrx_mj.runtime.mounted import Mounted
from vrx_mj.runtime.rig import Rig
from vrx_mj.runtime.sensing import Readings, Sensing
from vrx_mj.runtime.shooter import fire
from vrx_mj.runtime.subscriptions import Subscription, Subscriptions
from vrx_mj.runtime.turns import Turn, in_turn
from vrx_mj.runtime.weather import Sea
from vrx_mj.sensors.readings import Reading

__all__ = ["Instruments"]


class Instruments:
    """The part of a simulation that boats see, hear and shoot with."""

    _helm: Helm
    _sensing: Sensing
    _subscriptions: Subscriptions
    _rig: Rig
    _sea: Sea
    _turn: Turn

    def sensors(self, boat: str) -> tuple[str, ...]:
        """Names of a boat's sensors; UnknownNameError if no boat has that name."""
        return self._sensing.names(boat)

    def mounted(self, boat: str) -> tuple[Mounted, ...]:
        """A boat's sensors with their `config`, `frame` and `mount`; UnknownNameError if no boat has that name."""
        check_name("boat", boat, self._sensing.boats)
        return tuple(sensor for sensor in self._rig.sensors if sensor.boat == boat)

    def sense(self, boat: str) -> Readings:
        """Last readings of a boat's sensors by name, each at the sensor's own rate.

        A sensor measures when it is looked up for the first time, and at its rate from then on.

        Raises:
            UnknownNameError: no boat has that name, or, when a reading is looked up, no sensor.
            SensorError: when a reading is looked up: the sensor cannot measure, as a GPS without georeference.
        """
        return self._sensing.readings(boat)

    @in_turn
    def prepare_sensors(self) -> None:
        """Compile now what the boats' cameras and lidars need on this machine, rather than in their first reading.

        Nothing is measured, and the run stays as it is.
        """
        self._sensing.compile()

    @in_turn
    def subscribe(
        self, boat: str, sensor: str, callback: Callable[[Reading], None], *, rate: float | None = None
    ) -> Subscription:
        """Call `callback(reading)` for every measurement of a sensor, or `rate` times per simulated second [Hz].

        The call comes from within `advance`, at the step of the measurement, and must not advance, reset or set the
        state. A reading that is due now comes as soon as the simulation advances.

        Raises:
            UnknownNameError: the boat or the sensor does not exist.
            CommandError: the rate is not above 0, or above the sensor's own.
        """
        check_name("boat", boat, self._sensing.boats)
        return self._subscriptions.add(boat, sensor, callback, rate, float(self._rig.data.time))

    @in_turn
    def unsubscribe(self, subscription: Subscription) -> None:
        """End a subscription that `subscribe` returned."""
        self._subscriptions.remove(subscription)

    @in_turn
    def watch_contacts(self, tell: Callable[[Touch], None]) -> ContactWatch:
        """Call `tell(touch)` once for every touch of a boat, with the other body, the time and the largest force.

        The call comes from within `advance`, up to half a second after the touch began, and must not advance, reset or
        set the state. A touch of less than 0.25 s may be missed.

        Raises:
            CommandError: `tell` cannot be called.
        """
        if not callable(tell):
            raise CommandError(f"invalid tell {shown(tell)}: a function that takes a touch is needed")
        own = weakref.proxy(self)
        watch = ContactWatch(lambda: own.boats, lambda: own._rig, tell)
        self._subscriptions.watch(watch)
        return watch

    @in_turn
    def unwatch_contacts(self, watch: ContactWatch) -> None:
        """End what `watch_contacts` began."""
        self._subscriptions.unwatch(watch)

    def steering(self, boat: str) -> dict[str, float]:
        """Current angle of each engine and rudder of a boat [rad]; UnknownNameError if no boat has that name."""
        return self._of_thrusters(boat, "angle")

    def thrust(self, boat: str) -> dict[str, float]:
        """Current force of each thruster and rudder of a boat [N]; UnknownNameError if no boat has that name."""
        return self._of_thrusters(boat, "thrust")

    @property
    def reading_times(self) -> Mapping[tuple[str, str], float]:
        """Wall time [s] spent so far on readings of subscribed sensors, by boat and sensor."""
        return self._subscriptions.times

    def receivers(self, boat: str) -> tuple[str, ...]:
        """Names of a boat's pinger receivers; UnknownNameError if no boat has that name."""
        return tuple(self._sensing.of_kind(boat, "pinger"))

    @in_turn
    def set_pinger(self, boat: str, sensor: str, position: Sequence[float]) -> None:
        """Move the beacon that a receiver hears to (x, y, z) [m, ENU]; it starts at the world's origin.

        Raises:
            UnknownNameError: the boat or the receiver does not exist.
            CommandError: the position is not three finite numbers.
        """
        self._sensing.set_beacon(boat, sensor, position)

    def pinger(self, boat: str, sensor: str) -> tuple[float, float, float]:
        """Position (x, y, z) [m, ENU] of the beacon that a receiver hears.

        Raises:
            UnknownNameError: the boat or the receiver does not exist.
        """
        return self._sensing.beacon(boat, sensor)

    @in_turn
    def fire(self, boat: str, sensor: str | None = None) -> bool:
        """Shoot a ball and return whether a shot was left; `name` may be left out if the boat has one shooter.

        Raises:
            UnknownNameError: the boat or the ball shooter does not exist.
            CommandError: the boat has no ball shooter, or several and `name` is not given.
        """
        fired = fire(self._sensing, self._rig, self._sea, boat, sensor)
        self._derive()
        return fired

    def _of_thrusters(self, boat: str, column: str) -> dict[str, float]:
        with self._turn.crew:
            check_name("boat", boat, self._sensing.boats)
            values = self._rig.thruster_state[column]
            return {name: float(values[row]) for name, row in self._helm.thrusters[boat].items()}

    def _derive(self) -> None:
        """Make what follows from the state follow it."""
        raise NotImplementedError
