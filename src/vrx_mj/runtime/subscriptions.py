"""Readings handed over as they fall due: to a recorder, to ROS, to a live view.

A subscribed sensor is read at the steps at which its clock latches a moment (`runtime.sample_clocks`), by the same
rule, so that there is one reading for every measurement and no drift. `Simulation.advance` stops at these steps: the
motion is the same to the last bit with any listeners.

Recorders read rows that the compiled loop copies while it runs.
"""

import math
import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter
from typing import Protocol

import numpy as np

from vrx_mj.arguments import as_number, check_kind, check_name
from vrx_mj.arrays import FloatArray
from vrx_mj.constants import EARLY
from vrx_mj.errors import CommandError, quote
from vrx_mj.model.kinds import STRICT, Vec3
from vrx_mj.runtime.loop import FILLED, STRIDE
from vrx_mj.runtime.loop_arrays import LoopArrays
from vrx_mj.runtime.mounted import Mounted
from vrx_mj.runtime.timing import sample_number, steps_to_time, stride_of
from vrx_mj.sensors.readings import Reading
from vrx_mj.tasks.referee import Message

_TOUCH_PERIOD, _REPORT_PERIOD, _FREE_PERIOD = 0.05, 0.5, 1e9
"""Simulated time between two samples while a boat touches something, while a touch is to be reported, and else [s].

A sample ends a call of the compiled loop, which costs 20 us; the loop returns by itself when a touch begins.
"""
_REPORT_DELAY = 0.5
"""Time after a touch began at which it is reported, with the largest force until then [s]."""
_PARTING_TIME = 1.0
"""Time without contact after which the next contact of a pair is a new touch [s]."""

_Pair = tuple[str, str]
_Forces = Mapping[_Pair, tuple[Vec3, Vec3]]
_RATIO_TOLERANCE = 1e-9
"""Distance by which a ratio of rates may fall short of a whole number."""
_ROUNDING_SHARE = 1e-3
"""Share of a step by which to stop too early rather than too late, where times are rounded."""
_NEVER = 1 << 62
"""Number of steps to the next reading where there are no subscriptions and no watches."""
_BUFFER_BYTES = 1_000_000
"""Approximate size of a buffer [bytes]: larger blocks of memory are not reused, which takes four times as long."""
_METHODS = ("rows", "state", "event")
"""Methods of every listener; `frame` is called in worlds with a task, `boats_changed` when boats come and go."""


@dataclass
class Touch:
    """A contact of a boat with something else."""

    __pydantic_config__ = STRICT
    boat: str
    """Name of the boat."""
    other: str
    """Another boat, an object or a dock, by its name, or `terrain`."""
    time: float
    """Time at which it began [s]."""
    force: float
    """Largest force observed, summed over all points of contact [N]."""
    duration: float = 0.0
    """Time from its beginning to the last contact observed [s]; it grows, like `force`, while the touch lasts."""
    count: int = 1
    """Number of touches: in a run's summary all of a pair, with the largest force and the total duration."""
    point: Vec3 | None = None
    """Point at which the largest force acted: the mean of all points of contact, weighted by force [m, ENU]."""
    vector: Vec3 | None = None
    """The largest force on the boat [N, ENU]."""

    def __str__(self) -> str:
        until = f" to {self.time + self.duration:.1f}" if self.duration else ""
        return f"{self.boat} touches {self.other}, {self.time:.1f}{until} s, {self.force:.0f} N"


