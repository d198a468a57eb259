"""What a campaign is to sail: every controller in every world with every seed."""

import fnmatch
import glob
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cache
from hashlib import sha256
from itertools import product
from pathlib import Path
from typing import Literal

from vrx_mj.arguments import Names
from vrx_mj.campaign.vary import Quantity
from vrx_mj.config.search import catalogue, find, is_path
from vrx_mj.errors import CommandError

State = Literal["not started", "cut", "finished", "failed", "lost"]
"""How a trial ended: before its task started, while it ran, after it; by an error of the controller, or of the machine.

A failed or lost trial has no score, one whose task has not started neither; a lost one says nothing of its controller.
"""
_MOST_SEEDS = 100_000
_GLOB = re.compile(r"[*?\[]")
_READABLE_NAMES = (
    re.compile(r"[a-z0-9_][a-z0-9_-]*(/[a-z0-9_][a-z0-9_-]*)*"),
    re.compile(r"\w+(\.\w+)*:\w+", re.ASCII),
)
"""Names of worlds and of controllers that stay readable, and apart, with a dot for every slash and colon."""
_SERIES_SEPARATOR = "#"
"""Between the path of a series of worlds and the number of one of them."""


@dataclass(frozen=True, order=True)
class Cell:
    """One trial of a campaign."""

    controller: str
    """Controller, such as `my_boat:controller`, or the line that starts a program."""
    world: str
    """Name, or path of a file."""
    seed: int

    @property
    def folder(self) -> str:
        """Folder of the cell in that of the campaign, with slashes; no two cells have the same."""
        return f"cells/{folder_name(self.controller)}/{folder_name(self.world)}/seed_{self.seed}"

    def __str__(self) -> str:
        return f"{self.controller} in {self.world}, seed {self.seed}"


@dataclass(frozen=True)
class Serving:
    """How a world is served to a program that sails it."""

    rate: float | None = 1.0
    """Simulated seconds per second; None: as fast as it can."""
    lockstep: Names | None = None
    """Topics that time waits for; None: it waits for nobody."""
    rosbridge: bool = False
    """Whether there is one beside the ROS master."""
    ardupilot: bool = False
    """Whether it is served to ArduPilot's SITL in place of ROS."""


@dataclass(frozen=True, kw_only=True)
class _TrialOptions:
    """How each trial of a campaign is sailed."""

    fleet: str | None = None
    """Fleet instead of the world's own; None: the world's own."""
    duration: float | None = None
    """Simulated time [s]; None: until the task is over."""
    timeout: float | None = None
    """Wall time from the loading of the controller on [s]; None: as long as it simulates, and a minute."""
    record: bool = False
    """Whether it is recorded."""
    serving: Serving | None = None
    """How the world is served, where the controller is a program."""


@dataclass(frozen=True)
class Trial(_TrialOptions):
    """A cell and how to sail it."""

    cell: Cell
    rows: bool = False
    """Whether its controller takes rows, so that trials may be sailed together."""
    parameters: Mapping[str, float] = field(default_factory=dict)
    """Values of the quantities that are drawn, as `vary.numbers_by_name` takes them."""


@dataclass(frozen=True)
class Plan(_TrialOptions):
    """All cells, and how each of them is sailed."""

    controllers: Names
    worlds: Names
    seeds: tuple[int, ...]
    vary: tuple[Quantity, ...] = ()
    """Quantities that are drawn for each trial."""

    def trial(self, cell: Cell) -> Trial:
        """The trial of a cell."""
        options = {option.name: getattr(self, option.name) for option in fields(_TrialOptions)}
        drawn = {quantity.name: quantity.value(cell.seed) for quantity in self.vary}
        return Trial(cell, parameters=drawn, **options)

    @property
    def cells(self) -> tuple[Cell, ...]:
        """Every cell, world by world."""
        return tuple(
            Cell(controller, world, seed)
            for world, seed, controller in product(self.worlds, self.seeds, self.controllers)
        )


def parse_seeds(text: str) -> tuple[int, ...]:
    """Seeds from `5`, `0,3,7`, `0..9`, or a mixture of them; each once, in their order.

    Raises:
        CommandError: it is not of that form.
    """
    seeds: dict[int, None] = {}
    for part in text.split(","):
        found = re.fullmatch(r"\s*(\d{1,9})\s*(?:\.\.\s*(\d{1,9})\s*)?", part)
        if found is None:
            raise CommandError(
                f"--seeds '{text}': '{part}' is not a seed: whole numbers from 0 are needed, as in 0..9 or 0,3,7"
            )
        first, last = int(found[1]), int(found[2] or found[1])
        if last < first:
            raise CommandError(f"--seeds '{text}': the range {first}..{last} is empty; write the smaller number first")
        if last - first >= _MOST_SEEDS:
            raise CommandError(f"--seeds '{text}': {last - first + 1} seeds; at most {_MOST_SEEDS} are allowed")
        seeds |= dict.fromkeys(range(first, last + 1))
    return tuple(seeds)


def choose_worlds(patterns: Iterable[str]) -> Names:
    """The worlds that names, paths and patterns mean, each once.

    In a name `*` stands for any characters, slashes too; in a path, which ends like one, for those of a file or folder.

    Raises:
        CommandError: a pattern matches no world, or a file is not there.
        UnknownNameError: no world has that name.
    """
    chosen: dict[str, None] = {}
    for pattern in patterns:
        chosen |= dict.fromkeys(_worlds(pattern.strip()))
    return tuple(chosen)


def _worlds(pattern: str) -> Sequence[str]:
    source, mark, number = pattern.partition(_SERIES_SEPARATOR)
    if is_path(source):
        files = [source] if Path(source).is_file() else sorted(glob.glob(source, recursive=True))  # noqa: PTH207 - absolute ones too
        if not files:
            raise CommandError(f"--worlds '{pattern}': no file '{source}'")
        return [f"{file}{mark}{number}" for file in files]
    known = catalogue("worlds")
    if not _GLOB.search(pattern):
        if source not in known:
            find("worlds", source)
        return [pattern]
    found = [name for name in known if fnmatch.fnmatchcase(name, pattern)]
    if not found:
        folders = sorted({f"{name.partition('/')[0]}/*" for name in known if "/" in name})
        hint = f"; folders of worlds: {', '.join(folders)}" if folders else ""
        raise CommandError(f"--worlds '{pattern}' matches none of {len(known)} worlds{hint}")
    return found


@cache
def folder_name(name: str) -> str:
    """A name as that of one folder, on any system: `vrx2022/gymkhana` becomes `vrx2022.gymkhana`.

    A name of a world with other characters than small letters, digits, `-`, `_` and slashes, and any that is long, gets
    a hash at its end.
    """
    if len(name) <= 80 and any(form.fullmatch(name) for form in _READABLE_NAMES):
        return re.sub(r"[/:]", ".", name)
    plain = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")
    return f"{plain[-60:]}-{sha256(name.encode()).hexdigest()[:8]}"
