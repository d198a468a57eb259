"""What boats' instruments write at the present moment of a run, and what their AIS receivers hear."""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial

from vrx_mj.model.boats import AisClass
from vrx_mj.nmea.ais import FIRST, LEAST_OF_A, PERIOD, Transponder, mmsi_of, size_of
from vrx_mj.nmea.sentences import HEADINGS, KINDS, Sentence
from vrx_mj.runtime.battery import Charge
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.runtime.timing import Schedule
from vrx_mj.sensors.readings import Reading

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
        """What a boat's instruments write at this moment; UnknownNameError if no boat has that name."""
        time = self._update_time()
        if self._written.get(boat, (-1.0, ()))[0] != time:
            self._written[boat] = time, [*self._write(boat, time)]
        return self._written[boat][1]

    def reports(self, boat: str) -> Sequence[Sentence]:
        """What all other vessels report by AIS at this moment, in a world with a georeference."""
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
        """What the transponders of all boats send, each with its boat."""
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
