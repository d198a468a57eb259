"""A case of `vrx-mj validate` with data that a user has measured: which world, which boat, what it did, and bands."""

import contextlib
import csv
import io
import itertools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar, NamedTuple

from pydantic import Field

from vrx_mj.config.base import Config, Faults, InFolder, column_faults
from vrx_mj.config.dynamics import Row
from vrx_mj.config.kinds import wrong_kind
from vrx_mj.config.loading import Loading, read_file, validate
from vrx_mj.config.search import ReadingError, display, read_limited
from vrx_mj.config.tree import choice, literal
from vrx_mj.config.values import MAX_NUMBER, NonNegative, Number, Pose, Positive
from vrx_mj.errors import ConfigError, VrxError, shorten
from vrx_mj.model.kinds import Seed

SIGNALS: dict[str, str] = {
    "x": "m", "y": "m", "z": "m", "roll_deg": "deg", "pitch_deg": "deg", "heading_deg": "deg", "surge": "m/s",
    "sway": "m/s", "heave_speed": "m/s", "roll_rate_deg": "deg/s", "pitch_rate_deg": "deg/s", "yaw_rate_deg": "deg/s",
    "speed": "m/s",
}  # fmt: skip
"""Signals of a boat, and their units."""
MOST_BYTES, MOST_ROWS = 20_000_000, 200_000
"""Bytes and rows of a file of measurements, at most."""
_MAX_TIME = 36_000.0
"""Latest time [s]."""


class CommandsConfig(Config):
    """Commands of a boat from a time until the next entry."""

    time: NonNegative
    """Time from which these commands apply [s]."""
    thrusters: dict[str, Number]
    """Command of each thruster, such as `{left: 0.5, right: 0.5, left_angle: 0.1}`; those not listed are 0."""


class SignalConfig(Config):
    """A column of the measurements."""

    of: str | None = None
    """Signal of the boat to which the column corresponds; by default the one with the column's name."""
    band: Positive
    """Largest difference that counts as inside, in the signal's unit."""


class MeasuredCaseConfig(InFolder):
    """A case with a user's own measurements."""

    folder_keys: ClassVar = {"folder": "world"}
    title: str = ""
    """Heading of the case; by default the name of the file."""
    source: str
    """Origin of the measurements: tank or lake, boat, instruments, date."""
    world: str
    """World: a name, or a path relative to this file."""
    fleet: str | None = None
    """Fleet: a name, or a path relative to this file; by default the world's own boat."""
    boat: str | None = None
    """Boat that was measured; by default the only one."""
    pose: Pose | None = None
    """Pose of the boat at time 0 [m, rad]; by default that of the world."""
    velocity: Row | None = None
    """Velocity of the boat at time 0, u v w p q r [m/s, rad/s]; by default at rest."""
    seed: Seed = 0
    """Seed of the run."""
    commands: tuple[CommandsConfig, ...] = Field(default=(), max_length=10_000)
    """Commands over time; by default none."""
    signals: dict[str, SignalConfig] = Field(min_length=1, max_length=100)
    """Columns of the measurements by their names, each with its band."""

    def _faults(self) -> Faults:
        for name, signal in self.signals.items():
            if (signal.of or name) not in SIGNALS:
                yield ("signals", name, "of"), choice(signal.of or name, tuple(SIGNALS))
        yield from column_faults("commands", [each.time for each in self.commands], "a time", " s")


def read_case(path: Path) -> MeasuredCaseConfig:
    """The case in a YAML file.

    Raises:
        ConfigError: it is not one; the error lists every problem with its place.
    """
    if other := wrong_kind(path, "a case"):
        raise ConfigError.of(display(path), other)
    return validate(MeasuredCaseConfig, read_file("cases", path), Loading())


class Measurements(NamedTuple):
    """Columns of a CSV file."""

    times: tuple[float, ...]
    """Rising times [s]."""
    signals: dict[str, tuple[float, ...]]
    """Columns by name; values that were left out are not numbers."""


def read_measurements(path: Path, wanted: tuple[str, ...]) -> Measurements:
    """The columns `time` and those that are wanted of a CSV file, whose first line has their names.

    Raises:
        VrxError: it cannot be read, lacks a column, or a value is not a number.
    """
    name = display(path)
    try:
        lines = io.TextIOWrapper(io.BytesIO(read_limited(path, MOST_BYTES)), encoding="utf-8-sig")  # any line ends
        reader = csv.DictReader(lines, restval="")
        columns = _columns(name, reader, ("time", *wanted))
        values = list(itertools.islice(_rows(name, reader, columns), MOST_ROWS + 1))
    except (ReadingError, UnicodeDecodeError, csv.Error) as error:
        raise VrxError(f"{name}: {'not UTF-8' if isinstance(error, UnicodeDecodeError) else error}") from None
    if isinstance(lines.newlines, tuple) and "\r" in lines.newlines:
        raise VrxError(f"{name}: a carriage return inside a line; use one kind of line ending")
    if not 2 <= len(values) <= MOST_ROWS:
        raise VrxError(f"{name}: 2 to {MOST_ROWS:,} rows are needed, got {'more' if values[2:] else len(values)}")
    times, *signals = zip(*values, strict=True)
    if not (times[0] >= 0.0 and times[-1] <= _MAX_TIME):
        raise VrxError(f"{name}: times from 0 to {_MAX_TIME:g} s are needed, got {times[0]:g} to {times[-1]:g}")
    return Measurements(times, dict(zip(wanted, signals, strict=True)))


def _columns(name: str, reader: "csv.DictReader[str]", wanted: tuple[str, ...]) -> tuple[str, ...]:
    """The columns that are wanted, by the names that the reader has now, without blanks around them."""
    reader.fieldnames = [column.strip() for column in reader.fieldnames or ()]
    for column in wanted:
        if column not in reader.fieldnames:
            listed = shorten(", ".join(reader.fieldnames[:100]) or "none", 1000)
            raise VrxError(f"{name}: no column '{column}' in its first line; it has {listed}")
    return wanted


def _rows(name: str, reader: "csv.DictReader[str]", columns: tuple[str, ...]) -> Iterator[tuple[float, ...]]:
    """The values of the columns, the time first, of every row that is not blank."""
    before = -math.inf
    for row in reader:
        if any(str(word).strip() for word in row.values()):
            place = f"{name}, line {reader.line_num}"
            values = tuple(_value(place, column, row[column]) for column in columns)
            if not values[0] > before:
                raise VrxError(f"{place}: a time above {before:g} s, that of the previous row, is needed")
            before = values[0]
            yield values


def _value(place: str, column: str, word: str) -> float:
    """A value of a row; an empty one of a signal is not a number."""
    if not word.strip() and column != "time":
        return math.nan
    with contextlib.suppress(ValueError):
        if abs(value := float(word)) < MAX_NUMBER:
            return value
    raise VrxError(f"{place}: {column} needs a number, got {literal(word.strip())}")
