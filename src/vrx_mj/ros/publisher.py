"""What goes out: messages made when they are due, and only while somebody listens."""

from collections.abc import Callable, Sequence

from vrx_mj.errors import SensorError
from vrx_mj.ros.messages import Message, encode
from vrx_mj.ros.offer import Output, Sent, Table, Transport
from vrx_mj.ros.table import CLOCK
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.runtime.subscriptions import Subscription
from vrx_mj.runtime.timing import Schedule
from vrx_mj.sensors.readings import Reading

__all__ = ["Publisher"]

NEWS_RATE = 10.0
"""How often outputs without a rate are looked at, per simulated second."""


class Publisher:
    """Outputs of a table on their way to transports."""

    def __init__(self, sim: Simulation, transports: Sequence[Transport], tell: Callable[[str, str], None]) -> None:
        self._sim, self._transports, self._tell = sim, transports, tell
        self._table, self._wanted = Table(), frozenset[str]()
        self._read: dict[tuple[str, str], Subscription] = {}
        self._failed: set[tuple[str, str]] = set()
        self._batch: list[Sent] = []
        self._schedule = Schedule()
        self._last: dict[str, tuple[Message, bytes]] = {}

    def offer(self, table: Table) -> None:
        """Make messages of this table from now on."""
        self._table = table
        self._schedule.keep(table.outputs)
        self._last = {name: told for name, told in self._last.items() if name in table.outputs}
        for key in [key for key in self._read if key[0] not in self._sim.boats]:
            del self._read[key]  # the simulation ended these itself
        self._wanted = frozenset()

    def begin(self) -> None:
        """Time began anew."""
        self._schedule = Schedule()
        self._last.clear()

    def deliver(self) -> None:
        """Send what is due at the present time; the clock goes last, for those who answer it."""
        self._listen()
        time = self._sim.time
        for output in self._table.outputs.values():
            make = output.make if output.sensor is None else output.blind
            if make is not None and output.sensor not in self._read and self._is_due(output, time):
                self._make(output, make, time)
        batch, self._batch = self._batch, []
        batch.sort(key=lambda sent: sent.output.name == CLOCK)
        if batch:
            for transport in self._transports:
                transport.publish(batch)

    def repeat(self, name: str) -> None:
        """Send the present message of an output out of turn, if somebody listens and there is such an output."""
        output = self._table.outputs.get(name)
        if output is not None and output.sensor is None and name in self._wanted:
            self._make(output, output.make, self._sim.time)
            batch, self._batch = self._batch, []
            for transport in self._transports:
                transport.publish(batch)

    def _listen(self) -> None:
        """Read the sensors that somebody listens to, and no others."""
        wanted = frozenset().union(*(transport.wanted for transport in self._transports))
        if wanted == self._wanted:
            return
        self._wanted = wanted
        outputs = [self._table.outputs[name] for name in wanted if name in self._table.outputs]
        keys = {output.sensor for output in outputs if output.sensor and not output.blind} - self._failed
        for key in self._read.keys() - keys:
            self._sim.unsubscribe(self._read.pop(key))
        for key in sorted(keys - self._read.keys()):
            self._subscribe(key)

    def _subscribe(self, key: tuple[str, str]) -> None:
        """Try a reading first: a sensor that cannot measure here says so once, and is silent."""
        boat, sensor = key
        try:
            self._sim.sense(boat)[sensor]
        except SensorError as error:
            self._failed.add(key)
            self._tell("ERROR", str(error))
            return
        outputs = [output for output in self._table.outputs.values() if output.sensor == key]

        def take(reading: Reading) -> None:
            for output in outputs:
                if output.name in self._wanted:
                    message = output.make(reading)
                    if message is not None:
                        self._batch.append(Sent(output, message, reading.time))

        self._read[key] = self._sim.subscribe(boat, sensor, take)

    def _is_new(self, output: Output, message: Message) -> bool:
        """Whether the message differs from the last one of an output that has no rate."""
        last, told = self._last.get(output.name, (None, b""))
        if message is last:
            return False
        now = encode(message, output.type)
        self._last[output.name] = message, now
        return now != told

    def _is_due(self, output: Output, time: float) -> bool:
        due = self._schedule.take(output.name, output.rate or NEWS_RATE, time)
        return due and (output.latched or output.name in self._wanted)

    def _make(self, output: Output, make: Callable[[], Message | None], time: float) -> None:
        message = make()
        if message is None:
            return
        if output.rate == 0.0 and not self._is_new(output, message):
            return
        self._batch.append(Sent(output, message, time))
