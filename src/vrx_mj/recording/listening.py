"""From a simulation's sensors to a recording: which there are, how they stand on their boats, who takes readings."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from vrx_mj.mjcf.world import World
from vrx_mj.recording.choice import Choice
from vrx_mj.recording.scene import RecordedSensor
from vrx_mj.recording.writer import RecordWriter
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.sensors.readings import Reading

__all__ = ["recorded_sensors", "sensor_rates", "taker"]


def sensor_rates(sim: Simulation) -> dict[str, dict[str, float]]:
    """By boat, its sensors and how often they measure [1/s]."""
    rates: dict[str, dict[str, float]] = {boat: {} for boat in sim.boats}
    for row in sim.world.tree["sensors"]:
        rates[row["boat"]][row["config"]["name"]] = float(row["config"]["rate"])
    return rates


def recorded_sensors(world: World, choices: Sequence[Choice]) -> Iterator[RecordedSensor]:
    """The chosen sensors; a receiver of sound that measures at the boat's `base_link` is drawn there."""
    rows = {(row["boat"], row["config"]["name"]): row for row in world.tree["sensors"]}
    at_base = world.tree["at_base_link"]
    for choice in choices:
        row = rows[choice.boat, choice.sensor]
        config = row["config"]
        moved = config["type"] == "pinger" and "pinger" in at_base
        yield RecordedSensor(
            boat=choice.boat,
            name=choice.sensor,
            type=config["type"],
            frame=row["frame"],
            rate=choice.rate,
            position=(0.0, 0.0, 0.0) if moved else tuple(row["position"]),
            rotation=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)) if moved else row["rotation"],
            config=config,
        )


def taker(writer: RecordWriter, boat: str) -> Callable[[Reading], None]:
    """What records a boat's readings, and a ball shooter's shots as events."""
    left: dict[str, int] = {}

    def take(reading: Reading) -> None:
        writer.reading(boat, reading)
        if reading.type == "ball_shooter":
            shots = reading.data.shots_left
            if shots < left.get(reading.name, shots):
                writer.event(reading.time, f"{boat} {reading.name}: a shot, {shots} left")
            left[reading.name] = shots

    return take