class ContactSampler:
    """Samples the contacts of boats, for all who watch them."""

    def __init__(self, boats: Callable[[], tuple[str, ...]], arrays: Callable[[], LoopArrays]) -> None:
        """Sample contacts of these boats; `arrays` returns the present arrays."""
        self._boats, self._arrays = boats, arrays
        self._due, self._armed = 0, False

    def begin(self) -> None:
        """Sample at the next look."""
        self._due = 0

    def steps(self, time: float) -> int:
        """Steps from `time` [s] to the next sample."""
        return max(1, self._due - round(time / self._arrays().timestep))

    def look(self, time: float, *, waiting: bool) -> _Forces | None:
        """Forces of the last step and where they act by pairs, as `forces_of_pairs`; None if none is due at `time`.

        `waiting`: a touch is to be reported.
        """
        arrays = self._arrays()
        step, look = round(time / arrays.timestep), arrays.broadphase[0]
        stopped = self._armed and not look["armed"]
        if step < self._due and not stopped:
            return None
        free = look["wait"] == 0 and look["clearance"] > 0.0  # the list of contacts is then an earlier step's
        found = forces_of_pairs(arrays, frozenset(self._boats())) if arrays.data.ncon and not free else {}
        self._armed = not (found or stopped)  # what holds a boat stops the loop without a contact
        look["armed"] = self._armed
        stride = max(
            1, round(_TOUCH_PERIOD / arrays.timestep)
        )  # samples are at whole multiples of it, however the run is cut
        until = _TOUCH_PERIOD if not self._armed else _REPORT_PERIOD if waiting else _FREE_PERIOD
        self._due = (step // stride + round(until / _TOUCH_PERIOD)) * stride
        return found


class ContactWatch:
    """Reports every touch of a boat once."""

    def __init__(self, callback: Callable[[Touch], None], *, ended: bool = False) -> None:
        """`callback` is called with every touch: `_REPORT_DELAY` after it began, or with `ended` when it is over."""
        self._callback, self._ended = callback, ended
        self._touches: dict[_Pair, Touch] = {}
        self._seen: dict[_Pair, float] = {}
        self._waiting: set[_Pair] = set()

    def begin(self) -> None:
        """The state was set, maybe to an earlier time: report what is pending, and forget all touches."""
        self.end()
        self._touches.clear()
        self._seen.clear()

    def take(self, found: _Forces, time: float) -> None:
        """Take a sample at `time` [s], and report the touches that are due."""
        for pair, (vector, point) in found.items():
            self._note(pair, vector, point, time)
        self._report([pair for pair in self._waiting if self._is_due(pair, time)])

    @property
    def waiting(self) -> bool:
        """Whether a touch was not reported yet."""
        return bool(self._waiting)

    def end(self) -> None:
        """Report touches that were not reported yet."""
        self._report(self._waiting)

    def _note(self, pair: _Pair, vector: Vec3, point: Vec3, time: float) -> None:
        if time - self._seen.get(pair, -_PARTING_TIME) >= _PARTING_TIME:
            self._report(self._waiting & {pair})
            self._touches[pair] = Touch(*pair, time, -1.0)
            self._waiting.add(pair)
        self._seen[pair] = time
        touch, force = self._touches[pair], math.hypot(*vector)
        touch.duration = time - touch.time
        if force > touch.force:
            touch.force, touch.point, touch.vector = force, point, vector

    def _is_due(self, pair: _Pair, time: float) -> bool:
        """Whether a touch is to be reported at `time` [s]."""
        if self._ended:
            return time - self._seen[pair] >= _PARTING_TIME
        return self._touches[pair].time < time - _REPORT_DELAY

    def _report(self, due: Collection[_Pair]) -> None:
        """Report touches in the order of their names."""
        pairs = sorted(due)
        self._waiting.difference_update(pairs)
        for pair in pairs:
            self._callback(self._touches[pair])


def forces_of_pairs(arrays: LoopArrays, boats: frozenset[str]) -> _Forces:
    """Contact forces [N] of the last step on boats by what they touch, and where they act [m, ENU], by their names.

    Two boats are one pair, in the order of their names: which of their geoms MuJoCo has first means nothing.
    """
    model, data = arrays.model, arrays.data
    sums: dict[_Pair, np.ndarray] = {}  # of forces, of places by the size of their forces, and of these sizes
    for number in range(data.ncon):
        contact = data.contact[number]
        one, two = (model.body(int(model.geom_bodyid[geom])).name.partition("/")[0] for geom in contact.geom)
        pair = (one, two) if one in boats and not (two in boats and two < one) else (two, one)
        if pair[0] in boats and one != two:
            force, _ = arrays.contact_load(number)
            known = (pair[0], "terrain" if pair[1] in {"", "world"} else pair[1])
            size = max(float(np.linalg.norm(force)), sys.float_info.min)
            part = np.array([*(-force if one == pair[0] else force), *(size * contact.pos), size])
            sums[known] = sums.get(known, 0.0) + part
    return {pair: (tuple(row[:3].tolist()), tuple((row[3:6] / row[6]).tolist())) for pair, row in sums.items()}


@dataclass(eq=False)
class Subscription:
    """Somebody who takes a sensor's readings; `Simulation.unsubscribe` ends it."""

    boat: str
    sensor: str
    rate: float
    """Readings per simulated second."""
    callback: Callable[[Reading], None]
    own: float
    """Measurements of the sensor per simulated second."""
    taken: int = -1
    """Number of the last reading that was due."""

    def number(self, time: float) -> int:
        """Number of the reading that is the newest at `time` [s]; 0 is due at time 0.

        Of the measurements k = 0, 1, ... those are taken at which k times the rate over the sensor's own reaches the
        next whole number: every n-th where that goes, else n-th and (n+1)-th in turn.
        """
        measured = sample_number(self.own, time)
        return math.floor(measured * self.rate / self.own + _RATIO_TOLERANCE)

    def steps(self, time: float, timestep: float) -> int:
        """Steps from `time` [s] after which to look whether the next reading is due; never too many."""
        measured = math.ceil((self.number(time) + 1 - _RATIO_TOLERANCE) * self.own / self.rate)
        return steps_to_time(measured / self.own - EARLY, time, timestep, _ROUNDING_SHARE)


class Subscriptions:
    """All who take readings of a run, in the order in which they came."""

    def __init__(
        self,
        sensors: Sequence[Mounted],
        read: Callable[[str, str], Reading],
        timestep: float,
        contacts: ContactSampler,
    ) -> None:
        """Start without subscriptions; `read` returns the reading of a boat's sensor now."""
        self._read, self._timestep, self._contacts = read, timestep, contacts
        self._all: tuple[Subscription, ...] = ()
        self._watches: tuple[ContactWatch, ...] = ()
        self.busy = False
        """Whether a reading is being handed over."""
        self.times: dict[tuple[str, str], float] = {}
        """Wall time [s] that the readings of each boat's sensors took, with what their subscribers made of them."""
        self.bind(sensors)

    def bind(self, sensors: Sequence[Mounted]) -> None:
        """Go on with these sensors: subscriptions of those that are gone end."""
        self._rates: dict[str, dict[str, float]] = {}
        for sensor in sensors:
            self._rates.setdefault(sensor.boat, {})[sensor.name] = float(sensor.config.rate)
        self._all = tuple(one for one in self._all if one.sensor in self._rates.get(one.boat, {}))
        self.times = {key: spent for key, spent in self.times.items() if key[1] in self._rates.get(key[0], {})}

    def add(
        self, boat: str, sensor: str, callback: Callable[[Reading], None], rate: float | None, time: float
    ) -> Subscription:
        """Subscribe at `time` [s]; a reading that is due at this very time is the first.

        Raises:
            UnknownNameError: no such sensor on the boat.
            CommandError: a rate above the sensor's own, or none; nothing that can be called.
        """
        rates = self._rates.get(boat, {})
        check_name(f"sensor of {boat}", sensor, rates)
        if not callable(callback):
            raise CommandError(f"invalid callback {quote(callback)}: a function that takes a reading is needed")
        own = rates[sensor]
        wanted = own if rate is None else as_number(rate)
        if not 0.0 < wanted <= own:
            given = f"{wanted:g}" if math.isfinite(wanted) else quote(rate)
            raise CommandError(
                f"invalid rate {given} Hz for {sensor} of {boat}: above 0, and at most the sensor's {own:g} Hz"
            )
        subscription = Subscription(boat, sensor, wanted, callback, own)
        subscription.taken = subscription.number(time - self._timestep)
        self._all = (*self._all, subscription)
        return subscription

    def remove(self, subscription: Subscription) -> None:
        """Give no more readings to a subscription; nothing happens if it has ended."""
        self._all = tuple(one for one in self._all if one is not subscription)

    def watch(self, watch: ContactWatch) -> None:
        """Add a watch of contacts."""
        self._watches = (*self._watches, watch)
        self._contacts.begin()

    def unwatch(self, watch: ContactWatch) -> None:
        """End what `watch` began; nothing happens if it has ended.

        Raises:
            CommandError: it is not a watch.
        """
        check_kind("unwatch_contacts", watch, ContactWatch, "a watch, as watch_contacts returned it")
        self._watches = tuple(one for one in self._watches if one is not watch)
        with self._handing_over():
            watch.end()

    def begin(self, time: float) -> None:
        """The state was set: readings that are due at `time` [s] are to come, and contacts are new ones."""
        self._contacts.begin()
        for watch in self._watches:
            with self._handing_over():
                watch.begin()
        for one in self._all:
            one.taken = one.number(time - self._timestep)

    def check_idle(self, what: str) -> None:
        """Check that the run may be changed now.

        Raises:
            CommandError: a reading is being handed over.
        """
        if self.busy:
            raise CommandError(f"{what} cannot be called from the callback of a subscription: call it afterwards")

    def steps(self, time: float) -> int:
        """Steps from `time` [s] to where the next reading, or look at the contacts, may be due."""
        sample = self._contacts.steps(time) if self._watches else _NEVER
        return min([sample, *(one.steps(time, self._timestep) for one in self._all)])

    def deliver(self, time: float) -> None:
        """Look at the contacts, and hand over readings, where that is due at `time` [s] and was not done yet."""
        waiting = any(watch.waiting for watch in self._watches)
        found = self._contacts.look(time, waiting=waiting) if self._watches else None
        if found is not None:
            for watch in self._watches:
                with self._handing_over():
                    watch.take(found, time)
        for one in self._all:
            number = one.number(time)
            if number != one.taken and one in self._all:
                one.taken, begun = number, perf_counter()
                try:
                    with self._handing_over():
                        one.callback(self._read(one.boat, one.sensor))
                finally:
                    key = one.boat, one.sensor
                    self.times[key] = self.times.get(key, 0.0) + perf_counter() - begun

    @contextmanager
    def _handing_over(self) -> Iterator[None]:
        """Context for calls of users' functions, during which the run may not be changed."""
        before, self.busy = self.busy, True
        try:
            yield
        finally:
            self.busy = before


class Listener(Protocol):
    """Interface of a recorder to a simulation."""

    def rows(self, block: FloatArray) -> None:
        """Take sampled rows: [time, wind speed, thrusts, steering angles, qpos, qvel, displays' marks]."""

    def state(self, time: float, blob: bytes) -> None:
        """Take a saved state, once per simulated second."""

    def event(self, time: float, text: str, level: str) -> None:
        """Take a line of the log."""

    def frame(self, time: float, row: FloatArray, messages: Sequence[Message]) -> None:
        """Take a frame that the referee of the world's task looked at, as `tasks.layout` has it."""

    def boats_changed(self) -> None:
        """Boats have come or gone: later rows, states and frames are of the world as it is now."""


def check_listener(listener: object) -> None:
    """Check that something can be attached to a simulation.

    Raises:
        CommandError: it lacks a method of `Listener`, or is a class.
    """
    lacks = [name for name in _METHODS if not callable(getattr(listener, name, None))]
    if lacks or isinstance(listener, type):
        raise CommandError(
            f"invalid listener {quote(listener)}: an object with the methods {', '.join(_METHODS)} is needed"
        )


class Sampler:
    """A buffer that `advance` fills with rows, and the listeners that empty it, each at a rate of its own."""

    def __init__(self, columns: int, timestep: float) -> None:
        self.table = np.array([0, 0, 0], np.int64)
        self.buffer = np.zeros((0, columns))
        self._timestep = timestep
        self._strides: dict[int, tuple[Listener, int]] = {}  # by identity: a listener need not have a hash
        self._rows = 0

    @property
    def listeners(self) -> tuple[Listener, ...]:
        """Listeners that are attached."""
        return tuple(listener for listener, _ in self._strides.values())

    def add(self, listener: Listener, rate: float) -> None:
        """Sample `rate` rows per simulated second (at most one per step) for a listener."""
        self.drain()
        self._strides[id(listener)] = listener, stride_of(rate, self._timestep)
        self._begin()

    def resize(self, columns: int) -> None:
        """Hand the filled rows over, and take rows of another width from now on, at the same steps."""
        self.drain()
        self._take(columns)

    def remove(self, listener: Listener) -> None:
        """Give it what is left, and stop sampling when nobody listens."""
        self.drain()
        del self._strides[id(listener)]
        self._begin()

    def check_free(self, what: str) -> None:
        """Refuse what would make another run of the one that is recorded."""
        if self._strides:
            raise CommandError(
                f"{what} cannot be called while the run is recorded, since a recording holds one run: call it before "
                "the recording begins, or end the recording first"
            )

    def drain(self) -> None:
        """Hand the filled rows to the listeners, to each those that are due by its rate."""
        filled = int(self.table[FILLED])
        if not filled:
            return
        numbers = np.arange(self._rows, self._rows + filled) * self.table[STRIDE]
        self._rows += filled
        self.table[FILLED] = 0
        for listener, stride in tuple(self._strides.values()):
            due = self.buffer[:filled][numbers % stride == 0]
            if len(due):
                listener.rows(due)

    def _begin(self) -> None:
        """Sample at the finest common stride of those who listen now."""
        self._take(self.buffer.shape[1])
        self._rows = 0
        self.table[:] = (math.gcd(*(stride for _, stride in self._strides.values())), 0, 0)

    def _take(self, columns: int) -> None:
        """Make an empty buffer."""
        rows = max(64, _BUFFER_BYTES // (8 * columns)) if self._strides else 0
        self.buffer = np.zeros((rows, columns))
