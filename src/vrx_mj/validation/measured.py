"""A case with a user's own measurements, beside those of the report."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from vrx_mj.config.loading import referenced_file
from vrx_mj.config.measured import SIGNALS, MeasuredCaseConfig, Measurements, read_case, read_measurements
from vrx_mj.draw.chart import Chart, Series
from vrx_mj.errors import UnknownNameError, VrxError
from vrx_mj.mjcf.compile import compile_world
from vrx_mj.runtime.observation import BoatObservation
from vrx_mj.runtime.simulation import Simulation
from vrx_mj.validation.rows import EVIDENCE, Band, Case, Comparison, Outcome

_READERS: dict[str, Callable[[BoatObservation], float]] = {
    "x": lambda seen: float(seen.position[0]),
    "y": lambda seen: float(seen.position[1]),
    "z": lambda seen: float(seen.position[2]),
    "roll_deg": lambda seen: math.degrees(seen.roll),
    "pitch_deg": lambda seen: math.degrees(seen.pitch),
    "heading_deg": lambda seen: math.degrees(seen.heading),
    "surge": lambda seen: float(seen.velocity[0]),
    "sway": lambda seen: float(seen.velocity[1]),
    "heave_speed": lambda seen: float(seen.velocity[2]),
    "roll_rate_deg": lambda seen: math.degrees(seen.angular_velocity[0]),
    "pitch_rate_deg": lambda seen: math.degrees(seen.angular_velocity[1]),
    "yaw_rate_deg": lambda seen: math.degrees(seen.angular_velocity[2]),
    "speed": lambda seen: seen.speed,
}
"""How a signal is read off a boat."""
_ANGLES = ("roll_deg", "pitch_deg", "heading_deg")
"""Signals that are the same after a full turn."""


def measured_case(case: Path, data: Path) -> Case:
    """The case of a YAML file and of the CSV with its measurements.

    Raises:
        VrxError: a file is wrong, or the world does not fit it.
    """
    config = read_case(case)
    measured = read_measurements(data, tuple(config.signals))
    fleet = None if config.fleet is None else referenced_file("fleets", config.fleet, config.folder)
    world = compile_world(referenced_file("worlds", config.world, config.folder), fleet=fleet)
    sim = Simulation(world)
    boat = _boat_of(sim, config)
    _check_commands(sim, boat, config)
    return Case(
        name=case.stem,
        title=config.title or case.stem,
        setup=f"World {config.world}{f', fleet {config.fleet}' if config.fleet else ''}, boat {boat}, as {case.name} "
        f"has it; {len(measured.times)} samples of {data.name}, up to {measured.times[-1]:g} s. Our values are those "
        "of the physics step nearest to each.",
        source=config.source,
        files=(),
        run=lambda: _comparisons(_signals_at(sim, boat, config, measured), config, measured),
    )


def _boat_of(sim: Simulation, config: MeasuredCaseConfig) -> str:
    if config.boat is None and len(sim.boats) != 1:
        raise VrxError(f"world {config.world} has {len(sim.boats)} boats: `boat` is needed")
    boat = sim.boats[0] if config.boat is None else config.boat
    if boat not in sim.boats:
        raise UnknownNameError("boat", boat, sim.boats)
    return boat


def _check_commands(sim: Simulation, boat: str, config: MeasuredCaseConfig) -> None:
    known = sim.command_names(boat)
    for row in config.commands:
        for name in row.thrusters:
            if name not in known:
                raise UnknownNameError(f"command of boat '{boat}'", name, known)


def _signals_at(
    sim: Simulation, boat: str, config: MeasuredCaseConfig, measured: Measurements
) -> dict[str, list[float]]:
    """Our values of the signals at the times of the measurements."""
    sim.reset(seed=config.seed)
    if config.pose is not None or config.velocity is not None:
        sim.set_boat(boat, pose=config.pose, velocity=config.velocity)
    step = sim.timestep
    commands = {round(row.time / step): row.thrusters for row in config.commands}
    samples = [round(time / step) for time in measured.times]
    found: dict[str, list[float]] = {name: [] for name in config.signals}
    now, current = 0, commands.get(0, {})
    for sample in samples:
        for stop in sorted({at for at in commands if now < at <= sample} | {sample}):
            if stop > now:
                sim.step({boat: current}, duration=(stop - now) * step)
            now, current = stop, commands.get(stop, current)
        seen = sim.observe()[boat]
        for name, signal in config.signals.items():
            found[name].append(_READERS[signal.of or name](seen))
    return found


def _comparisons(ours: dict[str, list[float]], config: MeasuredCaseConfig, measured: Measurements) -> Outcome:
    for name, signal in config.signals.items():
        of = signal.of or name
        theirs, own = np.array(measured.signals[name]), np.array(ours[name])
        apart = own - theirs
        if of in _ANGLES:
            apart = np.array([math.remainder(each, 360.0) for each in apart])
            own = theirs + apart
        known = np.isfinite(theirs)
        greatest = np.abs(apart[known]).max() if known.any() else math.nan
        band = Band(EVIDENCE[0], f"0 to {signal.band:g}")
        yield Comparison(f"{name}: greatest difference", SIGNALS[of], None, greatest, band=band)
        series = Series("measured", measured.times, theirs, reference=True), Series("ours", measured.times, own)
        yield Chart(name, "time [s]", f"{of} [{SIGNALS[of]}]", series)
