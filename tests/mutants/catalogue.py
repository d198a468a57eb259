"""The list of mutants: reads `mutants.yaml`, and makes one line of the source wrong."""

from dataclasses import dataclass
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[2]
LIST = Path(__file__).with_name("mutants.yaml")
KINDS = ("sign", "constant", "comparison", "dropped term", "swapped axes", "removed guard", "wrong value")


@dataclass(frozen=True)
class Mutant:
    """A mistake that a careful reviewer would call a bug."""

    id: str
    file: str
    """Below `src/vrx_mj`."""
    kind: str
    old: str
    """Occurs once in the file."""
    new: str

    @property
    def source(self) -> str:
        """The file's path in the repository."""
        return f"src/vrx_mj/{self.file}"

    @property
    def package(self) -> str:
        """The package that it counts for, or the module of none: `physics`, `ros`, `frames`."""
        return self.file.split("/")[0].removesuffix(".py")

    def mutated_source(self, text: str) -> str:
        """The source with the mistake; ValueError where the old text does not occur exactly once."""
        count = text.count(self.old)
        if count != 1:
            raise ValueError(f"{self.id}: {self.old!r} occurs {count} times in {self.source}")
        return text.replace(self.old, self.new)


def mutants() -> list[Mutant]:
    """All mutants, in the order of the file, where a source may stand more than once."""
    files = yaml.compose(LIST.read_text(encoding="utf-8")).value
    items = [(file.value, item.value) for file, listed in files for item in listed.value]
    return [Mutant(file=file, **{key.value: text.value for key, text in item}) for file, item in items]
