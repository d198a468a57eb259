"""What a kind of input is: where its mutated files come from, and how they are tried."""

import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

Files = Mapping[str, bytes]
"""Contents by relative path; the first is the one that was mutated. A refusal is to name one of them."""


@dataclass(frozen=True)
class Kind:
    """A kind of input that we read."""

    name: str
    mutated: Callable[[random.Random], Files]
    """Draws a seed and changes it; all that is random comes from the argument."""
    tried: Callable[[Path], None]
    """Uses the files of a folder, which is the current one, as users do; it may write to its subfolder `out`."""
    warm: Callable[[], object] = lambda: None
    """Makes what the inputs have in common, once, before the workers begin."""
    names_its_file: bool = True
    """Whether a refusal names a file."""
    calls: bool = False
    """Whether it connects to a socket."""


def chance_of(kind: str, seed: int, number: int) -> random.Random:
    """All chance of one input."""
    return random.Random(f"{kind} {seed} {number}")


def write(files: Files, folder: Path) -> None:
    """Write an input's files to a folder."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
