"""What a world is made of: pieces of MJCF, each rendered once for its kind and placed under a name, joined at the end.

The saved MJCF joins whole pieces. Models that step leave out what is only seen, or all shapes. For each element that it
reads, MuJoCo goes over all that it has read before, so many pieces are read in groups.
"""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from itertools import groupby, takewhile
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
from markupsafe import Markup, escape

from vrx_mj.frames import Pose
from vrx_mj.mjcf.templates import block, render

__all__ = ["Detail", "Part", "Piece", "Pieces", "hull_file"]

PREFIX = "@prefix@/"
"""What names in a piece start with until it has a place in a world."""
MANY, GROUP = 100, 50
"""Of more parts than `MANY`, groups of so many are read."""
SLEEP_OPTIONS = ("enableflags", "sleep_tolerance")
"""What the first part that is asleep changes in the options."""
SENSOR_FIELDS = ("name", "type", "objtype", "objname", "reftype", "refname", "intprm", "datatype", "needstage", "dim")


class Detail(Enum):
    """How much of a world a model has."""

    WHOLE = "whole"
    """Everything, as the saved MJCF has it."""
    WITHOUT_VISUALS = "without visuals"
    """What can move or collide."""
    CONTACT_FREE = "contact-free"
    """What can move, without any shape."""


@dataclass(frozen=True)
class Piece:
    """One kind of thing as MJCF. Its names, but for those of shared meshes, start with `PREFIX`."""

    template: str
    values: Mapping[str, Any]
    files: Mapping[str, bytes]
    """Contents of the files that it names, by file name."""
    hulls: Mapping[str, bytes] = field(default_factory=dict)
    """Points that the MJCF holds as files: MuJoCo keeps the hulls of files from one world to the next."""
    _blocks: dict[tuple[str, Detail], str] = field(default_factory=dict, init=False, compare=False, repr=False)

    def block(self, name: str, detail: Detail = Detail.WHOLE) -> str:
        """One of its blocks: `assets`, `bodies`, `contacts` or `equalities`."""
        if (name, detail) not in self._blocks:
            self._blocks[name, detail] = block(self.template, name, {**self.values, **_flags(detail), "prefix": PREFIX})
        return self._blocks[name, detail]

    def document(self, name: str = "piece") -> str:
        """It alone, as a model called `name`, its names without a prefix."""
        return render(self.template, **self.values, **_flags(Detail.WHOLE), prefix="", model=name)


def _flags(detail: Detail) -> dict[str, bool]:
    return {"with_visuals": detail is Detail.WHOLE, "with_collisions": detail is not Detail.CONTACT_FREE}


@dataclass(frozen=True)
class Part:
    """A piece under its name in a world."""

    name: str
    piece: Piece
    frame: str = ""
    """Tag that opens the frame around its bodies; empty: they need none."""

    @staticmethod
    def placed(name: str, piece: Piece, pose: Pose) -> "Part":
        """A piece at a pose."""
        return Part(name, piece, render("frame.xml.j2", pose=pose))

    def block(self, name: str, detail: Detail = Detail.WHOLE, *, skipped: int = 0) -> str:
        """A block of its piece, with its own names, which lack the first `skipped` characters."""
        return self.piece.block(name, detail).replace(PREFIX, escape(f"{self.name}/"[skipped:]))

    def bodies(self, detail: Detail, skipped: int = 0) -> str:
        """Its bodies in their frame; names lack the first `skipped` characters."""
        text = self.block("bodies", detail, skipped=skipped)
        return f"\n    {self.frame}{text}\n    </frame>" if self.frame else text

    @cached_property
    def assets(self) -> Mapping[str, str]:
        """Its meshes, an element each, with what is left of each without visuals."""
        texts = (self.block("assets", detail).split("\n") for detail in (Detail.WHOLE, Detail.WITHOUT_VISUALS))
        return {whole.strip(): solid.strip() for whole, solid in zip(*texts, strict=True) if whole.strip()}

    @property
    def owner(self) -> str:
        """The boat, dock or object that it is a part of: itself, or the boat whose ball it is."""
        return self.name.partition("/")[0]

    @cached_property
    def is_prefixed(self) -> bool:
        """Whether the names of its bodies, joints and geoms start with its own name."""
        return self.name[0].isalnum() and f'<body name="{PREFIX}' in self.piece.block("bodies")


