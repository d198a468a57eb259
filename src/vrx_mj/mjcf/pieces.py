"""What a world is made of: pieces of MJCF, each rendered once for its kind and placed under a name, joined at the end.

The saved MJCF joins whole pieces. Models that step leave out what is only seen, or all shapes. For each element that it
reads, MuJoCo goes over all that it has read before, so many pieces are read in groups.

The pieces of a world that was loaded are read from its MJCF. Its parameters list the names by which a piece is known,
and the text of a piece is what the file holds, so the MJCF that joins the pieces again is the same.
"""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from itertools import groupby, takewhile
from typing import Any
from xml.parsers import expat

import mujoco
import numpy as np
import numpy.typing as npt
from markupsafe import Markup, escape

from vrx_mj.frames import Pose
from vrx_mj.mjcf.templates import block, render
from vrx_mj.model.world import Parameters

PREFIX = "@prefix@/"
"""What names in a piece start with until it has a place in a world."""
MANY, _GROUP = 100, 50
"""Of more parts than `MANY`, groups of so many are read."""
_SLEEP_OPTIONS = ("enableflags", "sleep_tolerance")
"""What the first part that is asleep changes in the options."""
_SENSOR_FIELDS = ("name", "type", "objtype", "objname", "reftype", "refname", "intprm", "datatype", "needstage", "dim")


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
        """Without a boat and its balls, an object with its parts, or a dock, and without what only they use."""
        parts = tuple(part for part in self.parts if part.owner != owner)
        kept = {line for part in parts for line in part.assets}
        unused = {line for part in self.parts if part.owner == owner for line in part.assets} - kept
        return Pieces(
            self.own,
            parts,
            tuple(line for line in self.assets if line not in unused),
            {rival: sensor for rival, sensor in self.touches.items() if rival.partition("/")[0] != owner},
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
        plain = all(
            part.is_prefixed and not any(part.assets.values()) and not part.block("equalities").strip() for part in new
        )
        if not plain or self.parts[:count] != before.parts or len({part.name[0] for part in new}) != 1:
            return False
        self._attach(spec, new, detail, with_contacts=True)
        touches = [self.touches[rival] for rival in self.touches if rival not in before.touches]
        for element in touches:
            read = mujoco.MjSpec.from_string(f"<mujoco><sensor>{element}</sensor></mujoco>").sensors[0]
            spec.add_sensor(**{name: getattr(read, name) for name in _SENSOR_FIELDS})
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
        groups = [run[start : start + _GROUP] for run in runs for start in range(0, len(run), _GROUP)]
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
        for option in _SLEEP_OPTIONS:
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


_JOINED = ("asset", "worldbody", "contact", "equality", "sensor")
"""Sections that join elements of pieces."""


@dataclass
class _Element:
    """An element of a section, with what is in it."""

    tag: str
    attributes: Mapping[str, str]
    start: int
    """Where it starts in the text [bytes]."""
    end: int = 0
    bodies: list[str] = field(default_factory=list)
    meshes: dict[str, bool] = field(default_factory=dict)
    """Names of meshes, and whether one of their shapes can collide."""
    visuals: list[tuple[int, int]] = field(default_factory=list)
    """Where cameras and shapes that cannot collide are."""
    shapes: list[tuple[int, int]] = field(default_factory=list)
    """Where the other shapes are."""


class _Text:
    """An MJCF cut into the elements of its sections."""

    def __init__(self, mjcf: str) -> None:
        self.sections: list[tuple[_Element, list[_Element]]] = []
        self._text, self._depth, self._open = mjcf.encode(), 0, list[_Element]()
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler, self._parser.EndElementHandler = self._start, self._end
        self._parser.Parse(self._text, True)

    def cut(self, start: int, end: int, without: Iterable[tuple[int, int]] = ()) -> str:
        """The text between two places, without some spans."""
        parts = []
        for first, last in sorted(without):
            parts.append(self._text[start:first])
            start = last
        return b"".join((*parts, self._text[start:end])).decode()

    def elements(self, *sections: str) -> list[_Element]:
        """All elements of sections, in their order."""
        return [element for section, inside in self.sections if section.tag in sections for element in inside]

    def line(self, element: _Element) -> str:
        """An element on a line of its own."""
        return f"\n    {self.cut(element.start, element.end)}"

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        element = _Element(tag, attributes, self._parser.CurrentByteIndex)
        self._open.append(element)
        if len(self._open) == 2:
            self.sections.append((element, []))
        elif len(self._open) == 3:
            self.sections[-1][1].append(element)
        if len(self._open) > 2 and tag == "body" and (name := attributes.get("name")):
            self._open[2].bodies.append(name)

    def _end(self, tag: str) -> None:
        element = self._open.pop()
        element.end = self._text.index(b">", element.start) + 1
        if self._text[element.end - 2 : element.end] != b"/>":
            element.end = self._text.index(b">", self._parser.CurrentByteIndex) + 1
        if len(self._open) > 1 and tag in ("camera", "geom"):
            (*_, whole) = [*self._open, element][:3]
            values = element.attributes
            solid = tag == "geom" and not values.get("contype") == values.get("conaffinity") == "0"
            (whole.shapes if solid else whole.visuals).append((element.start, element.end))
            if mesh := values.get("mesh"):
                whole.meshes[mesh] = solid or whole.meshes.get(mesh, False)


def pieces_of(mjcf: str, files: Mapping[str, bytes], world: Parameters) -> Pieces:
    """The pieces of a world's MJCF, whose form was checked; `world` are its parameters."""
    text = _Text(mjcf)
    meshes = {element.attributes.get("name", ""): element for element in text.elements("asset")}
    names = {hull.body: boat.name for hull, boat in zip(world.hulls, world.boats, strict=True)}
    names |= {item.body: item.name for item in world.objects}
    placed = [item for item in text.elements("worldbody") if item.tag in ("frame", "body")]
    parts = [_part(text, item, names, meshes, files) for item in placed]
    touches = {item.attributes["name"].partition("/")[2]: text.line(item) for item in text.elements("sensor")}
    assets = tuple(text.line(item).strip() for item in text.elements("asset"))
    return Pieces(_own(text, placed, world), tuple(parts), assets, touches)


def _own(text: _Text, placed: list[_Element], world: Parameters) -> Piece:
    """What belongs to nothing that was placed."""
    sections = [section for section, _ in text.sections]
    at = next(index for index, section in enumerate(sections) if section.tag == "option")
    last = max(index for index, section in enumerate(sections) if section.tag in _JOINED)
    option = sections[at]
    before = len(text.cut(0, option.start).rstrip().encode())
    own = [item for item in text.elements("worldbody") if item not in placed]
    settings = [text.cut(one.start, one.end) for one in sections[at + 1 : last] if one.tag not in _JOINED]
    values = {
        "head": text.cut(0, before),
        "option": text.cut(before, option.end),
        "settings": "".join(f"\n  {section}" for section in settings),
        "whole": "".join(map(text.line, own)),
        "without_visuals": "".join(text.cut(item.start, item.end, item.visuals) for item in own),
        "contact_free": "".join(text.cut(item.start, item.end, [*item.visuals, *item.shapes]) for item in own),
        "tail": text.cut(sections[last].end, -1) + "\n",
    }
    marked = {name: Markup(value) for name, value in values.items()}
    options = {"asleep": False, "timestep": world.timestep, "gravity": world.gravity}
    return Piece("saved.xml.j2", marked | options, {})


def _part(
    text: _Text,
    item: _Element,
    names: Mapping[str, str],
    meshes: Mapping[str, _Element],
    files: Mapping[str, bytes],
) -> Part:
    """Something that was placed."""
    root = item.bodies[0] if item.bodies else "terrain/"
    name = names.get(root, root.partition("/")[0])
    start, end = _inside(text, item)
    used = [meshes[mesh] for mesh in item.meshes if mesh in meshes]
    hulls = {
        mesh: hull_file([float(number) for number in points.split()])
        for mesh in item.meshes
        if mesh in meshes and (points := meshes[mesh].attributes.get("vertex"))
    }
    bodies = set(item.bodies)

    def joined(section: str) -> str:
        return "".join(text.line(one) for one in text.elements(section) if one.attributes.get("body1") in bodies)

    lead = "" if item.tag == "frame" else "\n    "
    values = {
        "assets": "".join(map(text.line, used)),
        "solid_assets": "".join(
            _solid_line(text, meshes[mesh], hulls.get(mesh)) if solid else "\n" for mesh, solid in item.meshes.items()
        ),
        "whole": lead + text.cut(start, end),
        "without_visuals": lead + text.cut(start, end, item.visuals),
        "contact_free": lead + text.cut(start, end, [*item.visuals, *item.shapes]),
        "contacts": joined("contact"),
        "equalities": joined("equality"),
    }
    own = f'"{escape(name)}/'
    marked = {key: Markup(value.replace(own, f'"{PREFIX}')) for key, value in values.items()}
    own_files = [file for mesh in used if (file := mesh.attributes.get("file"))]
    piece = Piece("saved.xml.j2", marked, {file: files[file] for file in own_files}, dict(hulls.values()))
    return Part(name, piece, text.cut(item.start, start) if item.tag == "frame" else "")


def _inside(text: _Text, item: _Element) -> tuple[int, int]:
    """Where the bodies are: within the frame, if there is one."""
    if item.tag != "frame":
        return item.start, item.end
    start = item.start + text.cut(item.start, item.end).index(">") + 1
    return start, start + len(text.cut(start, item.end).rpartition("</")[0].rstrip().encode())


def _solid_line(text: _Text, mesh: _Element, hull: tuple[str, bytes] | None) -> str:
    """A mesh that can be hit; its points are in a file."""
    if hull is None:
        return text.line(mesh)
    return f'\n    <mesh name="{escape(mesh.attributes["name"])}" file="{hull[0]}"/>'