@dataclass(frozen=True)
class Pieces:
    """All pieces of a world, in the order of its MJCF."""

    own: Piece
    """What belongs to nothing in it: blocks `head`, `option`, `settings`, `assets`, `bodies` and `tail`."""
    parts: tuple[Part, ...]
    assets: tuple[str, ...]
    """Elements of the section of assets."""
    touches: Mapping[str, str]
    """Sensors of what the boat that a task scores touches, by rival."""

    @staticmethod
    def joined(own: Piece, parts: Iterable[Part], touches: Mapping[str, str]) -> "Pieces":
        """Pieces with the assets that they name, each once."""
        own_assets = (line.strip() for line in own.block("assets").splitlines() if line.strip())
        return Pieces(own, (), tuple(own_assets), touches).with_parts(parts)

    @property
    def files(self) -> dict[str, bytes]:
        """Contents of the files that are named, by file name."""
        return {file: content for part in self.parts for file, content in part.piece.files.items()}

    def with_parts(self, parts: Iterable[Part], *, asleep: bool = False) -> "Pieces":
        """With parts after all others; `asleep`: whether they sleep until they are moved."""
        own = replace(self.own, values={**self.own.values, "asleep": True}) if asleep else self.own
        new = tuple(parts)
        assets = dict.fromkeys(line for part in new for line in part.assets)
        return replace(self, own=own, parts=self.parts + new, assets=tuple(dict.fromkeys((*self.assets, *assets))))

    def without(self, owner: str) -> "Pieces":
        """Without a boat, its balls, and what only they use."""
        parts = tuple(part for part in self.parts if part.owner != owner)
        kept = {line for part in parts for line in part.assets}
        unused = {line for part in self.parts if part.owner == owner for line in part.assets} - kept
        return Pieces(
            self.own,
            parts,
            tuple(line for line in self.assets if line not in unused),
            {rival: sensor for rival, sensor in self.touches.items() if rival != owner},
        )

    def first_of_each_kind(self) -> "Pieces":
        """With one boat, dock and object of each kind: if MuJoCo takes these, it takes all, as their names differ."""
        groups: dict[str, list[Part]] = {part.name: [] for part in self.parts}
        for part in self.parts:
            groups[part.owner if part.owner in groups else part.name].append(part)
        kinds: dict[object, list[Part]] = {}
        for name, group in groups.items():
            kinds.setdefault(tuple((id(part.piece), part.name.removeprefix(name)) for part in group), group)
        parts = tuple(part for group in kinds.values() for part in group)
        names = {part.name for part in parts}
        touches = {rival: sensor for rival, sensor in self.touches.items() if rival in names}
        return replace(self, parts=parts, touches=touches)

    def text(self) -> str:
        """The MJCF."""
        return self._document(self.parts, Detail.WHOLE)

    def spec(self, detail: Detail = Detail.WHOLE) -> mujoco.MjSpec:
        """The MuJoCo spec.

        Raises:
            ValueError: MuJoCo refuses the MJCF.
        """
        first, *groups = self._groups()
        files = {} if detail is Detail.CONTACT_FREE else self.files
        if detail is Detail.WITHOUT_VISUALS:
            files |= {file: content for part in self.parts for file, content in part.piece.hulls.items()}
        spec = mujoco.MjSpec.from_string(self._document(first, detail), assets=files)
        spec.compiler.discardvisual = detail is not Detail.WHOLE
        for group in groups:
            self._attach(spec, group, detail)
        return spec

    def grown(self, spec: mujoco.MjSpec, before: "Pieces", detail: Detail) -> bool:
        """Whether a spec of the pieces of before was made that of these, by attaching to it the parts that came last.

        Raises:
            ValueError: MuJoCo refuses them; the spec cannot be used any more.
        """
        count = len(before.parts)
        new = self.parts[count:]
        plain = all(part.is_prefixed and not any(part.assets.values()) for part in new)
        if not plain or self.parts[:count] != before.parts or len({part.name[0] for part in new}) != 1:
            return False
        self._attach(spec, new, detail, with_contacts=True)
        touches = [self.touches[rival] for rival in self.touches if rival not in before.touches]
        for element in touches:
            read = mujoco.MjSpec.from_string(f"<mujoco><sensor>{element}</sensor></mujoco>").sensors[0]
            spec.add_sensor(**{name: getattr(read, name) for name in SENSOR_FIELDS})
        return True

    def spec_of(self, name: str) -> mujoco.MjSpec:
        """The spec of one part alone, with all that is seen of it."""
        part = next(part for part in self.parts if part.name == name)
        assets = [line for line in self.assets if line in set(part.assets)]
        text = _joined(head=self._head(), assets=assets, bodies=[part.bodies(Detail.WHOLE)], tail="\n</mujoco>")
        return mujoco.MjSpec.from_string(text, assets=dict(part.piece.files))

    def _head(self) -> str:
        return "".join(self.own.block(name) for name in ("head", "option", "settings"))

    def _document(self, parts: Sequence[Part], detail: Detail) -> str:
        """An MJCF of all but the bodies of other parts than these."""
        return _joined(
            head=self._head(),
            assets=self.assets if detail is Detail.WHOLE else self._solid_assets(detail),
            bodies=[self.own.block("bodies", detail), *(part.bodies(detail) for part in parts)],
            contacts=[part.block("contacts") for part in self.parts],
            equalities=[part.block("equalities") for part in self.parts],
            sensors=self.touches.values(),
            tail=self.own.block("tail"),
        )

    def _solid_assets(self, detail: Detail) -> list[str]:
        """The assets that are left without visuals, in the order of them all."""
        left: dict[str, str] = {}
        for part in self.parts if detail is Detail.WITHOUT_VISUALS else ():
            left |= part.assets
        return [left[line] for line in self.assets if left.get(line)]

    def _groups(self) -> list[Sequence[Part]]:
        """The parts that are read together; but for the first ones, names of a group have one first letter."""
        fixed = list(takewhile(lambda part: not part.is_prefixed, self.parts))
        others = self.parts[len(fixed) :]
        runs = [list(run) for _, run in groupby(others, key=lambda part: part.name[0])]
        groups = [run[start : start + GROUP] for run in runs for start in range(0, len(run), GROUP)]
        many = len(self.parts) > max(MANY, 10 * len(groups))
        return [fixed, *groups] if many and all(part.is_prefixed for part in others) else [self.parts]

    def _attach(
        self, spec: mujoco.MjSpec, group: Sequence[Part], detail: Detail, *, with_contacts: bool = False
    ) -> None:
        """Attach parts, with what is asleep among them; MuJoCo wants a prefix, the first letter of all their names."""
        bodies = "".join(part.bodies(detail, 1) for part in group)
        contacts = "".join(part.block("contacts", skipped=1) for part in group) if with_contacts else ""
        inside = f"<worldbody><frame>{bodies}</frame></worldbody><contact>{contacts}</contact>"
        child = mujoco.MjSpec.from_string(f"{self._head()}{inside}</mujoco>")
        for option in SLEEP_OPTIONS:
            setattr(spec.option, option, getattr(child.option, option))
        shared = [(geom, geom.meshname) for geom in child.geoms if geom.meshname]
        spec.worldbody.attach_frame(child.worldbody.first_frame(), group[0].name[0], "")
        for geom, mesh in shared:
            geom.meshname = mesh


def hull_file(points: npt.ArrayLike) -> tuple[str, bytes]:
    """Name and content of a file with points (n, 3) [m], in MuJoCo's format MSH, without normals, texture and faces.

    Its numbers are those that MuJoCo has of points in the MJCF: floats of 32 bits.
    """
    array = np.asarray(points, np.float64).reshape(-1, 3).astype(np.float32)
    content = np.array([len(array), 0, 0, 0], np.int32).tobytes() + array.tobytes()
    return f"points_{hashlib.sha256(content).hexdigest()[:16]}.msh", content


def _joined(
    *,
    head: str,
    assets: Iterable[str],
    bodies: Iterable[str],
    tail: str,
    contacts: Iterable[str] = (),
    equalities: Iterable[str] = (),
    sensors: Iterable[str] = (),
) -> str:
    lines = [f"\n    {line}" for line in assets]
    sections = {
        "assets": lines, "bodies": bodies, "contacts": contacts, "equalities": equalities, "sensors": sensors,
    }  # fmt: skip
    texts = {"head": head, "tail": tail} | {name: "".join(elements) for name, elements in sections.items()}
    return render("joined.xml.j2", **{name: Markup(text) for name, text in texts.items()})
